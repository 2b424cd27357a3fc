//! The setpoint limiter: the reference stays in its range and moves no faster than told.
//!
//! Three kinds, by which limits are given: a step passes as a step (range only); a ramp (velocity); or a time-optimal
//! move (velocity and acceleration), which accelerates, cruises, brakes and lands on the target without overshoot.
//!
//! The braking rule, with remaining distance `e`, acceleration `a` and tick `h`: the fastest velocity from which equal
//! steps of `a h` stop in time is `v = sqrt(2 a e) − a h / 2`; it lies never more than `a h² / 8` of travel below the
//! exact staircase and never above it, so the reference cannot overshoot. Within `e ≤ a h²` one tick suffices.

use crate::arithmetic::{limit, saturate};
use crate::quantities::{Position, Velocity};

/// Fractional bits of the limiter's own position: a tick's travel is far below the resolution of [`Position`].
const FINE_BITS: u32 = 56;
const FINE_SHIFT: u32 = FINE_BITS - Position::FRAC_NBITS;

/// Range and dynamic limits of the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetpointLimits {
    /// Lowest reference.
    pub(crate) low: Position,
    /// Highest reference.
    pub(crate) high: Position,
    /// How the reference moves inside the range.
    pub(crate) motion: Motion,
}

/// How the reference moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// At once.
    Step,
    /// At limited velocity.
    Ramp {
        /// Largest change per tick, m, 56 fractional bits.
        step_q56: i64,
    },
    /// At limited velocity and acceleration.
    Smooth(Smooth),
}

/// Precomputed numbers of the time-optimal move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smooth {
    /// Highest velocity.
    pub(crate) max_velocity: Velocity,
    /// Largest change of velocity per tick, `a h`.
    pub(crate) velocity_step: Velocity,
    /// Twice the acceleration, m/s2, U16F16.
    pub(crate) two_acceleration_q16: u32,
    /// The distance `a h²` from which one tick lands on the target, m, 56 fractional bits.
    pub(crate) landing_q56: i64,
    /// The tick `h`, s, 32 fractional bits.
    pub(crate) tick_q32: u32,
    /// `1 / h`, 1/s.
    pub(crate) tick_hz: u32,
}

/// Where the limited reference is and how fast it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SetpointState {
    position_q56: i64,
    velocity: Velocity,
}

impl SetpointState {
    /// The reference at rest at `position`, where a move begins without a jump.
    #[must_use]
    pub fn at(position: Position) -> Self {
        Self { position_q56: fine(position), velocity: Velocity::ZERO }
    }
}

fn fine(position: Position) -> i64 {
    // |position| < 2^31 · 2^28: fits.
    i64::from(position.to_bits()) << FINE_SHIFT
}

impl SetpointLimits {
    /// The reference for this tick on the way to `target`.
    #[inline]
    pub fn advance(&self, state: &mut SetpointState, target: Position) -> Position {
        let target = limit(target, self.low, self.high);
        // Both below 2^59 in magnitude.
        let remaining = fine(target) - state.position_q56;
        match &self.motion {
            Motion::Step => {
                *state = SetpointState::at(target);
                return target;
            }
            Motion::Ramp { step_q56 } => state.position_q56 += limit(remaining, -step_q56, *step_q56),
            Motion::Smooth(smooth) => {
                state.velocity = smooth.velocity(state.velocity, remaining);
                // 2^31 · 2^32 / 50 at most, as a tick is no longer than 1/50 s.
                state.position_q56 += i64::from(state.velocity.to_bits()) * i64::from(smooth.tick_q32);
            }
        }
        let (low, high) = (fine(self.low), fine(self.high));
        state.position_q56 = limit(state.position_q56, low, high);
        Position::from_bits(saturate((state.position_q56 + (1 << (FINE_SHIFT - 1))) >> FINE_SHIFT))
    }
}

impl Smooth {
    /// The velocity for the coming tick: as fast as allowed, never so fast that braking comes too late.
    #[inline]
    fn velocity(&self, present: Velocity, remaining_q56: i64) -> Velocity {
        let distance = remaining_q56.unsigned_abs();
        let speed = if distance <= self.landing_q56.unsigned_abs() {
            // distance · tick_hz <= a h: below 128 m/s.
            Velocity::from_bits(saturate(((distance * u64::from(self.tick_hz)) >> (FINE_BITS - 24)) as i64))
        } else {
            self.braking_speed(distance)
        };
        let wanted = if remaining_q56 < 0 { -speed } else { speed };
        let reachable =
            limit(wanted, present.saturating_sub(self.velocity_step), present.saturating_add(self.velocity_step));
        limit(reachable, -self.max_velocity, self.max_velocity)
    }

    /// `sqrt(2 a e) − a h / 2`, rounded down to 15 significant bits, at most the highest velocity.
    #[inline]
    fn braking_speed(&self, distance_q56: u64) -> Velocity {
        // e = mantissa · 2^(drop − 56) with a mantissa of at most 32 bits.
        let drop = 32_u32.saturating_sub(distance_q56.leading_zeros());
        let square = (distance_q56 >> drop) * u64::from(self.two_acceleration_q16); // F(72 − drop)
        // A 32-bit radicand with an even exponent: v² in F48 is square · 2^(drop − 24).
        let mut cut = 32_u32.saturating_sub(square.leading_zeros());
        let odd = (cut + drop) & 1;
        cut += odd;
        let root = ((square >> cut) as u32).isqrt();
        let exponent = (cut + drop) as i32 / 2 - 12;
        let speed = if exponent >= 0 { u64::from(root) << exponent } else { u64::from(root) >> -exponent };
        let limit = self.max_velocity.to_bits().unsigned_abs();
        let speed = if speed > u64::from(limit) + u64::from(self.velocity_step.to_bits().unsigned_abs()) {
            limit as i32
        } else {
            speed as i32 - self.velocity_step.to_bits() / 2
        };
        Velocity::from_bits(crate::arithmetic::limit(speed, 0, limit as i32))
    }
}
