//! The piston through one interval of a log: sliding, sticking on elastic bristles, breaking away (3.8 to 3.12).

use super::force::Driving;
use crate::constants;
use crate::data::record::Record;
use plant_model::friction::{Level, Response};
use plant_model::{FirstOrderLag, Plant, State};

/// The speed in m/s up to which a piston may be at rest.
pub(crate) fn at_rest_m_per_s(record: &Record) -> f64 {
    constants::rest_sigmas() * record.velocity_error_m_per_s()
}

/// The same of the speed that a sensor would show without its lag.
pub(super) fn at_rest_ahead_m_per_s(record: &Record, lag: &FirstOrderLag<f64>) -> f64 {
    at_rest_m_per_s(record) * record.velocity_error_ahead(lag)
}

/// The same as a true speed of a plant.
pub(crate) fn truly_at_rest_m_per_s(record: &Record, plant: &Plant<f64>) -> f64 {
    let shown = at_rest_ahead_m_per_s(record, &plant.added().position_lag);
    plant.true_position_m(shown) - plant.true_position_m(0.0)
}

/// Velocity and bristle deflection of a piston at a state with a velocity as measured: the bristles of a moving piston are fully
/// bent, those of one that rests within the sensor's error (`at_rest_m_per_s`) hold the force `held_n`.
pub(crate) fn restarted(
    at_rest_m_per_s: f64,
    plant: &Plant<f64>,
    state: &State<f64>,
    held_n: impl FnOnce() -> f64,
) -> (f64, f64) {
    let (v, stiffness) = (state.v_m_per_s, plant.coefficients().stiffness);
    let limit = plant.friction_level(state).force_n / stiffness;
    if v.abs() > at_rest_m_per_s { (v, limit * v.signum()) } else { (0.0, (held_n() / stiffness).clamp(-limit, limit)) }
}

/// Position, velocity and bristle deflection.
pub(super) struct Piston {
    pub(super) y: f64,
    pub(super) v: f64,
    pub(super) z: f64,
}

impl Piston {
    /// The initial state at a sample, with the speed in m/s up to which it may be at rest.
    pub(super) fn start(record: &Record, at_rest: f64, plant: &Plant<f64>, drive: &Driving, k: usize) -> Self {
        let [y, v] = record.motion_ahead(k, &plant.added().position_lag);
        let v_m_per_s = plant.true_position_m(v) - plant.true_position_m(0.0);
        let y = plant.true_position_m(y);
        let state = State { y_m: y, v_m_per_s, p_a_pa: drive.p_a_pa, p_b_pa: drive.p_b_pa, ..State::default() };
        let (v, z) = restarted(at_rest, plant, &state, || drive.force_n);
        Self { y, v, z }
    }

    /// One interval. While the bristles are still bending the step must resolve them; once they are fully bent they
    /// follow the velocity, and the method's stability allows the whole interval at once.
    pub(super) fn step(&mut self, plant: &Plant<f64>, drive: &Driving, dt: f64) {
        let c = plant.coefficients();
        let friction = plant.friction();
        let least_n = plant.least_friction_level_n();
        // Whether the bristles hardly bend on some way, whatever the sliding force.
        let hardly = |way: f64| way * c.stiffness <= constants::bend_step() * least_n;
        let coasted = self.v.abs() * dt;
        if hardly(coasted) && friction.is_elastic(self.z, self.v) {
            let first = friction.elastic_response(self.z, self.v);
            let pushed_n = (drive.force_n - first.force_n).abs();
            // Elastic bristles stop what a force pushes, after an overshoot.
            if hardly(coasted + (0.5 * pushed_n * dt * dt / c.mass_kg).min(2.0 * pushed_n / c.stiffness)) {
                self.part(plant, drive, &first, dt);
                return;
            }
        }
        if !hardly(coasted)
            && let Some(after) = self.slid(plant, drive, dt)
        {
            *self = after;
            return;
        }
        let mut level = plant.friction_level(&self.state(drive));
        let limit = level.force_n / c.stiffness;
        let respond = |piston: &Self, level: &Level<f64>| friction.respond(piston.z, piston.v, level);
        let mut first = respond(self, &level);
        let bending = self.z * self.v.signum() < constants::fully_bent() * limit;
        if !bending && let Some(after) = self.bent(plant, drive, &first, dt) {
            *self = after;
            return;
        }
        // A light piston may turn round within an interval.
        let way = coasted + 0.5 * (drive.force_n - first.force_n).abs() * dt * dt / c.mass_kg;
        let parts = (way / (constants::bend_step() * limit)).ceil().clamp(1.0, constants::most_parts());
        for part in 0..parts as usize {
            if part > 0 {
                level = plant.friction_level(&self.state(drive));
                first = respond(self, &level);
            }
            self.part(plant, drive, &first, dt / parts);
        }
    }

