use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo, leak_scales};
use super::identification::{Against, Balance, Balances, Identification, Only, Picture};
use super::terms::{Chamber, ChamberFlow, Side, Term};
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
        if chamber.side == Side::B {
            sum.mass_flow -= self.conductance * (chamber.p_pa - chamber.atmosphere_pa);
            sum.by_chamber -= self.conductance;
        }
    }
}

pub(super) struct LeakChamberB;

impl Definition for LeakChamberB {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "leak-chamber-b",
        title: "Leak of chamber B to atmosphere",
        equation: "q = k (p - p_atm), out of the chamber",
        signature: "chamber B keeps losing mass while the valve is closed, in proportion to its gauge pressure; the other chamber gains nothing",
        source: "laminar seal or fitting leak; Beater 2007",
        parameters: &[ParameterInfo {
            name: "conductance_kg_per_s_pa",
            key: "effects.leak-chamber-b.conductance_kg_per_s_pa",
            min: 0.0,
            max: 1.0e-7,
            typical: 3.0e-10,
            meaning: "leak conductance k, kg/(s Pa)",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        length_exponents: [-1, 0, 0],
        ..Identification::on(
            Balances::MASS_B,
            &[
                Picture::new(
                    Balance::MassB,
                    Against::PressureB,
                    "Valve closed: a line through zero is a leak to atmosphere.",
                )
                .only(Only::ValveClosed),
                Picture::new(Balance::MassA, Against::PressureA, "Chamber A for comparison.").only(Only::ValveClosed),
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
            "Chamber B loses air to atmosphere even with the valve closed: {:.3} g/s at 1 bar gauge",
            values[0] * 1e8
        )
    }
}
