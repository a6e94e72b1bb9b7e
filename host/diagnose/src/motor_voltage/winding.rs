//! Results from the voltage of one joint's motor.

use crate::outcome::{Absorbed, Detectable, Map, Place, Remainder, Step, Tried};

/// Results from the voltage of one joint's motor.
pub(crate) struct Winding {
    /// From 0.
    pub(crate) joint: usize,
    /// Sensor reading without a current, as a torque at the joint, and its standard deviation, N·m or N.
    pub(crate) offset: [f64; 2],
    /// A sentence if the back-EMF contradicts the torque constant.
    pub(crate) constant: Option<String>,
    pub(crate) remarks: Vec<String>,
    pub(crate) tried: Tried,
    pub(crate) detectable: Option<Detectable>,
    pub(crate) dead_zone: Option<DeadZone>,
    pub(crate) left: Option<Remainder>,
}

/// A dead zone of the inverter.
pub(crate) struct DeadZone {
    /// True if the description states it.
    pub(crate) described: bool,
    pub(crate) volts: f64,
    pub(crate) step: Step,
    pub(crate) places: Vec<Place>,
    pub(crate) absorbed: Vec<Absorbed>,
    pub(crate) map: Map,
}

/// Returns true if any named dead zone is not in the description.
pub(crate) fn name_something(windings: &[Winding]) -> bool {
    let found = |w: &Winding| w.dead_zone.as_ref().is_some_and(|dead| !dead.described);
    windings.iter().any(found)
}

/// Returns true if the voltages contradict the description's values.
pub(crate) fn contradict(windings: &[Winding]) -> bool {
    windings.iter().any(|w| w.constant.is_some())
}

/// Returns the unexplained remainder of the voltages.
pub(crate) fn left_of_voltage(windings: &[Winding]) -> Option<Remainder> {
    let left = windings.iter().filter_map(|w| w.left.clone());
    left.max_by(|a, b| a.ratio.total_cmp(&b.ratio))
}
