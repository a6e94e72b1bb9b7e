//! Gear ratios and rotors of the `<transmission>` elements.
//!
//! Leaves out transmissions of several joints, offsets and everything without a documented meaning; a remark says so where
//! they concern a joint of the chain.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::locks::few;
use super::names::nearest;
use super::reader::{Reader, Xml};
use super::tree::Tree;
use crate::robot::error::RobotError;

/// The drive of a joint, as far as the file states it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Motor<'a> {
    /// Motor turns per joint turn.
    pub reduction: Option<f64>,
    /// Inertia of the rotor on the motor side, kg·m².
    pub rotor_inertia: Option<f64>,
    /// Elements that state the two.
    places: [Option<Xml<'a>>; 2],
}

/// The drives by the name of the joint.
pub(super) type Motors<'a> = HashMap<&'a str, Motor<'a>>;

/// Elements of a `<transmission>` and of its `<actuator>`, in ROS 1, ROS 2 and Drake.
const KNOWN: [&str; 14] = [
    "type",
    "plugin",
    "joint",
    "actuator",
    "mechanicalReduction",
    "mechanical_reduction",
    "hardwareInterface",
    "offset",
    "role",
    "param",
    "motorInertia",
    "motorTorqueConstant",
    "rotor_inertia",
    "gear_ratio",
];

/// Names of the gear ratio in ROS 1 and ROS 2.
const REDUCTIONS: [&str; 2] = ["mechanicalReduction", "mechanical_reduction"];
/// Names of gear ratios among the parameters of a hardware driver, in lower case without `_`.
const RATIOS: [&str; 6] = [
    "mechanicalreduction",
    "gearratio",
    "reduction",
    "reductionratio",
    "gearreduction",
    "transmissionratio",
];

/// A number of a transmission that a motor has one of.
struct Stated<'a> {
    node: Xml<'a>,
    /// Name of the element in messages.
    what: String,
    text: &'a str,
    is_rotor: bool,
}

