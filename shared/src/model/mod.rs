//! Models used for identification of one link, all linear in [`PARAMETER_NAMES`](crate::link::PARAMETER_NAMES):
//!
//! τ = J·q̈ + gc·cos q + gs·sin q + fv·q̇ + fc·sgn q̇ + off.
//!
//! | model | needs | error it brings |
//! | --- | --- | --- |
//! | [`differential`] | q, q̇, q̈ | that of the derivative of q̇ |
//! | [`filtered`] | q, q̇ | none beyond frequency warping, stated there |
//! | [`integral`] | q, q̇ | quadrature, stated there |
//!
//! Leaves out: presliding, Stribeck effect, load-dependent friction, elasticity of the gear.

pub mod differential;
pub mod filtered;
pub mod integral;

use crate::link::PARAMETER_COUNT;

/// One row of the regressor: the factor of each parameter.
pub type Row<T> = [T; PARAMETER_COUNT];
