//! Constants of the position laws.

use super::adaptation::Adaptation;
use super::{ControlKind, Gains};
use crate::friction::Friction;
use crate::link::LinkParameters;
use crate::precompensation::PrecompensationSettings;

/// Constants of a law while it runs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Config<T> {
    /// Kind of law.
    pub kind: ControlKind,
    /// Feedback gains.
    pub gains: Gains<T>,
    /// Inertia that the gains were designed for, kg·m².
    pub design_inertia: T,
    /// Model for feed-forward and computed torque.
    pub model: LinkParameters<T>,
    /// Friction law for precompensation.
    pub friction: Friction<T>,
    /// Settings of the friction precompensation.
    pub precompensation: PrecompensationSettings<T>,
    /// Bounds and rates of the adaptive law.
    pub adaptation: Adaptation<T>,
    /// Highest joint torque, N·m.
    pub torque_limit: T,
    /// Time between two steps, s.
    pub period: T,
}
