//! Whether the log's command was held between rows, or moved on: by likelihood.

use super::effort::Effort;
use super::problem::{Fit, Problem};
use crate::balances::between;
use crate::balances::shared::Signals;
use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::data::grid::{self, Between};
use crate::data::record::Record;
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Parameter;
use plant_model::{Effect, Plant};
use rayon::prelude::*;
use rig_files::RigFile;

/// How often the controller acts from one row to the next: once in a while, many times, or all the time.
const PER_ROW: [f64; 4] = [2.0, 5.0, 10.0, f64::INFINITY];
/// By how much of a row a staircase comes after the line through the rows at most.
pub(super) const LATEST: f64 = 0.5 / PER_ROW[0];

/// The record of some rows in steps, with the command held between rows unless the chambers' pressures are plainly likelier,
/// by as much as a cause must gain, if it moved. The hypothesis is fitted to a part of the record, beginning where it is.
///
/// A cause may have come in to undo a wrong reading of the rows, as a delay of half a row does. So the command also counts as
/// held if then one of the causes is not needed: without it no more than noise is left.
pub(crate) fn likelier(
    rig: &RigFile,
    plant: &Plant<f64>,
    rows: &Record,
    judgeable: Channels,
    nominal: &[Parameter],
    hypothesis: &Hypothesis,
) -> Record {
    let air = judgeable & (Channel::PressureA.bit() | Channel::PressureB.bit());
    let cost = |record: &Record, hypothesis: &Hypothesis| -> Option<(f64, f64)> {
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((rig, record), air, nominal, (&signals, &effort));
        let (subset, _) = problem.subset();
        let fit: Fit = subset.refit(hypothesis.clone(), air, constants::first_iterations())?;
        let widths = subset.innovations(&fit)?.log_widths / record.averaged() as f64;
        Some((fit.undispersed() + widths, subset.noise_cost(air)))
    };
    let refined = |command: Between| {
        let mut record = grid::refined(rows.clone(), command);
        between::follow_the_flow(&mut record, plant);
        record
    };
    let held = refined(Between::Held);
    if air == 0 {
        return held;
    }
    let Some((if_held, noise)) = cost(&held, hypothesis) else { return held };
    // What is like noise needs no other reading.
    if if_held < noise {
        return held;
    }
    let enough =
        |effect: &Effect| cost(&held, &hypothesis.without(*effect, nominal)).is_some_and(|(rest, _)| rest < noise);
    if hypothesis.effects.par_iter().any(enough) {
        return held;
    }
    let late_s = PER_ROW.map(|times| 0.5 * rows.quality.interval_s / times);
    let moved = late_s.into_par_iter().filter_map(|late_s| {
        let mut record = refined(Between::Moved { late_s });
        between::doubts(&mut record, plant);
        Some((cost(&record, hypothesis)?.0, record))
    });
    let least = constants::penalty_per_cause().max(constants::share_of_noise() * noise);
    match moved.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((if_moved, record)) if if_moved + least < if_held => record,
        _ => held,
    }
}
