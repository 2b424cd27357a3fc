//! Whether the log's command was held between rows, or moved on: by likelihood.

use super::effort::Effort;
use super::likelihood::{by_chance, loss};
use super::problem::{Fit, Problem};
use crate::balances::between;
use crate::balances::shared::Signals;
use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::data::command::{FasterLoop, Missing};
use crate::data::grid::{self, Between};
use crate::data::record::Record;
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Parameter;
use plant_model::{Effect, Place, Plant};
use rayon::prelude::*;
use rig_files::RigFile;

/// How often the controller acts from one row to the next: once in a while, many times, or all the time.
const PER_ROW: [f64; 5] = [2.0, 3.0, 5.0, 10.0, f64::INFINITY];
/// From how many rows to each side a command that jitters may be taken: more of them say its mean better, unless it moves meanwhile.
const NEAR: [usize; 5] = [1, 2, 4, 8, 16];
/// How much of a command's jumps may be uncertain: half of the variance, a quarter, and so on. Of `m` commands that jitter a mean has a
/// variance `m` times smaller than one command.
const SHARES: [f64; 5] = [1.0, 0.7, 0.5, 0.35, 0.25];
/// How much of what the curve between the points of a table may differ by counts: all, half of it, a quarter. Never nothing, as what a
/// fit sees of a curve is not all of it.
const CURVE_SHARES: [f64; 3] = [1.0, 0.5, 0.25];
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

/// How a command that moved between rows is read.
#[derive(Clone, Copy)]
struct Moved {
    faster: FasterLoop,
    /// The part of its jumps that is uncertain.
    share: f64,
}

/// What some rows tell under one reading of them.
struct Told {
    /// Of the chambers' pressures, after a fit to them.
    cost: f64,
    /// The same row by row. A prediction that follows its measurement more closely than it need errs from row to row with alternating
    /// sign: averages of neighbours do not show it.
    by_rows: f64,
    /// What noise alone would cost.
    noise: f64,
    fitted: Hypothesis,
}

impl Told {
    /// Whether noise reaches this by chance.
    fn is_noise(&self) -> bool {
        self.cost < by_chance(self.noise) * self.noise
    }
}

/// Rows as read with a command that moved.
struct Reading {
    moved: Moved,
    /// The plant by which it is uncertain.
    plant: Plant<f64>,
    record: Record,
    told: Told,
}

/// Rows as read by a plant, with a command that moved or was held.
struct Read {
    moved: Option<Moved>,
    plant: Plant<f64>,
    record: Record,
}

