//! Elements and numbers of an MJCF file, with the defaults of their class.

use std::collections::HashMap;
use std::path::Path;

use roxmltree::{Document, Node};

use super::schema::unknown;
use crate::robot::error::{Place, RobotError};
use crate::robot::fault::is_safe_magnitude;

/// An element.
pub(super) type Xml<'a> = Node<'a, 'a>;

/// Attributes by element and name.
type Attributes<'a> = HashMap<(&'a str, &'a str), &'a str>;

/// Elements of actuators, which have one set of defaults in a class.
const ACTUATORS: [&str; 13] = [
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "plugin",
    "dcmotor",
    "pid",
    "orientation",
];

/// How MuJoCo writes a model without what is refused here; tried with MuJoCo 3.3.2, 3.3.7 and 4.0.0.
pub(super) const REMEDY: &str = "let MuJoCo (3.3.2 or newer) write the whole model: `spec = mujoco.MjSpec.from_file(\"in.xml\"); spec.compiler.saveinertial = True; spec.compile(); open(\"whole.xml\", \"w\").write(spec.to_xml())`";

/// Changes of `<compiler>` to the inertias of all moving bodies.
#[derive(Clone, Copy, Default)]
pub(super) struct Bounds {
    /// Least mass, kg.
    pub mass: f64,
    /// Least principal moment of inertia, kg·m².
    pub inertia: f64,
    /// True if principal moments that no body has become their mean.
    pub is_balanced: bool,
}

/// Settings of a file for all of its elements.
pub(super) struct Reader<'a> {
    pub path: &'a Path,
    pub document: &'a Document<'a>,
    /// True if angles are in degrees.
    pub is_in_degrees: bool,
    /// Order of the axes of Euler angles.
    pub order: &'a str,
    pub bounds: Bounds,
    /// True if a flag turns damping off.
    pub is_undamped: bool,
    /// True if a flag turns dry friction off.
    pub is_frictionless: bool,
    /// Attributes of each class, with those of the classes that it is in. The outermost class has an empty name.
    classes: HashMap<&'a str, Attributes<'a>>,
}

impl<'a> Reader<'a> {
    /// Reads the settings and the defaults.
    ///
    /// # Errors
    /// A setting that changes the meaning of the file, by its line.
    pub(super) fn new(path: &'a Path, document: &'a Document<'a>) -> Result<Self, RobotError> {
        let mut reader = Self {
            path,
            document,
            is_in_degrees: true,
            order: "xyz",
            bounds: Bounds::default(),
            is_undamped: false,
            is_frictionless: false,
            classes: HashMap::from([("", Attributes::new())]),
        };
        let root = document.root_element();
        let refused = ["include", "replicate", "attach", "composite", "flexcomp"];
        if let Some(node) = root
            .descendants()
            .find(|node| refused.contains(&node.tag_name().name()))
        {
            return Err(reader.error(
                node,
                format!("<{}> is not read; {REMEDY}", node.tag_name().name()),
            ));
        }
        if let Some((node, message)) = unknown(document) {
            return Err(reader.error(node, message));
        }
        for compiler in root.children().filter(|n| n.has_tag_name("compiler")) {
            reader.settings(compiler)?;
        }
        for node in root.children().filter(|n| n.has_tag_name("default")) {
            reader.class(node, "", true)?;
        }
        reader.is_undamped = reader.is_off("damper") || reader.is_off("passive");
        reader.is_frictionless = reader.is_off("frictionloss") || reader.is_off("constraint");
        reader.check_classes()?;
        Ok(reader)
    }

    /// Returns true if the last `<flag>` that names a part of MuJoCo's dynamics turns it off.
    pub(super) fn is_off(&self, name: &str) -> bool {
        let root = self.document.root_element();
        let options = root.children().filter(|n| n.has_tag_name("option"));
        let flags = options.flat_map(|n| n.children());
        flags.filter_map(|n| n.attribute(name)).next_back() == Some("disable")
    }

