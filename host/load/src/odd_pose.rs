//! Poses that the load by all other poses does not explain: one with a contact, or several in which a channel is cut.
//!
//! At rest forces and moments are apart: the forces show the mass, the moments the first moments. A set of poses is left
//! out if the residual of one of them falls by more than chance has it (F test for deleted observations, Cook & Weisberg
//! 1982, corrected for all sets that are tried).

use nalgebra::{DMatrix, DVector};
use rig_data::WRENCH_COLUMNS;
use rig_output::format_significant;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::statistics::Recorded;
use crate::system::{Fit, Sensed};

/// Probability by chance, of all sets together, below which poses are no readings of the load.
const BY_CHANCE: f64 = 1e-4;
/// Relative singular value below which a column is none.
const ROUNDING: f64 = 1e-9;
/// Smallest eigenvalue of what a set of poses leaves to the others, from which these predict it.
const PREDICTED: f64 = 1e-6;

/// Poses of a recording that are left out.
pub(crate) struct OddPoses {
    /// Index of the recording.
    pub recording: usize,
    /// Their numbers among its poses.
    poses: Vec<usize>,
    /// Probability by chance, of all sets together.
    chance: f64,
    /// Channel and mean reading, if it is cut there.
    pub cut: Option<(usize, f64)>,
    /// What they read, and what the load by the others gives.
    text: String,
}

impl OddPoses {
    /// Leaves the poses out.
    pub(crate) fn leave_out(&self, recordings: &mut [Recorded]) {
        if let Some(recorded) = recordings.get_mut(self.recording) {
            *recorded = recorded.without_poses(&self.poses);
        }
    }

    /// Says what is odd about them.
    pub(crate) fn words(&self) -> &str {
        &self.text
    }
}

/// Finds the poses that fit the load by the others least, if this is no chance.
pub(crate) fn odd_poses(sensed: &Sensed, fit: &Fit) -> Option<OddPoses> {
    let all = sensed.recordings.iter().enumerate();
    let listed = all.filter(|(_, recorded)| recorded.poses && recorded.is_sampled());
    let found = listed.filter_map(|(recording, recorded)| {
        let equations = [0, 3].map(|first| Equations::of(sensed, fit, recording, first));
        let sets = sets(recorded);
        let tried = 2 * sets.len();
        let odd = sets.into_iter().filter_map(|set| set.judged(&equations));
        let least = odd.min_by(|a, b| a.1.total_cmp(&b.1));
        let (set, chance) = least?;
        Some(set.told(recorded, recording, tried as f64 * chance, &equations))
    });
    let least = found.min_by(|a, b| a.chance.total_cmp(&b.chance))?;
    (least.chance < BY_CHANCE).then_some(least)
}

/// Returns single poses, and those with the highest or lowest readings of a channel: at most half of all.
fn sets(recorded: &Recorded) -> Vec<Set> {
    let count = recorded.sample.len();
    let mut sets: Vec<Set> = (0..count)
        .map(|k| Set {
            poses: vec![k],
            end: None,
        })
        .collect();
    for channel in 0..6 {
        let mut order: Vec<usize> = (0..count).collect();
        let reading = |k: &usize| recorded.sample[*k].readings[channel];
        order.sort_by(|a, b| reading(a).total_cmp(&reading(b)));
        for outwards in [-1.0, 1.0] {
            for size in 2..=count / 2 {
                let poses = match outwards < 0.0 {
                    true => order[..size].to_vec(),
                    false => order[count - size..].to_vec(),
                };
                sets.push(Set {
                    poses,
                    end: Some((channel, outwards)),
                });
            }
        }
    }
    sets
}

/// A set of poses.
struct Set {
    poses: Vec<usize>,
    /// Channel, and −1 for its lowest, 1 for its highest readings.
    end: Option<(usize, f64)>,
}

impl Set {
    /// Returns the set with the probability by chance that the others predict it as badly. `None` if they cannot predict it,
    /// or if the load would not read further out than a channel that is cut.
    fn judged(self, equations: &[Equations; 2]) -> Option<(Self, f64)> {
        let kinds = match self.end {
            None => 0..2,
            Some((channel, _)) => channel / 3..channel / 3 + 1,
        };
        let mut least = 1.0_f64;
        for kind in kinds {
            let (errors, chance) = equations[kind].deleted(&self.poses)?;
            let is_beyond = |(channel, outwards): (usize, f64)| {
                errors
                    .iter()
                    .skip(channel % 3)
                    .step_by(3)
                    .all(|error| error * outwards < 0.0)
            };
            if self.end.is_none_or(is_beyond) {
                least = least.min(chance);
            }
        }
        Some((self, least))
    }

    fn told(
        self,
        recorded: &Recorded,
        recording: usize,
        chance: f64,
        equations: &[Equations; 2],
    ) -> OddPoses {
        let rows: Vec<_> = self.poses.iter().map(|k| &recorded.sample[*k]).collect();
        let cut = self.end.map(|(channel, _)| {
            let sum: f64 = rows.iter().map(|row| row.readings[channel]).sum();
            (channel, sum / rows.len() as f64)
        });
        let text = format!(
            "{}: the pose at t = {} s does not fit the load by all other poses ({}); it was left out. Look for a contact, a cable that pulls, a reading that is cut, or a robot that still moved.",
            recorded.label,
            format_significant(rows[0].time, 4),
            worst(&rows[0].readings, self.poses[0], equations)
        );
        OddPoses {
            recording,
            poses: self.poses,
            chance,
            cut,
            text,
        }
    }
}

/// Says which reading of a pose is furthest from the load by the others, in units of what these leave.
fn worst(readings: &[f64; 6], pose: usize, equations: &[Equations; 2]) -> String {
    let (mut most, mut words) = (0.0, String::new());
    for (kind, own) in equations.iter().enumerate() {
        let Some((errors, _)) = own.deleted(&[pose]) else {
            continue;
        };
        for (axis, error) in errors.iter().enumerate() {
            let channel = 3 * kind + axis;
            let size = error.abs() / own.residual.norm();
            if size > most {
                most = size;
                words = format!(
                    "{} reads {} {} instead of {}",
                    WRENCH_COLUMNS[channel],
                    format_significant(readings[channel], 3),
                    ["N", "N·m"][kind],
                    format_significant(readings[channel] - error, 3)
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
        let svd = columns.svd(true, false);
        let least = ROUNDING * svd.singular_values.max();
        let kept: Vec<usize> = (0..svd.singular_values.len())
            .filter(|k| svd.singular_values[*k] > least)
            .collect();
        let span = svd.u.unwrap_or_default().select_columns(&kept);
        let residual = &right - &span * span.tr_mul(&right);
        Self { span, residual }
    }

    /// Returns the errors of the readings of some poses against the load by the others, and the probability that they are
    /// chance. `None` if the others do not predict them.
    fn deleted(&self, poses: &[usize]) -> Option<(DVector<f64>, f64)> {
        let rows: Vec<usize> = poses
            .iter()
            .flat_map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
            .collect();
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
        let chance = FisherSnedecor::new(further, freedom)
            .ok()?
            .sf(ratio.max(0.0));
        Some((errors, chance))
    }
}
