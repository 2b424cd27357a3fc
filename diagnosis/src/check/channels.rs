//! What single columns lose: values that stand still, readings at a limit, rows too far apart, a piston that hardly moves.

use super::{Flaw, Weight};
use crate::balances::motion;
use crate::constants;
use crate::data::hum::Hum;
use crate::data::outliers::Outlier;
use crate::data::record::Record;
use crate::data::repeats::{Kind, Repeats, others_change};
use crate::errors::LEAST_SAMPLES;
use core::ops::Range;
use plant_model::Short;
use rig_files::{Column, Log, RigFile};

fn loss(problem: String, remedy: &str) -> Flaw {
    Flaw { weight: Weight::Loss, problem, remedy: remedy.to_string() }
}

/// Hum that was subtracted.
pub(crate) fn hum(found: &Hum) -> Flaw {
    let name = found.column.name();
    let (amplitude, unit) =
        if found.column == Column::Y { (found.amplitude * 1.0e6, "um") } else { (found.amplitude, "Pa") };
    loss(
        format!("{name} carries hum of the mains, {:.1} Hz with an amplitude of {amplitude:.0} {unit}", found.hz),
        "it is subtracted; shield the sensor's cable and supply it from a clean source",
    )
}

/// Readings that were left out because they repeat others.
pub(crate) fn repeats(found: &Repeats) -> Flaw {
    let name = found.column.name();
    match found.kind {
        Kind::Frozen { from_s, length_s } => loss(
            format!("{name} does not change for {:.1} s, from {:.3} s on", Short(length_s), Short(from_s)),
            "it is not judged there; check the sensor and the logger's channel: a live sensor has noise",
        ),
        Kind::Held { for_rows } => loss(
            format!(
                "{name} has a new reading in one of {for_rows} rows only: it was sampled more slowly than the others"
            ),
            "only rows with new readings are judged; record all columns at one rate",
        ),
    }
}

/// Single readings that were left out, column by column.
pub(crate) fn isolated(outliers: &[Outlier]) -> Vec<Flaw> {
    let by_column = outliers.chunk_by(|one, other| one.column == other.column);
    let told = by_column.map(|of| {
        let (count, Outlier { column, t_s, value, expected }) = (of.len(), of[0]);
        let (name, [value, t_s]) = (column.name(), [value, t_s].map(Short));
        let readings = if count == 1 { "one reading".to_string() } else { format!("{count} readings, each") };
        let first = if count == 1 { "" } else { "the first " };
        loss(
            format!("{name} has {readings} far from those before and after: {first}{value} at {t_s} s, where about {expected:.5e} is due"),
            "such rows are left out; look for a loose contact, or for the logger's mark of a missing value",
        )
    });
    told.collect()
}

