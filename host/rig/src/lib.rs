//! The `rig` program as a library: [`commands`] are its verbs, [`pages`] what its reports show, [`demo`] the main job
//! without hardware.

pub mod commands;
pub mod demo;
pub mod pages;
