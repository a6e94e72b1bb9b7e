//! Clocks of messages.

/// Where the time of messages with header stamps comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Clock {
    /// From the stamps.
    #[default]
    Stamp,
    /// From the recorder, for topics that are stamped by several clocks.
    Log,
}

/// Why a stamp is not used if the recorder's clock is wanted; follows "the header stamp of message 1".
pub(super) const UNWANTED: &str = "is not used";

impl Clock {
    /// Returns the clock of a name.
    ///
    /// # Errors
    /// What is wrong, one clause.
    pub(super) fn named(name: &str) -> Result<Self, String> {
        match name {
            "stamp" => Ok(Self::Stamp),
            "log" => Ok(Self::Log),
            _ => Err(format!(
                "`{name}` is no clock; give stamp for the header stamps of messages, or log for the times at which they were logged"
            )),
        }
    }
}