    /// One interval of sliding, by the trapezoidal rule: bristles that run through their whole range hold the sliding
    /// force. `None` if the piston does not slide from beginning to end.
    fn slid(&self, plant: &Plant<f64>, drive: &Driving, dt: f64) -> Option<Self> {
        let c = plant.coefficients();
        let direction = self.v.signum();
        let fast = |v: f64| v * direction * plant.friction().inverse_stribeck_velocity > constants::sliding();
        if !fast(self.v) || self.v.abs() * dt * c.stiffness < plant.least_friction_level_n() {
            return None;
        }
        let half = 0.5 * dt / c.mass_kg;
        let damping = half * c.viscous;
        let ends = |friction_n: f64| {
            ((1.0 - damping) * self.v + 2.0 * half * (drive.force_n - direction * friction_n)) / (1.0 + damping)
        };
        let moved = |v: f64| Self { y: self.y + 0.5 * dt * (self.v + v), v, z: self.z };
        let before_n = c.stiffness * self.z * direction;
        let after_n = plant.friction_level(&moved(ends(before_n)).state(drive)).force_n;
        let bending = c.damping * (after_n - before_n) / (c.stiffness * dt);
        let v = ends(0.5 * (before_n + after_n) + bending);
        // The bristles must run through their range.
        if !fast(v) || self.v.abs().min(v * direction) * dt * c.stiffness < after_n {
            return None;
        }
        let mut after = moved(v);
        after.z = direction * after_n / c.stiffness;
        after.stop_at_ends(c.half_stroke_m);
        Some(after)
    }

    /// An end stop takes the velocity away.
    fn stop_at_ends(&mut self, limit: f64) {
        if self.y.abs() > limit && self.v * self.y > 0.0 {
            self.y = self.y.clamp(-limit, limit);
            self.v = 0.0;
        }
    }

    /// As the plant model knows it.
    fn state(&self, drive: &Driving) -> State<f64> {
        State {
            y_m: self.y,
            v_m_per_s: self.v,
            z_m: self.z,
            p_a_pa: drive.p_a_pa,
            p_b_pa: drive.p_b_pa,
            ..State::default()
        }
    }

    /// A part of an interval, with the friction at its start: velocity and bristles by an L-stable Rosenbrock method of
    /// order 2 (ROS2).
    fn part(&mut self, plant: &Plant<f64>, drive: &Driving, first: &Response<f64>, dt: f64) {
        const GAMMA: f64 = 1.0 - core::f64::consts::FRAC_1_SQRT_2;
        let solve = implicit(plant, first, GAMMA * dt);
        let k1 = solve(rates(plant, drive, first));
        let between = Self { y: self.y, v: self.v + dt * k1.0, z: self.z + dt * k1.1 };
        let f2 = rates(plant, drive, &plant.friction_at(&between.state(drive)));
        let k2 = solve((f2.0 - 2.0 * k1.0, f2.1 - 2.0 * k1.1));
        self.advance(plant, (1.5 * k1.0 + 0.5 * k2.0, 1.5 * k1.1 + 0.5 * k2.1), dt);
    }

    /// One interval with bristles that are fully bent from the start, with the friction there: they follow the velocity, so that
    /// nothing is stiff, and the linearly implicit midpoint rule, with half of the evaluations, is as accurate. `None` if the
    /// piston turns round.
    fn bent(&self, plant: &Plant<f64>, drive: &Driving, first: &Response<f64>, dt: f64) -> Option<Self> {
        let rates = implicit(plant, first, 0.5 * dt)(rates(plant, drive, first));
        let mut after = Self { ..*self };
        after.advance(plant, rates, dt);
        (after.v * self.v > 0.0).then_some(after)
    }

    /// Goes on with an acceleration and a rate of the bristles.
    fn advance(&mut self, plant: &Plant<f64>, (by_v, by_z): (f64, f64), dt: f64) {
        let v = self.v + dt * by_v;
        self.z += dt * by_z;
        self.y += 0.5 * dt * (self.v + v);
        self.v = v;
        self.stop_at_ends(plant.coefficients().half_stroke_m);
    }
}

