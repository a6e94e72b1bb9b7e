//! Stiffness of the drives from static loading.

mod advice;
mod another_reading;
mod equilibrium;
mod findings;
mod fit;
mod instrument;
mod link;
mod result;
mod stuck;
mod tool;
mod windows;
mod wrench;

pub(crate) use findings::loading;
pub use result::{Deflection, DriveLoading, LoadingFindings};
