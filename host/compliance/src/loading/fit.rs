//! The springs' regression with gaps as unknowns, and its lack of fit.
//!
//! y = Σ arm_k·(load_k − friction_k·direction_k)/c_k + Σ arm_k·(gap_k/2)·sign(spring_k − zero_k) + offset. The first n columns hold
//! the loads, the next n the directions. The torque zero_k at which the gap is crossed is 0 if the load is known absolutely. With a wrench
//! it rests on the described weight; then it is searched, as a threshold model (Hansen 2000).
//!
//! Lack of fit: successive windows of one group differ by noise only, whatever slow law the line leaves out. Half the mean square of their
//! difference is the variance of the noise (von Neumann 1941); what the residual has beyond it is systematic.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use rig_output::format_significant;

use super::instrument::{Estimate, Regression};
use crate::value::Value;

/// Share of the spring's half range about a gap in which the gap is crossed.
const CROSSING: f64 = 0.1;
/// Standard deviations beyond which a gap is significant.
const GAP_SIGMAS: f64 = 5.0;
/// Fewest windows on either side of a gap.
const SIDE: usize = 5;
/// Fits of gap and friction in turn.
const ITERATIONS: usize = 4;
/// Torques tried as the crossing of a gap.
const ZEROS: usize = 60;
/// Standard deviations of the variance ratio of white noise beyond which a residual is systematic.
const LACK_SIGMAS: f64 = 6.0;
/// Systematic residual over the deflection beyond which a warning tells it. By judgement: what is smaller widens the standard
/// deviations alone.
const TOLD: f64 = 0.03;
/// Student's t of the correlation of instrument and load from which on the instrument shows the load. Noise alone has a standard
/// deviation of one; below about 3 the estimate of a weak instrument has no valid interval (Stock & Yogo 2005).
const STRONG: f64 = 5.0;
/// Reciprocal condition number of the normal matrix below which a direction is left out of the search.
const SINGULAR: f64 = 1e-12;

/// One reading of one window.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// Columns without gaps: n loads times arm, n directions times minus arm, others.
    pub x: Vec<f64>,
    /// The n loads times arm of the neighbours.
    pub z: Vec<f64>,
    pub y: f64,
    pub group: usize,
    /// Reading per twist of each drive.
    pub arms: Vec<f64>,
    /// Torque of each drive by the neighbours, 0 where the spring is free as far as is known. It decides the side of a gap, which
    /// the noise of the window itself must not do.
    pub loads: Vec<f64>,
    /// Torque of each drive by the weight, part of `loads` with the opposite sign.
    pub weight: Vec<f64>,
    pub directions: Vec<f64>,
    /// Number of the window.
    pub window: usize,
    /// Number of the recording.
    pub stretch: usize,
}

/// A significant gap.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gap {
    pub drive: usize,
    /// Torque of the spring, by the description, at which it is crossed.
    pub zero: f64,
}

/// Root mean squares of a regression.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lack {
    /// Of the residual.
    pub residual: f64,
    /// Of the noise by neighbouring windows.
    pub noise: f64,
    /// Of the systematic part of the residual; 0 if it is not significant.
    pub systematic: f64,
    /// Of the reading about its mean in each group.
    pub signal: f64,
}

/// A regression that was solved.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub estimate: Estimate,
    /// Standard deviations with the systematic residual along each regressor.
    pub stds: Vec<f64>,
    pub gaps: Vec<Gap>,
    /// Number of windows, without those that cross a gap.
    pub windows: usize,
    pub lack: Lack,
    /// Friction of each drive, a torque.
    friction: Vec<f64>,
    count: usize,
}

impl Fit {
    /// Column of the gap of a drive, half a gap.
    pub(super) fn gap(&self, drive: usize) -> Option<(Gap, usize)> {
        let place = self.gaps.iter().position(|g| g.drive == drive)?;
        Some((
            self.gaps[place],
            self.estimate.values.len() - self.gaps.len() + place,
        ))
    }

    /// Friction of a drive, a torque.
    pub(super) fn friction(&self, k: usize) -> f64 {
        self.friction[k]
    }

