//! The force balance: the position predicted from the chamber pressures as measured (3.8 to 3.12).

use super::in_turns::{Prediction, halves, in_turns};
use super::judged::judged;
use crate::constants;
use crate::data::record::{Moment, Record};
use crate::data::smoothing::Smoothed;
use crate::data::split::{Stretch, samples};
use plant_model::friction::{Level, Response};
use plant_model::{Plant, Side, State};

/// Whether one of two velocities means rest and the other motion.
fn at_odds(v: f64, measured: f64, at_rest: f64) -> bool {
    let (slower, faster) = if v.abs() < measured.abs() { (v, measured) } else { (measured, v) };
    slower.abs() < at_rest && faster.abs() > 2.0 * at_rest
}

/// Prediction errors of the position in units of its noise: one for each row of the stretches.
///
/// `forces` are those within the stretches. `added_n` is a force in addition to the model's, one value per sample, that
/// opposes positive motion; empty for none.
///
/// The first and the second half of the stretches run [in turns](super::in_turns).
pub(crate) fn innovations(
    record: &Record,
    plant: &Plant<f64>,
    forces: &Forces,
    added_n: &[f64],
    stretches: &[Stretch],
) -> Vec<f64> {
    in_turns(halves(stretches).map(|part| Motion::new(record, plant, forces, added_n, part))).concat()
}

/// The prediction of the position over some stretches, one sample after the other.
struct Motion<'a> {
    record: &'a Record,
    plant: &'a Plant<f64>,
    forces: &'a Forces,
    added_n: &'a [f64],
    timing: Timing,
    /// One over the standard deviation of an error, 1/m.
    inverse_sigma: f64,
    /// Up to this speed the piston may be at rest, m/s.
    at_rest: f64,
    /// What is shown at the position zero: subtracted to turn a difference of shown positions into one of true positions.
    zero: f64,
    /// The stretch at hand, the place of its first sample among the forces, and the stretches behind it.
    stretch: Stretch,
    first: usize,
    stretches: &'a [Stretch],
    /// From here on errors are judged, s.
    settled: f64,
    /// The sample at hand.
    k: usize,
    force: Driving,
    piston: Piston,
    /// A prediction that breaks away before the real piston waits until that one moves.
    waits: bool,
    errors: Vec<f64>,
}

impl<'a> Motion<'a> {
    /// Before the first sample of some stretches; second, its place among the forces.
    fn new(
        record: &'a Record,
        plant: &'a Plant<f64>,
        forces: &'a Forces,
        added_n: &'a [f64],
        (stretches, first): (&'a [Stretch], usize),
    ) -> Self {
        let between_rows_m = 0.5 * constants::unseen_acceleration() * record.quality.interval_s.powi(2);
        let sigma = record.quality.position.standard_deviation.max(constants::numerical_error_m()).max(between_rows_m);
        let mut out = Self {
            record,
            plant,
            forces,
            added_n,
            timing: Timing::of(plant),
            inverse_sigma: 1.0 / (sigma * record.observer_noise),
            at_rest: at_rest_m_per_s(record),
            zero: plant.true_position_m(0.0),
            stretch: Stretch { start: 0, end: 0, held_back: false },
            first,
            stretches,
            settled: 0.0,
            k: 0,
            force: Driving { force_n: 0.0, p_a_pa: 0.0, p_b_pa: 0.0 },
            piston: Piston { y: 0.0, v: 0.0, z: 0.0 },
            waits: false,
            errors: Vec::with_capacity(samples(stretches)),
        };
        out.next_stretch();
        out
    }

    /// Goes on to the next stretch.
    fn next_stretch(&mut self) {
        self.first += self.stretch.range().len();
        let Some((stretch, rest)) = self.stretches.split_first() else {
            self.k = self.stretch.end;
            return;
        };
        (self.stretch, self.stretches, self.k) = (*stretch, rest, stretch.start);
        self.settled = self.record.t_s[stretch.start] + constants::settling_s();
        self.waits = false;
        self.restart();
    }

    /// Goes on from the measured motion at the sample at hand.
    fn restart(&mut self) {
        self.force = self.driving(self.k);
        self.piston = Piston::start(self.record, self.at_rest, self.plant, &self.force, self.k);
    }

    /// What drives the piston at a sample of the stretch at hand.
    #[inline(always)]
    fn driving(&self, k: usize) -> Driving {
        let added = added_at(self.record, &self.timing, self.added_n, &self.stretch, k);
        let shown = [self.record.motion.value[k], self.record.motion.slope[k]];
        driving(self.plant, self.forces, self.first + k - self.stretch.start, shown, added)
    }
}

impl Prediction for Motion<'_> {
    #[inline(always)]
    fn goes_on(&self) -> bool {
        self.k < self.stretch.end
    }

