//! Acceptance of the effects found: tests by simulated motion and joint fit, on training data alone.

use crate::DiagnoseError;
use crate::acceptance::credibility::unbelieved;
use crate::acceptance::judge::{Judge, Judged};
use crate::description::preferred_values::by_description;
use crate::fit::refit::Refit;
use crate::models::bodies::ModelCache;
use crate::models::simulated_motion::Replay;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::refusal::Refusal;
use crate::search::tried_candidate::{TriedCandidate, refuse, refuse_guesses};

/// Data for the acceptance tests.
pub(crate) struct Trial<'a, 'r> {
    /// The training data.
    pub(crate) judge: &'a Judge<'a, 'r>,
    /// The nominal model on them.
    pub(crate) refit: &'a Refit<'r>,
    /// Models with effects.
    pub(crate) fitting: &'a ModelCache<'a, 'r>,
    /// Simulation of the training motion.
    pub(crate) replay: &'a Replay<'a>,
}

/// Result of the acceptance tests.
pub(crate) struct Accepted {
    /// Accepted effects.
    pub(crate) judged: Judged,
    /// Dropped effects with a large gain.
    pub(crate) fallen: Vec<FittedCandidate>,
}

impl Trial<'_, '_> {
    /// Drops effects that fail a test, one at a time, and writes the reason to `tried`.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn stand(
        &self,
        found: Vec<FittedCandidate>,
        tried: &mut [TriedCandidate],
    ) -> Result<Accepted, DiagnoseError> {
        let Self { judge, refit, .. } = self;
        let judged = judge.judged(found)?;
        refuse_guesses(tried, &judged.guesses);
        let judged = by_description(judge, refit, self.fitting.context, judged)?;
        refuse_guesses(tried, &judged.guesses);
        let left = Accepted {
            judged,
            fallen: Vec::new(),
        };
        self.tested(left, tried)
    }

    /// Drops effects that degrade the simulated motion or are not credible beside the others.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn tested(
        &self,
        left: Accepted,
        tried: &mut [TriedCandidate],
    ) -> Result<Accepted, DiagnoseError> {
        let Self { judge, refit, .. } = self;
        // An effect that increases the simulated error replaces another one.
        let mut left = self.unspoilt(left, tried)?;
        while let Some((k, why)) = unbelieved(refit, judge.search, judge, &left.judged.chosen)? {
            left = self.without(left, k, why, tried)?;
        }
        Ok(left)
    }

    /// Drops effects that degrade the simulated training motion.
    fn unspoilt(
        &self,
        mut left: Accepted,
        tried: &mut [TriedCandidate],
    ) -> Result<Accepted, DiagnoseError> {
        let given = |chosen: &[FittedCandidate]| self.judge.search.count_given(chosen);
        while let Some(k) = {
            let chosen = &left.judged.chosen;
            self.replay.spoiling(chosen, given(chosen))?
        } {
            left = self.without(left, k, Refusal::WorseMotion, tried)?;
        }
        Ok(left)
    }

    /// Drops the `k`-th effect with the reason `why`, and judges the others.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn without(
        &self,
        Accepted { judged, mut fallen }: Accepted,
        k: usize,
        why: Refusal,
        tried: &mut [TriedCandidate],
    ) -> Result<Accepted, DiagnoseError> {
        let search = self.judge.search;
        let mut stand = judged.chosen;
        let gone = stand.remove(k);
        refuse(tried, &gone, why);
        if gone.takes_much(search.trials()) {
            fallen.push(gone);
        }
        let stand = search.possible(&self.refit.base, stand)?;
        let judged = self.judge.judged(stand)?;
        refuse_guesses(tried, &judged.guesses);
        Ok(Accepted { judged, fallen })
    }
}
