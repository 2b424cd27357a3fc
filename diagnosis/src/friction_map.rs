//! Friction from logs with a measured force, and on what it depends. The unit of inference is the recording.
//!
//! Where position, one chamber pressure and the force at the rod are measured and the motion is slow, the force balance
//! needs no valve: `r = A (p_a - p_b) + f_ext` is friction (with the sign of the motion) plus any force that keeps its
//! sign. Half the difference of the two directions is friction, half the sum is the rest. Recordings of the same rig at
//! several pressures are the unit of inference: what differs from one run to the next for unknown reasons (temperature,
//! grease, sensor zero) is the same for all samples of a run, so these count as one observation.

use crate::data::smoothing::{Smoothed, parabola};
use nalgebra::{DMatrix, DVector};
use rig_files::{Log, RigFile};
use serde::Serialize;

/// Samples on either side when taking the velocity.
const VELOCITY_REACH: usize = 7;
/// Slower than this part of the usual speed is a reversal, not sliding.
const SLOW: f64 = 0.3;
/// Behind a reversal the bristles need a way to bend; this part of the travelled range is left out.
const REVERSAL: f64 = 0.05;
/// Fewer sliding samples in one direction say nothing.
const LEAST_SAMPLES: usize = 100;
/// A ripple line must stand out of its neighbourhood in the spectrum by this factor.
const LINE_FACTOR: f64 = 4.0;
/// Shortest wavelength looked for, in sample spacings.
const SHORTEST_SPACINGS: f64 = 5.0;
/// Longest wavelength looked for: this part of the travelled range.
const LONGEST: f64 = 0.25;
/// Spacing of the spectrum in periods over the range.
const SPECTRUM_STEP: f64 = 0.25;

/// Why no friction map can be made.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum FrictionMapError {
    /// A column is missing.
    #[error("has no column `{column}`: a friction map needs y_m, f_ext_n and at least one of p_a_pa and p_b_pa")]
    Missing {
        /// Which log, counted from 0.
        log: usize,
        /// Its name.
        column: &'static str,
    },
    /// The piston does not slide in both directions.
    #[error("has too little sliding in one direction: record strokes in both directions at a slow, steady speed")]
    NoMotion {
        /// Which log, counted from 0.
        log: usize,
    },
}

/// What one recording shows.
#[derive(Clone, Debug, Serialize)]
pub struct FrictionRun {
    /// Mean gauge pressure difference across the piston while sliding, Pa.
    pub pressure_pa: f64,
    /// Mean speed, m/s.
    pub speed_m_per_s: f64,
    /// Half the force loop: friction, N.
    pub friction_n: f64,
    /// Half the sum of both directions: force that keeps its sign when the motion reverses, N.
    pub bias_n: f64,
    /// Amplitude of the ripple at the common wavelength, N; 0 where there is none.
    pub ripple_n: f64,
    /// Sliding samples.
    pub samples: usize,
}

/// A value with its standard error and whether the runs establish it.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Finding {
    /// Value, SI.
    pub value: f64,
    /// Standard error from the scatter between runs, SI.
    pub std_error: f64,
    /// Beyond the 1 % level of Student's t, and better on runs left out.
    pub established: bool,
}

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

/// Error of one model on the runs left out of its fit.
#[derive(Clone, Debug, Serialize)]
pub struct Stage {
    /// What the model contains, in words.
    pub model: &'static str,
    /// Root-mean-square error, N, over all runs, each predicted from the others.
    pub holdout_rmse_n: f64,
    /// Whether it is kept: established and better than the stage before.
    pub kept: bool,
}

/// What friction depends on.
#[derive(Clone, Debug, Serialize)]
pub struct FrictionMap {
    /// The recordings.
    pub runs: Vec<FrictionRun>,
    /// Friction at zero pressure difference, N.
    pub friction_n: Finding,
    /// Growth of friction with pressure, N/Pa.
    pub pressure_n_per_pa: Finding,
    /// Growth of friction with speed between the runs, at equal pressure, N s/m.
    pub speed_n_s_per_m: Finding,
    /// Force that keeps its sign when the motion reverses, mean over the runs, N.
    pub bias_n: Finding,
    /// Its growth with pressure, N/Pa.
    pub bias_n_per_pa: Finding,
    /// The same bias read as friction that differs by direction, relative to friction.
    pub asymmetry: f64,
    /// The same bias read as an area (or force gain) other than nominal, relative.
    pub area_error: f64,
    /// The ripple, if a line stands out.
    pub ripple: Option<RippleLine>,
    /// Models in order, each on runs left out.
    pub stages: Vec<Stage>,
    /// Spectrum of the ripple: wavelength, m, and explained part of the variance.
    #[serde(skip)]
    pub spectrum: Vec<(f64, f64)>,
    /// Per run: position, m, signed residual force, N, and direction of motion.
    #[serde(skip)]
    pub scatter: Vec<Vec<(f64, f64, f64)>>,
}

