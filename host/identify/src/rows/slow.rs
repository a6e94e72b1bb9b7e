//! Rows in which friction has no known sign: the motor of a coupled drive is slow, although every joint may be fast, or
//! a shaft dwells instead of passing through zero.

use super::plan::Plan;
use crate::error::failed;
use rig_data::prepare::{Motion, PrepareError};

/// Share of the speed threshold below which a shaft hardly moves. A shaft that passes through zero spends the same
/// share of its slow rows below it.
pub(crate) const HARDLY: f64 = 1.0 / 3.0;
/// Largest share of a window in which a shaft may dwell: friction then has any value between its two signs. Chosen by
/// judgement on a three-joint arm that sticks for up to half a second. 95 % intervals hold the truth in 79 % without
/// this limit, 86 % with it, and 88 % at a third of it. At a third, the TX40's friction leaves its published values.
const STAYING: f64 = 0.15;

/// Returns true if a shaft dwells within `all` rows, of which it is slow in `slow` and hardly moves in `hardly`.
pub(crate) fn stays(slow: usize, hardly: usize, all: usize) -> bool {
    let beyond_passing = hardly as f64 - HARDLY * slow as f64;
    beyond_passing > STAYING * (1.0 - HARDLY) * all as f64
}

/// Rows in which a motor is slow, and the joints that it moves.
pub(crate) struct SlowMotor {
    /// Per row of the piece, true if the motor is slow.
    pub slow: Vec<bool>,
    /// Per row, true if the motor hardly moves.
    pub hardly: Vec<bool>,
    /// Per joint, true if the motor's friction is in its torque.
    pub moves: Vec<bool>,
}

/// Returns one entry per motor that moves several joints or has a varying ratio.
///
/// Motor k runs at Σ J_kj·q̇_j. It counts as slow below √Σ(J_kj·v_j)², with v_j the joints' own thresholds. This is the
/// motor speed that corresponds to the noise of these velocities, or to friction that is not yet Coulomb and viscous.
pub(crate) fn slow_motors(motion: &Motion, plan: &Plan) -> Result<Vec<SlowMotor>, PrepareError> {
    if plan.transmission.is_simple() {
        return Ok(Vec::new());
    }
    let (n, rows) = (motion.joints.len(), motion.t.len());
    let thresholds = &plan.treatment.speed_threshold;
    let mut motors: Vec<SlowMotor> = (0..n)
        .map(|_| SlowMotor {
            slow: Vec::with_capacity(rows),
            hardly: Vec::with_capacity(rows),
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
            motor.hardly.push(speed.abs() < HARDLY * square.sqrt());
        }
    }
    motors.retain(|m| m.moves.contains(&true));
    Ok(motors)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns true if a shaft with this speed over time dwells within 0.4 s.
    fn of(speed: &dyn Fn(f64) -> f64) -> bool {
        let below = |threshold: f64| {
            let speeds = (0..400).map(|k| speed(k as f64 * 1e-3 - 0.2));
            speeds.filter(|v| v.abs() < threshold).count()
        };
        stays(below(0.1), below(HARDLY * 0.1), 400)
    }

    #[test]
    fn a_passage_through_zero_is_no_stay_and_a_stop_is_one() {
        for acceleration in [0.6, 2.0, 50.0] {
            assert!(!of(&|t| acceleration * t), "{acceleration}");
        }
        // Sticks for 80 ms at a reversal; the same, smoothed, so that it never stands; stops and moves on.
        assert!(of(&|t: f64| t.signum() * (t.abs() - 0.04).max(0.0) * 5.0));
        assert!(of(&|t| 100.0 * t.powi(3)));
        assert!(of(&|t: f64| (t.abs() - 0.04).max(0.0) * 5.0));
    }
}
