//! The law: a jerk that places three poles at `−w`, and the opening of the valve that gives it.

use super::air::Air;
use super::factor::{Factor, PartOf, quotient};
use super::friction::Feedforward;
use super::hold::Means;
use super::reference::Motion;
use super::stick::{LeadGains, Stick};
use super::{Acceleration, Angle, Jerk, Ratio, ServoState, Tuning};
use crate::arithmetic::{limit, product, saturate};
use crate::quantities::{Position, Velocity, Voltage};
use fixed::types::I6F26;

/// Gains of one bandwidth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LawGains {
    /// While the piston moves, at the full bandwidth.
    pub(crate) feedback: Feedback,
    /// While it sticks.
    pub(crate) lead: LeadGains,
}

impl LawGains {
    /// Of the bandwidth `w`, with so many times the law's rate of force while the piston sticks.
    pub(crate) fn new(w: f64, stick: f64) -> Self {
        Self { feedback: Feedback::new(w), lead: LeadGains::new(w, stick) }
    }
}

/// From the errors of acceleration, velocity and position to a jerk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Feedback {
    /// `3 w`.
    pub(crate) a: Factor<Acceleration, Jerk>,
    /// `3 w²`.
    pub(crate) v: Factor<Velocity, Jerk>,
    /// `w³`.
    pub(crate) y: Factor<Position, Jerk>,
}

/// The parts of the three that are used, in their order.
pub(crate) type Parts = [PartOf; 3];

impl Feedback {
    fn new(w: f64) -> Self {
        Self { a: Factor::new(3.0 * w), v: Factor::new(3.0 * w * w), y: Factor::new(w * w * w) }
    }

    /// At a part of the bandwidth.
    pub(crate) fn at(&self, bandwidth: Ratio) -> Parts {
        let square: Ratio = product(bandwidth, bandwidth);
        let cube: Ratio = product(square, bandwidth);
        [self.a.part(bandwidth.to_bits()), self.v.part(square.to_bits()), self.y.part(cube.to_bits())]
    }

    /// The jerk that corrects errors of acceleration, velocity and position.
    #[inline]
    pub(super) fn jerk(&self, [a, v, y]: Parts, errors: (Acceleration, Velocity, Position)) -> i64 {
        self.a.wide_part(errors.0, a) + self.v.wide_part(errors.1, v) + self.y.wide_part(errors.2, y)
    }
}

/// The angle that gives a rate of force, as far as the valve goes.
#[inline]
pub(super) fn angle_for(rate: Jerk, slope: Jerk, most: Angle) -> Angle {
    let slope = slope.to_bits().unsigned_abs();
    limit(Angle::from_bits(quotient(rate.to_bits(), slope, 28)), -most, most)
}

