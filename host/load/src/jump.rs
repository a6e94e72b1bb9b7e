//! Jumps of the sensor's bias.

use nalgebra::{DMatrix, DVector};
use rig_identify::f_p_value;
use rig_numerics::svd::Svd;

use crate::settle::settled;
use crate::system::{Fit, Jump, Nuisance, SegmentMean, Sensed};

/// Drifts of the bias, beside which it may jump.
pub(crate) const DRIFTS: [Nuisance; 2] = [Nuisance::Drift, Nuisance::Warming];

/// Probability by chance, of all channels and places together, below which the bias is said to jump.
const JUMPS: f64 = 1e-4;
/// Least number of segments on either side of a jump.
const LEAST_SIDE: usize = 3;

/// Finds the clearest jump of the bias between two jumps that are known, or the clearest pair: of two opposite jumps neither
/// is seen alone. The means of the residuals over the segments beside them differ by more than they differ among themselves
/// (F test, corrected for all places and channels). If the fit has a drift, it is estimated again beside each jump: the bias
/// of a sensor that drifts and is zeroed is a saw tooth, and a straight line takes a part of each jump. Empty if there is none.
pub(crate) fn jumps(sensed: &Sensed, fit: &Fit) -> Vec<Jump> {
    let (mut least, mut clearest) = (JUMPS, Vec::new());
    let stretches = sensed.mean_residuals(fit);
    for (number, (recording, means)) in stretches.iter().enumerate() {
        let recording = *recording;
        if sensed.recordings[recording].poses {
            let between = means.iter().map(|(segment, _)| *segment);
            if let Some((p, jump)) = between_poses(sensed, fit, recording, between.collect())
                && p < least
            {
                (least, clearest) = (p, vec![jump]);
            }
            continue;
        }
        let course = Course::of(sensed, fit, &stretches, number);
        let places = places(means.len());
        for own in &places {
            let as_many = places.iter().filter(|other| other.len() == own.len());
            let p = 6.0 * as_many.count() as f64 * course.chance_of(own);
            if p < least {
                least = p;
                let jump = |place: &usize| Jump {
                    recording,
                    segment: means[*place].0,
                };
                clearest = own.iter().map(jump).collect();
            }
        }
    }
    clearest
}

/// Mean residuals of the segments in which a jump is looked for, and what explains them without one.
struct Course {
    /// Mean residual of each segment (row) and channel, at right angles to `span`.
    residuals: DMatrix<f64>,
    /// Orthonormal columns: one for each stretch between two jumps, and the drift of the fit.
    span: DMatrix<f64>,
    /// Row of the first segment of the stretch, and the number of its segments.
    stretch: [usize; 2],
}

impl Course {
    /// Forms the course of stretch `number`. A drift is common to all stretches of a recording, so all tell its slope.
    fn of(
        sensed: &Sensed,
        fit: &Fit,
        stretches: &[(usize, Vec<SegmentMean>)],
        number: usize,
    ) -> Self {
        let (recording, own) = &stretches[number];
        let has_slope = DRIFTS.iter().any(|drift| fit.unknowns.has(*drift));
        let is_used = |k: &usize| *k == number || has_slope && stretches[*k].0 == *recording;
        let used: Vec<usize> = (0..stretches.len()).filter(is_used).collect();
        let rows: Vec<(usize, &SegmentMean)> = (used.iter())
            .flat_map(|k| stretches[*k].1.iter().map(move |mean| (*k, mean)))
            .collect();
        let of_stretch = |k: usize| {
            let is_in = rows
                .iter()
                .map(move |(own, _)| f64::from(u8::from(*own == k)));
            DVector::from_iterator(rows.len(), is_in)
        };
        let of_drift = |drift: Nuisance| {
            let values =
                (rows.iter()).map(|(_, (segment, _))| sensed.mean_of(drift, *recording, *segment));
            DVector::from_iterator(rows.len(), values)
        };
        let drifts = DRIFTS.iter().filter(|drift| fit.unknowns.has(**drift));
        let columns: Vec<DVector<f64>> = (used.iter().map(|k| of_stretch(*k)))
            .chain(drifts.map(|drift| of_drift(*drift)))
            .collect();
        let span = orthonormal(&DMatrix::from_columns(&columns));
        let residuals = DMatrix::from_fn(rows.len(), 6, |r, c| rows[r].1.1[c]);
        let first = rows.iter().position(|(k, _)| *k == number).unwrap_or(0);
        Self {
            residuals: beside(&residuals, &span),
            span,
            stretch: [first, own.len()],
        }
    }

