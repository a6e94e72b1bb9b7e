//! Kinds of experiments.

use serde::Serialize;

use crate::experiment::family::Family;

/// Kind of an experiment; serialises to its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(into = "String")]
pub enum ExperimentKind {
    /// A log with the drive off.
    DriveOffLog,
    /// A motion without external loads.
    PullsOff,
    /// Current and voltage together.
    CurrentAndVoltage,
    /// Motions of one joint at a time.
    OneJointAtATime,
    /// A fast motion against gravity.
    FastLift,
    /// A motion over the whole range.
    WholeRange,
    /// One motion at two speeds.
    FastAndSlow,
    /// One motion with the base as it stands and turned.
    BaseTurned,
    /// A motion from cold to warm.
    WarmUp,
    /// One motion with two payloads.
    PayloadSwap,
    /// A motion alone.
    Motion(Family),
    /// A motion that decides with two payloads.
    WithPayload(Family),
    /// A motion that decides with the base as it stands and turned.
    WithBaseTurned(Family),
    /// Data for an effect that is not testable.
    NotTestableYet,
}

impl std::fmt::Display for ExperimentKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::DriveOffLog => "drive-off-log",
            Self::PullsOff => "pulls-taken-off",
            Self::CurrentAndVoltage => "current-and-voltage",
            Self::OneJointAtATime => "one-joint-at-a-time",
            Self::FastLift => "fast-lift",
            Self::WholeRange => "whole-range",
            Self::FastAndSlow => "fast-and-slow",
            Self::BaseTurned => "base-turned",
            Self::WarmUp => "warm-up",
            Self::PayloadSwap => "payload-swap",
            Self::Motion(family) => family.name(),
            Self::WithPayload(family) => return write!(f, "payload-swap: {}", family.name()),
            Self::WithBaseTurned(family) => return write!(f, "base-turned: {}", family.name()),
            Self::NotTestableYet => "what is not testable yet",
        })
    }
}

impl From<ExperimentKind> for String {
    fn from(kind: ExperimentKind) -> Self {
        kind.to_string()
    }
}
