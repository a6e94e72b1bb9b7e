//! The page of a diagnosis: the verdict first, then its evidence.

mod curves;
mod gap;
mod left;
mod limits;
mod page;
mod pictures;
mod steps;
#[cfg(test)]
mod tests;
mod treated;
mod words;

pub use page::diagnosis;
pub use pictures::{NAMES as PICTURE_NAMES, pictures};
pub use words::verdict;
