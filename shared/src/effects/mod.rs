//! Effects beyond the standard model, one file each. Simulator, identifier, diagnosis and the firmware's
//! precompensation use the same laws.
//!
//! An effect adds a torque to the drive's torque: τ = Y·π + Σ βₖ·hₖ(η; motion). The βₖ (*gains*) enter linearly, the
//! η (*shapes*) do not; the motion drives the hidden states. A few effects act elsewhere ([`Channel`]): on a sensor
//! reading, between motor and link, or between command and voltage.
//!
//! To add an effect, add its file, its line in the list of files below and its line in the `registry!` of [`Kind`].

mod about;
mod asymmetric_coulomb;
mod backlash;
mod cogging;
mod contact;
mod current_offset;
mod drive_deadzone;
mod effect;
mod encoder_eccentricity_joint;
mod encoder_eccentricity_motor;
mod gear_eccentricity;
mod gravity_tilt;
mod inertia_coupling;
mod instant;
mod joint_elasticity;
mod kind;
mod law;
mod load_friction;
mod measurement_delay;
mod payload;
mod position_friction;
mod presliding_dahl;
mod presliding_lugre;
mod presliding_maxwell;
mod quadratic_drag;
mod spring;
mod stribeck;
mod stribeck_exponential;
#[cfg(test)]
mod tests;
mod torque_offset;
mod torque_ripple;
mod torque_saturation;
mod viscous_warmup_heat;
mod viscous_warmup_temperature;
mod viscous_warmup_time;

pub use about::{About, Channel, Confusion, Direction, Need, Parameter, Periodic, Scale};
pub use backlash::transmission_torque;
pub use effect::{Effect, Memory};
pub use instant::Instant;
pub use kind::Kind;
pub use law::{GAINS, MEMORY, SHAPES};
