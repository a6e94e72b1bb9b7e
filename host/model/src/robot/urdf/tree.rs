//! Converts the tree of links to a chain of bodies, each moved by one joint.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::Path;

use nalgebra::{Isometry3, Vector3};
use rig_shared::multibody::MAX_JOINTS;

use super::chain::{Body, Chain};
use super::reader::{Reader, Xml, child, parsed};
use super::spatial::SpatialInertia;
use crate::robot::error::{Place, RobotError};
use crate::robot::joint::JointKind;

/// Reads the text of a file; `path` only names it in messages.
pub(in crate::robot) fn read(text: &str, path: &Path) -> Result<Chain, RobotError> {
    let document = parsed(text, path)?;
    Reader {
        path,
        document: &document,
        remarks: RefCell::default(),
    }
    .chain()
}

/// A movable joint with the pose of its parent link in the frame of the body before it.
type Outgoing<'a> = (Xml<'a>, Isometry3<f64>);

/// The joint and the parent of a link.
struct Above<'a> {
    joint: &'a str,
    parent: &'a str,
}

/// Returns the joints of the closed loop above `link` on the path to the base; `None` if the path ends at a base.
fn loop_above(link: &str, above: &HashMap<&str, Above>) -> Option<String> {
    let mut way: Vec<&Above> = Vec::new();
    let mut link = link;
    while let Some(next) = above.get(link) {
        if let Some(first) = way.iter().position(|seen| seen.joint == next.joint) {
            let names = way[first..].iter().rev();
            let names: Vec<String> = names.map(|own| format!("`{}`", own.joint)).collect();
            return Some(names.join(", "));
        }
        way.push(next);
        link = next.parent;
    }
    None
}

/// A link with all links fixed to it.
struct Rigid<'a> {
    /// In the frame of the link; `None` if no part has an inertia.
    inertia: Option<SpatialInertia>,
    /// Links that have an inertia.
    heavy: Vec<String>,
    /// The only movable joint after it.
    outgoing: Option<Outgoing<'a>>,
}

impl<'a> Reader<'a> {
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

    pub(super) fn chain(&self) -> Result<Chain, RobotError> {
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
        self.expanded()?;
        self.as_described()?;
        let links: HashMap<&str, Xml<'a>> = self.named("link")?.into_iter().collect();
        let joints = self.named("joint")?;
        let reductions = self.reductions(&joints)?;
        let mut children: HashMap<&str, Vec<Xml<'a>>> = HashMap::new();
        let mut above: HashMap<&str, Above<'a>> = HashMap::new();
        for &(name, node) in &joints {
            let (parent, moved) = (self.end(node, "parent")?, self.end(node, "child")?);
            for link in [parent, moved] {
                if !links.contains_key(link) {
                    return Err(self.error(node, format!("joint `{name}` names link `{link}`, which the file does not describe; add <link name=\"{link}\"> or correct the name")));
                }
            }
            if let Some(first) = above.insert(
                moved,
                Above {
                    joint: name,
                    parent,
                },
            ) {
                let first = first.joint;
                return Err(self.error(node, format!("link `{moved}` is the child of joint `{first}` and of joint `{name}`, a closed loop; only a serial chain from base to tip can be read")));
            }
            children.entry(parent).or_default().push(node);
        }
        for &(_, node) in &joints {
            if let Some(names) = loop_above(self.end(node, "child")?, &above) {
                return Err(self.error(node, format!("joints {names} form a closed loop; only a serial chain from base to tip can be read, so let one of them leave a link outside of it")));
            }
        }
        let base = self.base(root, &above)?;
        let mut bodies = Vec::new();
        let mut outgoing = self.rigid_body(base, &links, &children)?.outgoing;
        while let Some((joint, to_joint)) = outgoing {
            if bodies.len() == MAX_JOINTS {
                return Err(self.error(joint, format!("this is movable joint {} of the chain, but a robot has at most {MAX_JOINTS}", MAX_JOINTS + 1)));
            }
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
            file: self.path.display().to_string(),
            base: base.to_owned(),
            bodies,
            remarks: self.remarks.take(),
        })
    }

    fn base(&self, root: Xml<'a>, above: &HashMap<&str, Above>) -> Result<&'a str, RobotError> {
        let mut roots = Vec::new();
        for (name, node) in self.named("link")? {
            if !above.contains_key(name) {
                roots.push((name, node));
            }
        }
        match roots.as_slice() {
            [] => Err(self.error(root, "the robot has no link; it needs a base link and one for each joint to move".into())),
            [(name, _)] => Ok(name),
            [(first, _), (second, node), ..] => Err(self.error(*node, format!("links `{first}` and `{second}` are both no joint's child; connect them by a fixed joint so that there is one base"))),
        }
    }

    /// Joins `link` with all links fixed to it.
    fn rigid_body(
        &self,
        link: &'a str,
        links: &HashMap<&str, Xml<'a>>,
        children: &HashMap<&str, Vec<Xml<'a>>>,
    ) -> Result<Rigid<'a>, RobotError> {
        let mut total: Option<SpatialInertia> = None;
        let mut heavy = Vec::new();
        let mut outgoing: Option<Outgoing<'a>> = None;
        let mut pending = vec![(link, Isometry3::identity())];
        while let Some((name, pose)) = pending.pop() {
            if let Some(&node) = links.get(name)
                && let Some(part) = self.inertial(node)?
            {
                heavy.push(name.to_owned());
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
        Ok(Rigid {
            inertia: total,
            heavy,
            outgoing,
        })
    }

    fn body(
        &self,
        node: Xml<'a>,
        to_parent: Isometry3<f64>,
        links: &HashMap<&str, Xml<'a>>,
        children: &HashMap<&str, Vec<Xml<'a>>>,
        reductions: &HashMap<&str, f64>,
    ) -> Result<(Body, Option<Outgoing<'a>>), RobotError> {
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
            // The default of the URDF definition.
            None => Vector3::x(),
            Some(axis_node) => {
                let axis = self.vector(axis_node, "xyz")?.unwrap_or_else(Vector3::x);
                axis.try_normalize(1e-9).ok_or_else(|| self.error(axis_node, format!("the axis of joint `{name}` is the zero vector, but it must be a direction such as \"0 0 1\"")))?
            }
        };
        let link = self.end(node, "child")?;
        let rigid = self.rigid_body(link, links, children)?;
        let inertia = rigid.inertia.ok_or_else(|| RobotError::NoInertial {
            path: self.path.into(),
            place: links
                .get(link)
                .map_or_else(|| self.place(node), |n| self.place(*n)),
            link: link.to_owned(),
            joint: name.to_owned(),
        })?;
        let body = Body {
            joint: name.to_owned(),
            place: self.place(node),
            link: link.to_owned(),
            heavy: rigid.heavy,
            kind,
            origin: to_parent * self.origin(node)?,
            axis,
            inertia,
            limits: self.limits(node, name, kind_name == "continuous")?,
            friction: self.friction(node)?,
            reduction: reductions.get(name).copied(),
        };
        Ok((body, rigid.outgoing))
    }
}