/// Unread elements by name: the first, and how many there are.
type Unread<'a> = BTreeMap<&'a str, (Xml<'a>, usize)>;

impl<'a> Reader<'a> {
    /// Returns the gear ratios and rotors. A ratio of 1 is the usual placeholder for "none" and is ignored. `active`: the
    /// joints of the chain; remarks concern them alone.
    ///
    /// # Errors
    /// A joint is unknown, a name is misspelt, or two values contradict each other.
    pub(super) fn motors(
        &self,
        tree: &Tree<'a>,
        active: &[&str],
    ) -> Result<Motors<'a>, RobotError> {
        let mut motors = Motors::new();
        let mut unread = Unread::new();
        let mut strange = Vec::new();
        let root = self.document.root_element();
        // ROS 1 and Drake place them beside the joints, ROS 2 within <ros2_control>.
        let all = || {
            root.descendants()
                .filter(|n| n.has_tag_name("transmission"))
        };
        let driven: HashSet<&str> = all()
            .flat_map(|own| own.children().filter(|n| n.has_tag_name("joint")))
            .filter_map(|joint| joint.attribute("name"))
            .collect();
        for transmission in all() {
            self.spelt(transmission)?;
            let joints = self.joints_of(transmission, tree, &driven, &mut strange)?;
            let concerned = joints.iter().any(|name| active.contains(name));
            if concerned {
                gather(transmission, &mut unread);
            }
            let [joint] = joints.as_slice() else {
                if concerned {
                    self.several(transmission, &joints);
                }
                continue;
            };
            for stated in stated(transmission) {
                self.put(&mut motors, joint, &stated)?;
            }
        }
        self.strange(&strange);
        for (name, (node, count)) in unread {
            self.unread(name, node, count);
        }
        self.command_limits(active);
        self.parameters_of_hardware(active)?;
        Ok(motors)
    }

    /// Refuses misspelt elements of a transmission.
    fn spelt(&self, transmission: Xml<'a>) -> Result<(), RobotError> {
        // ROS 2 states the reduction within <joint>.
        let inner = |node: &Xml<'a>| {
            node.parent() == Some(transmission)
                || node
                    .parent()
                    .is_some_and(|own| own.has_tag_name("actuator") || own.has_tag_name("joint"))
        };
        let own = transmission.descendants().filter(Xml::is_element);
        for node in own
            .filter(inner)
            .filter(|own| own.tag_name().namespace().is_none())
        {
            let tag = node.tag_name().name();
            if let (false, Some(meant)) = (KNOWN.contains(&tag), nearest(tag, KNOWN.into_iter())) {
                return Err(self.error(
                    node,
                    format!("<{tag}> is no element of <transmission>; is <{meant}> meant?"),
                ));
            }
            if tag == "param" {
                self.spelt_parameter(node)?;
            }
        }
        Ok(())
    }

    /// Refuses a parameter whose name is nearly that of a reduction.
    fn spelt_parameter(&self, node: Xml<'a>) -> Result<(), RobotError> {
        let name = node.attribute("name").unwrap_or_default();
        match nearest(name, REDUCTIONS.into_iter()).filter(|meant| *meant != name) {
            Some(meant) if !KNOWN.contains(&name) => Err(self.error(
                node,
                format!("the parameter `{name}` is none of <transmission>; is `{meant}` meant?"),
            )),
            _ => Ok(()),
        }
    }

    /// Returns the names of the joints of a transmission. `driven`: the joints that some transmission of the file names.
    fn joints_of(
        &self,
        transmission: Xml<'a>,
        tree: &Tree<'a>,
        driven: &HashSet<&str>,
        strange: &mut Vec<(Xml<'a>, &'a str)>,
    ) -> Result<Vec<&'a str>, RobotError> {
        let of_ros_2 = (transmission.ancestors()).any(|n| n.has_tag_name("ros2_control"));
        let mut names = Vec::new();
        for joint in transmission.children().filter(|n| n.has_tag_name("joint")) {
            let name = self.attribute(joint, "name")?;
            // Controllers of ROS 2 may move joints of another file.
            if !of_ros_2 && tree.joint(name).is_none() {
                let undriven =
                    (tree.joints.iter().map(|own| own.name)).filter(|own| !driven.contains(own));
                if let Some(meant) = nearest(name, undriven) {
                    return Err(self.error(joint, format!("this <transmission> names joint `{name}`, which the file does not describe; is `{meant}` meant?")));
                }
                strange.push((joint, name));
            }
            names.push(name);
        }
        Ok(names)
    }

    /// Adds a remark on transmissions of joints that the file does not describe.
    fn strange(&self, strange: &[(Xml<'a>, &'a str)]) {
        if let Some((first, _)) = strange.first() {
            let names: Vec<&str> = strange.iter().map(|(_, name)| *name).collect();
            self.remarks.borrow_mut().push(format!(
                "{}:{}: transmissions of {} are not read, for the file does not describe such joints.",
                self.path.display(),
                self.place(*first),
                few(&names)
            ));
        }
    }

    /// Puts a number into the drive of `joint`.
    fn put(
        &self,
        motors: &mut Motors<'a>,
        joint: &'a str,
        stated: &Stated<'a>,
    ) -> Result<(), RobotError> {
        let Stated {
            node, what, text, ..
        } = stated;
        let value = self.parse_number(*node, what, text)?;
        if value == 0.0 && !stated.is_rotor {
            return Err(self.error(
                *node,
                format!("{what} is 0, but it must be motor turns per joint turn, different from 0"),
            ));
        }
        if value < 0.0 && stated.is_rotor {
            return Err(self.error(
                *node,
                format!("{what} is {value}, but an inertia must be 0 or greater, in kg·m² on the motor side"),
            ));
        }
        if value == 1.0 && !stated.is_rotor {
            return Ok(());
        }
        let motor = motors.entry(joint).or_default();
        let (own, place, kind) = match stated.is_rotor {
            false => (&mut motor.reduction, &mut motor.places[0], "reduction"),
            true => (
                &mut motor.rotor_inertia,
                &mut motor.places[1],
                "rotor inertia",
            ),
        };
        if let (Some(other), Some(first)) = (own.filter(|other| *other != value), *place) {
            return Err(self.error(
                *node,
                format!(
                    "{what} of joint `{joint}` is {value}, and {other} at {}; give a joint one {kind}",
                    self.place(first)
                ),
            ));
        }
        (*own, *place) = (Some(value), Some(*node));
        Ok(())
    }

    /// Adds a remark on a transmission of several joints.
    fn several(&self, transmission: Xml<'a>, joints: &[&str]) {
        let place = format!("{}:{}", self.path.display(), self.place(transmission));
        self.remarks.borrow_mut().push(format!(
            "{place}: this <transmission> names {} joints ({}); only those of one joint each are read, so their gear ratios and rotors count as not known. Torques are those of the joints; state a coupled drive in TOML (`rig init --from`).",
            joints.len(),
            joints.join(", ")
        ));
    }

    /// Adds a remark on elements that are not read.
    fn unread(&self, name: &str, node: Xml<'a>, count: usize) {
        let more = match count {
            1 => String::new(),
            n => format!(", here and in {} more transmissions", n - 1),
        };
        let why = match name {
            "offset" => {
                "it shifts the motor's zero and not the joint's; `zero` of [joint.drive] in TOML holds it"
            }
            "rotor_inertia" => {
                "only Drake defines such an element, as <drake:rotor_inertia value=\"…\"/> (kg·m², motor side); write it so to have it read"
            }
            "motorTorqueConstant" => {
                "no document says on which side of the gear it counts; state `torque_constant` of [joint.drive] in TOML (`rig init --from`)"
            }
            _ => {
                "no document says on which side of the gear it counts; state <drake:rotor_inertia value=\"…\"/> in the <actuator> (kg·m², motor side), or `rotor_inertia` of [joint.drive] in TOML (`rig init --from`)"
            }
        };
        self.remarks.borrow_mut().push(format!(
            "{}:{}: <{name}> is not read{more}: {why}.",
            self.path.display(),
            self.place(node)
        ));
    }

    /// Adds a remark on gear ratios among the parameters of a driver in `<ros2_control>`, and refuses misspelt ones. Each
    /// driver defines its parameters itself.
    ///
    /// # Errors
    /// A name is misspelt.
    fn parameters_of_hardware(&self, active: &[&str]) -> Result<(), RobotError> {
        let of_joint = |node: &Xml<'a>| {
            let joint = node.parent().filter(|own| own.has_tag_name("joint"));
            let control = joint.and_then(|joint| joint.parent());
            control.is_some_and(|own| own.has_tag_name("ros2_control"))
                && (joint.and_then(|joint| joint.attribute("name")))
                    .is_some_and(|name| active.contains(&name))
        };
        let root = self.document.root_element();
        let mut first = None;
        for node in (root.descendants()).filter(|node| node.has_tag_name("param") && of_joint(node))
        {
            let name = node.attribute("name").unwrap_or_default();
            // A ratio of 1 is the placeholder for "none".
            let is_one = node
                .text()
                .is_some_and(|text| text.trim().parse() == Ok(1.0));
            if is_ratio(name) {
                first = first.or((!is_one).then_some((node, name)));
            } else {
                self.spelt_parameter(node)?;
            }
        }
        if let Some((node, name)) = first {
            self.remarks.borrow_mut().push(format!(
                "{}:{}: the parameter `{name}` of <ros2_control> is not read, for each driver defines its own; give <mechanical_reduction> in a <transmission>, or `gear_ratio` of [joint.drive] in TOML (`rig init --from`).",
                self.path.display(),
                self.place(node)
            ));
        }
        Ok(())
    }

    /// Adds a remark on limits of commands in `<ros2_control>`, which are those of a controller.
    fn command_limits(&self, active: &[&str]) {
        let root = self.document.root_element();
        let is_limit = |node: &Xml<'a>| {
            node.has_tag_name("param")
                && matches!(node.attribute("name"), Some("min" | "max"))
                && node.ancestors().any(|own| {
                    own.has_tag_name("joint")
                        && own
                            .attribute("name")
                            .is_some_and(|name| active.contains(&name))
                })
                && node.ancestors().any(|own| own.has_tag_name("ros2_control"))
        };
        if let Some(first) = root.descendants().find(is_limit) {
            self.remarks.borrow_mut().push(format!(
                "{}:{}: limits of commands in <ros2_control> are not read; those of <limit> count.",
                self.path.display(),
                self.place(first)
            ));
        }
    }
}

