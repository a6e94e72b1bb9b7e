//! Described torque limits that are ignored.

/// A described torque limit that the recorded torque exceeds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LiftedLimit {
    /// Name of the joint.
    pub(crate) joint: String,
    /// Unit of the torques, ASCII.
    pub(crate) unit: &'static str,
    /// Largest recorded torque.
    pub(crate) most: f64,
    /// The described limit.
    pub(crate) limit: f64,
    /// Share of the samples beyond the limit, per cent.
    pub(crate) percent: f64,
}
