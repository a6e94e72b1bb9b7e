//! One set: its identification, and factors of its rows for the torque of any parameters.

use nalgebra::{DMatrix, DVector};
use rig_identify::{
    Base, Identification, IdentifyError, ModelKind, Options, Sizes, TriangularFactor, identify,
};
use rig_model::robot::Robot;

use crate::error::CompareError;
use crate::friction_drift::{Drift, Stretches};
use crate::matrices::pseudo_inverse;
use crate::rows::each_row;
use crate::set::RecordingSet;
use crate::shrinkage::shrunk;

/// A set that was identified.
pub(crate) struct IdentifiedSet {
    /// Name.
    pub name: String,
    /// Its own result.
    pub found: Identification,
    /// Identified values.
    pub values: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Weight of the target in the covariance, see [`crate::shrinkage`].
    pub shrinkage: f64,
    /// Factor of the inverse of the covariance, see [`crate::shrinkage`].
    pub inverse_factor: f64,
    /// Identified values = `of_base` · base parameters.
    pub of_base: DMatrix<f64>,
    /// By joint, the rows over the base parameters, torque against motion.
    pub factors: Vec<TriangularFactor>,
    /// RMS torque, speed and acceleration of each joint.
    pub sizes: Sizes,
    /// By joint, the change of its friction during the recordings, if they are long enough to show one.
    pub drifts: Vec<Drift>,
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
        let of_base = &details.combination * pseudo_inverse(&base.combination);
        let values = DVector::from_column_slice(&details.estimate.values);
        let of_rows = pseudo_inverse(&of_base) * &values;
        let OfRows {
            factors,
            sizes,
            drifts,
        } = rows(robot, base, set, &found, of_rows.as_slice()).map_err(failed)?;
        let own: Vec<usize> = (details.columns.iter())
            .filter_map(|c| base.columns.iter().position(|b| b == c))
            .collect();
        let n = details.estimate.values.len();
        let covariance = DMatrix::from_fn(n, n, |i, j| details.estimate.covariance[i][j]);
        let information = weighted_information(&factors, &found).select_rows(&own);
        let information = information.select_columns(&own);
        if own.len() != n {
            return Err(CompareError::Singular(set.name.clone()));
        }
        let shrunk = shrunk(
            &covariance,
            &information,
            details.estimate.degrees_of_freedom,
        )
        .ok_or_else(|| CompareError::Singular(set.name.clone()))?;
        Ok(Self {
            name: set.name.clone(),
            values,
            covariance: shrunk.covariance,
            shrinkage: shrunk.weight,
            inverse_factor: shrunk.inverse_factor,
            of_base,
            factors,
            sizes,
            drifts,
            found,
        })
    }

    /// Degrees of freedom of the covariance.
    pub(crate) fn freedom(&self) -> f64 {
        self.found.details.estimate.degrees_of_freedom.max(1) as f64
    }

    /// Returns XᵀX of the base parameters over all joints, each in units of its residual.
    pub(crate) fn information(&self) -> DMatrix<f64> {
        weighted_information(&self.factors, &self.found)
    }
}

/// Returns XᵀX over all joints, each in units of its residual.
fn weighted_information(factors: &[TriangularFactor], found: &Identification) -> DMatrix<f64> {
    let p = factors.first().map_or(0, TriangularFactor::columns);
    let mut sum = DMatrix::zeros(p, p);
    for (factor, joint) in factors.iter().zip(&found.joints) {
        let noise = joint.train_residual_rms;
        if noise > 0.0 && noise.is_finite() {
            let (r, _) = factor.system();
            sum += r.transpose() * &r / (noise * noise);
        }
    }
    sum
}

/// Sums of squares of a joint's motion.
#[derive(Clone, Copy, Default)]
struct Motion {
    rows: f64,
    speed: f64,
    acceleration: f64,
}

/// What the rows of a set show.
struct OfRows {
    factors: Vec<TriangularFactor>,
    sizes: Sizes,
    drifts: Vec<Drift>,
}

/// Streams the rows of a set into one factor a joint. `values`: base parameters of the set.
fn rows(
    robot: &Robot,
    base: &Base,
    set: &RecordingSet,
    found: &Identification,
    values: &[f64],
) -> Result<OfRows, IdentifyError> {
    let joints = robot.joints.len();
    let p = base.len();
    let mut factors = vec![TriangularFactor::new(p); joints];
    let mut motion = vec![Motion::default(); joints];
    let mut stretches: Vec<Stretches> = (0..joints).map(|j| Stretches::new(base, j)).collect();
    let mut start = (0, f64::NAN);
    let differential = ModelKind::Differential;
    each_row(
        robot,
        base,
        &set.recordings,
        found,
        differential,
        &mut |recording, rows| {
            if let Some(first) = rows.t.first()
                && (start.1.is_nan() || start.0 != recording)
            {
                start = (recording, *first);
            }
            for (j, (factor, equation)) in factors.iter_mut().zip(&rows.equations).enumerate() {
                for k in 0..rows.t.len() {
                    if equation.keep[k] {
                        factor.push(&equation.x[k * p..(k + 1) * p], equation.y[k], 1.0);
                        let time = rows.t[k] - start.1;
                        stretches[j].push((equation, k), values, time);
                    }
                    motion[j].rows += 1.0;
                    motion[j].speed += rows.qd[j][k].powi(2);
                    if k > 0 {
                        let slope =
                            (rows.qd[j][k] - rows.qd[j][k - 1]) / (rows.t[k] - rows.t[k - 1]);
                        motion[j].acceleration += slope * slope;
                    }
                }
            }
        },
    )?;
    let rms = |of: fn(&Motion) -> f64| -> Vec<f64> {
        let one = |m: &Motion| (of(m) / m.rows.max(1.0)).sqrt();
        motion.iter().map(one).collect()
    };
    let torque = |f: &TriangularFactor| (f.right_side_squares() / f.rows().max(1) as f64).sqrt();
    let sizes = Sizes {
        torque: factors.iter().map(torque).collect(),
        speed: rms(|m| m.speed),
        acceleration: rms(|m| m.acceleration),
    };
    Ok(OfRows {
        factors,
        sizes,
        drifts: (stretches.iter().enumerate())
            .filter_map(|(j, own)| own.drift(j))
            .collect(),
    })
}
