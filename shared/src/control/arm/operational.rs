//! Torques for a wanted acceleration of the tool.

use super::fault::{ControlFault, check};
use super::friction::add_dry_friction;
use super::input::{Inputs, Limited, limit};
use super::model::ArmModel;
use super::task::{AXES, Task, TaskMotion};
use crate::cholesky::{factorise, solve};
use crate::multibody::{MAX_JOINTS, MultibodyError};
use crate::precompensation::PrecompensationSettings;
use crate::scalar::Real;

/// Smallest mobility of the tool along a direction, as a share of the largest one in the task, that is not singular. The
/// square root is the ratio of distances that equal efforts move the tool: a thousandth.
const SINGULAR: f64 = 1e-6;

/// Constants of the laws in the space of a task.
#[derive(Clone, Copy, Debug)]
pub struct Operational<'a, T> {
    /// The model.
    pub model: ArmModel<'a, T>,
    /// Tool and directions.
    pub task: Task<'a, T>,
    /// Posture in the motions that do not move the tool: kp in 1/s², kd in 1/s.
    pub posture: [T; 2],
    /// Settings of the compensation of dry friction.
    pub friction: PrecompensationSettings<T>,
    /// Highest torque of each joint, N·m or N.
    pub torque_limit: &'a [T],
}

/// What comes with the torques of a task.
#[derive(Clone, Copy, Debug)]
pub(super) struct Computed<T> {
    /// The joints at their torque limits.
    pub limited: Limited,
    /// Mobility of the tool along each direction, the diagonal of J·A⁻¹·Jᵀ, m/(N·s²).
    pub mobility: [T; AXES],
}

impl<T: Real<Mask = bool>> Operational<'_, T> {
    /// Computes the joint torques that give the tool the acceleration `wanted` along each direction (Khatib 1987):
    /// q̈ = q̈₀ + A⁻¹·Jᵀ·Λ·(a − J̇·q̇ − J·q̈₀) with Λ = (J·A⁻¹·Jᵀ)⁻¹. q̈₀ holds the posture; it acts only where the tool
    /// does not move. The force on the tool is taken off: τ = A·q̈ + C·q̇ + g + friction − Jᵀ·f. `speed` is the planned
    /// velocity along each direction, which gives the direction of friction.
    pub(super) fn torque(
        &self,
        input: &Inputs<'_, T>,
        motion: &TaskMotion<T>,
        [wanted, speed, pressed]: [&[T; AXES]; 3],
        torque: &mut [T],
    ) -> Result<Computed<T>, ControlFault> {
        let (n, count) = (self.model.joint_count(), self.task.directions.len());
        input.check(n)?;
        check("torque_limit", n, self.torque_limit.len())?;
        check("torque", n, torque.len())?;
        let mut mass = [T::ZERO; MAX_JOINTS * MAX_JOINTS];
        let mass = &mut mass[..n * n];
        self.model.inertia_matrix(input.position, mass)?;
        factorise(mass, n).map_err(|joint| {
            ControlFault::Multibody(MultibodyError::NotPositiveDefinite { joint })
        })?;
        // A⁻¹·Jᵀ, one row a direction.
        let mut response = motion.rows;
        for row in response.iter_mut().take(count) {
            solve(mass, &mut row[..n]);
        }
        let mut mobility = [T::ZERO; AXES * AXES];
        let (mut largest, mut diagonal) = (T::ZERO, [T::ZERO; AXES]);
        for a in 0..count {
            for b in 0..count {
                mobility[a * count + b] = dot(&motion.rows[a][..n], &response[b][..n]);
            }
            diagonal[a] = mobility[a * count + a];
            largest = largest.max(diagonal[a]);
        }
        let mobility = &mut mobility[..count * count];
        factorise(mobility, count).map_err(|direction| ControlFault::Singular { direction })?;
        for direction in 0..count {
            let pivot = mobility[direction * count + direction].squared();
            if !(T::from_f64(SINGULAR) * largest).lt(pivot) {
                return Err(ControlFault::Singular { direction });
            }
        }
        let [kp, kd] = self.posture;
        let mut acceleration = [T::ZERO; MAX_JOINTS];
        for (j, reference) in input.reference.iter().enumerate() {
            acceleration[j] = reference.acceleration
                + kp * (reference.position - input.position[j])
                + kd * (reference.velocity - input.velocity[j]);
        }
        let (mut force, mut pace) = ([T::ZERO; AXES], *speed);
        for d in 0..count {
            force[d] =
                wanted[d] - motion.convective[d] - dot(&motion.rows[d][..n], &acceleration[..n]);
        }
        solve(mobility, &mut force[..count]);
        solve(mobility, &mut pace[..count]);
        let mut planned = [T::ZERO; MAX_JOINTS];
        for d in 0..count {
            for j in 0..n {
                acceleration[j] += response[d][j] * force[d];
                planned[j] += response[d][j] * pace[d];
            }
        }
        let (q, qd) = (input.position, input.velocity);
        self.model.rigid_torque(q, qd, &acceleration[..n], torque)?;
        self.model.add_viscous_torque(q, qd, torque)?;
        add_dry_friction(&self.model, &self.friction, q, &planned[..n], qd, torque)?;
        for (j, own) in torque.iter_mut().enumerate() {
            *own += input.known(j);
            for d in 0..count {
                *own += motion.rows[d][j] * pressed[d];
            }
        }
        Ok(Computed {
            limited: limit(self.torque_limit, torque),
            mobility: diagonal,
        })
    }
}

fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    let mut sum = T::ZERO;
    for (&x, &y) in a.iter().zip(b) {
        sum += x * y;
    }
    sum
}
