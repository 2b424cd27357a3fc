//! Learning: valve gain, dead zone, lag, load, friction and mass, slowly, within bounds, and only where the motion shows them.
//!
//! Each is a step of least mean squares (Åström and Wittenmark 1995, 2.5): the error, times the regressor, over one plus
//! its square. The errors are the innovation of the force, which the valve explains, and the disturbance, which load, friction
//! and mass explain.

use super::air::Air;
use super::inversion::ValveModel;
use super::observer::{Body, Estimate, Innovation};
use super::tuning::Tuning;
use control::Quantity;
use control::servo::constants::{GAIN_ANGLE, LEARN, LOAD_RATE, MASS_PART, SLIDING, TURNING, ZONE_V};

/// Lowest and highest value ever learned.
fn limits(quantity: Quantity, nominal: f64) -> [f64; 2] {
    quantity.limits().map_or([f64::NEG_INFINITY, f64::INFINITY], |limits| limits.map(|part| part * nominal))
}

/// The spool's lag as learned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lag {
    /// The lag, s.
    pub seconds: f64,
    theta: f64,
    turn: f64,
}

impl Lag {
    /// The nominal lag.
    #[must_use]
    pub fn of(tuning: &Tuning) -> Self {
        Self { seconds: tuning.lag_s, ..Self::default() }
    }

    /// A spool slower than modelled leaves the force behind by `slope * angle' * error of the lag`.
    pub fn learn(&mut self, innovation: &Innovation, theta: f64, slope: f64, tuning: &Tuning) {
        let t = tuning.tick_s;
        let turn = (theta - self.theta) / t;
        self.theta = theta;
        // The innovation is the model's error behind the correction's own lag; so is what it is compared with.
        self.turn += (t * tuning.force_rate).min(1.0) * (turn - self.turn);
        let wrong = tuning.force_rate * innovation.force / slope;
        let part = self.turn / (self.turn * self.turn + TURNING * TURNING);
        let [least, most] = limits(Quantity::Lag, tuning.lag_s);
        self.seconds = (self.seconds - LEARN[1] * t * wrong * part).clamp(least, most);
    }
}

/// The valve's gain and dead zone, from what one tick shows.
pub fn learn_valve(valve: &mut ValveModel, innovation: &Innovation, theta: f64, air: &Air, tuning: &Tuning) {
    let t = tuning.tick_s;
    let [gain_rate, zone_rate, _] = tuning.learn;
    let side = usize::from(theta < 0.0);
    let slope = valve.slope(theta, air);
    // A wrong rate of force stands as an innovation of that rate over the correction's.
    let rate = tuning.force_rate * innovation.force;
    let (w, volts_per_rad) = valve.known.voltage(theta);
    if theta.abs() > GAIN_ANGLE {
        let wrong = rate / (slope * theta) * valve.gain[side];
        let [least, most] = limits(Quantity::FlowRight, 1.0);
        valve.gain[side] = (valve.gain[side] + gain_rate * t * wrong).clamp(least, most);
    } else if w.abs() < ZONE_V && theta != 0.0 {
        let wrong_v = rate / slope * volts_per_rad;
        let zone = if side == 0 { &mut valve.right } else { &mut valve.left };
        let outward = if side == 0 { wrong_v } else { -wrong_v };
        let [least, most] = limits(Quantity::ZoneRight, tuning.zone_v[side]);
        *zone = (*zone - zone_rate * t * outward).clamp(least, most);
    }
}

/// Coulomb friction that is less than what is compensated, which a limit cycle shows: its speed is too low to learn from.
pub fn unlearn_friction(body: &mut Body, tuning: &Tuning) {
    body.coulomb = (body.coulomb * (1.0 - tuning.unlearn)).max(limits(Quantity::Coulomb, tuning.coulomb)[0]);
}

/// The law's bandwidth, less where a limit cycle goes on: the rig answers later than its file says, by hoses or a sensor's filter.
pub fn slow_down(bandwidth: &mut f64, tuning: &Tuning) {
    *bandwidth = (*bandwidth * (1.0 - tuning.unlearn)).max(limits(Quantity::Bandwidth, 1.0)[0]);
}

/// The load, from what the disturbance of one tick shows `beyond` it, N. Over moves both ways that is the load alone, because friction
/// changes its sign. What friction would have to leave its bounds for is load at once.
fn learn_load(load: &mut f64, beyond: f64, friction_is_at_its_end: bool, tuning: &Tuning) {
    let rate = if friction_is_at_its_end { tuning.slow_learn } else { LOAD_RATE };
    let [least, most] = tuning.load_bounds;
    *load = (*load + tuning.tick_s * rate * beyond).clamp(least, most);
}

/// Load, friction and mass, from what the disturbance of one tick shows. `approaches` says that the piston moves towards a target
/// that stands.
pub fn learn_body(body: &mut Body, estimate: &mut Estimate, approaches: bool, tuning: &Tuning) {
    let side = estimate.v.signum();
    let beyond = estimate.disturbance - estimate.load;
    let [least, most] = limits(Quantity::Coulomb, tuning.coulomb);
    if estimate.v.abs() < SLIDING {
        // Slow motion meets Coulomb friction alone. It is learned before the piston stands: too much of it is a limit cycle. Where
        // the piston slips, what seems to be too little may be static friction.
        let step = -tuning.slow_learn * tuning.tick_s * side * beyond;
        if approaches && !(tuning.stick_slip && step > 0.0) {
            let before = body.coulomb;
            let asked = before + step;
            body.coulomb = asked.clamp(least, most);
            learn_load(&mut estimate.load, beyond, body.coulomb != asked, tuning);
            estimate.disturbance += side * (body.coulomb - before);
        }
        return;
    }
    // In parts of the nominal Coulomb force, along the motion.
    let unit = tuning.coulomb * side;
    let wrong = -beyond / unit;
    let viscous = tuning.viscous * estimate.v / unit;
    let inert = tuning.mass * estimate.a / unit;
    let step = tuning.learn[2] * tuning.tick_s * wrong;
    let friction_step = step / (1.0 + viscous * viscous);
    let mass_step = MASS_PART * step * inert / (1.0 + inert * inert);
    let learned = |value: f64, step: f64, nominal: f64, quantity: Quantity| {
        let [least, most] = limits(quantity, nominal);
        (value + step * nominal).clamp(least, most)
    };
    let before = *body;
    let asked = before.coulomb + friction_step * tuning.coulomb;
    body.coulomb = asked.clamp(least, most);
    learn_load(&mut estimate.load, beyond, body.coulomb != asked, tuning);
    body.viscous = learned(before.viscous, friction_step * viscous, tuning.viscous, Quantity::Viscous);
    body.mass = learned(before.mass, mass_step, tuning.mass, Quantity::Mass);
    // What is now explained is no longer a disturbance.
    estimate.disturbance += (body.coulomb - before.coulomb) * side
        + (body.viscous - before.viscous) * estimate.v
        + (body.mass - before.mass) * estimate.a;
}