    /// Returns the probability that jumps at these places of the stretch explain as much of any channel by chance (F test).
    fn chance_of(&self, places: &[usize]) -> f64 {
        let [first, count] = self.stretch;
        let steps = DMatrix::from_fn(self.span.nrows(), places.len(), |row, k| {
            let is_after = row >= first + places[k] && row < first + count;
            f64::from(u8::from(is_after))
        });
        let steps = orthonormal(&beside(&steps, &self.span));
        let further = steps.ncols() as f64;
        let freedom = (self.span.nrows() - self.span.ncols()) as f64 - further;
        let explained = steps.tr_mul(&self.residuals);
        let ratio =
            (self.residuals.column_iter().zip(explained.column_iter())).map(|(all, own)| {
                let between = own.norm_squared();
                let within = (all.norm_squared() - between) / freedom;
                between / further / within.max(f64::MIN_POSITIVE)
            });
        f_p_value(ratio.fold(0.0, f64::max), [further, freedom]).unwrap_or(1.0)
    }
}

/// Relative singular value below which a column is rounding.
const ROUNDING: f64 = 1e-9;

/// Returns orthonormal columns that span those of a matrix.
fn orthonormal(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let svd = Svd::of(columns.clone());
    let least = ROUNDING * svd.singular_values.max();
    let kept: Vec<usize> = (0..svd.singular_values.len())
        .filter(|k| svd.singular_values[*k] > least)
        .collect();
    svd.u.select_columns(&kept)
}

/// Returns the part of columns at right angles to others, which are orthonormal.
fn beside(columns: &DMatrix<f64>, others: &DMatrix<f64>) -> DMatrix<f64> {
    columns - others * others.tr_mul(columns)
}

/// Returns the jump between two poses with which the fit leaves least, and the probability that any such jump leaves as little
/// by chance (F test). The load takes up much of a jump between few poses, so each is fitted.
fn between_poses(
    sensed: &Sensed,
    fit: &Fit,
    recording: usize,
    segments: Vec<usize>,
) -> Option<(f64, Jump)> {
    let places = LEAST_SIDE..(segments.len() + 1).saturating_sub(LEAST_SIDE);
    let count = places.len() as f64;
    let fits = places.map(|place| {
        let segment = segments[place];
        let jump = Jump { recording, segment };
        let mut unknowns = fit.unknowns.clone();
        unknowns.jumps.push(jump);
        (settled(sensed, &fit.mounting, &unknowns), jump)
    });
    let (larger, jump) = fits.min_by(|a, b| a.0.misfit().total_cmp(&b.0.misfit()))?;
    Some((count * larger.chance_over(fit)?, jump))
}

/// Returns the places of one jump and of two in a stretch of segments.
fn places(count: usize) -> Vec<Vec<usize>> {
    let one = |from: usize| from + LEAST_SIDE..(count + 1).saturating_sub(LEAST_SIDE);
    // The segments beside a jump are left out.
    let is_long = |jumps: usize| count >= (jumps + 1) * LEAST_SIDE + 2 * jumps;
    let mut all = Vec::new();
    if is_long(1) {
        all.extend(one(0).map(|place| vec![place]));
    }
    if is_long(2) {
        all.extend(one(0).flat_map(|first| one(first).map(move |second| vec![first, second])));
    }
    all
}
