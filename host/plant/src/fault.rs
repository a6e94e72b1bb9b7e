//! Faults to inject while the rig runs.

use super::body::Body;

/// What is wrong with the rig at the moment. The default is nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// The encoder's cable is cut: the counter stands still.
    pub encoder_cut: bool,
    /// Counts by which the counter has jumped.
    pub encoder_jump: i32,
    /// The current converter delivers this code only.
    pub current_stuck: Option<u16>,
    /// The supply converter delivers this code only.
    pub supply_stuck: Option<u16>,
    /// The temperature converter delivers this code only.
    pub temperature_stuck: Option<u16>,
    /// The supply stands at this open-circuit voltage, V.
    pub supply: Option<f64>,
    /// The driver reports a fault and its outputs are off.
    pub driver: bool,
    /// The control tick before did not finish in its period.
    pub overrun: bool,
    /// A body hangs on the link beside its own. It arrives with the link's own speed.
    pub payload: Option<Body>,
    /// Torque from outside on the link, N·m.
    pub external_torque: f64,
}
