//! Namespace prefixes that a file uses and does not declare.
//!
//! `drake:acceleration` without `xmlns:drake` is no XML with namespaces, yet parsers without namespaces, which ROS and
//! PyBullet use, read it, and published files have it.

use std::borrow::Cow;

use roxmltree::{Document, Error};

/// Prefixes that are declared at most; a file with more is damaged.
const MOST: usize = 16;

/// A text whose prefixes are all declared.
pub(super) struct Declared<'a> {
    pub text: Cow<'a, str>,
    /// Prefixes that were added to the outermost element.
    pub added: Vec<String>,
}

impl Declared<'_> {
    /// Returns the sentence for the user, without the path, if prefixes were added.
    pub(super) fn remark(&self) -> Option<String> {
        let names: Vec<String> = self.added.iter().map(|own| format!("`{own}`")).collect();
        let (prefixes, are, first) = match self.added.as_slice() {
            [] => return None,
            [one] => ("prefix", "is", one),
            [first, ..] => ("prefixes", "are", first),
        };
        Some(format!(
            "the namespace {prefixes} {} {are} not declared (<robot xmlns:{first}=\"{}\"> would do it); the file is read as if {}.",
            rig_output::listed(&names),
            namespace(first),
            if self.added.len() == 1 {
                "it were"
            } else {
                "they were"
            },
        ))
    }
}

/// Declares the prefixes that `text` uses without a declaration, on its outermost element and its line. Prefix `xacro` stays
/// undeclared: it marks a file that is no URDF yet.
pub(super) fn declared(text: &str) -> Declared<'_> {
    let mut result = Declared {
        text: Cow::Borrowed(text),
        added: Vec::new(),
    };
    while let Some(prefix) = undeclared(&result.text) {
        let is_new = !result.added.contains(&prefix);
        if prefix == "xacro" || !is_new || result.added.len() == MOST {
            return Declared {
                text: Cow::Borrowed(text),
                added: Vec::new(),
            };
        }
        let Some(end) = end_of_first_name(&result.text) else {
            return result;
        };
        let declaration = format!(" xmlns:{prefix}=\"{}\"", namespace(&prefix));
        result.text.to_mut().insert_str(end, &declaration);
        result.added.push(prefix);
    }
    result
}

/// Returns the first prefix without a declaration.
fn undeclared(text: &str) -> Option<String> {
    match Document::parse(text) {
        Err(Error::UnknownNamespace(prefix, _)) => Some(prefix),
        _ => None,
    }
}

/// Returns the usual name of the namespace behind a prefix.
fn namespace(prefix: &str) -> String {
    match prefix {
        "drake" => "http://drake.mit.edu".to_owned(),
        other => format!("urn:{other}"),
    }
}

/// Returns the byte behind the name of the outermost element.
fn end_of_first_name(text: &str) -> Option<usize> {
    let mut at = 0;
    loop {
        at += text.get(at..)?.find('<')?;
        let rest = text.get(at..)?;
        let closing = match rest {
            _ if rest.starts_with("<!--") => "-->",
            _ if rest.starts_with("<?") => "?>",
            _ if rest.starts_with("<!") => ">",
            _ => {
                let ends = |c: char| c.is_whitespace() || matches!(c, '>' | '/');
                return rest.find(ends).map(|length| at + length);
            }
        };
        at += rest.find(closing)? + closing.len();
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::path::Path;

    use super::declared;
    use crate::robot::{Original, Robot};

    const HEAD: &str = "<?xml version='1.0'?>\n<!-- <robot> of nobody -->\n";

    /// A robot of one joint; `name` stands in the outermost element, `limit` in `<limit>`, and `more` behind the joint.
    fn file(name: &str, limit: &str, more: &str) -> String {
        format!(
            "{HEAD}<robot name='r'{name}>\n<link name='base'/>\n<link name='arm'><inertial><origin xyz='0 0 0.1'/><mass value='2'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>\n<joint name='turn' type='revolute'><parent link='base'/><child link='arm'/><axis xyz='0 1 0'/><limit lower='-1' upper='1' velocity='2' effort='3' {limit}/></joint>\n{more}</robot>"
        )
    }

    const DRIVE: &str = "<transmission name='t'><joint name='turn'/><actuator name='m'><drake:gear_ratio value='50'/><drake:rotor_inertia value='2e-5'/></actuator></transmission>\n";

    #[test]
    fn a_prefix_without_a_declaration_is_read_like_one_with_it() {
        let limit = "drake:acceleration='2.5'";
        let without = file("", limit, DRIVE);
        let with = file(" xmlns:drake='http://drake.mit.edu'", limit, DRIVE);
        let read = |text: &str| Original::read(text.to_owned(), Path::new("r.urdf")).unwrap();
        let (bare, whole) = (read(&without), read(&with));
        assert_eq!(bare.robot(), whole.robot());
        let joint = &bare.robot().joints[0];
        assert_eq!(joint.limits.as_ref().unwrap().acceleration, Some(2.5));
        let drive = joint.drive.as_ref().unwrap();
        assert_eq!((drive.gear_ratio, drive.rotor_inertia), (50.0, 2e-5));
        assert_eq!(whole.remarks(), Vec::<String>::new());
        let [remark] = bare.remarks() else {
            unreachable!("{:?}", bare.remarks())
        };
        assert!(
            remark.starts_with("r.urdf: the namespace prefix `drake` is not declared"),
            "{remark}"
        );
        // What is written has the declaration, and every XML reader takes it.
        let mut other = bare.robot().clone();
        other.joints[0].inertial.as_mut().unwrap().mass = 3.0;
        let written = bare.with_values(&other).unwrap().text;
        assert!(roxmltree::Document::parse(&written).is_ok(), "{written}");
        assert!(written.contains("drake:acceleration='2.5'"), "{written}");
        assert!(
            read(&written).robot().joints[0]
                .inertial
                .as_ref()
                .unwrap()
                .mass
                == 3.0
        );
    }

    #[test]
    fn several_prefixes_are_told_in_one_sentence() {
        let text = file("", "drake:acceleration='2'", "<gz:plugin/><gz:plugin/>");
        let found = declared(&text);
        assert_eq!(found.added, ["drake", "gz"]);
        // Lines stay.
        assert_eq!(found.text.lines().count(), text.lines().count());
        let remark = found.remark().unwrap();
        assert!(
            remark.contains("`drake` and `gz` are not declared"),
            "{remark}"
        );
        assert_eq!(declared(HEAD).text, HEAD);
    }

    #[test]
    fn xacro_and_bad_accelerations_stay_refused() {
        let refused = |text: &str| {
            Robot::from_urdf(text, Path::new("r.urdf"))
                .unwrap_err()
                .to_string()
        };
        let message = refused(&file("", "", "<xacro:arm/><drake:x/>"));
        assert!(
            message.contains("run xacro over the file first"),
            "{message}"
        );
        let message = refused(&file("", "drake:acceleration='-2'", ""));
        assert!(
            message.contains("r.urdf:6:")
                && message.contains("acceleration limit of joint `turn` is -2"),
            "{message}"
        );
        let message = refused(&file("", "drake:acceleration='fast'", ""));
        assert!(message.contains("must be a finite number"), "{message}");
        // Drake's own default.
        let robot = Robot::from_urdf(
            &file("", "drake:acceleration='inf'", ""),
            Path::new("r.urdf"),
        );
        assert_eq!(
            robot.unwrap().joints[0]
                .limits
                .as_ref()
                .unwrap()
                .acceleration,
            None
        );
    }
}
