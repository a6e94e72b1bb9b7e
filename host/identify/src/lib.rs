//! Identification: from prepared motion to base parameters with honest uncertainty.
//!
//! Rows of a model stream into triangular factors ([`TriangularFactor`]); the base parameters of the robot
//! ([`Base`]) are estimated from them, what the data do not excite is named, and further passes over the
//! recordings give residuals and a covariance that allows for their correlation in time. Memory does not grow
//! with the recordings.
//!
//! Least squares (ordinary, weighted by joint, robust) take the regressor as exact; its noise is kept small by the
//! choice of the cut-off ([`rig_data::prepare::NOISE_SHARE`]). Where that does not do, there are instrumental variables,
//! output error and total least squares; maximum likelihood for residuals that are correlated; ridge regression and
//! physical consistency for what the motion leaves open. Every estimate can be compared with the others on stretches
//! of time left out of the fit ([`Comparison`]).
//!
//! The parameters of a simulated pendulum, from its motion and torque:
//!
//! ```
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
//! Leaves out: estimation of the friction law's form (see [`friction_map()`]); noise models that change with the motion.

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
    /// Torque against acceleration, velocity and position.
    #[default]
    Differential,
    /// One joint: work against change of energy over windows. Several: impulse against change of momentum, one equation a
    /// joint. Needs no acceleration.
    Integral,
}

/// How they are fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// Ordinary least squares.
    Ols,
    /// Each joint's rows divided by the standard deviation of its residual.
    #[default]
    Weighted,
    /// Weighted, and rows with large residuals count less (iteratively reweighted least squares).
    Robust,
    /// Instrumental variables from the simulated closed loop (IDIM-IV).
    Iv,
    /// Torque of the simulated closed loop against the measured one (DIDIM).
    OutputError,
    /// Total least squares: noise in the regressor too.
    Tls,
    /// Maximum likelihood: autoregressive residuals, correlated between joints.
    Ml,
    /// Ridge regression towards the description's values.
    Ridge,
    /// Weighted, under the condition that every link is a body that can exist.
    Consistent,
}

impl Estimator {
    /// All, plain ones first.
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

    /// The estimator that is used for `robot` where none is asked for. One joint: weighted least squares, which need no
    /// prior. Several joints are seldom all excited, and what is fitted to one motion must hold for the next: `consistent`
    /// takes from the description what the data do not say and gives links that can exist, so that the values reported
    /// are those of the files that are written.
    pub fn for_robot(robot: &Robot) -> Self {
        if robot.joints.len() > 1 {
            Self::Consistent
        } else {
            Self::Weighted
        }
    }

    /// Whether the description's values enter its estimate.
    pub fn has_prior(self) -> bool {
        matches!(
            self,
            Self::Iv | Self::OutputError | Self::Ridge | Self::Consistent
        )
    }

    /// As the command line and `identification.json` name it.
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

    /// In words.
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

/// Which large residuals count less, and how much.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Loss {
    /// Huber 1964, k = 1.345 (95 % efficient for normal residuals): bounded influence.
    #[default]
    Huber,
    /// Tukey's bisquare, c = 4.685 (95 % efficient): outliers count nothing.
    Bisquare,
}

impl Loss {
    /// Weight of a residual of `u` standard deviations.
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
    /// Equations.
    pub model: ModelKind,
    /// Fit.
    pub estimator: Estimator,
    /// Loss of the robust estimator.
    pub loss: Loss,
    /// Filters, decimation, masks.
    pub prepare: PrepareOptions,
    /// Length of the integral model's windows, s; chosen from the motion where absent. The differential model has none.
    pub window: Option<f64>,
    /// Seed of the random states from which the base parameters are found.
    pub seed: u64,
    /// How many times each training recording counts; those beyond the list count once.
    pub recording_weights: Vec<f64>,
    /// Relative uncertainty of the description's inertial values, for [`Estimator::has_prior`] and, of several joints, for
    /// the standard parameters; where absent, `ridge` takes what makes the data most likely and all else takes 2.
    pub prior_uncertainty: Option<f64>,
    /// Which estimators are compared besides; none for no comparison.
    pub compare: Vec<Estimator>,
    /// Look for springs, ripple and a base that is not level where several joints are described with all their links; else
    /// the description is taken as it is.
    pub look_beyond: bool,
}

impl Options {
    /// Factor that rows of training recording `r` are multiplied by: squares then count as often as was asked.
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

/// What mends a recording of which too few rows are usable, by why the others are not.
fn what_helps(slow: u64, saturated: u64) -> &'static str {
    if saturated > slow {
        "the torque stands at its limit: record a motion that needs less, or without the limit"
    } else {
        "record a longer or livelier motion"
    }
}

