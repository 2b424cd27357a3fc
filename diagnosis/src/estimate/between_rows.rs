//! Whether the log's command was held between rows, or moved on: by likelihood.

use super::problem::{Fit, Problem};
use crate::balances::shared::Signals;
use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::data::record::Record;
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Parameter;
use rig_files::RigFile;

/// Whether the chambers' pressures are plainly likelier, by as much as a cause must gain, if the command moved between rows:
/// each record with nominal values fitted to a part of it.
pub(crate) fn command_moved(
    rig: &RigFile,
    [held, moved]: [&Record; 2],
    judgeable: Channels,
    nominal: &[Parameter],
) -> bool {
    let air = judgeable & (Channel::PressureA.bit() | Channel::PressureB.bit());
    let cost = |record: &Record| -> Option<(f64, f64)> {
        let signals = Signals::default();
        let stretches = record.stretches.iter().copied().filter(|s| !s.held_back).collect();
        let problem = Problem {
            rig,
            record,
            stretches,
            judgeable: air,
            nominal,
            signals: &signals,
            terms: &[],
            dispersion: [1.0; 4],
        };
        let (subset, _) = problem.subset();
        let fit: Fit = subset.refit(Hypothesis::null(nominal), air, constants::first_iterations())?;
        Some((fit.undispersed(), subset.noise_cost(air)))
    };
    if air == 0 {
        return false;
    }
    let (Some((if_held, noise)), Some((if_moved, _))) = (cost(held), cost(moved)) else { return false };
    if_moved + constants::penalty_per_cause().max(constants::share_of_noise() * noise) < if_held
}