/// One sliding sample.
#[derive(Clone, Copy)]
struct Sample {
    y: f64,
    r: f64,
    p: f64,
    direction: f64,
    /// Residual without mean and slope of its stroke.
    flat: f64,
    late: bool,
}

struct Run {
    samples: Vec<Sample>,
    summary: FrictionRun,
    spacing_m: f64,
    range_m: f64,
}

/// Maps friction from recordings of one rig, best at several pressures.
///
/// # Errors
/// A log lacks a column or does not slide in both directions.
pub fn friction_map(rig: &RigFile, logs: &[&Log]) -> Result<FrictionMap, FrictionMapError> {
    let mut runs = logs.iter().enumerate().map(|(place, log)| run(rig, log, place)).collect::<Result<Vec<_>, _>>()?;
    let (ripple, spectrum) = ripple(&runs);
    let ripple = ripple.map(|line| confirmed(line, &runs));
    if let Some(line) = &ripple {
        for run in &mut runs {
            let part = run.samples.iter().collect::<Vec<_>>();
            let (a, b) = phase(&part, line.wavelength_m, line.turns_with_motion);
            run.summary.ripple_n = a.hypot(b);
        }
    }
    let summaries: Vec<FrictionRun> = runs.iter().map(|run| run.summary.clone()).collect();
    let column = |get: fn(&FrictionRun) -> f64| summaries.iter().map(get).collect::<Vec<f64>>();
    let (pressure, speed) = (column(|r| r.pressure_pa), column(|r| r.speed_m_per_s));
    let (friction, bias) = (column(|r| r.friction_n), column(|r| r.bias_n));
    let stages = stages(&runs, ripple.as_ref());
    let gains = |later: usize| stages.get(later).is_some_and(|stage| stage.kept);

    let line = regress(&friction, &[&pressure]);
    let with_speed = regress(&friction, &[&pressure, &speed]);
    let mean_bias = regress(&bias, &[]);
    let bias_line = regress(&bias, &[&pressure]);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let load: Vec<f64> = pressure.iter().map(|p| p * rig.rig.cylinder.area_m2).collect();
    let square: f64 = load.iter().map(|f| f * f).sum();
    let mut map = FrictionMap {
        friction_n: line[0],
        pressure_n_per_pa: line.get(1).copied().unwrap_or(NOTHING),
        speed_n_s_per_m: with_speed.get(2).copied().unwrap_or(NOTHING),
        bias_n: mean_bias[0],
        bias_n_per_pa: bias_line.get(1).copied().unwrap_or(NOTHING),
        asymmetry: mean(&bias) / mean(&friction),
        area_error: -load.iter().zip(&bias).map(|(f, b)| f * b).sum::<f64>() / square.max(1e-12),
        scatter: runs.iter().map(|run| run.samples.iter().map(|s| (s.y, s.r, s.direction)).collect()).collect(),
        runs: summaries,
        ripple,
        stages: Vec::new(),
        spectrum,
    };
    map.pressure_n_per_pa.established &= gains(1);
    map.bias_n.established &= gains(2);
    // Chance would make it better in half of the recordings.
    map.ripple = map.ripple.filter(|line| line.holdout_gain > 0.0 && 4 * line.better_in >= 3 * logs.len());
    map.stages = stages;
    Ok(map)
}

