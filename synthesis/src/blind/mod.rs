//! The blind suite: cases drawn at random and kept from the diagnosis, scored like the DAMADICS benchmark.

mod json;
mod plan;
mod report;
mod run;
mod score;
#[cfg(test)]
mod score_tests;
mod tally;

pub use json::JsonError;
pub use plan::{Class, Nominal, Plan, PlanError, plans, plans_hiding};
pub use report::{case_lines, markdown};
pub use run::{Diagnose, Entry, run, run_one};
pub use score::{Answer, Estimate, Holdout, LARGEST_TIE, Named, Outcome, ParameterScore, Score, score};
pub use tally::{Rate, Tally};
