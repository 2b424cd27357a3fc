//! Whether rows that look as if the command moved between them are those of a held command and a cause.

use super::forward::{Wanted, extensions};
use super::memory::Memory;
use super::search::{Begin, Found};
use crate::balances::shared::Signals;
use crate::constants;
use crate::data::record::Record;
use crate::estimate::between_rows::Rows;
use crate::estimate::problem::Problem;
use crate::model::hypothesis::Hypothesis;

/// The rows with the command held and the cause that explains them so, where both together are likelier than what was `found` with a
/// command that moved. That a command moved makes every prediction behind its jumps uncertain, so that a cause may hide there: one that
/// acts on the air.
pub(crate) fn held_with_a_cause(rows: &Rows<'_>, moved: &Problem<'_>, found: &Found) -> Option<(Record, Begin)> {
    let held = rows.held(&Hypothesis::null(rows.nominal), moved.record)?;
    let signals = Signals::default();
    let problem = Problem::new((rows.rig, &held), rows.judgeable, rows.nominal, (&signals, moved.effort));
    let null = problem.fit(found.null.hypothesis.clone(), constants::iterations())?;
    let wanted = Wanted { acting: rows.air(), ..Wanted::any(&problem) };
    let mut memory = Memory::default();
    let best = extensions(&problem, &null, &wanted, &mut memory).into_iter().next()?;
    let likelier = rows.is_likelier((&held, &best.hypothesis), (moved.record, &found.best.hypothesis));
    likelier.then(|| (held, Begin::of(&null, &best, &memory)))
}
