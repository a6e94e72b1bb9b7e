//! Physically consistent parameters: every link is a possible body, friction and drive inertia are not negative.
//!
//! The convex problem
//!
//!   min ½‖R·K·π − z‖² + Σ pullᵢ·D(Jᵢ(π)‖Jᵢ⁰) + Σ pullⱼ·(πⱼ/πⱼ⁰ − ln(πⱼ/πⱼ⁰) − 1),
//!
//! with R and z the triangular factor of the data in units of its own noise, K the grouping, D the divergence of
//! [`super::pseudo_inertia`]. D is the barrier of the linear matrix inequalities Jᵢ ≻ 0. It is centred on a prior,
//! which decides what the data do not identify (Wensing, Kim & Slotine 2018; Lee, Wensing & Park 2020). Newton's method
//! solves it along the path of a falling multiple of the pulls (Nesterov & Nemirovskii 1994; Boyd & Vandenberghe 2004,
//! ch. 11), in coordinates in which the data's part is diagonal. The pull costs at most its own size, a few units of
//! noise.
//!
//! Limits: does not use that rotor inertia seen at several joints comes from one rotor; no bounds on the centre of
//! mass.

use nalgebra::{Cholesky, DMatrix, DVector};
use rig_numerics::svd::Svd;

use super::prior::{Prior, Rule};
use super::pseudo_inertia::INERTIAL;
use super::quadratic::Quadratic;
use crate::error::IdentifyError;

/// Factor on the pulls from one stage of the path to the next.
const STAGE: f64 = 0.1;
/// Largest number of Newton steps over all stages.
const MOST_STEPS: usize = 500;
/// Squared Newton decrement that ends a stage: for stages before the last, and for the last.
const SETTLED: [f64; 2] = [1e-2, 1e-13];
/// Decrease of the squares below which a stage also ends; smaller ones are rounding errors.
const NOTHING_TO_GAIN: f64 = 1e-11;
/// Number of consecutive steps without a larger decrease after which a stage ends: rounding moves the point.
const MOST_STANDING: usize = 4;
/// Relative additions to the diagonal of a Hessian, tried in this order.
const ROUNDING: [f64; 5] = [0.0, 1e-14, 1e-12, 1e-10, 1e-8];
/// Pull of an offset towards its prior; matters only if the data do not identify the offset.
const OFFSET_PULL: f64 = 1e-6;

/// The minimum.
#[derive(Clone, Debug)]
pub(crate) struct Consistent {
    /// Standard parameters.
    pub parameters: Vec<f64>,
    /// ‖R·K·π − z‖².
    pub squares: f64,
    /// W with W·Wᵀ the covariance of the prior's values: the inverse of the Hessians of data and [`believed`].
    pub spread: DMatrix<f64>,
    /// Newton steps.
    pub steps: usize,
}

/// Coordinates c with π = lift·c in which the data's Hessian is diagonal.
struct Coordinates {
    lift: DMatrix<f64>,
    singular: DVector<f64>,
    target: DVector<f64>,
}

impl Coordinates {
    fn new(data: &Quadratic, prior: &Prior) -> Self {
        let m = prior.centre.len();
        let rows = data.matrix.nrows().min(m);
        let mut square = DMatrix::zeros(m, m);
        square
            .view_mut((0, 0), (rows, m))
            .copy_from(&data.matrix.rows(0, rows));
        for (c, mut column) in square.column_iter_mut().enumerate() {
            column *= prior.scale[c];
        }
        let svd = Svd::of(square);
        let mut right = DVector::zeros(m);
        right.rows_mut(0, rows).copy_from(&data.right.rows(0, rows));
        let mut lift = svd.v_t.transpose();
        for (c, mut row) in lift.row_iter_mut().enumerate() {
            row *= prior.scale[c];
        }
        Self {
            target: svd.u.transpose() * right,
            singular: svd.singular_values,
            lift,
        }
    }

    /// Returns c for π.
    fn lower(&self, pi: &[f64], scale: &[f64]) -> DVector<f64> {
        let scaled = DVector::from_fn(pi.len(), |k, _| pi[k] / (scale[k] * scale[k]));
        self.lift.transpose() * scaled
    }

    fn misfit(&self, c: &DVector<f64>) -> DVector<f64> {
        self.singular.component_mul(c) - &self.target
    }

    /// Returns the Hessian of the data and of pulls whose own Hessian times `lift` is `strength` times `bent`.
    fn hessian(&self, bent: &DMatrix<f64>, strength: f64) -> DMatrix<f64> {
        let mut sum = self.lift.tr_mul(bent) * strength;
        for (k, singular) in self.singular.iter().enumerate() {
            sum[(k, k)] += singular.powi(2);
        }
        sum
    }
}