fn run(rig: &RigFile, log: &Log, place: usize) -> Result<Run, FrictionMapError> {
    let missing = |column| FrictionMapError::Missing { log: place, column };
    let force = log.f_ext_n.as_deref().ok_or(missing("f_ext_n"))?;
    if log.p_a_pa.is_none() && log.p_b_pa.is_none() {
        return Err(missing("p_a_pa"));
    }
    let atmosphere = rig.rig.supply.atmosphere_pa;
    let pressure = |column: &Option<Vec<f64>>, k: usize| column.as_ref().map_or(atmosphere, |p| p[k]);
    let rows: Vec<(f64, f64, f64, f64)> = (0..log.len())
        .map(|k| (log.t_s[k], log.y_m[k], pressure(&log.p_a_pa, k) - pressure(&log.p_b_pa, k), force[k]))
        .filter(|(_, y, p, f)| y.is_finite() && p.is_finite() && f.is_finite())
        .collect();
    let t: Vec<f64> = rows.iter().map(|row| row.0).collect();
    let y: Vec<f64> = rows.iter().map(|row| row.1).collect();
    let mut motion = Smoothed::default();
    parabola(&t, &y, VELOCITY_REACH, &mut motion);
    let no_motion = FrictionMapError::NoMotion { log: place };
    let (low, high) = y.iter().fold((f64::MAX, f64::MIN), |(a, b), y| (a.min(*y), b.max(*y)));
    let range_m = high - low;
    let mut speeds: Vec<f64> = motion.slope.iter().map(|v| v.abs()).collect();
    if speeds.len() < LEAST_SAMPLES || range_m <= 0.0 {
        return Err(no_motion);
    }
    let at = speeds.len() * 3 / 4;
    let usual = *speeds.select_nth_unstable_by(at, f64::total_cmp).1;

    let mut samples: Vec<Sample> = Vec::new();
    let mut strokes: Vec<(usize, usize)> = Vec::new();
    let (mut direction, mut turned_at, mut begun) = (0.0, 0.0, 0);
    let mut travelled = 0.0;
    for (k, row) in rows.iter().enumerate() {
        let v = motion.slope[k];
        if v.abs() < SLOW * usual {
            continue;
        }
        if v.signum() != direction {
            (direction, turned_at) = (v.signum(), row.1);
            strokes.push((begun, samples.len()));
            begun = samples.len();
        }
        if (row.1 - turned_at).abs() < REVERSAL * range_m {
            continue;
        }
        travelled += v.abs();
        let r = rig.rig.cylinder.area_m2 * row.2 + row.3;
        samples.push(Sample { y: row.1, r, p: row.2, direction, flat: 0.0, late: 2 * k > rows.len() });
    }
    strokes.push((begun, samples.len()));
    for (from, to) in strokes {
        flatten(&mut samples[from..to]);
    }
    let of = |sign: f64| samples.iter().filter(move |s| s.direction == sign);
    let mean = |sign: f64| of(sign).map(|s| s.r).sum::<f64>() / of(sign).count() as f64;
    if of(1.0).count() < LEAST_SAMPLES || of(-1.0).count() < LEAST_SAMPLES {
        return Err(no_motion);
    }
    let (up, down, n) = (mean(1.0), mean(-1.0), samples.len());
    let speed = travelled / n as f64;
    let spacing_m = speed * (t[t.len() - 1] - t[0]) / t.len() as f64;
    let summary = FrictionRun {
        pressure_pa: samples.iter().map(|s| s.p).sum::<f64>() / n as f64,
        speed_m_per_s: speed,
        friction_n: 0.5 * (up - down),
        bias_n: 0.5 * (up + down),
        ripple_n: 0.0,
        samples: n,
    };
    Ok(Run { samples, summary, spacing_m, range_m })
}

/// Takes mean and slope out of a stroke, so that only its shape along the way is left.
fn flatten(stroke: &mut [Sample]) {
    let n = stroke.len() as f64;
    if n < 8.0 {
        return;
    }
    let (y0, r0) = stroke.iter().fold((0.0, 0.0), |(y, r), s| (y + s.y / n, r + s.r / n));
    let (xy, xx) =
        stroke.iter().fold((0.0, 1.0e-30), |(xy, xx), s| (xy + (s.y - y0) * (s.r - r0), xx + (s.y - y0) * (s.y - y0)));
    for s in stroke {
        s.flat = s.r - r0 - xy / xx * (s.y - y0);
    }
}

