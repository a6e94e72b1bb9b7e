//! Comparison of two plain effects with one flexible effect: a gear, or a friction law with many shapes.

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::kinds::{is_gear, is_searched};
use crate::fit::least_squares::Fit;
use crate::search::chosen::with;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::Search;

/// Share of the best default law's residual that another law must remove to precede it.
const FAR_MORE: f64 = 0.5;

impl Search<'_> {
    /// Prevents a false gear: one with stiction fits friction with both memory and Stribeck fall. If two plain effects
    /// of any laws leave at most the same residual, the first of them is taken.
    pub(crate) fn plain_before_gear(
        &self,
        base: &Fit,
        chosen: &[FittedCandidate],
        best: FittedCandidate,
        profiles: &[FittedCandidate],
        trials: usize,
    ) -> Result<FittedCandidate, DiagnoseError> {
        let joint = best.candidate.joint;
        let plain = (profiles.iter())
            .filter(|p| !is_gear(p.candidate.kind) && p.candidate.joint == joint)
            .find(|p| p.refused(trials).is_none());
        let Some(plain) = plain.filter(|_| is_gear(best.candidate.kind)) else {
            return Ok(best);
        };
        let mut pair = self.pair(base, chosen, plain, trials)?;
        self.other_laws(base, &mut pair)?;
        let instead = left(base, &pair, joint) <= left(base, &and(chosen, &best), joint);
        Ok(match pair.into_iter().nth(chosen.len()) {
            Some(plain) if instead => plain,
            _ => best,
        })
    }

    /// Prevents a wrong name: where the default law misses most of the torque, another name would win. A law that
    /// removes far more is taken instead, unless two plain effects leave at most the same residual.
    pub(crate) fn richer_law_first(
        &self,
        base: &Fit,
        chosen: &[FittedCandidate],
        best: FittedCandidate,
        profiles: &[FittedCandidate],
        trials: usize,
    ) -> Result<FittedCandidate, DiagnoseError> {
        let joint = best.candidate.joint;
        if is_gear(best.candidate.kind) {
            return Ok(best);
        }
        let fit = with(base, chosen, None);
        let mut rich: Option<FittedCandidate> = None;
        let passing =
            |p: &&FittedCandidate| p.candidate.joint == joint && p.refused(trials).is_none();
        for first in profiles.iter().filter(passing) {
            for (c, law) in self.laws_beside(first.candidate) {
                if is_searched(law.kind) || is_gear(law.kind) {
                    continue;
                }
                if let Some(law) = self.profile(&fit, c, None)?
                    && law.refused(trials).is_none()
                    && (rich.as_ref()).is_none_or(|r| law.evidence.gain > r.evidence.gain)
                {
                    rich = Some(law);
                }
            }
        }
        let Some(rich) = rich.filter(|r| r.evidence.beyond(&best.evidence) > FAR_MORE) else {
            return Ok(best);
        };
        let pair = self.pair(base, chosen, &best, trials)?;
        let plain = left(base, &pair, joint) <= left(base, &and(chosen, &rich), joint);
        Ok(if plain { best } else { rich })
    }

    /// Adds `first`, then the plain effect with the largest gain beside it, and refines all.
    fn pair(
        &self,
        base: &Fit,
        chosen: &[FittedCandidate],
        first: &FittedCandidate,
        trials: usize,
    ) -> Result<Vec<FittedCandidate>, DiagnoseError> {
        let mut pair = and(chosen, first);
        let taken = pair.iter().map(|p| p.candidate);
        let gears = self.library.iter().filter(|c| is_gear(c.kind));
        let without: Vec<Candidate> = taken.chain(gears.copied()).collect();
        let fit = with(base, &pair, None);
        let second = self.sweep_at(first.candidate.joint, &fit, &without, &[])?;
        pair.extend((second.into_iter()).find(|p| p.refused(trials).is_none()));
        for _ in 0..2 {
            self.refine_all(base, &mut pair)?;
        }
        Ok(pair)
    }
}

fn and(chosen: &[FittedCandidate], more: &FittedCandidate) -> Vec<FittedCandidate> {
    chosen.iter().chain([more]).cloned().collect()
}

fn left(base: &Fit, list: &[FittedCandidate], joint: usize) -> f64 {
    with(base, list, None).rms(joint)
}
