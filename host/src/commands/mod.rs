//! commands

pub mod excite;
pub mod simulate;
pub mod ui;
