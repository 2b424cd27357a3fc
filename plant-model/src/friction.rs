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

/// Beyond this exponent the Stribeck term is below the rounding of the Coulomb force.
const NEGLIGIBLE_EXPONENT: f64 = 40.0;

impl<R: Real> LuGre<R> {
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

    /// The elasto-plastic switch `alpha(z, v)` of (3.12, with the missing `+ 1/2` and absolute value): 0 while the
    /// bristles deflect elastically, 1 in sliding; with derivatives by `|z|` and by `z_max`.
    ///
    /// Where effects lower `g` so far that `z_ba` reaches `z_max`, against (3.13), `z_ba` is taken as 0.95 `z_max`.
    #[inline]
    #[must_use]
    pub fn alpha(&self, z: R, v: R, z_max: R) -> (R, R, R) {
        let none = (R::ZERO, R::ZERO, R::ZERO);
        if v.sign() != z.sign() {
            return none;
        }
        let deflection = z.abs();
        if deflection >= z_max {
            return (R::ONE, R::ZERO, R::ZERO);
        }
        let breakaway = self.breakaway_m.at_most(R::of(0.95) * z_max);
        if deflection <= breakaway {
            return none;
        }
        let width = z_max - breakaway;
        let x = (deflection - (z_max + breakaway) * R::HALF) / width;
        let angle = R::PI * x;
        let slope = R::HALF * R::PI * angle.cos() / width;
        (R::HALF * angle.sin() + R::HALF, slope, -slope * (R::HALF + x))
    }

    /// Force and bristle rate at bristle deflection `z` in m, velocity `v` in m/s and sliding force `level`.
    #[inline]
    #[must_use]
    pub fn respond(&self, z: R, v: R, level: &Level<R>) -> Response<R> {
        let inverse_level = R::ONE / level.force_n;
        let (alpha, by_deflection, by_limit) = self.alpha(z, v, level.force_n / self.stiffness);
        let speed = v.abs();
        let pull = self.stiffness * inverse_level * z;
        let bristle_rate = v - alpha * pull * speed;
        // d(z_max)/dg = 1/sigma0.
        let rate_by_level = -(by_limit / self.stiffness - alpha * inverse_level) * pull * speed;
        Response {
            force_n: self.stiffness * z + self.damping * bristle_rate + self.viscous * v,
            bristle_rate,
            rate_by_velocity: R::ONE - alpha * pull * v.sign() + rate_by_level * level.by_velocity,
            rate_by_bristle: -self.stiffness * inverse_level * speed * (alpha + z.abs() * by_deflection),
            rate_by_level,
        }
    }

    /// Friction force in steady sliding at velocity `v` in m/s (3.15), N.
    #[must_use]
    pub fn steady_force_n(&self, v: R) -> R {
        self.level(v).force_n * v.sign() + self.viscous * v
    }
}
