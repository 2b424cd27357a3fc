//! The positioning law in f64: the reference for the fixed-point law, and the place to try changes.
//!
//! ```text
//! target ─ stream ─ reference ─► law ─ inversion ─► command          one file each, named as in `control::servo`
//! ```
//!
//! Derivation, sources, measured tables and the whole picture: `docs/control-law.md`.

pub mod air;
pub mod bench;
pub mod cycle;
pub mod friction;
pub mod hold;
pub mod inversion;
pub mod learning;
pub mod margins;
pub mod observer;
pub mod reference;
pub mod stall;
pub mod stick;
pub mod stream;
pub mod tuning;

use air::Air;
use control::servo::constants::{
    CALM_JERK, DEAD_BAND_M, DEVIATION, FOLLOWED, LEAST_DRIVE, LEAST_LENGTH, MOST_SWINGS, MOST_THRESHOLD_SCALE,
    NOISE_RATE, PRESSURE_RATE, QUIET_UM, RESERVE, SLIPPING, STICK_SPEED, TICK_DELAY,
};
use cycle::Cycle;
use friction::Feedforward;
use hold::Hold;
use inversion::ValveModel;
use learning::Lag;
use observer::{Body, Estimate};
use plant_model::Rig;
use reference::{Limits, Motion};
use rig_files::tuning::Pneumatics;
use stall::Stall;
use std::collections::VecDeque;
use stick::Stick;
use stream::{Aim, Stream};
pub use tuning::Tuning;

/// What the sensors read in one tick, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Readings {
    /// Position, m.
    pub y: f64,
    /// Pressure of chamber A, Pa absolute; `None` where its sensor is lost or none is fitted.
    pub p_a: Option<f64>,
    /// Pressure of chamber B, Pa absolute; `None` where its sensor is lost or none is fitted.
    pub p_b: Option<f64>,
    /// Supply pressure, Pa absolute.
    pub p_sup: f64,
}

/// The law with its memory.
#[derive(Clone, Debug)]
pub struct Servo {
    /// Its constants.
    pub tuning: Tuning,
    /// The rig as it was told.
    pub rig: Rig<f64>,
    /// Its valve, hoses and chambers as the law knows them.
    pub known: Pneumatics,
    /// The rig as it was estimated.
    pub estimate: Estimate,
    /// Where the piston should be.
    pub motion: Motion,
    /// The valve as learned.
    pub valve: ValveModel,
    /// Friction and mass as learned.
    pub body: Body,
    /// Hold.
    pub hold: Hold,
    /// Lag of the spool as learned.
    pub lag: Lag,
    /// Bandwidth of the law, over that of its constants.
    pub bandwidth: f64,
    stream: Stream,
    stick: Stick,
    stall: Stall,
    swings: Cycle,
    /// The target in the last tick, m.
    target: f64,
    noise: f64,
    acting: f64,
    delayed: VecDeque<f64>,
    pressures: [f64; 3],
    samples: u32,
    unseen: bool,
    approaches: bool,
    feedforward: Feedforward,
}

impl Servo {
    /// At power-on.
    #[must_use]
    pub fn new(rig: &Rig<f64>, tuning: Tuning) -> Self {
        let [right, left] = tuning.zone_v;
        let known = Pneumatics::of(rig);
        let valve = ValveModel { right, left, gain: [1.0; 2], most: tuning.most_v, centre: tuning.centre_v, known };
        Self {
            rig: *rig,
            known,
            delayed: std::iter::repeat_n(tuning.centre_v, tuning.delay_ticks).collect(),
            estimate: Estimate { spool: tuning.centre_v, ..Estimate::default() },
            motion: Motion::default(),
            valve,
            body: Body { coulomb: tuning.coulomb_start * tuning.coulomb, viscous: tuning.viscous, mass: tuning.mass },
            hold: Hold::default(),
            lag: Lag::of(&tuning),
            bandwidth: 1.0,
            stream: Stream::default(),
            stick: Stick::default(),
            stall: Stall::default(),
            swings: Cycle::default(),
            target: 0.0,
            noise: 0.0,
            acting: tuning.centre_v,
            pressures: [0.0; 3],
            samples: 0,
            unseen: false,
            approaches: false,
            feedforward: Feedforward::default(),
            tuning,
        }
    }

