//! Descriptions of the drives, and the parameters of their motors.

/// Number of parameters, and so of regressor columns, of a motor.
pub const MOTOR_COLUMNS: usize = 3;

/// Names of the motor parameters in their order; the motor's number (from 1) is appended.
///
/// | name | meaning | unit, coupled drive | unit, varying drive |
/// | --- | --- | --- | --- |
/// | `Iam` | inertia of the rotor | kg·m² (kg), at the drive's own joint | kg·m², at the motor |
/// | `fvm` | viscous friction of the motor | N·m·s/rad (N·s/m), at the own joint | N·m·s/rad, at the motor |
/// | `fcm` | Coulomb friction of the motor | N·m (N), at the own joint | N·m, at the motor |
pub const MOTOR_COLUMN_NAMES: [&str; MOTOR_COLUMNS] = ["Iam", "fvm", "fcm"];

/// Indices of the parameters within the [`MOTOR_COLUMNS`] of a motor.
pub mod motor_column {
    /// Rotor inertia.
    pub const INERTIA: usize = 0;
    /// Viscous friction.
    pub const VISCOUS: usize = 1;
    /// Coulomb friction.
    pub const COULOMB: usize = 2;
}

/// A ball screw that turns a crank: a term of a motor's position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScrewMap<'a> {
    /// Advance of the nut per turn of the motor, m; negative if the screw shortens as the motor turns forwards.
    pub lead: f64,
    /// s, m².
    pub constant: f64,
    /// m, the factor of cos φ, m².
    pub cosine: f64,
    /// n, the factor of −sin φ, m².
    pub sine: f64,
    /// c: the crank's angle is Σ c_j·q_j + offset.
    pub weights: &'a [f64],
    /// Crank's angle at q = 0, rad.
    pub offset: f64,
}

/// One motor's position as a function of the joint coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveMap<'a> {
    /// g: motor radians per radian (or metre) of each joint.
    pub ratios: &'a [f64],
    /// The screw, if there is one.
    pub screw: Option<ScrewMap<'a>>,
    /// Constant added, rad.
    pub zero: f64,
    /// True if gear and shaft have an inertia that turns with the joint and not with the motor.
    pub joint_inertia: bool,
}

/// Form of a motor's row of the Jacobian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveKind {
    /// Constant, with an entry for its own joint only.
    Simple,
    /// Constant, with entries for other joints too.
    Coupled,
    /// Depends on the position.
    Varying,
}
