//! Learning: valve gain, dead zone, lag, load, friction and mass, slowly, within bounds, and only where the motion shows them.
//!
//! Each is a step of least mean squares (Åström and Wittenmark 1995, 2.5): the error, times the regressor, over one plus
//! its square. The errors are the innovation of the force, which the valve explains, and the disturbance, which load, friction
//! and mass explain.

use super::air::{Air, Areas};
use super::constants::{GAIN_ANGLE, LEARN, LOAD_RATE, MASS_PART, SLIDING, SLOW_LEARN, TURNING, UNLEARN, ZONE_V};
use super::factor::{Factor, Share, quotient};
use super::inversion::{Valve, ValveModel};
use super::learned::Quantity;
use super::observer::{Body, Estimate, Opening};
use super::rig::Rig;
use super::{Acceleration, Angle, Damping, Jerk, Part, Ratio, Ticks};
use crate::arithmetic::{bits, fixed, limit, multiply, product, saturate};
use crate::parameters::Parameters;
use crate::quantities::{Velocity, Voltage};

/// [`GAIN_ANGLE`], [`ZONE_V`] and [`SLIDING`] in the tick's formats.
const WIDE: Angle = Angle::from_bits(bits(GAIN_ANGLE, Angle::FRAC_NBITS));
const ZONE: Voltage = Voltage::from_bits(bits(ZONE_V, Voltage::FRAC_NBITS));
const SLIDES: Velocity = Velocity::from_bits(bits(SLIDING, Velocity::FRAC_NBITS));
/// What is kept of the friction, or of the bandwidth, each time that the piston passes a standing target once more.
const KEPT: Ratio = Ratio::from_bits(bits(1.0 - UNLEARN, Ratio::FRAC_NBITS));
/// [`MASS_PART`].
const OF_MASS: Ratio = Ratio::from_bits(bits(MASS_PART, Ratio::FRAC_NBITS));
/// Bounds of the valve's flow over its nominal flow.
pub(super) const GAIN_BOUNDS: [Ratio; 2] = Quantity::FlowRight.ratio_limits();
/// Bounds of the mass over its nominal value.
pub(super) const MASS_BOUNDS: [Ratio; 2] = Quantity::Mass.ratio_limits();
/// And of the bandwidth.
pub(super) const BANDWIDTH_BOUNDS: [Ratio; 2] = Quantity::Bandwidth.ratio_limits();

/// Constants of learning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LearningRates {
    /// From an innovation of the force to the rate of force that was wrong.
    pub(crate) wrong: Factor<Acceleration, Jerk>,
    /// Per tick: gain.
    pub(crate) gain: Share<Ratio, Ratio>,
    /// Per tick: dead zone.
    pub(crate) zone: Share<Voltage, Voltage>,
    /// Bounds of the dead zone's half-widths, right and left.
    pub(crate) zone_bounds: [[Voltage; 2]; 2],
    /// Per tick: lag.
    pub(crate) lag: Share<Ticks, Ticks>,
    /// How fast the change of the angle follows, per tick.
    pub(crate) turn: Share<Angle, Angle>,
    /// Square of the change of angle in a tick above which the force tells the lag.
    pub(crate) turning_square: Angle,
    /// Bounds of the lag.
    pub(crate) lag_bounds: [Ticks; 2],
    /// Per tick: friction and mass, the disturbance in parts of the nominal Coulomb friction.
    pub(crate) body: Factor<Acceleration, Part>,
    /// Per tick: load.
    pub(crate) load: Share<Acceleration, Acceleration>,
    /// Its bounds: what the supply can hold.
    pub(crate) load_bounds: [Acceleration; 2],
    /// Per tick: Coulomb friction, in slow motion; and load that friction cannot be.
    pub(crate) slowly: Share<Acceleration, Acceleration>,
    /// Whether the piston slips as it breaks away.
    pub(crate) slips: bool,
    /// Nominal Coulomb friction.
    pub(crate) coulomb: Acceleration,
    /// Its bounds.
    pub(crate) coulomb_bounds: [Acceleration; 2],
    /// Nominal viscous friction.
    pub(crate) viscous: Damping,
    /// Its bounds.
    pub(crate) viscous_bounds: [Damping; 2],
    /// From the velocity to the nominal viscous friction in parts of the Coulomb friction.
    pub(crate) viscous_part: Factor<Velocity, Acceleration>,
    /// From the acceleration to the inertia in parts of the Coulomb friction.
    pub(crate) inertia_part: Factor<Acceleration, Acceleration>,
}

