//! What each model makes of the motion: the recorded torques drive it, and each joint's controller answers where it departs
//! from the recorded motion.
//!
//! A joint's controller that is linear in position and velocity gives, for the motion q of a model instead of the recorded
//! q_m, its recorded torque and kp·(q_m − q) + kd·(q̇_m − q̇): whatever it feeds forward is in the recorded torque
//! already. So the closed loop is simulated without knowing more of it than kp and kd. They are those of [joint.controller]
//! where the description has one, else regressed from the recording where a reference stands in it and explains the
//! torque, else those of a slow stand-in, with which a joint that would fall or drift stays at the recorded motion.
//!
//! Leaves out: integral action (part of the recorded torque), controllers that couple joints, temperatures, what acts on the
//! voltage.

use rig_data::runs::{JointRun, Run};
use rig_model::robot::{Controller, Placed, Robot};
use rig_model::simulate::{Inputs, Model, Motion, SimulateError, Since, closed_loop_since};
use rig_shared::multibody::column;

mod controller;

pub use controller::of_joints;

/// Motion of `model` under the torques of a run and the controllers' answers to what it departs by, which alone its torques are;
/// `substeps` within a sample.
///
/// # Errors
/// Those of [`rig_model::simulate::closed_loop`].
pub fn replayed(
    robot: &Robot,
    model: &Model,
    controllers: &[Controller],
    run: &Run,
    substeps: u32,
) -> Result<Motion, SimulateError> {
    if run.is_empty() {
        let none = || vec![Vec::new(); run.joints.len()];
        return Ok(Motion {
            q: none(),
            qd: none(),
            tau: none(),
            saturated: vec![0; run.joints.len()],
        });
    }
    let period = 1.0 / run.rate;
    let added: Vec<Vec<f64>> = (run.joints.iter().enumerate())
        .map(|(j, joint)| {
            let applied = model.effects.applied_effort(j, &joint.tau, period);
            // A torque held over a sample acts as in its middle.
            (0..applied.len())
                .map(|k| 0.5 * (applied[k] + applied[(k + 1).min(applied.len() - 1)]))
                .collect()
        })
        .collect();
    let reference: Vec<Vec<f64>> = (run.joints.iter().zip(controllers))
        .map(|(joint, controller)| {
            let ahead = joint.qd.iter().map(|v| v / controller.position_gain);
            joint.q.iter().zip(ahead).map(|(q, a)| q + a).collect()
        })
        .collect();
    let first = |of: fn(&JointRun) -> &[f64]| -> Vec<f64> {
        run.joints.iter().map(|joint| of(joint)[0]).collect()
    };
    let remembered = |p: &Placed| {
        let row = &model.parameters[p.joint];
        let friction = [row[column::VISCOUS], row[column::COULOMB]];
        run.past.remembered(&p.effect, p.joint, friction)
    };
    let since = Since {
        time: run.t[0] - run.began,
        memory: model.effects.placed().iter().map(remembered).collect(),
    };
    closed_loop_since(
        robot,
        model,
        controllers,
        &Inputs {
            period,
            reference: &reference,
            feed_forward: &[],
            added: &added,
            q: &first(|joint| &joint.q),
            v: &first(|joint| &joint.qd),
            substeps,
            held: true,
        },
        &since,
        |_| (),
    )
}

#[cfg(test)]
mod tests;
