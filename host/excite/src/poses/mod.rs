//! Poses at rest that identify mass and centre of mass of a load by a wrist sensor.

mod design;
mod exchange;
mod information;
mod route;
mod space;

pub use design::{PoseOptions, Poses, poses};
