//! The result of an identification.

use serde::Serialize;

use crate::bodies::standard::StandardSet;
use crate::comparison::compared::Comparison;
use crate::estimator::Estimator;
use crate::options::ModelKind;
use crate::structure::essential::EssentialSet;
use crate::structure::excitation::NotExcited;
use crate::uncertainty::estimate::Estimate;
use crate::uncertainty::residual::ResidualReport;
use crate::unmodelled::position::PositionTorque;
use crate::unmodelled::tilt::BaseTilt;
use crate::warning::Warning;
use rig_data::prepare::{Masked, PreprocessingPlan, Survey};

/// An identified base parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaseParameter {
    /// The combination in the notation of the literature: `m1 + Ia1`.
    pub expression: String,
    /// Value, SI.
    pub value: f64,
    /// Standard deviation; allows for the correlation of the residuals.
    pub std: f64,
    /// `100·std/|value|`
    pub relative_std_percent: f64,
    /// ASCII
    pub unit: String,
    /// 95 % interval.
    pub interval: [f64; 2],
    /// Relative standard deviation for white residuals, as in the literature, %.
    pub classical_relative_std_percent: f64,
}

/// Residual figures of a joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointFigures {
    /// Name of the joint.
    pub name: String,
    /// N·m or N; not a number (null) if no row of the joint was usable, for example because it stood still.
    pub train_residual_rms: f64,
    /// N·m or N; null without a hold-out or if no row of the joint in it was usable.
    pub holdout_residual_rms: Option<f64>,
    /// RMS of the residual over RMS of the torque.
    pub train_relative_error: f64,
    /// The same over the hold-out.
    pub holdout_relative_error: Option<f64>,
    /// Share of the training rows in these errors: slow rows and rows at the torque limit are excluded.
    pub train_rows_share: f64,
    /// The same for the hold-out.
    pub holdout_rows_share: Option<f64>,
    /// RMS of the residual over RMS of the torque, over all rows.
    pub train_relative_error_all_rows: f64,
    /// The same over the hold-out.
    pub holdout_relative_error_all_rows: Option<f64>,
}

impl JointFigures {
    /// Collects the figures of the training residuals and, if given, of the hold-out residuals.
    pub(crate) fn of(name: &str, train: &ResidualReport, held: Option<&ResidualReport>) -> Self {
        let share = |r: &ResidualReport| r.rows as f64 / r.all.rows.max(1) as f64;
        Self {
            name: name.to_owned(),
            train_residual_rms: train.rms,
            holdout_residual_rms: held.map(|h| h.rms),
            train_relative_error: train.relative_error,
            holdout_relative_error: held.map(|h| h.relative_error),
            train_rows_share: share(train),
            holdout_rows_share: held.map(share),
            train_relative_error_all_rows: train.all.relative_error,
            holdout_relative_error_all_rows: held.map(|h| h.all.relative_error),
        }
    }
}

/// The result; serialises to `identification.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Identification {
    /// `rig-identification/1`
    pub schema: String,
    /// Name of the robot.
    pub robot: String,
    /// Equations fitted.
    pub model: ModelKind,
    /// Estimator.
    pub estimator: Estimator,
    /// Number of base parameters that are identifiable from the data.
    pub rank: usize,
    /// Condition number of the regressor of these parameters.
    pub condition_number: f64,
    /// The parameters.
    pub base_parameters: Vec<BaseParameter>,
    /// Residuals by joint.
    pub joints: Vec<JointFigures>,
    /// Position-dependent torques that the data show and the description lacks.
    pub position_torques: Vec<PositionTorque>,
    /// Deviation of gravity from the described direction, if the data show one.
    pub base_tilt: Option<BaseTilt>,
    /// Combinations that the data do not determine.
    pub not_excited: Vec<NotExcited>,
    /// Warnings; in JSON their sentences.
    pub warnings: Vec<Warning>,
    /// The few parameters that suffice for the torque.
    pub essential: Option<EssentialSet>,
    /// A full, physically consistent set of standard parameters; absent for a single joint unless requested.
    pub standard_parameters: Option<StandardSet>,
    /// Comparison of the estimators with the recommended one, if requested.
    pub comparison: Option<Comparison>,
    /// The course of the estimation, sentences.
    pub procedure: Vec<String>,
    /// Further content of the report.
    #[serde(skip)]
    pub details: Details,
}

impl Identification {
    /// Returns the warnings as sentences.
    pub fn sentences(&self) -> Vec<String> {
        self.warnings.iter().map(ToString::to_string).collect()
    }
}

/// Report content beyond `identification.json`.
#[derive(Clone, Debug, PartialEq)]
pub struct Details {
    /// Preparation.
    pub treatment: PreprocessingPlan,
    /// Rows excluded from the fit.
    pub masked: Vec<Masked>,
    /// Summaries of the training recordings.
    pub training: Vec<Survey>,
    /// Summaries of the hold-out recordings.
    pub holdout: Vec<Survey>,
    /// Values, covariance, condition numbers.
    pub estimate: Estimate,
    /// Weighted least-squares value of each base parameter, without a prior, with its 95 % interval. It shows what the
    /// data alone give where the estimator's prior changes the value.
    pub free: Vec<[f64; 3]>,
    /// K in identified values = K·π, with π the 14 standard parameters of each joint; rows as `base_parameters`.
    pub combination: nalgebra::DMatrix<f64>,
    /// Number of links, each with 14 standard columns.
    pub links: usize,
    /// Standard column that represents each base parameter.
    pub columns: Vec<usize>,
    /// Residuals of the training recordings by joint (torque, differential form).
    pub train: Vec<ResidualReport>,
    /// Residuals of the hold-out, if given.
    pub holdout_residuals: Option<Vec<ResidualReport>>,
    /// Window length of the integral model, s, and its reason; absent for the differential model.
    pub window: Option<(f64, String)>,
}
