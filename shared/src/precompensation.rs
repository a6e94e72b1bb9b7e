//! Friction precompensation.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// How the friction law is turned into a feed-forward torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct PrecompensationSettings<T> {
    /// Off: no friction torque is added.
    pub enabled: bool,
    /// Share of the friction law that is compensated while sliding, 0 to 1.
    pub gain: T,
    /// Share near zero speed, below `gain` so that the loop cannot hunt, 0 to 1.
    pub gain_at_rest: T,
    /// Speed below which the measured velocity says nothing about the direction, rad/s.
    pub velocity_threshold: T,
}
