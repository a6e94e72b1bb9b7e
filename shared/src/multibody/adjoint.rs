//! Exact gradients of weighted sums of the regressor, at about the cost of two regressors.
//!
//! An excitation criterion depends on the motion through every entry of Y. Dual numbers would carry 3n derivatives
//! through each of the n·14n entries. Reverse accumulation (Griewank & Walther 2008, ch. 3.2) takes one sweep inwards
//! for any number of joints.

use super::capacity::with_capacity;
use super::chain::{Chain, JointKind, MAX_JOINTS, MultibodyError, check};
use super::inverse::LinkMotion;
use super::parameters::{COLUMNS, column, inertia};
use super::projection::REGRESSOR;
use super::spatial::{Motion, Transform, Vector3, Wrench};
use crate::scalar::Real;

/// Motion of a link in the outward pass, with the values that the backward pass needs.
#[derive(Clone, Copy)]
struct Step<T> {
    transform: Transform<T>,
    motion: LinkMotion<T>,
}

/// Computes the gradient of Σ W∘Y by `q`, `qd` and `qdd`. Y is the n × 14n matrix of
/// [`differential_regressor`](super::differential_regressor), W has constant weights of the same shape (row-major).
///
/// With W = λ·πᵀ it is the gradient of λᵀτ. Each derivative is written to the slice of its name (length n). The sgn q̇
/// in the Coulomb columns counts as constant. Takes O(n²) operations.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn regressor_gradient<T: Real>(
    chain: &Chain<T>,
    q: &[T],
    qd: &[T],
    qdd: &[T],
    weights: &[T],
    by_q: &mut [T],
    by_qd: &mut [T],
    by_qdd: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        return projected_gradient(chain, [q, qd, qdd], weights, [by_q, by_qd, by_qdd]);
    }
    let n = chain.joint_count();
    check("q", n, q.len())?;
    check("qd", n, qd.len())?;
    check("qdd", n, qdd.len())?;
    check("weights", n * chain.parameter_count(), weights.len())?;
    check("by_q", n, by_q.len())?;
    check("by_qd", n, by_qd.len())?;
    check("by_qdd", n, by_qdd.len())?;
    with_capacity!(n, gradient(chain, q, qd, qdd, weights, by_q, by_qd, by_qdd));
    Ok(())
}

fn gradient<T: Real, const CAPACITY: usize>(
    chain: &Chain<T>,
    q: &[T],
    qd: &[T],
    qdd: &[T],
    weights: &[T],
    by_q: &mut [T],
    by_qd: &mut [T],
    by_qdd: &mut [T],
) {
    let width = chain.parameter_count();
    let base = LinkMotion::base(chain.gravity);
    let mut steps = [Step {
        transform: Transform::IDENTITY,
        motion: base,
    }; CAPACITY];
    let mut axes = [[Motion::ZERO; CAPACITY]; CAPACITY];
    outwards(chain, q, qd, qdd, &mut steps, &mut axes);
    // Derivatives of the sum by the values that the link further in passes outwards.
    let mut by_axes = [Wrench::ZERO; CAPACITY];
    let mut by_motion = LinkMotion {
        velocity: Vector3::ZERO,
        acceleration: Vector3::ZERO,
        proper: Vector3::ZERO,
    };
    for (i, joint) in chain.joints.iter().enumerate().rev() {
        let Step { transform, motion } = &steps[i];
        for j in 0..=i {
            let start = j * width + i * COLUMNS;
            let Some(row) = weights[start..].first_chunk::<COLUMNS>() else {
                return;
            };
            link_gradient(row, motion, &axes[i][j], &mut by_motion, &mut by_axes[j]);
        }
        let own = &weights[i * width + i * COLUMNS..];
        let mut by_joint = JointGradient {
            q: T::ZERO,
            qd: own[column::VISCOUS],
            qdd: own[column::DRIVE_INERTIA],
        };

        // Seen from this link, an axis further in turns against the joint.
        let axis = axes[i][i];
        for j in 0..i {
            by_joint.q -= axis.cross(axes[i][j]).dot(by_axes[j]);
            by_axes[j] = transform.wrench_to_parent(by_axes[j]);
        }

        let parent = if i == 0 { base } else { steps[i - 1].motion };
        by_motion = by_joint.across(joint.kind, &steps[i], &parent, qd[i], &by_motion);
        by_q[i] = by_joint.q;
        by_qd[i] = by_joint.qd;
        by_qdd[i] = by_joint.qdd;
    }
}