    #[inline(always)]
    fn step(&mut self) {
        let Self { record, plant, inverse_sigma, at_rest, zero, k, .. } = *self;
        let omega = record.observer_rad_per_s;
        let row = record.is_row(k);
        self.k += 1;
        let is_last = self.k == self.stretch.end;
        if record.at_end[k] {
            // Follow the measurement until the piston has left the end for good.
            if row {
                self.errors.push(f64::NAN);
            }
            if is_last {
                self.next_stretch()
            } else {
                self.restart()
            }
            return;
        }
        // Between rows nothing was measured, and nothing is corrected.
        let error = if row { record.y_m[k] - plant.shown_position_m(self.piston.y) } else { 0.0 };
        // The same error as a true distance.
        let behind = plant.true_position_m(error) - zero;
        if row {
            self.errors.push(if record.t_s[k] >= self.settled { judged(error * inverse_sigma) } else { f64::NAN });
        }
        if is_last {
            self.next_stretch();
            return;
        }
        let w = omega * if row { record.to_next_row_s(k) } else { 0.0 };
        self.piston.y += behind * (core::f64::consts::SQRT_2 * w).min(0.5);
        let measured_v = plant.true_position_m(record.motion.slope[k]) - zero;
        if self.waits {
            self.force = self.driving(k + 1);
            self.waits = measured_v.abs() < 2.0 * at_rest;
            if !self.waits {
                self.piston = Piston::start(record, at_rest, plant, &self.force, k + 1);
            }
            return;
        }
        // Not at rest: corrections by noise would make the bristles of a resting piston break away too early.
        if self.piston.v.abs() > at_rest || measured_v.abs() > at_rest {
            self.piston.v += behind * omega * w;
        }
        let next = self.driving(k + 1);
        if error.abs() * inverse_sigma > constants::mispredicted() && at_odds(self.piston.v, measured_v, at_rest) {
            // The piston broke away or came to rest at another time than predicted. The innovations so far have
            // counted that once; the prediction goes on from the measured motion.
            self.piston = Piston::start(record, at_rest, plant, &next, k + 1);
            self.waits = measured_v.abs() < at_rest;
        } else {
            let mean = self.force.mean_to(&next, self.forces.bend_n(plant, self.first + k - self.stretch.start));
            self.piston.step(plant, &mean, record.interval_s(k));
        }
        self.force = next;
    }

    fn errors(self) -> Vec<f64> {
        self.errors
    }
}

/// The added force at a sample, N; 0 where none is added.
pub(super) fn added_at(record: &Record, timing: &Timing, added_n: &[f64], stretch: &Stretch, k: usize) -> f64 {
    if added_n.is_empty() {
        return 0.0;
    }
    timing.moment(record, stretch, k).map_or_else(|| added_n[k], |moment| moment.of(added_n))
}

/// What drives the piston at one instant.
#[derive(Clone, Copy)]
pub(super) struct Driving {
    /// Net force apart from friction, N.
    pub(super) force_n: f64,
    pub(super) p_a_pa: f64,
    pub(super) p_b_pa: f64,
}

