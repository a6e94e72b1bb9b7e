//! The load as a link of a URDF.

use nalgebra::Vector3;

use crate::controllers::about_centre;
use crate::result::LoadIdentification;

/// Returns a URDF link with the identified body, in the flange frame, to be fixed to the flange.
pub fn urdf_link(load: &LoadIdentification) -> String {
    let centre = Vector3::from(load.body.first_moment) / load.body.mass;
    let inertia = about_centre(load, &centre);
    let note = match load.inertia_shown {
        true => String::new(),
        false => "    <!-- The recordings do not show the inertia: it is that of a sphere. -->\n"
            .to_owned(),
    };
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
