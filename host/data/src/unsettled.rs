//! Samples of the rig whose current was read before its amplifier had settled.

use rig_shared::safety::{Limit, LimitSet};

/// Columns of a recording of the rig that hold its marks. Another recording's `limits` have another meaning.
pub(crate) const MARKED_BY: [&str; 2] = ["limits", "mode"];

/// Returns the columns [`MARKED_BY`], in this order; none if the recording is not of the rig.
pub(crate) fn with_marks(extra: &[(String, Vec<f64>)]) -> Vec<(String, Vec<f64>)> {
    let column = |wanted: &&str| extra.iter().find(|(name, _)| name == wanted).cloned();
    let kept: Option<Vec<_>> = MARKED_BY.iter().map(column).collect();
    kept.unwrap_or_default()
}

/// Returns for each row whether the rig marked its current as not settled, from the columns kept by name. Empty if there
/// are no marks.
pub(crate) fn unsettled(extra: &[(String, Vec<f64>)]) -> Vec<bool> {
    let [limits, mode] = MARKED_BY.map(|wanted| extra.iter().find(|(name, _)| name == wanted));
    let is_marked = |set: &f64| LimitSet(*set as u8).has(Limit::Unsettled);
    match limits.zip(mode) {
        Some(((_, sets), _)) => sets.iter().map(is_marked).collect(),
        None => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_read_from_recordings_of_the_rig_alone() {
        let column = |name: &str, values: &[f64]| (name.to_owned(), values.to_vec());
        let limits = column("limits", &[0.0, 64.0, 63.0, 65.0, f64::NAN]);
        let mode = column("mode", &[3.0; 5]);
        assert!(unsettled(std::slice::from_ref(&limits)).is_empty());
        assert_eq!(
            unsettled(&[limits, mode]),
            [false, true, false, true, false]
        );
    }
}
