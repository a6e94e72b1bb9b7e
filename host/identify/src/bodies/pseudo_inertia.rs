//! The pseudo-inertia of a link, and the divergence that keeps it physically consistent.
//!
//! J = [[Σ, h], [hᵀ, m]] with Σ = ½·tr(I)·1 − I the second moments about the frame's origin, h = m·c. The ten inertial
//! parameters belong to a body with some mass distribution exactly if J is positive semidefinite (Wensing, Kim &
//! Slotine 2018). Positive mass and the triangle inequality of the principal moments follow.

use nalgebra::{Matrix4, SMatrix, SVector};

/// The ten parameters m mx my mz Ixx Ixy Ixz Iyy Iyz Izz, inertia about the frame's origin.
pub(crate) const INERTIAL: usize = 10;

/// Returns J for ten inertial parameters.
pub fn pseudo_inertia(p: &[f64]) -> Matrix4<f64> {
    let half = 0.5 * (p[4] + p[7] + p[9]);
    let (xx, yy, zz) = (half - p[4], half - p[7], half - p[9]);
    let (xy, xz, yz) = (-p[5], -p[6], -p[8]);
    Matrix4::new(
        xx, xy, xz, p[1], //
        xy, yy, yz, p[2], //
        xz, yz, zz, p[3], //
        p[1], p[2], p[3], p[0],
    )
}

/// Returns the ten inertial parameters of J.
pub(crate) fn parameters_of(j: &Matrix4<f64>) -> [f64; INERTIAL] {
    let (xx, yy, zz) = (j[(0, 0)], j[(1, 1)], j[(2, 2)]);
    [
        j[(3, 3)],
        j[(0, 3)],
        j[(1, 3)],
        j[(2, 3)],
        yy + zz,
        -j[(0, 1)],
        -j[(0, 2)],
        xx + zz,
        -j[(1, 2)],
        xx + yy,
    ]
}

/// Returns the smallest eigenvalue of J, scaled by the mass and the radius of gyration so that it has no unit. Positive
/// if a body can have these parameters; minus infinity if mass or second moments are not positive.
pub fn least_eigenvalue(p: &[f64]) -> f64 {
    let j = pseudo_inertia(p);
    let (mass, second) = (j[(3, 3)], j[(0, 0)] + j[(1, 1)] + j[(2, 2)]);
    if !(mass > 0.0 && second > 0.0) {
        return f64::NEG_INFINITY;
    }
    let scale = [
        1.0 / second.sqrt(),
        1.0 / second.sqrt(),
        1.0 / second.sqrt(),
        1.0 / mass.sqrt(),
    ];
    Matrix4::from_fn(|r, c| j[(r, c)] * scale[r] * scale[c])
        .symmetric_eigenvalues()
        .min()
}

/// ∂J/∂p_k.
fn direction(k: usize) -> Matrix4<f64> {
    let mut unit = [0.0; INERTIAL];
    unit[k] = 1.0;
    pseudo_inertia(&unit)
}

/// D(J‖J₀) = tr(J₀⁻¹·J) − ln det(J₀⁻¹·J) − 4, the Bregman divergence of −ln det (Lee, Wensing & Park 2020). It is
/// convex in the parameters, zero at the prior, infinite where J stops being positive definite, and independent of
/// frame and units.
#[derive(Clone, Debug)]
pub struct Divergence {
    inverse: Matrix4<f64>,
    log_det: f64,
    linear: [f64; INERTIAL],
    directions: [Matrix4<f64>; INERTIAL],
}

impl Divergence {
    /// Builds it from the prior's ten parameters; `None` if they are not consistent.
    pub fn new(prior: &[f64]) -> Option<Self> {
        if least_eigenvalue(prior) <= 1e-9 {
            return None;
        }
        let cholesky = pseudo_inertia(prior).cholesky()?;
        let inverse = cholesky.inverse();
        let directions: [Matrix4<f64>; INERTIAL] = std::array::from_fn(direction);
        Some(Self {
            linear: std::array::from_fn(|k| (inverse * directions[k]).trace()),
            inverse,
            log_det: log_det(&cholesky.l()),
            directions,
        })
    }

