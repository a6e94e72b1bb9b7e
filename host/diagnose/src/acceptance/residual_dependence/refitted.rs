//! Components that a refit removes from a residual. After a refit, the noise has no part along the model's own columns.
//! A test that ignores this finds nothing (estimated parameters in a marked empirical process: Stute, González Manteiga
//! & Presedo Quindimil 1998, J. Am. Stat. Assoc. 93).
//!
//! Limit: each joint counts as refitted separately, also if joints share base parameters.

use crate::acceptance::residual_dependence::process::BINS;
use crate::rows::regression::Rows;
use rig_numerics::vector::dot_in_order;

/// Smallest part of a column orthogonal to those before it, as a share of its length.
const OWN: f64 = 1e-6;

/// Orthonormal basis of one joint's nominal columns.
pub(crate) struct Refitted(Vec<Vec<f64>>);

impl Refitted {
    /// Creates the basis of a joint, with row weights if given.
    pub(crate) fn of(rows: &Rows, counts: Option<&[f64]>, joint: usize) -> Self {
        let keep = &rows.keep[joint];
        let mut basis: Vec<Vec<f64>> = Vec::new();
        for column in rows.nominal.iter().filter_map(|c| c[joint].as_ref()) {
            let mut own: Vec<f64> = (column.iter().zip(keep).enumerate())
                .map(|(k, (x, keep))| match (keep, counts) {
                    (false, _) => 0.0,
                    (true, Some(counts)) => counts[k] * x,
                    (true, None) => *x,
                })
                .collect();
            let whole = dot_in_order(&own, &own);
            // Two passes are enough (Kahan).
            for _ in 0..2 {
                for b in &basis {
                    take(&mut own, b);
                }
            }
            let rest = dot_in_order(&own, &own);
            if rest > OWN * OWN * whole {
                let length = rest.sqrt();
                own.iter_mut().for_each(|x| *x /= length);
                basis.push(own);
            }
        }
        Self(basis)
    }

    /// Creates an empty basis: no refit.
    pub(crate) fn none() -> Self {
        Self(Vec::new())
    }

    /// Returns a residual after the refit.
    pub(crate) fn rest(&self, residual: &[f64]) -> Vec<f64> {
        let mut left = residual.to_vec();
        for b in &self.0 {
            take(&mut left, b);
        }
        left
    }

    /// Returns a residual along each direction, block by block.
    pub(crate) fn along(&self, residual: &[f64], block: &[usize], blocks: usize) -> Vec<Vec<f64>> {
        let mut along = vec![vec![0.0; self.0.len()]; blocks];
        for (d, b) in self.0.iter().enumerate() {
            for ((x, r), block) in b.iter().zip(residual).zip(block) {
                along[*block][d] += x * r;
            }
        }
        along
    }

    /// Returns each direction summed over bins.
    pub(crate) fn in_bins(&self, place: &[Option<usize>]) -> Vec<[f64; BINS]> {
        let of = |b: &Vec<f64>| {
            let mut sums = [0.0; BINS];
            for (x, bin) in b.iter().zip(place) {
                if let Some(bin) = bin {
                    sums[*bin] += x;
                }
            }
            sums
        };
        self.0.iter().map(of).collect()
    }
}

fn take(from: &mut [f64], direction: &[f64]) {
    let along = dot_in_order(from, direction);
    for (x, d) in from.iter_mut().zip(direction) {
        *x -= along * d;
    }
}
