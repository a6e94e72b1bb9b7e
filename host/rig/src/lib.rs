//! The `rig` program as a library: its [`commands`], the [`pages`] of its reports, the [`demo`] without hardware, and the
//! [`c_header`] for controllers in C.

pub mod c_header;
pub mod commands;
pub mod demo;
pub mod pages;
