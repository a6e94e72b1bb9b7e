//! Information on a page beside the result.

/// Information on a page beside the result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Context {
    /// The command line that repeats the result.
    pub command: String,
    /// Name and text of the description that was written into the same folder.
    pub identified: Option<(String, String)>,
    /// Remarks about choices made to write that description.
    pub remarks: Vec<String>,
    /// Warnings from reading the recordings.
    pub warnings: Vec<String>,
}
