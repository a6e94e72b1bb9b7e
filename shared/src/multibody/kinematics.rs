//! Pose of a frame of a link, and its derivatives by the joint positions.

use super::chain::{Chain, JointKind, MAX_JOINTS, MultibodyError, check};
use super::spatial::Vector3;
use crate::scalar::Real;

/// Computes the position of a point of link `link` (from 0) in the base frame, m, and its joint-position derivatives.
///
/// `point` is fixed in frame `link`. `jacobian` has length n: entry j is the derivative of the position by q of joint j
/// (Khalil & Dombre 2002, eq. 5.9), zero for the joints beyond the link.
///
/// # Errors
/// [`MultibodyError::WrongLength`], also for a `link` that the chain does not have.
pub fn point_position<T: Real>(
    chain: &Chain<T>,
    q: &[T],
    link: usize,
    point: [T; 3],
    jacobian: &mut [[T; 3]],
) -> Result<[T; 3], MultibodyError> {
    if chain.has_followers() {
        return behind_followers(chain, (q, link), jacobian, |axes, q, axis, own| {
            point_position(axes, q, axis, point, own)
        });
    }
    check_link(chain, q, link, jacobian.len())?;
    jacobian.fill([T::ZERO; 3]);
    let mut place = Vector3(point);
    // Inwards: values in frame i are transformed to frame i − 1.
    for i in (0..=link).rev() {
        let joint = &chain.joints[i];
        let transform = joint.transform(q[i]);
        let z = Vector3([T::ZERO, T::ZERO, T::ONE]);
        jacobian[i] = match joint.kind {
            JointKind::Revolute => z.cross(place).0,
            JointKind::Prismatic => z.0,
        };
        for column in &mut jacobian[i..=link] {
            *column = transform.direction_to_parent(Vector3(*column)).0;
        }
        place = transform.origin + transform.direction_to_parent(place);
    }
    Ok(place.0)
}

/// Checks lengths, and that the chain has the link.
fn check_link<T: Real>(
    chain: &Chain<T>,
    q: &[T],
    link: usize,
    jacobian: usize,
) -> Result<(), MultibodyError> {
    let n = chain.joint_count();
    check("q", n, q.len())?;
    check("jacobian", n, jacobian)?;
    if link >= n {
        return Err(MultibodyError::WrongLength {
            argument: "q",
            expected: link + 1,
            found: n,
        });
    }
    Ok(())
}

/// Position and orientation of a frame in another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<T> {
    /// Origin, m.
    pub position: [T; 3],
    /// Rotation matrix, row-major: its columns are the axes of the frame.
    pub rotation: [[T; 3]; 3],
}

/// Computes the pose in the base frame of a frame that is fixed in link `link` (from 0), and its Jacobian.
///
/// `fixed` is the pose of the frame in the frame of the link. `jacobian` has length n: entry j is the twist of the frame
/// for a unit velocity of joint j, linear velocity of its origin (m) before angular velocity (rad), both in the base frame
/// (Khalil & Dombre 2002, eq. 5.9). It is zero for the joints beyond the link.
///
/// # Errors
/// [`MultibodyError::WrongLength`], also for a `link` that the chain does not have.
pub fn frame_pose<T: Real>(
    chain: &Chain<T>,
    q: &[T],
    link: usize,
    fixed: &Pose<T>,
    jacobian: &mut [[T; 6]],
) -> Result<Pose<T>, MultibodyError> {
    if chain.has_followers() {
        return behind_followers(chain, (q, link), jacobian, |axes, q, axis, own| {
            frame_pose(axes, q, axis, fixed, own)
        });
    }
    check_link(chain, q, link, jacobian.len())?;
    jacobian.fill([T::ZERO; 6]);
    let z = Vector3([T::ZERO, T::ZERO, T::ONE]);
    let mut place = Vector3(fixed.position);
    let [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]] = fixed.rotation;
    let mut axes = [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]].map(Vector3);
    // Inwards: values in frame i are transformed to frame i − 1.
    for i in (0..=link).rev() {
        let joint = &chain.joints[i];
        let transform = joint.transform(q[i]);
        let (linear, angular) = match joint.kind {
            JointKind::Revolute => (z.cross(place), z),
            JointKind::Prismatic => (z, Vector3::ZERO),
        };
        jacobian[i] = six(linear, angular);
        for column in &mut jacobian[i..=link] {
            let [x, y, z, a, b, c] = *column;
            *column = six(
                transform.direction_to_parent(Vector3([x, y, z])),
                transform.direction_to_parent(Vector3([a, b, c])),
            );
        }
        place = transform.origin + transform.direction_to_parent(place);
        axes = axes.map(|axis| transform.direction_to_parent(axis));
    }
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = axes.map(|axis| axis.0);
    Ok(Pose {
        position: place.0,
        rotation: [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]],
    })
}

