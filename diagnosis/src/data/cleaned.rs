//! A log without what its sensors did not measure: repeated readings, single wild ones, hum of the mains.

use super::hum::{self, Hum};
use super::outliers::{self, Outlier};
use super::repeats::{self, Repeats};
use rig_files::Log;

/// A log that was cleaned, and of what.
pub(crate) struct Cleaned {
    /// With blanks in place of readings that were left out.
    pub(crate) log: Log,
    /// Columns that repeat readings, from frozen sensors or slower ones.
    pub(crate) repeats: Vec<Repeats>,
    /// Single readings far from all their neighbours.
    pub(crate) outliers: Vec<Outlier>,
    /// Hum that was subtracted.
    pub(crate) hums: Vec<Hum>,
}

impl Cleaned {
    /// Repeats first: they make good readings beside them look wild.
    pub(crate) fn of(log: &Log) -> Self {
        let (live, repeats) = repeats::left_out(log);
        let (tame, outliers) = outliers::left_out(&live);
        let (log, hums) = hum::subtracted(tame);
        Self { log: log.into_owned(), repeats, outliers, hums }
    }
}
