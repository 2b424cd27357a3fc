//! Sums over entries: rates with their intervals, parameter errors, times.

use super::run::Entry;
use super::score::{Outcome, ParameterScore};
use rig_files::Verdict;

/// A share with its 95 % interval (Wilson).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rate {
    /// How many.
    pub hits: usize,
    /// Of how many.
    pub of: usize,
}

impl Rate {
    /// The share, NaN for nothing.
    #[must_use]
    pub fn share(self) -> f64 {
        self.hits as f64 / self.of as f64
    }

    /// The Wilson interval at 95 %.
    #[must_use]
    pub fn interval(self) -> (f64, f64) {
        let (n, p, z) = (self.of as f64, self.share(), 1.96_f64);
        let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        ((middle - half).max(0.0), (middle + half).min(1.0))
    }
}

/// The sums over a set of entries.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    outcomes: Vec<Option<Outcome>>,
    parameters: Vec<ParameterScore>,
    structural: Vec<bool>,
    floors: Vec<f64>,
    seconds: Vec<f64>,
    with_ties: usize,
    named: usize,
    doubted: usize,
}

impl Tally {
    /// Sums over entries.
    #[must_use]
    pub fn of<'a>(entries: impl IntoIterator<Item = &'a Entry>) -> Self {
        let mut tally = Self::default();
        for entry in entries {
            tally.seconds.push(entry.took.as_secs_f64());
            tally.outcomes.push(entry.score.as_ref().map(|score| score.outcome));
            let Some(score) = &entry.score else { continue };
            tally.parameters.extend(score.parameters.iter().cloned());
            tally.structural.extend(score.structural_tie_declared);
            tally.floors.extend(score.worst_floor_ratio);
            if let Ok(answer) = &entry.answer {
                tally.named += answer.causes.len();
                tally.with_ties += answer.causes.iter().filter(|cause| !cause.ties.is_empty()).count();
                let right = matches!(score.outcome, Outcome::Exact | Outcome::Tied);
                tally.doubted += usize::from(right && answer.verdict != Verdict::Explained);
            }
        }
        tally
    }

    /// How many entries.
    #[must_use]
    pub fn len(&self) -> usize {
        self.outcomes.len()
    }

    /// None at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.outcomes.is_empty()
    }

    /// How many ended in one of these outcomes.
    #[must_use]
    pub fn rate(&self, outcomes: &[Outcome]) -> Rate {
        let hits = self.outcomes.iter().flatten().filter(|outcome| outcomes.contains(outcome)).count();
        Rate { hits, of: self.len() }
    }

    /// How many could not be diagnosed at all.
    #[must_use]
    pub fn failed(&self) -> usize {
        self.outcomes.iter().filter(|outcome| outcome.is_none()).count()
    }

    /// Parameters within 5 % or two standard errors.
    #[must_use]
    pub fn parameters_good(&self) -> Rate {
        Rate { hits: self.parameters.iter().filter(|p| p.is_good()).count(), of: self.parameters.len() }
    }

    /// Parameters inside their 95 % intervals.
    #[must_use]
    pub fn parameters_covered(&self) -> Rate {
        Rate { hits: self.parameters.iter().filter(|p| p.is_covered()).count(), of: self.parameters.len() }
    }

    /// Median relative error of the parameters, NaN for none.
    #[must_use]
    pub fn median_parameter_error(&self) -> f64 {
        quantile(self.parameters.iter().map(|p| p.relative_error).filter(|e| e.is_finite()).collect(), 0.5)
    }

    /// Structural ties that were declared where they had to be.
    #[must_use]
    pub fn structural_ties(&self) -> Rate {
        Rate { hits: self.structural.iter().filter(|declared| **declared).count(), of: self.structural.len() }
    }

    /// Entries whose extended model predicts within `ratio` of the noise floor.
    #[must_use]
    pub fn at_floor(&self, ratio: f64) -> Rate {
        Rate { hits: self.floors.iter().filter(|found| **found <= ratio).count(), of: self.floors.len() }
    }

    /// Named causes that carry ties.
    #[must_use]
    pub fn tied_names(&self) -> Rate {
        Rate { hits: self.with_ties, of: self.named }
    }

    /// Right answers without the verdict `explained`.
    #[must_use]
    pub fn doubted(&self) -> usize {
        self.doubted
    }

    /// A quantile of the diagnosis times, s.
    #[must_use]
    pub fn seconds(&self, part: f64) -> f64 {
        quantile(self.seconds.clone(), part)
    }
}

/// The value below which `part` of the values lie; NaN for none.
fn quantile(mut values: Vec<f64>, part: f64) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    values.sort_by(f64::total_cmp);
    let at = (part * (values.len() - 1) as f64).round() as usize;
    values[at.min(values.len() - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_a_rate_contains_it_and_narrows_with_more_cases() {
        let few = Rate { hits: 9, of: 10 }.interval();
        let many = Rate { hits: 900, of: 1000 }.interval();
        assert!(few.0 < 0.9 && 0.9 < few.1);
        assert!(many.1 - many.0 < 0.2 * (few.1 - few.0));
        assert!(Rate { hits: 10, of: 10 }.interval().1 <= 1.0);
    }

    #[test]
    fn quantiles_of_few_values_are_among_them() {
        assert_eq!(quantile(vec![3.0, 1.0, 2.0], 0.5), 2.0);
        assert_eq!(quantile(vec![3.0, 1.0, 2.0], 1.0), 3.0);
        assert!(quantile(vec![], 0.5).is_nan());
    }
}
