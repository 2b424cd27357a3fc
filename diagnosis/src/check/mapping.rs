//! Mistakes made when a logger's columns were mapped: units, signs, zeros, sides. A unit shows in the size of the numbers. All
//! others show in how badly the rig as stated predicts the log, and how well it does once the mistake is undone; signs and sides
//! also in whether command, motion and pressures turn the same way, and gauge pressures in what the supply reads.

use super::channels;
use super::direction::agreement;
use super::{Flaw, Weight};
use crate::balances::observers;
use crate::balances::shared::Signals;
use crate::constants;
use crate::data::channel::Channel;
use crate::data::grid::{Between, refined};
use crate::data::prepare::prepare;
use crate::data::record::Record;
use crate::data::split::Stretch;
use crate::estimate::likelihood::{COST_OF_NOISE, loss};
use crate::statistics::median;
use plant_model::{Plant, Short};
use rayon::prelude::*;
use rig_files::{Column, Log, RigFile};

/// A mistake, and the log without it.
pub(crate) struct Mistake {
    pub(crate) problem: String,
    pub(crate) remedy: String,
    pub(crate) undone: Log,
}

/// What contradicts the rig or itself, in a log and the record made of it.
pub(crate) fn contradictions(rig: &RigFile, log: &Log, record: &Record) -> Vec<Flaw> {
    if let Some(columns) = channels::dead(log) {
        return vec![contradiction(
            format!("no sensor changes from the first row to the last ({columns}): live ones have noise"),
            "check the sensors' supply and what the logger is connected to".into(),
        )];
    }
    if let Some((one, other)) = channels::alike(log) {
        return vec![contradiction(
            format!("{one} and {other} are the same readings: two sensors have noise of their own"),
            format!("correct `from` under [column.{one}] or [column.{other}] in the mapping"),
        )];
    }
    let units = units(rig, log);
    let misread = || turned(rig, log, record).or_else(|| supply_as_gauge(rig, log)).or_else(|| misread(rig, log));
    if units.is_empty() { misread().into_iter().collect() } else { units }
}

pub(crate) fn contradiction(problem: String, remedy: String) -> Flaw {
    Flaw { weight: Weight::Contradiction, problem, remedy }
}

/// The smallest and largest reading.
fn extent(values: &[f64]) -> Option<(f64, f64)> {
    let finite = values.iter().copied().filter(|x| x.is_finite());
    finite.map(|x| (x, x)).reduce(|(low, high), (x, _)| (low.min(x), high.max(x)))
}

/// The unit in which a reading is nearest to the supply, and its factor to Pa.
fn nearest_unit(reading: f64, supply_pa: f64) -> (&'static str, f64) {
    const UNITS: [(&str, f64); 5] =
        [("bar", 1.0e5), ("kPa", 1.0e3), ("MPa", 1.0e6), ("psi", 6_894.757_293_168), ("mbar", 1.0e2)];
    let off = |(_, factor): &(&str, f64)| (reading * factor / supply_pa).ln().abs();
    UNITS.into_iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(UNITS[0])
}

