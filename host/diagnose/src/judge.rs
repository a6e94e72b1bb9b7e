//! What stands at the end of a search: the noise floor, what is left beyond it, which other names a step may have.

mod doubts;
mod rank;
mod unseen;

pub(super) use self::rank::{equal, rank};
pub(super) use self::unseen::{left_of_held, not_carried_over, taken_by_none, too_short_for_names};

use rig_shared::effects::Kind;

use super::DiagnoseError;
use super::burst::{Burst, burst};
use super::engine::Follower;
use super::experiment::exact;
use super::fit::Fit;
use super::floor::{self, Repeated};
use super::locate::{Coordinate, Known, Refitted, locate};
use super::outcome::{FloorFrom, Place, Remainder};
use super::position_reading::PositionReading;
use super::profile::{Profile, SIGNIFICANT};
use super::proof::of_torque;
use super::rows::Rows;
use super::search::{Search, is_gear, shadow, with};

use rig_model::robot::{Joint, Robot};

/// Share of its gap that a step must close to stand beside a remainder.
const HALF: f64 = 0.5;
/// … and at least, where nothing else would close half as much in its place.
const QUARTER: f64 = 0.25;
/// What is left counts as more than noise beyond this ratio to a floor known from repeated recordings, in rows of other motions,
/// whose noise is not quite the same, or beside a play, of whose touches each law leaves something. The difference between a right
/// name's law and the rig's may leave its shadow besides.
pub(super) const BEYOND_FLOOR: f64 = 1.12;
/// … and beyond this in the repeated runs themselves: right names left 1.00 to 1.03 times the floor in 25 rigs of seed 3500, and up to
/// 1.05 in 13 with a fifth of their noise …
const BEYOND_OWN_FLOOR: f64 = 1.06;
/// … unless that is within so many standard deviations of chance: of ratio² − 1, the mean product of two runs' noise, 1/√rows.
const CHANCE: f64 = 4.0;
/// … and so much of the torque itself: filters and differences of a step each are not the derivatives that they stand for.
const TREATED: f64 = 3e-3;
/// … and beyond this it is so much that names are guesses at it.
const FAR_BEYOND_FLOOR: f64 = 1.25;
/// … and where a coordinate explains this share of its squares; with a repeat, of those beyond the floor, or where it is left away
/// from reversals too.
const SHARE_LEFT: f64 = 0.1;

/// The training data that effects are judged on.
pub(super) struct Judge<'a, 'r> {
    /// As it was given.
    pub(super) robot: &'a Robot,
    /// The library on the training data.
    pub(super) search: &'a Search<'r>,
    /// Of links behind gears.
    pub(super) follower: &'a Follower<'a, 'r>,
    /// The training data.
    pub(super) rows: &'a Rows,
    /// Their coordinates, joint by joint.
    pub(super) coordinates: &'a [Vec<Coordinate>],
    /// Runs that repeat each other.
    pub(super) pairs: Vec<(usize, usize)>,
    /// What the reading of the positions leaves in each joint's torque.
    pub(super) position_reading: PositionReading,
    /// The refitted nominal model on them.
    pub(super) base: &'a Fit<'r>,
    /// Of the bootstrap.
    pub(super) seed: u64,
}

/// What stands.
pub(super) struct Judged {
    /// The effects.
    pub(super) chosen: Vec<Profile>,
    /// Noise floor, joint by joint.
    pub(super) floors: Vec<f64>,
    /// … of rows as they count.
    pub(super) quiet: Vec<f64>,
    /// Noise floor that no model made, joint by joint; NaN where none is known.
    pub(super) known: Vec<f64>,
    /// What each of them rests on.
    pub(super) from: Vec<FloorFrom>,
    /// What is left beyond it.
    pub(super) left: Option<Remainder>,
    /// Names that were no more than guesses at it.
    pub(super) guesses: Vec<Profile>,
    /// Whether that is so much that names may be guesses at it.
    much_left: bool,
}

