//! Laws of friction over speed, fitted to the points, and the choice between them.

use nalgebra::{DMatrix, DVector};

use super::map::{FrictionFit, FrictionPoint};
use crate::uncertainty::estimate::{f_p_value, t_quantile};

/// p-value below which the Stribeck term is accepted. Its velocity exists only if the term does, so the F distribution
/// is too optimistic (Davies 1977); a thousandth allows for that.
pub(super) const WARRANT: f64 = 1e-3;
/// Smallest number of points for a comparison of both laws: the larger one has five parameters.
const FEWEST: usize = 7;
/// Number of trial Stribeck velocities, evenly spaced in their logarithm.
const GRID: usize = 60;
/// Highest trial velocity as a share of the fastest pass. Above it the term is a parabola over all speeds, collinear
/// with viscous and Coulomb friction.
const HIGHEST: f64 = 0.5;
/// Number of halvings of the interval that contains the common variance.
const HALVINGS: usize = 60;

/// Fitted laws and the choice between them.
pub(super) struct Decision {
    pub simple: FrictionFit,
    pub stribeck: Option<FrictionFit>,
    pub profile: Vec<[f64; 2]>,
    pub p_value: Option<f64>,
    pub warranted: bool,
    /// Standard deviation between points beyond their own, N·m or N.
    pub scatter: f64,
}

/// Fits both laws and decides between them; none if all points have the same speed.
///
/// The points' own standard deviations contain the noise within a pass but not errors between passes: gravity errors
/// over the sweep's range, cogging, friction that depends on position. One common variance is added to all points. It
/// makes the larger law's residual match the points' deviations (Paule & Mandel 1982). A noisy slow pass then has less
/// weight but is not removed.
pub(super) fn decide(points: &[FrictionPoint]) -> Option<Decision> {
    let speeds = points.iter().map(|p| p.speed.abs());
    let (slow, fast) = speeds.fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    let highest = HIGHEST * fast;
    let grid: Vec<f64> = if points.len() >= FEWEST && slow < highest {
        (0..=GRID)
            .map(|k| slow * (highest / slow).powf(k as f64 / GRID as f64))
            .collect()
    } else {
        Vec::new()
    };
    let scatter = scatter(points, &grid);
    let weights = weights(points, scatter);
    let simple = fit(points, &weights, None)?;
    let (best, profile) = best(points, &weights, &grid);
    let freedom = points.len() as f64 - 5.0;
    let p_value = best.as_ref().and_then(|b| {
        let f = ((simple.squares - b.squares) / 2.0) / (b.squares / freedom).max(f64::MIN_POSITIVE);
        f_p_value(f, [2.0, freedom])
    });
    let warranted = match (&best, p_value) {
        (Some(b), Some(p)) => {
            let known = b
                .half_interval
                .get(2)
                .is_some_and(|h| b.breakaway_excess > *h);
            p < WARRANT && known && b.leave_one_out_rms < simple.leave_one_out_rms
        }
        _ => false,
    };
    Some(Decision {
        simple,
        stribeck: best,
        profile,
        p_value,
        warranted,
        scatter,
    })
}

/// Returns one over the standard deviation of each point with `scatter` added.
fn weights(points: &[FrictionPoint], scatter: f64) -> Vec<f64> {
    points
        .iter()
        .map(|p| 1.0 / p.std.hypot(scatter).max(f64::MIN_POSITIVE.sqrt()))
        .collect()
}

/// Returns the fit with the best Stribeck velocity, and the sum of squares for all trial velocities.
fn best(
    points: &[FrictionPoint],
    weights: &[f64],
    grid: &[f64],
) -> (Option<FrictionFit>, Vec<[f64; 2]>) {
    let mut best: Option<FrictionFit> = None;
    let mut profile = Vec::new();
    for vs in grid {
        let Some(candidate) = fit(points, weights, Some(*vs)) else {
            continue;
        };
        profile.push([*vs, candidate.squares]);
        if best.as_ref().is_none_or(|b| candidate.squares < b.squares) {
            best = Some(candidate);
        }
    }
    (best, profile)
}

/// Returns the standard deviation that, added to every point's own, makes the larger law's sum of squares equal to its
/// degrees of freedom; 0 if the points' own suffice.
fn scatter(points: &[FrictionPoint], grid: &[f64]) -> f64 {
    let law = if grid.is_empty() { 3 } else { 5 };
    let freedom = points.len().saturating_sub(law).max(1) as f64;
    let squares = |scatter: f64| {
        let weights = weights(points, scatter);
        let simple = fit(points, &weights, None).map_or(0.0, |f| f.squares);
        best(points, &weights, grid)
            .0
            .map_or(simple, |b| b.squares.min(simple))
    };
    if squares(0.0) <= freedom {
        return 0.0;
    }
    let largest = points.iter().map(|p| p.friction.abs()).fold(0.0, f64::max);
    let (mut low, mut high) = (0.0, largest);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if squares(middle) > freedom {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Fits a law with a constant by least squares; none if its columns are collinear.
fn fit(points: &[FrictionPoint], weights: &[f64], vs: Option<f64>) -> Option<FrictionFit> {
    let columns = if vs.is_some() { 4 } else { 3 };
    let law = |v: f64, c: usize| match (c, vs) {
        (0, _) => v.signum(),
        (1, _) => v,
        (2, Some(vs)) => v.signum() * (-(v / vs).powi(2)).exp(),
        _ => 1.0,
    };
    let n = points.len();
    let a = DMatrix::from_fn(n, columns, |i, c| weights[i] * law(points[i].speed, c));
    let y = DVector::from_fn(n, |i, _| weights[i] * points[i].friction);
    let qr = a.clone().qr();
    let inverse = qr.r().try_inverse()?;
    if !inverse.iter().all(|v| v.is_finite()) {
        return None;
    }
    let x = &inverse * (qr.q().transpose() * &y);
    let residual = &y - &a * &x;
    let squares = residual.norm_squared();
    // Leave-one-out error by the leverage: e/(1 − h).
    let q = qr.q();
    let left_out: f64 = (0..n)
        .map(|i| {
            let h = q.row(i).norm_squared().min(1.0 - 1e-9);
            (residual[i] / ((1.0 - h) * weights[i])).powi(2)
        })
        .sum();
    let freedom = n.saturating_sub(columns + usize::from(vs.is_some())).max(1);
    // At least one, the points' own standard deviation.
    let sigma = (squares / freedom as f64).max(1.0).sqrt();
    let quantile = t_quantile(freedom as f64);
    let half = |c: usize| quantile * sigma * inverse.row(c).norm();
    Some(FrictionFit {
        coulomb: x[0],
        viscous: x[1],
        breakaway_excess: if vs.is_some() { x[2] } else { 0.0 },
        offset: x[columns - 1],
        stribeck_velocity: vs,
        half_interval: (0..columns - 1).map(half).collect(),
        squares,
        leave_one_out_rms: (left_out / n as f64).sqrt(),
    })
}
