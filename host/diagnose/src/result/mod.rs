//! Steps, limits, pictures and sentences of a result.

pub(crate) mod described;
pub(crate) mod finish;
pub(crate) mod found;
pub(crate) mod limits;
pub(crate) mod motion;
pub(crate) mod pictures;
pub(crate) mod places;
pub(crate) mod remainder;
pub(crate) mod remarks;
pub(crate) mod sentences;
pub(crate) mod steps;
pub(crate) mod treatment;
pub(crate) mod tried;