/// Computes the motions of all links and, in the frame of each, the axes of the joints up to it.
#[inline(always)]
fn outwards<T: Real, const CAPACITY: usize>(
    chain: &Chain<T>,
    q: &[T],
    qd: &[T],
    qdd: &[T],
    steps: &mut [Step<T>; CAPACITY],
    axes: &mut [[Motion<T>; CAPACITY]; CAPACITY],
) {
    let mut motion = LinkMotion::base(chain.gravity);
    for (i, joint) in chain.joints.iter().enumerate() {
        let transform = joint.transform(q[i]);
        motion = motion.next(joint, &transform, qd[i], qdd[i]);
        steps[i] = Step { transform, motion };
        for j in 0..i {
            axes[i][j] = transform.motion_to_child(axes[i - 1][j]);
        }
        axes[i][i] = joint.axis();
    }
}

/// Derivatives of the sum by the motion of one joint.
struct JointGradient<T> {
    q: T,
    qd: T,
    qdd: T,
}

impl<T: Real> JointGradient<T> {
    /// Adds what the motion of the joint's own link, `step`, depends on. Returns the derivatives by the motion of its
    /// `parent` from those by that of the link, `by_motion`.
    #[inline(always)]
    fn across(
        &mut self,
        kind: JointKind,
        step: &Step<T>,
        parent: &LinkMotion<T>,
        qd: T,
        by_motion: &LinkMotion<T>,
    ) -> LinkMotion<T> {
        let Step { transform, motion } = step;
        let carried = transform.direction_to_child(parent.velocity);
        let z = Vector3([T::ZERO, T::ZERO, T::ONE]);
        let across = carried.cross_z(T::ONE);
        let mut by_carried = by_motion.velocity;
        let outer = transform.direction_to_parent(by_motion.proper);
        match kind {
            JointKind::Revolute => {
                self.qdd += by_motion.acceleration.z();
                self.qd += by_motion.velocity.z() + by_motion.acceleration.dot(across);
                by_carried += z.cross(by_motion.acceleration).scaled(qd);
                let angular_acceleration = transform.direction_to_child(parent.acceleration);
                // A rotated constant vector v changes by −z × v.
                self.q -= by_carried.dot(z.cross(carried))
                    + by_motion.acceleration.dot(z.cross(angular_acceleration))
                    + by_motion.proper.dot(z.cross(motion.proper));
            }
            JointKind::Prismatic => {
                let two = T::ONE + T::ONE;
                self.qdd += by_motion.proper.z();
                self.qd += two * by_motion.proper.dot(across);
                by_carried += z.cross(by_motion.proper).scaled(two * qd);
                let by_origin = outer.cross(parent.acceleration)
                    + parent.velocity.cross(parent.velocity.cross(outer));
                self.q += by_origin.dot(transform.direction_to_parent(z));
            }
        }
        let origin = transform.origin;
        LinkMotion {
            velocity: transform.direction_to_parent(by_carried)
                + centripetal(parent.velocity, origin, outer),
            acceleration: transform.direction_to_parent(by_motion.acceleration)
                + origin.cross(outer),
            proper: outer,
        }
    }
}

/// Returns the gradient by ω of a·(ω × (ω × b)), which is symmetric in a and b.
#[inline(always)]
fn centripetal<T: Real>(angular_velocity: Vector3<T>, a: Vector3<T>, b: Vector3<T>) -> Vector3<T> {
    let along = a.dot(b);
    b.scaled(angular_velocity.dot(a)) + a.scaled(angular_velocity.dot(b))
        - angular_velocity.scaled(along + along)
}

/// Adds the weighted gradient of one link's ten columns along one axis. The weights act as a body, and the derivative
/// by the axis is that body's wrench.
#[inline(always)]
fn link_gradient<T: Real>(
    weights: &[T; COLUMNS],
    motion: &LinkMotion<T>,
    axis: &Motion<T>,
    by_motion: &mut LinkMotion<T>,
    by_axis: &mut Wrench<T>,
) {
    let body = inertia(weights);
    let (angular_velocity, angular_acceleration, proper) =
        (motion.velocity, motion.acceleration, motion.proper);
    let (s, l) = (axis.angular, axis.linear);
    let moment = body.first_moment;
    let momentum = body.inertia.times(angular_velocity);
    by_axis.force += proper.scaled(body.mass)
        + angular_acceleration.cross(moment)
        + angular_velocity.cross(angular_velocity.cross(moment));
    by_axis.moment += body.inertia.times(angular_acceleration)
        + angular_velocity.cross(momentum)
        + moment.cross(proper);
    by_motion.proper += l.scaled(body.mass) + s.cross(moment);
    by_motion.acceleration += moment.cross(l) + body.inertia.times(s);
    by_motion.velocity += centripetal(angular_velocity, moment, l)
        + momentum.cross(s)
        + body.inertia.times(s.cross(angular_velocity));
}

