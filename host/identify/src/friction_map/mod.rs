//! Friction against speed, from a recording with stretches of constant speed.

mod build;
mod cause;
mod check;
mod consistency;
mod law;
mod map;
mod passes;
mod rows;
mod sweep;
mod text;

pub use build::friction_map;
pub use map::{DroppedPass, FrictionFit, FrictionMap, FrictionMapOptions, FrictionPoint};
