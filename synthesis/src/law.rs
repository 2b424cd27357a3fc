//! The control law of the synthetic rig: proportional with velocity feedback and dead-zone compensation, in `f64`.

use crate::physics::Physics;
use plant_model::Rig;

/// Gains and compensation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// V/m.
    pub position_gain: f64,
    /// V s/m.
    pub velocity_gain: f64,
    /// Break-points the compensation believes in, V.
    pub right_v: f64,
    /// As `right_v`, to the left.
    pub left_v: f64,
    /// Largest command, V.
    pub max_v: f64,
    /// Open loop reverses when the piston is this far out, m.
    pub turn_back_m: f64,
}

/// Over this range of the uncompensated command the compensation fades in, V: without it, noise would chatter.
const FADE_V: f64 = 0.05;
/// Time constant of the velocity estimate, s.
const VELOCITY_FILTER_S: f64 = 0.02;

impl Law {
    /// Gains for a rig, from its linearisation about mid-stroke: an integrator behind a spring-mass whose spring is the
    /// air (`omega`) and whose damping is `sigma2 / M`. Velocity feedback adds stiffness and, through the lag of the
    /// velocity estimate, takes damping; it gets 0.4 of what would use the damping up. The proportional gain is
    /// `vigour` times half the one at which the loop begins to oscillate.
    #[must_use]
    pub fn for_rig(rig: &Rig<f64>, vigour: f64) -> Self {
        let physics = Physics::new(rig, &[]);
        let speed_per_volt = physics.opening_per_volt() * physics.speed_per_opening();
        let damping = rig.friction.viscous_n_s_per_m / rig.load.mass_kg;
        let area = rig.cylinder.mean_area_m2();
        let compliance = 1.0 / rig.cylinder.volume_a0_m3 + 1.0 / rig.cylinder.volume_b0_m3;
        let stiffness = rig.gas.heat_capacity_ratio * area * area * physics.rest_pressure_pa() * compliance;
        let lag = (stiffness / rig.load.mass_kg).sqrt() * VELOCITY_FILTER_S;
        let omega_squared = stiffness / rig.load.mass_kg;
        let limit = damping * (1.0 + lag * lag) / (omega_squared * VELOCITY_FILTER_S);
        let feedback = (0.4 * limit).min(2.0);
        Self {
            position_gain: (vigour * 0.5 * damping * (1.0 + feedback) / speed_per_volt).clamp(0.5, 40.0),
            velocity_gain: feedback / speed_per_volt,
            right_v: rig.valve.dead_zone_right_v,
            left_v: rig.valve.dead_zone_left_v,
            max_v: rig.valve.max_voltage_v,
            turn_back_m: 0.42 * rig.cylinder.stroke_m,
        }
    }
}

/// The law with its velocity estimate.
#[derive(Clone, Copy, Debug)]
pub struct Controller {
    law: Law,
    last: Option<(f64, f64)>,
    velocity: f64,
    /// Sign of the end the limit switches are turning away from, or zero.
    turned: f64,
}

impl Controller {
    /// At rest.
    #[must_use]
    pub fn new(law: Law) -> Self {
        Self { law, last: None, velocity: 0.0, turned: 0.0 }
    }

    /// The command at time `t` for a measured position.
    pub fn command_v(&mut self, t_s: f64, y_m: f64, demand: &crate::Demand) -> f64 {
        if let Some((t, y)) = self.last
            && t_s > t
        {
            let dt = t_s - t;
            let share = dt / (dt + VELOCITY_FILTER_S);
            self.velocity += share * ((y_m - y) / dt - self.velocity);
        }
        self.last = Some((t_s, y_m));
        let law = &self.law;
        let command = match demand.y_ref_m {
            Some(reference) => {
                let raw = law.position_gain * (reference - y_m) - law.velocity_gain * self.velocity;
                let fade = (raw.abs() / FADE_V).min(1.0);
                raw + fade * if raw >= 0.0 { law.right_v } else { law.left_v } + demand.added_v
            }
            None => {
                // Limit switches turn the motion round until the piston is half-way back.
                if !demand.guarded || y_m * self.turned < 0.5 * law.turn_back_m {
                    self.turned = 0.0;
                }
                if demand.guarded && y_m.abs() > law.turn_back_m {
                    self.turned = y_m.signum();
                }
                if demand.added_v * self.turned > 0.0 { -demand.added_v } else { demand.added_v }
            }
        };
        command.clamp(-law.max_v, law.max_v)
    }
}
