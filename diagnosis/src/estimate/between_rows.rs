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

/// What the rows of a log are judged by: the chambers' pressures, and the nominal values to be fitted.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a> {
    pub(crate) rig: &'a RigFile,
    pub(crate) rows: &'a Record,
    pub(crate) judgeable: Channels,
    pub(crate) nominal: &'a [Parameter],
}

/// How much of the rows a reading is judged by.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Subset,
    All,
}

/// What some rows tell under one reading of them.
struct Told {
    /// Of the chambers' pressures, after a fit to them.
    cost: f64,
    /// What noise alone would cost.
    noise: f64,
    fitted: Hypothesis,
}

impl Rows<'_> {
    /// The record of the rows in steps, with the command held between rows unless the chambers' pressures are plainly likelier,
    /// by as much as a cause must gain, if it moved. The hypothesis is fitted to a part of the record, beginning where it is.
    ///
    /// A cause may have come in to undo a wrong reading of the rows, as a delay of half a row does. So the command also counts as
    /// held if then one of the causes is not needed: without it no more than noise is left.
    pub(crate) fn likelier(&self, hypothesis: &Hypothesis) -> Record {
        let Some(plant) = hypothesis.plant(self.rig, &hypothesis.values) else {
            return grid::refined(self.rows.clone(), Between::Held);
        };
        let held = self.read(Between::Held, &plant);
        if self.air() == 0 {
            return held;
        }
        let Some(mut if_held) = self.told(&held, hypothesis, Part::Subset) else { return held };
        let mut part = Part::Subset;
        // What is like noise needs no other reading. A part may lack the commands that tell readings apart.
        if if_held.cost < if_held.noise {
            match self.told(&held, &if_held.fitted, Part::All).filter(|all| all.cost > all.noise) {
                Some(all) => (if_held, part) = (all, Part::All),
                None => return held,
            }
        }
        let enough = |effect: &Effect| {
            self.told(&held, &hypothesis.without(*effect, self.nominal), part)
                .is_some_and(|rest| rest.cost < rest.noise)
        };
        if hypothesis.effects.par_iter().any(enough) {
            return held;
        }
        let late_s = PER_ROW.map(|times| 0.5 * self.rows.quality.interval_s / times);
        let moved = late_s.into_par_iter().filter_map(|late_s| {
            let command = Between::Moved { late_s };
            let record = self.read(command, &plant);
            Some((self.told(&record, hypothesis, part)?, record, command))
        });
        let least = self.plainly(if_held.noise);
        let likeliest = moved.min_by(|a, b| a.0.cost.total_cmp(&b.0.cost));
        let Some((mut told, mut record, command)) =
            likeliest.filter(|(if_moved, ..)| if_moved.cost + least < if_held.cost)
        else {
            return held;
        };
        // How uncertain a jump makes the pressures depends on where the valve begins to open: by the values as fitted, as long as
        // the rows become likelier by that.
        while let Some(plant) = told.fitted.plant(self.rig, &told.fitted.values) {
            let again = self.read(command, &plant);
            match self.told(&again, &told.fitted, part) {
                Some(better) if better.cost < told.cost - constants::likelier() => (told, record) = (better, again),
                _ => break,
            }
        }
        record
    }

    /// Another reading of the rows than a record's, where that is plainly likelier with what was found.
    pub(crate) fn other_than(&self, record: &Record, found: &Hypothesis) -> Option<Record> {
        let again = self.likelier(found);
        if again.command_moved() != record.command_moved() {
            return Some(again);
        }
        // A command that was held is read in one way.
        if !again.command_moved() {
            return None;
        }
        let [before, now] = [record, &again].map(|record| self.told(record, found, Part::Subset));
        let (before, now) = (before?, now?);
        (now.cost + self.plainly(now.noise) < before.cost).then_some(again)
    }

    /// The record of the rows with the command held between them; `None` if the hypothesis cannot be simulated.
    pub(crate) fn held(&self, hypothesis: &Hypothesis) -> Option<Record> {
        Some(self.read(Between::Held, &hypothesis.plant(self.rig, &hypothesis.values)?))
    }

    /// Whether one reading of the rows with its causes is likelier than another with its own, each cause at its penalty.
    pub(crate) fn is_likelier(&self, one: (&Record, &Hypothesis), other: (&Record, &Hypothesis)) -> bool {
        let cost = |(record, hypothesis): (&Record, &Hypothesis)| {
            let penalties = constants::penalty_per_cause() * hypothesis.effects.len() as f64;
            Some(self.told(record, hypothesis, Part::All)?.cost + penalties)
        };
        cost(one).zip(cost(other)).is_some_and(|(one, other)| one < other)
    }

    /// By how much less a reading must cost.
    fn plainly(&self, noise: f64) -> f64 {
        constants::penalty_per_cause().max(constants::share_of_noise() * noise)
    }

    fn air(&self) -> Channels {
        self.judgeable & (Channel::PressureA.bit() | Channel::PressureB.bit())
    }

    fn read(&self, command: Between, plant: &Plant<f64>) -> Record {
        let mut record = grid::refined(self.rows.clone(), command);
        between::follow_the_flow(&mut record, plant);
        if command != Between::Held {
            between::doubts(&mut record, plant);
        }
        record
    }

    fn told(&self, record: &Record, hypothesis: &Hypothesis, part: Part) -> Option<Told> {
        let (signals, effort, air) = (Signals::default(), Effort::default(), self.air());
        let problem = Problem::new((self.rig, record), air, self.nominal, (&signals, &effort));
        let subset = if part == Part::Subset { problem.subset().0 } else { problem };
        let fit: Fit = subset.refit(hypothesis.clone(), air, constants::first_iterations())?;
        let widths = subset.innovations(&fit)?.log_widths / record.averaged() as f64;
        Some(Told { cost: fit.undispersed() + widths, noise: subset.noise_cost(air), fitted: fit.hypothesis })
    }
}
