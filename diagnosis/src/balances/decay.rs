//! What is left of a difference after a time: `exp(-t / time constant)`, kept for the last two times: a delayed command cuts each
//! interval in two.

/// The decay of a first-order lag.
#[derive(Clone, Copy)]
pub(super) struct Decay {
    time_constant_s: f64,
    /// The times asked for last, s, and what was left after them; the latest first.
    last: [(f64, f64); 2],
}

impl Decay {
    /// Of a lag with this time constant, s; `None` for one too short to be told from none.
    pub(super) fn of(time_constant_s: f64) -> Option<Self> {
        (time_constant_s > 1.0e-6).then_some(Self { time_constant_s, last: [(f64::NAN, f64::NAN); 2] })
    }

    /// The part of a difference that is left after a time in s.
    #[inline(always)]
    pub(super) fn after(&mut self, duration_s: f64) -> f64 {
        // Intervals of an even clock differ by rounding.
        let alike = |known: &(f64, f64)| (duration_s - known.0).abs() <= 1.0e-9 * duration_s;
        if let Some((_, rest)) = self.last.iter().find(|known| alike(known)) {
            return *rest;
        }
        let rest = (-duration_s / self.time_constant_s).exp();
        self.last = [(duration_s, rest), self.last[0]];
        rest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_that_of_the_time_asked_for_whichever_was_asked_before() {
        let mut decay = Decay::of(0.01).expect("long enough");
        for duration_s in [0.001, 0.001 + 1e-16, 0.0003, 0.0007, 0.0003, 0.0007, 0.001, 0.0, 0.002] {
            let expected = (-duration_s / 0.01_f64).exp();
            assert!((decay.after(duration_s) - expected).abs() < 1e-12, "{duration_s}");
        }
        assert!(Decay::of(0.0).is_none());
    }
}
