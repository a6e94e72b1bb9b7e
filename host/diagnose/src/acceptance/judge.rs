//! Judgement of a search's effects: the noise floor, the unexplained residual, alternative names.

mod doubts;
pub(crate) mod rank;
pub(crate) mod unseen;

use rig_shared::effects::Kind;

use crate::DiagnoseError;
use crate::acceptance::coordinates::Coordinate;
use crate::acceptance::lack_of_fit::misfit;
use crate::acceptance::law_mismatch::besides;
use crate::acceptance::residual_dependence::dependence::Dependence;
use crate::acceptance::residual_dependence::refitted::Refitted;
use crate::acceptance::residual_dependence::{Known, locate};
use crate::acceptance::unexplained::{RemainderCause, Unexplained};
use crate::columns::kinds::is_gear;
use crate::experiment::exact;
use crate::fit::least_squares::Fit;
use crate::gap::closed;
use crate::levels::{BEYOND_FLOOR, SIGNIFICANT};
use crate::models::observer_models::ObserverModels;
use crate::outcome::FloorFrom;
use crate::recordings::noise_floor;
use crate::recordings::noise_floor::{Repeated, of_torque};
use crate::recordings::outlier_segment::{Burst, burst};
use crate::recordings::position_reading::PositionReading;
use crate::rows::regression::Rows;
use crate::search::chosen::with;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::Search;

use rig_model::robot::{Joint, Robot};
use rig_numerics::statistics;

/// Share of its gap that an effect must close to be accepted beside a remainder.
const HALF: f64 = 0.5;
/// The same if every rival closes less than half as much.
const QUARTER: f64 = 0.25;
/// The same within the repeated runs. True models left 1.00 to 1.03 in 25 rigs of seed 3500, and up to 1.05 in 13 rigs
/// with a fifth of their noise.
const BEYOND_OWN_FLOOR: f64 = 1.06;
/// Standard deviations of chance (1/√rows each) in ratio² − 1 that the residual must also exceed.
const CHANCE: f64 = 4.0;
/// Residual-to-noise RMS ratio above which weak effects count as guesses.
const FAR_BEYOND_FLOOR: f64 = 1.25;
/// Share of the squares that a coordinate must explain for a remainder. With repeated runs: of the excess over the
/// floor. Less is enough there if the residual also exceeds the floor away from reversals.
const SHARE_LEFT: f64 = 0.1;

/// The judge of effects, with the training data.
pub(crate) struct Judge<'a, 'r> {
    /// As it was given.
    pub(crate) robot: &'a Robot,
    /// The candidate library on the training data.
    pub(crate) search: &'a Search<'r>,
    /// Follower of links behind gears.
    pub(crate) follower: &'a ObserverModels<'a, 'r>,
    /// The training data.
    pub(crate) rows: &'a Rows,
    /// Coordinates of the training data, joint by joint.
    pub(crate) coordinates: &'a [Vec<Coordinate>],
    /// Runs that repeat each other.
    pub(crate) pairs: Vec<(usize, usize)>,
    /// Torque error from the position readings, joint by joint.
    pub(crate) position_reading: PositionReading,
    /// Fit of the nominal model.
    pub(crate) base: &'a Fit<'r>,
    /// Seed of the bootstrap.
    pub(crate) seed: u64,
}

/// Accepted effects and the residual.
pub(crate) struct Judged {
    /// The effects.
    pub(crate) chosen: Vec<FittedCandidate>,
    /// Noise floor, joint by joint.
    pub(crate) floors: Vec<f64>,
    /// Noise floor with row weights.
    pub(crate) quiet: Vec<f64>,
    /// Noise floor that does not depend on a model, joint by joint; NaN if unknown.
    pub(crate) known: Vec<f64>,
    /// Sources of the known noise floors.
    pub(crate) from: Vec<FloorFrom>,
    /// The unexplained residual.
    pub(crate) left: Option<Unexplained>,
    /// Effects that only approximated it.
    pub(crate) guesses: Vec<FittedCandidate>,
    /// True if it is so large that effects may be guesses.
    much_left: bool,
}

