//! A covariance matrix as P = U·D·Uᵀ, U unit upper triangular, D diagonal and positive.
//!
//! Rounding cannot destroy its symmetry or positive definiteness. This makes recursive least squares in `f32` safe for
//! days. Sources: Bierman (1977), "Factorization Methods for Discrete Sequential Estimation", ch. V (measurement
//! update, rank-one decrease) and ch. III (Agee & Turner 1972, rank-one increase).

use crate::scalar::Real;

/// The factors of an N×N covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UdFactor<T, const N: usize> {
    u: [[T; N]; N],
    d: [T; N],
}

impl<T: Real<Mask = bool>, const N: usize> UdFactor<T, N> {
    /// Returns the diagonal covariance with these variances.
    pub fn diagonal(variance: [T; N]) -> Self {
        let mut u = [[T::ZERO; N]; N];
        for i in 0..N {
            u[i][i] = T::ONE;
        }
        Self { u, d: variance }
    }

    /// Returns (P·φ, φᵀ·P·φ). Cost: N(N−1) + 2N products.
    #[inline]
    pub fn multiply(&self, phi: &[T; N]) -> ([T; N], T) {
        let mut product = [T::ZERO; N];
        let mut leverage = T::ZERO;
        for j in 0..N {
            let mut f = phi[j];
            for i in 0..j {
                f += self.u[i][j] * phi[i];
            }
            let g = self.d[j] * f;
            leverage += f * g;
            for i in 0..j {
                product[i] += self.u[i][j] * g;
            }
            product[j] = g;
        }
        (product, leverage)
    }

    /// P ← P − P·φ·φᵀ·P/(r + φᵀPφ) for r > 0 (Bierman's update); D stays at or above `floor`.
    /// Cost: about 1.5·N² products and 2N divisions.
    #[inline]
    pub fn decrease(&mut self, phi: &[T; N], r: T, floor: T) {
        let mut b = [T::ZERO; N];
        let mut alpha = r;
        for j in 0..N {
            let mut f = phi[j];
            for i in 0..j {
                f += self.u[i][j] * phi[i];
            }
            let g = self.d[j] * f;
            let next = alpha + f * g;
            let p = -f / alpha;
            self.d[j] = (self.d[j] * alpha / next).max(floor);
            for i in 0..j {
                let u = self.u[i][j];
                self.u[i][j] = u + b[i] * p;
                b[i] += u * g;
            }
            b[j] = g;
            alpha = next;
        }
    }

    /// P ← P + c·a·aᵀ for c ≥ 0 (Agee–Turner). Cost: about N² products and N divisions.
    #[inline]
    pub fn increase(&mut self, mut a: [T; N], mut c: T) {
        for j in (0..N).rev() {
            let s = a[j];
            let old = self.d[j];
            let new = old + c * s * s;
            let beta = c * s / new;
            for i in 0..j {
                a[i] -= s * self.u[i][j];
                self.u[i][j] += beta * a[i];
            }
            c *= old / new;
            self.d[j] = new;
        }
    }

    /// Returns the variances P_ii.
    #[inline]
    pub fn variances(&self) -> [T; N] {
        let mut out = self.d;
        for i in 0..N {
            for j in i + 1..N {
                out[i] += self.u[i][j] * self.u[i][j] * self.d[j];
            }
        }
        out
    }

    /// Returns the whole matrix.
    pub fn matrix(&self) -> [[T; N]; N] {
        let mut out = [[T::ZERO; N]; N];
        for i in 0..N {
            for k in 0..N {
                for j in i.max(k)..N {
                    out[i][k] += self.u[i][j] * self.d[j] * self.u[k][j];
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn updates_are_the_matrix_identities() {
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        let mut p = UdFactor::<f64, 4>::diagonal([1.0, 2.0, 0.5, 4.0]);
        for k in 0..200 {
            let a: [f64; 4] = core::array::from_fn(|_| rng.random_range(-1.0..1.0));
            let before = p.matrix();
            let (pa, z) = p.multiply(&a);
            let (sign, scale) = if k % 2 == 0 {
                let r = rng.random_range(0.1..3.0);
                p.decrease(&a, r, 0.0);
                (pa, -1.0 / (r + z))
            } else {
                let c = rng.random_range(0.0..0.5);
                p.increase(a, c);
                (a, c)
            };
            let after = p.matrix();
            let variances = p.variances();
            for i in 0..4 {
                let own: f64 = (0..4).map(|j| before[i][j] * a[j]).sum();
                assert!((own - pa[i]).abs() < 1e-12);
                assert!((variances[i] - after[i][i]).abs() < 1e-12);
                for j in 0..4 {
                    let expected = before[i][j] + scale * sign[i] * sign[j];
                    assert!((after[i][j] - expected).abs() < 1e-11, "{k} {i} {j}");
                }
            }
        }
    }
}
