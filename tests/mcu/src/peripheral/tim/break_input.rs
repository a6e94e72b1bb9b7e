//! State of a break input.

use crate::time::Instant;

/// One of the break inputs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BreakInput {
    /// Levels of its sources: the pin, and comparators 1 to 4.
    pub(super) levels: [bool; 5],
    /// Time since which a source acts, before the filter.
    pub(super) since: Option<Instant>,
    /// It acts, behind the filter.
    pub(super) active: bool,
}

impl BreakInput {
    /// Returns an input whose pin has this level.
    pub(super) fn with_pin(high: bool) -> Self {
        let mut input = Self::default();
        input.levels[0] = high;
        input
    }
}
