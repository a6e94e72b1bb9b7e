//! commands

pub mod ui;
