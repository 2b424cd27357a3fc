use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::effect::Effect;
use super::identification::{Against, Balance, Balances, Confusion, Identification, Likeness, Picture, StartContext};
pub(crate) use super::terms::NoTerms as Terms;
use crate::coefficients::{Coefficients, ValvePaths};
use crate::hose::Throttle;
use crate::real::Real;
use core::fmt;

/// A line in series behind what lies between valve and chamber. It lets `1/ratio` of what the open valve fills through pass.
fn restrict<R: Real>(ratio: R, full_drop: R, valve: &mut ValvePaths<R>) {
    let is_there = ratio > R::ZERO;
    if !is_there {
        return;
    }
    let open = valve.fill * R::PI * R::HALF;
    valve.line = Some(Throttle::new(open, ratio, valve.critical_ratios.is_some(), full_drop));
}

pub(super) struct LineRestriction;

impl Definition for LineRestriction {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "line-restriction",
        title: "Line between valve and chamber throttles",
        equation: "valve and line in series by side: 1/beta + 1/beta_l instead of 1/beta, beta_l = (pi/2) beta_fill/ratio; under ISO 6358 1/C^3 + 1/C_l^3, b = 0.3",
        signature: "little is missing at small commands and more the wider the valve opens, both ways through the same line; the other chamber may be in order",
        source: "kinked hose, small fitting, flow-control valve; series of resistances by Beater 2007, section 4.4",
        parameters: &[
            ParameterInfo {
                name: "ratio_a",
                key: "effects.line-restriction.ratio_a",
                min: 0.0,
                max: 20.0,
                typical: 0.5,
                meaning: "conductance with which the fully open valve fills over that of the line to chamber A; 0: no restriction",
            },
            ParameterInfo {
                name: "ratio_b",
                key: "effects.line-restriction.ratio_b",
                min: 0.0,
                max: 20.0,
                typical: 0.5,
                meaning: "the same of chamber B",
            },
        ],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        starts_fitted: 2,
        // A kink throttles one line.
        parts: &[&[0], &[1]],
        confused_with: &[
            Confusion {
                with: Effect::OpeningCurve,
                kind: Likeness::Near,
                experiment: Some(
                    "Fill and exhaust each chamber in large steps to both sides: a valve's curve shows in both chambers at the same command, a line in its own chamber on both sides.",
                ),
            },
            Confusion {
                with: Effect::FillCoefficient,
                kind: Likeness::Near,
                experiment: Some(
                    "Step the command to a tenth and to the whole of the opening: a coefficient is off by the same part at both, a line throttles only the large one.",
                ),
            },
            Confusion {
                with: Effect::ExhaustCoefficient,
                kind: Likeness::Near,
                experiment: Some(
                    "Step the command to a tenth and to the whole of the opening: a coefficient is off by the same part at both, a line throttles only the large one.",
                ),
            },
        ],
        ..Identification::on(
            Balances::MASS,
            &[
                Picture::new(
                    Balance::MassA,
                    Against::Command,
                    "Flow of A that falls short the more the wider the valve opens, on both sides.",
                ),
                Picture::new(Balance::MassB, Against::Command, "The same of B."),
            ],
        )
    };

    fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
        let full_drop = (model.supply_pa - model.atmosphere_pa) / model.supply_pa;
        restrict(values[0], full_drop, &mut model.valve_a);
        restrict(values[1], full_drop, &mut model.valve_b);
    }

    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // A little in either line; or much in both or in one, where the flow has a limit.
        let ([a, b, _], [scale_a, scale_b, _]) = (context.neutral, context.scales);
        for (in_a, in_b) in [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0), (0.0, 2.0)] {
            begin(&[a + in_a * scale_a, b + in_b * scale_b]);
        }
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, _] = *values;
        let passes = |ratio: f64| 100.0 / (1.0 + ratio);
        match (a > 0.0, b > 0.0) {
            (true, false) => write!(f, "Through the line to A passes {:.0} % of the open valve's flow", passes(a)),
            (false, true) => write!(f, "Through the line to B passes {:.0} % of the open valve's flow", passes(b)),
            _ => write!(
                f,
                "Through the lines passes {:.0} % of the open valve's flow to A and {:.0} % to B",
                passes(a),
                passes(b)
            ),
        }
    }
}
