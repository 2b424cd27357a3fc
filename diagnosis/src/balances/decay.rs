//! What is left of a difference after a time: `exp(-t / time constant)`, kept for the last few times.

/// What was computed for the last few durations, the latest first: a delayed command cuts each interval in two, and a spool that travels
/// is followed in parts of either.
#[derive(Clone, Copy)]
pub(super) struct LastFew<T>([Option<(f64, T)>; 4]);

impl<T: Copy> LastFew<T> {
    /// Of none yet.
    pub(super) fn none() -> Self {
        Self([None; 4])
    }

    /// What was computed for this duration in s, or is now.
    #[inline(always)]
    pub(super) fn of(&mut self, duration_s: f64, compute: impl FnOnce() -> T) -> T {
        // Intervals of an even clock differ by rounding.
        let alike = |(known_s, _): &&(f64, T)| (duration_s - known_s).abs() <= 1.0e-9 * duration_s;
        if let Some((_, known)) = self.0.iter().flatten().find(alike) {
            return *known;
        }
        let new = compute();
        self.0.rotate_right(1);
        self.0[0] = Some((duration_s, new));
        new
    }
}

/// The decay of a first-order lag.
#[derive(Clone, Copy)]
pub(super) struct Decay {
    time_constant_s: f64,
    last: LastFew<f64>,
}

impl Decay {
    /// Of a lag with this time constant, s; `None` for one too short to be told from none.
    pub(super) fn of(time_constant_s: f64) -> Option<Self> {
        (time_constant_s > 1.0e-6).then(|| Self { time_constant_s, last: LastFew::none() })
    }

    /// The part of a difference that is left after a time in s.
    #[inline(always)]
    pub(super) fn after(&mut self, duration_s: f64) -> f64 {
        self.last.of(duration_s, || (-duration_s / self.time_constant_s).exp())
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
