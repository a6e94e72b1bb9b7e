//! List of all trials of a search, kept consistent with the effects that stand.

use rig_shared::effects::Kind;

use crate::search::fitted_candidate::FittedCandidate;
use crate::search::refusal::Refusal;

/// A trial: one candidate in one sweep of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TriedCandidate {
    /// Its kind.
    pub(crate) kind: Kind,
    /// Its joint, from 0.
    pub(crate) joint: usize,
    /// Its step, from 0.
    pub(crate) step: usize,
    /// Share of the residual's RMS that it removes on blocks outside its fit.
    pub(crate) gain: f64,
    /// The gain over its standard deviation.
    pub(crate) gain_sigmas: f64,
    /// p-value corrected for all trials.
    pub(crate) p_value: f64,
    /// Reason for refusal; None for an accepted candidate.
    pub(crate) refused: Option<Refusal>,
}

impl TriedCandidate {
    /// Returns the trial of a candidate in a step, with the p-value corrected for `trials` trials.
    pub(crate) fn of(
        profile: &FittedCandidate,
        step: usize,
        trials: usize,
        refused: Option<Refusal>,
    ) -> Self {
        Self {
            kind: profile.candidate.kind,
            joint: profile.candidate.joint,
            step,
            gain: profile.evidence.gain,
            gain_sigmas: profile.evidence.gain_sigmas,
            p_value: profile.evidence.corrected(trials),
            refused,
        }
    }

    /// Returns true if it is a trial of this effect.
    fn is_of(&self, profile: &FittedCandidate) -> bool {
        self.kind == profile.candidate.kind && self.joint == profile.candidate.joint
    }
}

/// Notes in `tried` why an accepted effect was dropped.
pub(crate) fn refuse(tried: &mut [TriedCandidate], fallen: &FittedCandidate, why: Refusal) {
    let own = |t: &&mut TriedCandidate| t.refused.is_none() && t.is_of(fallen);
    if let Some(taken) = tried.iter_mut().find(own) {
        taken.refused = Some(why);
    }
}

/// Marks effects as refused that only approximated an unknown residual.
pub(crate) fn refuse_guesses(tried: &mut [TriedCandidate], guesses: &[FittedCandidate]) {
    for guess in guesses {
        refuse(tried, guess, Refusal::Guess);
    }
}

/// Replaces the entry of a law by that of another law with the same name that took over.
fn took_over(tried: &mut Vec<TriedCandidate>, profile: &FittedCandidate, trials: usize) {
    let (kind, joint) = (profile.candidate.kind, profile.candidate.joint);
    let first = (tried.iter().enumerate())
        .filter(|(_, t)| t.joint == joint && t.kind.about().name == kind.about().name)
        .max_by(|a, b| a.1.gain.total_cmp(&b.1.gain));
    let Some((at, first)) = first else { return };
    let step = first.step;
    tried[at].refused = Some(Refusal::AnotherLaw);
    tried.insert(at, TriedCandidate::of(profile, step, trials, None));
}

/// Makes the list of trials consistent with the final effects. Effects without a sweep of their own are marked as
/// accepted, absent ones as dropped.
pub(crate) fn reconcile(tried: &mut Vec<TriedCandidate>, found: &[FittedCandidate], trials: usize) {
    for profile in found {
        if tried
            .iter()
            .any(|t| t.refused.is_none() && t.is_of(profile))
        {
            continue;
        }
        let own = tried.iter_mut().filter(|t| t.is_of(profile));
        match own.max_by(|a, b| a.gain.total_cmp(&b.gain)) {
            Some(best) => best.refused = None,
            None => took_over(tried, profile, trials),
        }
    }
    let mut rounds = vec![0; found.len()];
    for fallen in tried.iter_mut().filter(|t| t.refused.is_none()) {
        let own: Vec<usize> = (0..found.len())
            .filter(|k| fallen.is_of(&found[*k]))
            .collect();
        // Each order of a wave was accepted in a sweep of its own.
        let stands = own.first().is_some_and(|first| {
            rounds[*first] += 1;
            found[*first].candidate.order.is_none() || rounds[*first] <= own.len()
        });
        if !stands {
            fallen.refused = Some(Refusal::FellAgain);
        }
    }
}
