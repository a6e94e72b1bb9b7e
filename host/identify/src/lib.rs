//! Identification: from prepared motion to base parameters with their uncertainty.
//!
//! Rows of a model are streamed into triangular factors ([`TriangularFactor`]), from which the base parameters of the
//! robot ([`Base`]) are estimated. Parameters without excitation are named. Further passes over the recordings give
//! residuals and a covariance that allows for their correlation in time. Memory does not grow with the recordings.
//!
//! Least squares (ordinary, weighted by joint, robust) assume an exact regressor; the choice of the cut-off keeps its
//! noise small ([`rig_data::prepare::NOISE_SHARE`]). If this is not enough, there are instrumental variables, output
//! error and total least squares. Maximum likelihood is for correlated residuals. Ridge regression and physical
//! consistency are for parameters that the motion does not identify. All estimates can be compared on time segments
//! left out of the fit ([`Comparison`]).
//!
//! The parameters of a simulated pendulum, from its motion and torque:
//!
//! ```no_run
//! use rig_data::prepare::InMemory;
//! use rig_data::{Block, JointColumns};
//! use rig_identify::{Options, identify};
//! use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = Robot::from_toml(ONE_LINK_TEMPLATE, "one-link.toml".as_ref())?;
//! let t: Vec<f64> = (0..20_000).map(|k| 0.001 * f64::from(k)).collect();
//! let q: Vec<f64> = t.iter().map(|t| 0.8 * (1.3 * t).sin() + 0.3 * (4.1 * t).sin()).collect();
//! let torque = |t: &f64| {
//!     let q = 0.8 * (1.3 * t).sin() + 0.3 * (4.1 * t).sin();
//!     let qd = 1.04 * (1.3 * t).cos() + 1.23 * (4.1 * t).cos();
//!     let qdd = -1.352 * (1.3 * t).sin() - 5.043 * (4.1 * t).sin();
//!     0.05 * qdd + 1.5 * q.cos() + 0.1 * qd + 0.2 * qd.signum()
//! };
//! let tau = t.iter().map(torque).collect();
//! let joints = vec![JointColumns { q, tau, ..JointColumns::default() }];
//! let recording = InMemory {
//!     label: "pendulum".into(),
//!     blocks: vec![Block { t, joints, first_line: 2, ..Block::default() }],
//! };
//! let found = identify(&robot, &[&recording], &[], &Options::default())?;
//! let inertia = &found.base_parameters[0];
//! assert!((inertia.value - 0.05).abs() < 1e-3, "{} {}", inertia.expression, inertia.value);
//! # Ok(())
//! # }
//! ```
//!
//! Limits: the form of the friction law is not estimated (see [`friction_map()`]); the noise model is independent of
//! the motion.

mod added_torque;
mod band;
mod base;
mod beyond;
mod bodies;
mod cache;
mod closed;
mod compare;
mod consistent;
mod contradicted;
mod covariance;
mod cutoff;
mod decimation;
mod describe;
mod differential;
mod endogeneity;
mod essential;
mod evaluate;
mod evidence;
mod excitation;
mod factor;
mod fit;
mod freed;
mod friction_map;
mod further;
mod grouping;
mod instrumental;
mod integral;
mod lag;
mod least;
mod left_out;
mod likelihood;
mod linear;
mod model;
mod momentum;
mod one_way;
mod output_error;
mod parts;
mod position;
mod prior;
mod problem;
mod pseudo_inertia;
mod recommend;
mod repeat;
mod residual;
mod ridge;
mod robust;
mod settled;
mod slow;
mod solve;
mod speed;
mod standard;
mod states;
mod terms;
mod tilt;
mod total;
mod twin;
mod warnings;
mod window;

#[cfg(test)]
mod rows_test;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

