//! Poses that the load by all other poses does not explain, as those with a contact or of a robot that still moved.
//!
//! Such poses may hide one another, so they are not looked for one by one. A fit that half of the poses bear (least trimmed
//! squares, Rousseeuw & Van Driessen 2006) orders all poses by their distance. Those that are farthest, one to half of all,
//! are left out if the residual falls by more than chance has it (F test for deleted observations, Cook & Weisberg 1982,
//! corrected for all sets of as many poses). At rest forces and moments are apart: the forces show the mass, the moments the
//! first moments.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand::seq::index::sample;
use rand_pcg::Pcg64;
use rig_data::WRENCH_COLUMNS;
use rig_identify::f_p_value;
use rig_numerics::svd::Svd;
use rig_output::{format_significant, listed};
use statrs::function::factorial::ln_binomial;

use crate::statistics::Recorded;
use crate::system::{Fit, Sensed};

/// Probability by chance, of all sets together, below which poses are no readings of the load.
const BY_CHANCE: f64 = 1e-4;
/// Relative singular value below which a column is none.
const ROUNDING: f64 = 1e-9;
/// Smallest eigenvalue of what a set of poses leaves to the others, from which these predict it.
const PREDICTED: f64 = 1e-6;
/// Drawn subsets from which a fit of half of the poses begins. If 3 of 10 poses are odd, a third of the subsets of three
/// poses has none of them.
const STARTS: usize = 200;
/// Most steps of a fit of half of the poses. Each leaves less; most end after three.
const STEPS: usize = 20;

/// Poses of a recording that are left out.
pub(crate) struct OddPoses {
    /// Index of the recording.
    pub recording: usize,
    /// Their numbers among its poses.
    pub poses: Vec<usize>,
    /// Probability by chance, of all sets together.
    chance: f64,
    /// What they read, and what the load by the others gives.
    pub text: String,
}

/// Finds the poses that fit the load by the others least, if this is no chance.
pub(crate) fn odd_poses(sensed: &Sensed, fit: &Fit) -> Option<OddPoses> {
    let all = sensed.recordings.iter().enumerate();
    let listed = all.filter(|(_, recorded)| recorded.poses && recorded.is_sampled());
    let found = listed.filter_map(|(recording, recorded)| {
        let equations = [0, 3].map(|first| Equations::of(sensed, fit, recording, first));
        let count = recorded.sample.len();
        let sets = equations.iter().flat_map(|own| own.farthest(count));
        let judged = sets.filter_map(|poses| Some((chance(&equations, &poses, count)?, poses)));
        let (chance, mut poses) = judged.min_by(|a, b| a.0.total_cmp(&b.0))?;
        poses.sort_unstable();
        Some(OddPoses {
            text: told(recorded, &poses, &equations),
            recording,
            poses,
            chance,
        })
    });
    let least = found.min_by(|a, b| a.chance.total_cmp(&b.chance))?;
    (least.chance < BY_CHANCE).then_some(least)
}

/// Returns the probability by chance that any set of as many poses is predicted as badly by the others; `None` if these
/// cannot predict it.
fn chance(equations: &[Equations; 2], poses: &[usize], count: usize) -> Option<f64> {
    let mut least = 1.0_f64;
    for own in equations {
        least = least.min(own.deleted(poses)?.1);
    }
    let sets = ln_binomial(count as u64, poses.len() as u64).exp();
    Some(2.0 * sets * least)
}

/// Says which poses do not fit, and their reading that is furthest off.
fn told(recorded: &Recorded, poses: &[usize], equations: &[Equations; 2]) -> String {
    let rows = poses.iter().map(|k| &recorded.sample[*k]);
    let times: Vec<String> = rows.map(|row| format_significant(row.time, 4)).collect();
    let (subject, verb, object) = match times.len() {
        1 => ("pose", "does", "it was"),
        _ => ("poses", "do", "they were"),
    };
    let cause = saturated(recorded, poses, equations).unwrap_or_else(|| {
        "Look for a contact, a cable that pulls, or a robot that still moved.".to_owned()
    });
    format!(
        "{}: the {subject} at t = {} s {verb} not fit the load by all other poses ({}); {object} left out. {cause}",
        recorded.label,
        listed(&times),
        worst(recorded, poses, equations)
    )
}