impl Driving {
    /// The mean from here to the next instant, where the force's mean is so much more than that of a straight line.
    fn mean_to(&self, next: &Self, bend_n: f64) -> Self {
        Self {
            force_n: 0.5 * (self.force_n + next.force_n) + bend_n,
            p_a_pa: 0.5 * (self.p_a_pa + next.p_a_pa),
            p_b_pa: 0.5 * (self.p_b_pa + next.p_b_pa),
        }
    }
}

/// Lag and delay of the sensors, by which pressures and position are brought to the same time.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Timing {
    pressure_lag_s: f64,
    position_delay_s: f64,
}

impl Timing {
    pub(crate) fn of(plant: &Plant<f64>) -> Self {
        Self { pressure_lag_s: plant.added().pressure_lag.time_constant_s, position_delay_s: plant.position_delay_s() }
    }

    /// The moment at which the position of a sample was true: a delayed position belongs to earlier pressures. `None`
    /// without a delay.
    fn moment(&self, record: &Record, stretch: &Stretch, k: usize) -> Option<Moment> {
        (self.position_delay_s > 0.0).then(|| record.moment(k, -self.position_delay_s, stretch.range()))
    }
}

/// Forces and pressures at the samples of some stretches, in order, sensors' offsets included.
pub(crate) struct Forces {
    p_a_pa: Vec<f64>,
    p_b_pa: Vec<f64>,
    /// [`Record::bend_pa`] of both chambers.
    bends_pa: Vec<[f64; 2]>,
    /// Empty if not measured.
    external_n: Vec<f64>,
}

impl Forces {
    /// The bends of the pressures behind a place as a force, N.
    fn bend_n(&self, plant: &Plant<f64>, place: usize) -> f64 {
        let [a, b] = self.bends_pa[place];
        a * plant.area_m2(Side::A) - b * plant.area_m2(Side::B)
    }
}

/// The measured pressures with the sensor's lag undone, and the measured force, within some stretches.
pub(crate) fn forces(record: &Record, timing: &Timing, stretches: &[Stretch]) -> Forces {
    let count = samples(stretches);
    let measured = if record.available.force { count } else { 0 };
    let mut out = Forces {
        p_a_pa: Vec::with_capacity(count),
        p_b_pa: Vec::with_capacity(count),
        bends_pa: Vec::with_capacity(count),
        external_n: Vec::with_capacity(measured),
    };
    for stretch in stretches {
        for k in stretch.range() {
            let late = timing.moment(record, stretch, k);
            let at = |x: &[f64]| late.as_ref().map_or_else(|| x[k], |moment| moment.of(x));
            let pressure = |smooth: &Smoothed| at(&smooth.value) + timing.pressure_lag_s * at(&smooth.slope);
            out.p_a_pa.push(pressure(&record.p_a_smooth));
            out.p_b_pa.push(pressure(&record.p_b_smooth));
            out.bends_pa.push([Side::A, Side::B].map(|side| record.bend_pa(side, k)));
            if measured > 0 {
                out.external_n.push(at(&record.f_ext_n));
            }
        }
    }
    out
}

/// What drives the piston at sample `k` of a stretch, which is number `place` of the forces.
pub(super) fn driving(
    plant: &Plant<f64>,
    forces: &Forces,
    place: usize,
    [y_m, v_m_per_s]: [f64; 2],
    added_n: f64,
) -> Driving {
    let p_a_pa = plant.pressure_behind_lag_pa(Side::A, forces.p_a_pa[place]);
    let p_b_pa = plant.pressure_behind_lag_pa(Side::B, forces.p_b_pa[place]);
    let external = forces.external_n.get(place).copied().unwrap_or(0.0);
    let force_n = plant.net_force_n(y_m, v_m_per_s, p_a_pa, p_b_pa) - added_n + external;
    Driving { force_n, p_a_pa, p_b_pa }
}

