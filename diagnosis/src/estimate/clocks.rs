//! Columns that were stamped by different clocks: a position too early, a command too late. A delay of the rig does neither; the
//! other ways round are effects of the catalogue, `position-delay` and `line-delay`.

use super::problem::Problem;
use super::reading::{MOST_LEFT, Read, Reading};
use crate::check::{Flaw, mapping};
use crate::constants;
use crate::data::channel::Channels;
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Parameter;
use core::cmp::Ordering;
use plant_model::Effect;
use rayon::prelude::*;
use rig_files::{Column, Log, RigFile};

/// The shifts looked for first, in rows: nothing between rows is known without its noise.
const ROWS: [i32; 7] = [1, 2, 4, 8, 16, 32, 64];
/// Effects with one parameter, a time by which a signal is behind.
const DELAYS: [Effect; 5] =
    [Effect::PressureLag, Effect::ValveLag, Effect::LineDelay, Effect::PositionDelay, Effect::PositionLag];
/// How often nominal values and shift are corrected in turn at most: each takes up a part of the other.
const REFITS: usize = 6;
/// A round that takes away less than this part of what is left, and keeps the rows, is the last: a slow pressure sensor, read as an
/// early position, took a seventh, a thousandth, and a millionth away.
const SETTLED: f64 = 0.01;

/// A shift, s, and the part of a log read with it.
#[derive(Clone)]
struct Shift {
    later_s: f64,
    read: Read,
}

/// Which of two shifts leaves less.
fn less(one: &(i32, Shift), other: &(i32, Shift)) -> Ordering {
    one.1.read.left.total_cmp(&other.1.read.left)
}

impl Reading<'_> {
    /// The misfit with a column shifted, after so many steps of a fit of the nominal values.
    fn with(&self, column: Column, later_s: f64, nominal: &Hypothesis, steps: usize) -> Option<Shift> {
        let mut log = self.part.clone();
        log.set(column, self.part.shifted(column, later_s));
        Some(Shift { later_s, read: self.read(&log, |problem| problem.refit(nominal.clone(), self.judgeable, steps))? })
    }

    /// Whether an effect of the rig that delays one signal leaves less than a shift: slow pressure sensors look like a position that
    /// is stamped too early.
    fn delays_better(&self, effect: Effect, shift: &Shift) -> bool {
        let begin = |problem: &Problem<'_>| {
            let delayed = shift.read.nominal.extended_by(effect, problem.parameters(effect), &[shift.later_s.abs()]);
            problem.fit(delayed, constants::iterations())
        };
        self.read(&self.part, begin).is_some_and(|delayed| delayed.left < shift.read.left)
    }

    /// The shift of a column (to a side) by whole rows, and these, that leaves least without another fit, if it takes at least a
    /// fifth away: nominal values have taken up a part of it.
    fn coarse(&self, (column, sign): (Column, f64), as_is: &Shift) -> Option<(i32, Shift)> {
        self.part.column(column)?;
        let shifts = ROWS.into_par_iter().filter_map(|rows| self.by_rows((column, sign), rows, as_is, (as_is, 0)));
        shifts.min_by(less).filter(|(_, best)| best.read.left < 0.8 * as_is.read.left)
    }

    /// A shift by whole rows after so many steps of a fit from another one's nominal values, and these rows.
    fn by_rows(
        &self,
        (column, sign): (Column, f64),
        rows: i32,
        as_is: &Shift,
        (from, steps): (&Shift, usize),
    ) -> Option<(i32, Shift)> {
        let later_s = f64::from(rows) * sign * self.part.period_s();
        let shift = self.with(column, later_s, &from.read.nominal, steps)?;
        // A log of which less can be judged is not understood better.
        (shift.read.noise > 0.9 * as_is.read.noise).then_some((rows, shift))
    }

    /// The shift of a column that leaves least, found from a coarse one.
    fn best(&self, way: (Column, f64), as_is: &Shift, coarse: (i32, Shift)) -> Option<Shift> {
        let row_s = way.1 * self.part.period_s();
        let with = |rows: i32, from: &Shift| self.by_rows(way, rows, as_is, (from, constants::first_iterations()));
        let mut best = coarse;
        for _ in 0..REFITS {
            let (from, reach) = (best.1.clone(), (best.0 / 4).max(1));
            let beside = [-reach, 0, reach].map(|by| best.0 + by).into_par_iter().filter(|rows| *rows > 0);
            best = beside.filter_map(|rows| with(rows, &from)).min_by(less)?;
            let gained = from.read.left - best.1.read.left;
            if reach == 1 && best.1.later_s == from.later_s && gained < SETTLED * from.read.left {
                break;
            }
        }
        // Between rows the misfit is a parabola.
        let (rows, best) = best;
        let beside = [rows - 1, rows + 1].map(|rows| with(rows, &best));
        let [Some((_, before)), Some((_, after))] = beside else { return None };
        let [before, middle, after] = [before, best, after].map(|shift| shift.read);
        let (slope, bend) = (0.5 * (after.left - before.left), after.left - 2.0 * middle.left + before.left);
        let beyond = if bend > 0.0 { (-slope / bend).clamp(-0.5, 0.5) } else { 0.0 };
        // Where neighbours leave far more than noise a parabola may promise less than none.
        let left = (middle.left + beyond * (slope + 0.5 * bend * beyond)).max(middle.left.min(0.0));
        Some(Shift { later_s: (f64::from(rows) + beyond) * row_s, read: Read { left, ..middle } })
    }
}

/// The shift of a column that, undone, takes nearly all that the rig with its nominal values corrected misses beyond noise.
pub(crate) fn late_or_early(
    rig: &RigFile,
    log: &Log,
    (judgeable, nominal): (Channels, &[Parameter]),
    fitted: &Hypothesis,
) -> Option<Flaw> {
    // Between distant rows nobody knows when a command moved.
    if log.period_s() >= constants::close_rows() {
        return None;
    }
    let reading = Reading::of(rig, log, (judgeable, nominal));
    let begun = reading.with(Column::Y, 0.0, fitted, 0)?;
    // What is like noise needs no shift; what a few steps of a fit left, others may take away.
    if begun.read.is_noise() {
        return None;
    }
    // The search begins where nominal values have not yet taken up the shift.
    let ways = [((Column::Y, 1.0), "early"), ((Column::U, -1.0), "late")];
    let coarse = |(way, word)| Some((way, word, reading.coarse(way, &begun)?));
    let coarse: Vec<_> = ways.into_iter().filter_map(coarse).collect();
    if coarse.is_empty() {
        return None;
    }
    let as_is = reading.with(Column::Y, 0.0, fitted, constants::iterations())?;
    if as_is.read.is_noise() {
        return None;
    }
    let shifts = coarse.into_iter().filter_map(|(way, word, coarse)| {
        let best = reading.best(way, &begun, coarse)?;
        Some((best, way.0, word))
    });
    let (best, column, word) = shifts.min_by(|one, other| one.0.read.left.total_cmp(&other.0.read.left))?;
    let told = best.read.left < MOST_LEFT * as_is.read.left
        && best.later_s.abs() >= log.period_s()
        && !DELAYS.into_iter().any(|effect| reading.delays_better(effect, &best));
    told.then(|| {
        let name = column.name();
        mapping::contradiction(
            format!(
                "{name} seems to be stamped {:.1} ms too {word} against the other columns; put right, the rig predicts the log nearly as \
                 well as its noise allows",
                best.later_s.abs() * 1.0e3
            ),
            format!(
                "record all columns by one clock, or write `shift_s = {:.4}` under [column.{name}] in the mapping",
                best.later_s
            ),
        )
    })
}
