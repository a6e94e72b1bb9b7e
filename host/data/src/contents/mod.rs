//! What a file of measurements holds, whether or not it is a recording of a robot: channels, rates, gaps, ranges, and the
//! columns that they probably are.
//!
//! Nothing here needs a robot, and memory does not grow with the file.

mod intake;
mod likely;
mod messages;
mod names;
mod picture;
mod proposal;
mod read;
mod stored_columns;
mod table;
mod text;
mod topic;

pub use intake::stand_in;
pub use picture::Picture;
pub use proposal::{Proposal, Proposed};
pub use read::contents;
pub use topic::{Channel, Contents, Step, Time, TimeSource, Topic};

#[cfg(test)]
mod tests;
