//! Numbers in sentences.

use rig_output::format_significant;

/// Formats a number with three digits.
pub(crate) fn number(x: f64) -> String {
    format_significant(x, 3)
}

/// Formats a share as per cent with three digits.
pub(crate) fn percent(share: f64) -> String {
    format!("{} %", format_significant(100.0 * share, 3))
}
