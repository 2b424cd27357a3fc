//! A limit cycle: the piston passes a standing target again and again.

/// Counts how often a target is passed while it stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cycle {
    side: f64,
    passes: u32,
    passed: bool,
}

impl Cycle {
    /// Takes this tick's error in m; one within `limit` is on no side. `counts` says whether the target stands.
    pub fn see(&mut self, counts: bool, error: f64, limit: f64) {
        self.passed = false;
        if !counts {
            *self = Self::default();
        } else if error.abs() > limit {
            self.passed = error * self.side < 0.0;
            self.passes += u32::from(self.passed);
            self.side = error.signum();
        }
    }

    /// Whether the piston has passed the target in this tick, after it had passed it `often`.
    #[must_use]
    pub fn passed_more_than(&self, often: u32) -> bool {
        self.passed && self.passes > often
    }
}
