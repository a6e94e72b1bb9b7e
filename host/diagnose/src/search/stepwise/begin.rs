//! Start of a search from the described effects.

use std::sync::Arc;

use rig_shared::effects::SHAPES;

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::kinds::is_gear;
use crate::description::described_effects::{candidate, is_one};
use crate::fit::least_squares::Fit;
use crate::levels::LEAST_GAIN;
use crate::search::chosen::with;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::shadow::in_the_shadow;
use crate::search::stepwise::{Renew, STAYS, Search};

impl<'a> Search<'a> {
    /// Returns true if the description states an effect.
    pub(crate) fn is_described(&self, effect: &Candidate) -> bool {
        self.described.iter().any(|placed| is_one(placed, effect))
    }

    /// Returns the shapes of a gear that a link encoder showed; None for other effects.
    pub(crate) fn shapes_of(&self, effect: &Candidate) -> Option<[f64; SHAPES]> {
        let own = |(candidate, _): &&(Candidate, _)| candidate == effect;
        self.measured.iter().find(own).map(|(_, shapes)| *shapes)
    }

    /// Returns true if a link encoder showed the effect.
    pub(crate) fn is_measured(&self, effect: &Candidate) -> bool {
        self.shapes_of(effect).is_some()
    }

    /// Returns the shapes of a gear whose shapes are fixed.
    pub(crate) fn fixed(&self, effect: &Candidate) -> Option<[f64; SHAPES]> {
        let own = |(candidate, _): &&(Candidate, _)| candidate == effect;
        let settled = self.settled.iter().find(own).map(|(_, shapes)| *shapes);
        self.shapes_of(effect).or(settled)
    }

    /// Returns true for a gear known by torque alone, without a link encoder.
    pub(crate) fn is_gear_by_torque(&self, effect: &Candidate) -> bool {
        is_gear(effect.kind) && !self.is_measured(effect)
    }

    /// Returns the joints with such a gear.
    pub(crate) fn loud(&self, chosen: &[FittedCandidate]) -> Vec<usize> {
        (chosen.iter().map(|p| &p.candidate))
            .filter(|c| self.is_gear_by_torque(c))
            .map(|c| c.joint)
            .collect()
    }

    /// Refits the shapes of gears known by torque, with the row weights of `base`, and fixes them.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn settle_gears(
        &mut self,
        base: &Fit,
        chosen: &mut [FittedCandidate],
    ) -> Result<(), DiagnoseError> {
        self.settled.clear();
        let mut settled = Vec::new();
        for i in 0..chosen.len() {
            let FittedCandidate {
                candidate, shapes, ..
            } = chosen[i];
            if !self.is_gear_by_torque(&candidate) {
                continue;
            }
            let place = self.place(&candidate);
            let beside = with(base, chosen, Some(i));
            if let Some(c) = place
                && let Some(better) = self.profile(&beside, c, Some(shapes))?
            {
                chosen[i] = better;
            }
            settled.push((candidate, chosen[i].shapes));
        }
        self.settled = settled;
        Ok(())
    }

    /// Returns the rank of an effect: described ones first, then those from link encoders.
    pub(crate) fn rank_of(&self, effect: &Candidate) -> u8 {
        match (self.is_described(effect), self.is_measured(effect)) {
            (true, _) => 0,
            (false, true) => 1,
            (false, false) => 2,
        }
    }

    /// Returns the number of effects that no search by torque found. They come first.
    pub(crate) fn count_given(&self, chosen: &[FittedCandidate]) -> usize {
        let given = |p: &&FittedCandidate| self.rank_of(&p.candidate) < 2;
        chosen.iter().take_while(given).count()
    }

    /// Returns the number of described effects. They come first.
    pub(crate) fn count_described(&self, chosen: &[FittedCandidate]) -> usize {
        let described = |p: &&FittedCandidate| self.is_described(&p.candidate);
        chosen.iter().take_while(described).count()
    }

    /// Returns the described effects, refined, without those that are not significant.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn warm_start(
        &mut self,
        base: &Fit,
        renew: &Renew<'_, 'a>,
    ) -> Result<Vec<FittedCandidate>, DiagnoseError> {
        let mut chosen = Vec::new();
        let described = self.described.iter().map(|placed| {
            let own = candidate(placed);
            (own, self.shapes_of(&own).unwrap_or(placed.effect.shapes))
        });
        let measured = (self.measured.iter().copied()).filter(|(c, _)| !self.is_described(c));
        for (candidate, shapes) in described.chain(measured) {
            chosen.push(FittedCandidate::unjudged(
                candidate,
                shapes,
                self.source.columns(&candidate, &shapes)?,
            ));
        }
        if chosen.is_empty() {
            return Ok(chosen);
        }
        // First update load, inertia and contact deflection with the described effects. Shapes would diverge beside
        // columns without them.
        for _ in 0..2 {
            self.renewed(renew(&chosen)?);
            for profile in &mut chosen {
                let columns = self.source.columns(&profile.candidate, &profile.shapes)?;
                profile.columns = Arc::new(columns);
            }
        }
        for _ in 0..2 {
            self.renewed(renew(&chosen)?);
            self.refine_all(base, &mut chosen)?;
        }
        self.prune(base, &mut chosen)?;
        Ok(chosen)
    }

    /// Removes effects that are no longer significant; returns those at a bound. Given effects are exempt from the
    /// minimum-gain and mismatch tests.
    pub(crate) fn prune(
        &self,
        base: &Fit,
        chosen: &mut Vec<FittedCandidate>,
    ) -> Result<Vec<Candidate>, DiagnoseError> {
        let mut at_bound = Vec::new();
        let mut i = 0;
        while i < chosen.len() {
            let e = &chosen[i].evidence;
            let unsure = e.p_value > STAYS || chosen[i].in_too_few_blocks();
            let weak = if self.rank_of(&chosen[i].candidate) < 2 {
                unsure
            } else {
                chosen.len() > 1
                    && (unsure
                        || e.joint_gain < LEAST_GAIN.min(chosen[i].least_gain())
                        || in_the_shadow(self.source.robot, chosen, i))
            };
            if weak || chosen[i].at_bound.is_some() {
                let gone = chosen.remove(i);
                at_bound.extend(gone.at_bound.map(|_| gone.candidate));
                self.refine_all(base, chosen)?;
                i = 0;
            } else {
                i += 1;
            }
        }
        Ok(at_bound)
    }
}
