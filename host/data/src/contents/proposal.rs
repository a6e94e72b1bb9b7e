//! The columns that the channels of a file probably are.

use serde::Serialize;

/// A column that a channel probably is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Proposed {
    /// Name of the column: `t`, `q1`, `tau1`, …
    pub column: String,
    /// Topic of the channel; empty for a text file.
    pub topic: String,
    /// The channel.
    pub channel: String,
    /// Its probable unit, if it is not that of the column.
    pub unit: Option<&'static str>,
    /// Why, one clause.
    pub why: String,
}

impl Proposed {
    /// Returns the channel as `--map` takes it: with its topic in front.
    pub fn full_name(&self) -> String {
        match self.topic.trim_start_matches('/') {
            "" => self.channel.clone(),
            topic => format!("{topic}/{}", self.channel),
        }
    }
}

/// The columns of a file for the other commands.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Proposal {
    /// The columns.
    pub columns: Vec<Proposed>,
    /// True if the commands find these columns without options, unless `refusal` says why they refuse the file.
    pub is_plain: bool,
    /// The error with which `rig identify` refuses the file, with these options if there are any; `None` if it reads every
    /// row.
    pub refusal: Option<String>,
    /// Options that tell the commands these columns; empty if they find them.
    pub options: Vec<String>,
    /// What a recording needs and the file lacks, one sentence each.
    pub missing: Vec<String>,
    /// What should be looked at, one sentence each.
    pub doubts: Vec<String>,
}
