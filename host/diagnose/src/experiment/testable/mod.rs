//! Effects that recordings cannot show, with the missing data and the remedy.
//!
//! Leaves out: whether the effect is large enough; see the detectable sizes.

mod confounded;
mod evidence;
mod needs;
#[cfg(test)]
mod tests;

pub use confounded::confounded;
pub use needs::not_testable;
