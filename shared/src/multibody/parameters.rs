//! The parameters of a joint and of its link.

use super::spatial::{Inertia, Symmetric3, Vector3};
use crate::scalar::Real;

/// Number of parameters, and so of regressor columns, of a joint.
pub const COLUMNS: usize = 14;

/// Names of the parameters in the order of every parameter vector. The joint's number (from 1) is appended if several
/// joints are listed.
///
/// | name | meaning | unit |
/// | --- | --- | --- |
/// | `m` | mass of link i | kg |
/// | `mx` `my` `mz` | first moment m·c in frame i | kg·m |
/// | `Ixx` … `Izz` | inertia about the origin of frame i, in frame i; `Ixy` is the matrix entry −∫x·y dm | kg·m² |
/// | `Ia` | drive inertia seen at the joint | kg·m² (revolute), kg (prismatic) |
/// | `fv` | viscous friction | N·m·s/rad, N·s/m |
/// | `fc` | Coulomb friction | N·m, N |
/// | `off` | constant torque | N·m, N |
pub const COLUMN_NAMES: [&str; COLUMNS] = [
    "m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz", "Ia", "fv", "fc", "off",
];

/// Indices of the parameters within the [`COLUMNS`] of a joint.
pub mod column {
    /// Mass.
    pub const MASS: usize = 0;
    /// The first of the three first moments.
    pub const FIRST_MOMENT: usize = 1;
    /// The first of the six inertias, in the order xx xy xz yy yz zz.
    pub const INERTIA: usize = 4;
    /// Drive inertia seen at the joint.
    pub const DRIVE_INERTIA: usize = 10;
    /// Viscous friction.
    pub const VISCOUS: usize = 11;
    /// Coulomb friction.
    pub const COULOMB: usize = 12;
    /// Constant torque.
    pub const OFFSET: usize = 13;
}

/// The ten inertial parameters of a link as mass, first moment and inertia.
#[inline(always)]
pub(super) fn inertia<T: Real>(parameters: &[T; COLUMNS]) -> Inertia<T> {
    let [m, mx, my, mz, xx, xy, xz, yy, yz, zz, ..] = *parameters;
    Inertia {
        mass: m,
        first_moment: Vector3([mx, my, mz]),
        inertia: Symmetric3 {
            xx,
            xy,
            xz,
            yy,
            yz,
            zz,
        },
    }
}
