//! The structure of a robot: base parameters, and which of them the data identify.

pub(crate) mod base;
pub(crate) mod chain;
pub(crate) mod columns;
pub(crate) mod essential;
pub(crate) mod excitation;
pub(crate) mod grouping;
pub(crate) mod independent;
pub(crate) mod states;
pub(crate) mod structural;
