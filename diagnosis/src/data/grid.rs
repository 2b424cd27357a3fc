//! A log of distant samples, with further ones between them by interpolation: the balances run in short steps, whatever
//! the logger's rate. Innovations are formed where something was measured, nowhere else.

use super::command::FasterLoop;
use super::record::Record;
use super::smoothing::Smoothed;
use super::spline::{self, hermite};
use super::split::{Stretch, interrupted, pieces};
use crate::constants;

/// What the command did between two rows of the log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Between {
    /// It was held: controller and log have one clock.
    Held,
    /// It moved on, nobody knows how: the controller is faster than the log.
    Moved(FasterLoop),
}

/// Where the entries of the grid lie among the measured rows.
struct Grid {
    /// For each entry the row before it, and the part of the way to the next one.
    places: Vec<(usize, f64)>,
    /// For each row its entry.
    rows: Vec<usize>,
}

impl Grid {
    fn new(t_s: &[f64], usual_s: f64) -> Self {
        let mut out = Self { places: Vec::with_capacity(t_s.len()), rows: Vec::with_capacity(t_s.len()) };
        for k in 0..t_s.len() {
            out.rows.push(out.places.len());
            let bridged = k + 1 < t_s.len() && !interrupted(t_s, k + 1, usual_s);
            let parts = if bridged { parts(t_s[k + 1] - t_s[k]) } else { 1 };
            out.places.extend((0..parts).map(|part| (k, part as f64 / parts as f64)));
        }
        out
    }

    /// A signal, linear between rows.
    fn linear(&self, signal: &[f64]) -> Vec<f64> {
        if signal.is_empty() {
            return Vec::new();
        }
        let at = |(k, part): &(usize, f64)| {
            let next = signal.get(k + 1).copied().unwrap_or(signal[*k]);
            signal[*k] + (next - signal[*k]) * part
        };
        self.places.iter().map(at).collect()
    }

    /// A smooth signal: the cubic that has its values and slopes at the rows (Hermite).
    fn cubic(&self, t_s: &[f64], signal: &Smoothed) -> Smoothed {
        let mut out = Smoothed::default();
        if signal.value.is_empty() {
            return out;
        }
        for (k, x) in &self.places {
            let (from, slope) = (signal.value[*k], signal.slope[*k]);
            if *x == 0.0 || k + 1 >= t_s.len() {
                out.value.push(from);
                out.slope.push(slope);
                continue;
            }
            let [value, slope] =
                hermite([from, signal.value[k + 1]], [slope, signal.slope[k + 1]], t_s[k + 1] - t_s[*k], *x);
            out.value.push(value);
            out.slope.push(slope);
        }
        out
    }

    /// The cubic spline through values at the rows. It sees neither across an interruption nor into the part held back.
    fn spline(&self, t_s: &[f64], stretches: &[Stretch], value: Vec<f64>) -> Smoothed {
        if value.is_empty() {
            return Smoothed::default();
        }
        let slope = spline::slopes(t_s, &value, &pieces(stretches, t_s.len()));
        self.cubic(t_s, &Smoothed { value, slope })
    }
}

/// In how many steps the balances go from one row to the next.
fn parts(interval_s: f64) -> usize {
    ((interval_s / constants::longest_step() - 1.0e-6).ceil() as usize).max(1)
}

/// A record of rows alone, refined to steps of at most `constants::longest_step`.
pub(crate) fn refined(rows: Record, command: Between) -> Record {
    let usual_s = rows.quality.interval_s;
    let grid = Grid::new(&rows.t_s, usual_s);
    let entry = |row: usize| grid.rows[row];
    let stretch = |s: &Stretch| Stretch { start: entry(s.start), end: entry(s.end - 1) + 1, ..*s };
    let flagged = |flags: &[bool]| -> Vec<bool> {
        let at = |(k, part): &(usize, f64)| flags[*k] || *part > 0.0 && flags.get(k + 1).is_some_and(|next| *next);
        if flags.is_empty() { Vec::new() } else { grid.places.iter().map(at).collect() }
    };
    let held = |signal: &[f64]| -> Vec<f64> {
        if signal.is_empty() { Vec::new() } else { grid.places.iter().map(|(k, _)| signal[*k]).collect() }
    };
    let t_s = grid.linear(&rows.t_s);
    let has_more = t_s.len() > grid.rows.len();
    let smooth = |signal: &Smoothed| {
        if has_more { grid.spline(&rows.t_s, &rows.stretches, signal.value.clone()) } else { signal.clone() }
    };
    let (u_v, commands) = match command {
        Between::Held => (held(&rows.u_v), None),
        Between::Moved(faster) => {
            let steps = faster.steps(&rows.t_s, &rows.u_v, usual_s);
            (steps.means(&t_s, usual_s), Some(steps))
        }
    };
    Record {
        u_v,
        commands,
        y_m: grid.linear(&rows.y_m),
        p_a_pa: grid.linear(&rows.p_a_pa),
        p_b_pa: grid.linear(&rows.p_b_pa),
        p_sup_pa: grid.linear(&rows.p_sup_pa),
        f_ext_n: grid.linear(&rows.f_ext_n),
        y_smooth: smooth(&rows.y_smooth),
        motion: grid.cubic(&rows.t_s, &rows.motion),
        p_a_smooth: smooth(&rows.p_a_smooth),
        p_b_smooth: smooth(&rows.p_b_smooth),
        p_sup_smooth: grid.cubic(&rows.t_s, &rows.p_sup_smooth),
        weight_a_per_pa: held(&rows.weight_a_per_pa),
        weight_b_per_pa: held(&rows.weight_b_per_pa),
        at_end: flagged(&rows.at_end),
        stretches: rows.stretches.iter().map(stretch).collect(),
        step_s: usual_s / parts(usual_s) as f64,
        measured: if has_more { grid.places.iter().map(|p| p.1 == 0.0).collect() } else { Vec::new() },
        u_rows_v: rows.u_v.clone(),
        rows: grid.rows,
        t_s,
        ..rows
    }
}

