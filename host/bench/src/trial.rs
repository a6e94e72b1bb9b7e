//! Asks the methods about every case.

use super::answer::Method;
use super::cases::Case;
use super::counted::counted;
use super::error::BenchError;
use super::follow;
use super::outcome::Outcome;
use super::parameters::compare;

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