pub use added_torque::added_torque;
pub use base::{
    Base, Independent, chain_of, column_name, expression, independent_columns, preference,
    transmission_of, unit,
};
pub use bodies::{Sizes, as_bodies};
pub use cache::RowCache;
pub use compare::{Compared, Comparison};
pub use contradicted::contradicted;
pub use covariance::{Ellipse, Estimate, t_quantile};
pub use cutoff::treatment_for;
pub use describe::identified_robot;
pub use describe::{Combinations, redistributed};
pub use endogeneity::{Endogeneity, Verdict};
pub use essential::{Essential, EssentialSet};
pub use evaluate::{Planned, torque_residuals};
pub use factor::TriangularFactor;
pub use friction_map::{
    DroppedPass, FrictionFit, FrictionMap, FrictionMapOptions, FrictionPoint, friction_map,
};
pub use grouping::{agree, grouped};
pub use model::{Equation, Plan, Rows, Tally, each_rows};
pub use one_way::OneWay;
pub use one_way::{SLIDES, Slides};
pub use position::PositionTorque;
pub use prior::described;
pub use pseudo_inertia::{least_eigenvalue, pseudo_inertia};
pub use residual::{Dependence, ResidualReport, Series};
pub use settled::identify;
pub use standard::{StandardParameter, StandardSet};
pub use tilt::BaseTilt;

use rig_data::prepare::{Masked, PrepareError, PrepareOptions, Survey, Treatment};
use rig_model::robot::Robot;

/// Which equations are fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelKind {
    /// Torque as a function of acceleration, velocity and position.
    #[default]
    Differential,
    /// One joint: work equals change of energy over a window. Several joints: impulse equals change of momentum, one
    /// equation per joint. Needs no acceleration.
    Integral,
}

/// The estimation method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// Ordinary least squares.
    Ols,
    /// Each joint's rows are divided by the standard deviation of its residual.
    #[default]
    Weighted,
    /// Weighted, with smaller weights for rows with large residuals (iteratively reweighted least squares).
    Robust,
    /// Instrumental variables from the simulated closed loop (IDIM-IV).
    Iv,
    /// Fits the torque of the simulated closed loop to the measured torque (DIDIM).
    OutputError,
    /// Total least squares: allows for noise in the regressor.
    Tls,
    /// Maximum likelihood: residuals are autoregressive and correlated between joints.
    Ml,
    /// Ridge regression towards the description's values.
    Ridge,
    /// Weighted, with the constraint that every link has physically consistent inertial parameters.
    Consistent,
}

impl Estimator {
    /// All estimators, the simple ones first.
    pub const ALL: [Self; 9] = [
        Self::Ols,
        Self::Weighted,
        Self::Robust,
        Self::Iv,
        Self::OutputError,
        Self::Tls,
        Self::Ml,
        Self::Ridge,
        Self::Consistent,
    ];

    /// Returns the default estimator for `robot`. One joint: weighted least squares, which needs no prior. Several
    /// joints: `consistent`, because one motion seldom excites all joints. It takes from the description what the data
    /// do not identify, and its links are physically consistent. The reported values then equal those in the written
    /// files.
    pub fn for_robot(robot: &Robot) -> Self {
        if robot.joints.len() > 1 {
            Self::Consistent
        } else {
            Self::Weighted
        }
    }

    /// Returns true if the description's values enter the estimate.
    pub fn has_prior(self) -> bool {
        matches!(
            self,
            Self::Iv | Self::OutputError | Self::Ridge | Self::Consistent
        )
    }

    /// The name on the command line and in `identification.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ols => "ols",
            Self::Weighted => "weighted",
            Self::Robust => "robust",
            Self::Iv => "iv",
            Self::OutputError => "output-error",
            Self::Tls => "tls",
            Self::Ml => "ml",
            Self::Ridge => "ridge",
            Self::Consistent => "consistent",
        }
    }

    /// The name in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Ols => "ordinary least squares",
            Self::Weighted => "weighted least squares",
            Self::Robust => "robust (reweighted) least squares",
            Self::Iv => "instrumental variables (IDIM-IV)",
            Self::OutputError => "closed-loop output error (DIDIM)",
            Self::Tls => "total least squares",
            Self::Ml => "maximum likelihood with the residual's covariance",
            Self::Ridge => "ridge regression towards the description",
            Self::Consistent => "physically consistent least squares",
        }
    }
}

/// The function that reduces the weight of large residuals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Loss {
    /// Huber 1964, k = 1.345 (95 % efficient for normal residuals): influence is bounded.
    #[default]
    Huber,
    /// Tukey's bisquare, c = 4.685 (95 % efficient): outliers have zero weight.
    Bisquare,
}

