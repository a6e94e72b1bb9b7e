//! Checks of the accepted effects on the hold-out, and the residual that they leave. They report and select nothing.

use std::sync::Arc;

use super::naming::Named;
use super::work::Work;
use crate::DiagnoseError;
use crate::acceptance::judge::Judged;
use crate::acceptance::judge::unseen::{
    left_of_held, not_carried_over, taken_by_none, too_short_for_names,
};
use crate::acceptance::law_mismatch::besides;
use crate::acceptance::model_check::{Proof, unexplained};
use crate::acceptance::unexplained::Unexplained;
use crate::models::bodies::FittedModel;
use crate::models::rms_path::RmsPath;
use crate::models::simulated_motion::{Errors, Replay};
use crate::motor_voltage::left_of_voltage;
use crate::outcome::{DataFault, Left, Remainder};
use crate::search::fitted_candidate::FittedCandidate;

/// Results of the checks.
pub(super) struct Checked {
    /// RMS of the residual, model by model.
    pub(super) descent: RmsPath,
    /// Residual of the written model, joint by joint.
    pub(super) sizes: Vec<Left>,
    /// Returns true if the torque has an unexplained residual.
    pub(super) left: bool,
    /// The unexplained residual of the motor voltages, if that of the torque is explained.
    pub(super) of_voltage: Option<Remainder>,
    /// The model with the described effects alone.
    pub(super) before: Arc<FittedModel>,
    /// The model with all effects.
    pub(super) after: Arc<FittedModel>,
    /// Errors of the simulated motion, model by model.
    pub(super) motion: Vec<Option<Errors>>,
}

impl Checked {
    /// Compares the models with the hold-out and the noise floors. `found` are the effects of the search, `nameless` the
    /// fault because of which none was searched for. `replay` simulates the hold-out, or else the training motion.
    ///
    /// # Errors
    /// [`DiagnoseError`].
    pub(super) fn of(
        work: &Work,
        named: &mut Named,
        found: &[FittedCandidate],
        nameless: Option<DataFault>,
        replay: &Replay,
    ) -> Result<Self, DiagnoseError> {
        let (robot, base) = (work.data.context.robot, &work.refit.base);
        let described = named.described;
        let judged = &mut named.judged;
        let descent = RmsPath::of(
            work.fitting,
            work.refit,
            &judged.chosen,
            described,
            work.data.prepared,
            work.data.held_out,
            &work.search.source,
            work.judge.added(&judged.from),
        )?;
        if judged.left.is_none() {
            judged.left = left_on_holdout(work, &descent, judged, described);
        }
        // With repeated runs, the residual was already compared with the noise.
        if judged.left.is_none() && work.judge.pairs.is_empty() {
            named.fallen.extend(work.search.still_taking(base, found)?);
            judged.left = taken_by_none(robot, &named.fallen, &judged.chosen, &judged.floors);
        }
        let sizes = Proof {
            robot,
            fitting: work.fitting,
            base,
            prepared: work.data.prepared,
            held_out: work.data.held_out,
            descent: &descent,
        }
        .left(judged, described)?;
        if judged.left.is_none() {
            let of = |name: &str| robot.joints.iter().position(|joint| joint.name == name);
            let named = |name: &str| {
                (judged.chosen[described..].iter()).any(|p| Some(p.candidate.joint) == of(name))
            };
            judged.left = unexplained(&sizes, &named);
        }
        if let Some(fault) = nameless {
            // No effect was tried, so do not claim that none explains the residual.
            judged.left = too_short_for_names(robot, base, &judged.known, fault);
        }
        let left = judged.left.is_some();
        let chosen = &judged.chosen;
        Ok(Self {
            descent,
            sizes,
            left,
            of_voltage: (!left).then(|| left_of_voltage(&named.windings)).flatten(),
            before: work.fitting.of(&chosen[..described])?,
            after: work.fitting.of(chosen)?,
            motion: (described..=chosen.len())
                .map(|count| replay.errors(&chosen[..count]))
                .collect::<Result<_, DiagnoseError>>()?,
        })
    }
}

/// Returns the unexplained residual of the hold-out.
fn left_on_holdout(
    work: &Work,
    descent: &RmsPath,
    judged: &Judged,
    described: usize,
) -> Option<Unexplained> {
    let held = descent.holdout.as_ref()?;
    let robot = work.data.context.robot;
    let mut named: Vec<(usize, [f64; 2])> = (judged.chosen[described..].iter())
        .map(|p| (p.candidate.joint, held.whole(p.candidate.joint)))
        .collect();
    named.dedup_by_key(|(joint, _)| *joint);
    left_of_held(
        robot,
        &held.last(),
        &descent.train.last(),
        [&judged.floors, &descent.noise_held(&judged.floors)],
        &judged.chosen,
        &|joint| {
            let rows = &work
                .data
                .held_out
                .filter(|_| descent.is_held_twice(joint))?
                .rows;
            Some(besides(&judged.chosen, rows, joint, held.whole(joint)))
        },
    )
    .or_else(|| not_carried_over(robot, &named, &descent.floors(&judged.floors)))
}
