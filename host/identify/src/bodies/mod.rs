//! Standard parameters that a body can have: the prior and the physically consistent set.

pub(crate) mod consistent;
pub(crate) mod contradicted;
pub(crate) mod evidence;
pub(crate) mod fit_prior;
pub(crate) mod hints;
pub(crate) mod prior;
pub(crate) mod pseudo_inertia;
pub(crate) mod quadratic;
pub(crate) mod standard;
