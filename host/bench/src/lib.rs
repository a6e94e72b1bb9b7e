//! How often a method finds what was hidden in recordings of the emulated rig, and how often it finds what is not there.
//!
//! Every figure is over scenarios of [`rig_scenario`]; proportions come with Wilson intervals. It is a tool for developers:
//! `cargo run --release -p rig-bench -- --help`.

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

/// Why the bench cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A scenario that cannot be made.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A method that cannot work at all.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// A file that cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A folder that holds results.
    #[error(
        "{0} holds results of an earlier run; name another folder with --out, or replace them with --force."
    )]
    Results(PathBuf),
    /// An option out of its range, a sentence.
    #[error("{0}")]
    Option(String),
}

/// Puts every case to every method, `threads` at a time; `progress` hears how many of how many are done. The result has
/// one list a method, in the order of the cases.
///
/// # Errors
/// A scenario that cannot be made. A method that fails is an outcome, not an error.
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

/// What comes of each case, in their order, `threads` at a time.
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
