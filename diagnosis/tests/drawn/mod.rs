//! Logs that several tests draw.

use rig_files::{Log, RigFile};
use synthesis::blind::{Class, Nominal, Plan, plans};

pub(crate) const SEED: u64 = 20_261_122;

/// A log without a hidden effect, with its rig.
pub(crate) fn null(which: usize) -> (Plan, RigFile, Log) {
    let plan = plans(Class::Null, Nominal::TwoPercent, which + 1, SEED)[which];
    let case = plan.draw();
    let log = case.record().0;
    (plan, case.rig_file, log)
}
