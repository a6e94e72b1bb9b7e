//! Excitation motions: motions that make the parameters of a robot identifiable.
//!
//! [`design`] finds Fourier series (Swevers et al. 1997) that are optimal for the base parameters within the limits on
//! position, velocity, acceleration and torque, and within the regions of the base frame that points of the links must
//! not leave. [`staged`] makes chirps, staircases, slow reversals and friction sweeps from the same limits of the
//! joints. [`poses()`] finds poses at rest for mass and centre of mass of a load at the flange, by a wrist sensor.
//! [`TrajectoryFile`] stores them all; [`replay`] runs one through the simulated closed loop.
//!
//! # Scaling
//! The columns of the regressor have different units, so its condition number alone has no meaning. With
//! [`Scaling::Sizes`] each column is divided by its own size: its root mean square over uniformly drawn states within
//! the limits. A singular value then tells how well a combination of parameters is excited, relative to the largest
//! possible excitation of one column. No prior value of a parameter enters, so an offset expected to be zero counts as
//! much as any other.
//!
//! Each joint's rows are divided by the standard deviation of its torque ([`Options::torque_noise`]). If that is not
//! given, they are divided by its torque limit, if several joints all have one.
//!
//! ```
//! use rig_excite::{Options, design};
//! use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = Robot::from_toml(ONE_LINK_TEMPLATE, "one-link.toml".as_ref())?;
//! let design = design(&robot, &Options::default(), |_, _| ())?;
//! println!("{}", design.file.to_toml(&robot));
//! # Ok(())
//! # }
//! ```
//!
//! Limits: no collisions; no [`rig_model::robot::Robot::effects`]; no controller errors (the limits hold for the
//! reference). [`staged`] does not check the regions of the workspace and says so.

mod bounds;
mod certificate;
mod criterion;
mod drives;
mod effort;

mod error;
mod feasible;
mod fit;
mod frame;
mod identified;
mod instants;
mod interpolation;
mod interval;
mod lanes;
mod motor_limits;
mod multisine;
mod optimise;
mod optimum;
mod options;
mod period;
mod poses;
mod problem;
mod quintic_move;
mod random;
mod replay;
mod schedule;
mod search;
mod setup;
mod sign;
mod stages;
mod torque_share;
mod trajectory_file;
mod workspace;
mod wrist_chain;
mod wrist_readings;

#[cfg(test)]
mod tests;

pub use certificate::{MotorReach, Reach};
pub use criterion::{Criterion, Values};
pub use effort::Effort;
pub use error::{ExciteError, LimitedTorque};
pub use multisine::{Multisine, MultisineOptions, multisine};
pub use optimum::{Clearance, Design, design, design_measured};
pub use options::{Options, Parameters, Scaling};
pub use period::default_period;
pub use poses::{PoseOptions, Poses, poses};
pub use random::drawn;
pub use replay::STEP as REPLAY_STEP;
pub use replay::{Noise, Replay, SETTLING, replay, replay_carrying};
pub use stages::{StagedKind, StagedOptions, staged};
pub use trajectory_file::{
    COASTING, DesignRecord, JointTrajectory, SampledReference, TrajectoryFile, load_reference,
    reference_at,
};
pub use wrist_readings::Carried;
