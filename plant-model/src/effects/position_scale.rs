use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::identification::{Against, Balance, Balances, Identification, Needs, Picture, StartContext};
use super::terms::Term;
use crate::coefficients::Coefficients;
use crate::measurement::Measurement;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms<R> {
    /// Gain of the position sensor.
    pub scale: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn sense(&self, shown: &mut Measurement<R>) {
        shown.y_m = self.scale * shown.y_m;
    }

    #[inline(always)]
    fn true_position_m(&self, shown_m: R) -> R {
        shown_m / self.scale
    }
}

impl<R: Real> Default for Terms<R> {
    fn default() -> Self {
        Self { scale: R::ONE }
    }
}

pub(super) struct PositionScale;

impl Definition for PositionScale {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "position-scale",
        title: "Position sensor gain error",
        equation: "measured y = s y",
        signature: "velocity from the position sensor disagrees with the volume rate seen by the chamber pressures by a constant factor",
        source: "calibration of the position sensor",
        parameters: &[ParameterInfo {
            name: "scale",
            key: "effects.position-scale.scale",
            min: 0.2,
            max: 5.0,
            typical: 1.05,
            meaning: "sensor gain s",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        needs: Needs::AnyPressure,
        starts_fitted: 2,
        // Air and piston do not tell a position that reads too long from larger volumes and flows, a smaller mass, and bristles that
        // are softer and longer; only tolerances and the end stops do.
        moves_in_step: &[
            ("valve.fill_coefficient_kg_per_s_pa", -1),
            ("valve.exhaust_coefficient_kg_per_s_pa", -1),
            ("valve.fill_conductance_m3_per_s_pa", -1),
            ("valve.exhaust_conductance_m3_per_s_pa", -1),
            ("cylinder.volume_a0_m3", -1),
            ("cylinder.volume_b0_m3", -1),
            ("load.mass_kg", 1),
            ("friction.viscous_n_s_per_m", 1),
            ("friction.stiffness_n_per_m", 1),
            ("friction.damping_n_s_per_m", 1),
            ("friction.stribeck_velocity_m_per_s", -1),
            ("friction.breakaway_m", -1),
        ],
        ..Identification::on(
            Balances::MASS.and(Balances::FORCE),
            &[
                Picture::new(
                    Balance::MassA,
                    Against::Velocity,
                    "Compression that does not fit the motion read by the sensor.",
                ),
                Picture::new(Balance::Force, Against::Acceleration, "Motion that does not fit the force."),
            ],
        )
    };

    fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [R::ONE, R::ZERO, R::ZERO]
    }

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { scale: values[0] }
    }

    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // What it changes, other values can change as well, all in step: the misfit is a long, narrow, bent valley.
        let (neutral, bounds) = (context.neutral[0], context.bounds[0]);
        for percent in -10..=10 {
            begin(&[(neutral * (1.0 + 0.01 * f64::from(percent))).clamp(bounds.min, bounds.max)]);
        }
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "Positions read {:.2} % too {} for the volumes and forces they go with",
            (values[0] - 1.0).abs() * 100.0,
            if values[0] < 1.0 { "small" } else { "large" }
        )
    }
}
