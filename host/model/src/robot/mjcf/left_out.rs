//! Sentences about what enters MuJoCo's dynamics and not the description.

use super::actuators::Drives;
use super::elements::{Reader, Xml};
use crate::robot::error::RobotError;

/// Attributes of joints of a passive force that the description has no term for.
const OF_JOINTS: [(&str, &str); 2] = [
    ("stiffness", "springs of joints"),
    ("springdamper", "`springdamper` of joints"),
];

/// Attributes of the medium around the bodies.
const MEDIUM: [&str; 2] = ["density", "viscosity"];

/// Forces of a `dcmotor` beside those of armature and damping.
const OF_MOTORS: [&str; 2] = ["cogging", "lugre"];

/// Returns a sentence about all terms that are not read, with their lines, and one about what MJCF does not state.
///
/// # Errors
/// A term that is no number, by its line.
pub(super) fn left_out(
    reader: &Reader<'_>,
    drives: &Drives<'_>,
) -> Result<Vec<String>, RobotError> {
    let root = reader.document.root_element();
    let path = reader.path.display();
    let mut names = Vec::new();
    let joints = || {
        root.descendants().filter(|n| {
            n.has_tag_name("joint") && n.ancestors().any(|around| around.has_tag_name("worldbody"))
        })
    };
    let bodies = root.descendants().filter(|n| n.has_tag_name("body"));
    names.extend(named(
        reader,
        "gravity compensation (`gravcomp`) of bodies",
        &not_zero(reader, bodies, "gravcomp")?,
    ));
    for (attribute, name) in OF_JOINTS {
        names.extend(named(reader, name, &not_zero(reader, joints(), attribute)?));
    }
    let actuators = root.children().filter(|n| n.has_tag_name("actuator"));
    let actuators: Vec<Xml<'_>> = (actuators.flat_map(|n| n.children()))
        .filter(Xml::is_element)
        .collect();
    let mut curved = Vec::new();
    for node in joints().chain(actuators.iter().copied()) {
        if reader.leading(node, "damping", 3, 0.0)?.1 {
            curved.push(node);
        }
    }
    names.extend(named(
        reader,
        "damping beyond its first, linear coefficient",
        &curved,
    ));
    for attribute in OF_MOTORS {
        let motors = actuators.iter().copied();
        let nodes = not_zero(reader, motors, attribute)?;
        names.extend(named(reader, &format!("`{attribute}` of motors"), &nodes));
    }
    for attribute in MEDIUM {
        let mut options = root.children().filter(|n| n.has_tag_name("option"));
        let last = options.rfind(|n| n.has_attribute(attribute));
        let nodes = not_zero(reader, last.into_iter(), attribute)?;
        names.extend(named(
            reader,
            &format!("`{attribute}` of the medium"),
            &nodes,
        ));
    }
    for (tag, name) in [("tendon", "tendons"), ("equality", "equalities")] {
        let own = root.children().filter(|n| n.has_tag_name(tag));
        let nodes: Vec<Xml<'_>> = (own.flat_map(|n| n.children()))
            .filter(Xml::is_element)
            .collect();
        names.extend(named(reader, name, &nodes));
    }
    let mut remarks = Vec::new();
    if !names.is_empty() {
        remarks.push(format!(
            "{path}: {} are not read; the description has no term for them.",
            names.join(", ")
        ));
    }
    if let Some(name) = named(reader, "gears", &drives.other_gears) {
        remarks.push(format!(
            "{path}: {name} differ from that of the first actuator of their joint, which is the gear of the description.",
        ));
    }
    remarks.push(format!(
        "{path}: MJCF states no speed limits, so the description has no limits; `rig init --from` writes places for them."
    ));
    Ok(remarks)
}

/// Returns the elements of which one number of an attribute is not zero.
fn not_zero<'a>(
    reader: &Reader<'a>,
    nodes: impl Iterator<Item = Xml<'a>>,
    attribute: &str,
) -> Result<Vec<Xml<'a>>, RobotError> {
    let mut found = Vec::new();
    for node in nodes {
        let values = reader.numbers(node, attribute)?.unwrap_or_default();
        if values.iter().any(|value| *value != 0.0) {
            found.push(node);
        }
    }
    Ok(found)
}

/// Returns the name of a term with the lines of the elements that have it; `None` without any.
fn named(reader: &Reader<'_>, name: &str, nodes: &[Xml<'_>]) -> Option<String> {
    let mut lines: Vec<usize> = nodes.iter().map(|node| reader.place(*node).line).collect();
    lines.dedup();
    let list: Vec<String> = lines.iter().map(usize::to_string).collect();
    let word = if lines.len() == 1 { "line" } else { "lines" };
    (!lines.is_empty()).then(|| format!("{name} ({word} {})", list.join(", ")))
}
