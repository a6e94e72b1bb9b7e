//! The robot description: read from TOML, URDF or MJCF, written back.
//!
//! Joint-side SI units throughout; angles grow in the positive sense of the joint axis.
//!
//! Frames follow the modified Denavit–Hartenberg convention (Craig, *Introduction to Robotics*, 1989,
//! eq. 3.6; Khalil & Dombre 2002, sec. 3.2): frame i−1 → i is
//! RotX(alpha) · TransX(a) · RotZ(theta + σ̄q) · TransZ(d + σq), with σ = 1 where prismatic, σ̄ = 1 − σ.

mod angles;
mod array;
mod ball_screw_crank;
mod band;
mod bodies;
mod check;
mod check_drives;
mod check_effects;
mod check_followers;
mod check_joint;
mod check_workspace;
mod degrees;
mod description;
mod dh;
mod draft;
mod drive;
mod drives;
mod effects;
mod encoding;
mod error;
mod fault;
mod flange;
mod follower;
mod frame;
mod geometry_only;
mod implausible;
mod inertia;
mod joint;
mod joint_pose;
mod link_size;
mod links;
mod load;
mod load_body;
mod mjcf;
mod numbers;
mod placed;
mod right_angle;
mod serial_robot;
mod templates;
mod text;
mod toml_message;
mod uncertainty;
mod unit_check;
mod unlikely;
mod urdf;
mod voltage_controller;
mod workspace;
mod worth;
mod wrist_sensor;
mod written;

pub use ball_screw_crank::BallScrewCrank;
pub use band::{IdentifiedBand, MOST_LEAD};
pub use description::{Description, audit_file};
pub use drive::{Drive, MotorLimits};
pub use effects::{EFFECT_NAMES, RobotEffect, plausible_range, title_of, unit_of};
pub use error::{MAX_BYTES, Place, RobotError};
pub use fault::{is_safe_magnitude, written};
pub use flange::Flange;
pub use follower::Follower;
pub use joint::{Controller, Inertial, Joint, JointFriction, JointKind, JointLimits};
pub use load::Load;
pub use load_body::CentredBody;
pub use mjcf::MjcfJoints;
pub use placed::Placed;
pub use serial_robot::Robot;
pub use templates::{
    DOUBLE_PENDULUM, EDDA_TEMPLATE, EMPS, IRP6_TEMPLATE, ONE_LINK_TEMPLATE, TX40, XL330, template,
};
pub use text::joint_place;
pub use uncertainty::Uncertainty;
pub use urdf::{
    Audit, AuditCheck, AuditFinding, ChainChoice, Original, Urdf, audit, is_placeholder,
};
pub use voltage_controller::{AntiWindup, Demand, VoltageController};
pub use workspace::Region;
pub use worth::{CONTRADICTED, DESCRIBED, Origin, Quantity, STAND_IN, Worth, worth};
pub use wrist_sensor::{LARGEST_GAIN_STD, Reads, WristSensor};

#[cfg(test)]
mod drives_test;
#[cfg(test)]
mod tests;
