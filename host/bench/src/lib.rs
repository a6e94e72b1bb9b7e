//! A benchmark for developers: how often a method finds the hidden effects in recordings of the emulated rig, and how
//! often it names effects that are not there.
//!
//! All figures are over scenarios of [`rig_scenario`]; proportions have Wilson intervals. Run
//! `cargo run --release -p rig-bench -- --help` for the options.

mod answer;
mod arms;
mod cases;
mod follow;
mod parameters;
pub mod peer;
mod score;
mod table;
#[cfg(test)]
mod tests;
mod wilson;

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use rig_diagnose::DiagnoseError;
use rig_model::batch::each_by;
use rig_output::WriteError;
use rig_scenario::ScenarioError;

pub use answer::{Answer, Diagnose, Method, Named, Proposed, exact_class, is_right};
pub use arms::{ArmCase, ArmOutcome, arm_cases, arm_table, run_arms};
pub use cases::{Case, Group, Plan};
pub use follow::Followed;
pub use parameters::{Compared, compare};
pub use score::{EffectScore, Outcome, Score};
pub use table::markdown;
pub use wilson::Proportion;

/// Reason why the benchmark stopped.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A scenario cannot be made.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A method cannot process a recording.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The output folder holds results already.
    #[error(
        "{0} holds results of an earlier run; name another folder with --out, or replace them with --force."
    )]
    Results(PathBuf),
    /// An option is out of its range; a sentence.
    #[error("{0}")]
    Option(String),
}

/// Runs every method on every case in `threads` threads. Calls `progress` with the number of finished cases and their
/// total. Returns one list of outcomes for each method, in the order of the cases.
///
/// # Errors
/// A scenario cannot be made. A failed method is an outcome, not an error.
pub fn run(
    cases: &[Case],
    methods: &[&dyn Method],
    threads: usize,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Vec<Outcome>>, BenchError> {
    let mut lists: Vec<Vec<Outcome>> = methods.iter().map(|_| Vec::new()).collect();
    for outcomes in counted(cases, threads, progress, |case| ask(case, methods))? {
        for (list, outcome) in lists.iter_mut().zip(outcomes) {
            list.push(outcome);
        }
    }
    Ok(lists)
}

/// Processes the cases in `threads` threads and returns the results in the order of the cases.
fn counted<C: Sync, O: Send>(
    cases: &[C],
    threads: usize,
    progress: &(dyn Fn(usize, usize) + Sync),
    ask: impl Fn(&C) -> Result<O, BenchError> + Sync,
) -> Result<Vec<O>, BenchError> {
    let done = AtomicUsize::new(0);
    let results = each_by(cases.len(), threads, |k| {
        let outcome = ask(&cases[k]);
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, cases.len());
        outcome
    });
    results.into_iter().collect()
}

fn ask(case: &Case, methods: &[&dyn Method]) -> Result<Vec<Outcome>, BenchError> {
    let (made, sizes) = case.make()?;
    Ok(methods
        .iter()
        .map(|method| {
            let (answer, failure) = match method.answer(&made, &case.without) {
                Ok(answer) => (Some(answer), None),
                Err(error) => (None, Some(error.to_string())),
            };
            let followed = answer
                .as_ref()
                .filter(|_| case.follow)
                .and_then(|answer| follow::follow(case, &made, *method, answer));
            let found = answer.iter().flat_map(|a| &a.named);
            let parameters = found
                .flat_map(|named| {
                    let hidden = made.truth.hidden.iter();
                    hidden
                        .filter(|h| h.effect.name() == named.effect)
                        .flat_map(|h| compare(&h.effect, &made.truth, named, &made.robot))
                        .collect::<Vec<_>>()
                })
                .collect();
            Outcome {
                group: case.group,
                level: case.level,
                seed: case.scenario.seed,
                hidden: case.scenario.hidden.clone(),
                sizes: sizes.clone(),
                answer,
                failure,
                followed,
                parameters,
            }
        })
        .collect())
}
