//! The spool between two changes of its target: `m tau^2 w'' + tau w' + w = u`, solved exactly (see the effect `valve-lag`).

use super::decay::{Decay, LastFew};
use plant_model::effects::ValveLagTerms as Terms;

/// After so many times the slower of its time constants nothing is left of where a spool began that an `f64` could tell: `ln 2^53`.
const MEMORY: f64 = 37.0;

/// For how long a spool remembers where it began, s.
pub(super) fn memory_s(lag: &Terms<f64>) -> f64 {
    // The slower eigenvalue's real part is 1/tau or more with little inertia, and 1/(2 m tau) with much.
    MEMORY * lag.time_constant_s * (2.0 * lag.inertia).max(1.0)
}

/// A spool that follows its target with a lag.
pub(super) struct Spool {
    lag: Terms<f64>,
    decay: Decay,
    responses: LastFew<Response>,
    place_v: f64,
    velocity_v_per_s: f64,
}

impl Spool {
    /// A spool at rest at 0 V; `None` where its lag is too short to be told from none.
    pub(super) fn of(lag: Terms<f64>) -> Option<Self> {
        let decay = Decay::of(lag.time_constant_s)?;
        Some(Self { lag, decay, responses: LastFew::none(), place_v: 0.0, velocity_v_per_s: 0.0 })
    }

    pub(super) fn place_v(&self) -> f64 {
        self.place_v
    }

    /// Lets it rest at a place in V.
    pub(super) fn rest_at(&mut self, place_v: f64) {
        (self.place_v, self.velocity_v_per_s) = (place_v, 0.0);
    }

    /// Follows a constant target in V for `duration_s`; returns its mean place meanwhile, V.
    pub(super) fn follow(&mut self, target_v: f64, duration_s: f64) -> f64 {
        if !self.lag.has_inertia() {
            let rest = self.decay.after(duration_s);
            let (mean, end) = self.lag.over(self.place_v, target_v, duration_s, rest);
            self.place_v = end;
            return mean;
        }
        let response = self.responses.of(duration_s, || Response::after(&self.lag, duration_s));
        let (tau, inertia_s2) = (self.lag.time_constant_s, self.lag.inertia * self.lag.time_constant_s.powi(2));
        let (away, velocity) = (self.place_v - target_v, self.velocity_v_per_s);
        let away_then = away * response.place_of_place + velocity * response.place_of_velocity;
        let velocity_then = away * response.velocity_of_place + velocity * response.velocity_of_velocity;
        // The integral of the equation itself.
        let integral = -(inertia_s2 * (velocity_then - velocity) + tau * (away_then - away));
        (self.place_v, self.velocity_v_per_s) = (target_v + away_then, velocity_then);
        if duration_s > 0.0 { target_v + integral / duration_s } else { self.place_v }
    }
}

/// What becomes of a spool's distance from its target and of its velocity within a duration.
#[derive(Clone, Copy)]
struct Response {
    place_of_place: f64,
    place_of_velocity: f64,
    velocity_of_place: f64,
    velocity_of_velocity: f64,
}

impl Response {
    fn after(lag: &Terms<f64>, duration_s: f64) -> Self {
        // Real part of the two eigenvalues, and their product.
        let sigma = 0.5 / (lag.inertia * lag.time_constant_s);
        let product = 1.0 / (lag.inertia * lag.time_constant_s.powi(2));
        let discriminant = sigma * sigma - product;
        let root = discriminant.abs().sqrt();
        // exp(-sigma t) times the cosine and the sine over the root, circular or hyperbolic.
        let (cosine, sine) = if discriminant > 0.0 {
            let [slow, fast] = [product / (sigma + root), sigma + root].map(|rate| (-rate * duration_s).exp());
            (0.5 * (slow + fast), 0.5 * (slow - fast) / root)
        } else {
            let decay = (-sigma * duration_s).exp();
            let (sine, cosine) = (root * duration_s).sin_cos();
            (decay * cosine, decay * if root > 0.0 { sine / root } else { duration_s })
        };
        Self {
            place_of_place: cosine + sigma * sine,
            place_of_velocity: sine,
            velocity_of_place: -product * sine,
            velocity_of_velocity: cosine - sigma * sine,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn place_mean_and_memory_are_those_of_the_equation_at_any_damping() {
        let tau = 2.0e-3;
        for inertia in [0.0, 0.01, 0.25, 0.4, 1.5] {
            let lag = Terms { time_constant_s: tau, inertia };
            let mut spool = Spool::of(lag).expect("a lag");
            // By many small steps of the trapezoidal rule, which are stable however fast the faster eigenvalue is.
            let (steps, mut w, mut r) = (20_000, 0.0, 0.0);
            for (target, duration) in [(1.0, 1.0e-3), (1.0, 0.6e-3), (-0.5, 1.0e-3), (0.3, 0.4e-3), (0.3, 5.0e-3)] {
                let h = 0.5 * duration / f64::from(steps);
                let mut sum = 0.0;
                for _ in 0..steps {
                    let before = w;
                    if inertia > 0.0 {
                        let (a, b) = (1.0 / (inertia * tau * tau), 1.0 / (inertia * tau));
                        // (1 - h J) x' = (1 + h J) x + 2 h c
                        let (right_w, right_r) = (w + h * r, r + h * (-a * w - b * r) + 2.0 * h * a * target);
                        let determinant = 1.0 + h * b + h * h * a;
                        let next_w = (right_w * (1.0 + h * b) + h * right_r) / determinant;
                        r = (right_r - h * a * right_w) / determinant;
                        w = next_w;
                    } else {
                        w += 2.0 * h * (target - w) / (tau + h);
                    }
                    sum += 0.5 * (before + w);
                }
                let mean = spool.follow(target, duration);
                let expected = sum / f64::from(steps);
                assert!((mean - expected).abs() < 2.0e-6, "inertia {inertia}: mean {mean} instead of {expected}");
                assert!((spool.place_v() - w).abs() < 2.0e-6, "inertia {inertia}: {} instead of {w}", spool.place_v());
            }
            // A duration of nothing changes nothing, and what rests stays.
            let place = spool.place_v();
            assert!((spool.follow(7.0, 0.0) - place).abs() < 1.0e-12);
            spool.rest_at(0.25);
            assert!((spool.follow(0.25, 0.01) - 0.25).abs() < 1.0e-12 && (spool.place_v() - 0.25).abs() < 1.0e-12);
        }
        assert!(Spool::of(Terms::default()).is_none());
    }

    #[test]
    fn with_next_to_no_inertia_it_is_a_lag_of_first_order() {
        let [mut with, mut without] =
            [1.0e-12, 0.0].map(|inertia| Spool::of(Terms { time_constant_s: 2.0e-3, inertia }).expect("a lag"));
        for (target, duration) in [(1.0, 1.0e-3), (-0.5, 0.3e-3), (0.3, 5.0e-3)] {
            let [mean, expected] = [&mut with, &mut without].map(|spool| spool.follow(target, duration));
            assert!((mean - expected).abs() < 1.0e-9, "{mean} instead of {expected}");
            assert!((with.place_v() - without.place_v()).abs() < 1.0e-9);
        }
    }
}
