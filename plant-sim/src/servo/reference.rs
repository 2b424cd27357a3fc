//! The reference: a target becomes a motion within limits of speed, acceleration and jerk, planned anew each tick.
//!
//! Nothing of a plan is stored. Each tick asks where the motion would stop if it braked from now on, and picks the
//! jerk whose stopping point is the target. So a new target in mid-move, or a motion that was taken back because the
//! valve could not follow, needs no case of its own.

use control::servo::constants::NEAR_M;

/// Limits of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// m/s.
    pub speed: f64,
    /// m/s2.
    pub acceleration: f64,
    /// m/s3.
    pub jerk: f64,
}

/// A point of the motion: position in m and its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// m.
    pub y: f64,
    /// m/s.
    pub v: f64,
    /// m/s2.
    pub a: f64,
}

impl Motion {
    /// After `t` seconds of constant jerk.
    #[must_use]
    pub fn after(&self, jerk: f64, t: f64) -> Self {
        Self {
            y: self.y + t * (self.v + t * (self.a / 2.0 + t * jerk / 6.0)),
            v: self.v + t * (self.a + t * jerk / 2.0),
            a: self.a + t * jerk,
        }
    }

    /// The motion itself, or the `aim` once one tick's jerk makes up the difference: else it would go on around its aim.
    #[must_use]
    pub fn arrived(&self, aim: &Self, limits: &Limits, t: f64) -> Self {
        let a = limits.jerk * t;
        let near = (self.a - aim.a).abs() <= a
            && (self.v - aim.v).abs() <= a * t
            && (self.y - aim.y).abs() <= NEAR_M + a * t * t;
        if near { *aim } else { *self }
    }

    /// Where the motion comes to rest if it brakes from now on within the limits, m.
    #[must_use]
    pub fn stopping_point(&self, limits: &Limits) -> f64 {
        let (jerk, most) = (limits.jerk, limits.acceleration);
        // The speed left once the acceleration has gone to zero tells which way to brake.
        let left = self.v + self.a * self.a.abs() / (2.0 * jerk);
        let side = if left >= 0.0 { 1.0 } else { -1.0 };
        let (v, a) = (side * self.v, side * self.a);
        let squared = jerk * v + a * a / 2.0;
        let peak = squared.max(0.0).sqrt().min(most);
        let t_1 = (a + peak) / jerk;
        let v_1 = v + (a * a - peak * peak) / (2.0 * jerk);
        let v_2 = peak * peak / (2.0 * jerk);
        let t_2 = if peak < most { 0.0 } else { ((v_1 - v_2) / most).max(0.0) };
        let way = t_1 * (v + t_1 * (a / 2.0 - t_1 * jerk / 6.0))
            + t_2 * (v_1 + v_2) / 2.0
            + peak.powi(3) / (6.0 * jerk * jerk);
        self.y + side * way
    }

    /// The jerk of the next tick of `t` seconds on the way to `target`. Braking has `reserve` times the jerk that the plan has: late
    /// by a little, the motion would otherwise pass its target.
    #[must_use]
    pub fn jerk_towards(&self, target: f64, limits: &Limits, reserve: f64, t: f64) -> f64 {
        // The acceleration after the tick from which the speed limit is just reached, either way.
        // Going back to zero takes a tick at least: without that the acceleration changed its side each tick along the limit.
        let to_speed = |speed: f64| {
            let room = speed - self.v - t * self.a / 2.0;
            let most = if room.abs() <= limits.jerk * t * t {
                room.abs() / t
            } else {
                limits.jerk * ((t * t / 4.0 + 2.0 * room.abs() / limits.jerk).sqrt() - t / 2.0)
            };
            most.copysign(room)
        };
        let braking = |against: bool| if against { reserve * limits.jerk } else { limits.jerk };
        let up = braking(self.v < 0.0 || (self.v > 0.0 && self.a < 0.0));
        let down = braking(self.v > 0.0 || (self.v < 0.0 && self.a > 0.0));
        let low = (self.a - down * t).max(to_speed(-limits.speed).max(-limits.acceleration));
        let high = (self.a + up * t).min(to_speed(limits.speed).min(limits.acceleration));
        // Beyond a limit (it was pushed there), go back with full jerk.
        let low = low.min(self.a + up * t);
        let high = high.max(self.a - down * t).max(low);
        let beyond = |a: f64| self.after((a - self.a) / t, t).stopping_point(limits) - target;
        let (mut low, mut high) = (low, high);
        let (mut at_low, mut at_high) = (beyond(low), beyond(high));
        let a = if at_high <= 0.0 {
            high
        } else if at_low >= 0.0 {
            low
        } else {
            // Regula falsi; an end that stays twice in a row counts half (Illinois).
            let mut a = low;
            let mut side = 0.0;
            for _ in 0..6 {
                a = low + (high - low) * (-at_low / (at_high - at_low));
                let at = beyond(a);
                if at.abs() < 1e-9 {
                    break;
                }
                if at > 0.0 {
                    (high, at_high) = (a, at);
                    at_low *= if side > 0.0 { 0.5 } else { 1.0 };
                } else {
                    (low, at_low) = (a, at);
                    at_high *= if side < 0.0 { 0.5 } else { 1.0 };
                }
                side = at;
            }
            a
        };
        (a - self.a) / t
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use control::servo::constants::RESERVE;

    const LIMITS: Limits = Limits { speed: 1.4, acceleration: 8.0, jerk: 93.0 };

    #[test]
    fn a_move_ends_on_its_target_without_passing_it_and_within_its_limits() {
        for target in [1e-5, 1e-3, 0.045, 0.3, -0.4] {
            let mut motion = Motion::default();
            for _ in 0..3000 {
                let jerk = motion.jerk_towards(target, &LIMITS, RESERVE, 1e-3);
                assert!(jerk.abs() <= RESERVE * LIMITS.jerk * 1.000_001);
                motion = motion.after(jerk, 1e-3);
                assert!(motion.v.abs() <= LIMITS.speed * 1.001, "{motion:?}");
                assert!(motion.a.abs() <= LIMITS.acceleration * 1.000_001, "{motion:?}");
                assert!(motion.y * target.signum() <= target.abs() + 2e-6, "{motion:?} beyond {target}");
            }
            assert!((motion.y - target).abs() < 1e-6, "{motion:?} instead of {target}");
            assert!(motion.v.abs() < 1e-4, "{motion:?}");
        }
    }

    #[test]
    fn a_target_changed_in_mid_move_is_reached_too() {
        let mut motion = Motion::default();
        for tick in 0..3000 {
            let target = if tick < 150 { 0.3 } else { -0.02 };
            motion = motion.after(motion.jerk_towards(target, &LIMITS, RESERVE, 1e-3), 1e-3);
        }
        assert!((motion.y + 0.02).abs() < 1e-6, "{motion:?}");
    }
}
