//! Elements and numbers of a URDF file. Each fault is reported with its line.

use std::cell::RefCell;
use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};

use super::unknown_limit::Unknown;
use crate::robot::error::{Place, RobotError};
use crate::robot::fault::{MAX_NUMBER, is_safe_magnitude};
use crate::robot::right_angle::WRITTEN;

/// A file being read.
pub(super) struct Reader<'a> {
    pub path: &'a Path,
    pub document: &'a Document<'a>,
    /// Remarks for the user, one sentence each.
    pub remarks: RefCell<Vec<String>>,
    /// Limits that count as not known: why, where, and the joint.
    pub unknown: RefCell<Vec<(Unknown, Place, String)>>,
}

/// Correction for a macro.
const EXPAND: &str =
    "which is an unexpanded macro; run xacro over the file first: xacro FILE -o arm.urdf";

/// Elements whose contents do not enter the dynamics and may hold text of other programs.
const FOREIGN: [&str; 5] = ["visual", "collision", "gazebo", "sensor", "ros2_control"];

/// An element.
pub(super) type Xml<'a> = Node<'a, 'a>;

/// Returns the document, or the place where it is not well formed.
pub(super) fn parsed<'a>(text: &'a str, path: &Path) -> Result<Document<'a>, RobotError> {
    Document::parse(text).map_err(|e| RobotError::Urdf {
        path: path.into(),
        place: Place {
            line: e.pos().row as usize,
            column: e.pos().col as usize,
        },
        message: match &e {
            _ if text.trim_start().len() < text.len() && text.trim_start().starts_with("<?xml") => {
                "something stands before <?xml …?>; remove the empty line or the blanks there"
                    .to_owned()
            }
            roxmltree::Error::UnknownNamespace(prefix, _) if prefix == "xacro" => {
                format!("this is an element or attribute of xacro, {EXPAND}")
            }
            _ => format!(
                "this is not well-formed XML ({}), but a URDF file is",
                without_position(&e.to_string())
            ),
        },
    })
}

/// Removes the " at line:column" that the XML reader appends; the message already begins with the place.
fn without_position(message: &str) -> &str {
    match message.rsplit_once(" at ") {
        Some((head, tail)) if tail.chars().all(|c| c.is_ascii_digit() || c == ':') => head,
        _ => message,
    }
}

impl<'a> Reader<'a> {
    pub(super) fn error(&self, node: Xml<'a>, message: String) -> RobotError {
        self.error_at(self.place(node), message)
    }

    pub(super) fn error_at(&self, place: Place, message: String) -> RobotError {
        RobotError::Urdf {
            path: self.path.into(),
            place,
            message,
        }
    }

    /// Refuses xacro that was not expanded: its elements anywhere, its expressions if they enter the dynamics.
    pub(super) fn expanded(&self) -> Result<(), RobotError> {
        let root = self.document.root_element();
        for node in root.descendants().filter(Xml::is_element) {
            let tag = node.tag_name();
            if tag.namespace().is_some_and(|uri| uri.contains("xacro")) {
                let message = format!("this is <xacro:{}>, {EXPAND}", tag.name());
                return Err(self.error(node, message));
            }
            let foreign = |n: Xml| FOREIGN.contains(&n.tag_name().name());
            let expression = |text: &str| text.contains("${") || text.contains("$(");
            if let Some(found) = node.attributes().find(|a| expression(a.value()))
                && !node.ancestors().any(foreign)
            {
                let (name, value) = (found.name(), found.value());
                let message = format!("`{name}` of <{}> is \"{value}\", {EXPAND}", tag.name());
                return Err(self.error(node, message));
            }
        }
        Ok(())
    }

    pub(super) fn place(&self, node: Xml<'a>) -> Place {
        let position = self.document.text_pos_at(node.range().start);
        Place {
            line: position.row as usize,
            column: position.col as usize,
        }
    }

