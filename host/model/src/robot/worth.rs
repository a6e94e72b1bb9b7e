//! Trust in the values of a description before any data: one table, used by `identify` and `diagnose`.
//!
//! The values of a TOML description, zeros included, are stated by the user on purpose. A URDF is an exchange file:
//! exporters fill `<dynamics>` with 0 or a placeholder, so its friction gives at most the order of magnitude.

/// Source of a description's values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Origin {
    /// A TOML description, or one that a program made: all values are stated on purpose.
    #[default]
    Own,
    /// A URDF file.
    Urdf,
}

/// Kinds of values that a description states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Mass, first moment and inertia of a link.
    Inertial,
    /// The same for the block that replaces a link without stated values.
    StandInBody,
    /// Inertia of rotor and gear, seen at the joint.
    DriveInertia,
    /// Viscous or Coulomb friction, at the joint or the motor.
    Friction,
    /// Constant torque.
    Offset,
}

/// Trust in a stated value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Worth {
    /// Right within this share of its size (one standard deviation).
    Share(f64),
    /// Right within this factor either way (one standard deviation of the logarithm) if it is not 0. Used only if the
    /// data do not determine the value; it never overrides the data.
    Factor(f64),
    /// No trust: the value counts as not stated.
    Unknown,
}

/// Inertial values of a description: a share of 2, right within a factor of about three. On the real arms
/// (docs/arms.md) errors on the hold-out agree within a few per cent for shares from 1 to 3. With 1 the Stäubli TX40's
/// momentum model has 52 of 60 values within two published standard deviations, with 2 and 3 it has 55.
pub const DESCRIBED: f64 = 2.0;
/// A stand-in body: an aluminium block between two joints. 3: real links differ from it by a factor of a few.
pub const STAND_IN: f64 = 3.0;
/// Friction in a URDF: a factor of 10. Of 1232 moving joints in the 69 URDF files of example-robot-data 6.0.0, 401 have
/// no `<dynamics>` and 238 have two zeros. Of 591 dampings above 0, 492 are one of 1, 0.5, 0.05, 0.1, 3, 0.001 and
/// 0.003, independent of the joint (counted 2026).
const URDF_FRICTION: f64 = 10.0;

/// Standard deviations between data and a stated value above which the value is rejected. 5: six in ten million true
/// values are that far off. The same limit applies to effects that differ from the description.
pub const CONTRADICTED: f64 = 5.0;

/// The table. Geometry, gear ratios and limits are not in it: they count as exact. A contradiction is a fault of
/// description or recording (docs/diagnosis.md). Placeholders count as not stated when the file is read.
pub fn worth(quantity: Quantity, origin: Origin, value: f64) -> Worth {
    match (quantity, origin) {
        (Quantity::Inertial, _) => Worth::Share(DESCRIBED),
        (Quantity::StandInBody, _) => Worth::Share(STAND_IN),
        // Exporters write this if the user entered nothing.
        (Quantity::Friction, Origin::Urdf) if value <= 0.0 => Worth::Unknown,
        // URDF has no element for it.
        (Quantity::DriveInertia, Origin::Urdf) => Worth::Unknown,
        (Quantity::DriveInertia | Quantity::Friction, Origin::Own) => Worth::Share(DESCRIBED),
        (Quantity::Friction, Origin::Urdf) => Worth::Factor(URDF_FRICTION),
        // It depends on sensors and postures, and is fitted whenever possible.
        (Quantity::Offset, _) => Worth::Unknown,
    }
}
