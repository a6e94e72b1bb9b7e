//! Lists of a fixed length in a description: neither shorter nor longer.

use serde::de::{Deserialize, Deserializer, Error};

/// Exactly `N` numbers. Serde's own arrays stop reading at the last one and never see what follows.
pub(super) fn exact<'de, D: Deserializer<'de>, const N: usize>(
    from: D,
) -> Result<[f64; N], D::Error> {
    let list = Vec::<f64>::deserialize(from)?;
    let length = list.len();
    list.try_into()
        .map_err(|_| D::Error::invalid_length(length, &format!("a list of {N} numbers").as_str()))
}

/// The same of a list that may be absent; `#[serde(default)]` goes with it.
pub(super) fn exact_or_none<'de, D: Deserializer<'de>, const N: usize>(
    from: D,
) -> Result<Option<[f64; N]>, D::Error> {
    exact(from).map(Some)
}