/// Returns the pulls' value at π; `None` outside the cone.
fn barrier(prior: &Prior, pi: &[f64]) -> Option<f64> {
    let mut sum = 0.0;
    for (c, rule) in prior.rules.iter().enumerate() {
        let (x, x0, pull) = (pi[c], prior.centre[c], prior.pull(c));
        sum += match rule {
            Rule::Inertial(0) => {
                let body = prior.bodies.get(c / rig_shared::multibody::COLUMNS)?;
                pull * body.value(&pi[c..c + INERTIAL])?
            }
            Rule::Inertial(_) => 0.0,
            Rule::NotNegative if x > 0.0 => pull * (x / x0 - (x / x0).ln() - 1.0),
            Rule::NotNegative => return None,
            Rule::Free => 0.5 * OFFSET_PULL * ((x - x0) / prior.scale[c]).powi(2),
        };
    }
    sum.is_finite().then_some(sum)
}

/// Returns the gradient of the pulls and their Hessian times `lift`.
fn slopes(prior: &Prior, pi: &[f64], lift: &DMatrix<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let m = pi.len();
    let mut gradient = DVector::zeros(m);
    let mut bent = DMatrix::zeros(m, m);
    for (c, rule) in prior.rules.iter().enumerate() {
        let (x, x0, pull) = (pi[c], prior.centre[c], prior.pull(c));
        match rule {
            Rule::Inertial(0) => {
                let body = prior.bodies.get(c / rig_shared::multibody::COLUMNS)?;
                let (g, h) = body.derivatives(&pi[c..c + INERTIAL])?;
                for k in 0..INERTIAL {
                    gradient[c + k] = pull * g[k];
                }
                let h = DMatrix::from_fn(INERTIAL, INERTIAL, |r, s| pull * h[(r, s)]);
                bent.rows_mut(c, INERTIAL)
                    .copy_from(&(h * lift.rows(c, INERTIAL)));
            }
            Rule::Inertial(_) => {}
            Rule::NotNegative => {
                gradient[c] = pull * (1.0 / x0 - 1.0 / x);
                bent.row_mut(c).copy_from(&(lift.row(c) * (pull / (x * x))));
            }
            Rule::Free => {
                let bend = OFFSET_PULL / prior.scale[c].powi(2);
                gradient[c] = bend * (x - x0);
                bent.row_mut(c).copy_from(&(lift.row(c) * bend));
            }
        }
    }
    Some((gradient, bent))
}

/// Returns the prior's Hessian, times `lift`, as used for the covariance. At the edge of the cone the pulls' own
/// Hessian is unbounded, which says nothing about the uncertainty. Bodies are taken at the mean of prior and solution,
/// friction and drive inertia at the prior; unknown values get [`OFFSET_PULL`] only.
fn believed(prior: &Prior, pi: &[f64], lift: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let mut bent = DMatrix::zeros(pi.len(), pi.len());
    for (c, rule) in prior.rules.iter().enumerate() {
        let pull = prior.pull(c);
        let bend = match rule {
            Rule::Inertial(0) => {
                let body = prior.bodies.get(c / rig_shared::multibody::COLUMNS)?;
                let both: Vec<f64> = (c..c + INERTIAL).map(|k| pi[k] + prior.centre[k]).collect();
                let (_, h) = body.derivatives(&both)?;
                // At twice the argument the Hessian is a quarter.
                let h = DMatrix::from_fn(INERTIAL, INERTIAL, |r, s| 4.0 * pull * h[(r, s)]);
                bent.rows_mut(c, INERTIAL)
                    .copy_from(&(h * lift.rows(c, INERTIAL)));
                continue;
            }
            Rule::Inertial(_) => continue,
            Rule::NotNegative if prior.uncertainty[c].is_finite() => pull / prior.centre[c].powi(2),
            Rule::NotNegative | Rule::Free => OFFSET_PULL / prior.size[c].powi(2),
        };
        bent.row_mut(c).copy_from(&(lift.row(c) * bend));
    }
    Some(bent)
}

/// Returns the Cholesky factor after scaling the diagonal to one, and the scales.
pub(crate) fn scaled_cholesky(
    mut h: DMatrix<f64>,
) -> Option<(Cholesky<f64, nalgebra::Dyn>, DVector<f64>)> {
    let m = h.nrows();
    let scale = DVector::from_fn(m, |k, _| 1.0 / h[(k, k)].sqrt());
    for c in 0..m {
        for r in 0..m {
            h[(r, c)] *= scale[r] * scale[c];
        }
    }
    Some((h.cholesky()?, scale))
}

