//! Cases in several threads, with progress.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::error::BenchError;
use rig_model::batch::each_by;

/// Processes the cases in `threads` threads and returns the results in the order of the cases.
pub(super) fn counted<C: Sync, O: Send>(
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