/// Numbers of another order of magnitude than the rig allows.
fn units(rig: &RigFile, log: &Log) -> Vec<Flaw> {
    let (mut out, r) = (Vec::new(), &rig.rig);
    let far = constants::unit_factor();
    if let Some((low, high)) = extent(&log.y_m)
        && high - low > far * r.cylinder.stroke_m
    {
        out.push(contradiction(
            format!(
                "y_m runs over {:.4} m, {:.0} strokes",
                Short(high - low),
                Short((high - low) / r.cylinder.stroke_m)
            ),
            "give y_m in metres: `unit = \"mm\"` under [column.y_m] in the mapping, if they are millimetres".into(),
        ));
    }
    // A sensor of a somewhat other scale reads a little beyond the stroke; no sensor reads far beyond it.
    let half = 0.5 * r.cylinder.stroke_m;
    if let Some((low, high)) = extent(&log.y_m)
        && out.is_empty()
        && (low < -half - constants::beyond_stroke() * half || high > half + constants::beyond_stroke() * half)
    {
        let [low, high, half] = [low, high, half].map(Short);
        out.push(contradiction(
            format!(
                "y_m runs from {low:.4} to {high:.4} m, but the stroke allows ±{half} m: it seems to start at an end of the stroke"
            ),
            "give y_m from mid-stroke: correct `offset` or `points` under [column.y_m] in the mapping, or the stroke in the rig file".into(),
        ));
    }
    for column in [Column::PA, Column::PB, Column::PSup] {
        let Some((_, high)) = log.column(column).and_then(extent) else { continue };
        let name = column.name();
        if high < r.supply.atmosphere_pa / far {
            let (unit, factor) = nearest_unit(high, r.supply.pressure_pa);
            out.push(contradiction(
                format!("{name} never exceeds {:.4} Pa, far below atmosphere", Short(high)),
                format!(
                    "give {name} in Pa, absolute: it reads as {unit} would, so write `unit = \"{unit}\"` under [column.{name}] in the \
                     mapping; 1 {unit} is {} Pa",
                    Short(factor)
                ),
            ));
        } else if high > far * r.supply.pressure_pa {
            out.push(contradiction(
                format!("{name} rises to {high:.3e} Pa, {:.0} times the supply", Short(high / r.supply.pressure_pa)),
                format!("give {name} in Pa, absolute: correct `unit` under [column.{name}] in the mapping"),
            ));
        } else if column == Column::PSup
            && far * (high - r.supply.atmosphere_pa) < r.supply.pressure_pa - r.supply.atmosphere_pa
        {
            let [high, stated] = [high, r.supply.pressure_pa].map(|pa| Short(pa * 1.0e-5));
            out.push(contradiction(
                format!("{name} never exceeds {high:.3} bar, absolute, where the rig file states {stated:.3}"),
                format!(
                    "correct the `unit` of the pressures in the mapping, open the supply, or leave [column.{name}] out if its sensor \
                     is not connected"
                ),
            ));
        }
    }
    if let Some((low, high)) = log.column(Column::U).and_then(extent)
        && low.abs().max(high.abs()) > far * r.valve.max_voltage_v
    {
        let [from, to] = [low, high].map(Short);
        let most = r.valve.max_voltage_v;
        // Per cent go to 100, and perhaps a little beyond.
        let may_be_percent = low.abs().max(high.abs()) <= 110.0;
        let percent = if may_be_percent {
            format!("`points = [[-100.0, {:?}], [100.0, {most:?}]]` if they are per cent, ", -most)
        } else {
            String::new()
        };
        out.push(contradiction(
            format!("u_v runs from {from:.1} to {to:.1} V, but the valve takes ±{most} V"),
            format!(
                "give u_v in volts, by the mapping under [column.u_v]: {percent}`unit = \"mV\"` if they are millivolts"
            ),
        ));
    }
    let period_s = log.period_s();
    if period_s > constants::slowest_rows() {
        out.push(contradiction(
            format!("rows come every {} s: between two of them a stroke is over", Short(period_s)),
            "give t_s in seconds (`unit = \"ms\"` under [column.t_s] in the mapping, if they are milliseconds), or record at 50 Hz or more".into(),
        ));
    }
    out
}

/// The mistake that, undone, lets command, motion and pressures turn the same way, which they do not as read.
fn turned(rig: &RigFile, log: &Log, record: &Record) -> Option<Flaw> {
    let as_is = agreement(rig, record)?;
    let enough = (as_is + constants::turned()).max(constants::turns_alike());
    if enough > 1.0 {
        return None;
    }
    let agreeing = |mistake: Mistake| Some((agreement(rig, &prepare(&mistake.undone, rig))?, mistake));
    let mut undone: Vec<(f64, Mistake)> = mistakes(rig, log, log).into_par_iter().filter_map(agreeing).collect();
    let best = undone.iter().map(|(agrees, _)| *agrees).reduce(f64::max).filter(|best| *best >= enough)?;
    // A zero hardly changes how things turn: of those alike the rig as stated tells.
    undone.retain(|(agrees, _)| *agrees > best - 0.5 * constants::turned());
    let misfit = |mistake: &Mistake| misfit(rig, &excerpt(&mistake.undone)).map_or(f64::INFINITY, |(misfit, _)| misfit);
    let (agrees, mistake) = undone.into_iter().min_by(|a, b| misfit(&a.1).total_cmp(&misfit(&b.1)))?;
    Some(contradiction(
        format!(
            "{}; so read, the valve's opening and the air that flows correlate by {agrees:.2} instead of {as_is:.2}",
            mistake.problem
        ),
        mistake.remedy,
    ))
}