/// The piston's acceleration and its bristles' rate.
#[inline(always)]
fn rates(plant: &Plant<f64>, drive: &Driving, friction: &Response<f64>) -> (f64, f64) {
    ((drive.force_n - friction.force_n) / plant.coefficients().mass_kg, friction.bristle_rate)
}

/// Solves `(1 - h J) k = f` for `k`, with the Jacobian `J` of [`rates`] by velocity and bristle deflection.
#[inline(always)]
fn implicit(plant: &Plant<f64>, friction: &Response<f64>, h: f64) -> impl Fn((f64, f64)) -> (f64, f64) {
    let c = plant.coefficients();
    let inverse_mass = 1.0 / c.mass_kg;
    let v_v = -(c.damping * friction.rate_by_velocity + c.viscous) * inverse_mass;
    let v_z = -(c.stiffness + c.damping * friction.rate_by_bristle) * inverse_mass;
    let (z_v, z_z) = (friction.rate_by_velocity, friction.rate_by_bristle);
    let (m00, m01, m10, m11) = (1.0 - h * v_v, -h * v_z, -h * z_v, 1.0 - h * z_z);
    let inverse = 1.0 / (m00 * m11 - m01 * m10);
    move |(a, b)| ((a * m11 - b * m01) * inverse, (b * m00 - a * m10) * inverse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant_model::Effect;
    use rig_files::RigFile;

    /// A stroke of 0.6 s against friction that ripples, driven by a force that turns round.
    fn stroke(v_m_per_s: f64, advance: impl Fn(&mut Piston, &Plant<f64>, &Driving)) -> (Vec<[f64; 2]>, usize) {
        let mut file = RigFile::paper_a();
        file.effects.set(Effect::FrictionPosition, &[0.2, 0.4, 0.02]);
        let plant = Plant::new(&file.rig, &file.effects).expect("a sound rig");
        let level_n = plant.friction_level(&State { v_m_per_s, ..State::default() }).force_n;
        let mut piston = Piston { y: 0.0, v: v_m_per_s, z: level_n / plant.coefficients().stiffness };
        let (mut out, mut slid) = (Vec::new(), 0);
        for k in 0..600 {
            let force_n = 40.0 + 90.0 * (0.02 * f64::from(k)).cos();
            let drive = Driving { force_n, p_a_pa: 4.0e5, p_b_pa: 3.5e5 };
            slid += usize::from(piston.slid(&plant, &drive, 1.0e-3).is_some());
            advance(&mut piston, &plant, &drive);
            out.push([piston.y, piston.v]);
        }
        (out, slid)
    }

    #[test]
    fn sliding_with_bent_bristles_is_what_resolved_bristles_do() {
        let (fast, slid) = stroke(0.25, |piston, plant, drive| piston.step(plant, drive, 1.0e-3));
        let (resolved, _) = stroke(0.25, |piston, plant, drive| {
            for _ in 0..500 {
                let first = plant.friction_at(&piston.state(drive));
                piston.part(plant, drive, &first, 2.0e-6);
            }
        });
        // Both ways of stepping took part.
        assert!((100..550).contains(&slid), "{slid}");
        for (k, ([y, v], [y_resolved, v_resolved])) in fast.iter().zip(&resolved).enumerate() {
            assert!((y - y_resolved).abs() < 1.0e-4, "{k}: {y} {y_resolved}");
            assert!((v - v_resolved).abs() < 5.0e-4, "{k}: {v} {v_resolved}");
        }
    }

    #[test]
    fn a_light_piston_that_turns_round_within_an_interval_does_what_resolved_bristles_do() {
        let mut file = RigFile::paper_a();
        file.rig.load.mass_kg = 1.4;
        let plant = Plant::new(&file.rig, &file.effects).expect("a sound rig");
        let drive = Driving { force_n: 90.0, p_a_pa: 4.0e5, p_b_pa: 3.5e5 };
        for v in [-0.05, -0.02, -0.005, 0.0] {
            let level_n = plant.friction_level(&State { v_m_per_s: v, ..State::default() }).force_n;
            let start = Piston { y: 0.0, v, z: -level_n / plant.coefficients().stiffness };
            let mut resolved = Piston { ..start };
            for _ in 0..1000 {
                let first = plant.friction_at(&resolved.state(&drive));
                resolved.part(&plant, &drive, &first, 2.0e-6);
            }
            let mut stepped = Piston { ..start };
            stepped.step(&plant, &drive, 2.0e-3);
            assert!((stepped.v - resolved.v).abs() < 1.0e-3, "{v}: {} {}", stepped.v, resolved.v);
        }
    }
}
