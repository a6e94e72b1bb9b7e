//! Error of a scenario.

/// Reason why a scenario cannot be made.
#[derive(Debug, thiserror::Error)]
#[error("The scenario cannot be made: {0}")]
pub struct ScenarioError(pub String);
