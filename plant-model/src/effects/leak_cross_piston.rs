use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo, leak_scales};
use super::identification::{Against, Balance, Balances, Identification, Needs, Only, Picture};
use super::terms::{Chamber, ChamberFlow, Term};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Leak conductance, kg/(s Pa).
    pub conductance: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn is_present(&self) -> bool {
        self.conductance != R::ZERO
    }

    #[inline(always)]
    fn flow(&self, chamber: &Chamber<R>, sum: &mut ChamberFlow<R>) {
        if let Some(p_other_pa) = chamber.p_other_pa {
            sum.mass_flow -= self.conductance * (chamber.p_pa - p_other_pa);
            sum.by_chamber -= self.conductance;
            sum.by_other += self.conductance;
        }
    }
}

pub(super) struct LeakCrossPiston;

impl Definition for LeakCrossPiston {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "leak-cross-piston",
        title: "Leak across the piston seal",
        equation: "q = k (p_a - p_b), from A to B",
        signature: "both chambers drift towards each other while the valve is closed; what A loses B gains",
        source: "laminar piston seal leak; Beater 2007",
        parameters: &[ParameterInfo {
            name: "conductance_kg_per_s_pa",
            key: "effects.leak-cross-piston.conductance_kg_per_s_pa",
            min: 0.0,
            max: 1.0e-7,
            typical: 3.0e-10,
            meaning: "leak conductance k, kg/(s Pa)",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        needs: Needs::BothPressures,
        length_exponents: [-1, 0, 0],
        ..Identification::on(
            Balances::MASS,
            &[
                Picture::new(
                    Balance::MassA,
                    Against::Difference,
                    "Valve closed: a line through zero is air that crosses the piston; A loses what B gains.",
                )
                .only(Only::ValveClosed),
                Picture::new(
                    Balance::MassB,
                    Against::Difference,
                    "Valve closed: a line through zero is air that crosses the piston; A loses what B gains.",
                )
                .only(Only::ValveClosed),
            ],
        )
    };

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { conductance: values[0] }
    }

    fn scales(rig: &Rig<f64>, _neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        leak_scales(rig)
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "Air crosses the piston: {:.3} g/s at 1 bar difference; what one chamber loses the other gains",
            values[0] * 1e8
        )
    }
}
