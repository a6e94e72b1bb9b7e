//! Elements and attributes of URDF. Duplicates and misspelt names are refused with their line.
//!
//! Elements of other programs (Gazebo, Drake, ros2_control) may stand anywhere and are not checked.

use std::collections::{BTreeMap, BTreeSet};

use super::names::nearest;
use super::reader::{Reader, Xml};
use crate::robot::error::{Place, RobotError};
use rig_output::listed;

/// An element that is read: its name, its children that may occur once or several times, and its attributes.
struct Element {
    name: &'static str,
    once: &'static [&'static str],
    often: &'static [&'static str],
    attributes: &'static [&'static str],
}

/// The elements that enter a robot's dynamics (https://wiki.ros.org/urdf/XML).
const ELEMENTS: [Element; 14] = [
    Element {
        often: &["link", "joint", "transmission", "material", "gazebo"],
        ..element("robot", &[], &["name", "version"])
    },
    Element {
        often: &["visual", "collision"],
        ..element("link", &["inertial"], &["name", "type"])
    },
    element("inertial", &["origin", "mass", "inertia"], &[]),
    element("origin", &[], &["xyz", "rpy"]),
    element("mass", &[], &["value"]),
    element("inertia", &[], &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]),
    element(
        "joint",
        &[
            "origin",
            "parent",
            "child",
            "axis",
            "limit",
            "dynamics",
            "mimic",
            "safety_controller",
            "calibration",
        ],
        &["name", "type"],
    ),
    element("parent", &[], &["link"]),
    element("child", &[], &["link"]),
    element("axis", &[], &["xyz"]),
    element("limit", &[], &["lower", "upper", "velocity", "effort"]),
    element("dynamics", &[], &["damping", "friction"]),
    element("mimic", &[], &["joint", "multiplier", "offset"]),
    element(
        "safety_controller",
        &[],
        &[
            "soft_lower_limit",
            "soft_upper_limit",
            "k_position",
            "k_velocity",
        ],
    ),
];

const fn element(
    name: &'static str,
    once: &'static [&'static str],
    attributes: &'static [&'static str],
) -> Element {
    Element {
        name,
        once,
        often: &[],
        attributes,
    }
}

