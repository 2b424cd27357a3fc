//! Mass flow through the valve's orifices (3.2, 3.3), and the ISO 6358 law that may replace it.

use crate::real::Real;

/// How far an orifice pair is open: `|atan(2 w)|`, and which chamber is being filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening<R> {
    /// Effective command `w`, V.
    pub w: R,
    /// `|atan(2 w)|`, rad, 0 to pi/2. The 2 carries 1/V.
    pub magnitude: R,
    /// Whether chamber A is filled and B exhausted (`w >= 0`), or the other way round.
    pub fills_a: bool,
}

impl<R: Real> Opening<R> {
    /// The opening at effective command `w` in V.
    #[inline]
    #[must_use]
    pub fn at(w: R) -> Self {
        Self { w, magnitude: (w + w).abs().atan(), fills_a: w >= R::ZERO }
    }

    /// Derivative of the magnitude by `w`, 1/V.
    #[inline]
    #[must_use]
    pub fn gain_per_v(&self) -> R {
        let two_w = self.w + self.w;
        let gain = (R::ONE + R::ONE) / (R::ONE + two_w * two_w);
        if self.fills_a { gain } else { -gain }
    }
}

/// A mass flow into a chamber and its partial derivatives, for the integrator's Jacobian.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flow<R> {
    /// Flow into the chamber, kg/s.
    pub mass_flow: R,
    /// Derivative by the chamber's pressure, kg/(s Pa).
    pub by_chamber: R,
    /// Derivative by the supply pressure, kg/(s Pa).
    pub by_supply: R,
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
}

/// Parameters of the ISO 6358 law `q = C p_up psi(p_down / p_up)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iso6358<R> {
    /// Critical pressure ratio `b`, 0 to below 1.
    pub critical_ratio: R,
    /// `C` of filling, kg/(s Pa) per rad of opening.
    pub fill: R,
    /// `C` of exhausting, kg/(s Pa) per rad of opening.
    pub exhaust: R,
}

/// Above this pressure ratio the ISO law's infinite slope is replaced by a straight (laminar) line to zero flow.
const LAMINAR_RATIO: f64 = 0.999;

/// `psi(r)` of ISO 6358 and its derivative, laminar near `r = 1`.
#[inline]
#[must_use]
pub fn psi<R: Real>(ratio: R, critical: R) -> (R, R) {
    if ratio <= critical {
        return (R::ONE, R::ZERO);
    }
    let span = R::ONE - critical;
    let curve = |r: R| {
        let s = (r - critical) / span;
        let root = (R::ONE - s * s).at_least(R::ZERO).sqrt();
        (root, s)
    };
    let laminar = R::of(LAMINAR_RATIO);
    if ratio >= laminar {
        let (root, _) = curve(laminar);
        let slope = -root / (R::ONE - laminar);
        return ((R::ONE - ratio).at_least(R::ZERO) * -slope, slope);
    }
    let (root, s) = curve(ratio);
    (root, -s / (span * root))
}

/// Flow through one orifice from `up` to `down` by ISO 6358, positive that way, with derivatives by both.
#[inline]
fn iso_flow<R: Real>(conductance: R, critical: R, up: R, down: R) -> (R, R, R) {
    if down > up {
        let (q, by_down, by_up) = iso_flow(conductance, critical, down, up);
        return (-q, -by_up, -by_down);
    }
    let ratio = down / up;
    let (value, slope) = psi(ratio, critical);
    (conductance * up * value, conductance * (value - slope * ratio), conductance * slope)
}

/// What an open orifice of the linear law connects a chamber to: flow is `conductance (pressure - p)` into the chamber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Connection<R> {
    /// kg/(s Pa).
    pub(crate) conductance: R,
    /// Supply or atmosphere, Pa absolute.
    pub(crate) pressure_pa: R,
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
    #[inline]
    #[must_use]
    pub fn inflow(&self, filling: bool, magnitude: R, p: R, supply: R, atmosphere: R) -> Flow<R> {
        if let Some(iso) = &self.iso6358 {
            return iso.inflow(filling, magnitude, p, supply, atmosphere);
        }
        self.connect(filling, magnitude, supply, atmosphere).inflow(filling, p)
    }
}

impl<R: Real> Connection<R> {
    /// Flow into a chamber at pressure `p`.
    #[inline(always)]
    pub(crate) fn inflow(&self, filling: bool, p: R) -> Flow<R> {
        Flow {
            mass_flow: self.conductance * (self.pressure_pa - p),
            by_chamber: -self.conductance,
            by_supply: if filling { self.conductance } else { R::ZERO },
        }
    }
}

impl<R: Real> Iso6358<R> {
    fn inflow(&self, filling: bool, magnitude: R, p: R, supply: R, atmosphere: R) -> Flow<R> {
        if filling {
            let (mass_flow, by_supply, by_chamber) = iso_flow(self.fill * magnitude, self.critical_ratio, supply, p);
            Flow { mass_flow, by_chamber, by_supply }
        } else {
            let (out, by_chamber, _) = iso_flow(self.exhaust * magnitude, self.critical_ratio, p, atmosphere);
            Flow { mass_flow: -out, by_chamber: -by_chamber, by_supply: R::ZERO }
        }
    }
}
