//! Friction between piston seals and bore: LuGre with elasto-plastic presliding (3.9 to 3.12, corrected).
//!
//! ```text
//! F  = sigma0 z + sigma1 z' + sigma2 v                       (3.9; printed with z and z' exchanged)
//! z' = v - alpha(z, v) sigma0 / g(v) |v| z                    (3.10)
//! g  = F_c + (F_s - F_c) exp(-(v/v_s)^2)                      (3.11)
//! ```

use crate::real::Real;

/// Parameters of the friction law at one instant; `level` effects are already folded in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LuGre<R> {
    /// `sigma0`, N/m.
    pub stiffness: R,
    /// `1 / sigma0`, m/N.
    pub inverse_stiffness: R,
    /// `sigma1`, N s/m.
    pub damping: R,
    /// `sigma2`, N s/m.
    pub viscous: R,
    /// `F_c`, N.
    pub coulomb_n: R,
    /// `F_s`, N.
    pub static_n: R,
    /// `1 / v_s`, s/m.
    pub inverse_stribeck_velocity: R,
    /// `z_ba`, m.
    pub breakaway_m: R,
    /// Up to this deflection `alpha` is zero whatever the velocity: the sliding force need not be known.
    pub elastic_m: R,
}

/// Steady-state sliding force `g` in N and its derivative by velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level<R> {
    /// `g`, N, positive.
    pub force_n: R,
    /// `dg/dv`, N s/m.
    pub by_velocity: R,
}

/// Friction force and bristle rate, with partial derivatives for the integrator's Jacobian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response<R> {
    /// `F_fric`, N.
    pub force_n: R,
    /// `z'`, m/s.
    pub bristle_rate: R,
    /// `dz'/dv`.
    pub rate_by_velocity: R,
    /// `dz'/dz`, 1/s.
    pub rate_by_bristle: R,
    /// `dz'/dg`, m/(s N).
    pub rate_by_level: R,
}

/// The elasto-plastic switch and its partial derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Switch<R> {
    /// `alpha`, 0 while the bristles deflect elastically, 1 in sliding.
    pub(crate) alpha: R,
    /// `d alpha / d|z|`, 1/m.
    pub(crate) by_deflection: R,
    /// `d alpha / d z_max`, 1/m.
    pub(crate) by_limit: R,
}

/// Beyond this exponent the Stribeck term is below the rounding of the Coulomb force.
const NEGLIGIBLE_EXPONENT: f64 = 40.0;
/// `z_ba` counts as no more than this part of `z_max` (3.13).
pub(crate) const LARGEST_BREAKAWAY_RATIO: f64 = 0.95;

impl<R: Real> LuGre<R> {
    /// Whether `alpha` is zero for certain, without looking at the sliding force.
    #[inline(always)]
    #[must_use]
    pub fn is_elastic(&self, z: R, v: R) -> bool {
        let deflecting = v * z > R::ZERO;
        !deflecting || z.abs() <= self.elastic_m
    }

    /// Force and bristle rate where [`LuGre::is_elastic`].
    #[inline(always)]
    #[must_use]
    pub fn elastic_response(&self, z: R, v: R) -> Response<R> {
        Response {
            force_n: self.stiffness * z + self.damping * v + self.viscous * v,
            bristle_rate: v,
            rate_by_velocity: R::ONE,
            rate_by_bristle: R::ZERO,
            rate_by_level: R::ZERO,
        }
    }

    /// `g(v)` of (3.11).
    #[inline]
    #[must_use]
    pub fn level(&self, v: R) -> Level<R> {
        let s = v * self.inverse_stribeck_velocity;
        let squared = s * s;
        if squared > R::of(NEGLIGIBLE_EXPONENT) {
            return Level { force_n: self.coulomb_n, by_velocity: R::ZERO };
        }
        let bump = (self.static_n - self.coulomb_n) * (-squared).exp();
        Level { force_n: self.coulomb_n + bump, by_velocity: -(s + s) * self.inverse_stribeck_velocity * bump }
    }