    /// What the regression leaves of the reading of a row.
    pub(super) fn left(&self, row: &Row) -> f64 {
        let values = &self.estimate.values;
        let springs: f64 = row.x.iter().zip(values.iter()).map(|(a, b)| a * b).sum();
        let gaps = self.gaps.iter().zip(&values.as_slice()[row.x.len()..]);
        let gaps = gaps.map(|(gap, half)| {
            let k = gap.drive;
            let spring = row.loads[k] - self.friction[k] * row.directions[k];
            row.arms[k] * (spring - gap.zero).signum() * half
        });
        row.y - springs - gaps.sum::<f64>()
    }

    /// Returns true if the torque of the spring has both signs.
    pub(super) fn reverses(&self, rows: &[Row], k: usize) -> bool {
        sides(&springs(rows, k, &self.friction), 0.0)
    }

    /// A coefficient with the standard deviation that contains the systematic residual.
    pub(super) fn value(&self, column: usize) -> Value {
        Value::new(self.estimate.values[column], self.stds[column])
    }
}

impl Lack {
    /// Returns the residual in words, if its systematic part matters for the readings.
    pub(super) fn told(&self, unit: &str) -> Option<String> {
        (self.systematic > TOLD * self.signal).then(|| self.words(unit))
    }

    /// Returns the residual in words.
    pub(super) fn words(&self, unit: &str) -> String {
        format!(
            "the springs leave {} {unit} (RMS) of {} {unit}, while neighbouring windows differ by a noise of {} {unit}",
            format_significant(self.residual, 3),
            format_significant(self.signal, 3),
            format_significant(self.noise, 2)
        )
    }
}

/// Solves the regression of `count` drives. Gaps are added one after the other while one is significant. `search` tells that the
/// torque at which a gap is crossed is not known. `None` for too few rows.
pub(super) fn fit(rows: &[Row], count: usize, search: bool) -> Option<Fit> {
    let mut best = solve(rows, count, &[], &vec![0.0; count])?;
    best.friction = friction(&best.estimate, count);
    for _ in 0..count {
        let Some(next) = with_gap(rows, &best, search) else {
            break;
        };
        best = next;
    }
    Some(best)
}

/// Solves the regression of other readings with the gaps and the friction that were found. `None` for too few rows.
pub(super) fn refit(rows: &[Row], before: &Fit) -> Option<Fit> {
    let clear = clear(rows, &before.gaps, &before.friction);
    solve(&clear, before.count, &before.gaps, &before.friction)
}

/// Solves the regression of `count` drives without gaps. `None` for too few rows.
pub(super) fn without_gaps(rows: &[Row], count: usize) -> Option<Fit> {
    solve(rows, count, &[], &vec![0.0; count])
}

/// Adds the gap that explains most; `None` if it is not significant.
fn with_gap(rows: &[Row], before: &Fit, search: bool) -> Option<Fit> {
    let count = before.count;
    let others = &before.gaps;
    let mut found: Option<(Fit, Vec<Row>)> = None;
    // The line through both sides of a gap gives a wrong friction: the search starts without friction, too.
    for start in [before.friction.clone(), vec![0.0; count]] {
        let mut friction = start;
        for _ in 0..ITERATIONS {
            let base = Space::of(rows, others, &friction)?;
            let free = (0..count)
                .filter(|k| !before.estimate.hidden[*k] && others.iter().all(|g| g.drive != *k));
            let Some((_, gap)) = free
                .filter_map(|k| base.best(rows, k, &friction, search))
                .max_by(|a, b| a.0.total_cmp(&b.0))
            else {
                break;
            };
            let gaps: Vec<Gap> = others.iter().copied().chain([gap]).collect();
            let clear = clear(rows, &gaps, &friction);
            let Some(next) = solve(&clear, count, &gaps, &friction) else {
                break;
            };
            friction = self::friction(&next.estimate, count);
            if (found.as_ref()).is_none_or(|(f, _)| next.lack.residual < f.lack.residual) {
                found = Some((next, clear));
            }
        }
    }
    let (next, clear) = found?;
    let column = next.estimate.values.len() - 1;
    let significant = next.estimate.values[column] > GAP_SIGMAS * next.estimate.std(column)
        && !next.estimate.hidden[column]
        && next
            .gaps
            .last()
            .is_some_and(|gap| shows(&clear, &next, gap.drive))
        && bends(&clear, &next);
    significant.then_some(next)
}

