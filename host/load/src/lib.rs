//! The ten inertial parameters of a load at the flange: from a six-axis wrist sensor, from joint torques, or from both.
//!
//! [`identify_load`] estimates mass, centre of mass and inertia with their standard deviations. With a sensor it also
//! estimates its bias, drift and rotation, and finds exchanged, reversed, dead and saturated channels. What the data do
//! not show is named, with the pose or motion that would show it.
//!
//! A load of 2 kg on a one-link arm, from three poses:
//!
//! ```
//! use rig_data::prepare::InMemory;
//! use rig_data::{Block, JointColumns, WRENCH_COLUMNS};
//! use rig_load::{LoadOptions, identify_load};
//! use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = Robot::from_toml(ONE_LINK_TEMPLATE, "one-link.toml".as_ref())?;
//! let q: Vec<f64> = vec![-1.5, -0.4, 0.6, 1.4];
//! // The weight in the axes of the link, which turns in the vertical plane; the load's centre is 0.1 m along x.
//! // A channel that the load does not act on still reads some noise: one that never changes is refused as dead.
//! let weight = |q: &f64| [-19.62 * q.sin(), -19.62 * q.cos(), 1e-6 * q];
//! let read = |column: usize| -> Vec<f64> {
//!     q.iter()
//!         .map(|q| match column {
//!             0..=2 => weight(q)[column],
//!             5 => 0.1 * weight(q)[1],
//!             _ => 1e-6 * q,
//!         })
//!         .collect()
//! };
//! let block = Block {
//!     t: vec![0.0, 1.0, 2.0, 3.0],
//!     joints: vec![JointColumns { q: q.clone(), ..JointColumns::default() }],
//!     extra: (0..6).map(|c| (WRENCH_COLUMNS[c].to_owned(), read(c))).collect(),
//!     first_line: 2,
//!     ..Block::default()
//! };
//! let poses = InMemory { label: "poses".into(), blocks: vec![block] };
//! let load = identify_load(&robot, &[&poses], &[], &LoadOptions::default())?;
//! assert!((load.mass.value - 2.0).abs() < 1e-3);
//! assert!((load.centre[0].value - 0.1).abs() < 1e-3);
//! # Ok(())
//! # }
//! ```

mod axes;
mod body;
mod candidates;
mod causes;
mod central;
mod changed_columns;
mod channels;
mod clipping;
mod controllers;
mod curved_bias;
mod cut_channel;
mod cut_torque;
mod error;
mod estimate;
mod faulty_rows;
mod findings;
mod frozen;
mod gain_error;
mod hanging;
mod identify;
mod intake;
mod jump;
mod known_mass;
mod limits;
mod load_friction;
mod missing;
mod motion_sample;
mod mounting;
mod noise_floor;
mod odd_pose;
mod options;
mod pace;
mod pose_noise;
mod poses;
mod reach;
mod result;
mod rows;
mod selection;
mod sensor;
mod settle;
mod statistics;
mod system;
#[cfg(test)]
mod tests;
mod torque;
mod torque_noise;
mod torqueless;
mod units;
mod urdf_link;
mod wrench_row;

pub use controllers::{ControllerNumbers, controller_numbers, incomplete_numbers};
pub use curved_bias::Curve;
pub use error::LoadError;
pub use findings::{Bias, SensorFindings, Trace};
pub use gain_error::GainError;
pub use identify::identify_load;
pub use known_mass::MassCheck;
pub use load_friction::LoadFriction;
pub use options::{By, KnownMass, LoadOptions};
pub use result::{
    Agreement, LoadIdentification, LoadParameter, NotShown, TorqueFindings, Value,
    parameter_symbols,
};
pub use rows::FEWEST_ROWS;
pub use torque::TorqueTrace;
pub use urdf_link::urdf_link;
