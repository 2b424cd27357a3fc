//! The samples of a recording in which the piston slides, and the force balance at each.

use super::FrictionMapError;
use super::regression::{Finding, NOTHING, mean};
use crate::data::smoothing::{Reach, parabola};
use nalgebra::{Matrix4, Vector4};
use rig_files::{Log, RigFile};
use serde::Serialize;

/// Time on either side over which the velocity is taken: the recordings this was made for have noise of 0.05 mm at 100 Hz,
/// which leaves 0.3 mm/s of their 6 to 14 mm/s.
const VELOCITY_REACH_S: f64 = 0.07;
/// Slower than this part of the usual speed is a reversal, not sliding.
const SLOW: f64 = 0.3;
/// Behind a reversal the bristles need a way to bend; this part of the travelled range is left out.
const REVERSAL: f64 = 0.05;
/// Fewer sliding samples in one direction say nothing.
const LEAST_SAMPLES: usize = 100;

/// What one recording shows.
#[derive(Clone, Debug, Serialize)]
pub struct FrictionRun {
    /// Mean of the sum of both gauge pressures while sliding, Pa: what presses the seals on their ways. A chamber that was not
    /// measured counts as vented.
    pub pressure_pa: f64,
    /// Mean difference of the gauge pressures across the piston while sliding, Pa.
    pub difference_pa: f64,
    /// Mean speed, m/s.
    pub speed_m_per_s: f64,
    /// Speeds that nine tenths of the sliding samples lie between, m/s.
    pub speed_range_m_per_s: [f64; 2],
    /// Half the force loop: friction, N.
    pub friction_n: f64,
    /// Half the sum of both directions: force that keeps its sign when the motion reverses, N.
    pub bias_n: f64,
    /// Growth of friction with speed inside the recording, N s/m.
    pub speed_n_s_per_m: f64,
    /// Amplitude of the ripple at the common wavelength, N; 0 where there is none.
    pub ripple_n: f64,
    /// Sliding samples.
    pub samples: usize,
}

/// One sliding sample.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    /// Position, m.
    pub(super) y: f64,
    /// Force that the piston's seals and guides must bear: area times pressure difference plus measured force, N.
    pub(super) r: f64,
    /// Sum of both gauge pressures, Pa.
    pub(super) sum_pa: f64,
    /// Pressure difference across the piston, Pa.
    pub(super) difference_pa: f64,
    /// Speed, m/s.
    pub(super) speed: f64,
    /// 1 towards +y, -1 towards -y.
    pub(super) direction: f64,
    /// The force without mean and slope of its stroke, N.
    pub(super) flat: f64,
    /// Whether it belongs to the second half of its recording.
    pub(super) late: bool,
}

pub(super) struct Run {
    pub(super) samples: Vec<Sample>,
    pub(super) summary: FrictionRun,
    /// Mean way between samples, m.
    pub(super) spacing_m: f64,
    /// Way between the ends of the motion, m.
    pub(super) range_m: f64,
}

