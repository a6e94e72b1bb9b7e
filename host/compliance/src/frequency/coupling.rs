//! Torque that the motion of the other joints puts on the links of one joint.
//!
//! A joint that is held by its controller yields to the reaction of the joint that moves, by a few per cent. Its acceleration
//! times the coupling inertia M_kj, which may be several times the inertia M_kk of the links, is then no longer small: two masses
//! alone explain it by another stiffness. The other joints' positions are recorded, so their torque on the links follows from the
//! description: τ_k(q, q̇, q̈ without q̈_k) less that with the others at rest (recursive Newton–Euler).
//!
//! Leaves out: elasticity of the other joints, whose links move as their recorded positions do.

use rig_model::robot::Robot;
use rig_numerics::statistics::mean;
use rig_shared::multibody::{column, inverse_dynamics};

use crate::drives::{are_links_described, loaded};
use crate::error::ComplianceError;
use crate::signals::Signals;

/// Returns the torque of the other joints' motion on the links of joint `k` at each row but the last, that of the accelerations by
/// second differences. `None` if the description lacks an inertia, or if there is no other joint.
///
/// # Errors
/// [`ComplianceError::Model`].
pub(super) fn coupling(
    robot: &Robot,
    stretch: &Signals,
    k: usize,
) -> Result<Option<Vec<f64>>, ComplianceError> {
    let wrong = |error: &dyn std::fmt::Display| ComplianceError::Model(error.to_string());
    let n = robot.joints.len();
    if n < 2 || !are_links_described(robot, k) {
        return Ok(None);
    }
    let chain = robot.chain().map_err(|e| wrong(&e))?;
    let mut parameters = loaded(robot)?;
    for row in &mut parameters {
        for own in [
            column::DRIVE_INERTIA,
            column::VISCOUS,
            column::COULOMB,
            column::OFFSET,
        ] {
            row[own] = 0.0;
        }
    }
    let (rows, dt) = (stretch.len() - 1, 1.0 / stretch.rate());
    // Encoders on the links show more than those on the motors.
    let lists: Vec<&[f64]> = (stretch.joints.iter().enumerate())
        .map(|(j, own)| match &own.link {
            Some(link) if j != k => link.as_slice(),
            _ => own.q.as_slice(),
        })
        .collect();
    let middle: Vec<f64> = lists.iter().map(|list| mean(list)).collect();
    let zeros = vec![0.0; n];
    let (mut moving, mut resting) = (vec![0.0; n], vec![0.0; n]);
    let (mut q, mut qd, mut qdd) = (zeros.clone(), zeros.clone(), zeros.clone());
    let mut found = Vec::with_capacity(rows);
    for row in 0..rows {
        let before = row.saturating_sub(1);
        for (j, list) in lists.iter().enumerate() {
            let [last, own, next] = [list[before], list[row], list[row + 1]];
            q[j] = own;
            qd[j] = (next - last) / ((row + 1 - before) as f64 * dt);
            qdd[j] = match row > 0 && j != k {
                true => (next - 2.0 * own + last) / (dt * dt),
                false => 0.0,
            };
        }
        inverse_dynamics(&chain, &parameters, &q, &qd, &qdd, &mut moving).map_err(|e| wrong(&e))?;
        for j in (0..n).filter(|j| *j != k) {
            (q[j], qd[j]) = (middle[j], 0.0);
        }
        inverse_dynamics(&chain, &parameters, &q, &qd, &zeros, &mut resting)
            .map_err(|e| wrong(&e))?;
        found.push(moving[k] - resting[k]);
    }
    Ok(Some(found))
}