impl Rows<'_> {
    /// The record of the rows in steps, with the command held between rows unless the chambers' pressures are plainly likelier,
    /// by as much as a cause must gain, if it moved. The hypothesis is fitted to a part of the record, beginning where it is.
    ///
    /// A cause may have come in to undo a wrong reading of the rows, as a delay of half a row does. So the command also counts as
    /// held if then one of the causes is not needed: without it no more than noise is left.
    pub(crate) fn likelier(&self, hypothesis: &Hypothesis) -> Record {
        self.with_likelier_command(hypothesis)
            .map_or_else(|| grid::refined(self.rows.clone(), Between::Held), |read| read.record)
    }

    /// `None` if the hypothesis cannot be simulated.
    fn with_likelier_command(&self, hypothesis: &Hypothesis) -> Option<Read> {
        let plant = hypothesis.plant(self.rig, &hypothesis.values)?;
        let held = Read { moved: None, record: self.read(None, &plant, CURVE_SHARES[0]), plant };
        if self.air() == 0 {
            return Some(held);
        }
        let Some(mut if_held) = self.told(&held.record, hypothesis, Part::Subset) else { return Some(held) };
        let mut part = Part::Subset;
        // What is like noise needs no other reading. A part may lack the commands that tell readings apart.
        if if_held.is_noise() {
            match self.told(&held.record, &if_held.fitted, Part::All).filter(|all| !all.is_noise()) {
                Some(all) => (if_held, part) = (all, Part::All),
                None => return Some(held),
            }
        }
        let enough = |effect: &Effect| {
            let begun = self.told(&held.record, &hypothesis.without(*effect, self.nominal), part)?;
            // Nominal values that another reading bent take more than a few steps back.
            let to_the_end = || self.told_after(&held.record, &begun.fitted, part, constants::iterations());
            let near = begun.cost < constants::like_noise() * begun.noise;
            Some(near && (begun.is_noise() || to_the_end()?.is_noise()))
        };
        if hypothesis.effects.par_iter().any(|effect| enough(effect).unwrap_or(false)) {
            return Some(held);
        }
        let read_by = |part: Part, moved: Moved, from: &Hypothesis, plant: &Plant<f64>| {
            let record = self.read(Some(moved), plant, CURVE_SHARES[0]);
            Some(Reading { told: self.told(&record, from, part)?, record, moved, plant: *plant })
        };
        let read = |moved: Moved, from: &Hypothesis, plant: &Plant<f64>| read_by(part, moved, from, plant);
        let on_the_line = PER_ROW.into_par_iter().filter_map(|per_row| {
            let faster = FasterLoop { per_row, missing: Missing::OnTheLine };
            read(Moved { faster, share: SHARES[0] }, hypothesis, &held.plant)
        });
        let Some(mut best) = on_the_line.min_by(|a, b| a.told.cost.total_cmp(&b.told.cost)) else { return Some(held) };
        // Jitter, where no gap is left that a smoother command could hide: from ever more rows, and of jumps ever less, as long as
        // that is likelier.
        let near_noise = best.told.cost < constants::open() * if_held.noise;
        let mut last = f64::INFINITY;
        for near in NEAR.into_iter().filter(|_| near_noise) {
            let faster = FasterLoop { missing: Missing::LikeRows(near), ..best.moved.faster };
            let Some(next) = read(Moved { faster, ..best.moved }, hypothesis, &held.plant) else { break };
            if next.told.cost > last {
                break;
            }
            last = next.told.cost;
            best = if next.told.cost < best.told.cost { next } else { best };
        }
        if best.told.cost + self.plainly(if_held.noise) > if_held.cost {
            return Some(held);
        }
        for share in SHARES[1..].iter().filter(|_| near_noise) {
            match read(Moved { share: *share, ..best.moved }, &best.told.fitted, &held.plant) {
                Some(less) if less.told.cost < best.told.cost => best = less,
                _ => break,
            }
        }
        // What is not known of a spool that rests behind its play lasts, but a part of the log may lack the places where that tells.
        if held.plant.added().valve_hysteresis.half_width_v > 0.0
            && let Some(all) = self.told(&best.record, &best.told.fitted, Part::All)
        {
            (best.told, part) = (all, Part::All);
        }
        // How uncertain a jump makes the pressures depends on where the valve begins to open: by the values as fitted, as long as
        // the rows become likelier by that.
        while let Some(plant) = best.told.fitted.plant(self.rig, &best.told.fitted.values) {
            match read_by(part, best.moved, &best.told.fitted, &plant) {
                Some(again) if again.told.cost < best.told.cost - constants::likelier() => best = again,
                _ => break,
            }
        }
        Some(Read { moved: Some(best.moved), plant: best.plant, record: best.record })
    }

    /// The same with the curve doubted less, as long as the chambers' pressures in the whole log are likelier by that and like noise:
    /// where it runs as stated, what doubt takes for noise would hide small causes. The hypothesis is that of a fit.
    fn with_likelier_curve(&self, read: Read, fitted: &Hypothesis) -> Record {
        let Read { moved, plant, mut record } = read;
        let told = |record: &Record| self.tell(record, Part::All, |problem| problem.evaluate_as_is(fitted.clone()));
        let doubted = if record.curve_doubt > 0.0 { told(&record) } else { None };
        let Some(mut best) = doubted else { return record };
        for share in &CURVE_SHARES[1..] {
            let less = self.read(moved, &plant, *share);
            let is_likelier =
                |told: &Told| told.by_rows < best.by_rows && told.cost < constants::like_noise() * told.noise;
            match told(&less).filter(is_likelier) {
                Some(told) => (record, best) = (less, told),
                None => break,
            }
        }
        record
    }

    /// Another reading of the rows than a record's, where that is plainly likelier with what was found. Only then is the curve doubted
    /// less: a fit that begins far from the truth would be held in a valley of its own.
    pub(crate) fn other_than(&self, record: &Record, found: &Hypothesis) -> Option<Record> {
        let again = self.with_likelier_curve(self.with_likelier_command(found)?, found);
        if again.command_moved() != record.command_moved() || again.curve_doubt != record.curve_doubt {
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

    /// The record of the rows with the command held between them, the curve doubted as much as in another record; `None` if the
    /// hypothesis cannot be simulated.
    pub(crate) fn held(&self, hypothesis: &Hypothesis, other: &Record) -> Option<Record> {
        Some(self.read(None, &hypothesis.plant(self.rig, &hypothesis.values)?, other.curve_doubt))
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

    /// The judged chambers.
    pub(crate) fn air(&self) -> Channels {
        self.judgeable & (Channel::PressureA.bit() | Channel::PressureB.bit())
    }

    /// The record with a command that moved between rows, or was held, and a share of the doubt of the curve.
    fn read(&self, moved: Option<Moved>, plant: &Plant<f64>, curve: f64) -> Record {
        let command = moved.map_or(Between::Held, |moved| Between::Moved(moved.faster));
        let mut record = grid::refined(self.rows.clone(), command);
        between::follow_the_flow(&mut record, plant);
        if let Some(Moved { share, .. }) = moved {
            between::doubts(&mut record, plant, share);
        }
        // Where the rig file says how the curve runs between its points, it does.
        let smoothness = Some(Place::opening_smoothness.key().path);
        if curve > 0.0 && self.nominal.iter().any(|p| p.slot.stated_key() == smoothness) {
            between::doubt_the_curve(&mut record, plant, curve);
        }
        record
    }

    /// What a record tells once the hypothesis is fitted to it.
    fn told(&self, record: &Record, hypothesis: &Hypothesis, part: Part) -> Option<Told> {
        self.told_after(record, hypothesis, part, constants::first_iterations())
    }

    /// The same after so many steps of a fit at most.
    fn told_after(&self, record: &Record, hypothesis: &Hypothesis, part: Part, steps: usize) -> Option<Told> {
        self.tell(record, part, |problem| problem.refit(hypothesis.clone(), self.air(), steps))
    }

    /// What a record tells at a fit to it, or to a part of it.
    fn tell(&self, record: &Record, part: Part, fit: impl Fn(&Problem<'_>) -> Option<Fit>) -> Option<Told> {
        let (signals, effort, air) = (Signals::default(), Effort::default(), self.air());
        let problem = Problem::new((self.rig, record), air, self.nominal, (&signals, &effort));
        let subset = if part == Part::Subset { problem.subset().0 } else { problem };
        let fit = fit(&subset)?;
        let innovations = subset.innovations(&fit)?;
        let rows = innovations.channels.iter().flatten().filter(|error| !error.is_nan());
        let by_rows =
            rows.map(|error| loss(*error)).sum::<f64>() + innovations.log_widths.iter().sum::<f64>() + fit.prior_cost;
        Some(Told { cost: fit.undispersed(), by_rows, noise: subset.noise_cost(air), fitted: fit.hypothesis })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::simulated::{add_noise, every_other, simulated};
    use crate::data::prepare::prepare;
    use crate::model::nominal::nominal_parameters;
    use crate::model::parameter::Slot;
    use crate::validate::closure::misfit_of;
    use core::f64::consts::PI;
    use plant_model::OpeningTable;
    use rand::SeedableRng;
    use rand::distr::{Distribution, StandardUniform};
    use rand::rngs::Xoshiro256PlusPlus;

    #[test]
    fn a_command_that_jitters_behind_a_loop_twice_as_fast_as_the_log_leaves_volumes_what_they_are() {
        let mut file = RigFile::paper_c();
        (file.rig.valve.dead_zone_left_v, file.rig.valve.dead_zone_right_v) = (-0.4, 0.4);
        file.tolerance.default = 0.05;
        // A command for each millisecond, that jitters about a slow motion around the edges.
        let draws = StandardUniform.sample_iter(Xoshiro256PlusPlus::seed_from_u64(1));
        let jitter: Vec<f64> = draws.take(12_001).map(|x: f64| 0.3 * (x - 0.5)).collect();
        let command = |t_s: f64| 0.5 * (3.0 * t_s).sin() + jitter[(t_s * 1.0e3).round() as usize];
        let mut log = every_other(&simulated(&file, &plant_model::Effects::none(), 12_001, command));
        add_noise(&mut log, 5.0e-6, 100.0);
        let rows = prepare(&log, &file);
        let judgeable = judgeable(&rows);
        let nominal = nominal_parameters(&file, judgeable, false, &rows.u_v);
        let between = Rows { rig: &file, rows: &rows, judgeable, nominal: &nominal };
        let plant = Plant::new(&file.rig, &file.effects).expect("a sound rig");
        let null = Hypothesis::null(&nominal);
        let on_the_line = FasterLoop { per_row: 2.0, missing: Missing::OnTheLine };
        let line = between.read(Some(Moved { faster: on_the_line, share: 1.0 }), &plant, 1.0);
        // How far the volumes are from the true ones after a fit.
        let off = |record: &Record| {
            let (signals, effort) = (Signals::default(), Effort::default());
            let problem = Problem::new((&file, record), between.air(), &nominal, (&signals, &effort));
            let fit = problem.fit(null.clone(), constants::iterations()).expect("a rig that can be simulated");
            let away = |(p, value): (&Parameter, &f64)| match p.slot {
                Slot::Nominal(key) if key.path.starts_with("cylinder.volume") => (value / p.neutral - 1.0).abs(),
                _ => 0.0,
            };
            fit.hypothesis.parameters.iter().zip(&fit.hypothesis.values).map(away).fold(0.0, f64::max)
        };
        let read = between.likelier(&null);
        assert!(read.command_moved());
        let (as_read, on_the_line) = (off(&read), off(&line));
        // 3.5 % too large, and by the line 16 %.
        assert!(as_read < 0.0625 && on_the_line > 0.1, "{as_read} {on_the_line}");
    }

    /// A rig file with a table of the opening, and a log of a valve with the same curve, or with one that waves between its points.
    fn with_a_table(waves: bool) -> (RigFile, rig_files::Log) {
        let mut file = RigFile::paper_c();
        file.tolerance.default = 0.02;
        // The table has every third point of the waving curve.
        let opening = |u: f64| (0.5 * PI * u / 5.0).sin().powi(2).copysign(u) + 0.006 * (PI * u).sin();
        let points: Vec<[f64; 2]> = (-15..=15).map(|k| f64::from(k) / 3.0).map(|u| [u, opening(u)]).collect();
        let every_third: Vec<[f64; 2]> = points.iter().copied().step_by(3).collect();
        let at = |points: &[[f64; 2]]| OpeningTable::new(points).expect("a table");
        (file.rig.valve.dead_zone_left_v, file.rig.valve.dead_zone_right_v) = (0.0, 0.0);
        file.rig.opening = at(if waves { &points } else { &every_third });
        let command = |t_s: f64| 1.5 * (3.0 * t_s).sin() + 0.7 * (17.0 * t_s).sin();
        let mut log = simulated(&file, &plant_model::Effects::none(), 8_001, command);
        add_noise(&mut log, 5.0e-6, 300.0);
        file.rig.opening = at(&every_third);
        (file, log)
    }

    #[test]
    fn where_the_curve_of_a_table_runs_as_stated_it_is_doubted_less() {
        let [doubt, doubt_of_waves] = [false, true].map(|waves| {
            let (file, log) = with_a_table(waves);
            let rows = prepare(&log, &file);
            let judgeable = judgeable(&rows);
            let nominal = nominal_parameters(&file, judgeable, false, &rows.u_v);
            let between = Rows { rig: &file, rows: &rows, judgeable, nominal: &nominal };
            let null = Hypothesis::null(&nominal);
            let read = between.likelier(&null);
            between.other_than(&read, &null).unwrap_or(read).curve_doubt
        });
        assert!(doubt < doubt_of_waves && doubt == CURVE_SHARES[2], "{doubt} {doubt_of_waves}");
    }

    #[test]
    fn another_curve_between_the_points_of_a_table_than_lines_or_the_cubic_is_like_noise_unless_the_curve_is_stated() {
        let (file, log) = with_a_table(true);
        let rows = prepare(&log, &file);
        let judgeable = judgeable(&rows);
        let misfits = [false, true].map(|is_stated| {
            let mut file = file.clone();
            if is_stated {
                file.tolerance.set(Place::opening_smoothness.key().path, 0.0);
            }
            let nominal = nominal_parameters(&file, judgeable, false, &rows.u_v);
            let between = Rows { rig: &file, rows: &rows, judgeable, nominal: &nominal };
            let null = Hypothesis::null(&nominal);
            let record = between.held(&null, &between.likelier(&null)).expect("a rig that can be simulated");
            let (signals, effort) = (Signals::default(), Effort::default());
            let problem = Problem::new((&file, &record), between.air(), &nominal, (&signals, &effort));
            let fit = problem.fit(null, constants::iterations()).expect("a fit");
            [Channel::PressureA, Channel::PressureB].map(|channel| misfit_of(&problem, &fit, channel))
        });
        assert!(misfits[0].iter().all(|misfit| *misfit < 1.1), "{misfits:?}");
        assert!(misfits[1].iter().any(|misfit| *misfit > 1.25), "{misfits:?}");
    }
}
