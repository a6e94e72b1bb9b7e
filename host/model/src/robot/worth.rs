//! What the values of a description are worth before any data: one table, used by `identify` and `diagnose` alike.
//!
//! A TOML description is the user's own: its values, zeros among them, are stated on purpose. A URDF is an exchange file, written by
//! exporters that fill `<dynamics>` with 0 or a token; its friction says at most in which decade the friction is.

/// Where a description's values come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Origin {
    /// A TOML description, or one that a program made: values stated on purpose.
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
    /// The same of the block that stands in for a link of which nothing is stated.
    StandInBody,
    /// Inertia of rotor and gear, seen at the joint.
    DriveInertia,
    /// Viscous or Coulomb friction, at the joint or the motor.
    Friction,
    /// Constant torque.
    Offset,
}

/// What a stated value is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Worth {
    /// Right to this share of its size (one standard deviation).
    Share(f64),
    /// Right to this factor either way (one standard deviation of the logarithm) where it is not 0. It is a first value where the
    /// data say nothing, and no knowledge against what they say.
    Factor(f64),
    /// Nothing: the value is not stated, whatever stands there.
    Unknown,
}

/// Inertial values of a description: right to a factor of about three, a share of 2. On the real arms (docs/arms.md) errors on the
/// hold-out are the same to a few per cent for shares from 1 to 3; at 1 the Stäubli TX40's momentum model has 52 of 60 values within
/// two published standard deviations, at 2 and 3 it has 55.
pub const DESCRIBED: f64 = 2.0;
/// A stand-in body: an aluminium block between two joints. 3: real links differ from it by a factor of a few.
pub const STAND_IN: f64 = 3.0;
/// Friction in a URDF, a factor. 10: of 1232 moving joints in the 69 URDF files of example-robot-data 6.0.0, 401 have no `<dynamics>` and
/// 238 have two zeros; of 591 dampings above 0, 492 are one of 1, 0.5, 0.05, 0.1, 3, 0.001 and 0.003, whatever the joint (counted 2026).
const URDF_FRICTION: f64 = 10.0;

/// Standard deviations between data and a stated value from which on the value is no knowledge any more. 5: six in ten million true
/// values are that far off; the same as for an effect whose value differs from the description's.
pub const CONTRADICTED: f64 = 5.0;

/// The table. Geometry, gear ratios and limits are not in it: they are taken as exact, and what contradicts them is a fault of
/// description or recording (docs/diagnosis.md), but for placeholders, which count as not stated when the file is read.
pub fn worth(quantity: Quantity, origin: Origin, value: f64) -> Worth {
    match (quantity, origin) {
        (Quantity::Inertial, _) => Worth::Share(DESCRIBED),
        (Quantity::StandInBody, _) => Worth::Share(STAND_IN),
        // What exporters write where nothing was entered.
        (Quantity::Friction, Origin::Urdf) if value <= 0.0 => Worth::Unknown,
        // URDF has no place for it.
        (Quantity::DriveInertia, Origin::Urdf) => Worth::Unknown,
        (Quantity::DriveInertia | Quantity::Friction, Origin::Own) => Worth::Share(DESCRIBED),
        (Quantity::Friction, Origin::Urdf) => Worth::Factor(URDF_FRICTION),
        // It is a matter of sensors and postures, and fitted wherever it can be.
        (Quantity::Offset, _) => Worth::Unknown,
    }
}