    /// One tick: the command in V that acts from the next tick on.
    pub fn step(&mut self, target: f64, readings: &Readings) -> f64 {
        let tuning = self.tuning;
        let t = tuning.tick_s;
        let [area_a, area_b] = self.known.areas_m2;
        let rest = area_a * self.known.rest_pa[0] - area_b * self.known.rest_pa[1];
        let begins = self.samples == 0;
        self.samples = self.samples.saturating_add(1);
        if begins {
            (self.estimate.force, self.estimate.load) = (rest, -rest);
        }
        let seen = readings.p_a.zip(readings.p_b).map(|(p_a, p_b)| area_a * p_a - area_b * p_b);
        let force = seen.unwrap_or(self.estimate.force);
        let read = self.complete(readings);
        if begins {
            self.motion = Motion { y: readings.y, ..Motion::default() };
            self.stream = Stream::at(target);
            self.estimate = Estimate { y: readings.y, force, disturbance: -force, ..self.estimate };
            self.stall = Stall::at(readings.y, force);
            self.pressures = read;
            if seen.is_none() {
                self.body.coulomb = self.body.coulomb.min(tuning.unseen_coulomb);
            }
        }
        for (slow, now) in self.pressures.iter_mut().zip(read) {
            *slow += (t * PRESSURE_RATE).min(1.0) * (now - *slow);
        }
        // What the model made of an unmeasured force is no error of the valve: nothing is learned from it.
        if std::mem::replace(&mut self.unseen, seen.is_none())
            && let Some(force) = seen
        {
            self.estimate.take_force(force);
        }
        let air = self.air();
        let innovation = if self.samples <= tuning.standing_ticks {
            self.estimate.correct_standing(readings.y, force, self.samples)
        } else {
            self.estimate.correct(readings.y, force, &tuning)
        };
        self.delayed.push_back(self.acting);
        let acting = self.delayed.pop_front().unwrap_or(self.acting);
        let theta = self.estimate.predict(acting, &air, &self.valve, self.lag.seconds, &self.body, &tuning);
        if seen.is_none() {
            self.estimate.unseen_force(&tuning);
        }
        self.noise += NOISE_RATE * t * (DEVIATION * innovation.y.abs() - self.noise);
        let u = self.command(target, &air);
        self.acting = u;
        // Behind the command, as on the chip: what is learned counts from the next tick on.
        self.stall.see(self.estimate.y, self.estimate.force, &tuning);
        if self.hold.passed_again() {
            learning::unlearn_friction(&mut self.body, &tuning);
        }
        if self.swings.passed_more_than(MOST_SWINGS.into()) {
            learning::slow_down(&mut self.bandwidth, &tuning);
        }
        if seen.is_some() {
            self.lag.learn(&innovation, theta, self.valve.slope(theta, &air), &tuning);
            learning::learn_valve(&mut self.valve, &innovation, theta, &air, &tuning);
            if !self.stall.suspected(&tuning) {
                learning::learn_body(&mut self.body, &mut self.estimate, self.approaches, &tuning);
            }
            self.hold.learn_noise(innovation.force, &tuning);
        }
        u
    }

