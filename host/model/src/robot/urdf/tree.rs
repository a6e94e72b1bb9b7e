//! The tree of links and joints of a URDF file.

use std::collections::HashMap;

use super::reader::{Reader, Xml, child};
use crate::robot::error::{Place, RobotError};

/// How a joint lets its link move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    Fixed,
    Revolute,
    /// A revolute joint that turns without end.
    Continuous,
    Prismatic,
    /// Several degrees of freedom.
    Floating,
    /// Several degrees of freedom in a plane.
    Planar,
}

impl Motion {
    /// Returns true if the joint has one coordinate.
    pub(super) fn is_single(self) -> bool {
        matches!(self, Self::Revolute | Self::Continuous | Self::Prismatic)
    }

    /// Returns the unit of the joint's coordinate.
    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::Prismatic => "m",
            _ => "rad",
        }
    }
}

/// `<mimic>`: q = multiplier · q of the master + offset.
pub(super) struct Mimic<'a> {
    pub node: Xml<'a>,
    pub master: &'a str,
    pub multiplier: f64,
    pub offset: f64,
}

/// A joint of the file.
pub(super) struct TreeJoint<'a> {
    pub name: &'a str,
    pub node: Xml<'a>,
    pub motion: Motion,
    pub parent: &'a str,
    pub child: &'a str,
    pub mimic: Option<Mimic<'a>>,
}

/// All links and joints of the file. Every link has one joint above it at most, and no loop exists.
pub(super) struct Tree<'a> {
    /// Links in the order of the file.
    pub links: Vec<(&'a str, Xml<'a>)>,
    pub by_name: HashMap<&'a str, Xml<'a>>,
    pub joints: Vec<TreeJoint<'a>>,
    /// Joints that leave a link.
    below: HashMap<&'a str, Vec<usize>>,
    /// The joint that moves a link.
    above: HashMap<&'a str, usize>,
}

impl<'a> Tree<'a> {
    /// Returns the joints (their indices) that leave `link`.
    pub(super) fn below(&self, link: &str) -> impl Iterator<Item = usize> + '_ {
        self.below.get(link).into_iter().flatten().copied()
    }

    /// Returns the links that no joint moves.
    pub(super) fn roots(&self) -> Vec<(&'a str, Xml<'a>)> {
        let is_root = |(name, _): &&(&'a str, Xml<'a>)| !self.above.contains_key(name);
        self.links.iter().filter(is_root).copied().collect()
    }

    /// Returns the joints (their indices) from the root of the tree to `link`.
    pub(super) fn path_to(&self, link: &str) -> Vec<usize> {
        let mut path = Vec::new();
        let mut link = link;
        while let Some(&joint) = self.above.get(link) {
            path.push(joint);
            link = self.joints[joint].parent;
        }
        path.reverse();
        path
    }

    /// Returns the index of the joint called `name`.
    pub(super) fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Returns all links, each one after the link that carries it.
    pub(super) fn outwards(&self) -> Vec<&'a str> {
        let mut order: Vec<&'a str> = self.roots().into_iter().map(|(name, _)| name).collect();
        let mut next = 0;
        while let Some(&link) = order.get(next) {
            order.extend(self.below(link).map(|joint| self.joints[joint].child));
            next += 1;
        }
        order
    }

    /// Returns the joints of the closed loop above `link` on the path to the base; `None` if the path ends at a base.
    fn loop_above(&self, link: &str) -> Option<String> {
        let mut way: Vec<usize> = Vec::new();
        let mut link = link;
        while let Some(&next) = self.above.get(link) {
            if let Some(first) = way.iter().position(|seen| *seen == next) {
                let names = way[first..].iter().rev();
                let names: Vec<String> = names
                    .map(|own| format!("`{}`", self.joints[*own].name))
                    .collect();
                return Some(names.join(", "));
            }
            way.push(next);
            link = self.joints[next].parent;
        }
        None
    }
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

    fn tree_joint(&self, name: &'a str, node: Xml<'a>) -> Result<TreeJoint<'a>, RobotError> {
        let motion = match self.attribute(node, "type")? {
            "fixed" => Motion::Fixed,
            "revolute" => Motion::Revolute,
            "continuous" => Motion::Continuous,
            "prismatic" => Motion::Prismatic,
            "floating" => Motion::Floating,
            "planar" => Motion::Planar,
            other => {
                return Err(self.error(node, format!("joint `{name}` is of type \"{other}\", but only revolute, continuous, prismatic and fixed joints can be read")));
            }
        };
        let mimic = match child(node, "mimic") {
            Some(own) => Some(Mimic {
                node: own,
                master: self.attribute(own, "joint")?,
                multiplier: self.optional_number(own, "multiplier")?.unwrap_or(1.0),
                offset: self.optional_number(own, "offset")?.unwrap_or(0.0),
            }),
            None => None,
        };
        Ok(TreeJoint {
            name,
            node,
            motion,
            parent: self.end(node, "parent")?,
            child: self.end(node, "child")?,
            mimic,
        })
    }

    /// Reads the links and joints of the file and how they hang together.
    ///
    /// # Errors
    /// The file is no URDF, or its links do not form trees.
    pub(super) fn tree(&self) -> Result<Tree<'a>, RobotError> {
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
        let links = self.named("link")?;
        let mut tree = Tree {
            by_name: links.iter().copied().collect(),
            links,
            joints: Vec::new(),
            below: HashMap::new(),
            above: HashMap::new(),
        };
        for (index, (name, node)) in self.named("joint")?.into_iter().enumerate() {
            let joint = self.tree_joint(name, node)?;
            for link in [joint.parent, joint.child] {
                if !tree.by_name.contains_key(link) {
                    return Err(self.error(node, format!("joint `{name}` names link `{link}`, which the file does not describe; add <link name=\"{link}\"> or correct the name")));
                }
            }
            if let Some(first) = tree.above.insert(joint.child, index) {
                let (moved, first) = (joint.child, tree.joints[first].name);
                return Err(self.error(node, format!("link `{moved}` is the child of joint `{first}` and of joint `{name}`, a closed loop; only a serial chain from base to tip can be read")));
            }
            tree.below.entry(joint.parent).or_default().push(index);
            tree.joints.push(joint);
        }
        for joint in &tree.joints {
            if let Some(names) = tree.loop_above(joint.child) {
                return Err(self.error(joint.node, format!("joints {names} form a closed loop; only a serial chain from base to tip can be read, so let one of them leave a link outside of it")));
            }
        }
        Ok(tree)
    }
}
