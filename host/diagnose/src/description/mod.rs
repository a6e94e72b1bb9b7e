//! What the description states: effects, and how far its parameters may change.

pub(crate) mod described_effects;
pub(crate) mod fate;
pub(crate) mod lifted_limit;
pub(crate) mod parameter_prior;
pub(crate) mod preferred_values;