/// The weights of Y = Mᵀ·Y_axes are M·W over the axes; the gradients by positions are projected like torques.
fn projected_gradient<T: Real>(
    chain: &Chain<T>,
    states: [&[T]; 3],
    weights: &[T],
    outs: [&mut [T]; 3],
) -> Result<(), MultibodyError> {
    let (n, all, width) = (
        chain.joint_count(),
        chain.link_count(),
        chain.parameter_count(),
    );
    chain.on_axes(states, |axes, [q, qd, qdd]| {
        check("weights", n * width, weights.len())?;
        for (argument, out) in ["by_q", "by_qd", "by_qdd"].into_iter().zip(&outs) {
            check(argument, n, out.len())?;
        }
        let mut wide = [T::ZERO; REGRESSOR];
        let wide = &mut wide[..all * width];
        chain.weights(weights, wide);
        let [mut by_q, mut by_qd, mut by_qdd] = [[T::ZERO; MAX_JOINTS]; 3];
        regressor_gradient(
            axes,
            q,
            qd,
            qdd,
            wide,
            &mut by_q[..all],
            &mut by_qd[..all],
            &mut by_qdd[..all],
        )?;
        for (own, out) in [by_q, by_qd, by_qdd].iter().zip(outs) {
            chain.project(&own[..all], out);
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::dual::Dual;
    use crate::lanes::Lanes;
    use crate::multibody::differential_regressor;
    use crate::multibody::samples::Sample;
    use std::vec;
    use std::vec::Vec;

    /// Weights without order, so that no two entries can be exchanged.
    fn weights(count: usize) -> Vec<f64> {
        (0..count)
            .map(|k| libm::sin(1.0 + 12.9898 * k as f64) * 3.0)
            .collect()
    }

    #[test]
    fn it_is_the_derivative_by_dual_numbers() {
        type D = Dual<f64, 1>;
        for seed in 0..60 {
            let n = 1 + seed as usize % 9;
            let s = Sample::random(n, seed);
            let w = weights(n * n * COLUMNS);
            let mut found = [vec![f64::NAN; n], vec![f64::NAN; n], vec![f64::NAN; n]];
            let [by_q, by_qd, by_qdd] = &mut found;
            regressor_gradient(&s.chain(), &s.q, &s.qd, &s.qdd, &w, by_q, by_qd, by_qdd).unwrap();
            let chain = Chain::<D>::new(&s.geometry, s.gravity).unwrap();
            let mut out = vec![D::default(); w.len()];
            for order in 0..3 {
                for k in 0..n {
                    let mut state = [&s.q, &s.qd, &s.qdd]
                        .map(|v| v.iter().map(|x| D::constant(*x)).collect::<Vec<_>>());
                    state[order][k] = D::variable(state[order][k].value, 0);
                    let [q, qd, qdd] = &state;
                    differential_regressor(&chain, q, qd, qdd, &mut out).unwrap();
                    let [expected, scale] =
                        w.iter().zip(&out).fold([0.0, 1.0], |[sum, size], (w, y)| {
                            let term = w * y.derivative[0];
                            [sum + term, size + term.abs()]
                        });
                    let difference = (found[order][k] - expected).abs();
                    assert!(
                        difference < 1e-12 * scale,
                        "{seed} {order} {k}: {difference:e}"
                    );
                }
            }
        }
    }

    #[test]
    fn lanes_give_what_single_samples_give() {
        let samples: [Sample; 4] = core::array::from_fn(|k| {
            let mut s = Sample::random(5, 7);
            s.q.iter_mut().for_each(|q| *q += k as f64);
            s.qd.iter_mut().for_each(|q| *q -= 0.3 * k as f64);
            s
        });
        let side = |pick: fn(&Sample) -> &Vec<f64>| {
            (0..5)
                .map(|j| Lanes::<4>(core::array::from_fn(|k| pick(&samples[k])[j])))
                .collect::<Vec<_>>()
        };
        let w = weights(5 * 5 * COLUMNS);
        let wide: Vec<_> = w.iter().map(|w| Lanes::splat(*w)).collect();
        let chain = Chain::<Lanes<4>>::new(&samples[0].geometry, samples[0].gravity).unwrap();
        let mut a = [(); 3].map(|()| vec![Lanes::splat(f64::NAN); 5]);
        let [by_q, by_qd, by_qdd] = &mut a;
        let (q, qd, qdd) = (side(|s| &s.q), side(|s| &s.qd), side(|s| &s.qdd));
        regressor_gradient(&chain, &q, &qd, &qdd, &wide, by_q, by_qd, by_qdd).unwrap();
        for (k, s) in samples.iter().enumerate() {
            let mut b = [(); 3].map(|()| vec![f64::NAN; 5]);
            let [by_q, by_qd, by_qdd] = &mut b;
            regressor_gradient(&s.chain(), &s.q, &s.qd, &s.qdd, &w, by_q, by_qd, by_qdd).unwrap();
            for order in 0..3 {
                for j in 0..5 {
                    let (wide, one) = (a[order][j].0[k], b[order][j]);
                    assert!(
                        (wide - one).abs() < 1e-10 * (1.0 + one.abs()),
                        "{wide} {one}"
                    );
                }
            }
        }
    }
}