impl Judge<'_, '_> {
    /// Which of the effects found stand, and what they leave.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn judged(&self, found: Vec<Profile>) -> Result<Judged, DiagnoseError> {
        let mut judged = self.as_found(found);
        let mut guesses = Vec::new();
        // Beside something unknown, a name that closes less of the gap than it leaves is a guess at it, unless nothing else
        // comes near.
        while judged.much_left {
            let chosen = &judged.chosen;
            let followed = self.follower.followed(chosen, &judged.quiet)?;
            let followed = followed.map(|list| self.as_found(list));
            // What the driven law of a gear leaves is no reason to doubt the names of its joint; other joints are as they were.
            let on = |joint: usize| {
                let gear = |p: &Profile| p.candidate.joint == joint && p.followed.is_some();
                followed
                    .as_ref()
                    .filter(|last| last.chosen.iter().any(gear))
            };
            let closes = |k: usize| {
                let j = chosen[k].candidate.joint;
                let last = on(j).unwrap_or(&judged);
                // The name is in doubt, not one of its orders, each of which closes a part of the gap.
                let sort = chosen[k].candidate.sort();
                let others = last.chosen.iter().filter(|p| p.candidate.sort() != sort);
                let others: Vec<Profile> = others.cloned().collect();
                let [before, after] =
                    [&others, &last.chosen].map(|list| with(self.base, list, None));
                // A gear is worth what it does at its touches, which hardly count beside all else.
                if is_gear(chosen[k].candidate.kind) {
                    closed([before.even_rms(j), after.even_rms(j)], last.floors[j])
                } else {
                    closed([before.rms(j), after.rms(j)], last.quiet[j])
                }
            };
            // What the description states is no guess of the search.
            let mut doubtful: Vec<(usize, f64)> = (self.search.count_given(chosen)..chosen.len())
                .filter(|k| on(chosen[*k].candidate.joint).is_none_or(|last| last.much_left))
                .map(|k| (k, closes(k)))
                .filter(|(_, share)| *share < HALF)
                .collect();
            doubtful.sort_by(|a, b| a.1.total_cmp(&b.1));
            let mut guess = None;
            for (k, share) in doubtful {
                if share < QUARTER || !self.stands_out(chosen, k)? {
                    guess = Some(k);
                    break;
                }
            }
            let Some(guess) = guess else { break };
            let mut stand = judged.chosen;
            guesses.push(stand.remove(guess));
            judged = self.as_found(self.search.possible(self.base, stand)?);
        }
        judged.guesses = guesses;
        Ok(judged)
    }

    /// Whether nothing else in its place takes away half as much. What explains another joint is not in its place; what is the
    /// same function of the motion is no other.
    fn stands_out(&self, chosen: &[Profile], k: usize) -> Result<bool, DiagnoseError> {
        let own = &chosen[k];
        let own_kind = own.candidate.kind;
        let name = own_kind.about().name;
        let rivals = self.search.alternatives(self.base, chosen, k)?;
        Ok((rivals.iter())
            .filter(|r| r.candidate.joint == own.candidate.joint)
            .filter(|r| r.candidate.kind.about().name != name)
            .filter(|r| r.vanished.is_none() && !exact([own_kind, r.candidate.kind]))
            .all(|r| r.evidence.gain < HALF * own.evidence.gain))
    }

    /// What stands with these effects.
    pub(super) fn as_found(&self, chosen: Vec<Profile>) -> Judged {
        let fit = with(self.base, &chosen, None);
        // Of a play touches are loud, and so is what its law leaves of them.
        let plays = |j: usize| {
            let gear = |p: &Profile| p.candidate.kind == Kind::Backlash && p.candidate.joint == j;
            chosen.iter().any(gear)
        };
        let bursts: Vec<Option<Burst>> = (0..self.rows.joints())
            .map(|j| (!plays(j)).then(|| self.burst(&fit, j)).flatten())
            .collect();
        // Of a joint without its bursts.
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

    /// Noise floor of a joint that no model made, and what it rests on; `repeated` is what repeated runs say.
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

    /// What the floors have of the reading of the positions, joint by joint: nothing where they rest on something else.
    pub(super) fn added(&self, from: &[FloorFrom]) -> Vec<f64> {
        let own = |(joint, from): (usize, &FloorFrom)| match from {
            FloorFrom::TorqueReading => self.position_reading.whole(joint),
            _ => 0.0,
        };
        from.iter().enumerate().map(own).collect()
    }

    /// Where the residual of the refitted description sits, `base`; `described` are its effects.
    pub(super) fn places(&self, base: &Fit, floors: &[f64], described: &[Profile]) -> Vec<Place> {
        let fit = with(base, described, None);
        (0..self.rows.joints())
            .flat_map(|j| self.refitted_places(&fit, j, floors[j]))
            .collect()
    }

    /// Where a joint's residual sits, chance refitted as it was. What decides on a remainder takes chance as it comes, which asks
    /// for more.
    fn refitted_places(&self, fit: &Fit, joint: usize, floor: f64) -> Vec<Place> {
        let known = Known {
            refitted: Refitted::of(self.rows, fit.counts(joint), joint),
            pairs: &self.pairs,
        };
        self.located(fit, Some(&known), joint, floor)
    }

    fn places_of(&self, fit: &Fit, joint: usize, floor: f64) -> Vec<Place> {
        self.located(fit, None, joint, floor)
    }

    fn located(&self, fit: &Fit, known: Option<&Known>, joint: usize, floor: f64) -> Vec<Place> {
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

    /// What a few stretches of a joint's residual hold; where a motion was repeated, that is in the floor.
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

    /// What is left of a joint beyond the floor and goes with the motion, or came and went; `own` is what repeated runs say of it.
    fn remainder_of(
        &self,
        fit: &Fit,
        chosen: &[Profile],
        joint: usize,
        (floor, own): (f64, Option<Repeated>),
        burst: Option<&Burst>,
    ) -> Option<Remainder> {
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
            // The floor is what no coordinate of the motion explains.
            [rms, rms * (1.0 - shown?.share).max(0.01).sqrt()]
        };
        let places = match places.is_empty() {
            true => self.refitted_places(fit, joint, floor),
            false => places,
        };
        let shown = (places.iter().find(|p| p.p_value < SIGNIFICANT)).or(places.first());
        let shown = shown.map_or(
            "It goes with no coordinate of the motion beyond chance.",
            |p| &p.text,
        );
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        let text = format!(
            "{:.0} % more than the noise floor is left in joint {name} and no {}effect of the library explains it. {shown}",
            100.0 * (rms / noise - 1.0),
            if chosen.iter().any(|p| p.candidate.joint == joint) {
                "further "
            } else {
                ""
            },
        );
        Some(Remainder {
            joint: name.clone(),
            unit: kind.units().1.to_owned(),
            rms: (rms * rms - noise * noise).max(0.0).sqrt(),
            ratio: rms / noise,
            text,
            places,
            doubt: false,
        })
    }

    /// Whether more than the floor is left of a joint away from its reversals, which filters blur the same way in every run. A
    /// gear shows at reversals. `besides` as in [`Self::beyond_noise`].
    fn away_from_reversals(
        &self,
        fit: &Fit,
        chosen: &[Profile],
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
                let all = [floor::rms(&residual, &away), own.noise];
                self.beyond_noise(all, Some(own), besides, joint).is_some()
            })
    }

    /// What repeated runs say of a joint's residual.
    fn repeated(&self, residual: &[f64], counts: Option<&[f64]>, joint: usize) -> Option<Repeated> {
        floor::from_repeats(self.rows, &self.pairs, residual, counts, joint)
    }

    /// What is left of a joint and its noise, RMS, where that is more: of all rows, whose RMS and floor are `all`, or of the repeated
    /// runs themselves. `besides` are squares that neither noise nor a missing effect leaves.
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

/// Squares that neither noise nor a missing effect leaves of a joint's torque in some rows: treatment, and the shadow of the names
/// that take its residual from the one RMS to the other.
pub(super) fn besides(
    chosen: &[Profile],
    rows: &Rows,
    joint: usize,
    [before, after]: [f64; 2],
) -> f64 {
    let explained = (before * before - after * after).max(0.0);
    let names = chosen.iter().filter(|p| p.candidate.joint == joint);
    let shadow = names.map(shadow).fold(0.0, f64::max) * explained;
    let torque = floor::rms(&rows.torque[joint], &rows.keep[joint]);
    (TREATED * torque).powi(2) + shadow
}

/// Share of the gap to the floor that a fall of the RMS closes, 1 at most; 0 where there was none, NaN where the floor is not known.
pub(super) fn closed([before, after]: [f64; 2], floor: f64) -> f64 {
    if floor.is_nan() {
        f64::NAN
    } else if before > floor {
        // Below the floor there is nothing to explain.
        ((before - after) / (before - floor)).min(1.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests;
