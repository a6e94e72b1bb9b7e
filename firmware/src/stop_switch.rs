//! The stop switch: a normally closed switch whose opening ends every motion under control. It is no safety function.
//!
//! One reading of an open switch counts, so nothing delays the stop. An opening is never forgotten: if the switch bounces and
//! closes during the stop, the fault follows all the same. Only the arming waits until the switch has stayed closed.

/// Time for which the switch must have been closed before the rig is armed, s. Contacts bounce for some ms; 50 ms is ten
/// times as long.
const SETTLING_SECONDS: f32 = 0.05;

/// What is known of the switch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct StopSwitch {
    /// True from an opening during a motion until the fault has latched, or the bridge is off.
    pub(crate) stopping: bool,
    /// First tick after the last opening.
    pub(crate) closed_since: u64,
}

impl StopSwitch {
    /// Returns true if the switch has been closed for long enough at this tick. `period`: control period, s.
    pub(crate) fn has_settled(self, tick: u64, period: f32) -> bool {
        tick.saturating_sub(self.closed_since) as f32 * period >= SETTLING_SECONDS
    }
}