/// Gauge pressures, where the supply reads less than the rig file states by the atmosphere, and the rig as stated predicts the log
/// better with it added: a regulator that is set lower would lower the flows as well.
fn supply_as_gauge(rig: &RigFile, log: &Log) -> Option<Flaw> {
    let readings = less_by_the_atmosphere(rig, log)?;
    let part = excerpt(log);
    let (as_is, _) = misfit(rig, &part)?;
    let gauge = gauges(rig, &part).into_iter().filter(|(supply, _)| *supply);
    let undone = gauge.filter_map(|(_, mistake)| Some((misfit(rig, &mistake.undone)?.0, mistake)));
    let (best, mistake) = undone.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (best < as_is).then(|| contradiction(format!("{}: {readings}", mistake.problem), mistake.remedy))
}

/// A supply that reads less than the rig file states by the atmosphere: what it reads and what is stated.
fn less_by_the_atmosphere(rig: &RigFile, log: &Log) -> Option<String> {
    let (stated_pa, atmosphere_pa) = (rig.rig.supply.pressure_pa, rig.rig.supply.atmosphere_pa);
    let mut readings: Vec<f64> = log.column(Column::PSup)?.iter().copied().filter(|p| p.is_finite()).collect();
    let reading_pa = median(&mut readings)?;
    let less = (reading_pa + atmosphere_pa - stated_pa).abs() < constants::gauge_within() * atmosphere_pa;
    let [reading, stated] = [reading_pa, stated_pa].map(|pa| pa * 1.0e-5);
    less.then(|| format!("p_sup_pa reads {:.2} bar, the rig file states {stated:.2} bar absolute", Short(reading)))
}

/// The same where nothing contradicts it: the regulator may be set lower.
pub(super) fn supply_in_doubt(rig: &RigFile, log: &Log) -> Option<Flaw> {
    less_by_the_atmosphere(rig, log).map(|readings| Flaw {
        weight: Weight::Loss,
        problem: format!("the supply is in doubt: {readings}, more by the atmosphere"),
        remedy: "write `gauge = true` under the tables of pressures in the mapping if the sensors show gauge pressure; else correct \
                 `supply.pressure_pa` in the rig file"
            .into(),
    })
}

/// The mistake that, undone, makes the rig as stated predict the log by far better; `None` if there is none.
fn misread(rig: &RigFile, log: &Log) -> Option<Flaw> {
    let part = excerpt(log);
    let (as_is, judged) = misfit(rig, &part)?;
    if as_is < constants::suspect() {
        return None;
    }
    let undone = mistakes(rig, log, &part).into_par_iter().filter_map(|mistake| {
        let (misfit, count) = misfit(rig, &mistake.undone)?;
        // A log read so that little of it can be judged is not understood better.
        (count * 2 > judged).then_some((misfit, mistake))
    });
    let (best, mistake) = undone.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (best < constants::undone() * as_is).then(|| {
        let times = as_is / best;
        contradiction(
            format!("{}; so read, the rig predicts the log {times:.0} times better", mistake.problem),
            mistake.remedy,
        )
    })
}

/// The first part of a log, long enough to see motion both ways.
pub(crate) fn excerpt(log: &Log) -> Log {
    let until = log.t_s.first().map_or(0.0, |t| t + constants::excerpt_s());
    let count = log.t_s.partition_point(|t| *t < until);
    let mut out = Log { t_s: log.t_s[..count].to_vec(), ..Log::default() };
    for column in Column::ALL {
        if let Some(values) = log.column(column) {
            out.set(column, Some(values[..count].to_vec()));
        }
    }
    out
}

/// A log with some columns changed, each by a factor and something added.
fn changed(log: &Log, changes: &[(Column, f64, f64)]) -> Log {
    let mut out = log.clone();
    for (column, factor, added) in changes {
        if let Some(values) = log.column(*column) {
            out.set(*column, Some(values.iter().map(|x| factor * x + added).collect()));
        }
    }
    out
}

