//! Choice of the smallest among candidates that explain equally well.
//!
//! A law that contains another one wins by a small margin if the other is true: a spring contains every constant. The
//! larger of two nested laws is taken if its additional part is significant (Wald 1943; block covariance as elsewhere)
//! and large enough for an effect. Other laws are compared by whether the data distinguish them.

use rig_shared::effects::Kind;

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::kinds::{self, is_gear};
use crate::fit::least_squares::Fit;
use crate::levels::{LEAST_GAIN, SIGNIFICANT};
use crate::search::chosen::with;
use crate::search::fitted_candidate::{FittedCandidate, equal};
use crate::search::spring::about_its_middle;
use crate::search::stepwise::Search;

impl Search<'_> {
    /// Returns the number of gains and shapes of a candidate.
    pub(crate) fn size(&self, candidate: &Candidate) -> usize {
        self.source.gains(candidate).len() + candidate.kind.about().shapes.len()
    }

    /// Returns the first effect to add from `profiles`, best first: the best that passes, or the smallest equal one on
    /// its joint. `fit` holds the rest of the model.
    pub(crate) fn first_to_take(
        &self,
        fit: &Fit,
        profiles: &[FittedCandidate],
        trials: usize,
    ) -> Option<FittedCandidate> {
        let passing = || profiles.iter().filter(|p| p.refused(trials).is_none());
        let best = passing().next()?;
        // Prefer the transmission without backlash, unless backlash has a clearly larger gain.
        if best.candidate.kind == Kind::Backlash {
            let simpler = passing().find(|p| {
                p.candidate.kind == Kind::JointElasticity
                    && p.candidate.joint == best.candidate.joint
            });
            if let Some(simpler) = simpler
                && best.evidence.beyond(&simpler.evidence) < LEAST_GAIN
            {
                return Some(simpler.clone());
            }
        }
        let smallest = passing()
            .filter(|p| self.as_good_and_smaller(fit, best, p, trials))
            .min_by_key(|p| self.size(&p.candidate));
        Some(smallest.unwrap_or(best).clone())
    }

    /// Returns the smaller candidate of `rivals` that replaces the `i`-th effect beside all others; None if it stays.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn smaller(
        &self,
        base: &Fit,
        chosen: &[FittedCandidate],
        i: usize,
        rivals: &[FittedCandidate],
        trials: usize,
    ) -> Result<Option<FittedCandidate>, DiagnoseError> {
        let own = &chosen[i];
        let fit = with(base, chosen, Some(i));
        let taken = |c: &Candidate| {
            (chosen.iter().enumerate()).any(|(k, p)| k != i && kinds::rivals(&p.candidate, c))
        };
        let mut best: Option<FittedCandidate> = None;
        for rival in rivals {
            let c = &rival.candidate;
            if c.joint != own.candidate.joint
                || rival.refused(trials).is_some()
                || self.size(c) >= self.size(&own.candidate)
                || taken(c)
            {
                continue;
            }
            let Some(place) = self.place(c) else {
                continue;
            };
            let Some(now) = self.profile(&fit, place, Some(rival.shapes))? else {
                continue;
            };
            let smallest = best
                .as_ref()
                .map_or(usize::MAX, |b| self.size(&b.candidate));
            if now.refused(trials).is_none()
                && self.size(c) < smallest
                && self.as_good_and_smaller(&fit, own, &now, trials)
            {
                best = Some(now);
            }
        }
        Ok(best)
    }

    /// Replaces springs by the constants that they contain, if a later effect explains the rest. Returns true if it
    /// replaced one.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn springs_to_constants(
        &self,
        base: &Fit,
        chosen: &mut [FittedCandidate],
        trials: usize,
    ) -> Result<bool, DiagnoseError> {
        let mut changed = false;
        for i in 0..chosen.len() {
            let own = chosen[i].candidate;
            if own.kind != Kind::Spring || self.is_described(&own) {
                continue;
            }
            let rivals = self.alternatives(base, chosen, i)?;
            if let Some(smaller) = self.smaller(base, chosen, i, &rivals, trials)? {
                chosen[i] = smaller;
                changed = true;
            }
        }
        Ok(changed)
    }

    /// Returns true if the data support a smaller candidate as well as `best`. Gears are excluded: they fit too much,
    /// and the search compares them elsewhere.
    fn as_good_and_smaller(
        &self,
        fit: &Fit,
        best: &FittedCandidate,
        other: &FittedCandidate,
        trials: usize,
    ) -> bool {
        let gears = is_gear(best.candidate.kind) || is_gear(other.candidate.kind);
        let as_good = || {
            if holds(fit, best, other) {
                !adds(fit, best, other, trials)
            } else {
                equal(best, other)
            }
        };
        !gears
            && best.candidate.joint == other.candidate.joint
            && self.size(&other.candidate) < self.size(&best.candidate)
            && as_good()
    }
}

/// Returns true if the smaller one's columns are combinations of the larger one's and of the model's.
fn holds(fit: &Fit, larger: &FittedCandidate, smaller: &FittedCandidate) -> bool {
    let mut beside = fit.clone();
    for column in larger.columns.iter() {
        beside.push(column);
    }
    (smaller.columns.iter()).all(|c| beside.beside(std::slice::from_ref(c)).is_none())
}

/// Returns true if the additional part of the larger one is significant and large enough.
fn adds(fit: &Fit, larger: &FittedCandidate, smaller: &FittedCandidate, trials: usize) -> bool {
    let mut beside = fit.clone();
    for column in smaller.columns.iter() {
        beside.push(column);
    }
    let own = match larger.candidate.kind {
        Kind::Spring => beside.span(about_its_middle(fit, &larger.columns).as_slice()),
        _ => beside.span(&larger.columns),
    };
    let open = vec![[f64::NEG_INFINITY, f64::INFINITY]; own.len()];
    !own.is_empty()
        && (beside.evidence(&own, &open))
            .is_some_and(|e| e.corrected(trials) < SIGNIFICANT && e.joint_gain >= LEAST_GAIN)
}
