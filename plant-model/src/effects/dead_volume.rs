use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo, one};
use super::identification::{Against, Balance, Balances, Identification, Picture, StandsFor};
pub(crate) use super::terms::NoTerms as Terms;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// A plainly visible volume, as a part of the chamber's.
const VISIBLE_VOLUME: f64 = 0.2;

pub(super) struct DeadVolume;

impl Definition for DeadVolume {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "dead-volume",
        title: "Unstated dead volume",
        equation: "V_a0 := V_a0 + V, V_b0 := V_b0 + V",
        signature: "pressures change too slowly by a factor that is largest where the chamber is smallest; flow at standstill and compression by motion are affected alike",
        source: "hoses and fittings between valve and cylinder",
        parameters: &[ParameterInfo {
            name: "volume_m3",
            key: "effects.dead-volume.volume_m3",
            min: 0.0,
            max: 1.0e-2,
            typical: 5.0e-5,
            meaning: "volume added to each chamber, m3",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        stands_for: StandsFor::AddedTo(&["cylinder.volume_a0_m3", "cylinder.volume_b0_m3"]),
        length_exponents: [-1, 0, 0],
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

    fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
        model.volume_a0_m3 += values[0];
        model.volume_b0_m3 += values[0];
    }

    fn scales(rig: &Rig<f64>, _neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        one(VISIBLE_VOLUME * rig.cylinder.volume_a0_m3)
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let than = if values[0] < 0.0 { "less than stated" } else { "more than stated (hoses, fittings)" };
        write!(f, "Both chambers hold {:.1} cm3 {than}", values[0].abs() * 1e6)
    }
}
