//! The steps of an identification.

pub(crate) mod check;
pub(crate) mod freed;
pub(crate) mod further;
pub(crate) mod own;
pub(crate) mod settled;
pub(crate) mod solve;
pub(crate) mod warnings;
