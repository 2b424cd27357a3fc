//! What a positioning step is judged by, gathered tick by tick without storing the run.

/// The figures of one positioning step. Times are from the start; `None` where the event did not happen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepMetrics {
    /// From 10 % to 90 % of the step, s.
    pub rise_s: Option<f64>,
    /// Beyond the target, as a part of the step.
    pub overshoot: f64,
    /// After this time the error stays within 2 % of the step, for at least the last tenth of the run, s.
    pub settling_2_percent_s: Option<f64>,
    /// The same for 0.1 mm, s.
    pub settling_0_1_mm_s: Option<f64>,
    /// Mean of target minus position over the last third, m.
    pub steady_error_m: f64,
    /// Half the distance between the highest and the lowest position in the last third, m: the limit cycle's amplitude
    /// where it hunts, zero where it rests.
    pub hunting_m: f64,
    /// How often the position crosses the target.
    pub crossings: u32,
}

/// Observes a step from `start` to `target` over a known duration.
#[derive(Clone, Debug)]
pub struct StepObserver {
    start_m: f64,
    step_m: f64,
    tail_from_s: f64,
    at_10_s: Option<f64>,
    at_90_s: Option<f64>,
    furthest: f64,
    last_outside_2_percent: Option<f64>,
    last_outside_0_1_mm: Option<f64>,
    last_t_s: f64,
    tail_sum_m: f64,
    tail_count: u32,
    tail_low_m: f64,
    tail_high_m: f64,
    side: f64,
    crossings: u32,
}

/// The finer settling band, m.
const FINE_BAND_M: f64 = 1.0e-4;

impl StepObserver {
    /// A step from `start_m` to `target_m`, watched for `duration_s`; its last third is the steady state.
    #[must_use]
    pub fn new(start_m: f64, target_m: f64, duration_s: f64) -> Self {
        Self {
            start_m,
            step_m: target_m - start_m,
            tail_from_s: duration_s * 2.0 / 3.0,
            at_10_s: None,
            at_90_s: None,
            furthest: 0.0,
            last_outside_2_percent: None,
            last_outside_0_1_mm: None,
            last_t_s: 0.0,
            tail_sum_m: 0.0,
            tail_count: 0,
            tail_low_m: f64::INFINITY,
            tail_high_m: f64::NEG_INFINITY,
            side: 0.0,
            crossings: 0,
        }
    }

    /// Takes one sample of the true position.
    #[inline]
    pub fn see(&mut self, t_s: f64, y_m: f64) {
        let moved_m = y_m - self.start_m;
        let part = moved_m / self.step_m;
        if part >= 0.1 && self.at_10_s.is_none() {
            self.at_10_s = Some(t_s);
        }
        if part >= 0.9 && self.at_90_s.is_none() {
            self.at_90_s = Some(t_s);
        }
        self.furthest = self.furthest.max(part);
        let error_m = self.step_m - moved_m;
        if error_m.abs() > 0.02 * self.step_m.abs() {
            self.last_outside_2_percent = Some(t_s);
        }
        if error_m.abs() > FINE_BAND_M {
            self.last_outside_0_1_mm = Some(t_s);
        }
        if error_m * self.side < 0.0 {
            self.crossings += 1;
        }
        if error_m != 0.0 {
            self.side = error_m;
        }
        if t_s >= self.tail_from_s {
            self.tail_sum_m += error_m;
            self.tail_count += 1;
            self.tail_low_m = self.tail_low_m.min(y_m);
            self.tail_high_m = self.tail_high_m.max(y_m);
        }
        self.last_t_s = t_s;
    }

    /// The figures of what was seen.
    #[must_use]
    pub fn metrics(&self) -> StepMetrics {
        let settled = |last_outside: Option<f64>| match last_outside {
            None => Some(0.0),
            // Passing through the band is not settling: it has to hold for the last tenth of the run.
            Some(t_s) if t_s > 0.9 * self.last_t_s => None,
            Some(t_s) => Some(t_s),
        };
        let tail = self.tail_count > 0;
        StepMetrics {
            rise_s: self.at_10_s.zip(self.at_90_s).map(|(low, high)| high - low),
            overshoot: (self.furthest - 1.0).max(0.0),
            settling_2_percent_s: settled(self.last_outside_2_percent),
            settling_0_1_mm_s: settled(self.last_outside_0_1_mm),
            steady_error_m: if tail { self.tail_sum_m / f64::from(self.tail_count) } else { f64::NAN },
            hunting_m: if tail { 0.5 * (self.tail_high_m - self.tail_low_m) } else { f64::NAN },
            crossings: self.crossings,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observe(duration_s: f64, y: impl Fn(f64) -> f64) -> StepMetrics {
        let mut observer = StepObserver::new(0.0, 1.0, duration_s);
        for tick in 0..=(duration_s * 1000.0) as u32 {
            let t_s = f64::from(tick) * 1e-3;
            observer.see(t_s, y(t_s));
        }
        observer.metrics()
    }

    #[test]
    fn a_first_order_lag_has_its_textbook_figures() {
        let metrics = observe(10.0, |t| 1.0 - (-t).exp());
        assert!((metrics.rise_s.expect("rises") - 9.0_f64.ln()).abs() < 2e-3);
        assert!((metrics.settling_2_percent_s.expect("settles") - 50.0_f64.ln()).abs() < 2e-3);
        assert_eq!((metrics.overshoot, metrics.crossings), (0.0, 0));
    }

    #[test]
    fn crossing_the_target_just_before_the_end_is_not_settling() {
        let metrics = observe(2.0, |t| if t < 1.95 { 0.5 } else { 1.0 });
        assert_eq!((metrics.settling_2_percent_s, metrics.settling_0_1_mm_s), (None, None));
    }

    #[test]
    fn an_oscillation_is_measured_as_overshoot_crossings_and_hunting() {
        let metrics = observe(9.0, |t| 1.0 - 0.25 * (2.0 * std::f64::consts::PI * t).cos());
        assert!((metrics.overshoot - 0.25).abs() < 1e-4);
        assert!((metrics.hunting_m - 0.25).abs() < 1e-4);
        assert!(metrics.steady_error_m.abs() < 1e-3);
        assert_eq!((metrics.settling_2_percent_s, metrics.crossings), (None, 18));
    }
}
