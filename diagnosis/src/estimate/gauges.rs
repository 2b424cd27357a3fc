//! Gauge pressures of the chambers taken for absolute ones, where only corrected nominal values show it: a rig file that is a few
//! percent off hides what the check before the fit looks for.

use super::reading::{MOST_LEFT, Reading};
use crate::check::{Flaw, mapping};
use crate::constants;
use crate::data::channel::Channels;
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Parameter;
use rayon::prelude::*;
use rig_files::{Log, RigFile};

/// The pressures that, with the atmosphere added, take nearly all that the rig with its nominal values corrected misses beyond noise.
/// Sensors off by one atmosphere are not told apart from that, and are none.
pub(crate) fn chambers_as_gauge(
    rig: &RigFile,
    log: &Log,
    judged_by: (Channels, &[Parameter]),
    fitted: &Hypothesis,
) -> Option<Flaw> {
    let reading = Reading::of(rig, log, judged_by);
    let steps = constants::first_iterations();
    let read = |log: &Log, from: &Hypothesis, steps| {
        reading.read(log, |problem| problem.refit(from.clone(), reading.judgeable, steps))
    };
    // What is like noise needs no other reading.
    if read(&reading.part, fitted, 0)?.is_noise() {
        return None;
    }
    // Nor where the rig as stated is not better off already.
    let stated = Hypothesis::null(reading.nominal);
    let as_stated = read(&reading.part, &stated, 0)?;
    let undone = mapping::gauges(rig, &reading.part).into_par_iter().filter(|(supply, _)| !supply);
    let undone = undone.filter_map(|(_, mistake)| {
        let begun = read(&mistake.undone, &stated, 0)?;
        let better = begun.noise > 0.9 * as_stated.noise && begun.left < 0.5 * as_stated.left;
        better.then(|| Some((read(&mistake.undone, &begun.nominal, steps)?, mistake)))?
    });
    let (best, mistake) = undone.min_by(|one, other| one.0.left.total_cmp(&other.0.left))?;
    let as_is = read(&reading.part, fitted, steps)?;
    if as_is.is_noise() {
        return None;
    }
    (best.left < MOST_LEFT * as_is.left).then(|| {
        mapping::contradiction(
            format!("{}; so read, the rig predicts the log nearly as well as its noise allows", mistake.problem),
            mistake.remedy,
        )
    })
}
