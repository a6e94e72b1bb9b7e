//! Simulation under the recorded torques.

use rig_data::runs::{JointRun, Run};
use rig_model::robot::{Controller, Placed, Robot};
use rig_model::simulate::{Inputs, Model, Motion, SimulateError, Since, closed_loop_since};
use rig_shared::multibody::column;

/// Simulates `model` under the torques of a run plus the controllers' corrections; only the corrections are returned as
/// its torques. `substeps` is per sample.
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
            // A torque held over a sample acts on average in its middle.
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
        run.thermal_history
            .state_after(&p.effect, p.joint, friction)
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
