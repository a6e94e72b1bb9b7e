//! The load as a link of a URDF.

use crate::result::LoadIdentification;

/// Returns a URDF link with the identified body, in the flange frame, to be fixed to the flange.
pub fn urdf_link(load: &LoadIdentification) -> String {
    // A body has a mass.
    let (centre, inertia) = load.body.about_centre().unwrap_or_default();
    let mut note = match load.inertia_shown {
        true => String::new(),
        false => "    <!-- The recordings do not show the inertia: it is that of a sphere. -->\n"
            .to_owned(),
    };
    let unknown: Vec<&str> = (load.parameters.iter().take(4))
        .filter_map(|p| (!p.shown).then_some(p.name))
        .collect();
    if !unknown.is_empty() {
        note.push_str(&format!(
            "    <!-- The recordings do not show {}: mass and origin are no measured values. -->\n",
            unknown.join(", ")
        ));
    }
    format!(
        "<link name=\"load\">\n  <inertial>\n{note}    <origin xyz=\"{:?} {:?} {:?}\" rpy=\"0 0 0\"/>\n    <mass value=\"{:?}\"/>\n    <inertia ixx=\"{:?}\" ixy=\"{:?}\" ixz=\"{:?}\" iyy=\"{:?}\" iyz=\"{:?}\" izz=\"{:?}\"/>\n  </inertial>\n</link>\n",
        centre.x,
        centre.y,
        centre.z,
        load.body.mass,
        inertia.m11,
        inertia.m12,
        inertia.m13,
        inertia.m22,
        inertia.m23,
        inertia.m33
    )
}
