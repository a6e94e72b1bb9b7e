//! The `rig` program as a library: its [`commands`], the [`pages`] of its reports, and the [`demo`] without hardware.

pub mod commands;
pub mod demo;
pub mod pages;