/// The cubic spline through values at the rows of a refined record, at its entries; nothing without values.
pub(crate) fn splined(record: &Record, at_rows: Vec<f64>) -> Smoothed {
    let t_s: Vec<f64> = record.rows.iter().map(|k| record.t_s[*k]).collect();
    let row_of = |entry: usize| record.rows.partition_point(|row| *row < entry);
    let of_rows = |s: &Stretch| Stretch { start: row_of(s.start), end: row_of(s.end), ..*s };
    let stretches: Vec<Stretch> = record.stretches.iter().map(of_rows).collect();
    Grid::new(&t_s, record.quality.interval_s).spline(&t_s, &stretches, at_rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::command::Missing;

    fn record(t_s: Vec<f64>, of: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64) -> Record {
        let signal =
            Smoothed { value: t_s.iter().map(|t| of(*t)).collect(), slope: t_s.iter().map(|t| slope(*t)).collect() };
        let mut out =
            Record { y_m: signal.value.clone(), u_v: signal.value.clone(), motion: signal, ..Record::default() };
        out.y_smooth = out.motion.clone();
        out.quality.interval_s = 0.01;
        out.rows = (0..t_s.len()).collect();
        out.at_end = t_s.iter().map(|t| *t == 0.05).collect();
        out.stretches = vec![Stretch { start: 0, end: t_s.len(), held_back: false }];
        out.t_s = t_s;
        out
    }

    #[test]
    fn a_cubic_passes_unchanged_and_rows_stay_what_they_were() {
        let (of, slope) = (|t: f64| 1.0 + t - 20.0 * t.powi(3), |t: f64| 1.0 - 60.0 * t * t);
        let rows = record((0..20).map(|k| 0.01 * f64::from(k)).collect(), of, slope);
        let before = rows.y_m.clone();
        let fine = refined(rows, Between::Held);
        assert_eq!(fine.len(), 19 * 5 + 1);
        for (k, t) in fine.t_s.iter().enumerate() {
            assert!((fine.motion.value[k] - of(*t)).abs() < 1.0e-12, "{t}");
            assert!((fine.motion.slope[k] - slope(*t)).abs() < 1.0e-9, "{t}");
            // The spline makes its own slopes; straight ends are forgotten within a few rows.
            let middle = (0.08..0.11).contains(t);
            assert!(!middle || (fine.y_smooth.value[k] - of(*t)).abs() < 1.0e-8, "{t}");
            assert!(!middle || (fine.y_smooth.slope[k] - slope(*t)).abs() < 1.0e-5, "{t}");
        }
        assert_eq!(fine.rows.iter().map(|k| fine.y_m[*k]).collect::<Vec<_>>(), before);
        assert!(fine.at_end[23] && fine.at_end[25] && fine.at_end[27] && !fine.at_end[20] && !fine.at_end[30]);
        assert_eq!(fine.stretches[0].end, fine.len());
        assert!((fine.to_next_row_s(5) - 0.01).abs() < 1.0e-12 && (fine.interval_s(5) - 0.002).abs() < 1.0e-12);
    }

    #[test]
    fn a_command_is_a_staircase_if_it_was_held_and_a_line_if_it_moved() {
        let rows = record((0..4).map(|k| 0.01 * f64::from(k)).collect(), |t| t, |_| 1.0);
        let held = refined(rows.clone(), Between::Held);
        assert_eq!(held.u_v[..6], [0.0, 0.0, 0.0, 0.0, 0.0, 0.01]);
        let moved = refined(rows, Between::Moved(FasterLoop { per_row: f64::INFINITY, missing: Missing::OnTheLine }));
        for k in 0..moved.len() - 1 {
            // Four levels on a line.
            assert!((moved.u_v[k] - moved.t_s[k] - 0.001).abs() < 0.00126, "{k}");
        }
    }

    #[test]
    fn close_rows_and_interruptions_get_nothing_between_them() {
        let mut rows = record(vec![0.0, 0.001, 0.002, 0.1, 0.101], |t| t, |_| 1.0);
        rows.quality.interval_s = 0.001;
        assert_eq!(refined(rows, Between::Held).len(), 5);
    }

    #[test]
    fn a_few_missing_rows_do_not_make_rows_distant() {
        // A clock that is late by a fifth of an interval, where one row is missing.
        for (interval_s, gap, interpolated, distant) in
            [(0.001, 2.2, true, false), (0.001, 1.0, false, false), (0.005, 1.0, true, true)]
        {
            let times = (0..40).map(|k| interval_s * (f64::from(k) + if k < 20 { 0.0 } else { gap - 1.0 }));
            let mut rows = record(times.collect(), |t| t, |_| 1.0);
            rows.quality.interval_s = interval_s;
            let fine = refined(rows, Between::Held);
            assert_eq!(fine.is_interpolated(), interpolated, "{interval_s} s, {gap}");
            assert_eq!(fine.has_distant_rows(), distant, "{interval_s} s, {gap}");
        }
    }
}