/// Why an identification is not possible.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// Reading or preparing has failed.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The robot has no valid model.
    #[error("The robot's model cannot be built: {0}")]
    Model(String),
    /// Base parameters cannot be decided.
    #[error(
        "The base parameters of {robot} cannot be decided: column {column} of joint `{joint}` is independent of the others by only {least:.1e} of its length; write lengths and angles of that joint and the one before it that are meant to be zero, or multiples of a right angle, exactly."
    )]
    Undecided {
        /// Name of the doubtful column.
        column: String,
        /// Its joint.
        joint: String,
        /// Remainder of the doubtful column.
        least: f64,
        /// Name of the robot.
        robot: String,
    },
    /// No recording.
    #[error("No training recording was given; name at least one.")]
    NoRecording,
    /// Everything was masked.
    #[error(
        "Of all rows only {used} are usable for {unknown} parameters (too slow: {slow}, saturated: {saturated}); {}.", what_helps(*slow, *saturated)
    )]
    NothingLeft {
        /// Rows left.
        used: u64,
        /// Parameters.
        unknown: usize,
        /// Rows that were too slow.
        slow: u64,
        /// Rows at a torque limit.
        saturated: u64,
    },
    /// The torque is zero throughout.
    #[error(
        "The torque of joint {joint} is zero throughout; record the torque or the motor current{}.", if *.still { ", or make the joint, which stands still, type=\"fixed\" in the URDF" } else { "" }
    )]
    NoTorque {
        /// Number of the joint, from 1.
        joint: usize,
        /// Whether it stands still throughout.
        still: bool,
    },
    /// The fit is singular.
    #[error(
        "The least-squares problem is singular although its columns looked independent; the smallest of them is {column}."
    )]
    Singular {
        /// Its name.
        column: String,
    },
    /// No honest interval.
    #[error(
        "{rows} rows whose residuals remember {memory:.0} rows are too few for a confidence interval; record at least {needed} s."
    )]
    TooShortForIntervals {
        /// Rows.
        rows: u64,
        /// Memory of the residuals, rows.
        memory: f64,
        /// Duration needed, s.
        needed: u64,
    },
    /// A window that no integral model can have.
    #[error(
        "A window of {} s is not possible for the integral model; it must last between {least} s and {most} s here.",
        rig_model::robot::written(*window)
    )]
    Window {
        /// Asked for, s.
        window: f64,
        /// Shortest possible, s.
        least: f64,
        /// Longest possible, s.
        most: f64,
    },
    /// A physically consistent fit that comes to no end.
    #[error(
        "The physically consistent fit found no end: {why}. A prior uncertainty nearer to 1 (--prior-uncertainty) or a description nearer to the robot would help."
    )]
    Inconsistent {
        /// What stopped it.
        why: String,
    },
    /// An iteration that does not end.
    #[error(
        "{what} did not settle after {passes} steps; a longer recording or a prior closer to the robot would help."
    )]
    Unsettled {
        /// What was iterated.
        what: &'static str,
        /// Steps.
        passes: usize,
    },
    /// Output error without a closed loop.
    #[error(
        "Estimator output-error simulates the closed loop: every joint needs a [joint.controller] in the description and a column ref<k> in every recording; use iv, which makes do with less."
    )]
    NoLoop,
    /// References that are not the motion's.
    #[error(
        "Estimator output-error follows the recorded references (columns ref<k>), and these are in another unit or sense than the positions; correct them."
    )]
    StrangeReference,
    /// The identified model cannot be simulated.
    #[error("The identified model cannot be simulated: {0}")]
    Simulation(String),
    /// A weight that is none.
    #[error(
        "A recording's weight is {0}; it must lie between 1e-12 and 1e12 (1 counts the recording once, 2 twice)."
    )]
    Weight(f64),
    /// A prior uncertainty that is none.
    #[error(
        "The description's relative uncertainty is given as {0}; it must be above zero (0.1 means 10 %)."
    )]
    PriorUncertainty(f64),
    /// An uncertainty of the description for an estimate that it does not enter.
    #[error(
        "The description's relative uncertainty is given as {uncertainty}, but {estimator} of one joint takes nothing from the description; give --estimator ridge or consistent, or leave --prior-uncertainty out."
    )]
    UnusedUncertainty {
        /// What was given.
        uncertainty: f64,
        /// The estimator's name.
        estimator: &'static str,
    },
    /// A window for a model without windows.
    #[error(
        "A window of {0} s is given, but the differential model has no windows; give --model integral, or leave --window out."
    )]
    UnusedWindow(f64),
    /// A friction map cannot be drawn.
    #[error("{0}")]
    FrictionMap(String),
}