/// Returns true if the last gap explains the rows better than a stiffness that changes with the torque does.
fn bends(rows: &[Row], next: &Fit) -> bool {
    let (gap, others) = match next.gaps.split_last() {
        Some((gap, others)) => (gap, others),
        None => return false,
    };
    let values = springs(rows, gap.drive, &next.friction);
    let extreme = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let cubic = |i: usize| rows[i].arms[gap.drive] * (values[i] / extreme).powi(3);
    let step = regression(rows, &next.gaps, &next.friction, &|_| None);
    let smooth = regression(rows, others, &next.friction, &|i| Some(cubic(i)));
    match (step.solve(), smooth.solve()) {
        (Some(a), Some(b)) => step.residual(&a) < smooth.residual(&b),
        _ => false,
    }
}

/// Returns true if the rows determine the compliance of drive `k`: the neighbours tell its load apart from all other columns. Where
/// a load has two levels, each with its own direction of the hysteresis, only noise is left of it.
pub(super) fn shows(rows: &[Row], found: &Fit, k: usize) -> bool {
    if found.estimate.hidden[k] {
        return false;
    }
    let [load, instrument] = regression(rows, &found.gaps, &found.friction, &|_| None).apart(k);
    let along = load.dot(&instrument);
    let rest = (load.norm_squared() * instrument.norm_squared() - along * along).max(0.0);
    let freedom = rows.len().saturating_sub(found.estimate.values.len()) as f64;
    along > 0.0 && along * freedom.sqrt() > STRONG * rest.sqrt()
}

fn springs(rows: &[Row], k: usize, friction: &[f64]) -> Vec<f64> {
    (rows.iter())
        .map(|r| r.loads[k] - friction[k] * r.directions[k])
        .collect()
}

fn half_range(values: &[f64]) -> f64 {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    0.5 * (high - low)
}

/// Returns true if enough windows lie clearly on both sides.
fn sides(values: &[f64], zero: f64) -> bool {
    let least = CROSSING * half_range(values);
    let beyond = |side: f64| {
        (values.iter())
            .filter(|v| (*v - zero) * side > least)
            .count()
            >= SIDE
    };
    beyond(1.0) && beyond(-1.0)
}

/// Rows whose windows cross none of the gaps.
fn clear(rows: &[Row], gaps: &[Gap], friction: &[f64]) -> Vec<Row> {
    let mut kept = vec![true; rows.len()];
    for gap in gaps {
        let values = springs(rows, gap.drive, friction);
        let least = CROSSING * half_range(&values);
        for (kept, v) in kept.iter_mut().zip(&values) {
            *kept &= (v - gap.zero).abs() > least;
        }
    }
    (rows.iter().zip(kept))
        .filter(|(_, kept)| *kept)
        .map(|(row, _)| row.clone())
        .collect()
}

fn regression(
    rows: &[Row],
    gaps: &[Gap],
    friction: &[f64],
    more: &dyn Fn(usize) -> Option<f64>,
) -> Regression {
    let mut all = Regression::default();
    for (i, row) in rows.iter().enumerate() {
        let mut x = row.x.clone();
        x.extend(gaps.iter().map(|gap| {
            let spring = row.loads[gap.drive] - friction[gap.drive] * row.directions[gap.drive];
            row.arms[gap.drive] * (spring - gap.zero).signum()
        }));
        x.extend(more(i));
        let mut z = x.clone();
        z[..row.z.len()].copy_from_slice(&row.z);
        all.push(x, z, row.y, row.group, [row.stretch, row.window]);
    }
    all
}