/// The speed in m/s up to which a piston may be at rest.
pub(crate) fn at_rest_m_per_s(record: &Record) -> f64 {
    constants::rest_sigmas() * record.velocity_error_m_per_s()
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
struct Piston {
    y: f64,
    v: f64,
    z: f64,
}

impl Piston {
    /// The initial state at a sample, with the speed in m/s up to which it may be at rest.
    fn start(record: &Record, at_rest: f64, plant: &Plant<f64>, drive: &Driving, k: usize) -> Self {
        let v_m_per_s = plant.true_position_m(record.motion.slope[k]) - plant.true_position_m(0.0);
        let y = plant.true_position_m(record.motion.value[k]);
        let state = State { y_m: y, v_m_per_s, p_a_pa: drive.p_a_pa, p_b_pa: drive.p_b_pa, ..State::default() };
        let (v, z) = restarted(at_rest, plant, &state, || drive.force_n);
        Self { y, v, z }
    }

    /// One interval. While the bristles are still bending the step must resolve them; once they are fully bent they
    /// follow the velocity, and the method's stability allows the whole interval at once.
    fn step(&mut self, plant: &Plant<f64>, drive: &Driving, dt: f64) {
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

/// Whether the piston moves for long enough that its mechanics can be judged. A piston at rest does not follow the
/// noise of the measured pressures, but its prediction does: an effect that suppresses this noise would look like a
/// cause.
pub(crate) fn moves(record: &Record) -> bool {
    let at_rest = at_rest_m_per_s(record);
    let moving = record.rows.iter().filter(|k| record.motion.slope[**k].abs() > at_rest).count();
    moving as f64 * record.quality.interval_s >= constants::least_motion_s()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::between::follow_the_flow;
    use crate::balances::simulated::{every_other, simulated};
    use crate::data::grid::{Between, refined};
    use crate::data::prepare::prepare;
    use plant_model::Effect;
    use rand::SeedableRng;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand_distr::{Distribution, StandardNormal};
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

    #[test]
    fn the_mass_that_predicts_best_is_the_true_one_to_a_percent_in_rows_of_2_ms() {
        let mut file = RigFile::paper_c();
        file.rig.load.mass_kg = 1.0;
        let multisine = |t_s: f64| {
            // A command for two milliseconds each, and a row of the log when it changes.
            let held_s = (0.5e3 * t_s + 1.0e-6).floor() * 2.0e-3;
            [9.0, 31.0, 57.0, 88.0].iter().map(|w: &f64| 0.4 * (w * held_s + w).sin()).sum()
        };
        let mut log = every_other(&simulated(&file, &file.effects, 8001, multisine));
        let mut draws = StandardNormal.sample_iter(Xoshiro256PlusPlus::seed_from_u64(5));
        let mut noisy = |signal: &mut Vec<f64>, noise: f64| {
            signal.iter_mut().zip(&mut draws).for_each(|(x, e): (&mut f64, f64)| *x += noise * e);
        };
        noisy(&mut log.y_m, 2.0e-6);
        [&mut log.p_a_pa, &mut log.p_b_pa].into_iter().flatten().for_each(|p_pa| noisy(p_pa, 60.0));
        let plant = Plant::new(&file.rig, &file.effects).expect("a sound rig");
        let mut record = refined(prepare(&log, &file), Between::Held);
        follow_the_flow(&mut record, &plant);
        let cost = |scale: f64| {
            let mut file = file.clone();
            file.rig.load.mass_kg *= scale;
            let plant = Plant::new(&file.rig, &file.effects).expect("a sound rig");
            let forces = forces(&record, &Timing::of(&plant), &record.stretches);
            let errors = innovations(&record, &plant, &forces, &[], &record.stretches);
            errors.iter().filter(|e| !e.is_nan()).map(|e| e * e).sum::<f64>()
        };
        let best = (-80..=80).map(|k| 1.0 + 5.0e-4 * f64::from(k)).min_by(|a, b| cost(*a).total_cmp(&cost(*b)));
        let best = best.expect("many masses");
        // 1.1 % too small; 2.1 % where pressures go straight from row to row or are smoothed with the piston's motion in them, 3.1 %
        // where both.
        assert!((best - 1.0).abs() < 1.1e-2, "{best}");
    }
}
