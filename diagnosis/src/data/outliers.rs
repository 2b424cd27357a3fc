//! Single readings that no signal can have: far from all their neighbours, which agree.

use super::noise;
use super::split::usual_interval_s;
use crate::constants;
use rig_files::{Column, Log};
use std::borrow::Cow;
use std::ops::Range;

/// The columns of sensors. A command may well be a pulse.
const SENSORS: [Column; 4] = [Column::Y, Column::PA, Column::PB, Column::PSup];
/// Neighbours on either side.
const REACH: usize = 2;

/// A reading that was left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Outlier {
    pub(crate) column: Column,
    /// When, s.
    pub(crate) t_s: f64,
    pub(crate) value: f64,
    /// The middle of its neighbours.
    pub(crate) expected: f64,
}

/// The log without such readings: blank, as missing ones are.
pub(crate) fn left_out(log: &Log) -> (Cow<'_, Log>, Vec<Outlier>) {
    let (mut cleaned, mut all) = (Cow::Borrowed(log), Vec::new());
    let are_distant = usual_interval_s(&log.t_s).is_some_and(|usual_s| usual_s > constants::distant_rows());
    for column in SENSORS {
        let Some(values) = log.column(column) else { continue };
        let found = isolated(values, are_distant);
        if found.is_empty() {
            continue;
        }
        let mut kept = values.to_vec();
        for (k, expected) in found {
            all.push(Outlier { column, t_s: log.t_s[k], value: values[k], expected });
            kept[k] = f64::NAN;
        }
        cleaned.to_mut().set(column, Some(kept));
    }
    (cleaned, all)
}

/// The places of isolated readings, each with what is expected there: a Hampel identifier (Hampel 1974) about the straight line
/// through the neighbours, whose scale is their own distance from it and the column's noise, so that motion between distant rows
/// is none. Where rows are so distant that a pressure comes and goes between them, as it does in a short chamber, the reading must
/// also lie far outside what most others span.
fn isolated(values: &[f64], are_distant: bool) -> Vec<(usize, f64)> {
    let usual = if are_distant { usual_span(values) } else { f64::NAN..f64::NAN };
    let comes_and_goes = |value: f64| {
        let beyond = constants::beyond_span() * (usual.end - usual.start);
        value > usual.start - beyond && value < usual.end + beyond
    };
    let live = values.chunk_by(|one, other| one.is_finite() == other.is_finite()).filter(|run| run[0].is_finite());
    // Rows are taken for even, here as in the line through neighbours.
    let even: Vec<f64> = (0..values.len()).map(|k| k as f64).collect();
    let noise = noise::estimate(live.map(|run| (&even[..run.len()], run)));
    let least = noise.standard_deviation.max(noise.resolution);
    let far = |window: &[f64]| -> Option<f64> {
        let value = window[REACH];
        let neighbours = [(-2.0, window[0]), (-1.0, window[1]), (1.0, window[3]), (2.0, window[4])];
        // A quick look first: almost every reading is close to the one before it.
        let close = (value - window[1]).abs() <= constants::outlier() * least;
        if close || comes_and_goes(value) || neighbours.iter().any(|(_, x)| !x.is_finite()) {
            return None;
        }
        let expected = neighbours.iter().map(|(_, x)| x).sum::<f64>() / 4.0;
        let slope = neighbours.iter().map(|(place, x)| place * x).sum::<f64>() / 10.0;
        let off = |(place, x): &(f64, f64)| (x - expected - slope * place).abs();
        let scale = neighbours.iter().map(off).fold(least, f64::max);
        (scale > 0.0 && (value - expected).abs() > constants::outlier() * scale).then_some(expected)
    };
    let windows = values.windows(2 * REACH + 1).enumerate();
    windows.filter_map(|(k, window)| Some((k + REACH, far(window)?))).collect()
}

/// What all but the rare lowest and highest readings of a column span.
fn usual_span(values: &[f64]) -> Range<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let left_out = sorted.len() / constants::rare_readings();
    match (sorted.get(left_out), sorted.iter().nth_back(left_out)) {
        (Some(low), Some(high)) => *low..*high,
        _ => f64::NAN..f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    /// A moving signal with noise.
    fn signal(rows: usize, step: f64) -> Vec<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        (0..rows).map(|k| (step * k as f64).sin() + 1.0e-3 * rng.sample::<f64, _>(StandardNormal)).collect()
    }

    #[test]
    fn a_reading_far_from_neighbours_that_agree_is_left_out_and_nothing_else() {
        let mut y = signal(20_000, 0.002);
        assert!(isolated(&y, false).is_empty());
        (y[5_000], y[9_000]) = (y[5_000] + 0.2, -3.0e5);
        assert_eq!(isolated(&y, false).iter().map(|(k, _)| *k).collect::<Vec<_>>(), [5_000, 9_000]);
        let log = Log { t_s: (0..y.len()).map(|k| k as f64 * 1.0e-3).collect(), y_m: y, ..Log::default() };
        let (cleaned, found) = left_out(&log);
        assert!(cleaned.y_m[5_000].is_nan() && cleaned.y_m[5_001].is_finite());
        assert!(
            (found[0].t_s, found[0].column) == (5.0, Column::Y) && (found[1].expected - log.y_m[8_999]).abs() < 0.01
        );
    }

    #[test]
    fn between_distant_rows_only_what_no_other_reading_comes_near_is_left_out() {
        let mut p = signal(2_000, 0.02);
        // In one row the piston comes close to its end; in another the sensor is out.
        (p[700], p[900]) = (p[700] - 1.5, p[900] - 9.0);
        let places = |are_distant| isolated(&p, are_distant).iter().map(|(k, _)| *k).collect::<Vec<_>>();
        assert_eq!((places(false), places(true)), (vec![700, 900], vec![900]));
    }

    #[test]
    fn fast_motion_between_distant_rows_a_step_and_the_codes_of_a_coarse_converter_are_none() {
        // A few rows for each swing.
        assert!(isolated(&signal(2_000, 1.3), false).is_empty());
        // A step that stays.
        let step: Vec<f64> = signal(2_000, 0.0).iter().enumerate().map(|(k, y)| y + f64::from(k > 700)).collect();
        assert!(isolated(&step, false).is_empty());
        // One code up and back, on a signal that rests.
        let coarse: Vec<f64> = (0..2_000).map(|k| 0.01 * f64::from(u8::from(k % 7 == 0))).collect();
        assert!(isolated(&coarse, false).is_empty());
    }
}
