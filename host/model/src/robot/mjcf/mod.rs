//! Reads MJCF, the model format of MuJoCo, and writes the values of joints for it.
//!
//! Formats: "XML Reference" of the MuJoCo documentation (Google DeepMind, version 3). Read: bodies, hinge and slide joints,
//! `<inertial>` and its bounds, frames, armature and damping of joints and actuators, frictionloss, gear of actuators, gravity,
//! classes of defaults. Left out: geoms and what MuJoCo computes from them, contacts and ranges (MJCF states no speed limit,
//! without which a description has no limits), and with a remark what `left_out.rs` names.

mod actuators;
mod chain;
mod elements;
mod left_out;
mod orientation;
mod schema;
mod tree;
mod write;

pub(super) use chain::{Read, is_mjcf, read};
pub use write::MjcfJoints;

#[cfg(test)]
mod tests;