/// Returns true if a parameter is named like a gear ratio.
fn is_ratio(name: &str) -> bool {
    let plain: String = (name.chars().filter(|c| !matches!(c, '_' | '-' | ' ')))
        .flat_map(char::to_lowercase)
        .collect();
    RATIOS.contains(&plain.as_str())
}

/// Returns the numbers of a transmission: ROS 1 has `<mechanicalReduction>`, ROS 2 `<mechanical_reduction>`, Drake
/// `<drake:gear_ratio value>` and `<drake:rotor_inertia value>`, the inertia on the motor side (Drake, "Supported formats",
/// multibody parsing).
fn stated<'a>(transmission: Xml<'a>) -> impl Iterator<Item = Stated<'a>> {
    let is_name = |name: &str| REDUCTIONS.contains(&name);
    (transmission.descendants().filter(Xml::is_element)).filter_map(move |node| {
        let tag = node.tag_name().name();
        let text = node.text().unwrap_or_default();
        let name = node.attribute("name").unwrap_or_default();
        let (what, text, is_rotor) = match tag {
            _ if is_name(tag) => (format!("<{tag}>"), text, false),
            "param" if is_name(name) => (format!("`{name}`"), text, false),
            "gear_ratio" => (
                "<drake:gear_ratio>".to_owned(),
                node.attribute("value")?,
                false,
            ),
            "rotor_inertia" => (
                "<drake:rotor_inertia>".to_owned(),
                node.attribute("value")?,
                true,
            ),
            _ => return None,
        };
        Some(Stated {
            node,
            what,
            text,
            is_rotor,
        })
    })
}

