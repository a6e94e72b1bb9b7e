//! Growth of a model: one effect after the other, until none is significant.

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::fit::least_squares::Fit;
use crate::search::chosen::{same, sorts, with};
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::{Renew, Search};

/// Rounds in which each law is compared with other laws of its name, beside the updated others.
const LAWS_ANEW: usize = 2;
/// Maximum number of effects beside the described ones. The orders of one wave count once.
const MOST_EFFECTS: usize = 6;

/// What stays the same during a search.
struct Terms<'t, 'f, 'r, 'a> {
    /// The nominal columns.
    base: &'t Fit<'f>,
    /// Number of trials, for the correction of p-values.
    trials: usize,
    /// Source for given effects.
    renew: &'t Renew<'r, 'a>,
}

/// Progress of a search.
struct Growth {
    /// The effects so far.
    chosen: Vec<FittedCandidate>,
    /// Candidates that do not stand beside the others.
    impossible: Vec<Candidate>,
    /// Earlier lists of effects.
    stood: Vec<Vec<FittedCandidate>>,
}

impl<'a> Search<'a> {
    /// Finds effects one by one, after the described ones or after those `found` with other row weights. `base` holds
    /// the nominal columns. `told` receives every sweep and the number of effects found. `renew` returns the source for
    /// given effects.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn run(
        &mut self,
        base: &Fit,
        found: Option<Vec<FittedCandidate>>,
        renew: &Renew<'_, 'a>,
        told: &mut dyn FnMut(usize, &[FittedCandidate]),
    ) -> Result<Vec<FittedCandidate>, DiagnoseError> {
        let mut growth = Growth {
            chosen: match found {
                None => self.warm_start(base, renew)?,
                Some(found) => self.adopted(base, found, renew)?,
            },
            impossible: Vec::new(),
            stood: Vec::new(),
        };
        let beside = Terms {
            base,
            trials: self.trials(),
            renew,
        };
        let most = sorts(&growth.chosen) + MOST_EFFECTS;
        while sorts(&growth.chosen) < most {
            let fit = with(base, &growth.chosen, None);
            let present: Vec<Candidate> = growth.chosen.iter().map(|p| p.candidate).collect();
            let profiles = self.sweep(&fit, &present, &growth.impossible)?;
            let found = |p: &&FittedCandidate| !self.is_described(&p.candidate);
            told(growth.chosen.iter().filter(found).count(), &profiles);
            let grows = match self.first_to_take(&fit, &profiles, beside.trials) {
                Some(best) => self.takes(&beside, &mut growth, best, &profiles)?,
                None => self.takes_together(&beside, &mut growth, &profiles)?,
            };
            if !grows {
                break;
            }
        }
        let Growth {
            mut chosen,
            impossible,
            ..
        } = growth;
        self.compare_laws(&beside, &mut chosen)?;
        chosen.sort_by_key(|profile| self.rank_of(&profile.candidate));
        self.dropped = impossible;
        Ok(chosen)
    }

    /// Returns effects found with other row weights, without those that no longer stand.
    fn adopted(
        &mut self,
        base: &Fit,
        mut found: Vec<FittedCandidate>,
        renew: &Renew<'_, 'a>,
    ) -> Result<Vec<FittedCandidate>, DiagnoseError> {
        self.renewed(renew(&found)?);
        self.refine_all(base, &mut found)?;
        self.prune(base, &mut found)?;
        Ok(found)
    }

    /// Adds the `best` effect of a sweep, and updates the others. Returns false if the search ends.
    fn takes(
        &mut self,
        beside: &Terms<'_, '_, '_, 'a>,
        growth: &mut Growth,
        best: FittedCandidate,
        profiles: &[FittedCandidate],
    ) -> Result<bool, DiagnoseError> {
        let Terms {
            base,
            trials,
            renew,
        } = *beside;
        let Growth {
            chosen,
            impossible,
            stood,
        } = growth;
        let best = self.plain_before_gear(base, chosen, best, profiles, trials)?;
        let best = self.richer_law_first(base, chosen, best, profiles, trials)?;
        let before = chosen.clone();
        let newcomer = best.candidate;
        chosen.push(best);
        let at_bound = self.refine_prune_swap(base, chosen, trials, impossible)?;
        if at_bound.contains(&newcomer) && !same(&before, chosen) {
            // It removed others that it needs.
            impossible.push(newcomer);
            *chosen = before;
            return Ok(true);
        }
        self.refresh_predictions(base, chosen, renew)?;
        self.constant_side(base, chosen, renew)?;
        let place = chosen.iter().position(|p| p.candidate == newcomer);
        if let Some(i) = place
            && let Some(smaller) = self.smaller(base, chosen, i, profiles, trials)?
        {
            chosen[i] = smaller;
            self.refine_all(base, chosen)?;
            chosen.retain(|profile| profile.at_bound.is_none());
        }
        stood.push(before);
        if stood.iter().any(|before| same(before, chosen)) {
            // It is not stable at its best shapes, or two effects remove each other in turn. A weaker one may stay.
            if impossible.contains(&newcomer) {
                return Ok(false);
            }
            impossible.push(newcomer);
        }
        Ok(true)
    }

    /// Adds an effect that is significant together with the others only. Returns false if there is none, and notes a
    /// backlash that almost passed.
    fn takes_together(
        &mut self,
        beside: &Terms<'_, '_, '_, 'a>,
        growth: &mut Growth,
        profiles: &[FittedCandidate],
    ) -> Result<bool, DiagnoseError> {
        let Terms {
            base,
            trials,
            renew,
        } = *beside;
        let Growth {
            chosen,
            impossible,
            stood,
        } = growth;
        let together = self.tried_together(base, chosen, profiles, trials, impossible)?;
        let Some(together) = together.filter(|list| !stood.iter().any(|before| same(before, list)))
        else {
            let nearly = profiles.iter().find(|p| p.is_nearly_a_play(trials));
            self.nearly = nearly.cloned();
            return Ok(false);
        };
        stood.push(std::mem::replace(chosen, together));
        self.refresh_predictions(base, chosen, renew)?;
        self.constant_side(base, chosen, renew)?;
        Ok(true)
    }

    /// Replaces effects by better laws of their names, beside the updated others.
    fn compare_laws(
        &mut self,
        beside: &Terms<'_, '_, '_, 'a>,
        chosen: &mut Vec<FittedCandidate>,
    ) -> Result<(), DiagnoseError> {
        let Terms {
            base,
            trials,
            renew,
        } = *beside;
        for _ in 0..LAWS_ANEW {
            let other = self.other_laws(base, chosen)?;
            if !self.springs_to_constants(base, chosen, trials)? && !other {
                break;
            }
            self.refresh_predictions(base, chosen, renew)?;
            self.constant_side(base, chosen, renew)?;
        }
        Ok(())
    }
}
