//! The log cut into stretches without interruption, and into a part for fitting and a part held back.

use super::quality::Quality;
use crate::constants;
use crate::statistics::median;
use core::ops::Range;

/// Consecutive samples without interruption, all for fitting or all held back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stretch {
    pub(crate) start: usize,
    pub(crate) end: usize,
    pub(crate) held_back: bool,
}

impl Stretch {
    pub(crate) fn range(&self) -> Range<usize> {
        self.start..self.end
    }
}

/// How many samples some stretches have.
pub(crate) fn samples(stretches: &[Stretch]) -> usize {
    stretches.iter().map(|stretch| stretch.range().len()).sum()
}

/// The median of the intervals between samples, s; `None` for fewer than two samples.
pub(crate) fn usual_interval_s(t_s: &[f64]) -> Option<f64> {
    let mut intervals: Vec<f64> = t_s.windows(2).map(|w| w[1] - w[0]).collect();
    median(&mut intervals)
}

/// Whether samples are missing before sample `k`; `usual_s` is the usual interval.
pub(crate) fn interrupted(t_s: &[f64], k: usize, usual_s: f64) -> bool {
    k > 0 && k < t_s.len() && missing_between(t_s, (k - 1, k), usual_s)
}

/// Whether samples are missing between two of them.
pub(crate) fn missing_between(t_s: &[f64], (from, to): (usize, usize), usual_s: f64) -> bool {
    t_s[to] - t_s[from] > (constants::interruption() + to.saturating_sub(from + 1) as f64) * usual_s
}

/// Cuts the samples at interruptions and where the part held back begins or ends. Writes interval, jitter and number of
/// interruptions into `quality`.
pub(crate) fn stretches(t_s: &[f64], quality: &mut Quality) -> Vec<Stretch> {
    let mut out = Vec::new();
    let Some(usual) = usual_interval_s(t_s) else {
        return Vec::new();
    };
    quality.interval_s = usual;
    let intervals = t_s.windows(2).map(|w| w[1] - w[0]);
    let regular: Vec<f64> = intervals.filter(|dt| *dt < constants::interruption() * usual).collect();
    if !regular.is_empty() {
        let square = regular.iter().map(|dt| (dt / usual - 1.0).powi(2)).sum::<f64>() / regular.len() as f64;
        quality.jitter = square.sqrt();
    }

    let len = t_s.len();
    let chunk = len.div_ceil(constants::chunks()).max(1);
    let shortest = (constants::shortest_stretch_s() / usual).ceil() as usize;
    let mut start = 0;
    for k in 1..=len {
        let interrupted = interrupted(t_s, k, usual);
        quality.interruptions += usize::from(interrupted);
        let boundary = k == len || k % chunk == 0;
        // Chunks of the same use stay together; so do a chunk and a remainder too short to stand alone.
        let held_back = |k: usize| (k / chunk) % constants::held_back_every() == constants::held_back_every() - 1;
        let changes = boundary && (k == len || held_back(k) != held_back(k - 1));
        if interrupted || changes {
            if k - start >= shortest.max(constants::least_in_a_stretch()) {
                out.push(Stretch { start, end: k, held_back: held_back(k - 1) });
            }
            start = k;
        }
    }
    out
}

/// All samples of a log of some length, cut where a stretch starts or ends.
pub(crate) fn pieces(stretches: &[Stretch], len: usize) -> Vec<Range<usize>> {
    let mut cuts: Vec<usize> = stretches.iter().flat_map(|s| [s.start, s.end]).collect();
    cuts.extend([0, len]);
    cuts.sort_unstable();
    cuts.dedup();
    cuts.windows(2).map(|w| w[0]..w[1]).collect()
}
