//! Effects that another, missing or wrong, keeps from being sure: put in first, and judged together.

use super::{Search, is_gear, same};
use crate::DiagnoseError;
use crate::columns::Candidate;
use crate::fit::Fit;
use crate::profile::{Profile, SIGNIFICANT};

/// Share of the RMS that a candidate must take away to be put in although chance might do so: what is left is mostly of others then,
/// and goes on for long, so that few stretches of it are independent.
const WORTH_TRYING: f64 = 0.1;
/// Candidates that are put in, one after the other.
const TRIES: usize = 2;

impl Search<'_> {
    /// `chosen` with one of `profiles` that is not sure beside it, everything settled, where each effect passes by itself then; none
    /// where that makes none sure.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn tried_together(
        &self,
        base: &Fit,
        chosen: &[Profile],
        profiles: &[Profile],
        trials: usize,
        impossible: &[Candidate],
    ) -> Result<Option<Vec<Profile>>, DiagnoseError> {
        // Alone it stays as unsure as it is.
        if chosen.is_empty() {
            return Ok(None);
        }
        let unsure = |p: &&Profile| {
            !is_gear(p.candidate.kind)
                && p.vanished.is_none()
                && p.evidence.joint_gain >= WORTH_TRYING
                && p.corrected(trials) > SIGNIFICANT
        };
        for newcomer in profiles.iter().filter(unsure).take(TRIES) {
            let mut list = chosen.to_vec();
            list.push(newcomer.clone());
            self.settle(base, &mut list, trials, impossible)?;
            let passes =
                |p: &Profile| self.is_described(&p.candidate) || p.refused(trials).is_none();
            if !same(&list, chosen) && list.len() > chosen.len() && list.iter().all(passes) {
                return Ok(Some(list));
            }
        }
        Ok(None)
    }
}