/// Gauge pressures taken for absolute ones; each with whether the supply's is among them.
pub(crate) fn gauges(rig: &RigFile, part: &Log) -> Vec<(bool, Mistake)> {
    let atmosphere = rig.rig.supply.atmosphere_pa;
    let [a, b, supply] = [Column::PA, Column::PB, Column::PSup].map(|column| (column, 1.0, atmosphere));
    let gauge = |columns: &str, tables: &str, changes: &[(Column, f64, f64)]| Mistake {
        problem: format!("{columns} seem to be gauge pressures"),
        remedy: format!("write `gauge = true` under {tables} in the mapping, which adds {} Pa", Short(atmosphere)),
        undone: changed(part, changes),
    };
    let mut out = vec![(false, gauge("the chamber pressures", "[column.p_a_pa] and [column.p_b_pa]", &[a, b]))];
    for (column, change) in [(Column::PA, a), (Column::PB, b)] {
        let name = column.name();
        out.push((false, gauge(&format!("the values of {name}"), &format!("[column.{name}]"), &[change])));
    }
    if part.column(Column::PSup).is_some() {
        out.push((true, gauge("the values of p_sup_pa", "[column.p_sup_pa]", &[supply])));
        out.push((true, gauge("all pressures", "the three tables of pressures", &[a, b, supply])));
    }
    out
}

fn mistakes(rig: &RigFile, log: &Log, part: &Log) -> Vec<Mistake> {
    let (mut out, r) = (Vec::new(), &rig.rig);
    let with = |changes: &[(Column, f64, f64)]| changed(part, changes);
    let mut add = |problem: &str, remedy: String, undone: Log| {
        out.push(Mistake { problem: problem.to_string(), remedy, undone });
    };
    let half = 0.5 * r.cylinder.stroke_m;
    add(
        "y_m seems reversed",
        "turn `sign` under [column.y_m] in the mapping, and the sign of `offset` if there is one: y_m grows as chamber A does".into(),
        with(&[(Column::Y, -1.0, 0.0)]),
    );
    for zero in [-half, half] {
        let sign = if zero < 0.0 { 1.0 } else { -1.0 };
        let turn = if zero < 0.0 { "" } else { "turn `sign` and the sign of `offset`, then " };
        add(
            "y_m seems to start at an end of the stroke",
            format!("give y_m from mid-stroke: {turn}add {zero:.4} to `offset` under [column.y_m] in the mapping"),
            with(&[(Column::Y, sign, zero)]),
        );
    }
    if let Some((low, high)) = log.column(Column::U).and_then(extent) {
        let most = r.valve.max_voltage_v;
        add(
            "u_v seems reversed",
            "turn `sign` under [column.u_v] in the mapping, and the sign of `offset` if there is one: positive fills chamber A".into(),
            with(&[(Column::U, -1.0, 0.0)]),
        );
        // A command of one sign only, as 0 to 10 V is.
        if low > -0.1 * most {
            for middle in [5.0, most] {
                let factor = most / middle;
                if high <= 2.2 * middle {
                    add(
                        &format!("u_v seems to be 0 to {} V", 2.0 * middle),
                        format!(
                            "give u_v about mid position: `points = [[0.0, {:?}], [{:?}, {most:?}]]` under [column.u_v] in the mapping",
                            -most,
                            2.0 * middle
                        ),
                        with(&[(Column::U, factor, -factor * middle)]),
                    );
                }
            }
        }
    }
    if let (Some(a), Some(b)) = (part.column(Column::PA), part.column(Column::PB)) {
        let mut undone = part.clone();
        undone.set(Column::PA, Some(b.to_vec()));
        undone.set(Column::PB, Some(a.to_vec()));
        add(
            "p_a_pa and p_b_pa seem exchanged",
            "exchange `from` of [column.p_a_pa] and [column.p_b_pa] in the mapping: a positive command fills A".into(),
            undone,
        );
    }
    out.extend(gauges(rig, part).into_iter().map(|(_, mistake)| mistake));
    out
}

/// Mean cost of the rig as stated over that of noise, summed over the balances, and how many innovations were judged.
fn misfit(rig: &RigFile, log: &Log) -> Option<(f64, usize)> {
    let plant = Plant::new(&rig.rig, &rig.effects).ok()?;
    let record = refined(prepare(log, rig), Between::Held);
    let judgeable = observers::judgeable(&record) & !Channel::Supply.bit();
    let stretches: Vec<Stretch> = record.stretches.clone();
    let errors = observers::innovations(
        &record,
        &Signals::default(),
        &plant,
        &Default::default(),
        &stretches,
        judgeable,
        Default::default(),
    );
    let (mut sum, mut count) = (0.0, 0);
    for channel in errors.channels {
        let judged: Vec<f64> = channel.into_iter().filter(|e| !e.is_nan() && *e != 0.0).collect();
        if !judged.is_empty() {
            sum += judged.iter().map(|e| loss(*e)).sum::<f64>() / (COST_OF_NOISE * judged.len() as f64);
            count += judged.len();
        }
    }
    (count > 0).then_some((sum, count))
}
