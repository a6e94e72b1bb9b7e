//! URDF in: the tree of links becomes a chain of bodies, each moved by one joint.
//!
//! Leaves out: visuals, collision shapes, safety controllers and calibration, none of which enters the
//! dynamics.

use std::collections::HashMap;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};

use super::error::{Place, RobotError};
use super::{JointFriction, JointKind, JointLimits};

/// Mass, first moment and inertia of a rigid body, all about the origin of one frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpatialInertia {
    pub mass: f64,
    pub first_moment: Vector3<f64>,
    pub inertia: Matrix3<f64>,
}

impl SpatialInertia {
    fn zero() -> Self {
        Self {
            mass: 0.0,
            first_moment: Vector3::zeros(),
            inertia: Matrix3::zeros(),
        }
    }

    /// From mass, centre of mass and inertia about the centre of mass (Steiner).
    fn from_centre(mass: f64, centre: Vector3<f64>, about_centre: Matrix3<f64>) -> Self {
        let steiner = Matrix3::identity() * centre.norm_squared() - centre * centre.transpose();
        Self {
            mass,
            first_moment: centre * mass,
            inertia: about_centre + steiner * mass,
        }
    }

    /// The same body seen from another frame; `pose` is this frame in that one.
    ///
    /// With c → R·c + p: Σm·S(Rc+p)ᵀS(Rc+p) expands into the four terms below, and no division by the mass is needed.
    pub(super) fn seen_from(&self, pose: &Isometry3<f64>) -> Self {
        let (r, p) = (pose.rotation.to_rotation_matrix(), pose.translation.vector);
        let h = r * self.first_moment;
        let product =
            |a: &Vector3<f64>, b: &Vector3<f64>| Matrix3::identity() * a.dot(b) - b * a.transpose();
        Self {
            mass: self.mass,
            first_moment: h + p * self.mass,
            inertia: r * self.inertia * r.transpose()
                + product(&h, &p)
                + product(&p, &h)
                + product(&p, &p) * self.mass,
        }
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            mass: self.mass + other.mass,
            first_moment: self.first_moment + other.first_moment,
            inertia: self.inertia + other.inertia,
        }
    }
}

/// A joint and the body that it moves.
#[derive(Debug)]
pub(super) struct Body {
    pub joint: String,
    pub kind: JointKind,
    /// Frame of this joint (= of its child link) in the frame of the previous body at q = 0.
    pub origin: Isometry3<f64>,
    /// Unit vector of the axis in the joint's frame.
    pub axis: Vector3<f64>,
    /// In the joint's frame, with everything that is fixed to the link.
    pub inertia: SpatialInertia,
    pub limits: Option<JointLimits>,
    pub friction: Option<JointFriction>,
    pub reduction: Option<f64>,
}

/// The movable bodies from the base outwards; gravity is along −z of the base link.
#[derive(Debug)]
pub(super) struct Chain {
    pub name: String,
    pub bodies: Vec<Body>,
}

struct Reader<'a> {
    path: &'a Path,
    document: &'a Document<'a>,
}

type Xml<'a> = Node<'a, 'a>;

pub(super) fn read(text: &str, path: &Path) -> Result<Chain, RobotError> {
    let document = Document::parse(text).map_err(|e| RobotError::Urdf {
        path: path.into(),
        place: Place {
            line: e.pos().row as usize,
            column: e.pos().col as usize,
        },
        message: format!(
            "this is not well-formed XML ({}), but a URDF file is",
            without_position(&e.to_string())
        ),
    })?;
    Reader {
        path,
        document: &document,
    }
    .chain()
}

/// The XML reader appends " at line:column", which the message already begins with.
fn without_position(message: &str) -> &str {
    match message.rsplit_once(" at ") {
        Some((head, tail)) if tail.chars().all(|c| c.is_ascii_digit() || c == ':') => head,
        _ => message,
    }
}

impl<'a> Reader<'a> {
    fn error(&self, node: Xml<'a>, message: String) -> RobotError {
        RobotError::Urdf {
            path: self.path.into(),
            place: self.place(node),
            message,
        }
    }

    fn place(&self, node: Xml<'a>) -> Place {
        let position = self.document.text_pos_at(node.range().start);
        Place {
            line: position.row as usize,
            column: position.col as usize,
        }
    }

