use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::identification::{Against, Balance, Balances, Identification, Only, Picture, StandsFor, StartContext};
pub(crate) use super::terms::NoTerms as Terms;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// A plainly visible shift of a break-point.
const VISIBLE_V: f64 = 0.3;
/// How far from the stated break-points fits begin: half of what dead zones of such valves measure.
const START_V: f64 = 0.2;

pub(super) struct ValveDeadZone;

impl Definition for ValveDeadZone {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "valve-dead-zone",
        title: "Valve dead zone other than stated",
        equation: "w = dead_zone(u; right_v, left_v)",
        signature: "flow starts at another command than the rig file says, in the mass balances of both chambers; never in the force balance; a null offset shifts both break-points the same way",
        source: "Valdiero et al. 2011 (3.1); Tao and Kokotovic 1996",
        parameters: &[
            ParameterInfo {
                name: "right_v",
                key: "effects.valve-dead-zone.right_v",
                min: -2.0,
                max: 2.0,
                typical: 0.3,
                meaning: "right break-point, V",
            },
            ParameterInfo {
                name: "left_v",
                key: "effects.valve-dead-zone.left_v",
                min: -2.0,
                max: 2.0,
                typical: -0.3,
                meaning: "left break-point, V, not above the right one",
            },
        ],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        stands_for: StandsFor::ValuesOf(&["valve.dead_zone_right_v", "valve.dead_zone_left_v"]),
        starts_fitted: 2,
        ordered: Some([0, 1]),
        ..Identification::on(
            Balances::MASS,
            &[
                Picture::new(
                    Balance::MassA,
                    Against::Command,
                    "A step beside zero is a dead zone that opens elsewhere than the rig file says.",
                )
                .only(Only::SmallCommand),
                Picture::new(
                    Balance::MassB,
                    Against::Command,
                    "A step beside zero is a dead zone that opens elsewhere than the rig file says.",
                )
                .only(Only::SmallCommand),
            ],
        )
    };

    fn neutral<R: Real>(rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [rig.valve.dead_zone_right_v, rig.valve.dead_zone_left_v, R::ZERO]
    }

    fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
        model.dead_zone.right_v = values[0].at_least(values[1]);
        model.dead_zone.left_v = values[1].at_most(values[0]);
    }

    // What is typical may be what the rig file states already, so the scale is no distance to it.
    fn scales(_rig: &Rig<f64>, _neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        [VISIBLE_V, VISIBLE_V, 1.0]
    }

    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // Where hardly any sample lies in the dead zone as stated, a small change shows nothing.
        let [right, left, _] = context.neutral;
        begin(&[right, left]);
        for [to_right, to_left] in [[1.0, -1.0], [1.0, 0.0], [0.0, -1.0], [1.0, 1.0], [-1.0, -1.0]] {
            begin(&[right + to_right * START_V, left + to_left * START_V]);
        }
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "Air starts to flow at {:+.3} V and {:+.3} V instead of where the rig file puts the dead zone",
            values[0], values[1]
        )
    }
}