/// Computes the acceleration of the origin of a frame that is fixed in link `link` at constant velocities of the joints, m/s²,
/// in the base frame: J̇·q̇. `fixed` is the pose of the frame in the frame of the link.
///
/// # Errors
/// [`MultibodyError::WrongLength`], also for a `link` that the chain does not have.
pub fn convective_acceleration<T: Real>(
    chain: &Chain<T>,
    state: [&[T]; 2],
    link: usize,
    fixed: &Pose<T>,
) -> Result<[T; 3], MultibodyError> {
    if chain.has_followers() {
        // The axes of followers turn as well: the sum goes over all axes.
        let axis = chain.axis_of_link(link);
        return chain.on_axes(state, |axes, own| {
            convective_acceleration(axes, own, axis, fixed)
        });
    }
    let [q, qd] = state;
    check("qd", chain.joint_count(), qd.len())?;
    let mut jacobian = [[T::ZERO; 6]; MAX_JOINTS];
    let jacobian = &mut jacobian[..qd.len()];
    frame_pose(chain, q, link, fixed, jacobian)?;
    Ok(convective(jacobian, qd))
}

/// Returns Σ q̇_i·q̇_j·∂J_j/∂q_i of the linear velocity: ∂J_j/∂q_i is z_i × J_j if joint i is not beyond joint j, and
/// z_j × J_i otherwise (z of a sliding joint is zero).
pub(crate) fn convective<T: Real>(jacobian: &[[T; 6]], qd: &[T]) -> [T; 3] {
    let mut sum = [T::ZERO; 3];
    for (j, own) in jacobian.iter().enumerate() {
        for (i, other) in jacobian.iter().enumerate() {
            let (axis, arm) = if i <= j { (other, own) } else { (own, other) };
            let [x, y, z, ..] = *arm;
            let [_, _, _, a, b, c] = *axis;
            let weight = qd[i] * qd[j];
            sum[0] += weight * (b * z - c * y);
            sum[1] += weight * (c * x - a * z);
            sum[2] += weight * (a * y - b * x);
        }
    }
    sum
}

fn six<T: Copy>(linear: Vector3<T>, angular: Vector3<T>) -> [T; 6] {
    let ([x, y, z], [a, b, c]) = (linear.0, angular.0);
    [x, y, z, a, b, c]
}