impl Judge<'_, '_> {
    /// Returns the accepted effects among those found, and the residual.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn judged(&self, found: Vec<FittedCandidate>) -> Result<Judged, DiagnoseError> {
        let mut judged = self.as_found(found);
        let mut guesses = Vec::new();
        while let Some(guess) = self.guess(&judged)? {
            let mut stand = judged.chosen;
            guesses.push(stand.remove(guess));
            judged = self.as_found(self.search.possible(self.base, stand)?);
        }
        judged.guesses = guesses;
        Ok(judged)
    }

    /// Returns the effect that is most likely a guess at an unknown one; None if all are better than that. Described
    /// effects are no guesses.
    fn guess(&self, judged: &Judged) -> Result<Option<usize>, DiagnoseError> {
        match judged.much_left {
            true => self.beside_a_remainder(judged),
            false => Ok(self.beside_a_lack_of_fit(judged)),
        }
    }

    /// Returns the effect that closes less of the gap than it leaves open, unless no rival comes near.
    fn beside_a_remainder(&self, judged: &Judged) -> Result<Option<usize>, DiagnoseError> {
        let chosen = &judged.chosen;
        let followed = self.follower.followed(chosen, &judged.quiet)?;
        let followed = followed.map(|list| self.as_found(list));
        // A misfit of an open-loop gear is no reason to doubt effects of its joint. Other joints stay as they are.
        let on = |joint: usize| {
            let gear = |p: &FittedCandidate| p.candidate.joint == joint && p.followed.is_some();
            followed
                .as_ref()
                .filter(|last| last.chosen.iter().any(gear))
        };
        let closes = |k: usize| {
            let j = chosen[k].candidate.joint;
            let last = on(j).unwrap_or(judged);
            // Test the effect as a whole: each order of a wave closes only a part of the gap.
            let sort = chosen[k].candidate.sort();
            let others = last.chosen.iter().filter(|p| p.candidate.sort() != sort);
            let others: Vec<FittedCandidate> = others.cloned().collect();
            let [before, after] = [&others, &last.chosen].map(|list| with(self.base, list, None));
            // A gear shows at its contacts, whose rows have small weights: compare without weights.
            if is_gear(chosen[k].candidate.kind) {
                closed([before.even_rms(j), after.even_rms(j)], last.floors[j])
            } else {
                closed([before.rms(j), after.rms(j)], last.quiet[j])
            }
        };
        let mut doubtful: Vec<(usize, f64)> = (self.search.count_given(chosen)..chosen.len())
            .filter(|k| on(chosen[*k].candidate.joint).is_none_or(|last| last.much_left))
            .map(|k| (k, closes(k)))
            .filter(|(_, share)| *share < HALF)
            .collect();
        doubtful.sort_by(|a, b| a.1.total_cmp(&b.1));
        for (k, share) in doubtful {
            if share < QUARTER || !self.has_no_close_rival(chosen, k)? {
                return Ok(Some(k));
            }
        }
        Ok(None)
    }

    /// Returns the weakest effect of a joint of whose residual a free function still takes more than all effects of the
    /// joint took together: what they stand for is the smaller part of something unknown.
    fn beside_a_lack_of_fit(&self, judged: &Judged) -> Option<usize> {
        let chosen = &judged.chosen;
        let found = self.search.count_given(chosen)..chosen.len();
        let fit = with(self.base, chosen, None);
        (0..self.rows.joints()).find_map(|j| {
            let own: Vec<usize> = (found.clone())
                .filter(|k| chosen[*k].candidate.joint == j)
                .collect();
            if own.is_empty() || own.iter().any(|k| is_gear(chosen[*k].candidate.kind)) {
                return None;
            }
            let free = misfit(&self.search.source, self.rows, &fit, j)?;
            let others = (chosen.iter().enumerate()).filter(|(k, _)| !own.contains(k));
            let others: Vec<FittedCandidate> = others.map(|(_, p)| p.clone()).collect();
            let [before, after] = [with(self.base, &others, None).rms(j), fit.rms(j)];
            let taken = before * before - after * after;
            // Each order of a wave takes only a part.
            let gain = |k: &usize| -> f64 {
                let sort = chosen[*k].candidate.sort();
                let same = own.iter().filter(|i| chosen[**i].candidate.sort() == sort);
                same.map(|i| chosen[*i].evidence.joint_gain).sum()
            };
            (free.taken(after) > taken)
                .then(|| (own.iter().copied()).min_by(|a, b| gain(a).total_cmp(&gain(b))))
                .flatten()
        })
    }

    /// Returns true if no rival on the joint has half the gain. Kinds that are the same function of the motion are no
    /// rivals.
    fn has_no_close_rival(
        &self,
        chosen: &[FittedCandidate],
        k: usize,
    ) -> Result<bool, DiagnoseError> {
        let own = &chosen[k];
        let own_kind = own.candidate.kind;
        let name = own_kind.about().name;
        let rivals = self.search.alternatives(self.base, chosen, k)?;
        Ok((rivals.iter())
            .filter(|r| r.candidate.joint == own.candidate.joint)
            .filter(|r| r.candidate.kind.about().name != name)
            .filter(|r| r.at_bound.is_none() && !exact([own_kind, r.candidate.kind]))
            .all(|r| r.evidence.gain < HALF * own.evidence.gain))
    }

    /// Judges these effects without dropping any.
    pub(crate) fn as_found(&self, chosen: Vec<FittedCandidate>) -> Judged {
        let fit = with(self.base, &chosen, None);
        // At backlash contacts the residual is large anyway: no bursts there.
        let plays = |j: usize| {
            let gear =
                |p: &FittedCandidate| p.candidate.kind == Kind::Backlash && p.candidate.joint == j;
            chosen.iter().any(gear)
        };
        let bursts: Vec<Option<Burst>> = (0..self.rows.joints())
            .map(|j| (!plays(j)).then(|| self.burst(&fit, j)).flatten())
            .collect();
        // Factor from a joint's RMS to its RMS without bursts.
        let calm = |j: usize| {
            let loud = bursts[j].as_ref().map_or(0.0, |burst| burst.share);
            (1.0 - loud).max(0.0).sqrt()
        };
        let own: Vec<[Option<Repeated>; 2]> = (0..bursts.len())
            .map(|j| {
                let residual = fit.residual(j);
                [None, fit.counts(j)].map(|counts| self.repeated(&residual, counts, j))
            })
            .collect();
        let noise =
            |k: usize, j: usize| own[j][k].map(|own| own.noise.max(self.position_reading.steps[j]));
        let (floors, quiet): (Vec<f64>, Vec<f64>) = (0..bursts.len())
            .map(|j| {
                (
                    noise(0, j).unwrap_or_else(|| fit.even_rms(j) * calm(j)),
                    noise(1, j).unwrap_or_else(|| fit.rms(j) * calm(j)),
                )
            })
            .unzip();
        let (known, from) = (0..bursts.len())
            .map(|j| self.known_floor(noise(0, j), j))
            .unzip();
        let left = (0..quiet.len())
            .filter_map(|j| {
                let own = own[j][1].filter(|_| !plays(j));
                self.remainder_of(&fit, &chosen, j, (quiet[j], own), bursts[j].as_ref())
            })
            .max_by(|a, b| a.ratio.total_cmp(&b.ratio));
        let much_left = (left.as_ref())
            .is_some_and(|left| self.pairs.is_empty() || left.ratio > FAR_BEYOND_FLOOR);
        let throughout = || {
            (0..quiet.len()).find_map(|j| self.falls_throughout(&chosen, j, (fit.rms(j), quiet[j])))
        };
        let doubted = || (0..quiet.len()).find_map(|j| self.doubt(&fit, &chosen, j, quiet[j]));
        Judged {
            left: ((0..quiet.len()).find_map(|j| self.changed_besides(&fit, j)))
                .or_else(|| (0..quiet.len()).find_map(|j| self.changed_between(&fit, j)))
                .or(left)
                .or_else(throughout)
                .or_else(doubted)
                .or_else(|| (0..floors.len()).find_map(|j| self.unproven(&fit, &chosen, j))),
            guesses: Vec::new(),
            much_left,
            chosen,
            floors,
            quiet,
            known,
            from,
        }
    }

    /// Returns the model-independent noise floor of a joint and its source. `repeated` is the noise of repeated runs.
    fn known_floor(&self, repeated: Option<f64>, joint: usize) -> (f64, FloorFrom) {
        let runs = self.search.source.runs;
        match repeated {
            Some(noise) => (noise, FloorFrom::RepeatedRuns),
            None => match of_torque(runs, joint, self.rows.period) {
                Some(noise) => (
                    noise.hypot(self.position_reading.whole(joint)),
                    FloorFrom::TorqueReading,
                ),
                None => (f64::NAN, FloorFrom::Unknown),
            },
        }
    }

    /// Returns the part of the floors due to position readings, joint by joint; 0 if the floor has another source.
    pub(crate) fn added(&self, from: &[FloorFrom]) -> Vec<f64> {
        let own = |(joint, from): (usize, &FloorFrom)| match from {
            FloorFrom::TorqueReading => self.position_reading.whole(joint),
            _ => 0.0,
        };
        from.iter().enumerate().map(own).collect()
    }

    /// Locates the residual of the refitted description `base`, with its effects `described`.
    pub(crate) fn places(
        &self,
        base: &Fit,
        floors: &[f64],
        described: &[FittedCandidate],
    ) -> Vec<Dependence> {
        let fit = with(base, described, None);
        (0..self.rows.joints())
            .flat_map(|j| self.refitted_places(&fit, j, floors[j]))
            .collect()
    }

    /// Locates a joint's residual with a refitted bootstrap. The decision on a remainder uses the plain bootstrap,
    /// which is stricter.
    fn refitted_places(&self, fit: &Fit, joint: usize, floor: f64) -> Vec<Dependence> {
        let known = Known {
            refitted: Refitted::of(self.rows, fit.counts(joint), joint),
            pairs: &self.pairs,
        };
        self.located(fit, Some(&known), joint, floor)
    }

    fn places_of(&self, fit: &Fit, joint: usize, floor: f64) -> Vec<Dependence> {
        self.located(fit, None, joint, floor)
    }

    fn located(
        &self,
        fit: &Fit,
        known: Option<&Known>,
        joint: usize,
        floor: f64,
    ) -> Vec<Dependence> {
        locate(
            self.rows,
            &self.coordinates[joint],
            &fit.counted(joint),
            known,
            fit.block_of_rows(),
            joint,
            &self.robot.joints[joint].name,
            floor,
            self.seed,
        )
    }

    /// Returns large residuals in a few segments. With repeated runs they are part of the noise floor.
    fn burst(&self, fit: &Fit, joint: usize) -> Option<Burst> {
        let rows = self.rows;
        (self.pairs.is_empty())
            .then(|| {
                let residual = fit.residual(joint);
                let runs = self.search.source.runs;
                burst(
                    &residual,
                    &rows.keep[joint],
                    &rows.starts,
                    rows.period,
                    runs,
                )
            })
            .flatten()
    }

    /// Returns a joint's residual beyond the floor if it depends on the motion, or bursts. `own`: repeated runs.
    fn remainder_of(
        &self,
        fit: &Fit,
        chosen: &[FittedCandidate],
        joint: usize,
        (floor, own): (f64, Option<Repeated>),
        burst: Option<&Burst>,
    ) -> Option<Unexplained> {
        let repeated = !self.pairs.is_empty();
        let rms = fit.rms(joint);
        let places = self.places_of(fit, joint, if repeated { floor } else { 0.0 });
        let shown = (places.iter())
            .find(|p| p.p_value < SIGNIFICANT)
            .filter(|p| repeated || p.share > SHARE_LEFT);
        if let Some(burst) = burst {
            return Some(self.knocked(burst, rms, joint, places));
        }
        let [rms, noise] = if repeated {
            let besides = besides(chosen, self.rows, joint, [self.base.rms(joint), rms]);
            let more = self.beyond_noise([rms, floor], own, besides, joint)?;
            let much = shown.is_some_and(|p| p.share > SHARE_LEFT);
            (much || self.away_from_reversals(fit, chosen, besides, joint)).then_some(more)?
        } else {
            // The floor is the part that no coordinate explains.
            [rms, rms * (1.0 - shown?.share).max(0.01).sqrt()]
        };
        let places = match places.is_empty() {
            true => self.refitted_places(fit, joint, floor),
            false => places,
        };
        let shown = (places.iter().find(|p| p.p_value < SIGNIFICANT)).or(places.first());
        let cause = RemainderCause::BeyondFloor {
            beside_effects: chosen.iter().any(|p| p.candidate.joint == joint),
            shown: shown.cloned(),
        };
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        Some(Unexplained {
            joint: name.clone(),
            unit: kind.units().1.to_owned(),
            rms: (rms * rms - noise * noise).max(0.0).sqrt(),
            ratio: rms / noise,
            places,
            cause,
        })
    }

    /// Returns true if the residual exceeds the floor away from reversals, where filters have the same error in every
    /// run. Always true with a gear, which shows at reversals. `besides` as in [`Self::beyond_noise`].
    fn away_from_reversals(
        &self,
        fit: &Fit,
        chosen: &[FittedCandidate],
        besides: f64,
        joint: usize,
    ) -> bool {
        if (chosen.iter()).any(|p| p.candidate.joint == joint && is_gear(p.candidate.kind)) {
            return true;
        }
        let away = self.rows.away(joint);
        let residual = fit.residual(joint);
        let counts: Vec<f64> = (away.iter())
            .map(|away| f64::from(u8::from(*away)))
            .collect();
        self.repeated(&residual, Some(&counts), joint)
            .is_none_or(|own| {
                let all = [statistics::rms_of_kept(&residual, &away), own.noise];
                self.beyond_noise(all, Some(own), besides, joint).is_some()
            })
    }

    /// Returns noise and residual of a joint from repeated runs.
    fn repeated(&self, residual: &[f64], counts: Option<&[f64]>, joint: usize) -> Option<Repeated> {
        noise_floor::from_repeats(self.rows, &self.pairs, residual, counts, joint)
    }

    /// Returns residual and noise RMS of a joint if the residual exceeds the noise. It tests all rows (`all` is
    /// residual and floor), then the repeated runs. `besides` are squares from other sources.
    fn beyond_noise(
        &self,
        all: [f64; 2],
        own: Option<Repeated>,
        besides: f64,
        joint: usize,
    ) -> Option<[f64; 2]> {
        let steps = self.position_reading.steps[joint];
        let beyond = |[rms, noise]: [f64; 2], ratio: f64| {
            let rounded = noise.powi(2) + (BEYOND_FLOOR * steps).powi(2);
            (rms * rms > (ratio * noise).powi(2).max(rounded) + besides).then_some([rms, noise])
        };
        beyond(all, BEYOND_FLOOR).or_else(|| {
            let Repeated { left, noise, rows } = own?;
            let chance = (1.0 + CHANCE / rows.sqrt()).sqrt();
            beyond([left, noise.max(steps)], BEYOND_OWN_FLOOR.max(chance))
        })
    }
}

#[cfg(test)]
mod tests;
