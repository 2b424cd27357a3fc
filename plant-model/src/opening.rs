//! How far the valve is open at a command, where it is not by the arc tangent.

use crate::effects::opening_curve::OpeningParabola;
use crate::opening_table::{OpeningPoints, OpeningTable};
use crate::real::Real;

/// The opening in rad over the effective command, which the dead zone makes of the command, where it is not the arc tangent.
///
/// A fully open valve counts as π/2, the paper's limit of `atan(2 w)`: coefficients keep their meaning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OpeningCurve<R> {
    /// By the rig's table.
    Points(OpeningPoints<R>),
    /// By the effect `opening-curve`.
    Parabola(OpeningParabola<R>),
}

impl<R: Real> OpeningCurve<R> {
    /// `None` without a table.
    pub(crate) fn of(table: &OpeningTable<R>, smoothness: R) -> Option<Self> {
        OpeningPoints::of(table, smoothness).map(Self::Points)
    }

    /// Magnitude in rad at an effective command in V, and its derivative by the command's magnitude in rad/V.
    #[inline]
    pub(crate) fn at(&self, w: R) -> (R, R) {
        match self {
            Self::Points(points) => points.at(w),
            Self::Parabola(parabola) => parabola.at(w),
        }
    }
}