/// Says that a channel is cut in all of these poses: it reads one extreme value exactly, of either sign, in two poses or more,
/// where the load by the others would read more. Readings with noise agree in no digit but the first ones.
fn saturated(recorded: &Recorded, poses: &[usize], equations: &[Equations; 2]) -> Option<String> {
    let size = |pose: usize, channel: usize| recorded.sample[pose].readings[channel].abs();
    let all = 0..recorded.sample.len();
    let would = |channel: usize| -> Option<Vec<f64>> {
        let (errors, _) = equations[channel / 3].deleted(poses)?;
        let error = |k: usize| errors[3 * k + channel % 3];
        let rows = poses.iter().enumerate();
        Some(
            rows.map(|(k, pose)| recorded.sample[*pose].readings[channel] - error(k))
                .collect(),
        )
    };
    let is_cut = |channel: usize| {
        let end = all
            .clone()
            .map(|pose| size(pose, channel))
            .fold(0.0, f64::max);
        let shared = poses
            .iter()
            .filter(|pose| size(**pose, channel) == end)
            .count();
        let goes_on = |would: Vec<f64>| {
            let mut pairs = poses.iter().zip(would);
            pairs.all(|(pose, would)| {
                let read = recorded.sample[*pose].readings[channel];
                read.abs() < end || would * read.signum() > end
            })
        };
        (shared >= 2 && would(channel).is_some_and(goes_on)).then_some((channel, end))
    };
    let cut: Vec<(usize, f64)> = (0..6).filter_map(is_cut).collect();
    let is_told = |pose: &usize| {
        cut.iter()
            .any(|(channel, end)| size(*pose, *channel) == *end)
    };
    if cut.is_empty() || !poses.iter().all(is_told) {
        return None;
    }
    let each: Vec<String> = (cut.iter())
        .map(|(channel, end)| {
            let unit = ["N", "N·m"][channel / 3];
            let shared = all
                .clone()
                .filter(|pose| size(*pose, *channel) == *end)
                .count();
            format!(
                "{} reads exactly ±{} {unit} in {shared} poses and more in none",
                WRENCH_COLUMNS[*channel],
                format_significant(*end, 4)
            )
        })
        .collect();
    Some(format!(
        "The sensor looks saturated: {}. Check the amplifier, and the range that is set in the sensor.",
        listed(&each)
    ))
}

/// Says which reading of some poses is furthest from the load by the others, in units of what these leave.
fn worst(recorded: &Recorded, poses: &[usize], equations: &[Equations; 2]) -> String {
    let (mut most, mut words) = (0.0, String::new());
    for (kind, own) in equations.iter().enumerate() {
        let Some((errors, _)) = own.deleted(poses) else {
            continue;
        };
        for (at, error) in errors.iter().enumerate() {
            let channel = 3 * kind + at % 3;
            let row = &recorded.sample[poses[at / 3]];
            let size = error.abs() / own.residual.norm();
            if size > most {
                most = size;
                let when = match poses.len() {
                    1 => String::new(),
                    _ => format!(" at t = {} s", format_significant(row.time, 4)),
                };
                words = format!(
                    "{} reads {} {} instead of {}{when}",
                    WRENCH_COLUMNS[channel],
                    format_significant(row.readings[channel], 3),
                    ["N", "N·m"][kind],
                    format_significant(row.readings[channel] - error, 3)
                );
            }
        }
    }
    words
}

/// The equations of forces or moments of one recording of poses.
struct Equations {
    /// Orthonormal columns that span those of the unknowns; three rows a pose.
    span: DMatrix<f64>,
    residual: DVector<f64>,
}

