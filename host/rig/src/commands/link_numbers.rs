//! The numbers of links in the names of parameters.

use rig_model::robot::Robot;
use rig_output::listed;

/// Says which links the numbers beyond those of the joints name; `None` without followers.
pub(crate) fn followers_note(robot: &Robot) -> Option<String> {
    let n = robot.joints.len();
    let links: Vec<String> = (robot.followers.iter().enumerate())
        .map(|(k, own)| format!("{} the link that `{}` moves", n + k + 1, own.name))
        .collect();
    (!links.is_empty()).then(|| {
        format!(
            "In the names of parameters, numbers to {n} are the joints and their links, {}.",
            listed(&links)
        )
    })
}
