//! Mass flow through the valve's orifices (3.2, 3.3), and the ISO 6358 law that may replace it.

use crate::cushion::{self, Cushion};
pub use crate::effects::choked_flow::{Iso6358, psi};
pub(crate) use crate::flow::Connection;
pub use crate::flow::Flow;
use crate::hose::Resistance;
use crate::real::Real;

/// How far an orifice pair is open, and which chamber is being filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening<R> {
    /// Effective command `w`, V.
    pub w: R,
    /// `|atan(2 w)|`, rad, 0 to pi/2, where the 2 carries 1/V; or by a table, of which full opening is pi/2.
    pub magnitude: R,
    /// The magnitude of the paths to atmosphere, which open elsewhere on a valve with `exhaust_overlap_v`.
    pub exhaust: R,
    /// Whether chamber A is filled and B exhausted (`w >= 0`), or the other way round.
    pub fills_a: bool,
}

impl<R: Real> Opening<R> {
    /// The opening at effective command `w` in V, by the arc tangent.
    #[inline]
    #[must_use]
    pub fn at(w: R) -> Self {
        Self::open(w, Self::arc_tangent(w))
    }

    /// The arc tangent's magnitude in rad at effective command `w` in V.
    #[inline]
    pub(crate) fn arc_tangent(w: R) -> R {
        (w + w).abs().atan()
    }

    /// All paths open by `magnitude` in rad at effective command `w` in V.
    #[inline]
    #[must_use]
    pub fn open(w: R, magnitude: R) -> Self {
        Self { w, magnitude, exhaust: magnitude, fills_a: w >= R::ZERO }
    }

    /// The same with the paths to atmosphere as they are in another opening. Where they alone are open, they say which way.
    #[inline]
    #[must_use]
    pub fn with_exhaust(&self, there: &Self) -> Self {
        let fills_a = if self.magnitude > R::ZERO { self.fills_a } else { there.fills_a };
        Self { exhaust: there.magnitude, fills_a, ..*self }
    }

    /// Magnitude in rad of the path that a chamber is filled through, or exhausted.
    #[inline]
    #[must_use]
    pub fn through(&self, filling: bool) -> R {
        if filling { self.magnitude } else { self.exhaust }
    }

    /// Derivative of the arc tangent's magnitude by `w`, 1/V.
    #[inline]
    #[must_use]
    pub fn gain_per_v(&self) -> R {
        let two_w = self.w + self.w;
        let gain = (R::ONE + R::ONE) / (R::ONE + two_w * two_w);
        if self.fills_a { gain } else { -gain }
    }
}

/// Conductances of the two orifices a chamber is connected to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orifices<R> {
    /// `beta` of filling, kg/(s Pa).
    pub fill: R,
    /// `beta` of exhausting, kg/(s Pa).
    pub exhaust: R,
    /// ISO 6358 law, if it replaces the linear one.
    pub iso6358: Option<Iso6358<R>>,
    /// The hose between them and the chamber, if it is described, and what throttles.
    pub hose: Option<Resistance<R>>,
    /// The cushion at the chamber's end; its needle includes the hose.
    pub cushion: Option<Cushion<R>>,
}

impl<R: Real> Orifices<R> {
    /// The linear law (3.2, 3.3) at a given opening.
    #[inline(always)]
    pub(crate) fn connect(&self, filling: bool, magnitude: R, supply_pa: R, atmosphere_pa: R) -> Connection<R> {
        if filling {
            Connection { conductance: self.fill * magnitude, pressure_pa: supply_pa }
        } else {
            Connection { conductance: self.exhaust * magnitude, pressure_pa: atmosphere_pa }
        }
    }

    /// Flow into a chamber at pressure `p` through the open orifice (3.2, 3.3); all pressures Pa absolute.
    ///
    /// `filling` connects the chamber to the supply, otherwise it is connected to atmosphere.
    #[inline(always)]
    #[must_use]
    pub fn inflow(&self, filling: bool, magnitude: R, p: R, supply: R, atmosphere: R) -> Flow<R> {
        self.through(self.hose.as_ref(), filling, magnitude, p, supply, atmosphere)
    }

    /// [`Orifices::inflow`] with the piston at a distance in m from the chamber's end, where a cushion may throttle what
    /// flows out.
    #[inline(always)]
    #[must_use]
    pub fn inflow_at(&self, distance_m: R, filling: bool, magnitude: R, p: R, supply: R, atmosphere: R) -> Flow<R> {
        let bore = self.inflow(filling, magnitude, p, supply, atmosphere);
        match &self.cushion {
            Some(cushion) if distance_m < cushion.length_m && bore.mass_flow < R::ZERO => {
                let needle = self.through(Some(&cushion.needle), filling, magnitude, p, supply, atmosphere);
                cushion::between(&bore, &needle, cushion.closed(distance_m))
            }
            _ => bore,
        }
    }

    #[inline(always)]
    fn through(
        &self,
        hose: Option<&Resistance<R>>,
        filling: bool,
        magnitude: R,
        p: R,
        supply: R,
        atmosphere: R,
    ) -> Flow<R> {
        if let Some(iso) = &self.iso6358 {
            return iso.inflow(hose.and_then(Resistance::iso6358), filling, magnitude, p, supply, atmosphere);
        }
        let valve = self.connect(filling, magnitude, supply, atmosphere);
        match hose {
            Some(hose) => hose.inflow(&valve, filling, p),
            None => valve.inflow(filling, p),
        }
    }
}
