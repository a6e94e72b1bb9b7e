//! Stiffness of the joints, and the compliance of the tool point.
//!
//! [`identify_compliance`] estimates the stiffness c of each drive from slow loading (by encoders on the links, or by the
//! displacement of the tool point under a known force) and from the frequency response of a joint. [`ToolPoint`] turns the
//! stiffness into the compliance matrix K_p of the tool point at a pose, and [`compliance_map`] shows it over two joints.
//!
//! The compliance of an arm of one joint, 0.5 m long, with 2000 N·m/rad:
//!
//! ```
//! use rig_compliance::{ToolPoint, described_stiffness, given_stiffness};
//! use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = Robot::from_toml(ONE_LINK_TEMPLATE, "one-link.toml".as_ref())?;
//! let mut drives = described_stiffness(&robot)?;
//! given_stiffness(&mut drives, &[2000.0], &[40.0])?;
//! let found = ToolPoint::new(&robot, [0.5, 0.0, 0.0])?.compliance(&[0.0], &drives)?;
//! // Upwards, across the arm: 0.5²/2000 m/N, with the relative uncertainty of the stiffness.
//! assert!((found.compliance[2][2] - 1.25e-4).abs() < 1e-12);
//! assert!((found.compliance_std[2][2] - 2.5e-6).abs() < 1e-12);
//! assert_eq!(found.rank, 1);
//! # Ok(())
//! # }
//! ```

mod drives;
mod effects_text;
mod error;
mod frequency;
mod identify;
mod loading;
mod map;
mod sag;
mod signals;
mod stiffness;
#[cfg(test)]
mod tests;
mod tool_point;
mod value;

pub use effects_text::elasticity_text;
pub use error::ComplianceError;
pub use frequency::{Band, FrequencyResponse, Periodic, response_pose};
pub use identify::{Compliance, ComplianceOptions, WrenchFrame, identify_compliance};
pub use loading::{Deflection, DriveLoading, LoadingFindings};
pub use map::{ComplianceMap, GRID, SingularPose, compliance_map};
pub use stiffness::{
    DriveStiffness, Source, described_stiffness, elasticity_effects, given_stiffness,
};
pub use tool_point::{PrincipalCompliance, ToolCompliance, ToolPoint};
pub use value::Value;
