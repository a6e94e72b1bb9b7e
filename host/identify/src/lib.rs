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
mod chain;
mod check;
mod closed;
mod columns;
mod combinations;
mod compare;
mod compared;
mod consistent;
mod consistent_fit;
mod contradicted;
mod covariance;
mod cutoff;
mod decimation;
mod differential;
mod directions;
mod endogeneity;
mod equation;
mod error;
mod essential;
mod estimator;
mod evidence;
mod excitation;
mod factor;
mod fit;
mod fit_covariance;
mod fit_prior;
mod fitted;
mod freed;
mod friction_map;
mod further;
mod grouping;
mod held;
mod hints;
mod identification;
mod identified_robot;
mod independent;
mod instrumental;
mod integral;
mod jackknife;
mod lag;
mod least;
mod left_out;
mod likelihood;
mod linear;
mod look_beyond;
mod momentum;
mod motor_momentum;
mod one_link;
mod one_way;
mod options;
mod output_error;
mod own;
mod parts;
mod plan;
mod planned;
mod position;
mod prior;
mod problem;
mod pseudo_inertia;
mod quadratic;
mod recommend;
mod redistributed;
mod relative_error;
mod repeat;
mod residual;
mod ridge;
mod robust;
mod run;
mod search;
mod settled;
mod simulated;
mod slow;
mod solve;
mod speed;
mod standard;
mod states;
mod stream;
mod structural;
mod tally;
mod term_rows;
mod terms;
mod tilt;
mod together;
mod torque_residuals;
mod total;
mod twin;
mod warnings;
mod window;
mod written;

#[cfg(test)]
mod rows_test;
#[cfg(test)]
mod tests;

pub use added_torque::added_torque;
pub use base::Base;
pub use bodies::as_bodies;
pub use cache::RowCache;
pub use chain::{chain_of, transmission_of};
pub use columns::{column_name, expression, preference, unit};
pub use combinations::Combinations;
pub use compared::{Compared, Comparison};
pub use contradicted::contradicted;
pub use covariance::{Ellipse, Estimate, t_quantile};
pub use cutoff::treatment_for;
pub use endogeneity::{Endogeneity, Verdict};
pub use equation::{Equation, Rows};
pub use error::IdentifyError;
pub use essential::{Essential, EssentialSet};
pub use estimator::{Estimator, Loss};
pub use excitation::NotExcited;
pub use factor::TriangularFactor;
pub use friction_map::{
    DroppedPass, FrictionFit, FrictionMap, FrictionMapOptions, FrictionPoint, friction_map,
};
pub use grouping::{agree, grouped};
pub use hints::Sizes;
pub use identification::{BaseParameter, Details, Identification, JointFigures};
pub use identified_robot::identified_robot;
pub use independent::{Independent, independent_columns};
pub use one_way::{OneWay, SLIDES, Slides};
pub use options::{ModelKind, Options};
pub use plan::Plan;
pub use planned::Planned;
pub use position::PositionTorque;
pub use prior::described;
pub use pseudo_inertia::{least_eigenvalue, pseudo_inertia};
pub use redistributed::redistributed;
pub use residual::{Dependence, ResidualReport, Series};
pub use settled::identify;
pub use standard::{StandardParameter, StandardSet};
pub use stream::each_rows;
pub use tally::Tally;
pub use tilt::BaseTilt;
pub use torque_residuals::torque_residuals;
