//! Control laws of arms in a simulated closed loop, and their evaluation.
//!
//! The laws are those of [`rig_shared::control::arm`]. The true robot is the simulation of a description
//! ([`rig_model::simulate`]): dry friction that sticks, coupled drives, effects. A law sees encoder counts, the velocity of
//! the firmware's observer and a measured force; its torque is limited, held for a tick, and acts a tick late. The law's
//! model may be another one than the robot.
//!
//! ```
//! use rig_control::{Bench, LawKind, LawModel, Settings, default_reference, references};
//! use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
//! use rig_model::simulate::Model;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = Robot::from_toml(ONE_LINK_TEMPLATE, "one-link.toml".as_ref())?;
//! let truth = Model::from_robot(&robot)?;
//! let settings = Settings::default();
//! let reference = references(&default_reference(&robot, settings.rate, 5.0))?;
//! let bench = Bench {
//!     robot: &robot,
//!     truth: &truth,
//!     reference: &reference,
//!     tool: [0.6, 0.0, 0.0],
//!     settings,
//!     wrong: None,
//! };
//! let run = bench.track(LawKind::ComputedTorque, &LawModel::of(&robot)?, "the robot itself")?;
//! assert!(run.measures.tool_rms < 1e-3);
//! # Ok(())
//! # }
//! ```

mod adaptation;
mod closed_loop;
mod contact_task;
mod controller;
mod design;
mod effects;
mod error;
mod evaluate;
mod force_sensing;
mod law_model;
mod loop_margin;
mod measures;
mod mobility;
mod motor_limits;
mod plant;
mod position_limits;
mod recording;
mod reference;
mod result;
mod sensing;
mod settings;
mod start_pose;
mod surface;
mod task_path;
#[cfg(test)]
mod tests;
mod tool;
mod warnings;

pub use adaptation::EXCITED;
pub use closed_loop::Trace;
pub use contact_task::{ContactOptions, ContactTask};
pub use error::ControlError;
pub use evaluate::{Bench, Run};
pub use law_model::LawModel;
pub use recording::save;
pub use reference::{default_reference, references};
pub use result::{
    Adaptation, Adapted, Contact, Evaluation, Failed, JointMeasures, Robustness, Tracking,
};
pub use sensing::resolution;
pub use settings::{LawKind, Settings};
pub use start_pose::tool_point;
pub use surface::Surface;
