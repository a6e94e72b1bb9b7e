//! Acceptance of the effects found: tests by simulated motion, joint fit and hold-out.

use super::steps::{refuse, refuse_guesses};
use super::unbelieved::{CarriedOver, carried_over, ordered, unbelieved};
use crate::DiagnoseError;
use crate::bench::Loaded;
use crate::bodies::Fitting;
use crate::described::by_description;
use crate::judge::{Judge, Judged};
use crate::motion::Replay;
use crate::outcome::Tried;
use crate::profile::Profile;
use crate::refit::Refit;

/// Relative rise of the hold-out's simulated error that drops an effect without a significance test. The hold-out is
/// often too short for one.
const MUCH_WORSE: f64 = 0.1;

/// Data for the acceptance tests.
pub(super) struct Trial<'a, 'r> {
    /// The training data.
    pub(super) judge: &'a Judge<'a, 'r>,
    /// The nominal model on them.
    pub(super) refit: &'a Refit<'r>,
    /// Models with effects.
    pub(super) fitting: &'a Fitting<'a, 'r>,
    /// Simulation of the training motion.
    pub(super) replay: &'a Replay<'a>,
    /// The hold-out.
    pub(super) sealed: Option<&'a Loaded>,
}

/// Result of the acceptance tests.
pub(super) struct Survivors {
    /// Accepted effects.
    pub(super) judged: Judged,
    /// Dropped effects with a large gain.
    pub(super) fallen: Vec<Profile>,
}

impl Trial<'_, '_> {
    /// Drops effects that fail a test, one at a time, and writes the reason to `tried`.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn stand(
        &self,
        found: Vec<Profile>,
        tried: &mut [Tried],
    ) -> Result<Survivors, DiagnoseError> {
        let Self { judge, refit, .. } = self;
        let (robot, search) = (judge.robot, judge.search);
        let judged = judge.judged(found)?;
        refuse_guesses(robot, tried, &judged);
        let judged = by_description(judge, refit, self.fitting.bench, judged)?;
        refuse_guesses(robot, tried, &judged);
        let mut left = Survivors {
            judged,
            fallen: Vec::new(),
        };
        // An effect that increases the simulated error replaces another one.
        let why = "explains torque, but the simulated motion gets worse with it";
        left = self.unspoilt(left, (self.replay, f64::INFINITY), why, tried)?;
        while let Some((k, why)) = unbelieved(refit, search, judge, &left.judged.chosen)? {
            left = self.without(left, k, why, tried)?;
        }
        // The hold-out selects no effect, but removes those that it contradicts.
        if let Some(sealed) = self.sealed {
            let why = "explains the training data, and leaves more of the recordings held back than there is without it";
            loop {
                match carried_over(self.fitting, search, &left.judged.chosen, sealed)? {
                    CarriedOver::Yes => break,
                    CarriedOver::InAnotherOrder => {
                        let found = std::mem::take(&mut left.judged.chosen);
                        left.judged.chosen = ordered(self.fitting, search, found, sealed)?;
                        break;
                    }
                    CarriedOver::Not(k) => left = self.without(left, k, why, tried)?,
                }
            }
            let held = Replay::of(self.fitting, sealed)?;
            let why = "explains torque, but the simulated motion of the recordings held back gets worse with it";
            left = self.unspoilt(left, (&held, MUCH_WORSE), why, tried)?;
        }
        Ok(left)
    }

    /// Drops effects that degrade a simulation. `most` is the relative rise that suffices without significance.
    fn unspoilt(
        &self,
        mut left: Survivors,
        (replay, most): (&Replay, f64),
        why: &str,
        tried: &mut [Tried],
    ) -> Result<Survivors, DiagnoseError> {
        let given = |chosen: &[Profile]| self.judge.search.count_given(chosen);
        while let Some(k) = {
            let chosen = &left.judged.chosen;
            replay.spoiling(chosen, given(chosen), most)?
        } {
            left = self.without(left, k, why, tried)?;
        }
        Ok(left)
    }

    fn without(
        &self,
        Survivors { judged, mut fallen }: Survivors,
        k: usize,
        why: &str,
        tried: &mut [Tried],
    ) -> Result<Survivors, DiagnoseError> {
        let (robot, search) = (self.judge.robot, self.judge.search);
        let mut stand = judged.chosen;
        let gone = stand.remove(k);
        refuse(robot, tried, &gone, why);
        if gone.takes_much(search.trials()) {
            fallen.push(gone);
        }
        let stand = search.possible(&self.refit.base, stand)?;
        let judged = self.judge.judged(stand)?;
        refuse_guesses(robot, tried, &judged);
        Ok(Survivors { judged, fallen })
    }
}
