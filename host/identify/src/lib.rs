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
mod bodies;
mod comparison;
mod description;
mod error;
mod estimator;
mod estimators;
mod friction_map;
mod identification;
mod options;
mod rows;
mod steps;
mod structure;
mod treatment;
mod uncertainty;
mod unmodelled;
mod warning;

#[cfg(test)]
mod tests;

pub use added_torque::added_torque;
pub use bodies::contradicted::contradicted;
pub use bodies::hints::Sizes;
pub use bodies::prior::described;
pub use bodies::pseudo_inertia::{Divergence, least_eigenvalue, pseudo_inertia};
pub use bodies::standard::{StandardParameter, StandardSet};
pub use comparison::compared::{Compared, Comparison};
pub use comparison::endogeneity::{Endogeneity, Verdict};
pub use description::as_bodies::as_bodies;
pub use description::combinations::Combinations;
pub use description::identified_robot::identified_robot;
pub use description::redistributed::redistributed;
pub use error::IdentifyError;
pub use estimator::{Estimator, Loss};
pub use friction_map::{
    DroppedPass, FrictionFit, FrictionMap, FrictionMapOptions, FrictionPoint, friction_map,
};
pub use identification::{BaseParameter, Details, Identification, JointFigures};
pub use options::{ModelKind, Options};
pub use rows::cache::RowCache;
pub use rows::equation::{Equation, Rows};
pub use rows::factor::TriangularFactor;
pub use rows::one_way::{OneWay, SLIDES, Slides};
pub use rows::plan::Plan;
pub use rows::planned::Planned;
pub use rows::stream::each_rows;
pub use rows::tally::Tally;
pub use steps::settled::identify;
pub use structure::base::Base;
pub use structure::chain::{chain_of, transmission_of};
pub use structure::columns::{column_name, expression, preference, unit};
pub use structure::essential::{Essential, EssentialSet};
pub use structure::excitation::NotExcited;
pub use structure::grouping::{agree, grouped};
pub use structure::independent::{Independent, independent_columns};
pub use treatment::decide::treatment_for;
pub use uncertainty::estimate::Ellipse;
pub use uncertainty::estimate::Estimate;
pub use uncertainty::estimate::{f_p_value, t_quantile};
pub use uncertainty::jackknife::{LeaveOut, Refit};
pub use uncertainty::residual::{Dependence, LEAST_ERROR, ResidualReport, Series};
pub use uncertainty::torque_residuals::torque_residuals;
pub use unmodelled::field_torque::FieldTorque;
pub use unmodelled::position::PositionTorque;
pub use unmodelled::tilt::BaseTilt;
pub use warning::{
    AtJoint, JointFinding, LEAST_STRETCHES, MEMORIES, OwnCutoff, Part, TorqueFactor, TorqueScale,
    Unsettled, Warning, WarningKind,
};