/// Returns the element that states the rotor of `joint`, to write another value into it.
pub(super) fn rotor_of<'a>(root: Xml<'a>, joint: &str) -> Vec<Xml<'a>> {
    let of_joint = |transmission: &Xml<'a>| {
        let mut joints = transmission.children().filter(|n| n.has_tag_name("joint"));
        let first = joints.next().and_then(|own| own.attribute("name"));
        transmission.has_tag_name("transmission") && first == Some(joint) && joints.next().is_none()
    };
    (root.descendants().filter(of_joint))
        .flat_map(stated)
        .filter(|own| own.is_rotor)
        .map(|own| own.node)
        .collect()
}

/// Collects the elements with a value that are not read.
fn gather<'a>(transmission: Xml<'a>, unread: &mut Unread<'a>) {
    for node in transmission.descendants().filter(Xml::is_element) {
        let name = match node.tag_name().name() {
            "param" => node.attribute("name").unwrap_or_default(),
            tag => tag,
        };
        // Values that say nothing.
        let default = match name {
            "motorTorqueConstant" => 1.0,
            "offset" | "motorInertia" => 0.0,
            "rotor_inertia" if node.attribute("value").is_none() => 0.0,
            _ => continue,
        };
        let value = node.text().and_then(|text| text.trim().parse::<f64>().ok());
        if value != Some(default) {
            unread.entry(name).or_insert((node, 0)).1 += 1;
        }
    }
}
