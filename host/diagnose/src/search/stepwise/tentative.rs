//! Trial of effects that are not significant because another effect is missing or wrong.

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::kinds::is_gear;
use crate::fit::least_squares::Fit;
use crate::levels::SIGNIFICANT;
use crate::search::chosen::same;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::Search;

/// RMS share that a candidate must remove for a trial although it is not significant. Other missing effects then
/// dominate the residual, whose long correlation leaves few independent blocks.
const WORTH_TRYING: f64 = 0.1;
/// Maximum number of candidates on trial.
const TRIES: usize = 2;

impl Search<'_> {
    /// Adds one of `profiles` that is not significant and settles all effects. Returns the larger model if each effect
    /// passes in it; None if no such model exists.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn tried_together(
        &self,
        base: &Fit,
        chosen: &[FittedCandidate],
        profiles: &[FittedCandidate],
        trials: usize,
        impossible: &[Candidate],
    ) -> Result<Option<Vec<FittedCandidate>>, DiagnoseError> {
        // A lone candidate would stay not significant.
        if chosen.is_empty() {
            return Ok(None);
        }
        let unsure = |p: &&FittedCandidate| {
            !is_gear(p.candidate.kind)
                && p.at_bound.is_none()
                && p.evidence.joint_gain >= WORTH_TRYING
                && p.corrected(trials) > SIGNIFICANT
        };
        for newcomer in profiles.iter().filter(unsure).take(TRIES) {
            let mut list = chosen.to_vec();
            list.push(newcomer.clone());
            self.refine_prune_swap(base, &mut list, trials, impossible)?;
            let passes = |p: &FittedCandidate| {
                self.is_described(&p.candidate) || p.refused(trials).is_none()
            };
            if !same(&list, chosen) && list.len() > chosen.len() && list.iter().all(passes) {
                return Ok(Some(list));
            }
        }
        Ok(None)
    }
}