    /// The elasto-plastic switch `alpha(z, v)` of (3.12, with the missing `+ 1/2` and absolute value); derivatives are
    /// zero unless `PARTIALS`.
    ///
    /// `1/2 sin(pi x) + 1/2` over `-1/2 <= x <= 1/2` is `sin^2(pi s/2)` with `s = x + 1/2`, and symmetric about 1/2:
    /// written like that, the argument stays below pi/4 and sliding (`s` just below 1) does not cancel.
    ///
    /// Where effects lower `g` so far that `z_ba` reaches `z_max`, against (3.13), `z_ba` is taken as 0.95 `z_max`.
    #[inline(always)]
    pub(crate) fn switch<const PARTIALS: bool>(&self, z: R, v: R, z_max: R) -> Switch<R> {
        let deflecting = v * z > R::ZERO;
        if !deflecting {
            return Switch::default();
        }
        let deflection = z.abs();
        if deflection >= z_max {
            return Switch { alpha: R::ONE, ..Switch::default() };
        }
        let largest = R::of(LARGEST_BREAKAWAY_RATIO) * z_max;
        let capped = self.breakaway_m > largest;
        let breakaway = if capped { largest } else { self.breakaway_m };
        if deflection <= breakaway {
            return Switch::default();
        }
        let per_width = R::ONE / (z_max - breakaway);
        let s = (deflection - breakaway) * per_width;
        let rising = s <= R::HALF;
        let sine = (R::PI * R::HALF * if rising { s } else { R::ONE - s }).sin();
        let squared = sine * sine;
        let mut switch = Switch { alpha: if rising { squared } else { R::ONE - squared }, ..Switch::default() };
        if PARTIALS {
            // d(sin^2 a)/da = 2 sin a cos a, with cos a > 0.7 from the sine.
            let slope = R::PI * sine * (R::ONE - squared).sqrt() * per_width;
            switch.by_deflection = slope;
            switch.by_limit = -slope * if capped { deflection / z_max } else { s };
        }
        switch
    }

    /// Force and bristle rate at bristle deflection `z` in m, velocity `v` in m/s and sliding force `level`, with their
    /// partial derivatives.
    #[inline]
    #[must_use]
    pub fn respond(&self, z: R, v: R, level: &Level<R>) -> Response<R> {
        self.evaluate::<true>(z, v, level)
    }

    /// [`LuGre::respond`]; partial derivatives are meaningful only with `PARTIALS`.
    #[inline(always)]
    pub(crate) fn evaluate<const PARTIALS: bool>(&self, z: R, v: R, level: &Level<R>) -> Response<R> {
        let inverse_level = R::ONE / level.force_n;
        let switch = self.switch::<PARTIALS>(z, v, level.force_n * self.inverse_stiffness);
        let speed = v.abs();
        let pull = self.stiffness * inverse_level * z;
        let bristle_rate = v - switch.alpha * pull * speed;
        let mut response = Response {
            force_n: self.stiffness * z + self.damping * bristle_rate + self.viscous * v,
            bristle_rate,
            rate_by_velocity: R::ONE,
            rate_by_bristle: R::ZERO,
            rate_by_level: R::ZERO,
        };
        if PARTIALS {
            // d(z_max)/dg = 1/sigma0.
            response.rate_by_level =
                (switch.alpha * inverse_level - switch.by_limit * self.inverse_stiffness) * pull * speed;
            response.rate_by_velocity =
                R::ONE - (switch.alpha * pull).abs() + response.rate_by_level * level.by_velocity;
            response.rate_by_bristle =
                -self.stiffness * inverse_level * speed * (switch.alpha + z.abs() * switch.by_deflection);
        }
        response
    }

    /// Friction force in steady sliding at velocity `v` in m/s (3.15), N.
    #[must_use]
    pub fn steady_force_n(&self, v: R) -> R {
        self.level(v).force_n * v.sign() + self.viscous * v
    }
}