/// One identified combination.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaseParameter {
    /// As a paper prints it: `m1 + Ia1`.
    pub expression: String,
    /// SI
    pub value: f64,
    /// Standard deviation, correlation of the residuals allowed for.
    pub std: f64,
    /// `100·std/|value|`
    pub relative_std_percent: f64,
    /// ASCII
    pub unit: String,
    /// 95 % interval.
    pub interval: [f64; 2],
    /// What the literature prints: residuals taken as white.
    pub classical_relative_std_percent: f64,
}

/// One joint's residuals in figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointFigures {
    /// Name of the joint.
    pub name: String,
    /// N·m or N; not a number (null) where none of the joint's rows could be used, as of one that stands still.
    pub train_residual_rms: f64,
    /// N·m or N; null without a hold-out or where none of the joint's rows in it could be used.
    pub holdout_residual_rms: Option<f64>,
    /// RMS of the residual over RMS of the torque.
    pub train_relative_error: f64,
    /// The same over the hold-out.
    pub holdout_relative_error: Option<f64>,
    /// Share of the training rows that these errors are over: slow rows, and ones at the torque limit, are left out.
    pub train_rows_share: f64,
    /// The same of the hold-out.
    pub holdout_rows_share: Option<f64>,
    /// RMS of the residual over RMS of the torque, over all rows.
    pub train_relative_error_all_rows: f64,
    /// The same over the hold-out.
    pub holdout_relative_error_all_rows: Option<f64>,
}

impl JointFigures {
    /// Of residuals over the training data, and over the hold-out where there is one.
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

/// A combination that these data say nothing about, or less than the description does.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NotExcited {
    /// The base parameter that was not identified on its own, or that the data hardly touch.
    pub combination: String,
    /// Why.
    pub why: String,
    /// A motion that would change that.
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
    /// Fit.
    pub estimator: Estimator,
    /// Number of base parameters that the data determine.
    pub rank: usize,
    /// Condition number of the regressor of these parameters.
    pub condition_number: f64,
    /// The parameters.
    pub base_parameters: Vec<BaseParameter>,
    /// Residuals by joint.
    pub joints: Vec<JointFigures>,
    /// Torques with position that the description does not state and the data show.
    pub position_torques: Vec<PositionTorque>,
    /// Gravity off the direction that the description states, where the data show it.
    pub base_tilt: Option<BaseTilt>,
    /// What the data say nothing about.
    pub not_excited: Vec<NotExcited>,
    /// Sentences.
    pub warnings: Vec<String>,
    /// The few parameters that the torque needs.
    pub essential: Option<EssentialSet>,
    /// A full set of standard parameters that a robot can have; absent for a single joint unless asked for.
    pub standard_parameters: Option<StandardSet>,
    /// Estimators side by side and the one to trust, where asked for.
    pub comparison: Option<Comparison>,
    /// How the estimator went, sentences.
    pub procedure: Vec<String>,
    /// What a report shows beyond that.
    #[serde(skip)]
    pub details: Details,
}

/// What a report shows beyond `identification.json`.
#[derive(Clone, Debug, PartialEq)]
pub struct Details {
    /// Preparation.
    pub treatment: Treatment,
    /// What was left out of the fit.
    pub masked: Vec<Masked>,
    /// The training recordings at a glance.
    pub training: Vec<Survey>,
    /// The hold-out recordings at a glance.
    pub holdout: Vec<Survey>,
    /// Values, covariance, condition numbers.
    pub estimate: Estimate,
    /// What weighted least squares give for each base parameter, free of any prior, with its 95 % interval: what the data say
    /// where the estimator bends it.
    pub free: Vec<[f64; 3]>,
    /// K with identified values = K·π, π the 14 standard parameters of each joint; rows as `base_parameters`.
    pub combination: nalgebra::DMatrix<f64>,
    /// Standard column that stands for each base parameter.
    pub columns: Vec<usize>,
    /// Residuals of the training recordings by joint (torque, differential form).
    pub train: Vec<ResidualReport>,
    /// Residuals of the hold-out, where given.
    pub holdout_residuals: Option<Vec<ResidualReport>>,
    /// Length of the integral model's windows, s, and why; absent for the differential model.
    pub window: Option<(f64, String)>,
}
