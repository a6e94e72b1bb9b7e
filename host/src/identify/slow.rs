//! Where the motor of a coupled drive is slow: its friction has no known sign there, though every joint may move fast.

use super::model::{Plan, failed};
use crate::prepare::{Motion, PrepareError};

/// Rows in which a motor is slow, and the joints that it moves.
pub(super) struct SlowMotor {
    /// Per row of the piece.
    pub slow: Vec<bool>,
    /// Per joint, whether the motor's friction is in its torque.
    pub moves: Vec<bool>,
}

/// One entry a motor that moves more than its own joint or does it at a changing ratio.
///
/// Motor k runs at Σ J_kj·q̇_j. It counts as slow below √Σ(J_kj·v_j)², v_j the joints' own thresholds: what the noise of
/// these velocities, or friction that is not Coulomb and viscous up to these speeds, comes to at the motor.
pub(super) fn slow_motors(motion: &Motion, plan: &Plan) -> Result<Vec<SlowMotor>, PrepareError> {
    if plan.transmission.is_simple() {
        return Ok(Vec::new());
    }
    let (n, rows) = (motion.joints.len(), motion.t.len());
    let thresholds = &plan.treatment.speed_threshold;
    let mut motors: Vec<SlowMotor> = (0..n)
        .map(|_| SlowMotor {
            slow: Vec::with_capacity(rows),
            moves: vec![false; n],
        })
        .collect();
    let mut directions = vec![0.0; n * n];
    let mut q = vec![0.0; n];
    for row in 0..rows {
        for (q, joint) in q.iter_mut().zip(&motion.joints) {
            *q = joint.q[row];
        }
        plan.transmission
            .motor_directions(&q, &mut directions)
            .map_err(failed)?;
        for (motor, direction) in motors.iter_mut().zip(directions.chunks_exact(n)) {
            let (mut speed, mut square) = (0.0, 0.0);
            for (j, along) in direction.iter().enumerate() {
                speed += along * motion.joints[j].qd[row];
                square += (along * thresholds[j]).powi(2);
                motor.moves[j] |= *along != 0.0;
            }
            motor.slow.push(speed.abs() < square.sqrt());
        }
    }
    motors.retain(|m| m.moves.contains(&true));
    Ok(motors)
}