    /// The pressures, with those that are not measured from the modelled force.
    fn complete(&self, readings: &Readings) -> [f64; 3] {
        let (force, [area_a, area_b], [rest_a, rest_b]) =
            (self.estimate.force, self.known.areas_m2, self.known.rest_pa);
        let [atmosphere, p_sup] = [self.rig.supply.atmosphere_pa, readings.p_sup];
        let half = 0.5 * (force - (area_a * rest_a - area_b * rest_b));
        let (p_a, p_b) = (readings.p_a, readings.p_b);
        let [p_a, p_b] = [
            p_a.unwrap_or_else(|| p_b.map_or(rest_a + half / area_a, |p_b| (area_b * p_b + force) / area_a)),
            p_b.unwrap_or_else(|| p_a.map_or(rest_b - half / area_b, |p_a| (area_a * p_a - force) / area_b)),
        ];
        [p_a.clamp(atmosphere, p_sup.max(atmosphere)), p_b.clamp(atmosphere, p_sup.max(atmosphere)), p_sup]
    }

    fn command(&mut self, target: f64, air: &Air) -> f64 {
        // A noisier position is judged more coarsely.
        let least = if self.tuning.stick_slip { SLIPPING } else { 1.0 };
        let scale = (1e6 * self.noise / QUIET_UM).clamp(least, MOST_THRESHOLD_SCALE);
        let tuning = self.tuning.coarser(scale);
        let (t, w) = (tuning.tick_s, tuning.law_w * self.bandwidth);
        let estimate = self.estimate;
        let was_holding = self.hold.on;
        let Aim { motion: aim, jerk: aim_jerk, used, new, target } = self.stream.take(target, &tuning.limits, t);
        let followed = aim.v != 0.0 && used <= FOLLOWED;
        let friction = tuning.bristle_stiffness * estimate.bristle;
        if !followed {
            self.feedforward = Feedforward::at(friction);
        }
        let resting = (self.motion.y - target).abs() < DEAD_BAND_M && self.motion.v.abs() < STICK_SPEED && aim.v == 0.0;
        let error = target - estimate.y;
        // A model that slides while the piston sticks estimates a velocity that is none; the position's own does not.
        let v = if tuning.stick_slip { (self.hold.mean[0] - error) * tuning.hold_weights[0] / t } else { estimate.v };
        let frictions = [estimate.disturbance, self.body.coulomb];
        let holds = self.hold.decide(target, resting, [error, v, estimate.force], frictions, &tuning);
        let stays = aim.v == 0.0 && (target - self.target).abs() <= DEAD_BAND_M;
        self.target = target;
        self.swings.see(stays, self.hold.mean[0], tuning.hold_m[1]);
        self.approaches = aim.v == 0.0 && !holds && self.hold.mean[1].abs() > tuning.stick_speed;
        if holds {
            self.stick = Stick::default();
            let rate = self.hold.restoring_rate(&tuning);
            if rate == 0.0 {
                return self.valve.centre;
            }
            return self.valve.command(self.valve.angle_for(rate, air), tuning.blend);
        }
        if was_holding {
            self.motion = Motion { y: estimate.y, ..Motion::default() };
        }
        if let Some(rate) = self.stall.rate(error, estimate.force, &tuning) {
            self.motion = Motion { y: estimate.y, ..Motion::default() };
            return self.valve.command(self.valve.angle_for(rate, air), tuning.blend);
        }
        if let Some(rate) = self.stick.rate(resting, &self.hold.mean, estimate.force, &tuning) {
            self.motion = aim;
            return self.valve.command(self.valve.angle_for(rate, air), tuning.blend);
        }
        self.motion = self.motion.arrived(&aim, &tuning.limits, t);
        let r = self.motion;
        if (r.y - target).abs() < tuning.arrived_m {
            self.stream.arrive();
        }
        // Planned as seen from the moving target.
        let seen = Motion { y: r.y - aim.y, v: r.v - aim.v, a: r.a - aim.a };
        // A target that moves sets the pace itself, but for one that leaves the limits free.
        let part = self.bandwidth * self.valve.part_of_limits();
        let part = if aim.v == 0.0 || used <= part * FOLLOWED { part } else { 1.0 };
        let rest = |limit: f64, used: f64, least: f64| (part * (limit - used.abs())).max(least * limit);
        let still = aim.v == 0.0 && used == 0.0;
        let left = Limits {
            speed: rest(tuning.limits.speed, aim.v, 0.1),
            acceleration: rest(tuning.limits.acceleration, aim.a, 0.5),
            jerk: rest(if new { 1.0 } else { CALM_JERK } * tuning.limits.jerk, aim_jerk, 0.5),
        };
        let jerk_r = aim_jerk + seen.jerk_towards(0.0, &left, if still { RESERVE } else { 1.0 }, t);
        let jerk =
            jerk_r + 3.0 * w * (r.a - estimate.a) + 3.0 * w * w * (r.v - estimate.v) + w * w * w * (r.y - estimate.y);
        let rate = self.body.mass * jerk + air.stiffness * (estimate.v + tuning.lead_s * r.a);
        let most = self.valve.most_angle();
        // The friction of a target that is followed is known beforehand.
        let near = (r.y - estimate.y).abs() < tuning.near_m;
        let led = if followed && near {
            let coulomb = self.body.coulomb;
            let delay_s = self.lag.seconds + (tuning.delay_ticks as f64 + TICK_DELAY) * t;
            // The force travels by twice the friction at full flow; half of that before the target turns, half after it.
            let travel_s = coulomb / (self.valve.slope(aim.a, air) * most);
            let v_ahead = aim.v + (delay_s + travel_s) * aim.a;
            rate + self.feedforward.rate(v_ahead, friction, coulomb, delay_s, &tuning)
        } else {
            self.feedforward = Feedforward::at(friction);
            rate
        };
        let slope = self.valve.slope(led, air);
        let asked = led / slope;
        let theta = asked.clamp(-most, most);
        // What the valve cannot give, the reference does not ask for; the feedforward of friction is none of its motion. But one that
        // brakes near by would stop short and turn back.
        let missing = if theta == asked { 0.0 } else { (theta * slope - rate) / self.body.mass };
        let braking = near && aim.v == 0.0 && r.a * r.v.signum() < -tuning.braking;
        let brakes_harder = braking && r.v * missing < 0.0;
        let anti_windup = if brakes_harder || (missing < 0.0) != (theta >= 0.0) { 0.0 } else { missing };
        self.motion = r.after(jerk_r + anti_windup, t);
        self.valve.command(theta, tuning.blend)
    }

