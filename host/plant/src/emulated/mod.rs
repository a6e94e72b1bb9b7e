//! The rig without hardware: the firmware's own control application in a closed loop with the emulated rig.

mod demand;
mod description;
mod nameplate;
mod rig;
mod sweep;
pub mod upload;

pub use demand::{other_link, shortfalls};
pub use description::description_of;
pub use nameplate::{Nameplate, NameplateError, check_hardware, hardware_of, link_parameters};
pub use rig::EmulatedRig;
pub use sweep::friction_sweep;
