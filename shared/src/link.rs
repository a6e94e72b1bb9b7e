//! One-link dynamics, linear in its parameters.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Number of parameters of the one-link model.
pub const PARAMETER_COUNT: usize = 6;

/// Names of the parameters, in the order of every vector of them.
pub const PARAMETER_NAMES: [&str; PARAMETER_COUNT] = ["J", "gc", "gs", "fv", "fc", "off"];

/// Parameters of τ = J·q̈ + gc·cos q + gs·sin q + fv·q̇ + fc·sgn q̇ + off, joint-side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct LinkParameters<T> {
    /// Inertia about the joint axis with the drive's reflected inertia, kg·m².
    pub inertia: T,
    /// Gravity torque at q = 0, N·m (multiplies cos q).
    pub gravity_cos: T,
    /// Gravity torque at q = π/2, N·m (multiplies sin q).
    pub gravity_sin: T,
    /// Viscous friction, N·m·s/rad.
    pub viscous: T,
    /// Coulomb friction, N·m.
    pub coulomb: T,
    /// Constant torque, N·m.
    pub offset: T,
}
