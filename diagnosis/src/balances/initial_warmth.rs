//! The temperature of a chamber's air where the log begins, and behind missing rows: it depends on what the cylinder did before. Of a
//! prediction's errors those count that are left with the likeliest initial values.

use crate::constants;
use crate::data::record::Record;
use crate::data::split::{Stretch, missing_between};

/// A warmth by which errors are compared: 3 K. A few kelvins change flow and pressure by little, so that errors are straight in them.
pub(super) const STEP: f64 = 0.01;

/// What initial values make of the errors of some stretches.
pub(crate) struct InitialWarmth {
    /// For each beginning: rows with what a warmth there makes of their errors, and the sum of their squares.
    beginnings: Vec<(Vec<(usize, f64)>, f64)>,
}

impl InitialWarmth {
    /// From the errors of the stretches' rows, and from those of air that is warmer by [`STEP`] at each beginning.
    pub(super) fn of(record: &Record, stretches: &[Stretch], [errors, of_warmer]: [&[f64]; 2]) -> Self {
        let goes_on = |before: &Stretch, next: &Stretch| {
            !missing_between(&record.t_s, (before.end - 1, next.start), record.quality.interval_s)
        };
        let mut place = 0;
        let beginning = |part: &[Stretch]| {
            let until_s = part.first().map_or(0.0, |first| record.t_s[first.start] + constants::initial_warmth_s());
            let rows = place..place + record.rows_of(part).count();
            let soon = record.rows_of(part).take_while(|k| record.t_s[*k] < until_s).count();
            place = rows.end;
            let slopes = rows.take(soon).map(|row| (row, (of_warmer[row] - errors[row]) / STEP));
            let slopes: Vec<(usize, f64)> = slopes.filter(|(_, slope)| slope.is_finite()).collect();
            let square = slopes.iter().map(|(_, slope)| slope * slope).sum();
            (slopes, square)
        };
        Self { beginnings: stretches.chunk_by(goes_on).map(beginning).collect() }
    }

    /// Takes out of errors, or of changes of them, what the likeliest initial values make of them.
    pub(super) fn take_out_of(&self, errors: &mut [f64]) {
        for (slopes, square) in &self.beginnings {
            let product: f64 = slopes.iter().map(|(row, slope)| slope * errors[*row]).sum();
            let warmth = product / (square + constants::initial_warmth().powi(-2));
            slopes.iter().for_each(|(row, slope)| errors[*row] -= warmth * slope);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::balances::added::Added;
    use crate::balances::observers::innovations;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::{add_noise, rows, simulated};
    use crate::data::channel::Channel;
    use crate::data::prepare::prepare;
    use crate::estimate::likelihood::misfit;
    use plant_model::{Effect, Effects, Plant};
    use rig_files::RigFile;

    #[test]
    fn a_log_that_begins_while_the_piston_works_and_has_gaps_is_predicted_from_the_temperatures_there() {
        let file = RigFile::paper_a();
        let effects = Effects::none().with(Effect::WallHeat, &[50.0]);
        let mut log = simulated(&file, &effects, 9_000, |t_s| 0.8 * (6.0 * t_s).cos() + 0.7 * (3.1 * t_s).cos());
        add_noise(&mut log, 5.0e-6, 200.0);
        let plant = Plant::new(&file.rig, &effects).expect("a sound rig");
        for (begin, gap) in [(0, 0), (2000, 0), (2300, 0), (2000, 300)] {
            let log = rows(&log, |k| k >= begin && !(6_000..6_000 + gap).contains(&k));
            let record = prepare(&log, &file);
            let channels = Channel::PressureA.bit() | Channel::PressureB.bit();
            let (signals, added) = (Signals::default(), Added::default());
            let stretches = &record.stretches;
            let found = innovations(&record, &signals, &plant, &added, stretches, channels, Default::default());
            for errors in &found.channels[..2] {
                let misfit = misfit(errors, record.averaged());
                // 1.0 to 1.6, the first with the whole log, too; as cold as the supply at each beginning 4 to 15.
                assert!(misfit < 2.0, "from row {begin}, {gap} missing: {misfit}");
            }
        }
    }
}
