//! The wrench between a link and the body fixed to it: linear in the ten inertial parameters of that body.

use super::chain::{Chain, MultibodyError, check};
use super::inverse::LinkMotion;
use super::regressor::link_columns;
use super::spatial::{Motion, Vector3};
use crate::scalar::Real;

/// Number of inertial parameters of a body: m mx my mz Ixx Ixy Ixz Iyy Iyz Izz.
pub const INERTIAL_PARAMETERS: usize = 10;

/// Computes the regressor W of the wrench that moves a body with the last link: w = W(q, q̇, q̈)·φ
/// (Atkeson, An & Hollerbach 1986, eq. 9).
///
/// φ holds the ten inertial parameters of the body in the frame of the last joint, inertia about the frame's origin. w
/// is the force and the moment about that origin that the link exerts on the body, gravity included, in that frame:
/// fx fy fz, N, and mx my mz, N·m. `q`, `qd`, `qdd` have length n; `out` is 6 × 10, row-major.
///
/// Leaves out: the elasticity between link and body.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn wrench_regressor<T: Real>(
    chain: &Chain<T>,
    q: &[T],
    qd: &[T],
    qdd: &[T],
    out: &mut [T; 6 * INERTIAL_PARAMETERS],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        return chain.on_axes([q, qd, qdd], |axes, [q, qd, qdd]| {
            wrench_regressor(axes, q, qd, qdd, out)
        });
    }
    let n = chain.joint_count();
    check("q", n, q.len())?;
    check("qd", n, qd.len())?;
    check("qdd", n, qdd.len())?;
    let mut motion = LinkMotion::base(chain.gravity);
    for (i, joint) in chain.joints.iter().enumerate() {
        let transform = joint.transform(q[i]);
        motion = motion.next(joint, &transform, qd[i], qdd[i]);
    }
    for (axis, row) in out.chunks_exact_mut(INERTIAL_PARAMETERS).enumerate() {
        let mut unit = [T::ZERO; 3];
        unit[axis % 3] = T::ONE;
        // The power of a wrench along a unit motion is one of its components.
        let along = if axis < 3 {
            Motion {
                angular: Vector3::ZERO,
                linear: Vector3(unit),
            }
        } else {
            Motion {
                angular: Vector3(unit),
                linear: Vector3::ZERO,
            }
        };
        link_columns(&motion, &along, row);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::multibody::samples::{Sample, unit_point};
    use crate::multibody::{JointGeometry, JointKind, differential_regressor, point_position};
    use std::vec;

    /// Two links that turn about crossing axes, and carry a body of points.
    fn wrist() -> Chain<f64> {
        let joint = |alpha, a, d| JointGeometry {
            kind: JointKind::Revolute,
            alpha,
            a,
            theta: 0.2,
            d,
        };
        let joints = [
            joint(0.3, 0.0, 0.1),
            joint(-1.1, 0.25, 0.05),
            joint(0.8, 0.1, 0.3),
        ];
        Chain::new(&joints, [0.5, -0.3, -9.7]).unwrap()
    }

    /// Joint positions at time t.
    fn positions(t: f64) -> [f64; 3] {
        [
            0.9 * (2.1 * t).sin(),
            0.5 + 0.7 * (1.7 * t + 0.4).cos(),
            1.2 * (2.9 * t - 0.3).sin(),
        ]
    }

    fn derivative(of: impl Fn(f64) -> f64, t: f64) -> f64 {
        let h = 1e-3;
        (8.0 * (of(t + h) - of(t - h)) - (of(t + 2.0 * h) - of(t - 2.0 * h))) / (12.0 * h)
    }

    fn second_derivative(of: impl Fn(f64) -> f64, t: f64) -> f64 {
        let h = 1e-3;
        let near = of(t + h) + of(t - h);
        let far = of(t + 2.0 * h) + of(t - 2.0 * h);
        (16.0 * near - far - 30.0 * of(t)) / (12.0 * h * h)
    }

    /// Newton's law for each point: its acceleration from differences of its position in the base frame.
    #[test]
    fn wrench_of_a_body_of_points_is_that_of_newton_for_each_point() {
        let chain = wrist();
        let points = [
            (0.7, [0.1, -0.05, 0.2]),
            (0.4, [-0.08, 0.12, 0.15]),
            (1.1, [0.02, 0.06, 0.31]),
            (0.2, [0.15, 0.1, -0.04]),
        ];
        let mut phi = [0.0; INERTIAL_PARAMETERS];
        for (m, point) in points {
            for (sum, value) in phi.iter_mut().zip(unit_point(point)) {
                *sum += m * value;
            }
        }
        let place = |t: f64, point: [f64; 3]| {
            point_position(&chain, &positions(t), 2, point, &mut [[0.0; 3]; 3]).unwrap()
        };
        for t in [0.0, 0.37, 0.81, 1.6, 2.9] {
            let origin = place(t, [0.0; 3]);
            let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
                .map(|axis| Vector3(place(t, axis)) - Vector3(origin));
            let (mut force, mut moment) = (Vector3([0.0; 3]), Vector3([0.0; 3]));
            for (m, point) in points {
                let own: [f64; 3] = core::array::from_fn(|k| {
                    m * (second_derivative(|t| place(t, point)[k], t) - chain.gravity()[k])
                });
                force += Vector3(own);
                moment += (Vector3(place(t, point)) - Vector3(origin)).cross(Vector3(own));
            }
            let q = positions(t);
            let qd: [f64; 3] = core::array::from_fn(|k| derivative(|t| positions(t)[k], t));
            let qdd: [f64; 3] = core::array::from_fn(|k| second_derivative(|t| positions(t)[k], t));
            let mut w = [0.0; 60];
            wrench_regressor(&chain, &q, &qd, &qdd, &mut w).unwrap();
            for (row, expected) in w
                .chunks(INERTIAL_PARAMETERS)
                .zip((axes.iter().map(|a| a.dot(force))).chain(axes.iter().map(|a| a.dot(moment))))
            {
                let found: f64 = row.iter().zip(phi).map(|(a, b)| a * b).sum();
                assert!((found - expected).abs() < 2e-6, "{found} {expected}");
            }
        }
    }

    #[test]
    fn last_joint_gives_its_component() {
        for seed in 0..30 {
            let n = 1 + seed as usize % 7;
            let s = Sample::random(n, seed);
            let chain = s.chain();
            let mut w = [f64::NAN; 60];
            wrench_regressor(&chain, &s.q, &s.qd, &s.qdd, &mut w).unwrap();
            let width = chain.parameter_count();
            let mut y = vec![0.0; n * width];
            differential_regressor(&chain, &s.q, &s.qd, &s.qdd, &mut y).unwrap();
            let row = match chain.kind(n - 1).unwrap() {
                JointKind::Revolute => 5,
                JointKind::Prismatic => 2,
            };
            for k in 0..INERTIAL_PARAMETERS {
                let torque = y[(n - 1) * width + (n - 1) * 14 + k];
                assert!((w[row * INERTIAL_PARAMETERS + k] - torque).abs() < 1e-12);
            }
        }
    }
}