    /// Returns the value at `p`; `None` outside the cone.
    pub fn value(&self, p: &[f64]) -> Option<f64> {
        let j = pseudo_inertia(p);
        let cholesky = j.cholesky()?;
        Some((self.inverse * j).trace() - log_det(&cholesky.l()) + self.log_det - 4.0)
    }

    /// Returns gradient and Hessian at `p`; `None` outside the cone.
    pub fn derivatives(
        &self,
        p: &[f64],
    ) -> Option<(SVector<f64, INERTIAL>, SMatrix<f64, INERTIAL, INERTIAL>)> {
        let inverse = pseudo_inertia(p).cholesky()?.inverse();
        let products: [Matrix4<f64>; INERTIAL] =
            std::array::from_fn(|k| inverse * self.directions[k]);
        let gradient = SVector::from_fn(|k, _| self.linear[k] - products[k].trace());
        let hessian =
            SMatrix::from_fn(|k, l| products[k].component_mul(&products[l].transpose()).sum());
        Some((gradient, hessian))
    }
}

fn log_det(lower: &Matrix4<f64>) -> f64 {
    2.0 * lower.diagonal().iter().map(|d| d.ln()).sum::<f64>()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Point masses: every such body is consistent, and J is Σ m·[r; 1]·[r; 1]ᵀ.
    fn body(seed: u64, points: usize) -> [f64; INERTIAL] {
        let mut g = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut p = [0.0; INERTIAL];
        for _ in 0..points {
            let m = g.random::<f64>();
            let [x, y, z] = [0; 3].map(|_| g.random::<f64>() - 0.3);
            for (to, v) in p.iter_mut().zip([
                1.0,
                x,
                y,
                z,
                y * y + z * z,
                -x * y,
                -x * z,
                x * x + z * z,
                -y * z,
                x * x + y * y,
            ]) {
                *to += m * v;
            }
        }
        p
    }

    #[test]
    fn bodies_of_points_lie_in_the_cone_and_others_do_not() {
        for seed in 0..50 {
            let p = body(seed, 5);
            assert!(least_eigenvalue(&p) > 0.0);
            let back = parameters_of(&pseudo_inertia(&p));
            assert!(p.iter().zip(back).all(|(a, b)| (a - b).abs() < 1e-14));
            // Three points span no volume: on the boundary.
            assert!(least_eigenvalue(&body(seed, 3)).abs() < 1e-12);
            // A principal moment larger than the sum of the other two.
            let mut broken = [0.0; INERTIAL];
            (broken[0], broken[4], broken[7], broken[9]) = (1.0, 0.1, 0.1, 0.21);
            assert!(least_eigenvalue(&broken) < 0.0);
        }
    }

    #[test]
    fn divergence_is_zero_at_the_prior_and_its_derivatives_are_those_of_its_value() {
        let prior = body(1, 6);
        let d = Divergence::new(&prior).unwrap();
        assert!(d.value(&prior).unwrap().abs() < 1e-12);
        let p = body(2, 6);
        assert!(d.value(&p).unwrap() > 0.1);
        let (gradient, hessian) = d.derivatives(&p).unwrap();
        for k in 0..INERTIAL {
            let h = 1e-6;
            let at = |s: f64| {
                let mut moved = p;
                moved[k] += s * h;
                moved
            };
            let slope = (d.value(&at(1.0)).unwrap() - d.value(&at(-1.0)).unwrap()) / (2.0 * h);
            assert!((slope - gradient[k]).abs() < 1e-5 * (1.0 + gradient[k].abs()));
            let (up, down) = (
                d.derivatives(&at(1.0)).unwrap().0,
                d.derivatives(&at(-1.0)).unwrap().0,
            );
            for l in 0..INERTIAL {
                let bend = (up[l] - down[l]) / (2.0 * h);
                assert!((bend - hessian[(k, l)]).abs() < 1e-4 * (1.0 + bend.abs()));
            }
        }
    }
}