/// Returns what `of_axes` computes of the axis of link `link` with the chain of all axes and their positions, and adds the
/// columns of its Jacobian to those of the joints that the axes follow.
fn behind_followers<T: Real, R, const N: usize>(
    chain: &Chain<T>,
    (q, link): (&[T], usize),
    jacobian: &mut [[T; N]],
    of_axes: impl FnOnce(&Chain<T>, &[T], usize, &mut [[T; N]]) -> Result<R, MultibodyError>,
) -> Result<R, MultibodyError> {
    let (n, all) = (chain.joint_count(), chain.link_count());
    chain.on_axes([q], |axes, [q]| {
        check("jacobian", n, jacobian.len())?;
        if link >= all {
            return Err(MultibodyError::WrongLength {
                argument: "q",
                expected: link + 1,
                found: n,
            });
        }
        let mut wide = [[T::ZERO; N]; MAX_JOINTS];
        let found = of_axes(axes, q, chain.axis_of_link(link), &mut wide[..all])?;
        jacobian.fill([T::ZERO; N]);
        for (column, axis) in wide.iter().zip(&chain.axes) {
            for (to, value) in jacobian[axis.joint].iter_mut().zip(column) {
                *to += axis.ratio * *value;
            }
        }
        Ok(found)
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::dual::Dual;
    use crate::multibody::samples::Sample;
    use crate::multibody::{JointGeometry, potential_energy};
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn two_links_in_a_plane() {
        let joint = |a| JointGeometry {
            kind: JointKind::Revolute,
            alpha: 0.0,
            a,
            theta: 0.0,
            d: 0.0,
        };
        let chain = Chain::<f64>::new(&[joint(0.0), joint(0.5)], [0.0; 3]).unwrap();
        let (a, b) = (0.4_f64, 1.1_f64);
        let mut jacobian = [[f64::NAN; 3]; 2];
        let p = point_position(&chain, &[a, b], 1, [0.3, 0.0, 0.2], &mut jacobian).unwrap();
        let expected = [
            0.5 * a.cos() + 0.3 * (a + b).cos(),
            0.5 * a.sin() + 0.3 * (a + b).sin(),
            0.2,
        ];
        for k in 0..3 {
            assert!((p[k] - expected[k]).abs() < 1e-15, "{p:?}");
        }
        assert!((jacobian[1][0] + 0.3 * (a + b).sin()).abs() < 1e-15);
        assert!(point_position(&chain, &[a, b], 2, [0.0; 3], &mut jacobian).is_err());
    }

    #[test]
    fn heights_are_those_of_the_potential_energy_and_derivatives_those_of_dual_numbers() {
        type D = Dual<f64, 1>;
        for seed in 0..40 {
            let n = 1 + seed as usize % 7;
            let s = Sample::random(n, seed);
            let link = seed as usize % n;
            let point = [0.1, -0.2, 0.3];
            let mut jacobian = vec![[f64::NAN; 3]; n];
            let p = point_position(&s.chain(), &s.q, link, point, &mut jacobian).unwrap();
            // A mass of 1 kg at the point, under gravity along each axis in turn.
            let mut mass = vec![[0.0; crate::multibody::COLUMNS]; n];
            mass[link][..4].copy_from_slice(&[1.0, point[0], point[1], point[2]]);
            for axis in 0..3 {
                let mut gravity = [0.0; 3];
                gravity[axis] = -1.0;
                let tilted = s.chain().with_gravity(gravity);
                let height = potential_energy(&tilted, &mass, &s.q).unwrap();
                assert!((height - p[axis]).abs() < 1e-12, "{height} {p:?}");
            }
            let chain = Chain::<D>::new(&s.geometry, s.gravity).unwrap();
            let mut unused = vec![[D::default(); 3]; n];
            for k in 0..n {
                let mut q: Vec<D> = s.q.iter().map(|x| D::constant(*x)).collect();
                q[k] = D::variable(q[k].value, 0);
                let moved = point_position(&chain, &q, link, point.map(D::constant), &mut unused);
                for (found, dual) in jacobian[k].iter().zip(moved.unwrap()) {
                    assert!((found - dual.derivative[0]).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn pose_of_a_frame_is_that_of_its_points_and_its_rotation_stays_one() {
        for seed in 0..40 {
            let n = 1 + seed as usize % 7;
            let s = Sample::random(n, seed);
            let link = seed as usize % n;
            let (sin, cos) = 0.7_f64.sin_cos();
            let fixed = Pose {
                position: [0.1, -0.2, 0.3],
                rotation: [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]],
            };
            let mut jacobian = vec![[f64::NAN; 6]; n];
            let pose = frame_pose(&s.chain(), &s.q, link, &fixed, &mut jacobian).unwrap();
            // Points at the origin and at one metre along each axis of the frame.
            let mut columns = vec![[f64::NAN; 3]; n];
            let origin =
                point_position(&s.chain(), &s.q, link, fixed.position, &mut columns).unwrap();
            for k in 0..3 {
                assert!((pose.position[k] - origin[k]).abs() < 1e-12);
            }
            for axis in 0..3 {
                let mut tip = fixed.position;
                for (k, coordinate) in tip.iter_mut().enumerate() {
                    *coordinate += fixed.rotation[k][axis];
                }
                let mut moved = vec![[f64::NAN; 3]; n];
                let at = point_position(&s.chain(), &s.q, link, tip, &mut moved).unwrap();
                let arm: [f64; 3] = core::array::from_fn(|k| at[k] - origin[k]);
                for k in 0..3 {
                    assert!((pose.rotation[k][axis] - arm[k]).abs() < 1e-12);
                }
                // A rigid body: v(tip) = v(origin) + ω × arm.
                for j in 0..n {
                    let [vx, vy, vz, a, b, c] = jacobian[j];
                    let expected = [
                        vx + b * arm[2] - c * arm[1],
                        vy + c * arm[0] - a * arm[2],
                        vz + a * arm[1] - b * arm[0],
                    ];
                    for k in 0..3 {
                        assert!((moved[j][k] - expected[k]).abs() < 1e-12);
                    }
                }
            }
        }
    }
}