fn solve(rows: &[Row], count: usize, gaps: &[Gap], friction: &[f64]) -> Option<Fit> {
    let regression = regression(rows, gaps, friction, &|_| None);
    let estimate = regression.solve()?;
    let lack = lack(&regression, &estimate);
    let along = regression.along();
    let stds = (0..estimate.values.len())
        .map(|k| estimate.std(k).hypot(lack.systematic * along[k]))
        .collect();
    Some(Fit {
        estimate,
        stds,
        gaps: gaps.to_vec(),
        windows: (rows.iter().map(|r| r.window))
            .collect::<BTreeSet<usize>>()
            .len(),
        lack,
        friction: friction.to_vec(),
        count,
    })
}

/// Friction torques: hysteresis times stiffness; 0 where one of both is not known.
fn friction(found: &Estimate, count: usize) -> Vec<f64> {
    (0..count)
        .map(|k| {
            let known = !found.hidden[k] && !found.hidden[count + k] && found.values[k] > 0.0;
            match known {
                true => found.values[count + k] / found.values[k],
                false => 0.0,
            }
        })
        .collect()
}

/// Compares the residual with the noise by neighbouring windows.
fn lack(regression: &Regression, found: &Estimate) -> Lack {
    let (rows, columns) = (regression.len(), found.values.len());
    let left = regression.residuals(found);
    let (mut pairs, mut squares) = (0usize, 0.0);
    for (a, b) in regression.neighbours() {
        pairs += 1;
        squares += 0.5 * (left[a] - left[b]).powi(2);
    }
    let residual =
        left.iter().map(|e| e * e).sum::<f64>() / (rows.max(columns + 1) - columns) as f64;
    let noise = squares / pairs.max(1) as f64;
    let chance = 1.0 + LACK_SIGMAS * (2.0 / pairs.max(1) as f64).sqrt();
    Lack {
        residual: residual.sqrt(),
        noise: noise.sqrt(),
        systematic: (residual - chance * noise).max(0.0).sqrt(),
        signal: regression.signal(),
    }
}

/// The space of the columns of a regression, and what it leaves of the readings.
struct Space {
    basis: DMatrix<f64>,
    left: DVector<f64>,
}

impl Space {
    fn of(rows: &[Row], gaps: &[Gap], friction: &[f64]) -> Option<Self> {
        let (mut x, y) = regression(rows, gaps, friction, &|_| None).matrices()?;
        for mut column in x.column_iter_mut() {
            let length = column.norm();
            if length > 0.0 {
                column /= length;
            }
        }
        let eigen = SymmetricEigen::new(x.tr_mul(&x));
        let most = eigen.eigenvalues.max();
        let kept: Vec<usize> = (0..x.ncols())
            .filter(|k| eigen.eigenvalues[*k] > SINGULAR * most)
            .collect();
        let turn = DMatrix::from_fn(x.ncols(), kept.len(), |r, c| {
            eigen.eigenvectors[(r, kept[c])] / eigen.eigenvalues[kept[c]].sqrt()
        });
        let basis = x * turn;
        let left = &y - &basis * basis.tr_mul(&y);
        Some(Self { basis, left })
    }

    /// Returns the squares that a gap of drive `k` explains, and the gap.
    fn best(&self, rows: &[Row], k: usize, friction: &[f64], search: bool) -> Option<(f64, Gap)> {
        let values = springs(rows, k, friction);
        let half = half_range(&values);
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let mut zeros = vec![0.0];
        if search {
            zeros.extend((1..ZEROS).map(|i| low + 2.0 * half * i as f64 / ZEROS as f64));
        }
        (zeros.into_iter())
            .filter(|zero| sides(&values, *zero))
            .map(|zero| {
                let step = DVector::from_fn(rows.len(), |i, _| {
                    rows[i].arms[k] * (values[i] - zero).signum()
                });
                let own = &step - &self.basis * self.basis.tr_mul(&step);
                let square = own.norm_squared();
                let gain = match square > 1e-9 * step.norm_squared() {
                    true => own.dot(&self.left).max(0.0).powi(2) / square,
                    false => 0.0,
                };
                (gain, Gap { drive: k, zero })
            })
            .filter(|(gain, _)| *gain > 0.0)
            .max_by(|a, b| a.0.total_cmp(&b.0))
    }
}
