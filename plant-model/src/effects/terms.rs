//! What an effect may add to the equations, and the sums that collect it.
//!
//! A term is called in every evaluation of the right-hand side, statically and inlined: what an effect does not add costs
//! nothing.

use crate::measurement::Measurement;
use crate::real::Real;
use core::marker::PhantomData;

/// A chamber of the cylinder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Towards negative positions; grows with the position.
    A,
    /// Towards positive positions.
    B,
}

/// Mass flow into a chamber beside the valve's, with its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChamberFlow<R> {
    /// Flow into the chamber, kg/s.
    pub mass_flow: R,
    /// Derivative by the chamber's own pressure, kg/(s Pa).
    pub by_chamber: R,
    /// Derivative by the other chamber's pressure, kg/(s Pa).
    pub by_other: R,
}

/// Where a chamber stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chamber<R> {
    pub(crate) side: Side,
    pub(crate) p_pa: R,
    /// Absent where nobody measures it: then a term that needs it adds nothing.
    pub(crate) p_other_pa: Option<R>,
    pub(crate) atmosphere_pa: R,
}

/// Force on the piston towards chamber B, apart from friction, with its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Force<R> {
    /// N.
    pub force_n: R,
    /// Derivative by position, N/m.
    pub by_position: R,
    /// Derivative by velocity, N s/m.
    pub by_velocity: R,
}

/// What the seals see.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seal<R> {
    pub(crate) y_m: R,
    pub(crate) v_m_per_s: R,
    /// `p_a + p_b - 2 p_atm`.
    pub(crate) gauge_sum_pa: R,
}

/// What becomes of the sliding force: `g := (g + added) factor (1 + relative changes along the stroke)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sliding<R> {
    /// `g` with what is added before anything multiplies, N.
    pub(crate) loaded_n: R,
    /// Its derivative by either pressure, N/Pa.
    pub(crate) loaded_by_pressure: R,
    /// Product of factors that depend neither on position nor on pressure.
    pub(crate) factor: R,
    /// One plus the sum of relative changes along the stroke.
    pub(crate) place: R,
    /// Its derivative by position, 1/m.
    pub(crate) place_by_position: R,
}

impl<R: Real> Sliding<R> {
    #[inline(always)]
    pub(crate) fn at(plain_n: R) -> Self {
        Self {
            loaded_n: plain_n,
            loaded_by_pressure: R::ZERO,
            factor: R::ONE,
            place: R::ONE,
            place_by_position: R::ZERO,
        }
    }
}

/// An effect's own coefficients and what they add to the equations. The default value adds nothing.
///
/// An effect that only changes coefficients of the paper's model has no term of its own: [`NoTerms`].
pub(crate) trait Term<R: Real>: Copy + Default + PartialEq {
    /// Whether it adds a flow, a state, or a force that depends on the state: then the right-hand side takes its longer
    /// path.
    #[inline(always)]
    fn is_present(&self) -> bool {
        false
    }

    /// Whether the sliding force depends on more than velocity.
    #[inline(always)]
    fn changes_sliding_force(&self) -> bool {
        false
    }

    /// Adds a flow into a chamber.
    #[inline(always)]
    fn flow(&self, _chamber: &Chamber<R>, _sum: &mut ChamberFlow<R>) {}

    /// Whether its force on the piston depends on position or velocity: its derivatives then count, and it must say when it
    /// [is present](Term::is_present).
    const FORCE_VARIES: bool = false;

    /// Adds to the force on the piston.
    #[inline(always)]
    fn force(&self, _y_m: R, _v_m_per_s: R, _sum: &mut Force<R>) {}

    /// Changes the sliding force; derivatives are wanted only with `PARTIALS`.
    #[inline(always)]
    fn slide<const PARTIALS: bool>(&self, _seal: &Seal<R>, _sum: &mut Sliding<R>) {}

    /// The most that it can take from the sliding force anywhere in the stroke.
    #[inline]
    fn slide_least(&self, _half_stroke_m: R, _sum: &mut Sliding<R>) {}

    /// Changes what the sensors show.
    #[inline(always)]
    fn sense(&self, _shown: &mut Measurement<R>) {}

    /// The inverse of [`Term::sense`] for a pressure.
    #[inline(always)]
    fn true_pressure_pa(&self, _side: Side, shown_pa: R) -> R {
        shown_pa
    }

    /// The inverse of [`Term::sense`] for the position.
    #[inline(always)]
    fn true_position_m(&self, shown_m: R) -> R {
        shown_m
    }
}

/// The term of an effect that only changes coefficients of the paper's model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NoTerms<R>(PhantomData<R>);

impl<R: Real> Term<R> for NoTerms<R> {}
