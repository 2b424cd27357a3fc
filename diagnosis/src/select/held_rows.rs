//! Whether rows that look as if the command moved between them are those of a held command and a cause.

use super::forward::{Memory, Wanted, extensions};
use super::nominal_fit;
use crate::balances::shared::Signals;
use crate::data::record::Record;
use crate::estimate::between_rows::Rows;
use crate::estimate::problem::Problem;
use crate::model::hypothesis::Hypothesis;

/// The rows with the command held and the cause that explains them so, where both together are likelier than what was `found` with a
/// command that moved. That a command moved makes every prediction behind its jumps uncertain, so that a cause may hide there.
pub(crate) fn held_with_a_cause(
    rows: &Rows<'_>,
    moved: &Problem<'_>,
    found: &Hypothesis,
) -> Option<(Record, Hypothesis)> {
    let null = Hypothesis::null(rows.nominal);
    let held = rows.held(&null)?;
    let signals = Signals::default();
    let problem = Problem::new((rows.rig, &held), rows.judgeable, rows.nominal, (&signals, moved.effort));
    let null = nominal_fit::fitted(&problem, &null)?;
    let best = extensions(&problem, &null, &Wanted::any(&problem), &mut Memory::default()).into_iter().next()?;
    let likelier = rows.is_likelier((&held, &best.hypothesis), (moved.record, found));
    likelier.then_some((held, best.hypothesis))
}