/// [`scaled_cholesky`] of a matrix that is positive definite apart from rounding errors near the edge of the cone. Adds
/// the smallest of [`ROUNDING`] that makes it so.
fn steadied(
    h: &DMatrix<f64>,
) -> Result<(Cholesky<f64, nalgebra::Dyn>, DVector<f64>), IdentifyError> {
    let diagonal = h.diagonal();
    ROUNDING
        .iter()
        .find_map(|share| {
            let mut more = h.clone();
            more.set_diagonal(&(&diagonal * (1.0 + share)));
            scaled_cholesky(more)
        })
        .ok_or_else(broken)
}

fn broken() -> IdentifyError {
    IdentifyError::Inconsistent {
        why: "rounding hides the way".into(),
    }
}

fn not_settled() -> IdentifyError {
    IdentifyError::Inconsistent {
        why: format!("{MOST_STEPS} Newton steps did not settle it"),
    }
}

/// Solves the problem.
///
/// # Errors
/// [`IdentifyError::Inconsistent`].
pub(crate) fn consistent(data: &Quadratic, prior: &Prior) -> Result<Consistent, IdentifyError> {
    let own = Quadratic {
        matrix: prior.own(&data.matrix),
        right: data.right.clone(),
    };
    let space = Coordinates::new(&own, prior);
    let mut pi = DVector::from_column_slice(&prior.centre);
    let mut c = space.lower(&prior.centre, &prior.scale);
    let value = |c: &DVector<f64>, pi: &DVector<f64>, strength: f64| {
        Some(0.5 * space.misfit(c).norm_squared() + strength * barrier(prior, pi.as_slice())?)
    };
    // Strong enough for a short first Newton step.
    let first = {
        let (_, bent) = slopes(prior, pi.as_slice(), &space.lift).ok_or_else(broken)?;
        let (cholesky, scale) = steadied(&(space.lift.transpose() * bent))?;
        let gradient = space
            .singular
            .component_mul(&space.misfit(&c))
            .component_mul(&scale);
        2.0 * gradient.dot(&cholesky.solve(&gradient)).max(0.0).sqrt()
    };
    let mut strength = first.max(prior.strength);
    let mut standing = 0;
    for steps in 0..MOST_STEPS {
        let (slope, bent) = slopes(prior, pi.as_slice(), &space.lift).ok_or_else(broken)?;
        let gradient = space.singular.component_mul(&space.misfit(&c))
            + space.lift.transpose() * slope * strength;
        let (cholesky, scale) = steadied(&space.hessian(&bent, strength))?;
        let step = -cholesky
            .solve(&gradient.component_mul(&scale))
            .component_mul(&scale);
        let decrement = -gradient.dot(&step) / strength;
        let before = value(&c, &pi, strength).ok_or_else(broken)?;
        let mut length = 1.0;
        let mut moved = false;
        while length > 1e-10 {
            let next_c = &c + length * &step;
            let next_pi = &space.lift * &next_c;
            // Close to the minimum rounding hides the descent; a full step is correct there.
            let least =
                before - 1e-4 * length * decrement * strength + 1e-12 * (before.abs() + strength);
            if value(&next_c, &next_pi, strength).is_some_and(|v| v <= least) {
                (c, pi) = (next_c, next_pi);
                moved = true;
                break;
            }
            length *= 0.5;
        }
        let last = strength <= prior.strength;
        let nothing = decrement * strength <= NOTHING_TO_GAIN * (1.0 + before.abs());
        let after = value(&c, &pi, strength).ok_or_else(broken)?;
        let gained = before - after > NOTHING_TO_GAIN * (1.0 + before.abs());
        standing = if gained { 0 } else { standing + 1 };
        let stands = standing >= MOST_STANDING;
        if decrement <= SETTLED[usize::from(last)] || nothing || !moved || stands {
            standing = 0;
            if last {
                let bent = believed(prior, pi.as_slice(), &space.lift).ok_or_else(broken)?;
                // L·Lᵀ = S·H·S: H⁻¹ = S·L⁻ᵀ·L⁻¹·S.
                let (cholesky, scale) = steadied(&space.hessian(&bent, prior.strength))?;
                let mut whiten = DMatrix::from_diagonal(&scale);
                if !cholesky.l_dirty().solve_lower_triangular_mut(&mut whiten) {
                    return Err(broken());
                }
                for c in prior.nothing_of_its_own(&own.matrix) {
                    pi[c] = 0.0;
                }
                return Ok(Consistent {
                    squares: space.misfit(&c).norm_squared(),
                    spread: &space.lift * whiten.transpose(),
                    parameters: prior.standard(&pi),
                    steps: steps + 1,
                });
            }
            strength = (strength * STAGE).max(prior.strength);
        }
    }
    Err(not_settled())
}