impl Loss {
    /// Returns the weight of a residual of `u` standard deviations.
    pub fn weight(self, u: f64) -> f64 {
        let u = u.abs();
        match self {
            Self::Huber if u <= 1.345 => 1.0,
            Self::Huber => 1.345 / u,
            Self::Bisquare if u < 4.685 => (1.0 - (u / 4.685).powi(2)).powi(2),
            Self::Bisquare => 0.0,
        }
    }
}

/// Settings of an identification.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The equations to fit.
    pub model: ModelKind,
    /// The estimator.
    pub estimator: Estimator,
    /// Loss of the robust estimator.
    pub loss: Loss,
    /// Filters, decimation, masks.
    pub prepare: PrepareOptions,
    /// Window length of the integral model, s; chosen from the motion if absent. Unused by the differential model.
    pub window: Option<f64>,
    /// Seed of the random states used to find the base parameters.
    pub seed: u64,
    /// How many times each training recording counts; recordings beyond the end of the list count once.
    pub recording_weights: Vec<f64>,
    /// Relative uncertainty of the described inertial values, for [`Estimator::has_prior`] and the standard parameters
    /// of several joints. If absent, `ridge` maximises the likelihood of the data and everything else uses 2.
    pub prior_uncertainty: Option<f64>,
    /// Further estimators to compare; empty for no comparison.
    pub compare: Vec<Estimator>,
    /// Searches for springs, ripple and a tilted base if several joints are described with all their links. If false,
    /// the description is used unchanged.
    pub look_beyond: bool,
}

impl Options {
    /// Returns the factor for the rows of training recording `r`: the root of its weight, because squares are summed.
    pub fn row_weight(&self, r: usize) -> f64 {
        self.recording_weights.get(r).map_or(1.0, |w| w.sqrt())
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            model: ModelKind::default(),
            estimator: Estimator::default(),
            loss: Loss::default(),
            prepare: PrepareOptions::default(),
            window: None,
            seed: 1,
            recording_weights: Vec::new(),
            prior_uncertainty: None,
            compare: Vec::new(),
            look_beyond: false,
        }
    }
}

/// Returns the advice for a recording with too few usable rows, by the main reason for the unusable ones.
fn what_helps(slow: u64, saturated: u64) -> &'static str {
    if saturated > slow {
        "the torque stands at its limit: record a motion that needs less, or without the limit"
    } else {
        "record a longer or livelier motion"
    }
}