impl LearningRates {
    /// For a valve with these nominal half-widths of the dead zone.
    pub(crate) fn new(p: &Parameters, rig: &Rig, areas: &Areas, zones: [Voltage; 2]) -> Self {
        let Rig { hz, t, force_rate, coulomb, viscous, lag_s, .. } = *rig;
        // What friction is a part of must not be zero.
        let unit = coulomb.max(0.01);
        Self {
            wrong: Factor::new(force_rate),
            gain: Share::new(LEARN[0] * t),
            zone: Share::new(LEARN[1] * t),
            lag: Share::new(LEARN[1] * t),
            turn: Share::new((force_rate * t).min(1.0)),
            turning_square: fixed(TURNING * t * TURNING * t),
            lag_bounds: Quantity::Lag.parts().map(|bound| fixed(bound * lag_s * hz)),
            body: Factor::new(LEARN[1] * t / unit),
            coulomb: fixed(coulomb),
            viscous: fixed(viscous),
            viscous_bounds: Quantity::Viscous.parts().map(|bound| fixed(bound * viscous)),
            viscous_part: Factor::new(viscous / unit),
            inertia_part: Factor::new(1.0 / unit),
            zone_bounds: zones.map(|zone| {
                Quantity::ZoneRight
                    .parts()
                    .map(|bound| fixed::<Voltage>(bound * f64::from(zone.to_bits()) / f64::from(1 << 24)))
            }),
            load: Share::new(LOAD_RATE * t),
            load_bounds: [
                areas.force(1, p.servo_atmosphere_pa).saturating_sub(areas.force(0, p.servo_supply_pa)),
                areas.force(1, p.servo_supply_pa).saturating_sub(areas.force(0, p.servo_atmosphere_pa)),
            ],
            slowly: Share::new(SLOW_LEARN * t),
            slips: p.servo_stick_slip,
            coulomb_bounds: Quantity::Coulomb.parts().map(|bound| fixed(bound * coulomb)),
        }
    }
}

/// The spool's lag as learned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lag {
    /// The lag in ticks.
    pub ticks: Ticks,
    theta: Angle,
    turn: Angle,
}

impl Lag {
    /// When a run begins.
    pub(crate) fn of(ticks: Ticks) -> Self {
        Self { ticks, ..Self::default() }
    }

    /// A spool slower than modelled leaves the force behind by `slope * angle' * error of the lag`. `wrong` is the rate of
    /// force that the innovation shows.
    #[inline]
    pub(crate) fn learn(&mut self, wrong: Jerk, theta: Angle, slope: Jerk, rates: &LearningRates) {
        let change = theta.saturating_sub(self.theta);
        self.theta = theta;
        // The innovation is the model's error behind the correction's own lag; so is what it is compared with.
        self.turn = self.turn.saturating_add(rates.turn.of(change.saturating_sub(self.turn)));
        let turn = self.turn.to_bits();
        let radians = quotient(wrong.to_bits(), slope.to_bits().unsigned_abs(), 28);
        let square = multiply(turn, turn, 28).saturating_add(rates.turning_square.to_bits());
        let step = quotient(multiply(radians, turn, 28), square.unsigned_abs(), Ticks::FRAC_NBITS);
        let [least, most] = rates.lag_bounds;
        self.ticks = limit(self.ticks.saturating_sub(rates.lag.of(Ticks::from_bits(step))), least, most);
    }
}

/// The valve's gain and dead zone, from what one tick shows; `wrong` is the rate of force that the innovation shows.
#[inline]
pub(crate) fn learn_valve(
    (valve, model): (&Valve, &mut ValveModel),
    wrong: Jerk,
    opening: &Opening,
    air: &Air,
    rates: &LearningRates,
) {
    let Opening { w, theta } = *opening;
    let fills_a = theta >= 0;
    let side = usize::from(!fills_a);
    // Towards a stronger valve on this side.
    let outward = if fills_a { wrong } else { wrong.saturating_neg() }.to_bits();
    let slope = model.slope(fills_a, air);
    if theta.saturating_abs() > WIDE {
        let asked: Jerk = product(slope, theta.saturating_abs());
        let gain = &mut model.gains[side];
        let part = quotient(outward, asked.to_bits().unsigned_abs(), 28);
        let change = product(Ratio::from_bits(part), *gain);
        *gain = limit(gain.saturating_add(rates.gain.of(change)), GAIN_BOUNDS[0], GAIN_BOUNDS[1]);
    } else if w.saturating_abs() < ZONE && theta != 0 {
        // The voltage that makes up the wrong rate, and 1 / slope behind the dead zone.
        let radians = quotient(outward, slope.to_bits().unsigned_abs(), 24);
        let volts = valve.opening.volts_of(w, radians);
        let [least, most] = rates.zone_bounds[side];
        let zone = &mut model.zones[side];
        *zone = limit(zone.saturating_sub(rates.zone.of(product(volts, valve.per_slopes[side]))), least, most);
    }
}

