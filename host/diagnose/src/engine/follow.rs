//! Gears whose links are followed: the last word on their shapes.
//!
//! Names are found and judged with links that the motor's motion alone drives: the torque that a filter hears bends to
//! anything, and would speak for the wrong gear too. Once a gear has its name, its link is followed, its shapes are fitted
//! anew by what the prediction leaves, and so stand where that leaves less than before. What the driven law of a gear leaves
//! is no reason to doubt the names beside it.

use std::cell::RefCell;
use std::sync::Arc;

use rig_shared::effects::{Kind, SHAPES};

use crate::DiagnoseError;
use crate::bench::{Bench, Loaded};
use crate::columns::{Candidate, Source};
use crate::floor;
use crate::profile::{Followed, Profile};
use crate::refit::Refit;
use crate::search::{Search, with};

/// Rounds in which shapes and everything else are fitted in turn.
const ROUNDS: usize = 2;
/// Stiffness (N·m/rad) and damping (N·m·s/rad) of teeth where the fit begins: those that the search has left are softer by
/// what the motion of the motor does not tell of a touch.
const TEETH: [f64; 2] = [2000.0, 8.0];
/// Share of the RMS that following a play has to leave at most, where driving it takes off little.
const HEARD: f64 = 0.75;

/// Follows links behind gears on the training data.
pub(crate) struct Follower<'a, 'r> {
    /// Robot and treatment.
    bench: &'a Bench<'a>,
    /// The training data.
    loaded: &'a Loaded,
    /// The refitted nominal model on them.
    refit: &'a Refit<'r>,
    /// The library on them.
    search: &'a Search<'r>,
    /// Effects as they came last, and as they went: it takes seconds.
    last: RefCell<Option<(Vec<Driven>, Vec<Profile>)>>,
}

/// An effect and its shapes.
type Driven = (Candidate, [f64; SHAPES]);

impl<'a, 'r> Follower<'a, 'r> {
    /// For these recordings.
    pub(super) fn new(
        bench: &'a Bench<'a>,
        loaded: &'a Loaded,
        refit: &'a Refit<'r>,
        search: &'a Search<'r>,
    ) -> Self {
        Self {
            bench,
            loaded,
            refit,
            search,
            last: RefCell::new(None),
        }
    }

    /// Whether the link behind this gear is to be followed.
    fn follows(&self, profile: &Profile) -> bool {
        self.search.is_gear_by_torque(&profile.candidate)
    }

    /// Effects with the links behind gears followed, which have new shapes; none where there is no such gear. `noise` is what
    /// stays unexplained, joint by joint, where the torque's reading does not tell its own.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn followed(
        &self,
        driven: &[Profile],
        noise: &[f64],
    ) -> Result<Option<Vec<Profile>>, DiagnoseError> {
        if !driven.iter().any(|profile| self.follows(profile)) {
            return Ok(None);
        }
        let given: Vec<Driven> = driven.iter().map(|p| (p.candidate, p.shapes)).collect();
        if let Some((_, known)) = self
            .last
            .borrow()
            .as_ref()
            .filter(|(last, _)| *last == given)
        {
            return Ok(Some(known.clone()));
        }
        let mut chosen = driven.to_vec();
        for k in (0..driven.len()).filter(|k| self.follows(&driven[*k])) {
            self.follow(&mut chosen, k, noise)?;
        }
        // The columns with everything else as it has come out.
        let source = self.source(&chosen)?.smoothed();
        for profile in chosen.iter_mut().filter(|p| p.followed.is_some()) {
            profile.columns = Arc::new(source.columns(&profile.candidate, &profile.shapes)?);
        }
        *self.last.borrow_mut() = Some((given, chosen.clone()));
        Ok(Some(chosen))
    }

    /// Whether the recorded torque tells of a play beside what was `found` that the motor's motion alone hardly drives: wide play,
    /// whose link is seldom where that motion has it. Of a rig without any, following takes less than 2 %.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn hears(&self, found: &[Profile], play: Profile) -> Result<bool, DiagnoseError> {
        let joint = play.candidate.joint;
        let of = |chosen: &[Profile]| with(self.refit.even(), chosen, None);
        let before = of(found);
        let noise: Vec<f64> = (0..self.bench.robot.joints.len())
            .map(|j| before.rms(j))
            .collect();
        let mut chosen = found.to_vec();
        chosen.push(play);
        let followed = self.followed(&chosen, &noise)?;
        Ok(followed.is_some_and(|followed| of(&followed).rms(joint) < HEARD * noise[joint]))
    }

    fn follow(&self, chosen: &mut [Profile], k: usize, noise: &[f64]) -> Result<(), DiagnoseError> {
        let Self {
            loaded,
            refit,
            search,
            ..
        } = self;
        let joint = chosen[k].candidate.joint;
        let rms = |chosen: &[Profile]| with(refit.even(), chosen, None).rms(joint);
        let driven = chosen[k].clone();
        let before = rms(chosen);
        let reading = floor::of_reading(&loaded.runs, joint, loaded.rows.period);
        let own = &mut chosen[k];
        own.followed = Some(Followed {
            noise: reading.unwrap_or(noise[joint]),
        });
        own.otherwise = Some(driven.shapes);
        own.shapes = begun(own.candidate.kind, own.shapes);
        for _ in 0..ROUNDS {
            let source = self.source(chosen)?;
            let beside = with(refit.even(), chosen, Some(k));
            let Profile {
                candidate, shapes, ..
            } = &chosen[k];
            let (shapes, columns) = search.fitted_as_known(&source, &beside, candidate, shapes)?;
            chosen[k].shapes = shapes;
            chosen[k].columns = Arc::new(columns);
        }
        // Judged as it is going to stand: with its stretches begun where their readings say.
        let source = self.source(chosen)?.smoothed();
        let own = &mut chosen[k];
        own.columns = Arc::new(source.columns(&own.candidate, &own.shapes)?);
        if rms(chosen) >= before {
            let otherwise = Some(chosen[k].shapes);
            chosen[k] = Profile {
                otherwise,
                ..driven
            };
        }
        Ok(())
    }

    /// What columns are formed from with these effects.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn source(&self, chosen: &[Profile]) -> Result<Source<'a>, DiagnoseError> {
        let solution = self.refit.solution(chosen)?;
        let (nominal, gains) = solution.values.split_at(self.refit.free.len());
        self.bench
            .source(self.loaded, &self.bench.anchor.values(nominal))?
            .loaded_by(chosen, gains)?
            .following(&self.loaded.rows, chosen, gains)
    }
}

/// The shapes that the fit begins with where the search has left these.
fn begun(kind: Kind, mut shapes: [f64; SHAPES]) -> [f64; SHAPES] {
    if kind == Kind::Backlash {
        shapes[1..3].copy_from_slice(&TEETH);
    }
    shapes
}

#[cfg(test)]
mod tests;
