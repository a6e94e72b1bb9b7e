//! Everything that the `rig` program does, as a library.
//!
//! A sample's way: a [`link`] or a file in [`data`] → [`prepare`] → [`identify`] → [`report`];
//! [`robot`] is what is known beforehand, [`effects`] what of it goes beyond the standard model, [`excite`] and [`simulate`] make motions, [`plant`] is the
//! emulated rig that stands in for hardware, and [`commands`] are the program's verbs.

pub mod batch;
pub mod commands;
pub mod data;
pub mod demo;
pub mod diagnose;
pub mod effects;
pub mod emulated;
pub mod excite;
pub mod files;
pub mod identify;
pub mod link;
pub mod pages;
pub mod plant;
pub mod prepare;
pub mod report;
pub mod robot;
pub mod simulate;
pub mod validate;