/// Coulomb friction that is less than what is compensated, which a limit cycle shows: its speed is too low to learn from.
#[inline]
pub(crate) fn unlearn_friction(body: &mut Body, rates: &LearningRates) {
    let [least, _] = rates.coulomb_bounds;
    body.coulomb = product::<_, _, Acceleration>(body.coulomb, KEPT).max(least);
}

/// The law's bandwidth, less where a limit cycle goes on: the rig answers later than its file says, by hoses or a sensor's filter.
#[inline]
pub(crate) fn slow_down(bandwidth: &mut Ratio) {
    *bandwidth = product::<_, _, Ratio>(*bandwidth, KEPT).max(BANDWIDTH_BOUNDS[0]);
}

/// The load, from what the disturbance of one tick shows `beyond` it. Over moves both ways that is the load alone, because friction
/// changes its sign. What friction would have to leave its bounds for is load at once.
#[inline]
fn learn_load(load: &mut Acceleration, beyond: Acceleration, friction_is_at_its_end: bool, rates: &LearningRates) {
    let share = if friction_is_at_its_end { &rates.slowly } else { &rates.load };
    let [least, most] = rates.load_bounds;
    *load = limit(load.saturating_add(share.of(beyond)), least, most);
}

/// Load, friction and mass, from what the disturbance of one tick shows. `approaches` says that the piston moves towards a target
/// that stands.
#[inline]
pub(crate) fn learn_body(body: &mut Body, estimate: &mut Estimate, approaches: bool, rates: &LearningRates) {
    let forwards = estimate.v > 0;
    let along = |x: Acceleration| if forwards { x } else { x.saturating_neg() };
    let beyond = estimate.disturbance.saturating_sub(estimate.load);
    let wrong = along(beyond).saturating_neg();
    let [least, most] = rates.coulomb_bounds;
    if estimate.v.saturating_abs() < SLIDES {
        // Slow motion meets Coulomb friction alone. It is learned before the piston stands: too much of it is a limit cycle. Where
        // the piston slips, what seems to be too little may be static friction.
        if approaches && !(rates.slips && wrong > 0) {
            let before = body.coulomb;
            let asked = before.saturating_add(rates.slowly.of(wrong));
            body.coulomb = limit(asked, least, most);
            learn_load(&mut estimate.load, beyond, body.coulomb != asked, rates);
            estimate.disturbance = estimate.disturbance.saturating_add(along(body.coulomb - before));
        }
        return;
    }
    // In parts of the nominal Coulomb friction, along the motion: parts have 16 fractional bits.
    let viscous = along(rates.viscous_part.of(estimate.v));
    let inert = along(rates.inertia_part.of(estimate.a));
    let over_square = |x: Acceleration, one: i32| {
        // 1 / (1 + x²), or x of it.
        let square = (i64::from(x.to_bits()) * i64::from(x.to_bits())) >> 16;
        quotient(one, saturate(square + (1 << 16)).unsigned_abs(), 26)
    };
    let step = rates.body.of(wrong).to_bits();
    let friction_step = multiply(step, over_square(viscous, 1 << 16), 26);
    let mass_step: Part = product(Part::from_bits(multiply(step, over_square(inert, inert.to_bits()), 26)), OF_MASS);
    let before = *body;
    let coulomb = Acceleration::from_bits(multiply(friction_step, rates.coulomb.to_bits(), 26));
    let asked = before.coulomb.saturating_add(coulomb);
    body.coulomb = limit(asked, least, most);
    learn_load(&mut estimate.load, beyond, body.coulomb != asked, rates);
    let part = multiply(friction_step, viscous.to_bits(), 16);
    let [least, most] = rates.viscous_bounds;
    let change = Damping::from_bits(multiply(part, rates.viscous.to_bits(), 26));
    body.viscous = limit(before.viscous.saturating_add(change), least, most);
    let [least, most] = MASS_BOUNDS;
    let change = Ratio::from_bits(mass_step.to_bits().saturating_mul(4));
    body.mass = limit(before.mass.saturating_add(change), least, most);
    // What is now explained is no longer a disturbance.
    let viscous: Acceleration = product(body.viscous - before.viscous, estimate.v);
    let inert = product(body.mass - before.mass, estimate.a);
    estimate.disturbance = estimate
        .disturbance
        .saturating_add(along(body.coulomb - before.coulomb))
        .saturating_add(viscous.saturating_add(inert));
}
