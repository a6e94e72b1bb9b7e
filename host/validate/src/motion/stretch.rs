//! Stretches of a recording without a gap.

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;

use super::reference::no_reference;
use crate::ValidateError;
use rig_data::prepare::Recording;
use rig_identify::added_torque;
use rig_model::robot::{Controller, Robot};

/// Number of rows in the parabola that gives the initial state of a stretch.
pub(super) const FIRST_ROWS: usize = 21;
/// Shortest usable stretch between gaps, rows: in shorter ones the initial state dominates.
pub(super) const FEWEST_ROWS: usize = 5 * FIRST_ROWS;

/// A stretch without a gap, per joint.
pub(super) struct Stretch {
    pub(super) t: Vec<f64>,
    pub(super) reference: Vec<Vec<f64>>,
    pub(super) q: Vec<Vec<f64>>,
    pub(super) tau: Vec<Vec<f64>>,
    pub(super) added: Vec<Vec<f64>>,
    pub(super) first_velocity: Vec<Option<f64>>,
}

/// Content of a recording for a simulation.
pub(super) struct Gathered {
    pub(super) stretches: Vec<Stretch>,
    /// Per joint, description of the added torque.
    pub(super) added: Vec<String>,
    pub(super) short: usize,
}

/// Reads the input of the simulation; the inner error is a sentence about missing data.
pub(super) fn gather(
    robot: &Robot,
    controllers: &[Controller],
    recording: &dyn Recording,
    most: usize,
) -> Result<Result<Gathered, String>, ValidateError> {
    let n = robot.joints.len();
    let mut all: Vec<Stretch> = Vec::new();
    let mut seen = 0usize;
    let mut missing: Option<String> = None;
    let mut named: Vec<String> = Vec::new();
    recording.each_block(1 << 16, &mut |block| {
        let room = most.saturating_sub(seen).min(block.len());
        if missing.is_some() || room == 0 {
            return Ok(());
        }
        if let Some(j) = block.joints.iter().position(|j| j.reference.is_none()) {
            missing = Some(no_reference(&robot.joints[j].name, j));
            return Ok(());
        }
        if !block.continues || all.is_empty() {
            all.push(Stretch {
                t: Vec::new(),
                reference: vec![Vec::new(); n],
                q: vec![Vec::new(); n],
                tau: vec![Vec::new(); n],
                added: vec![Vec::new(); n],
                first_velocity: block
                    .joints
                    .iter()
                    .map(|j| j.qd.as_ref().and_then(|v| v.first().copied()))
                    .collect(),
            });
        }
        let Some(stretch) = all.last_mut() else {
            return Ok(());
        };
        stretch.t.extend(&block.t[..room]);
        for (j, joint) in block.joints.iter().enumerate() {
            stretch.q[j].extend(&joint.q[..room]);
            stretch.tau[j].extend(&joint.tau[..room]);
            if let Some(reference) = &joint.reference {
                stretch.reference[j].extend(&reference[..room]);
            }
            let added = added_torque(&block, j, controllers, room, &mut named);
            if added.iter().any(|a| a.is_nan()) {
                missing = Some(format!(
                    "The torque added to joint {} is not a number in some rows.",
                    robot.joints[j].name
                ));
            }
            stretch.added[j].extend(added);
        }
        seen += room;
        Ok(())
    })?;
    if let Some(why) = missing {
        return Ok(Err(why));
    }
    let before = all.len();
    all.retain(|s| s.t.len() >= FEWEST_ROWS);
    Ok(Ok(Gathered {
        short: before - all.len(),
        stretches: all,
        added: named,
    }))
}

/// Returns position and velocity at the first row of a stretch.
pub(super) fn first_state(stretch: &Stretch, period: f64) -> (Vec<f64>, Vec<f64>) {
    let n = stretch.q.len();
    let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
    let rows = FIRST_ROWS.min(stretch.t.len());
    let a = DMatrix::from_fn(rows, 3, |i, power| (i as f64).powi(power as i32));
    let svd = Svd::of(a);
    for j in 0..n {
        let y = DVector::from_fn(rows, |i, _| stretch.q[j][i]);
        let x = svd.solve(&y, 1e-12);
        q[j] = x[0];
        v[j] = stretch.first_velocity[j].unwrap_or(x[1] / period);
    }
    (q, v)
}
