//! Stiffness of a joint from its frequency response.

mod bands;
mod bin;
mod columns;
mod coupling;
mod fit;
mod link_motion;
mod periodic;
mod response;
mod search;
mod spectra;
mod two_mass;

pub use bands::Band;
#[cfg(test)]
pub(crate) use bands::bands;
pub use periodic::Periodic;
pub(crate) use response::respond;
pub use response::{FrequencyResponse, response_pose};
#[cfg(test)]
pub(crate) use spectra::spectra;