    /// Refuses classes that the file does not define.
    fn check_classes(&self) -> Result<(), RobotError> {
        let root = self.document.root_element();
        let elements = root.children().filter(|n| !n.has_tag_name("default"));
        for node in elements.flat_map(|n| n.descendants()) {
            for name in ["class", "childclass"] {
                let class = node.attribute(name).unwrap_or("main");
                if class != "main" && !self.classes.contains_key(class) {
                    return Err(self.error(
                        node,
                        format!("`{name}` is \"{class}\", but no <default> has this class"),
                    ));
                }
            }
        }
        Ok(())
    }

    fn settings(&mut self, compiler: Xml<'a>) -> Result<(), RobotError> {
        match compiler.attribute("angle") {
            Some("radian") => self.is_in_degrees = false,
            Some("degree") => self.is_in_degrees = true,
            None => {}
            Some(other) => {
                return Err(self.error(
                    compiler,
                    format!("`angle` is \"{other}\", but it must be radian or degree"),
                ));
            }
        }
        self.bounds.mass = self.number(compiler, "boundmass", self.bounds.mass)?;
        self.bounds.inertia = self.number(compiler, "boundinertia", self.bounds.inertia)?;
        if let Some(value) = compiler.attribute("balanceinertia") {
            self.bounds.is_balanced = value == "true";
        }
        if self.number(compiler, "settotalmass", -1.0)? > 0.0 {
            return Err(self.error(
                compiler,
                format!(
                    "<compiler settotalmass> scales all masses, which is not done here; {REMEDY}"
                ),
            ));
        }
        if let Some(order) = compiler.attribute("eulerseq") {
            if order.len() != 3 || order.chars().any(|c| !"xyzXYZ".contains(c)) {
                return Err(self.error(
                    compiler,
                    format!("`eulerseq` is \"{order}\", but it must be three of x, y, z, X, Y, Z"),
                ));
            }
            self.order = order;
        }
        for (name, value, why) in [
            (
                "coordinate",
                "global",
                "global coordinates were removed from MJCF",
            ),
            (
                "inertiafromgeom",
                "true",
                "inertias from geoms are not computed here",
            ),
        ] {
            if compiler.attribute(name) == Some(value) {
                return Err(self.error(
                    compiler,
                    format!("<compiler {name}=\"{value}\">: {why}; {REMEDY}"),
                ));
            }
        }
        Ok(())
    }

    /// Reads a class and those in it, which inherit its attributes.
    fn class(
        &mut self,
        node: Xml<'a>,
        within: &'a str,
        is_outermost: bool,
    ) -> Result<(), RobotError> {
        let name = match (is_outermost, node.attribute("class")) {
            (true, _) => "",
            (false, Some(name)) => name,
            (false, None) => {
                return Err(self.error(node, "<default> in another one has no `class`".to_owned()));
            }
        };
        let mut own = self.classes.get(within).cloned().unwrap_or_default();
        for element in node.children().filter(Xml::is_element) {
            for attribute in element.attributes() {
                own.insert(
                    (kind(element.tag_name().name()), attribute.name()),
                    attribute.value(),
                );
            }
        }
        self.classes.insert(name, own.clone());
        if let (true, Some(main)) = (is_outermost, node.attribute("class")) {
            self.classes.insert(main, own);
        }
        for inner in node.children().filter(|n| n.has_tag_name("default")) {
            self.class(inner, name, false)?;
        }
        Ok(())
    }

    /// Returns the error about an element.
    pub(super) fn error(&self, node: Xml<'a>, message: String) -> RobotError {
        RobotError::Urdf {
            path: self.path.into(),
            place: self.place(node),
            message,
        }
    }

    pub(super) fn place(&self, node: Xml<'a>) -> Place {
        let position = self.document.text_pos_at(node.range().start);
        Place {
            line: position.row as usize,
            column: position.col as usize,
        }
    }

