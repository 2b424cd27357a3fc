//! Runs the cases of a suite through a diagnosis, which sees the rig file and the log and nothing else.

use super::plan::Plan;
use super::score::{Answer, Score, score};
use crate::cause::Cause;
use rayon::prelude::*;
use rig_files::{Log, RigFile};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

/// A diagnosis that can be scored: the real one, a mutated one, an oracle in a test.
pub trait Diagnose: Sync {
    /// Diagnoses a log.
    ///
    /// # Errors
    /// Why it could not; the case then counts as failed.
    fn diagnose(&self, rig: &RigFile, log: &Log) -> Result<Answer, String>;
}

impl<F: Fn(&RigFile, &Log) -> Result<Answer, String> + Sync> Diagnose for F {
    fn diagnose(&self, rig: &RigFile, log: &Log) -> Result<Answer, String> {
        self(rig, log)
    }
}

/// One line of the result.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The case.
    pub plan: Plan,
    /// The rig's name.
    pub rig: String,
    /// The experiment's family.
    pub experiment: &'static str,
    /// What was hidden.
    pub hidden: Vec<Cause>,
    /// What was answered, or why nothing was.
    pub answer: Result<Answer, String>,
    /// How that scores; `None` for a failure.
    pub score: Option<Score>,
    /// Time the diagnosis took.
    pub took: Duration,
}

/// Draws, records, diagnoses and scores one case. A diagnosis that panics has failed this case, not the suite.
pub fn run_one(plan: Plan, rigs: &[RigFile], diagnose: &dyn Diagnose) -> Entry {
    let case = plan.draw_on(rigs);
    let (log, _) = case.record();
    let began = Instant::now();
    let answer = catch_unwind(AssertUnwindSafe(|| diagnose.diagnose(&case.rig_file, &log)))
        .unwrap_or_else(|_| Err("the diagnosis panicked".to_string()));
    let took = began.elapsed();
    let score = answer.as_ref().ok().map(|answer| score(&case.causes, answer));
    Entry {
        plan,
        rig: case.rig_file.name.clone(),
        experiment: case.experiment.name,
        hidden: case.causes,
        answer,
        score,
        took,
    }
}

/// Runs all plans, `jobs` at a time, and calls `done` after each; the entries are in the order of the plans.
///
/// # Errors
/// The threads could not be started.
pub fn run(
    plans: &[Plan],
    rigs: &[RigFile],
    jobs: usize,
    diagnose: &dyn Diagnose,
    done: &(dyn Fn(&Entry) + Sync),
) -> Result<Vec<Entry>, String> {
    let one = |plan: &Plan| {
        let entry = run_one(*plan, rigs, diagnose);
        done(&entry);
        entry
    };
    if jobs <= 1 {
        // On the caller's thread, so that the diagnosis has all cores to itself.
        return Ok(plans.iter().map(one).collect());
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build().map_err(|error| error.to_string())?;
    Ok(pool.install(|| plans.par_iter().map(one).collect()))
}
