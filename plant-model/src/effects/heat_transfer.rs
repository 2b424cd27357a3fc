use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::effect::Effect;
use super::identification::{Against, Balance, Balances, Confusion, Identification, Likeness, Picture};
pub(crate) use super::terms::NoTerms as Terms;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

pub(super) struct HeatTransfer;

impl Definition for HeatTransfer {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "heat-transfer",
        title: "Heat exchange with the walls",
        equation: "gamma := n in (3.6) and (3.7)",
        signature: "pressure changes by motion and by flow are smaller by n/gamma at all positions alike",
        source: "polytropic process; Carneiro and de Almeida 2006",
        parameters: &[ParameterInfo {
            name: "exponent",
            key: "effects.heat-transfer.exponent",
            min: 1.0,
            max: 1.67,
            typical: 1.15,
            meaning: "polytropic exponent n",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        confused_with: &[Confusion {
            with: Effect::DeadVolume,
            kind: Likeness::Near,
            experiment: Some(
                "Repeat fast strokes near both ends and in the middle: a dead volume matters most where the chamber is \
                 smallest, heat exchange everywhere alike.",
            ),
        }],
        ..Identification::on(
            Balances::MASS,
            &[
                Picture::new(
                    Balance::MassA,
                    Against::Velocity,
                    "A pressure that reacts less to compression than it should: added volume, or heat exchanged with the walls.",
                ),
                Picture::new(
                    Balance::MassB,
                    Against::Velocity,
                    "A pressure that reacts less to compression than it should: added volume, or heat exchanged with the walls.",
                ),
            ],
        )
    };

    fn neutral<R: Real>(rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [rig.gas.heat_capacity_ratio, R::ZERO, R::ZERO]
    }

    /// Walls take heat from air that is compressed and give it back: that is between isothermal and adiabatic.
    fn most(rig: &Rig<f64>) -> [f64; MAX_PARAMETERS] {
        [rig.gas.heat_capacity_ratio, 0.0, 0.0]
    }

    fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
        model.exponent = values[0];
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "Pressures react as if the gas exchanged heat with the walls: polytropic exponent {:.3} instead of 1.4",
            values[0]
        )
    }
}