/// Unread attributes by the name of their element: place of the first, their names, and the number of elements.
type Unread<'a> = BTreeMap<&'static str, (Place, BTreeSet<&'a str>, usize)>;

impl<'a> Reader<'a> {
    /// Refuses duplicate elements, and misspelt elements and attributes. Adds remarks on attributes that are not read.
    ///
    /// # Errors
    /// The first of these faults, with its line.
    pub(super) fn as_described(&self) -> Result<(), RobotError> {
        let root = self.document.root_element();
        let mut unread = Unread::new();
        self.element(root, &mut unread)?;
        for tag in ["link", "joint"] {
            for node in root.children().filter(|node| node.has_tag_name(tag)) {
                self.element(node, &mut unread)?;
                for own in node.children().filter(Xml::is_element) {
                    // Their contents are for display and do not enter the dynamics.
                    if own.has_tag_name("visual") || own.has_tag_name("collision") {
                        continue;
                    }
                    self.element(own, &mut unread)?;
                    for part in own.children().filter(Xml::is_element) {
                        self.element(part, &mut unread)?;
                    }
                }
            }
        }
        for (tag, (place, names, elements)) in unread {
            let names: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
            let more = match elements {
                1 => String::new(),
                n => format!(", here and in {} more elements", n - 1),
            };
            self.remarks.borrow_mut().push(format!(
                "{}:{place}: {} of <{tag}> {} not read{more}: no attribute of URDF.",
                self.path.display(),
                listed(&names),
                if names.len() == 1 { "is" } else { "are" },
            ));
        }
        Ok(())
    }

    /// Checks one element against its definition. Elements without a definition are not checked.
    fn element(&self, node: Xml<'a>, unread: &mut Unread<'a>) -> Result<(), RobotError> {
        let name = node.tag_name().name();
        let Some(known) = ELEMENTS.iter().find(|element| element.name == name) else {
            return Ok(());
        };
        // Names with another prefix than the robot's own belong to other programs.
        let own = self.document.root_element().tag_name().namespace();
        let is_own = |node: &Xml<'a>| node.tag_name().namespace() == own;
        if !is_own(&node) {
            return Ok(());
        }
        let children: Vec<Xml<'a>> = (node.children())
            .filter(|child| child.is_element() && is_own(child))
            .collect();
        for (k, child) in children.iter().enumerate() {
            let tag = child.tag_name().name();
            let first = children[..k].iter().find(|other| other.has_tag_name(tag));
            if let (Some(first), true) = (first, known.once.contains(&tag)) {
                let text = format!(
                    "this is a second <{tag}> of {}, whose first stands at {}",
                    self.called(node),
                    self.place(*first)
                );
                // Most fixed joints have attributes that the dynamics do not need, such as the stand of the base.
                if node.attribute("type") != Some("fixed") {
                    return Err(self.error(*child, format!("{text}; give one")));
                }
                let place = format!("{}:{}", self.path.display(), self.place(*child));
                (self.remarks.borrow_mut()).push(format!("{place}: {text}; the first counts."));
                continue;
            }
            let names = known.once.iter().chain(known.often);
            let is_known = names.clone().any(|other| *other == tag);
            // Of a robot's own children other tools read more, and none of them enters the dynamics.
            if !is_known && name != "robot" && ELEMENTS.iter().any(|own| own.name == tag) {
                let text = self.misplaced(node, tag);
                if !is_origin_of_nothing(&children, *child) {
                    return Err(self.error(*child, text));
                }
                let place = format!("{}:{}", self.path.display(), self.place(*child));
                self.remarks.borrow_mut().push(format!("{place}: {text}."));
                continue;
            }
            let missing = (names.copied()).filter(|other| {
                known.often.contains(other) || !children.iter().any(|own| own.has_tag_name(*other))
            });
            if let (Some(suggestion), false) = (nearest(tag, missing), is_known) {
                return Err(self.error(
                    *child,
                    format!(
                        "<{tag}> of {} is no element of URDF; is <{suggestion}> meant?",
                        self.called(node)
                    ),
                ));
            }
        }
        self.attributes_of(node, known, unread)
    }

    fn attributes_of(
        &self,
        node: Xml<'a>,
        known: &Element,
        unread: &mut Unread<'a>,
    ) -> Result<(), RobotError> {
        let own = node.attributes().filter(|own| own.namespace().is_none());
        let mut counted = false;
        for attribute in own.filter(|own| !known.attributes.contains(&own.name())) {
            let (name, tag) = (attribute.name(), known.name);
            let missing =
                (known.attributes.iter().copied()).filter(|other| !node.has_attribute(*other));
            if let Some(suggestion) = nearest(name, missing) {
                return Err(self.error(
                    node,
                    format!("`{name}` is no attribute of <{tag}>; is `{suggestion}` meant?"),
                ));
            }
            let first = || (self.place(node), BTreeSet::new(), 0);
            let (_, names, elements) = unread.entry(tag).or_insert_with(first);
            names.insert(name);
            *elements += usize::from(!counted);
            counted = true;
        }
        Ok(())
    }

    /// Says where an element belongs that stands in another one.
    fn misplaced(&self, node: Xml<'a>, tag: &str) -> String {
        let places: Vec<String> = (ELEMENTS.iter())
            .filter(|own| own.once.contains(&tag) || own.often.contains(&tag))
            .map(|own| format!("<{}>", own.name))
            .collect();
        format!(
            "<{tag}> stands in {}, where URDF does not have it, so it is not read; it belongs in {}",
            self.called(node),
            places.join(" or ")
        )
    }

    /// Returns the element as "joint `elbow`", or as "<inertial>" if it has no name.
    fn called(&self, node: Xml<'a>) -> String {
        let tag = node.tag_name().name();
        match node.attribute("name") {
            Some(name) => format!("{tag} `{name}`"),
            None => format!("<{tag}>"),
        }
    }
}

/// Returns true if an <origin> stands in a link beside no <inertial>, or beside one that has its own: no body can have
/// been meant. The frame of the SO-101's gripper has such a one.
fn is_origin_of_nothing(siblings: &[Xml], child: Xml) -> bool {
    let has_origin = |own: &Xml| own.children().any(|part| part.has_tag_name("origin"));
    let mut bodies = siblings.iter().filter(|own| own.has_tag_name("inertial"));
    child.tag_name().name() == "origin" && bodies.all(has_origin)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::path::Path;

    use crate::robot::{Original, Robot};

    /// A robot of one joint with these parts of its link and its joint.
    fn read(link: &str, joint: &str) -> Result<Robot, String> {
        let text = format!(
            "<robot name='r'>\n<link name='base'/>\n<link name='arm'>\n{link}\n</link>\n<joint name='turn' type='revolute'><parent link='base'/><child link='arm'/>\n{joint}\n</joint>\n</robot>"
        );
        Robot::from_urdf(&text, Path::new("r.urdf")).map_err(|error| error.to_string())
    }

    const INERTIAL: &str = "<inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>";
    const LIMIT: &str = "<limit lower='-1' upper='1' velocity='2' effort='3'/>";

    #[test]
    fn elements_that_stand_twice_are_refused_by_line() {
        assert!(read(INERTIAL, LIMIT).is_ok());
        let twice = |link: &str, joint: &str, words: &str| {
            let message = read(link, joint).unwrap_err();
            assert!(
                message.contains(words) && message.contains("whose first stands at"),
                "{message}"
            );
        };
        twice(&format!("{INERTIAL}\n{INERTIAL}"), LIMIT, "r.urdf:5");
        twice(
            INERTIAL,
            &format!("{LIMIT}\n{LIMIT}"),
            "second <limit> of joint `turn`",
        );
        twice(
            INERTIAL,
            &format!("{LIMIT}<axis xyz='0 0 1'/><axis xyz='1 0 0'/>"),
            "second <axis>",
        );
        let masses = INERTIAL.replace("<inertia ", "<mass value='2'/><inertia ");
        twice(&masses, LIMIT, "second <mass> of <inertial>");
        let drawn = "<visual/><visual/><collision/><collision/>";
        assert!(read(&format!("{INERTIAL}{drawn}"), LIMIT).is_ok());
    }

    /// An origin beside its <inertial> would leave the centre of mass at the joint.
    #[test]
    fn elements_in_the_wrong_place_are_refused() {
        let refused = |link: &str, joint: &str, words: &str| {
            let message = read(link, joint).unwrap_err();
            assert!(message.contains(words), "{message}");
        };
        let beside = format!("<origin xyz='0 0 0.1'/>{INERTIAL}");
        refused(&beside, LIMIT, "belongs in <inertial> or <joint>");
        let beside = INERTIAL
            .replace("<inertial>", "")
            .replace("</inertial>", "");
        refused(&beside, LIMIT, "<mass> stands in link `arm`");
        let damped = format!("{LIMIT}<dynamics damping='1'><limit effort='3'/></dynamics>");
        refused(INERTIAL, &damped, "<limit> stands in <dynamics>");
    }

    /// The gripper's frame of a published arm has an origin beside an <inertial> with its own, and empty links have one.
    #[test]
    fn an_origin_that_places_no_body_is_remarked() {
        let placed = INERTIAL.replace("<mass", "<origin xyz='0 0 0.1'/><mass");
        for link in [
            format!("<origin xyz='0 0 0'/>\n{placed}"),
            "<origin xyz='0 0 0'/>".to_owned(),
        ] {
            let text = format!(
                "<robot name='r'>\n<link name='base'/>\n<link name='arm'>{INERTIAL}</link>\n<link name='tool'>{link}</link>\n<joint name='turn' type='revolute'><parent link='base'/><child link='arm'/>{LIMIT}</joint>\n<joint name='flange' type='fixed'><parent link='arm'/><child link='tool'/></joint>\n</robot>"
            );
            let original = Original::read(text, Path::new("r.urdf")).unwrap();
            let remarks = original.remarks();
            let told = |own: &&String| {
                own.contains("r.urdf:4") && own.contains("<origin> stands in link `tool`")
            };
            assert_eq!(remarks.iter().filter(told).count(), 1, "{remarks:?}");
        }
    }

    /// The stand of a published arm has two origins.
    #[test]
    fn the_first_counts_at_a_fixed_joint() {
        let text = format!(
            "<robot name='r'>\n<link name='stand'/>\n<link name='base'/>\n<link name='arm'>{INERTIAL}</link>\n<joint name='foot' type='fixed'><parent link='stand'/><child link='base'/><origin xyz='0 0 1'/>\n<origin xyz='0 0 2'/></joint>\n<joint name='turn' type='revolute'><parent link='base'/><child link='arm'/>{LIMIT}</joint>\n</robot>"
        );
        let original = Original::read(text, Path::new("r.urdf")).unwrap();
        let message = original.remarks();
        assert!(
            message
                .iter()
                .any(|own| own.contains("r.urdf:6") && own.contains("the first counts"))
        );
    }

    #[test]
    fn attributes_that_are_not_read_are_remarked_once() {
        let dynamics = format!("{LIMIT}<dynamics damping='1' mu_viscous='2' D='1'/>");
        let text = format!(
            "<robot name='r'>\n<link name='base'/><link name='arm'>{INERTIAL}</link><link name='hand'>{INERTIAL}</link>\n<joint name='a' type='revolute'><parent link='base'/><child link='arm'/>{dynamics}</joint>\n<joint name='b' type='revolute'><parent link='arm'/><child link='hand'/>{dynamics}<origin quat_xyzw='0 0 0 1'/></joint></robot>"
        );
        let original = Original::read(text, Path::new("r.urdf")).unwrap();
        let message: Vec<&String> = (original.remarks().iter())
            .filter(|own| own.contains("not read"))
            .collect();
        assert_eq!(message.len(), 2, "{message:?}");
        assert!(
            message[0].contains("r.urdf:3:") && message[0].contains("here and in 1 more elements")
        );
        assert!(
            message[0].contains("`D` and `mu_viscous` of <dynamics> are"),
            "{message:?}"
        );
        assert!(
            message[1].contains("`quat_xyzw` of <origin> is"),
            "{message:?}"
        );
    }

    #[test]
    fn misspelt_elements_and_attributes_are_refused_with_what_is_meant() {
        let suggestion = |link: &str, joint: &str, words: &str| {
            let message = read(link, joint).unwrap_err();
            assert!(message.contains(words), "{message}");
        };
        suggestion(
            INERTIAL,
            &LIMIT.replace("upper", "uper"),
            "is `upper` meant?",
        );
        // Exchanged letters are one error, also in a short name.
        suggestion(
            INERTIAL,
            &format!("{LIMIT}<axis xzy='0 0 1'/>"),
            "is `xyz` meant?",
        );
        suggestion(INERTIAL, &format!("{LIMIT}<axis/>"), "has no `xyz`");
        suggestion(
            INERTIAL,
            &LIMIT.replace("velocity", "Velocity"),
            "is `velocity` meant?",
        );
        suggestion(
            INERTIAL,
            &format!("{LIMIT}<dynamics dampin='1'/>"),
            "is `damping` meant?",
        );
        suggestion(
            INERTIAL,
            &format!("{LIMIT}<dynamic damping='1'/>"),
            "is <dynamics> meant?",
        );
        suggestion(
            INERTIAL,
            &format!("{LIMIT}<axes xyz='1 0 0'/>"),
            "is <axis> meant?",
        );
        suggestion(
            &INERTIAL.replace("inertial>", "inertail>"),
            LIMIT,
            "is <inertial> meant?",
        );
        suggestion(
            INERTIAL,
            &LIMIT.replace("limit", "limits"),
            "is <limit> meant?",
        );
        // The same applies to a file with its own namespace.
        let text = format!(
            "<robot name='r' xmlns='http://www.ros.org'><link name='base'/><link name='arm'>{INERTIAL}</link><joint name='turn' type='revolute'><parent link='base'/><child link='arm'/>{}</joint></robot>",
            LIMIT.replace("upper", "uper")
        );
        let message = Robot::from_urdf(&text, Path::new("r.urdf")).unwrap_err();
        assert!(
            message.to_string().contains("is `upper` meant?"),
            "{message}"
        );
        // Elements of other programs are accepted.
        let more = "<hardwareInterface/><gazebo/><sensor name='s'/>";
        assert!(read(&format!("{INERTIAL}{more}"), &format!("{LIMIT}{more}")).is_ok());
    }
}
