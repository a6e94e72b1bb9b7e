//! One fit of all candidates beside a model.

use rig_shared::effects::Kind;

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::kinds::{doubles, has_many_orders, is_first_law, is_searched, rivals};
use crate::fit::least_squares::Fit;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::Search;
use rig_model::batch::each_by;

impl Search<'_> {
    /// Fits all candidates, best gain first, except `impossible` ones and those excluded by one that is `present`.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn sweep(
        &self,
        fit: &Fit,
        present: &[Candidate],
        impossible: &[Candidate],
    ) -> Result<Vec<FittedCandidate>, DiagnoseError> {
        self.sweep_of(fit, present, impossible, &|_| true)
    }

    /// Fits the candidates of one joint: possible replacements of an effect there.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn sweep_at(
        &self,
        joint: usize,
        fit: &Fit,
        present: &[Candidate],
        impossible: &[Candidate],
    ) -> Result<Vec<FittedCandidate>, DiagnoseError> {
        // A tilt acts on all joints.
        let there = |c: &Candidate| c.joint == joint || c.kind == Kind::GravityTilt;
        self.sweep_of(fit, present, impossible, &there)
    }

    fn sweep_of(
        &self,
        fit: &Fit,
        present: &[Candidate],
        impossible: &[Candidate],
        among: &dyn Fn(&Candidate) -> bool,
    ) -> Result<Vec<FittedCandidate>, DiagnoseError> {
        let open: Vec<usize> = (0..self.library.len())
            .filter(|c| {
                let candidate = &self.library[*c];
                is_searched(candidate.kind)
                    && among(candidate)
                    && !present.iter().any(|w| rivals(w, candidate))
                    && !impossible.contains(candidate)
            })
            .collect();
        let taken = [present, impossible].concat();
        let mut profiles = each_by(open.len(), self.threads, |k| {
            self.profile_but(fit, open[k], None, &taken)
        })
        .into_iter()
        .filter_map(Result::transpose)
        .collect::<Result<Vec<_>, _>>()?;
        better_laws(&mut profiles);
        for profile in &mut profiles {
            profile.near_collinear = present.iter().any(|p| doubles(p, &profile.candidate));
        }
        profiles.sort_by(|a, b| {
            b.evidence
                .gain
                .total_cmp(&a.evidence.gain)
                .then_with(|| a.candidate.kind.cmp(&b.candidate.kind))
        });
        Ok(profiles)
    }

    /// Returns the number of trials of a sweep.
    pub(crate) fn trials(&self) -> usize {
        (self.library.iter())
            .filter(|c| is_searched(c.kind))
            .map(|c| {
                let shown = self.grid(c).into_iter().filter(|s| self.shows(c, s));
                // The loudest orders beyond the grid were selected from all scanned ones.
                let chosen_from = if has_many_orders(c.kind) {
                    self.orders[c.joint].scanned
                } else {
                    0
                };
                shown.count() + chosen_from
            })
            .sum()
    }
}

/// Keeps the best law of each name, if the laws are equally flexible: a second law is no second effect.
fn better_laws(profiles: &mut Vec<FittedCandidate>) {
    let rank = |p: &FittedCandidate| (p.at_bound.is_none(), p.evidence.gain);
    let beaten: Vec<bool> = (profiles.iter())
        .map(|own| {
            (profiles.iter()).any(|other| {
                let [a, b] = [own, other].map(|p| p.candidate.kind);
                a != b
                    && a.about().name == b.about().name
                    && !(is_first_law(a) && is_first_law(b))
                    && (own.candidate.joint, own.candidate.other)
                        == (other.candidate.joint, other.candidate.other)
                    && (rank(other) > rank(own) || rank(other) == rank(own) && is_first_law(b))
            })
        })
        .collect();
    let mut beaten = beaten.into_iter();
    profiles.retain(|_| beaten.next() != Some(true));
}
