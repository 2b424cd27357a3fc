//! Readings that only repeat the one before: those of a sensor that froze, and those of a column that was sampled more slowly than
//! the rows were written. Neither is a measurement of its moment.

use crate::constants;
use rig_files::{Column, Log};
use std::borrow::Cow;
use std::ops::Range;

/// The columns of sensors. A command is held by its nature.
const SENSORS: [Column; 4] = [Column::Y, Column::PA, Column::PB, Column::PSup];
/// Of a live sensor so many rows differ from the one before: noise hardly ever repeats itself, though in coarse codes now and then.
const LIVE: f64 = 0.5;
/// Where a sensor is frozen its reading lasts so many times longer than any other: one that rests on a code does so again and again.
const ALONE: usize = 20;
/// Of a column that is held so many readings last equally long, or a whole number of times that, where the next reading happens to
/// be the same.
const EVEN: f64 = 0.95;
/// By so much of that time the length may vary, as clocks do: one row of five, none of four.
const UNEVEN: usize = 5;
/// Fewer readings show no rate.
const LEAST_READINGS: usize = 50;

/// Repeats of a column that were left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Repeats {
    pub(crate) column: Column,
    pub(crate) kind: Kind,
    /// How many rows were left out.
    pub(crate) rows: usize,
}

/// Why a column repeats readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    /// A live sensor kept one value from a time on, for so long, s.
    Frozen { from_s: f64, length_s: f64 },
    /// Each reading is held for so many rows.
    Held { for_rows: usize },
}

/// The log without repeats: blank, as missing readings are. A pressure that is frozen in most rows is left out as a whole.
pub(crate) fn left_out(log: &Log) -> (Cow<'_, Log>, Vec<Repeats>) {
    let of = |column: Column| {
        let readings = readings(log.column(column)?);
        let (kind, repeated) = held(&readings).or_else(|| frozen(log, column, &readings))?;
        let new_after = if let Kind::Held { for_rows } = kind { for_rows } else { usize::MAX };
        let repeats = |reading: &Range<usize>| {
            let begin = reading.start;
            (begin + 1..reading.end).filter(move |k| !(k - begin).is_multiple_of(new_after))
        };
        let rows: Vec<usize> = repeated.iter().flat_map(repeats).collect();
        Some((Repeats { column, kind, rows: rows.len() }, rows))
    };
    let mut found: Vec<(Repeats, Vec<usize>)> = SENSORS.into_iter().filter_map(of).collect();
    if !meet(log.len(), &found) {
        found.retain(|(repeats, _)| matches!(repeats.kind, Kind::Frozen { .. }));
    }
    let mut cleaned = Cow::Borrowed(log);
    for (Repeats { column, kind, .. }, rows) in &found {
        let mostly = matches!(kind, Kind::Frozen { .. }) && 2 * rows.len() > log.len();
        let kept = log.column(*column).filter(|_| !mostly).map(|values| {
            let mut kept = values.to_vec();
            rows.iter().for_each(|k| kept[*k] = f64::NAN);
            kept
        });
        cleaned.to_mut().set(*column, kept);
    }
    (cleaned, found.into_iter().map(|(repeats, _)| repeats).collect())
}

/// Whether columns that are held take new readings in the same rows, as far as their rates allow: only such rows can be judged.
fn meet(rows: usize, found: &[(Repeats, Vec<usize>)]) -> bool {
    let (mut fresh, mut slowest) = (vec![true; rows], 1);
    for (repeats, of) in found {
        if let Kind::Held { for_rows } = repeats.kind {
            of.iter().for_each(|k| fresh[*k] = false);
            slowest = slowest.max(for_rows);
        }
    }
    2 * slowest * fresh.into_iter().filter(|fresh| *fresh).count() >= rows
}

/// The rows that show one value each, row after row; missing ones belong to none.
fn readings(values: &[f64]) -> Vec<Range<usize>> {
    let mut at = 0;
    let runs = values.chunk_by(|one, other| one == other || one.is_nan() && other.is_nan()).map(|run| {
        at += run.len();
        (run[0], at - run.len()..at)
    });
    runs.filter(|(value, _)| value.is_finite()).map(|(_, rows)| rows).collect()
}

/// The readings of a column that are held equally long.
fn held(readings: &[Range<usize>]) -> Option<(Kind, Vec<Range<usize>>)> {
    let mut lengths: Vec<usize> = readings.iter().map(Range::len).collect();
    lengths.sort_unstable();
    let for_rows = *lengths.get(lengths.len() / 2)?;
    let uneven = |length: usize| {
        let beyond = length % for_rows;
        beyond.min(for_rows - beyond)
    };
    let even = lengths.iter().filter(|length| UNEVEN * uneven(**length) <= for_rows).count();
    let plainly = readings.len() >= LEAST_READINGS && even as f64 >= EVEN * readings.len() as f64;
    (for_rows > 1 && plainly).then(|| (Kind::Held { for_rows }, readings.to_vec()))
}

