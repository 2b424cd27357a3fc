//! A force that repeats itself along the stroke.

use super::sliding::{Run, Sample};
use crate::statistics::median;
use serde::Serialize;

/// A line must stand out of its neighbourhood in the spectrum by this factor.
const LINE_FACTOR: f64 = 4.0;
/// Shortest wavelength looked for, in sample spacings.
const SHORTEST_SPACINGS: f64 = 5.0;
/// Longest wavelength looked for: this part of the travelled range.
const LONGEST: f64 = 0.25;
/// Spacing of the spectrum in periods over the range.
const SPECTRUM_STEP: f64 = 0.25;

/// A periodic dependence on position.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct RippleLine {
    /// Wavelength, m.
    pub wavelength_m: f64,
    /// Half the width of the spectral line, m: the wavelength is known within this.
    pub resolution_m: f64,
    /// Mean amplitude over the runs, N.
    pub amplitude_n: f64,
    /// Standard deviation of the amplitude over the runs, N.
    pub amplitude_spread_n: f64,
    /// How far the line stands out of its neighbourhood in the spectrum.
    pub prominence: f64,
    /// Part of the variance along the stroke that it takes away in the second halves of the recordings, its phase known
    /// from the first halves, 0 to 1.
    pub holdout_gain: f64,
    /// In how many recordings the second half is predicted better with it.
    pub better_in: usize,
    /// Whether the ripple changes its sign with the motion (friction) or keeps it (a force of the drive or the guide).
    pub turns_with_motion: bool,
}

impl RippleLine {
    /// Whether the line predicts second halves of recordings: chance would make it better in half of them.
    pub(super) fn holds(&self, recordings: usize) -> bool {
        self.holdout_gain > 0.0 && 4 * self.better_in >= 3 * recordings
    }
}

/// Sine and cosine amplitudes of a ripple, N, about position zero.
pub(super) fn phase(samples: &[&Sample], wavelength_m: f64, turns: bool) -> (f64, f64) {
    let wave = core::f64::consts::TAU / wavelength_m;
    let mut m = [0.0f64; 5];
    for s in samples {
        let (sin, cos) = (wave * s.y).sin_cos();
        let r = if turns { s.flat * s.direction } else { s.flat };
        for (sum, add) in m.iter_mut().zip([sin * sin, sin * cos, cos * cos, sin * r, cos * r]) {
            *sum += add;
        }
    }
    let determinant = m[0] * m[2] - m[1] * m[1];
    if determinant.abs() < 1.0e-9 {
        return (0.0, 0.0);
    }
    ((m[3] * m[2] - m[4] * m[1]) / determinant, (m[4] * m[0] - m[3] * m[1]) / determinant)
}

fn explained(run: &Run, wavelength_m: f64, turns: bool) -> f64 {
    // Every fourth sample resolves every wavelength looked for less well, but four times as fast.
    let part: Vec<&Sample> = run.samples.iter().collect();
    let (a, b) = phase(&part, wavelength_m, turns);
    let total: f64 = run.samples.iter().map(|s| s.flat * s.flat).sum();
    0.5 * (a * a + b * b) * run.samples.len() as f64 / total.max(1e-30)
}

/// The line that stands out of the spectrum, and the spectrum itself. Positions of different recordings may have
/// different zeros: only power is compared, every run has its own phase.
pub(super) fn ripple(runs: &[Run]) -> (Option<RippleLine>, Vec<(f64, f64)>) {
    let range = runs.iter().map(|run| run.range_m).fold(f64::INFINITY, f64::min);
    let spacing = runs.iter().map(|run| run.spacing_m).fold(0.0, f64::max);
    let (fewest, most) = (1.0 / LONGEST, range / (SHORTEST_SPACINGS * spacing).max(1e-9));
    let count = (((most - fewest) / SPECTRUM_STEP) as usize).min(2000);
    let mut best: Option<(RippleLine, Vec<(f64, f64)>)> = None;
    for turns in [false, true] {
        let spectrum: Vec<(f64, f64)> = (0..count)
            .map(|step| {
                let wavelength = range / (fewest + step as f64 * SPECTRUM_STEP);
                let part = runs.iter().map(|run| explained(run, wavelength, turns)).sum::<f64>() / runs.len() as f64;
                (wavelength, part)
            })
            .collect();
        for (at, (wavelength, part)) in spectrum.iter().enumerate() {
            let peak = at > 0 && spectrum.get(at + 1).is_some_and(|next| next.1 <= *part) && spectrum[at - 1].1 < *part;
            let mut around: Vec<f64> = spectrum
                .iter()
                .filter(|(other, _)| (0.5..2.0).contains(&(other / wavelength)))
                .map(|(_, part)| *part)
                .collect();
            if !peak || around.len() < 12 {
                continue;
            }
            let prominence = part / median(&mut around).unwrap_or_default().max(1e-12);
            if prominence < LINE_FACTOR || best.as_ref().is_some_and(|(line, _)| line.prominence >= prominence) {
                continue;
            }
            let amplitudes: Vec<f64> = runs
                .iter()
                .map(|run| {
                    let (a, b) = phase(&run.samples.iter().collect::<Vec<_>>(), *wavelength, turns);
                    a.hypot(b)
                })
                .collect();
            let n = amplitudes.len() as f64;
            let mean = amplitudes.iter().sum::<f64>() / n;
            let spread = (amplitudes.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt();
            let line = RippleLine {
                wavelength_m: *wavelength,
                resolution_m: 0.5 * wavelength * wavelength / range,
                amplitude_n: mean,
                amplitude_spread_n: spread,
                prominence,
                holdout_gain: 0.0,
                better_in: 0,
                turns_with_motion: turns,
            };
            best = Some((line, spectrum.clone()));
        }
    }
    match best {
        Some((line, spectrum)) => (Some(line), spectrum),
        None => (None, Vec::new()),
    }
}

/// The line with its gain on second halves. The wavelength is that of all recordings together: leaving one of several
/// out moves it by less than its resolution.
pub(super) fn confirmed(mut line: RippleLine, runs: &[Run]) -> RippleLine {
    let (mut before, mut after) = (0.0, 0.0);
    for run in runs {
        let early: Vec<&Sample> = run.samples.iter().filter(|s| !s.late).collect();
        let (a, b) = phase(&early, line.wavelength_m, line.turns_with_motion);
        let (mut plain, mut rippled) = (0.0, 0.0);
        for s in run.samples.iter().filter(|s| s.late) {
            let (sin, cos) = (core::f64::consts::TAU / line.wavelength_m * s.y).sin_cos();
            let predicted = (a * sin + b * cos) * if line.turns_with_motion { s.direction } else { 1.0 };
            plain += s.flat * s.flat;
            rippled += (s.flat - predicted).powi(2);
        }
        line.better_in += usize::from(rippled < plain);
        before += plain;
        after += rippled;
    }
    line.holdout_gain = 1.0 - after / f64::max(before, 1e-30);
    line
}