/// Reasons why an identification fails.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// Reading or preparing a recording failed.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The robot has no valid model.
    #[error("The robot's model cannot be built: {0}")]
    Model(String),
    /// The base parameters are ambiguous.
    #[error(
        "The base parameters of {robot} cannot be decided: column {column} of joint `{joint}` is independent of the others by only {least:.1e} of its length; write lengths and angles of that joint and the one before it that are meant to be zero, or multiples of a right angle, exactly."
    )]
    Undecided {
        /// Name of the doubtful column.
        column: String,
        /// Its joint.
        joint: String,
        /// Relative length of the doubtful column after projection onto the others.
        least: f64,
        /// Name of the robot.
        robot: String,
    },
    /// No recording.
    #[error("No training recording was given; name at least one.")]
    NoRecording,
    /// Too few rows are usable after masking.
    #[error(
        "Of all rows only {used} are usable for {unknown} parameters (too slow: {slow}, saturated: {saturated}); {}.", what_helps(*slow, *saturated)
    )]
    NothingLeft {
        /// Usable rows.
        used: u64,
        /// Parameters.
        unknown: usize,
        /// Rows that were too slow.
        slow: u64,
        /// Rows at a torque limit.
        saturated: u64,
    },
    /// The torque is zero in all rows.
    #[error(
        "The torque of joint {joint} is zero throughout; record the torque or the motor current{}.", if *.still { ", or make the joint, which stands still, type=\"fixed\" in the URDF" } else { "" }
    )]
    NoTorque {
        /// Number of the joint, from 1.
        joint: usize,
        /// True if the joint stands still in all rows.
        still: bool,
    },
    /// The fit is singular.
    #[error(
        "The least-squares problem is singular although its columns looked independent; the smallest of them is {column}."
    )]
    Singular {
        /// Name of the smallest column.
        column: String,
    },
    /// The recording is too short for a confidence interval.
    #[error(
        "{rows} rows whose residuals remember {memory:.0} rows are too few for a confidence interval; record at least {needed} s."
    )]
    TooShortForIntervals {
        /// Rows.
        rows: u64,
        /// Correlation time of the residuals, rows.
        memory: f64,
        /// Duration needed, s.
        needed: u64,
    },
    /// The window length is impossible for the integral model.
    #[error(
        "A window of {} s is not possible for the integral model; it must last between {least} s and {most} s here.",
        rig_model::robot::written(*window)
    )]
    Window {
        /// Requested length, s.
        window: f64,
        /// Shortest possible, s.
        least: f64,
        /// Longest possible, s.
        most: f64,
    },
    /// The physically consistent fit did not converge.
    #[error(
        "The physically consistent fit found no end: {why}. A prior uncertainty nearer to 1 (--prior-uncertainty) or a description nearer to the robot would help."
    )]
    Inconsistent {
        /// Reason.
        why: String,
    },
    /// An iteration did not converge.
    #[error(
        "{what} did not settle after {passes} steps; a longer recording or a prior closer to the robot would help."
    )]
    Unsettled {
        /// Name of the iteration.
        what: &'static str,
        /// Steps.
        passes: usize,
    },
    /// Output error was requested without a closed loop.
    #[error(
        "Estimator output-error simulates the closed loop: every joint needs a [joint.controller] in the description and a column ref<k> in every recording; use iv, which makes do with less."
    )]
    NoLoop,
    /// The recorded references do not match the motion.
    #[error(
        "Estimator output-error follows the recorded references (columns ref<k>), and these are in another unit or sense than the positions; correct them."
    )]
    StrangeReference,
    /// The identified model cannot be simulated.
    #[error("The identified model cannot be simulated: {0}")]
    Simulation(String),
    /// A recording's weight is out of range.
    #[error(
        "A recording's weight is {0}; it must lie between 1e-12 and 1e12 (1 counts the recording once, 2 twice)."
    )]
    Weight(f64),
    /// The prior uncertainty is not positive.
    #[error(
        "The description's relative uncertainty is given as {0}; it must be above zero (0.1 means 10 %)."
    )]
    PriorUncertainty(f64),
    /// A prior uncertainty was given for an estimator that uses no prior.
    #[error(
        "The description's relative uncertainty is given as {uncertainty}, but {estimator} of one joint takes nothing from the description; give --estimator ridge or consistent, or leave --prior-uncertainty out."
    )]
    UnusedUncertainty {
        /// The given uncertainty.
        uncertainty: f64,
        /// The estimator's name.
        estimator: &'static str,
    },
    /// A window was given for the differential model.
    #[error(
        "A window of {0} s is given, but the differential model has no windows; give --model integral, or leave --window out."
    )]
    UnusedWindow(f64),
    /// The friction map cannot be computed.
    #[error("{0}")]
    FrictionMap(String),
}

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
    fn of(name: &str, train: &ResidualReport, held: Option<&ResidualReport>) -> Self {
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

/// A combination that the data do not determine, or determine less well than the description.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NotExcited {
    /// The base parameter that was not identified on its own or is weakly excited.
    pub combination: String,
    /// Reason.
    pub why: String,
    /// A motion that would excite it.
    pub motion: String,
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
    /// Sentences.
    pub warnings: Vec<String>,
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

/// Report content beyond `identification.json`.
#[derive(Clone, Debug, PartialEq)]
pub struct Details {
    /// Preparation.
    pub treatment: Treatment,
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
    /// Standard column that represents each base parameter.
    pub columns: Vec<usize>,
    /// Residuals of the training recordings by joint (torque, differential form).
    pub train: Vec<ResidualReport>,
    /// Residuals of the hold-out, if given.
    pub holdout_residuals: Option<Vec<ResidualReport>>,
    /// Window length of the integral model, s, and its reason; absent for the differential model.
    pub window: Option<(f64, String)>,
}
