//! Essential parameters: the few that the torque needs, the rest taken as zero.
//!
//! Backward elimination by relative standard deviation (Pham & Gautier 1991; Khalil & Dombre 2002, § 12.4.4): the
//! least certain parameter goes, the others are fitted anew, until none is more than [`RATIO`] times as uncertain as
//! the best known, or until an F-test, rows counted as what they are worth, says that one was needed: of the last
//! parameter alone, and of all that went together (many that were not needed would hide one that was).

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::factor::TriangularFactor;

/// Ratio of the largest to the smallest relative standard deviation at which elimination ends; the literature uses
/// 10 to 30.
const RATIO: f64 = 30.0;
/// p-value of the F-test below which what was taken away was needed.
const NEEDED: f64 = 0.05;

/// One essential parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Essential {
    /// As `base_parameters` prints it.
    pub expression: String,
    /// SI, fitted with the inessential ones at zero.
    pub value: f64,
    /// Residual's memory allowed for.
    pub relative_std_percent: f64,
    /// ASCII
    pub unit: String,
}

/// The essential set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EssentialSet {
    /// In the order of `base_parameters`.
    pub parameters: Vec<Essential>,
    /// Expressions of those taken as zero, in the order of elimination.
    pub left_out: Vec<String>,
    /// By how much the residual's RMS grew, %.
    pub residual_increase_percent: f64,
    /// Why elimination ended, a sentence.
    pub ended: String,
}

struct Fit {
    values: Vec<f64>,
    relative: Vec<f64>,
    squares: f64,
}

/// Eliminates on a factor of weighted rows; `columns` are the identified ones in it, `memory` the rows that the
/// residual remembers. `None` where the fit is singular.
pub(super) fn essential(
    factor: &TriangularFactor,
    columns: &[usize],
    memory: f64,
    names: &[(String, String)],
) -> Option<EssentialSet> {
    let (r, z) = factor.system();
    let rows = factor.rows() as f64 / memory;
    let rest = {
        // What no parameter of the factor explains.
        let solution = r.clone().svd(true, true).solve(&z, 1e-12 * r.norm()).ok()?;
        factor.residual_squares(solution.as_slice()) - (&r * &solution - &z).norm_squared()
    };
    let fit = |active: &[usize]| -> Option<Fit> {
        let pick: Vec<usize> = active.iter().map(|&k| columns[k]).collect();
        let a = r.select_columns(&pick);
        let qr = a.clone().qr();
        let inverse = qr.r().try_inverse()?;
        let values = &inverse * (qr.q().transpose() * &z);
        let squares = (&a * &values - &z).norm_squared() + rest.max(0.0);
        let variance = squares / (factor.rows() as f64 - active.len() as f64).max(1.0) * memory;
        let relative = (0..active.len())
            .map(|k| variance.sqrt() * inverse.row(k).norm() / values[k].abs())
            .collect();
        Some(Fit {
            values: values.as_slice().to_vec(),
            relative,
            squares,
        })
    };
    let mut active: Vec<usize> = (0..columns.len()).collect();
    let first = fit(&active)?;
    let freedom = (rows - columns.len() as f64).max(1.0);
    let mut current = Fit {
        values: first.values.clone(),
        relative: first.relative.clone(),
        squares: first.squares,
    };
    let mut left_out = Vec::new();
    let ended = loop {
        let worst = (0..active.len())
            .max_by(|&a, &b| current.relative[a].total_cmp(&current.relative[b]))?;
        let least = current
            .relative
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min);
        if current.relative[worst] <= RATIO * least {
            break format!(
                "None is more than {RATIO} times as uncertain, relative to its value, as the best known one."
            );
        }
        if active.len() == 1 {
            break "One parameter is left.".to_owned();
        }
        let mut fewer = active.clone();
        let gone = fewer.remove(worst);
        let next = fit(&fewer)?;
        // Where the residual remembers m rows, chance moves the squares m times as far.
        let variance =
            first.squares / (factor.rows() as f64 - columns.len() as f64).max(1.0) * memory;
        let chance = |grown: f64, removed: f64| {
            let f = grown / removed / variance.max(f64::MIN_POSITIVE);
            FisherSnedecor::new(removed, freedom).map_or(1.0, |d| d.sf(f.max(0.0)))
        };
        let removed = (columns.len() - fewer.len()) as f64;
        let p = chance(next.squares - current.squares, 1.0)
            .min(chance(next.squares - first.squares, removed));
        if p < NEEDED {
            break format!(
                "Without {} the residual would grow by more than chance (F-test, p = {p:.1e}).",
                names[gone].0
            );
        }
        left_out.push(names[gone].0.clone());
        (active, current) = (fewer, next);
    };
    Some(EssentialSet {
        parameters: active
            .iter()
            .enumerate()
            .map(|(place, &k)| Essential {
                expression: names[k].0.clone(),
                value: current.values[place],
                relative_std_percent: 100.0 * current.relative[place],
                unit: names[k].1.clone(),
            })
            .collect(),
        left_out,
        residual_increase_percent: 100.0 * ((current.squares / first.squares).sqrt() - 1.0),
        ended,
    })
}
