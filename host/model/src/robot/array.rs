//! Lists of a fixed length in a description; other lengths are refused.

use serde::de::{Deserialize, Deserializer, Error};

/// Reads exactly `N` numbers. Serde's own arrays ignore numbers after the last one.
pub(super) fn exact<'de, D: Deserializer<'de>, const N: usize>(
    from: D,
) -> Result<[f64; N], D::Error> {
    let list = Vec::<f64>::deserialize(from)?;
    let length = list.len();
    list.try_into()
        .map_err(|_| D::Error::invalid_length(length, &format!("a list of {N} numbers").as_str()))
}

/// The same for a list that may be absent; used with `#[serde(default)]`.
pub(super) fn exact_or_none<'de, D: Deserializer<'de>, const N: usize>(
    from: D,
) -> Result<Option<[f64; N]>, D::Error> {
    exact(from).map(Some)
}
