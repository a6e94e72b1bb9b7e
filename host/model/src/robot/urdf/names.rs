//! Similar names: what a misspelt word was meant to be.

use strsim::osa_distance;

/// Returns the known name within two typing errors of `written`: missing, added or wrong letters, two that changed places,
/// or another case.
/// Names of up to four letters allow one error.
pub(super) fn nearest<'n>(written: &str, names: impl Iterator<Item = &'n str>) -> Option<&'n str> {
    let most = if written.len() <= 4 { 1 } else { 2 };
    within(written, names, most)
}

/// As [`nearest`], for the long names of links and joints: an error in four letters is allowed.
pub(super) fn nearest_long<'n>(
    written: &str,
    names: impl Iterator<Item = &'n str>,
) -> Option<&'n str> {
    within(written, names, written.chars().count().div_ceil(4).max(2))
}

fn within<'n>(written: &str, names: impl Iterator<Item = &'n str>, most: usize) -> Option<&'n str> {
    let written = written.to_lowercase();
    let near = names.map(|name| (osa_distance(&written, &name.to_lowercase()), name));
    near.filter(|(slips, _)| *slips <= most)
        .min_by_key(|(slips, _)| *slips)
        .map(|(_, name)| name)
}