/// Sine and cosine amplitudes of a ripple, N, about position zero.
fn phase(samples: &[&Sample], wavelength_m: f64, turns: bool) -> (f64, f64) {
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
fn ripple(runs: &[Run]) -> (Option<RippleLine>, Vec<(f64, f64)>) {
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
            let middle = around.len() / 2;
            let usual = *around.select_nth_unstable_by(middle, f64::total_cmp).1;
            let prominence = part / usual.max(1e-12);
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
fn confirmed(mut line: RippleLine, runs: &[Run]) -> RippleLine {
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

/// Models from poor to rich, each judged on runs that took no part in its fit.
fn stages(runs: &[Run], line: Option<&RippleLine>) -> Vec<Stage> {
    let names = [
        "constant friction",
        "+ growing with pressure",
        "+ a part that differs by direction",
        "+ ripple along the stroke",
    ];
    let mut squares = [0.0; 4];
    let mut count = 0.0;
    for (out, run) in runs.iter().enumerate() {
        let others: Vec<&FrictionRun> =
            runs.iter().enumerate().filter(|(k, _)| *k != out).map(|(_, run)| &run.summary).collect();
        let friction: Vec<f64> = others.iter().map(|r| r.friction_n).collect();
        let pressure: Vec<f64> = others.iter().map(|r| r.pressure_pa).collect();
        let bias = mean(&others.iter().map(|r| r.bias_n).collect::<Vec<_>>());
        let slope = regress(&friction, &[&pressure]);
        // The phase depends on the run's zero: the first half of the run gives it, the second is predicted.
        let early: Vec<&Sample> = run.samples.iter().filter(|s| !s.late).collect();
        let (a, b) = line.map_or((0.0, 0.0), |line| phase(&early, line.wavelength_m, line.turns_with_motion));
        for s in run.samples.iter().filter(|s| s.late) {
            let constant = s.direction * mean(&friction);
            let grows = match slope.get(1) {
                Some(k) if others.len() > 2 => s.direction * (slope[0].value + k.value * s.p),
                _ => constant,
            };
            let ripple = line.map_or(0.0, |line| {
                let (sin, cos) = (core::f64::consts::TAU / line.wavelength_m * s.y).sin_cos();
                (a * sin + b * cos) * if line.turns_with_motion { s.direction } else { 1.0 }
            });
            let predicted = [constant, grows, grows + bias, grows + bias + ripple];
            for (square, predicted) in squares.iter_mut().zip(predicted) {
                *square += (s.r - predicted).powi(2);
            }
            count += 1.0;
        }
    }
    let mut stages: Vec<Stage> = Vec::new();
    for (model, square) in names.into_iter().zip(squares) {
        let rmse: f64 = (square / f64::max(count, 1.0)).sqrt();
        let kept = runs.len() > 2 && stages.last().is_none_or(|before| rmse < before.holdout_rmse_n);
        stages.push(Stage { model, holdout_rmse_n: rmse, kept });
    }
    stages
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

const NOTHING: Finding = Finding { value: 0.0, std_error: f64::INFINITY, established: false };

/// Least squares of one figure per run; the errors are those the scatter between the runs shows.
fn regress(values: &[f64], by: &[&[f64]]) -> Vec<Finding> {
    let (n, k) = (values.len(), by.len() + 1);
    let nothing = vec![NOTHING; k];
    if n == 0 {
        return nothing;
    }
    // Columns are scaled to their size: with Pa next to ones the matrix would be singular to working precision.
    let scale: Vec<f64> =
        std::iter::once(1.0).chain(by.iter().map(|c| c.iter().fold(1e-30, |m: f64, x| m.max(x.abs())))).collect();
    let x = DMatrix::from_fn(n, k, |row, column| if column == 0 { 1.0 } else { by[column - 1][row] / scale[column] });
    let y = DVector::from_column_slice(values);
    let Some(inverse) = (x.transpose() * &x).try_inverse() else { return nothing };
    let b = &inverse * x.transpose() * &y;
    let residual = (y - &x * &b).norm_squared();
    let free = n.saturating_sub(k);
    let variance = if free > 0 { residual / free as f64 } else { f64::INFINITY };
    (0..k)
        .map(|j| {
            let std_error = (variance * inverse[(j, j)]).sqrt() / scale[j];
            let value = b[j] / scale[j];
            Finding { value, std_error, established: value.abs() > student_1_percent(free) * std_error }
        })
        .collect()
}

/// Two-sided 1 % limit of Student's t.
fn student_1_percent(degrees_of_freedom: usize) -> f64 {
    const TABLE: [f64; 10] = [63.66, 9.925, 5.841, 4.604, 4.032, 3.707, 3.499, 3.355, 3.250, 3.169];
    match degrees_of_freedom {
        0 => f64::INFINITY,
        n if n <= TABLE.len() => TABLE[n - 1],
        // Never below the true limit from here on.
        n => 2.576 + 6.0 / n as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::student_1_percent;

    #[test]
    fn the_one_percent_limit_is_never_below_students_and_at_most_one_percent_above() {
        let published = [
            (1, 63.657),
            (2, 9.925),
            (5, 4.032),
            (10, 3.169),
            (11, 3.106),
            (15, 2.947),
            (30, 2.750),
            (60, 2.660),
            (120, 2.617),
        ];
        for (degrees, limit) in published {
            let found = student_1_percent(degrees);
            assert!(found > limit - 0.004 && found < 1.011 * limit, "{degrees}: {found}");
        }
    }
}
