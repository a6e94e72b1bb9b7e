//! The `rig` program as a library: [`commands`] runs the commands, [`pages`] composes the reports, and [`demo`] is the
//! demonstration without hardware.

pub mod commands;
pub mod demo;
pub mod pages;