pub(super) fn run(rig: &RigFile, log: &Log, place: usize) -> Result<Run, FrictionMapError> {
    let missing = |column| FrictionMapError::Missing { log: place, column };
    let force = log.f_ext_n.as_deref().ok_or(missing("f_ext_n"))?;
    if log.p_a_pa.is_none() && log.p_b_pa.is_none() {
        return Err(missing("p_a_pa"));
    }
    let atmosphere = rig.rig.supply.atmosphere_pa;
    let gauge = |column: &Option<Vec<f64>>, k: usize| column.as_ref().map_or(0.0, |p| p[k] - atmosphere);
    let cylinder = &rig.rig.cylinder;
    // Time, position, gauge pressures, and what the seals and guides must bear.
    let rows: Vec<(f64, f64, [f64; 2], f64)> = (0..log.len())
        .map(|k| {
            let (a, b) = (gauge(&log.p_a_pa, k), gauge(&log.p_b_pa, k));
            // The atmosphere acts on the rod: gauge pressures on their areas. A chamber with a spring breathes freely.
            let b = if cylinder.is_single_acting() { 0.0 } else { b };
            let driving = cylinder.area_a_m2 * a - cylinder.area_b_m2 * b - cylinder.spring_force_n(log.y_m[k]);
            (log.t_s[k], log.y_m[k], [a, b], driving + force[k])
        })
        .filter(|(_, y, [a, b], r)| [y, a, b, r].iter().all(|x| x.is_finite()))
        .collect();
    let t: Vec<f64> = rows.iter().map(|row| row.0).collect();
    let y: Vec<f64> = rows.iter().map(|row| row.1).collect();
    let no_motion = FrictionMapError::NoMotion { log: place };
    let (low, high) = y.iter().fold((f64::MAX, f64::MIN), |(a, b), y| (a.min(*y), b.max(*y)));
    let range_m = high - low;
    if rows.len() < LEAST_SAMPLES || range_m <= 0.0 {
        return Err(no_motion);
    }
    let step_s = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
    let reach = Reach { seconds: 0.0, least: ((VELOCITY_REACH_S / step_s).round() as usize).max(2) };
    let motion = parabola(&t, &y, reach);
    let mut speeds: Vec<f64> = motion.slope.iter().map(|v| v.abs()).collect();
    let at = speeds.len() * 3 / 4;
    let usual = *speeds.select_nth_unstable_by(at, f64::total_cmp).1;

    let mut samples: Vec<Sample> = Vec::new();
    let mut strokes: Vec<(usize, usize)> = Vec::new();
    let (mut direction, mut turned_at, mut begun) = (0.0, 0.0, 0);
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
        samples.push(Sample {
            y: row.1,
            r: row.3,
            sum_pa: row.2[0] + row.2[1],
            difference_pa: row.2[0] - row.2[1],
            speed: v.abs(),
            direction,
            flat: 0.0,
            late: 2 * k > rows.len(),
        });
    }
    strokes.push((begun, samples.len()));
    for (from, to) in strokes {
        flatten(&mut samples[from..to]);
    }
    let towards = |sign: f64| samples.iter().filter(move |s| s.direction == sign).map(|s| s.r).collect::<Vec<_>>();
    let (up, down) = (towards(1.0), towards(-1.0));
    if up.len() < LEAST_SAMPLES || down.len() < LEAST_SAMPLES {
        return Err(no_motion);
    }
    let mut speeds: Vec<f64> = samples.iter().map(|s| s.speed).collect();
    let speed = mean(&speeds);
    speeds.sort_unstable_by(f64::total_cmp);
    let summary = FrictionRun {
        pressure_pa: mean(&samples.iter().map(|s| s.sum_pa).collect::<Vec<_>>()),
        difference_pa: mean(&samples.iter().map(|s| s.difference_pa).collect::<Vec<_>>()),
        speed_m_per_s: speed,
        speed_range_m_per_s: [speeds[speeds.len() / 20], speeds[speeds.len() - 1 - speeds.len() / 20]],
        friction_n: 0.5 * (mean(&up) - mean(&down)),
        bias_n: 0.5 * (mean(&up) + mean(&down)),
        speed_n_s_per_m: growth_with_speed(&samples, speed),
        ripple_n: 0.0,
        samples: samples.len(),
    };
    if summary.friction_n < 0.0 {
        return Err(FrictionMapError::Reversed { log: place });
    }
    Ok(Run { samples, summary, spacing_m: speed * step_s, range_m })
}

/// How friction grows with speed inside one recording, N s/m: least squares of the force by direction, place and speed.
/// 0 where the speed does not vary.
fn growth_with_speed(samples: &[Sample], mean_speed: f64) -> f64 {
    let middle = mean(&samples.iter().map(|s| s.y).collect::<Vec<_>>());
    let range = samples.iter().map(|s| (s.y - middle).abs()).fold(1.0e-12, f64::max);
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for s in samples {
        // Columns of size one, or the matrix would be singular to working precision.
        let row = Vector4::new(
            1.0,
            s.direction,
            (s.y - middle) / range,
            s.direction * (s.speed - mean_speed) / mean_speed.max(1.0e-12),
        );
        normal += row * row.transpose();
        right += row * s.r;
    }
    normal.try_inverse().map_or(0.0, |inverse| (inverse * right)[3] / mean_speed.max(1.0e-12))
}

/// The mean growth with speed, its error from the scatter between the recordings.
pub(super) fn mean_growth_with_speed(runs: &[FrictionRun]) -> Finding {
    let slopes: Vec<f64> = runs.iter().map(|run| run.speed_n_s_per_m).collect();
    super::regression::regress(&slopes, &[]).first().copied().unwrap_or(NOTHING)
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