    /// Returns an attribute of an element, or that of its class: its own, or the `childclass` of the nearest body around it.
    pub(super) fn attribute(&self, node: Xml<'a>, name: &str) -> Option<&'a str> {
        if let Some(own) = node.attribute(name) {
            return Some(own);
        }
        let around = || {
            node.ancestors()
                .find_map(|body| body.attribute("childclass"))
        };
        let class = node.attribute("class").or_else(around).unwrap_or("");
        let class = self.classes.get(class).or_else(|| self.classes.get(""))?;
        let tag = kind(node.tag_name().name());
        class
            .iter()
            .find(|((of, own), _)| *of == tag && *own == name)
            .map(|(_, value)| *value)
    }

    /// Returns the numbers of an attribute; `None` without it.
    ///
    /// # Errors
    /// Text that is no number, by its line.
    pub(super) fn numbers(
        &self,
        node: Xml<'a>,
        name: &str,
    ) -> Result<Option<Vec<f64>>, RobotError> {
        let Some(text) = self.attribute(node, name) else {
            return Ok(None);
        };
        let value = |word: &str| word.parse().ok().filter(|v: &f64| is_safe_magnitude(*v));
        let values: Option<Vec<f64>> = text.split_whitespace().map(value).collect();
        match values {
            Some(values) => Ok(Some(values)),
            None => Err(self.error(
                node,
                format!(
                    "`{name}` of <{}> is \"{text}\", but it must be finite numbers",
                    node.tag_name().name()
                ),
            )),
        }
    }

    /// Returns the N numbers of an attribute; `None` without it.
    ///
    /// # Errors
    /// As [`Self::numbers`], and another count.
    pub(super) fn array<const N: usize>(
        &self,
        node: Xml<'a>,
        name: &str,
    ) -> Result<Option<[f64; N]>, RobotError> {
        let Some(values) = self.numbers(node, name)? else {
            return Ok(None);
        };
        match <[f64; N]>::try_from(values) {
            Ok(values) => Ok(Some(values)),
            Err(values) => Err(self.error(
                node,
                format!(
                    "`{name}` of <{}> has {} numbers, but it must have {N}",
                    node.tag_name().name(),
                    values.len()
                ),
            )),
        }
    }

    /// Returns the one number of an attribute, or `otherwise` without it.
    ///
    /// # Errors
    /// As [`Self::array`].
    pub(super) fn number(
        &self,
        node: Xml<'a>,
        name: &str,
        otherwise: f64,
    ) -> Result<f64, RobotError> {
        Ok(self.array::<1>(node, name)?.map_or(otherwise, |[own]| own))
    }

    /// Returns the first of up to `most` numbers of an attribute, or `otherwise` without it, and true if another one is not
    /// zero.
    ///
    /// # Errors
    /// As [`Self::numbers`], and another count.
    pub(super) fn leading(
        &self,
        node: Xml<'a>,
        name: &str,
        most: usize,
        otherwise: f64,
    ) -> Result<(f64, bool), RobotError> {
        let Some(values) = self.numbers(node, name)? else {
            return Ok((otherwise, false));
        };
        match values.as_slice() {
            [first, rest @ ..] if values.len() <= most => {
                Ok((*first, rest.iter().any(|value| *value != 0.0)))
            }
            _ => Err(self.error(
                node,
                format!(
                    "`{name}` of <{}> has {} numbers, but it must have 1 to {most}",
                    node.tag_name().name(),
                    values.len()
                ),
            )),
        }
    }

    /// Converts an angle of the file to rad.
    pub(super) fn angle(&self, value: f64) -> f64 {
        if self.is_in_degrees {
            value.to_radians()
        } else {
            value
        }
    }
}

/// Returns the name under which the defaults of an element are kept.
fn kind(tag: &str) -> &str {
    if ACTUATORS.contains(&tag) {
        "actuator"
    } else {
        tag
    }
}
