//! The kinds of swept sines.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Law of the frequency from start to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Sweep {
    /// The same change each second.
    Linear,
    /// The same ratio each second; both frequencies above zero.
    Logarithmic,
}
