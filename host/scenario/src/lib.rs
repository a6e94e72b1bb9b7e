//! Recordings with a known gap: an emulated rig with hidden effects and a description without them.
//!
//! The rig ([`rig_plant`]) shares no equation with the library of effects: velocity weakening is rational instead of
//! Gaussian, presliding has four elements, heat drives the warm-up, and so on. The recordings also contain the
//! influence of integration step, controller and sensors. Equal scenarios give equal bytes.
//!
//! ```no_run
//! use rig_scenario::Scenario;
//!
//! let made = Scenario::of(&["stribeck"], 1).unwrap().make().unwrap();
//! made.write("recordings".as_ref()).unwrap();
//! ```

mod arm;
mod catalogue;
mod dice;
mod drawn;
mod error;
mod fault;
mod hidden;
mod made;
mod proposed;
mod record;
mod reference;
mod rig;
mod scenario;
mod size;
mod surrogate;
#[cfg(test)]
mod tests;
mod written;

pub use arm::{Arm, ArmRecordings, ArmScenario};
pub use error::ScenarioError;
pub use fault::{CallsFor, Fault};
pub use hidden::payload;
pub use hidden::{Effect, Hidden};
pub use made::{Made, Truth};
pub use record::Intrusion;
pub use reference::Excitation;
pub use rig::{Noise, Rig};
pub use scenario::Scenario;
pub use size::{ABOVE_FLOOR, Size};
