//! From the effects of the search to accepted names with parameters.

use super::work::Work;
use crate::DiagnoseError;
use crate::acceptance::judge::Judged;
use crate::acceptance::trial::{Accepted, Trial};
use crate::fit::refit::Joint;
use crate::models::output_error::{Again, by_motion};
use crate::models::simulated_motion::Replay;
use crate::motor_voltage::{Winding, Word, settled, windings, zeros};
use crate::outcome::ByMotion;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::refusal::Refusal;
use crate::search::tried_candidate::TriedCandidate;

/// Accepted effects with their parameters.
pub(super) struct Named {
    /// The effects, the noise floors and the unexplained residual.
    pub(super) judged: Judged,
    /// Dropped effects with a large gain.
    pub(super) fallen: Vec<FittedCandidate>,
    /// What the voltage says of each effect's name.
    pub(super) said: Vec<Word>,
    /// Number of effects that the description states; they come first.
    pub(super) described: usize,
    /// Estimates of the joint fit.
    pub(super) joint: Joint,
    /// Refit to the simulated motion, for the report.
    pub(super) by_motion: Option<ByMotion>,
    /// Findings by the motor voltage.
    pub(super) windings: Vec<Winding>,
    /// Reasons why a voltage was not used.
    pub(super) silent: Vec<String>,
}

impl Named {
    /// Accepts effects among those found, settles their names and fits all parameters.
    ///
    /// # Errors
    /// [`DiagnoseError`].
    pub(super) fn of(
        work: &Work,
        learnt: &Replay,
        found: Vec<FittedCandidate>,
        tried: &mut [TriedCandidate],
    ) -> Result<Self, DiagnoseError> {
        let Work {
            search,
            refit,
            judge,
            ..
        } = work;
        let (windings, silent) = windings(
            work.data.context,
            work.data.prepared,
            work.data.held_out,
            work.data.options,
        )?;
        let trial = Trial {
            judge,
            refit,
            fitting: work.fitting,
            replay: learnt,
        };
        let mut accepted = trial.stand(found, tried)?;
        let (said, joint, again) = loop {
            let said = settled_names(work, &windings, &mut accepted.judged)?;
            let (joint, again) = fitted(work, learnt, &mut accepted.judged)?;
            // The fit to the motion sees the motion itself: what it takes for nothing stands in for another effect.
            let first = search.count_given(&accepted.judged.chosen);
            let nothing = again.as_ref().and_then(|a| a.most_likely_nothing(first));
            let Some(k) = nothing else {
                break (said, joint, again);
            };
            accepted = trial.without(accepted, k, Refusal::NothingByMotion, tried)?;
            accepted = trial.tested(accepted, tried)?;
        };
        let Accepted { mut judged, fallen } = accepted;
        let described = search.count_described(&judged.chosen);
        let by_motion = again.map(|again| {
            if let Some((model, effects)) = again.adopted {
                work.fitting.adopt(&effects, model);
                judged.chosen = effects;
            }
            again.told
        });
        Ok(Self {
            judged,
            fallen,
            said,
            described,
            joint,
            by_motion,
            windings,
            silent,
        })
    }

    /// Returns the effects that the description does not state.
    pub(super) fn found(&self) -> &[FittedCandidate] {
        &self.judged.chosen[self.described..]
    }
}

/// Fits all parameters together, to the torque and then to the simulated motion. Links behind gears are estimated by
/// their observers from here on.
fn fitted(
    work: &Work,
    learnt: &Replay,
    judged: &mut Judged,
) -> Result<(Joint, Option<Again>), DiagnoseError> {
    let Work {
        search,
        refit,
        judge,
        ..
    } = work;
    let mut followed = None;
    if let Some(chosen) = judge.follower.followed(&judged.chosen, &judged.quiet)? {
        *judged = judge.as_found(chosen);
        followed = Some(judge.follower.source(&judged.chosen)?);
    }
    let source = followed.as_ref().unwrap_or(&search.source);
    let joint = refit.joint(source, &judged.chosen, &judge.pairs, judge.coordinates)?;
    let threads = rig_data::prepare::threads(work.data.options.threads);
    let again = by_motion(
        work.fitting,
        learnt,
        source,
        &judged.chosen,
        &joint,
        threads,
    )?;
    Ok((joint, again))
}

/// Renames constants by the drive's zero and the voltage, and sorts the effects by their names.
fn settled_names(
    work: &Work,
    windings: &[Winding],
    judged: &mut Judged,
) -> Result<Vec<Word>, DiagnoseError> {
    let joints = work.data.context.robot.joints.len();
    let said = settled(
        &zeros(&work.data.options.sensor_zeros, windings, joints),
        work.search,
        &work.refit.base,
        &mut judged.chosen,
    )?;
    // An effect that the voltage renamed no longer counts as described: sort again.
    let mut named: Vec<_> = judged.chosen.drain(..).zip(said).collect();
    named.sort_by_key(|(profile, _)| work.search.rank_of(&profile.candidate));
    let (chosen, said): (Vec<_>, Vec<_>) = named.into_iter().unzip();
    judged.chosen = chosen;
    Ok(said)
}
