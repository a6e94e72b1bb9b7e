//! One set: its identification, and factors of its rows for the torque of any parameters.

use nalgebra::{DMatrix, DVector};
use rig_identify::{Base, Estimator, Identification, IdentifyError, ModelKind, Options, identify};
use rig_model::robot::Robot;

use crate::error::CompareError;
use crate::matrices::pseudo_inverse;
use crate::period::{Repeating, repeating};
use crate::set::RecordingSet;
use crate::set_rows::SetRows;
use crate::shrinkage::shrunk;

/// A set that was identified.
#[derive(Clone)]
pub(crate) struct IdentifiedSet {
    /// Name.
    pub name: String,
    /// Its own result.
    pub found: Identification,
    /// Identified values.
    pub values: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Degrees of freedom of the covariance.
    pub freedom: usize,
    /// Weight of the target in the covariance, see [`crate::shrinkage`].
    pub shrinkage: f64,
    /// Factor of the inverse of the covariance, see [`crate::shrinkage`].
    pub inverse_factor: f64,
    /// Identified values = `of_base` · base parameters.
    pub of_base: DMatrix<f64>,
    /// What its rows show.
    pub rows: SetRows,
    /// How its motion repeats; `None` if it does not.
    pub repeating: Option<Repeating>,
}

impl IdentifiedSet {
    /// Identifies a set of recordings.
    ///
    /// # Errors
    /// [`CompareError`].
    pub(crate) fn of(
        robot: &Robot,
        base: &Base,
        set: &RecordingSet,
        options: &Options,
    ) -> Result<Self, CompareError> {
        let failed = |why| CompareError::Set {
            set: set.name.clone(),
            why,
        };
        let options = Options {
            look_beyond: false,
            compare: Vec::new(),
            ..options.clone()
        };
        let found = identify(robot, &set.recordings, &[], &options).map_err(failed)?;
        let details = &found.details;
        let repeating = repeating(&set.recordings, &details.training)
            .map_err(|why| failed(IdentifyError::from(why)))?;
        let of_base = &details.combination * pseudo_inverse(&base.combination);
        let values = DVector::from_column_slice(&details.estimate.values);
        let of_rows = pseudo_inverse(&of_base) * &values;
        let rows = SetRows::of(
            robot,
            base,
            set,
            &found,
            of_rows.as_slice(),
            repeating.as_ref(),
        );
        let rows = rows.map_err(failed)?;
        let own: Vec<usize> = (details.columns.iter())
            .filter_map(|c| base.columns.iter().position(|b| b == c))
            .collect();
        let n = details.estimate.values.len();
        let information = rows.information(&found).select_rows(&own);
        let information = information.select_columns(&own);
        if own.len() != n {
            return Err(CompareError::Singular(set.name.clone()));
        }
        let (covariance, freedom) = covariance(&found, &rows, &of_base, &information);
        let shrunk = shrunk(&covariance, &information, freedom)
            .ok_or_else(|| CompareError::Singular(set.name.clone()))?;
        Ok(Self {
            name: set.name.clone(),
            values,
            covariance: shrunk.covariance,
            freedom,
            shrinkage: shrunk.weight,
            inverse_factor: shrunk.inverse_factor,
            of_base,
            rows,
            repeating,
            found,
        })
    }

    /// Degrees of freedom of the covariance.
    pub(crate) fn freedom(&self) -> f64 {
        self.freedom.max(1) as f64
    }

    /// Returns XᵀX of the base parameters over all joints, each in units of its residual.
    pub(crate) fn information(&self) -> DMatrix<f64> {
        self.rows.information(&self.found)
    }
}

/// Returns the covariance of a set's values and its degrees of freedom.
///
/// For a motion that repeats, the errors of the model count once: see [`crate::motion_groups`]. Those groups give the
/// covariance of weighted least squares. That of another estimator, or of the integral model, is enlarged in the ratio of
/// the mean variances that weighted least squares has with these groups and with groups of time alone.
fn covariance(
    found: &Identification,
    rows: &SetRows,
    of_base: &DMatrix<f64>,
    information: &DMatrix<f64>,
) -> (DMatrix<f64>, usize) {
    let estimate = &found.details.estimate;
    let n = estimate.values.len();
    let own = DMatrix::from_fn(n, n, |i, j| estimate.covariance[i][j]);
    let unchanged = estimate.degrees_of_freedom;
    let Some([by_place, by_time]) = &rows.groups else {
        return (own, unchanged);
    };
    let to_base = pseudo_inverse(of_base);
    let Some(repeated) = by_place.covariance(&to_base) else {
        return (own, unchanged);
    };
    let freedom = (by_place.len() - 1).min(unchanged);
    if found.estimator == Estimator::Weighted && found.model == ModelKind::Differential {
        return (repeated, freedom);
    }
    let size = |covariance: &DMatrix<f64>| (information * covariance).trace();
    let ratio = (by_time.covariance(&to_base)).map_or(1.0, |c| size(&repeated) / size(&c));
    (own * ratio.max(1.0), freedom)
}
