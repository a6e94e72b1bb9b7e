//! Faults to inject while the rig runs.

use super::body::Body;

/// Current faults of the rig; none by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// The encoder's cable is cut: the counter does not change.
    pub encoder_cut: bool,
    /// Counts by which the counter has jumped.
    pub encoder_jump: i32,
    /// The current converter returns only this code.
    pub current_stuck: Option<u16>,
    /// The supply converter returns only this code.
    pub supply_stuck: Option<u16>,
    /// The temperature converter returns only this code.
    pub temperature_stuck: Option<u16>,
    /// The supply has this open-circuit voltage, V.
    pub supply: Option<f64>,
    /// The driver reports a fault and its outputs are off.
    pub driver: bool,
    /// The stop switch is open.
    pub stop_switch_open: bool,
    /// The last control tick did not finish in its period.
    pub overrun: bool,
    /// An additional body on the link. It is attached with the speed of the link.
    pub payload: Option<Body>,
    /// Torque from outside on the link, N·m.
    pub external_torque: f64,
}
