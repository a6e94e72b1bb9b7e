//! Nominal parameters of one joint, and which of them a refit keeps.

/// Nominal parameters of one joint while the others stand: inertia, gravity with cos q and with sin q, viscous and
/// Coulomb friction, offset; SI.
pub type Nominal = [f64; 6];

/// Nominal parameters of a joint that a refit keeps as described.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Held {
    /// The direction of gravity.
    pub gravity: bool,
    /// The constant torque.
    pub constant: bool,
}