    fn attribute(&self, node: Xml<'a>, name: &str) -> Result<&'a str, RobotError> {
        node.attribute(name).ok_or_else(|| {
            let tag = node.tag_name().name();
            self.error(
                node,
                format!("<{tag}> has no `{name}`; give it as {name}=\"…\""),
            )
        })
    }

    fn parse_number(&self, node: Xml<'a>, what: &str, text: &str) -> Result<f64, RobotError> {
        match text.trim().parse::<f64>() {
            Ok(v) if v.is_finite() => Ok(v),
            _ if text.contains("${") => Err(self.error(
                node,
                format!("{what} is \"{text}\", an unexpanded macro; run xacro over the file first"),
            )),
            _ => Err(self.error(
                node,
                format!("{what} is \"{text}\", but it must be a finite number"),
            )),
        }
    }

    fn number(&self, node: Xml<'a>, name: &str) -> Result<f64, RobotError> {
        let what = format!("`{name}` of <{}>", node.tag_name().name());
        self.parse_number(node, &what, self.attribute(node, name)?)
    }

    fn optional_number(&self, node: Xml<'a>, name: &str) -> Result<Option<f64>, RobotError> {
        node.attribute(name)
            .map(|_| self.number(node, name))
            .transpose()
    }

    fn vector(&self, node: Xml<'a>, name: &str) -> Result<Option<Vector3<f64>>, RobotError> {
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

    /// `<origin xyz rpy>` of `node`; fixed-axis roll, pitch, yaw as URDF defines it.
    fn origin(&self, node: Xml<'a>) -> Result<Isometry3<f64>, RobotError> {
        let Some(origin) = child(node, "origin") else {
            return Ok(Isometry3::identity());
        };
        let xyz = self.vector(origin, "xyz")?.unwrap_or_else(Vector3::zeros);
        let rpy = self.vector(origin, "rpy")?.unwrap_or_else(Vector3::zeros);
        let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), rpy.z)
            * Rotation3::from_axis_angle(&Vector3::y_axis(), rpy.y)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), rpy.x);
        Ok(Isometry3::from_parts(
            Translation3::from(xyz),
            UnitQuaternion::from_rotation_matrix(&rotation),
        ))
    }

    fn inertial(&self, link: Xml<'a>) -> Result<Option<SpatialInertia>, RobotError> {
        let Some(node) = child(link, "inertial") else {
            return Ok(None);
        };
        let name = link.attribute("name").unwrap_or_default();
        let part = |tag: &str| {
            child(node, tag).ok_or_else(|| {
                self.error(
                    node,
                    format!(
                        "<inertial> of link `{name}` has no <{tag}>; it needs <mass> and <inertia>"
                    ),
                )
            })
        };
        let mass_node = part("mass")?;
        let mass = self.number(mass_node, "value")?;
        if mass < 0.0 {
            return Err(self.error(
                mass_node,
                format!("the mass of link `{name}` is {mass}, but it must be 0 or greater, in kg"),
            ));
        }
        let i = part("inertia")?;
        let [ixx, ixy, ixz, iyy, iyz, izz] = {
            let mut values = [0.0; 6];
            for (value, key) in values
                .iter_mut()
                .zip(["ixx", "ixy", "ixz", "iyy", "iyz", "izz"])
            {
                *value = self.number(i, key)?;
            }
            values
        };
        let pose = self.origin(node)?;
        let r = pose.rotation.to_rotation_matrix();
        let about_centre =
            r * Matrix3::new(ixx, ixy, ixz, ixy, iyy, iyz, ixz, iyz, izz) * r.transpose();
        Ok(Some(SpatialInertia::from_centre(
            mass,
            pose.translation.vector,
            about_centre,
        )))
    }

    fn named(&self, tag: &str) -> Result<Vec<(&'a str, Xml<'a>)>, RobotError> {
        let mut seen: HashMap<&str, Place> = HashMap::new();
        let mut found = Vec::new();
        for node in self
            .document
            .root_element()
            .children()
            .filter(|n| n.has_tag_name(tag))
        {
            let name = self.attribute(node, "name")?;
            if let Some(first) = seen.insert(name, self.place(node)) {
                return Err(self.error(
                    node,
                    format!(
                        "{tag} `{name}` was already described at {first}; names must be unique"
                    ),
                ));
            }
            found.push((name, node));
        }
        Ok(found)
    }

    fn end(&self, joint: Xml<'a>, tag: &str) -> Result<&'a str, RobotError> {
        let name = joint.attribute("name").unwrap_or_default();
        let node = child(joint, tag).ok_or_else(|| {
            self.error(
                joint,
                format!("joint `{name}` has no <{tag}>; give <{tag} link=\"…\"/>"),
            )
        })?;
        self.attribute(node, "link")
    }

    fn chain(&self) -> Result<Chain, RobotError> {
        let root = self.document.root_element();
        if root.tag_name().name() != "robot" {
            return Err(self.error(
                root,
                format!(
                    "the file begins with <{}>, but a URDF file begins with <robot>",
                    root.tag_name().name()
                ),
            ));
        }
        let links: HashMap<&str, Xml<'a>> = self.named("link")?.into_iter().collect();
        let joints = self.named("joint")?;
        let reductions = self.reductions()?;
        let mut children: HashMap<&str, Vec<Xml<'a>>> = HashMap::new();
        let mut parent_of: HashMap<&str, &str> = HashMap::new();
        for &(name, node) in &joints {
            let (parent, moved) = (self.end(node, "parent")?, self.end(node, "child")?);
            for link in [parent, moved] {
                if !links.contains_key(link) {
                    return Err(self.error(node, format!("joint `{name}` names link `{link}`, which the file does not describe; add <link name=\"{link}\"> or correct the name")));
                }
            }
            if let Some(first) = parent_of.insert(moved, name) {
                return Err(self.error(node, format!("link `{moved}` is the child of joint `{first}` and of joint `{name}`, a closed loop; only a serial chain from base to tip can be read")));
            }
            children.entry(parent).or_default().push(node);
        }
        let base = self.base(root, &parent_of)?;
        let mut bodies = Vec::new();
        let (_, mut outgoing) = self.rigid_body(base, &links, &children)?;
        while let Some((joint, to_joint)) = outgoing {
            let (body, next) = self.body(joint, to_joint, &links, &children, &reductions)?;
            bodies.push(body);
            outgoing = next;
        }
        if bodies.is_empty() {
            return Err(self.error(root, "the robot has no movable joint; it needs at least one revolute, continuous or prismatic joint".into()));
        }
        let moving = joints
            .iter()
            .filter(|(_, n)| n.attribute("type") != Some("fixed"))
            .count();
        if moving != bodies.len() {
            return Err(self.error(root, format!("{} of the {moving} movable joints are not connected to base link `{base}`; every joint must belong to one chain", moving - bodies.len())));
        }
        Ok(Chain {
            name: root.attribute("name").unwrap_or("robot").to_owned(),
            bodies,
        })
    }

    fn base(&self, root: Xml<'a>, parent_of: &HashMap<&str, &str>) -> Result<&'a str, RobotError> {
        let mut roots = Vec::new();
        for (name, node) in self.named("link")? {
            if !parent_of.contains_key(name) {
                roots.push((name, node));
            }
        }
        match roots.as_slice() {
            [] => Err(self.error(root, "there is no base link (a link that is no joint's child); only a serial chain from base to tip can be read".into())),
            [(name, _)] => Ok(name),
            [(first, _), (second, node), ..] => Err(self.error(*node, format!("links `{first}` and `{second}` are both no joint's child; connect them by a fixed joint so that there is one base"))),
        }
    }

    /// Joins `link` with all that is fixed to it. Gives the body's inertia in the frame of `link`
    /// (none where no link of it has one) and the one movable joint that leaves it with its parent
    /// link's pose.
    #[allow(clippy::type_complexity)]
    fn rigid_body(
        &self,
        link: &'a str,
        links: &HashMap<&str, Xml<'a>>,
        children: &HashMap<&str, Vec<Xml<'a>>>,
    ) -> Result<(Option<SpatialInertia>, Option<(Xml<'a>, Isometry3<f64>)>), RobotError> {
        let mut total: Option<SpatialInertia> = None;
        let mut outgoing: Option<(Xml<'a>, Isometry3<f64>)> = None;
        let mut pending = vec![(link, Isometry3::identity())];
        while let Some((name, pose)) = pending.pop() {
            if let Some(&node) = links.get(name)
                && let Some(part) = self.inertial(node)?
            {
                total = Some(
                    total
                        .unwrap_or_else(SpatialInertia::zero)
                        .plus(&part.seen_from(&pose)),
                );
            }
            for &joint in children.get(name).into_iter().flatten() {
                if self.attribute(joint, "type")? == "fixed" {
                    pending.push((self.end(joint, "child")?, pose * self.origin(joint)?));
                } else if let Some((other, _)) = outgoing {
                    let of = |n: Xml<'a>| n.attribute("name").unwrap_or_default();
                    return Err(self.error(joint, format!(
                        "the robot branches at link `{name}`: joints `{}` and `{}` both leave it or what is fixed to it; only a serial chain from base to tip can be read, so remove one branch or make its joint fixed",
                        of(other), of(joint)
                    )));
                } else {
                    outgoing = Some((joint, pose));
                }
            }
        }
        Ok((total, outgoing))
    }

    #[allow(clippy::type_complexity)]
    fn body(
        &self,
        node: Xml<'a>,
        to_parent: Isometry3<f64>,
        links: &HashMap<&str, Xml<'a>>,
        children: &HashMap<&str, Vec<Xml<'a>>>,
        reductions: &HashMap<&str, f64>,
    ) -> Result<(Body, Option<(Xml<'a>, Isometry3<f64>)>), RobotError> {
        let name = self.attribute(node, "name")?;
        let kind_name = self.attribute(node, "type")?;
        let kind = match kind_name {
            "revolute" | "continuous" => JointKind::Revolute,
            "prismatic" => JointKind::Prismatic,
            other => return Err(self.error(node, format!("joint `{name}` is of type \"{other}\", but only revolute, continuous, prismatic and fixed joints can be read"))),
        };
        if let Some(mimic) = child(node, "mimic") {
            return Err(self.error(mimic, format!("joint `{name}` mimics another joint, but only independent joints can be read; make it fixed or remove <mimic>")));
        }
        let axis = match child(node, "axis") {
            // The default that URDF defines.
            None => Vector3::x(),
            Some(axis_node) => {
                let axis = self.vector(axis_node, "xyz")?.unwrap_or_else(Vector3::x);
                axis.try_normalize(1e-9).ok_or_else(|| self.error(axis_node, format!("the axis of joint `{name}` is the zero vector, but it must be a direction such as \"0 0 1\"")))?
            }
        };
        let link = self.end(node, "child")?;
        let (inertia, outgoing) = self.rigid_body(link, links, children)?;
        let inertia = inertia.ok_or_else(|| RobotError::NoInertial {
            path: self.path.into(),
            place: links
                .get(link)
                .map_or_else(|| self.place(node), |n| self.place(*n)),
            link: link.to_owned(),
            joint: name.to_owned(),
        })?;
        let body = Body {
            joint: name.to_owned(),
            kind,
            origin: to_parent * self.origin(node)?,
            axis,
            inertia,
            limits: self.limits(node, name, kind_name == "continuous")?,
            friction: self.friction(node)?,
            reduction: reductions.get(name).copied(),
        };
        Ok((body, outgoing))
    }

    fn limits(
        &self,
        joint: Xml<'a>,
        name: &str,
        endless: bool,
    ) -> Result<Option<JointLimits>, RobotError> {
        let Some(node) = child(joint, "limit") else {
            return Ok(None);
        };
        let position = if endless {
            [f64::NEG_INFINITY, f64::INFINITY]
        } else {
            let bound = |key| self.optional_number(node, key).map(|v| v.unwrap_or(0.0));
            [bound("lower")?, bound("upper")?]
        };
        if position[0] >= position[1] {
            return Err(self.error(node, format!("the lower limit of joint `{name}` is {} and the upper limit {}, but lower must be below upper", position[0], position[1])));
        }
        let positive = |key: &str| -> Result<f64, RobotError> {
            let value = self.number(node, key)?;
            if value > 0.0 {
                return Ok(value);
            }
            Err(self.error(node, format!("the {key} limit of joint `{name}` is {value}, but it must be greater than 0; remove <limit> where the limits are not known")))
        };
        Ok(Some(JointLimits {
            position,
            velocity: positive("velocity")?,
            acceleration: None,
            torque: Some(positive("effort")?),
        }))
    }

    fn friction(&self, joint: Xml<'a>) -> Result<Option<JointFriction>, RobotError> {
        let Some(node) = child(joint, "dynamics") else {
            return Ok(None);
        };
        Ok(Some(JointFriction {
            coulomb: self.optional_number(node, "friction")?.unwrap_or(0.0),
            viscous: self.optional_number(node, "damping")?.unwrap_or(0.0),
            offset: 0.0,
        }))
    }

    /// Gear ratio by joint name; 1 is the customary placeholder for "none" and says nothing.
    fn reductions(&self) -> Result<HashMap<&'a str, f64>, RobotError> {
        let mut found = HashMap::new();
        for transmission in self
            .document
            .root_element()
            .children()
            .filter(|n| n.has_tag_name("transmission"))
        {
            let Some(reduction) = transmission
                .descendants()
                .find(|n| n.has_tag_name("mechanicalReduction"))
            else {
                continue;
            };
            let value = self.parse_number(
                reduction,
                "<mechanicalReduction>",
                reduction.text().unwrap_or_default(),
            )?;
            if value == 0.0 {
                return Err(self.error(reduction, "<mechanicalReduction> is 0, but it must be motor turns per joint turn, different from 0".into()));
            }
            let joints: Vec<Xml<'a>> = transmission
                .children()
                .filter(|n| n.has_tag_name("joint"))
                .collect();
            match joints.as_slice() {
                [joint] if value != 1.0 => {
                    found.insert(self.attribute(*joint, "name")?, value);
                }
                [_] => {}
                _ => return Err(self.error(transmission, format!("this <transmission> names {} joints, but only transmissions of one joint each can be read", joints.len()))),
            }
        }
        Ok(found)
    }
}

/// The first child element called `tag`.
fn child<'a>(node: Xml<'a>, tag: &str) -> Option<Xml<'a>> {
    node.children().find(|n| n.has_tag_name(tag))
}
