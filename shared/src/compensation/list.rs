//! The list of a rig's effects.

use crate::effects::Effect;

/// Maximum number of effects that a rig compensates.
pub const EFFECTS: usize = 8;

/// The effects of a rig; unused places are at the end.
pub type Effects<T> = [Option<Effect<T>>; EFFECTS];