    pub(super) fn attribute(&self, node: Xml<'a>, name: &str) -> Result<&'a str, RobotError> {
        node.attribute(name).ok_or_else(|| {
            let tag = node.tag_name().name();
            self.error(
                node,
                format!("<{tag}> has no `{name}`; give it as {name}=\"…\""),
            )
        })
    }

    pub(super) fn parse_number(
        &self,
        node: Xml<'a>,
        what: &str,
        text: &str,
    ) -> Result<f64, RobotError> {
        match text.trim().parse::<f64>() {
            // A very large limit means no limit.
            Ok(v) if is_safe_magnitude(v) || v.is_finite() && node.tag_name().name() == "limit" => {
                Ok(v)
            }
            Ok(v) if v.is_finite() => Err(self.error(
                node,
                format!("{what} is {v:e}, but it must be at most {MAX_NUMBER:e}"),
            )),
            _ if text.contains("${") => {
                Err(self.error(node, format!("{what} is \"{text}\", {EXPAND}")))
            }
            _ => {
                let endless = match node.tag_name().name() {
                    "limit" => {
                        "; a joint that turns without end has type=\"continuous\" and neither `lower` nor `upper`"
                    }
                    _ => "",
                };
                Err(self.error(
                    node,
                    format!("{what} is \"{text}\", but it must be a finite number{endless}"),
                ))
            }
        }
    }

    pub(super) fn number(&self, node: Xml<'a>, name: &str) -> Result<f64, RobotError> {
        let what = format!("`{name}` of <{}>", node.tag_name().name());
        self.parse_number(node, &what, self.attribute(node, name)?)
    }

    pub(super) fn optional_number(
        &self,
        node: Xml<'a>,
        name: &str,
    ) -> Result<Option<f64>, RobotError> {
        node.attribute(name)
            .map(|_| self.number(node, name))
            .transpose()
    }

    pub(super) fn vector(
        &self,
        node: Xml<'a>,
        name: &str,
    ) -> Result<Option<Vector3<f64>>, RobotError> {
        let Some(text) = node.attribute(name) else {
            return Ok(None);
        };
        let what = format!("`{name}` of <{}>", node.tag_name().name());
        let mut values = Vec::new();
        for word in text.split_whitespace() {
            values.push(self.parse_number(node, &what, word)?);
        }
        match values.as_slice() {
            &[x, y, z] => Ok(Some(Vector3::new(x, y, z))),
            _ => Err(self.error(
                node,
                format!("{what} is \"{text}\", but it must be three numbers"),
            )),
        }
    }

    /// Reads `<origin xyz rpy>` of `node`; fixed-axis roll, pitch, yaw as URDF defines it.
    pub(super) fn origin(&self, node: Xml<'a>) -> Result<Isometry3<f64>, RobotError> {
        let Some(origin) = child(node, "origin") else {
            return Ok(Isometry3::identity());
        };
        let xyz = self.vector(origin, "xyz")?.unwrap_or_else(Vector3::zeros);
        let rpy = self.vector(origin, "rpy")?.unwrap_or_else(Vector3::zeros);
        // As alpha in TOML: a larger angle has another unit. 2π that was rounded up is allowed.
        if rpy.amax() > TAU + WRITTEN {
            let [r, p, y] = rpy.map(f64::to_radians).into();
            return Err(self.error(
                origin,
                format!(
                    "`rpy` of <origin> is \"{}\", but it must be three angles within a turn, in rad; were these degrees, it would be \"{r:.6} {p:.6} {y:.6}\"",
                    origin.attribute("rpy").unwrap_or_default()
                ),
            ));
        }
        let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), rpy.z)
            * Rotation3::from_axis_angle(&Vector3::y_axis(), rpy.y)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), rpy.x);
        Ok(Isometry3::from_parts(
            Translation3::from(xyz),
            UnitQuaternion::from_rotation_matrix(&rotation),
        ))
    }
}

/// Returns the first child element called `tag`.
pub(super) fn child<'a>(node: Xml<'a>, tag: &str) -> Option<Xml<'a>> {
    node.children().find(|n| n.has_tag_name(tag))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_before_the_declaration_is_said() {
        for before in ["\n", "  ", "\r\n\r\n", "\t\n "] {
            let text = format!("{before}<?xml version=\"1.0\"?>\n<robot name=\"r\"/>");
            let said = parsed(&text, Path::new("a.urdf")).map_err(|e| e.to_string());
            let said = said.err().unwrap_or_default();
            assert!(said.starts_with("a.urdf:"), "{said}");
            assert!(
                said.contains("remove the empty line or the blanks"),
                "{said}"
            );
        }
        assert!(parsed("<?xml version=\"1.0\"?>\n<robot/>", Path::new("a.urdf")).is_ok());
    }
}
