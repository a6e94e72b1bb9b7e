//! Test of the written model: its residual on data that it was not fitted to, against a noise floor that no model
//! determined.
//!
//! A floor from the last model's residual would confirm any last model. Without an independent floor, only a fall of
//! the residual by [`NEARLY_ALL`] itself is a proof: for any noise, the gap above it is then closed at least as far.

use crate::DiagnoseError;
use crate::acceptance::judge::Judged;
use crate::acceptance::law_mismatch::besides;
use crate::acceptance::unexplained::{RemainderCause, Unexplained};
use crate::fit::least_squares::Fit;
use crate::levels::BEYOND_FLOOR;
use crate::models::bodies::ModelCache;
use crate::models::rms_path::RmsPath;
use crate::outcome::{FloorFrom, Left};
use crate::recordings::context::PreparedData;
use crate::search::chosen::with;
use rig_model::robot::{Joint, Robot};
use rig_numerics::statistics::sum_of_squares;

/// Least share of the gap between refitted description and noise floor, in RMS, that effects must close to explain a
/// joint. 0.9: on 15 emulated rigs with one effect each (`rig benchmark --seeds 1 --first-seed 4300`, 26 November 2026)
/// right names closed 0.921 (backlash) to 1. The rig without slow reversals, and so without presliding, closed 0.58.
pub(crate) const NEARLY_ALL: f64 = 0.9;

/// Models and data of the test.
pub(crate) struct Proof<'a, 'r> {
    /// Robot as given.
    pub(crate) robot: &'a Robot,
    /// Models of the robot with effects.
    pub(crate) fitting: &'a ModelCache<'a, 'r>,
    /// The nominal model on the training data.
    pub(crate) base: &'a Fit<'r>,
    /// The training data.
    pub(crate) prepared: &'a PreparedData,
    /// The hold-out.
    pub(crate) held_out: Option<&'a PreparedData>,
    /// RMS residual, model by model.
    pub(crate) descent: &'a RmsPath,
}

impl Proof<'_, '_> {
    /// Returns the residual of the written model, joint by joint; the first `described` effects are described ones.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn left(
        &self,
        judged: &Judged,
        described: usize,
    ) -> Result<Vec<Left>, DiagnoseError> {
        let Self { descent, .. } = self;
        let chosen = &judged.chosen;
        let data = self.held_out.unwrap_or(self.prepared);
        let floors = descent.floors(&judged.known);
        let fall = descent.holdout.as_ref().unwrap_or(&descent.train);
        let mut after = self.fitting.unseen(chosen, data)?;
        if self.held_out.is_none() {
            let unseen = with(self.base, chosen, None).left_out_in_turn();
            (after.iter_mut().zip(unseen)).for_each(|(rms, times)| *rms *= times);
        }
        let of_joint = |(j, joint): (usize, &Joint)| {
            let named = chosen[described..].iter().any(|p| p.candidate.joint == j);
            let before = fall.whole(j)[0];
            let rms = [before, after[j]];
            let floor_from = match descent.is_held_twice(j) {
                true => FloorFrom::RepeatedRuns,
                false => judged.from[j],
            };
            let torque = torque_of(data, j);
            let treated = besides(chosen, &data.rows, j, rms);
            Left {
                joint: joint.name.clone(),
                unit: joint.kind.units().1.to_owned(),
                on_holdout: self.held_out.is_some(),
                before,
                after: after[j],
                floor: floors[j],
                floor_from,
                torque,
                percent_of_torque: 100.0 * after[j] / torque,
                explained: explained(rms, floors[j], treated, named, floor_from),
            }
        };
        Ok(self.robot.joints.iter().enumerate().map(of_joint).collect())
    }
}

/// Returns true if the RMS `after` is at the noise floor, or nearly all of the gap between `before` and the floor is
/// closed. `treated` is a mean square that is neither noise nor a missing effect. A joint without a found effect passes
/// with any known floor: repeated runs are compared elsewhere, a lower limit not at all.
fn explained(
    [before, after]: [f64; 2],
    floor: f64,
    treated: f64,
    named: bool,
    from: FloorFrom,
) -> bool {
    let least = if floor.is_nan() { 0.0 } else { floor };
    let at_floor = after * after <= (BEYOND_FLOOR * least).powi(2) + treated;
    let closed = before - after >= NEARLY_ALL * (before - least);
    at_floor
        || if named {
            closed
        } else {
            from != FloorFrom::Unknown
        }
}

/// Returns the RMS of a joint's recorded torque.
fn torque_of(data: &PreparedData, joint: usize) -> f64 {
    let (mut squares, mut count) = (0.0, 0_usize);
    for run in &data.runs {
        let recorded = run.joints[joint].recorded();
        squares += sum_of_squares(&recorded);
        count += recorded.len();
    }
    (squares / count.max(1) as f64).sqrt()
}

/// Returns the residual of the unexplained joint that is largest relative to its torque; `None` if all are explained.
pub(crate) fn unexplained(left: &[Left], named: &dyn Fn(&str) -> bool) -> Option<Unexplained> {
    let worst = (left.iter().filter(|left| !left.explained))
        .max_by(|a, b| a.percent_of_torque.total_cmp(&b.percent_of_torque))?;
    let least = if worst.floor.is_nan() {
        0.0
    } else {
        worst.floor
    };
    Some(Unexplained {
        joint: worst.joint.clone(),
        rms: (worst.after.powi(2) - least * least).max(0.0).sqrt(),
        unit: worst.unit.clone(),
        ratio: worst.after / worst.floor,
        places: Vec::new(),
        cause: RemainderCause::GapOpen {
            left: worst.clone(),
            named: named(&worst.joint),
        },
    })
}

#[cfg(test)]
mod tests;
