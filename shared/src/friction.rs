//! Friction laws.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Parameters of the static friction law, joint-side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Friction<T> {
    /// Coulomb friction Fc, N·m.
    pub coulomb: T,
    /// Viscous friction Fv, N·m·s/rad.
    pub viscous: T,
    /// Breakaway minus Coulomb friction (the book's F_id), N·m; 0 leaves the Stribeck effect out.
    pub breakaway_excess: T,
    /// Stribeck velocity, rad/s.
    pub stribeck_velocity: T,
    /// Half the difference of Coulomb friction between the two directions, N·m.
    pub coulomb_asymmetry: T,
    /// Half the difference of viscous friction between the two directions, N·m·s/rad.
    pub viscous_asymmetry: T,
    /// Friction torque per transmitted torque, N·m/(N·m).
    pub load_coefficient: T,
}
