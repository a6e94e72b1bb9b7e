//! The identified URDF.

use rig_shared::multibody::{COLUMNS, column};

use rig_identify::Identification;
use rig_model::robot::{Description, Robot, RobotError, Urdf};

/// Returns the identified description as URDF: a copy of the given file with new values, or a new one. `None` if the
/// result has no full set of parameters: URDF needs one for each link, and base parameters do not give it.
pub(super) fn of(
    description: &Description,
    found: &Identification,
    identified: &Robot,
) -> Option<Result<Urdf, RobotError>> {
    let robot = &description.robot;
    if found.standard_parameters.is_none() && robot.link_count() != 1 {
        return None;
    }
    let urdf = match &description.urdf {
        Some(original) => original.with_values(identified),
        None => identified.to_urdf(),
    };
    Some(urdf.map(|mut urdf| {
        urdf.remarks.extend(chosen(robot, found));
        urdf
    }))
}

/// Sentences about drive inertias and constant torques that were identified only in sums with other parameters.
fn chosen(robot: &Robot, found: &Identification) -> Vec<String> {
    let in_a_sum = |place: usize| -> Option<String> {
        let set = found.standard_parameters.as_ref()?;
        let joints = robot.joints.iter().enumerate();
        let names: Vec<&str> = joints
            .filter(|(j, _)| {
                let own = set.parameters.get(j * COLUMNS + place);
                own.is_some_and(|own| !own.determined && own.value != 0.0)
            })
            .map(|(_, joint)| joint.name.as_str())
            .collect();
        (!names.is_empty()).then(|| names.join(", "))
    };
    let kinds = [
        (column::DRIVE_INERTIA, "drive inertias", "inertias of links"),
        (column::OFFSET, "constant torques", "weights of links"),
    ];
    let one = |(place, what, with)| {
        in_a_sum(place).map(|names| {
            format!(
                "The {what} of {names} are not identified on their own, only their sums with {with}; the file holds the split nearest to the description. Use these values together with the links of this file only."
            )
        })
    };
    kinds.into_iter().filter_map(one).collect()
}
