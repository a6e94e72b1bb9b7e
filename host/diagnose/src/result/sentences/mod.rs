//! All sentences of a diagnosis, one file per topic, from the typed results of the engine.

pub(crate) mod described;
pub(crate) mod effect;
pub(crate) mod limits;
pub(crate) mod model;
pub(crate) mod motion;
pub(crate) mod number;
pub(crate) mod parameters;
pub(crate) mod place;
pub(crate) mod recordings;
pub(crate) mod refusal;
pub(crate) mod remainder;
pub(crate) mod residual;
pub(crate) mod treatment;
pub(crate) mod verdict;
