//! Rows of a sweep: torque, reference and the torque of the identified model.

use rig_shared::multibody::{COLUMNS, column, differential_regressor, inverse_dynamics};

use super::passes::Signal;
use super::rows::Rows;
use crate::error::IdentifyError;
use crate::identification::Identification;
use crate::steps::torque_scale::poses;
use crate::structure::chain::chain_of;
use crate::treatment::decide::treatment_for;
use rig_data::prepare::{
    PrepareError, PrepareOptions, PreprocessingPlan, Recording, Survey, each_motion,
};
use rig_model::robot::Robot;

/// Decides the treatment of the sweep: the band of the identification, limited by the sweep's own rate and noise, and
/// the sweep's own clipping. There is no decimation, because means over passes are taken.
pub(super) fn treatment_of(
    robot: &Robot,
    fitted: &PreprocessingPlan,
    sweep: &Survey,
    recording: &dyn Recording,
) -> Result<PreprocessingPlan, IdentifyError> {
    let rate = sweep.sample_rate;
    // A noisier position, or one with worse time stamps, must not be differentiated in the band of a better one.
    let (_, own) = treatment_for(
        robot,
        &[recording],
        vec![sweep.clone()],
        &PrepareOptions::default(),
    )?;
    let cutoff = fitted.cutoff.min(own.cutoff).min(0.4 * rate);
    let saturation = (fitted.saturation.iter().zip(&sweep.joints))
        .map(|([low, high], own)| {
            let tighter = |a: Option<f64>, b: Option<f64>, pick: fn(f64, f64) -> f64| {
                a.into_iter().chain(b).reduce(pick)
            };
            [
                tighter(*low, own.clipped[0], f64::max),
                tighter(*high, own.clipped[1], f64::min),
            ]
        })
        .collect();
    Ok(PreprocessingPlan {
        sample_rate: rate,
        cutoff,
        decimation: 1,
        parallel_edge: cutoff,
        saturation,
        // One period of the filter, because a pass may end with the recording.
        trimmed: (rate / cutoff).ceil() as usize,
        ..fitted.clone()
    })
}

/// Returns the recorded reference of the joint; empty if there is none.
pub(super) fn reference_of(
    recording: &dyn Recording,
    joint: usize,
) -> Result<Signal, IdentifyError> {
    let mut signal = Signal::default();
    recording.each_block(1 << 16, &mut |block| {
        let Some(reference) = block.joints.get(joint).and_then(|j| j.reference.as_ref()) else {
            return Ok(());
        };
        for (k, (t, x)) in block.t.iter().zip(reference).enumerate() {
            signal.push(*t, *x, k > 0 || block.continues);
        }
        Ok(())
    })?;
    Ok(signal)
}

/// Computes the joint's torque and the identified model's torque with and without the joint's friction.
pub(super) fn rows_of(
    robot: &Robot,
    identification: &Identification,
    recording: &dyn Recording,
    joint: usize,
    treatment: &PreprocessingPlan,
) -> Result<Rows, IdentifyError> {
    let details = &identification.details;
    let chain = chain_of(robot)?;
    let n = robot.joints.len();
    let width = chain.parameter_count();
    let friction_columns = [column::VISCOUS, column::COULOMB].map(|c| joint * COLUMNS + c);
    let (own, rest): (Vec<(usize, f64)>, Vec<(usize, f64)>) =
        (details.columns.iter().zip(&details.estimate.values))
            .map(|(c, v)| (*c, *v))
            .partition(|(c, _)| friction_columns.contains(c));
    let (mut out, mut still) = (vec![0.0; n * width], vec![0.0; n * width]);
    let at_rest = vec![0.0; n];
    let mut rows = Rows::default();
    let mut last = None;
    each_motion(recording, treatment, 0, &mut |motion| {
        for k in motion.usable.0..motion.usable.1 {
            let state = |f: &dyn Fn(&rig_data::prepare::JointMotion) -> f64| {
                motion.joints.iter().map(f).collect::<Vec<f64>>()
            };
            let (q, qd, qdd) = (
                state(&|j| j.q[k]),
                state(&|j| j.qd[k]),
                state(&|j| j.qdd[k]),
            );
            differential_regressor(&chain, &q, &qd, &qdd, &mut out)
                .and_then(|()| differential_regressor(&chain, &q, &at_rest, &at_rest, &mut still))
                .map_err(|e| PrepareError::Stopped(e.to_string()))?;
            let of = |columns: &[f64], values: &[(usize, f64)]| {
                let row = &columns[joint * width..(joint + 1) * width];
                values.iter().map(|(c, v)| row[*c] * v).sum::<f64>()
            };
            let model = of(&out, &rest);
            rows.position
                .push(motion.t[k], q[joint], last == Some(motion.segment));
            last = Some(motion.segment);
            rows.speed.push(qd[joint]);
            rows.tau.push(motion.joints[joint].tau[k]);
            rows.model.push(model);
            rows.whole.push(model + of(&out, &own));
            rows.weight.push(of(&still, &rest));
            rows.saturated.push(motion.joints[joint].saturated[k]);
            rows.unsettled.push(motion.joints[joint].unsettled[k]);
        }
        Ok(())
    })?;
    Ok(rows)
}

/// Returns the identified viscous and Coulomb friction of a joint; 0 for a parameter that is not in the model.
pub(super) fn friction_of(identification: &Identification, joint: usize) -> [f64; 2] {
    let details = &identification.details;
    [column::VISCOUS, column::COULOMB].map(|own| {
        let mut all = details.columns.iter().zip(&details.estimate.values);
        let found = all.find(|(c, _)| **c == joint * COLUMNS + own);
        found.map_or(0.0, |(_, value)| *value)
    })
}

/// Returns true if gravity loads a joint in some pose, for bodies of any shape.
pub(super) fn can_be_loaded(robot: &Robot, joint: usize) -> Result<bool, IdentifyError> {
    let chain = chain_of(robot)?;
    let n = robot.joints.len();
    let (still, mut torque) = (vec![0.0; n], vec![0.0; n]);
    for (mass, first_moment) in [
        (1.0, [0.0; 3]),
        (1.0, [0.3, 0.2, 0.1]),
        (1.0, [-0.1, 0.3, 0.2]),
    ] {
        let mut body = [0.0; COLUMNS];
        body[column::MASS] = mass;
        body[column::FIRST_MOMENT..column::INERTIA].copy_from_slice(&first_moment);
        for q in poses(n) {
            inverse_dynamics(
                &chain,
                &vec![body; chain.link_count()],
                &q,
                &still,
                &still,
                &mut torque,
            )
            .map_err(|e| IdentifyError::Model(e.to_string()))?;
            // Unit bodies on arms of any size, N·m; rounded angles of a description tilt an axis by 1e-5.
            if torque[joint].abs() > 1e-3 {
                return Ok(true);
            }
        }
    }
    Ok(false)
}
