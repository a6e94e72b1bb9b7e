//! Diagnoses of recordings from outside: other simulators, real robots, simulated rigs.
#![allow(clippy::unwrap_used, clippy::panic)]

mod arm;
mod identified;
pub(crate) mod made;
mod one_way;
mod pendulum;
pub(crate) mod planar;
mod recorded;
mod short;