impl Equations {
    /// Forms the equations of three channels, linear about a fit.
    fn of(sensed: &Sensed, fit: &Fit, recording: usize, first: usize) -> Self {
        let rows = &sensed.recordings[recording].sample;
        let height = 3 * rows.len();
        let predicted = |fit: &Fit| {
            let all = rows.iter().flat_map(|row| {
                let own = sensed.predicted(fit, recording, row);
                [0, 1, 2].map(|axis| own[first + axis])
            });
            DVector::from_iterator(height, all)
        };
        let read = rows
            .iter()
            .flat_map(|row| [0, 1, 2].map(|axis| row.readings[first + axis]));
        let own = predicted(fit);
        let right = DVector::from_iterator(height, read) - &own;
        let mut columns = DMatrix::zeros(height, fit.values.len());
        let mut other = fit.clone();
        for k in 0..fit.values.len() {
            other.values[k] += 1.0;
            columns.set_column(k, &(predicted(&other) - &own));
            other.values[k] = fit.values[k];
        }
        let lengths: Vec<f64> = columns.column_iter().map(|c| c.norm()).collect();
        for (mut column, length) in columns.column_iter_mut().zip(lengths) {
            column /= length.max(f64::MIN_POSITIVE);
        }
        let svd = Svd::of(columns);
        let least = ROUNDING * svd.singular_values.max();
        let kept: Vec<usize> = (0..svd.singular_values.len())
            .filter(|k| svd.singular_values[*k] > least)
            .collect();
        let span = svd.u.select_columns(&kept);
        let residual = &right - &span * span.tr_mul(&right);
        Self { span, residual }
    }

    /// Returns the one to half of all `count` poses that are farthest from a fit that half of the poses bear.
    fn farthest(&self, count: usize) -> Vec<Vec<usize>> {
        let fewest = self.span.ncols() / 3 + 1;
        let half = count - count / 2;
        if half < fewest {
            return Vec::new();
        }
        let mut random = Pcg64::seed_from_u64(count as u64);
        let trimmed =
            (0..STARTS).map(|_| self.trimmed(sample(&mut random, count, fewest).into_vec(), half));
        let Some((_, order)) = trimmed.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            return Vec::new();
        };
        (1..=count / 2)
            .map(|size| order[count - size..].to_vec())
            .collect()
    }

    /// Fits some poses, then the `half` that are nearest to this fit, until they stay the same. Returns what these leave, and
    /// all poses by their distance.
    fn trimmed(&self, start: Vec<usize>, half: usize) -> (f64, Vec<usize>) {
        let (mut left, mut order) = (f64::INFINITY, start);
        let mut size = order.len();
        for _ in 0..STEPS {
            let rows = rows_of(&order[..size]);
            let right = self.residual.select_rows(&rows);
            let change = Svd::of(self.span.select_rows(&rows)).solve(&right, ROUNDING);
            let off = &self.residual - &self.span * change;
            let distance = |pose: usize| off.rows(3 * pose, 3).norm_squared();
            let mut next: Vec<usize> = (0..off.len() / 3).collect();
            next.sort_by(|a, b| distance(*a).total_cmp(&distance(*b)));
            let sum: f64 = next[..half].iter().map(|pose| distance(*pose)).sum();
            let is_less = sum < left;
            if !is_less {
                break;
            }
            (left, order, size) = (sum, next, half);
        }
        (left, order)
    }

    /// Returns the errors of the readings of some poses against the load by the others, and the probability that they are
    /// chance. `None` if the others do not predict them.
    fn deleted(&self, poses: &[usize]) -> Option<(DVector<f64>, f64)> {
        let rows = rows_of(poses);
        let own = self.span.select_rows(&rows);
        let rest = DMatrix::identity(own.ncols(), own.ncols()) - own.tr_mul(&own);
        let eigen = rest.symmetric_eigen();
        if eigen.eigenvalues.min() < PREDICTED {
            return None;
        }
        let residual = self.residual.select_rows(&rows);
        let inverse = &eigen.eigenvectors
            * DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| 1.0 / v))
            * eigen.eigenvectors.transpose();
        let errors = &residual + &own * (inverse * own.tr_mul(&residual));
        let further = rows.len() as f64;
        let freedom = (self.span.nrows() - self.span.ncols()) as f64 - further;
        let explained = residual.dot(&errors);
        let left = self.residual.norm_squared() - explained;
        let ratio = explained / further / (left / freedom).max(f64::MIN_POSITIVE);
        let chance = f_p_value(ratio, [further, freedom])?;
        Some((errors, chance))
    }
}

/// Returns the rows of some poses.
fn rows_of(poses: &[usize]) -> Vec<usize> {
    poses
        .iter()
        .flat_map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
        .collect()
}