/// What is lost, column by column.
pub(crate) fn losses(rig: &RigFile, log: &Log, rows: &Record) -> Vec<Flaw> {
    let mut out = Vec::new();
    for column in [Column::Y, Column::PA, Column::PB, Column::PSup] {
        let Some(values) = log.column(column) else { continue };
        let name = column.name();
        let frozen = frozen(values);
        let frozen_s = if frozen.is_empty() { 0.0 } else { log.t_s[frozen.end - 1] - log.t_s[frozen.start] };
        if frozen_s > constants::frozen_s() && others_change(log, column, &frozen) {
            out.push(loss(
                format!("{name} does not change for {:.1} s while other columns do", Short(frozen_s)),
                "check the sensor and the logger's channel: a live sensor has noise",
            ));
        }
        let at_limit = at_limit(values, column == Column::Y);
        if at_limit > constants::clipped_part() {
            out.push(loss(
                format!(
                    "{name} reads one extreme value in {:.0} % of the rows: its range ends there",
                    100.0 * at_limit
                ),
                "those rows are not judged; widen the sensor's or the logger's range",
            ));
        }
    }
    let interval_s = rows.quality.interval_s;
    if interval_s > constants::close_rows() {
        out.push(loss(
            format!(
                "rows come every {:.1} ms: what happens between them, like lags and delays of a few ms, shows less",
                Short(interval_s * 1e3)
            ),
            "record at 1 kHz if such effects matter",
        ));
    }
    if rows.quality.jitter > constants::uneven_rows() {
        out.push(loss(
            format!("the time between rows varies by {:.0} %", 100.0 * rows.quality.jitter),
            "nothing, if t_s is the time of sampling; if it is that of writing, record with a steady clock",
        ));
    }
    if rows.stretches.iter().all(|s| !s.held_back) {
        out.push(loss(
            "the log is too short to hold a part back: what is found cannot be confirmed on data that took no part in it".into(),
            "record 10 s or more",
        ));
    }
    if !motion::moves(rows) {
        out.push(loss(
            "the piston hardly moves: mechanics are not judged".into(),
            "record strokes both ways, best the sequence of `plant-sim experiment`",
        ));
    }
    if let Some(u) = log.column(Column::U) {
        let most = rig.rig.valve.max_voltage_v;
        let (low, high) =
            u.iter().filter(|u| u.is_finite()).fold((f64::MAX, f64::MIN), |(a, b), u| (a.min(*u), b.max(*u)));
        if high - low < constants::least_command() * most {
            let [low, high] = [low, high].map(Short);
            out.push(loss(
                format!("the command stays between {low:.2} and {high:.2} V: little of the valve is seen"),
                "record with larger steps, best the sequence of `plant-sim experiment`",
            ));
        }
    }
    out
}

/// The columns of sensors that were recorded, if none of them ever changes.
pub(crate) fn dead(log: &Log) -> Option<String> {
    let sensors = [Column::Y, Column::PA, Column::PB, Column::PSup].into_iter();
    let sensors: Vec<(Column, &[f64])> = sensors.filter_map(|c| Some((c, log.column(c)?))).collect();
    let still = |values: &[f64]| frozen(values).len() == values.len();
    let names: Vec<&str> = sensors.iter().map(|(column, _)| column.name()).collect();
    (log.len() >= LEAST_SAMPLES && sensors.iter().all(|(_, values)| still(values))).then(|| names.join(", "))
}

/// Two columns of pressures that hold the same readings, though they change.
pub(crate) fn alike(log: &Log) -> Option<(&'static str, &'static str)> {
    let all = [Column::PA, Column::PB, Column::PSup];
    let mut pairs =
        all.into_iter().enumerate().flat_map(|(at, one)| all[at + 1..].iter().map(move |other| (one, *other)));
    let same = |(one, other): &(Column, Column)| {
        let (Some(a), Some(b)) = (log.column(*one), log.column(*other)) else { return false };
        let both: Vec<(&f64, &f64)> = a.iter().zip(b).filter(|(a, b)| a.is_finite() && b.is_finite()).collect();
        // What rests on one code in both, such as vented chambers, is alike by chance.
        let changes = || both.windows(2).any(|rows| rows[0].0 != rows[1].0);
        both.len() >= LEAST_SAMPLES && both.iter().all(|(a, b)| a == b) && changes()
    };
    pairs.find(same).map(|(one, other)| (one.name(), other.name()))
}

/// The longest run of rows in which a column keeps one value.
fn frozen(values: &[f64]) -> Range<usize> {
    let (mut longest, mut start) = (0..0, 0);
    for k in 0..values.len() {
        if values[k] != values[start] {
            start = k;
        }
        if k + 1 - start > longest.len() {
            longest = start..k + 1;
        }
    }
    longest
}

/// The part of the rows that read the highest value of the column, or, if that can be a limit too, the lowest: a pressure rests
/// at atmosphere.
fn at_limit(values: &[f64], at_low: bool) -> f64 {
    let finite: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    let (low, high) = finite.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
    let extreme = |limit: f64| finite.iter().filter(|x| **x == limit).count();
    let most = extreme(high).max(if at_low { extreme(low) } else { 0 });
    if low >= high { 0.0 } else { most as f64 / finite.len() as f64 }
}