/// The longest reading of a pressure sensor that is live else, if it is frozen. A position may come from an encoder, which has no
/// noise.
fn frozen(log: &Log, column: Column, readings: &[Range<usize>]) -> Option<(Kind, Vec<Range<usize>>)> {
    let longest = readings.iter().max_by_key(|reading| reading.len())?;
    let (from_s, length_s) = (log.t_s[longest.start], log.t_s[longest.end - 1] - log.t_s[longest.start]);
    if column == Column::Y || !others_change(log, column, longest) {
        return None;
    }
    let others = || readings.iter().filter(|reading| *reading != longest).map(Range::len);
    let live = (readings.len() - 1) as f64 >= LIVE * others().sum::<usize>() as f64 && readings.len() > LEAST_READINGS;
    let alone = ALONE * others().max().unwrap_or(0) <= longest.len();
    (live && alone && length_s > constants::frozen_s())
        .then(|| (Kind::Frozen { from_s, length_s }, vec![longest.clone()]))
}

/// Whether another column changes from row to row meanwhile, as live sensors do.
pub(crate) fn others_change(log: &Log, column: Column, meanwhile: &Range<usize>) -> bool {
    let others = [Column::Y, Column::PA, Column::PB].into_iter().filter(|other| *other != column);
    others.filter_map(|other| log.column(other)).any(|values| {
        let changes = values[meanwhile.clone()].windows(2).filter(|pair| pair[0] != pair[1]).count();
        changes * 2 > meanwhile.len()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    /// A log at 1 kHz whose pressures are made from noisy readings and their places.
    fn log(value: impl Fn(&[f64], usize) -> f64) -> Log {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
        let live: Vec<f64> = (0..8_000)
            .map(|k| 4.0e5 + 5.0e4 * (3.0e-3 * f64::from(k)).sin() + 500.0 * rng.sample::<f64, _>(StandardNormal))
            .collect();
        let t_s: Vec<f64> = (0..8_000).map(|k| f64::from(k) * 1.0e-3).collect();
        let y_m: Vec<f64> = (0..8_000).map(|_| 1.0e-4 * rng.sample::<f64, _>(StandardNormal)).collect();
        Log { p_a_pa: Some((0..8_000).map(|k| value(&live, k)).collect()), t_s, y_m, ..Log::default() }
    }

    #[test]
    fn of_a_column_that_is_held_the_first_row_of_each_reading_stays() {
        let fine = log(|live, k| live[k - k % 5]);
        let (cleaned, found) = left_out(&fine);
        assert_eq!(found, [Repeats { column: Column::PA, kind: Kind::Held { for_rows: 5 }, rows: 6_400 }]);
        let kept = cleaned.column(Column::PA).expect("pressures");
        assert!(kept[5].is_finite() && kept[6..10].iter().all(|p| p.is_nan()) && kept[10].is_finite());
        // In coarse codes a reading is now and then the same as the one before.
        let coarse = left_out(&log(|live, k| (live[k - k % 5] / 250.0).round() * 250.0)).1;
        assert!(matches!(coarse[..], [Repeats { kind: Kind::Held { for_rows: 5 }, rows: 6_400, .. }]), "{coarse:?}");
    }

    #[test]
    fn of_a_sensor_that_froze_the_rest_stays() {
        let short = log(|live, k| live[k.min(6_000)]);
        let (cleaned, found) = left_out(&short);
        let kind = Kind::Frozen { from_s: 6.0, length_s: short.t_s[7_999] - short.t_s[6_000] };
        assert_eq!(found, [Repeats { column: Column::PA, kind, rows: 1_999 }]);
        assert_eq!(cleaned.column(Column::PA).expect("pressures").iter().filter(|p| p.is_finite()).count(), 6_001);
        let mut long = log(|live, k| live[k.min(3_000)]);
        assert_eq!(left_out(&long).0.column(Column::PA), None, "frozen in most rows");
        // Columns that are held in turns have no row in common.
        let held = |phase: usize| {
            log(move |live, k| live[((k + phase) / 5 * 5).min(7_999)]).column(Column::PA).map(<[f64]>::to_vec)
        };
        (long.p_a_pa, long.p_b_pa) = (held(0), held(2));
        assert_eq!(left_out(&long).1, []);
    }

    #[test]
    fn live_readings_coarse_ones_and_rests_on_one_code_are_no_repeats() {
        let coarse = |live: &[f64], k: usize| (live[k] / 2.0e3).round() * 2.0e3;
        // Twice for more than a second, on a sensor without noise.
        let rests = |_: &[f64], k: usize| 4.0e5 + 5.0e4 * (k % 4_000).min(2_500) as f64;
        for log in [log(|live, k| live[k]), log(coarse), log(rests)] {
            assert_eq!(left_out(&log).1, []);
        }
    }
}