    fn air(&self) -> Air {
        let (gas, known) = (&self.rig.gas, &self.known);
        let [area_a, area_b] = known.areas_m2;
        let [v_a0, v_b0] = known.volumes_m3;
        let volumes = [
            (v_a0 + area_a * self.estimate.y).max(LEAST_LENGTH * v_a0),
            (v_b0 - area_b * self.estimate.y).max(LEAST_LENGTH * v_b0),
        ];
        let [p_a, p_b, p_sup] = self.pressures;
        let atmosphere = self.rig.supply.atmosphere_pa;
        let heat = gas.heat_capacity_ratio * gas.gas_constant_j_per_kg_k * gas.temperature_k;
        // Never zero, whatever a sensor says.
        let small = LEAST_DRIVE * p_sup.max(atmosphere);
        let p = [p_a, p_b];
        let slope = |fills: usize, empties: usize| {
            let fill = known.fill[fills] * known.filling_pa(p_sup, p[fills]).max(small);
            let exhaust = known.exhaust[empties] * known.exhausting_pa(p[empties], atmosphere).max(small);
            let areas = known.areas_m2;
            heat * (areas[fills] * fill / volumes[fills] + areas[empties] * exhaust / volumes[empties])
        };
        Air {
            stiffness: gas.heat_capacity_ratio
                * (area_a * area_a * p_a / volumes[0] + area_b * area_b * p_b / volumes[1]),
            slope_fill_a: slope(0, 1),
            slope_fill_b: slope(1, 0),
        }
    }
}
