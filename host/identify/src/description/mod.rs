//! Identified values as a description of the robot.

pub(crate) mod as_bodies;
pub(crate) mod combinations;
pub(crate) mod identified_robot;
pub(crate) mod one_link;
pub(crate) mod redistributed;
pub(crate) mod written;
