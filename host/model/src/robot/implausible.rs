//! Remarks on inertial values that no body can have.
//!
//! Such values are not refused: identified values are often known only in combinations, and values that no motion shows
//! are often left at zero.

use super::bodies::implausibility;
use super::serial_robot::Robot;
use super::urdf::{Original, SpatialInertia};
use rig_output::listed;

/// What [`implausibility`] says of a body without mass and inertia.
const MASSLESS: &str = "has neither mass nor inertia";

impl Robot {
    /// Returns one sentence for each link (and its joint) whose inertial values no body can have. Links without mass and
    /// inertia share one sentence.
    pub fn implausible_bodies(&self, urdf: Option<&Original>) -> Vec<String> {
        let (massless, others): (Vec<_>, Vec<_>) =
            (self.implausible().into_iter()).partition(|(_, why)| why == MASSLESS);
        let of = |(k, why): (usize, String)| {
            let joint = self.link_name(k);
            let link = match urdf.and_then(|original| original.link(k)) {
                Some(link) => format!("Link `{link}`, moved by joint `{joint}`,"),
                None => format!("The link of joint `{joint}`"),
            };
            format!(
                "{link} {why}. No body is like that: `rig identify` takes a uniform block for what is known of it, a simulation takes it as it stands."
            )
        };
        match massless.len() {
            0 | 1 => (massless.into_iter().chain(others)).map(of).collect(),
            _ => {
                let one = self.massless_bodies(urdf);
                one.into_iter().chain(others.into_iter().map(of)).collect()
            }
        }
    }

    /// Returns the sentence on links without mass and inertia, if there are several.
    pub(super) fn massless_bodies(&self, urdf: Option<&Original>) -> Option<String> {
        let massless = self.implausible();
        let joints: Vec<usize> = (massless.into_iter())
            .filter(|(_, why)| why == MASSLESS)
            .map(|(k, _)| k)
            .collect();
        if joints.len() < 2 {
            return None;
        }
        let names = |of: &dyn Fn(usize) -> String| {
            let names: Vec<String> = joints.iter().map(|k| format!("`{}`", of(*k))).collect();
            listed(&names)
        };
        let moved = names(&|k| self.link_name(k).to_owned());
        let links = match urdf {
            Some(original) => {
                let own = names(&|k| original.link(k).unwrap_or_default().to_owned());
                format!("Links {own}, moved by joints {moved},")
            }
            None => format!("The links of joints {moved}"),
        };
        Some(format!(
            "{links} have neither mass nor inertia. No body is like that: `rig identify` takes uniform blocks for what is known of them, a simulation takes them as they stand."
        ))
    }

    /// Returns the joints (from 0) whose link no body can be, each with the reason as the end of a sentence.
    fn implausible(&self) -> Vec<(usize, String)> {
        (0..self.link_count())
            .filter_map(|k| {
                let inertial = self.link_inertial(k)?;
                let why = implausibility(&SpatialInertia::of(inertial), &self.shown(k))?;
                Some((k, why))
            })
            .collect()
    }
}
