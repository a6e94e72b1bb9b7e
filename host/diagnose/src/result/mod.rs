//! Steps, limits, pictures and sentences of a result.

pub(crate) mod finish;
pub(crate) mod found;
pub(crate) mod limits;
pub(crate) mod pictures;
pub(crate) mod remarks;
pub(crate) mod sentences;
pub(crate) mod steps;
pub(crate) mod treatment;
