//! Where the functions of the firmware's image lie.
//!
//! `firmware/fast_code.list` names the functions that run from the CCM SRAM. [`Placement`] compares the linked image
//! with that list, so that neither a renamed function nor a compiler that inlines otherwise changes unnoticed what runs
//! from there. [`Use`] says how much of each memory is left.

mod branch;
mod image;
mod list;
mod placement;
mod regions;

pub use image::{Function, Image, ImageError};
pub use list::{Entry, ListError, Speed, entries};
pub use placement::Placement;
pub use regions::{Region, Use, regions};

/// The list of functions: `firmware/fast_code.list`.
pub const LIST: &str = include_str!("../../fast_code.list");
/// The memory layout that the linker is given: `memory.x`.
pub const MEMORY: &str = include_str!("../../../memory.x");
/// The interrupt that is the control tick.
pub const ROOT: &str = "ADC1_2";