/// The valve's command and its effective voltage for this tick.
#[inline]
pub(crate) fn command(tuning: &Tuning, state: &mut ServoState, target: Position, air: &Air) -> [Voltage; 2] {
    let (valve, tick) = (&tuning.valve, &tuning.tick);
    let scale = tuning.threshold_scale(state.noise);
    let estimate = state.estimate;
    let was_holding = state.hold.on;
    let followed = state.stream.take(target, &tuning.stream, tick);
    let target = followed.target;
    let standing = followed.motion.v == 0;
    let in_full = !standing && followed.used <= tuning.stream.followed_part;
    if !in_full {
        state.feedforward = Feedforward::at(estimate.bristle);
    }
    let resting = state.motion.from(&Motion::at(target)).saturating_abs() < tuning.hold.target
        && state.motion.v.saturating_abs() < tuning.standing
        && standing;
    let error = target.saturating_sub(estimate.y);
    // A model that slides while the piston sticks estimates a velocity that is none; the position's own does not.
    let v = match &tuning.slipping {
        Some(rate) => rate.of(state.hold.mean.error.saturating_sub(error)),
        None => estimate.v,
    };
    let now = Means { error, v, force: estimate.force };
    let frictions = (estimate.disturbance, state.body.coulomb);
    let holds = state.hold.decide(target, resting, now, frictions, (&tuning.hold, scale));
    state.stays = standing && target.saturating_sub(state.target).saturating_abs() <= tuning.hold.target;
    state.target = target;
    state.approaches = standing && !holds && !tuning.stick.sticks(&state.hold.mean, scale);
    if holds {
        state.stick = Stick::default();
        let rate = state.hold.restoring_rate(&tuning.hold);
        if rate == 0 {
            return [valve.centre, Voltage::ZERO];
        }
        let theta = angle_for(rate, state.valve.slope(rate > 0, air), valve.most_angle(&state.valve));
        return valve.command(&state.valve, theta);
    }
    if was_holding {
        state.motion = Motion::at(estimate.y);
    }
    let most = valve.most_angle(&state.valve);
    if let Some(rate) = state.stall.rate(error, estimate.force, &tuning.stall) {
        // The motion begins anew where the piston is let go.
        state.motion = Motion::at(estimate.y);
        return valve.command(&state.valve, angle_for(rate, state.valve.slope(rate >= 0, air), most));
    }
    let stick = (&tuning.stick, &tuning.law.lead, tick);
    if let Some(rate) = state.stick.rate(resting, &state.hold.mean, estimate.force, stick, scale) {
        let theta = angle_for(rate, state.valve.slope(rate >= 0, air), most);
        state.motion = followed.motion;
        return valve.command(&state.valve, theta);
    }
    state.motion = state.motion.arrived(&followed.motion, &tuning.limits);
    let reference = state.motion;
    if reference.from(&Motion::at(target)).saturating_abs() < tuning.arrived {
        state.stream.arrive();
    }
    // A target that moves sets the pace itself: behind it with less, the reference would only pass it by more where it turns. One
    // that leaves the limits free does not.
    let part = state.pace;
    let free = followed.used <= product::<_, _, I6F26>(part, tuning.stream.followed_part);
    let part = if standing || free { part } else { I6F26::ONE };
    let jerk_r = reference.jerk_towards(&followed, &tuning.limits, part);
    let errors = (
        reference.a.saturating_sub(estimate.a),
        reference.v.saturating_sub(estimate.v),
        reference.position().saturating_sub(estimate.y),
    );
    let jerk = i64::from(jerk_r.to_bits()) + tuning.law.feedback.jerk(state.feedback, errors);
    let by_motion: Jerk = product(air.stiffness, estimate.v.saturating_add(tuning.lead.of(reference.a)));
    let mass = state.body.mass;
    let rate = product::<_, _, Jerk>(Jerk::from_bits(saturate(jerk)), mass).saturating_add(by_motion);
    let near = reference.position().saturating_sub(estimate.y).saturating_abs() < tuning.near;
    // The friction of a target that is followed is known beforehand.
    let led = if in_full && near {
        let frictions = (estimate.bristle, state.body.coulomb);
        let full = product(state.valve.slope(followed.motion.a >= 0, air), most);
        let constants = (&tuning.friction, tick);
        rate.saturating_add(state.feedforward.rate(&followed.motion, frictions, full, state.lag.ticks, constants))
    } else {
        state.feedforward = Feedforward::at(estimate.bristle);
        rate
    };
    let slope = state.valve.slope(led >= 0, air);
    let theta = angle_for(led, slope, most);
    // What the valve cannot give, the reference does not ask for; the feedforward of friction is none of its motion. But one that brakes
    // near by would stop short and turn back.
    let missing = product::<_, _, Jerk>(theta, slope).saturating_sub(rate);
    let anti_windup = if theta.saturating_abs() < most || (missing < 0) != (theta >= 0) {
        Jerk::ZERO
    } else {
        let against = |x: i32| if reference.v < 0 { x } else { x.saturating_neg() };
        let braking = near && standing && against(reference.a.to_bits()) > tuning.braking.to_bits();
        let brakes_harder = braking && against(missing.to_bits()) > 0;
        if brakes_harder {
            Jerk::ZERO
        } else {
            Jerk::from_bits(quotient(missing.to_bits(), mass.to_bits().unsigned_abs(), 28))
        }
    };
    state.motion = reference.after(jerk_r.saturating_add(anti_windup), tick);
    valve.command(&state.valve, theta)
}
