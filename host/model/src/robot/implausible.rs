//! Remarks on inertial values that no body can have.
//!
//! Such values are not refused: identified values are often known only in combinations, and values that no motion shows
//! are often left at zero.

use super::bodies::implausibility;
use super::serial_robot::Robot;
use super::urdf::{Original, SpatialInertia};

impl Robot {
    /// Returns one sentence for each link (and its joint) whose inertial values no body can have.
    pub fn implausible_bodies(&self, urdf: Option<&Original>) -> Vec<String> {
        (0..self.joints.len())
            .filter_map(|k| {
                let inertial = self.joints[k].inertial.as_ref()?;
                let why = implausibility(&SpatialInertia::of(inertial), &self.shown(k))?;
                let joint = &self.joints[k].name;
                let link = match urdf.and_then(|original| original.link(k)) {
                    Some(link) => format!("Link `{link}`, moved by joint `{joint}`,"),
                    None => format!("The link of joint `{joint}`"),
                };
                Some(format!(
                    "{link} {why}. No body is like that: `rig identify` takes a uniform block for what is known of it, a simulation takes it as it stands."
                ))
            })
            .collect()
    }
}
