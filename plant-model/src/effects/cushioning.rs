use super::definition::{Definition, Info, MAX_PARAMETERS, NEGLIGIBLE, Negligible, ParameterInfo};
use super::effect::Effect;
use super::identification::{
    Against, Balance, Balances, Bounds, Confusion, Identification, Likeness, Only, Picture, StartContext,
};
pub(crate) use super::terms::NoTerms as Terms;
use crate::coefficients::{Coefficients, ValvePaths};
use crate::hose::Throttle;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// A needle behind which `1/ratio` of what the open valve exhausts passes; none at a ratio of 0.
fn fit_cushion<R: Real>(length_m: R, ratio: R, full_drop: R, valve: &mut ValvePaths<R>) {
    let open = valve.exhaust * R::PI * R::HALF;
    let needle = || Throttle::new(open, ratio, valve.critical_ratios.is_some(), full_drop);
    valve.cushion = (ratio > R::ZERO).then(|| (length_m, needle()));
}

/// A step of the length that a fit feels, as a part of half the stroke: a tenth of the mouth of a common cushion.
const LENGTH_STEP: f64 = 2.0e-3;
/// Lengths from which fits begin, as parts of half the stroke: data sheets of strokes from 50 to 500 mm give 0.05 to 0.5.
/// A cushion acts within its length alone, so that each length is a minimum of its own.
const START_LENGTHS: [f64; 9] = [0.04, 0.07, 0.11, 0.16, 0.22, 0.29, 0.37, 0.46, 0.56];
/// Ratio from which fits begin: a needle a turn or two open.
const START_RATIO: f64 = 4.0;

pub(super) struct Cushioning;

impl Definition for Cushioning {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "cushioning",
        title: "Cushions at the ends of the stroke other than stated",
        equation: "nearer to a chamber's end than length_m, what flows out of it passes a needle in series with the valve, beta_n = (pi/2) beta_exh/ratio; over the first tenth of the length linear between both",
        signature: "exhaust is too slow on the last part of the stroke only, towards that end only; away from the end all is right",
        source: "adjustable pneumatic cushioning; Beater 2007, chapter 6",
        parameters: &[
            ParameterInfo {
                name: "length_m",
                key: "effects.cushioning.length_m",
                min: 0.0,
                max: 1.0,
                typical: 0.1,
                meaning: "length of the cushions, m; 0: the cushions of the rig file",
            },
            ParameterInfo {
                name: "ratio_a",
                key: "effects.cushioning.ratio_a",
                min: 0.0,
                max: 1000.0,
                typical: 4.0,
                meaning: "conductance with which the fully open valve exhausts over that of the needle at chamber A's end; 0: no cushion",
            },
            ParameterInfo {
                name: "ratio_b",
                key: "effects.cushioning.ratio_b",
                min: 0.0,
                max: 1000.0,
                typical: 4.0,
                meaning: "the same at chamber B's end",
            },
        ],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        length_exponents: [1, 0, 0],
        starts_fitted: 2,
        acts_locally: true,
        // A length means nothing without a needle.
        shape_only: &[0],
        parts: &[&[0, 1], &[0, 2]],
        confused_with: &[Confusion {
            with: Effect::LineRestriction,
            kind: Likeness::Near,
            experiment: Some(
                "Exhaust each chamber in large steps at mid-stroke and near its end: a line throttles everywhere, a cushion on its length only.",
            ),
        }],
        ..Identification::on(
            Balances::MASS,
            &[
                Picture::new(
                    Balance::MassA,
                    Against::Position,
                    "Exhaust that falls short from one position on to A's end.",
                )
                .only(Only::Exhausting),
                Picture::new(Balance::MassB, Against::Position, "The same towards B's end.").only(Only::Filling),
            ],
        )
    };

    fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        // No length stands for the rig's own cushions, if it has any.
        [R::ZERO; MAX_PARAMETERS]
    }

    fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
        let [length_m, ratio_a, ratio_b] = *values;
        if length_m > R::ZERO {
            let full_drop = (model.supply_pa - model.atmosphere_pa) / model.supply_pa;
            fit_cushion(length_m, ratio_a, full_drop, &mut model.valve_a);
            fit_cushion(length_m, ratio_b, full_drop, &mut model.valve_b);
        }
    }

    fn scales(rig: &Rig<f64>, _neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        let typical = Self::INFO.parameters[1].typical;
        [LENGTH_STEP * 0.5 * rig.cylinder.stroke_m, typical, typical]
    }

    fn negligible(_context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        scales.map(|scale| NEGLIGIBLE * scale)
    }

    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        let half_stroke_m = context.scales[0] / LENGTH_STEP;
        let Bounds { min, max } = context.bounds[0];
        for length in START_LENGTHS {
            begin(&[(length * half_stroke_m).clamp(min, max), START_RATIO, START_RATIO]);
        }
    }

    fn visible(_neutral: &[f64; MAX_PARAMETERS], scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        [0.3 * scales[0] / LENGTH_STEP, START_RATIO, START_RATIO]
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [length_m, a, b] = *values;
        let passes = |ratio: f64| 100.0 / (1.0 + ratio);
        write!(f, "On the last {:.1} mm ", length_m * 1e3)?;
        match (a > 0.0, b > 0.0) {
            (true, false) => write!(f, "towards A's end {:.0} % of the open valve's exhaust passes", passes(a)),
            (false, true) => write!(f, "towards B's end {:.0} % of the open valve's exhaust passes", passes(b)),
            _ => write!(
                f,
                "before the ends {:.0} % (A) and {:.0} % (B) of the open valve's exhaust passes",
                passes(a),
                passes(b)
            ),
        }
    }
}
