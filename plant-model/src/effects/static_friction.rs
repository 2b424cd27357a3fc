use super::definition::{Definition, Info, MAX_PARAMETERS, NEGLIGIBLE, Negligible, ParameterInfo, VISIBLE_PART, one};
use super::identification::{Against, Balance, Balances, Identification, Picture, StandsFor, StartContext};
pub(crate) use super::terms::NoTerms as Terms;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// Breakaway forces are told apart from this many standard deviations of the measured pressure force on.
const BREAKAWAY_SIGMAS: f64 = 3.0;
/// Breakaway forces from which fits begin, as factors on the nominal one, and the factor from one to the next.
const GRID: [f64; 2] = [0.7, 3.2];
const SPACING: f64 = 1.04;

pub(super) struct StaticFriction;

impl Definition for StaticFriction {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "static-friction",
        title: "Static friction changed",
        equation: "F_s := static_n",
        signature: "the force residual sits only around standstill: breakaway needs more force, sliding does not",
        source: "Stribeck curve (3.11); stiction after rest",
        parameters: &[ParameterInfo {
            name: "static_n",
            key: "effects.static-friction.static_n",
            min: 1.0e-3,
            max: 1.0e4,
            typical: 40.0,
            meaning: "static friction force F_s, N; taken as F_c where smaller",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        stands_for: StandsFor::ValuesOf(&["friction.static_n"]),
        starts_fitted: 3,
        starts_form_a_grid: true,
        smooth_at_neutral: false,
        ..Identification::on(
            Balances::FORCE,
            &[Picture::new(
                Balance::Force,
                Against::Velocity,
                "Errors only near standstill: breaking away takes another force than sliding.",
            )],
        )
    };

    fn neutral<R: Real>(rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [rig.friction.static_n, R::ZERO, R::ZERO]
    }

    fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
        model.static_n = values[0].at_least(model.coulomb_n);
    }

    /// The force of the supply on the larger side, the other side vented: a piston that holds against more never moves.
    fn most(rig: &Rig<f64>) -> [f64; MAX_PARAMETERS] {
        let area_m2 = rig.cylinder.area_a_m2.max(rig.cylinder.area_b_m2);
        one((rig.supply.pressure_pa - rig.supply.atmosphere_pa) * area_m2)
    }

    fn scales(_rig: &Rig<f64>, neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        one(VISIBLE_PART * neutral[0])
    }

    fn negligible(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        // A resting piston breaks away at the first noise that takes the force over its limit.
        scales.map(|scale| (BREAKAWAY_SIGMAS * context.log.force_noise_n).max(NEGLIGIBLE * scale))
    }

    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // Where a piston sticks and slips, each breakaway that comes at another moment puts a wall beside the right force,
        // and the valley between the walls is a few percent wide.
        let (nominal, bounds) = (context.neutral[0], context.bounds[0]);
        begin(&[nominal]);
        let mut factor = GRID[0];
        while factor < GRID[1] {
            let value = factor * nominal;
            if (bounds.min..=bounds.max).contains(&value) {
                begin(&[value]);
            }
            factor *= SPACING;
        }
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Breaking away from standstill takes {:.1} N, while sliding takes what it should", values[0])
    }
}
