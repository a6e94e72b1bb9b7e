//! The controllers of a robot.

use super::error::SimulateError;
use super::model::Model;
use crate::robot::{Controller, Robot};

/// Bandwidth of the stand-in controller if the description has none, Hz.
pub const STAND_IN_BANDWIDTH: f64 = 5.0;

/// Share of the largest inertia below which an inertia is rounding.
const NO_INERTIA: f64 = 1e-12;

/// Returns the controllers of a robot, and the joints that got a stand-in because the description has no controller.
///
/// The stand-in is a cascade that places both poles of the joint's own inertia at [`STAND_IN_BANDWIDTH`], critically
/// damped. It does not compensate friction: dry friction can hold a light link still. Use a feed-forward
/// ([`Inputs::feed_forward`](super::Inputs::feed_forward)) for that.
///
/// # Errors
/// [`SimulateError::NoInertia`] if a joint has no inertia to move.
pub fn controllers(
    robot: &Robot,
    model: &Model,
    q: &[f64],
) -> Result<(Vec<Controller>, Vec<String>), SimulateError> {
    let n = robot.joints.len();
    let mut mass = vec![0.0; n * n];
    model.inertia_matrix(q, &mut mass)?;
    if let Some(light) = massless(&mass, n) {
        return Err(SimulateError::NoInertia {
            joint: robot.joints[light].name.clone(),
        });
    }
    let mut stand_ins = Vec::new();
    let mut list = Vec::with_capacity(n);
    for (i, joint) in robot.joints.iter().enumerate() {
        if let Some(controller) = &joint.controller {
            list.push(controller.clone());
            continue;
        }
        let inertia = mass[i * n + i];
        let omega = core::f64::consts::TAU * STAND_IN_BANDWIDTH;
        stand_ins.push(joint.name.clone());
        list.push(Controller {
            position_gain: 0.5 * omega,
            velocity_gain: 2.0 * omega,
            torque_gain: inertia,
        });
    }
    Ok((list, stand_ins))
}

/// Returns the first joint, from the tip, with almost no inertia to move while the joints beyond it are free. Its pivot
/// of the inertia matrix (n × n, row-major) in the elimination from the tip (Featherstone 2008, sec. 7.3) is rounding.
fn massless(mass: &[f64], n: usize) -> Option<usize> {
    let largest = (0..n).map(|i| mass[i * n + i]).fold(0.0, f64::max);
    let mut left = mass.to_vec();
    for k in (0..n).rev() {
        let pivot = left[k * n + k];
        if pivot.is_nan() || pivot <= NO_INERTIA * mass[k * n + k].max(largest) {
            return Some(k);
        }
        for i in 0..k {
            let share = left[i * n + k] / pivot;
            for j in 0..k {
                left[i * n + j] -= share * left[k * n + j];
            }
        }
    }
    None
}

/// Returns the torque that a controller asks for, from the measured position and velocity.
pub(super) fn wish(controller: &Controller, reference: f64, [q, v]: [f64; 2]) -> f64 {
    let speed = controller.position_gain * (reference - q);
    controller.torque_gain * controller.velocity_gain * (speed - v)
}
