//! The tree of bodies of an MJCF file.

use nalgebra::{Isometry3, Matrix3, Unit, UnitQuaternion, Vector3};

use super::elements::{REMEDY, Reader, Xml};
use crate::robot::error::RobotError;
use crate::robot::joint::{JointFriction, JointKind};
use crate::robot::urdf::SpatialInertia;

/// A joint of a body.
pub(super) struct BodyJoint<'a> {
    pub name: String,
    pub node: Xml<'a>,
    pub kind: JointKind,
    /// Point on its axis, in the frame of the body.
    pub point: Vector3<f64>,
    pub axis: Unit<Vector3<f64>>,
    /// Its position in the pose of the file, rad or m.
    pub reference: f64,
    pub friction: JointFriction,
    pub armature: f64,
    /// Lowest and highest position, if limited.
    pub range: Option<[f64; 2]>,
}

impl BodyJoint<'_> {
    /// Returns the motion of the body's frame at a position.
    pub(super) fn at(&self, position: f64) -> Isometry3<f64> {
        let moved = position - self.reference;
        match self.kind {
            JointKind::Prismatic => Isometry3::translation(
                self.axis.x * moved,
                self.axis.y * moved,
                self.axis.z * moved,
            ),
            JointKind::Revolute => {
                let turn = UnitQuaternion::from_axis_angle(&self.axis, moved);
                let to = Isometry3::from(self.point);
                to * Isometry3::from_parts(Vector3::zeros().into(), turn) * to.inverse()
            }
        }
    }
}

/// An element of a body, in frames.
pub(super) struct Placed<'a> {
    node: Xml<'a>,
    /// Pose of the frames in the body.
    frame: Isometry3<f64>,
}

impl Placed<'_> {
    fn is_body(&self) -> bool {
        self.node.has_tag_name("body")
    }
}

/// A body.
pub(super) struct TreeBody<'a> {
    pub name: String,
    /// Pose in the frame of the body that it is in.
    pub pose: Isometry3<f64>,
    pub joints: Vec<BodyJoint<'a>>,
    /// In its own frame.
    pub inertia: Option<SpatialInertia>,
    /// The body that it is in, by its index; `None` in the world.
    pub parent: Option<usize>,
    pub children: Vec<usize>,
}

/// All bodies, each behind the body that it is in.
pub(super) struct Tree<'a> {
    pub bodies: Vec<TreeBody<'a>>,
}

impl<'a> Tree<'a> {
    /// Reads the tree.
    ///
    /// # Errors
    /// The first fault of the file, with its line.
    pub(super) fn read(reader: &Reader<'a>) -> Result<Self, RobotError> {
        let root = reader.document.root_element();
        let mut tree = Self { bodies: Vec::new() };
        let worlds = root.children().filter(|n| n.has_tag_name("worldbody"));
        let mut pending: Vec<(Placed<'a>, Option<usize>)> = Vec::new();
        for world in worlds {
            let inner = reader.contents(world)?.into_iter();
            pending.extend(inner.filter(Placed::is_body).map(|own| (own, None)));
        }
        pending.reverse();
        while let Some((placed, parent)) = pending.pop() {
            let index = tree.bodies.len();
            let inner = reader.contents(placed.node)?;
            tree.bodies
                .push(tree.body(reader, &placed, &inner, parent)?);
            if let Some(parent) = parent {
                tree.bodies[parent].children.push(index);
            }
            let inner = inner.into_iter().rev().filter(Placed::is_body);
            pending.extend(inner.map(|own| (own, Some(index))));
        }
        if tree.bodies.is_empty() {
            return Err(reader.error(
                root,
                "<worldbody> has no <body>; give the file of a robot".to_owned(),
            ));
        }
        Ok(tree)
    }

    fn body(
        &self,
        reader: &Reader<'a>,
        placed: &Placed<'a>,
        inner: &[Placed<'a>],
        parent: Option<usize>,
    ) -> Result<TreeBody<'a>, RobotError> {
        let node = placed.node;
        let pose = reader.pose(node)?;
        let name = node.attribute("name");
        let name = name.map_or_else(|| format!("body{}", self.bodies.len() + 1), str::to_owned);
        if self.bodies.iter().any(|body| body.name == name) {
            return Err(reader.error(
                node,
                format!("body `{name}` is there twice; bodies need names of their own"),
            ));
        }
        let mut joints = Vec::new();
        for own in inner {
            match own.node.tag_name().name() {
                "joint" => joints.push(reader.joint(own, &name, joints.len())?),
                "freejoint" => return Err(reader.error(own.node, free(&name))),
                _ => {}
            }
        }
        let own_inertia = reader.inertial(inner, &name)?;
        if own_inertia.is_none()
            && inner.iter().any(|own| own.node.has_tag_name("geom"))
            && (!joints.is_empty() || self.moves(parent))
        {
            return Err(reader.error(
                node,
                format!("body `{name}` has geoms and no <inertial>, so MuJoCo computes its inertia from the geoms, which is not done here; {REMEDY}"),
            ));
        }
        Ok(TreeBody {
            name,
            // MuJoCo gives a body without inertia the centre of mass `pos`, without its frames.
            inertia: own_inertia.or_else(|| reader.bounded_nothing(pose.translation.vector)),
            pose: placed.frame * pose,
            joints,
            parent,
            children: Vec::new(),
        })
    }

    /// Returns true if a joint moves this body.
    fn moves(&self, body: Option<usize>) -> bool {
        let has_joint = |own: &usize| !self.bodies[*own].joints.is_empty();
        body.is_some_and(|own| self.path_to(own).iter().any(has_joint))
    }

    /// Returns the bodies from the world to a body, that one last.
    pub(super) fn path_to(&self, body: usize) -> Vec<usize> {
        let mut path = vec![body];
        while let Some(parent) = path.last().and_then(|own| self.bodies[*own].parent) {
            path.push(parent);
        }
        path.reverse();
        path
    }

    /// Returns the largest number of joints on a way outwards that begins with this body.
    pub(super) fn depth(&self, body: usize) -> usize {
        let own = &self.bodies[body];
        let deepest = own.children.iter().map(|child| self.depth(*child)).max();
        own.joints.len() + deepest.unwrap_or(0)
    }
}

fn free(body: &str) -> String {
    format!(
        "body `{body}` has a free or ball joint, and a robot here is a chain of hinges and slides; remove the joint to fix the base"
    )
}

impl<'a> Reader<'a> {
    /// Returns the elements of a body, also those in frames.
    fn contents(&self, body: Xml<'a>) -> Result<Vec<Placed<'a>>, RobotError> {
        let of = |node: Xml<'a>, frame: Isometry3<f64>| {
            let inner = node.children().rev().filter(Xml::is_element);
            inner.map(move |node| Placed { node, frame })
        };
        let mut pending: Vec<Placed<'a>> = of(body, Isometry3::identity()).collect();
        let mut found = Vec::new();
        while let Some(own) = pending.pop() {
            if own.node.has_tag_name("frame") {
                pending.extend(of(own.node, own.frame * self.pose(own.node)?));
            } else {
                found.push(own);
            }
        }
        Ok(found)
    }

    fn joint(
        &self,
        placed: &Placed<'a>,
        body: &str,
        before: usize,
    ) -> Result<BodyJoint<'a>, RobotError> {
        let node = placed.node;
        let kind = match self.attribute(node, "type").unwrap_or("hinge") {
            "hinge" => JointKind::Revolute,
            "slide" => JointKind::Prismatic,
            "free" | "ball" => return Err(self.error(node, free(body))),
            other => {
                return Err(self.error(
                    node,
                    format!("`type` of <joint> is \"{other}\", but it must be hinge or slide"),
                ));
            }
        };
        let name = node.attribute("name");
        let name = name.map_or_else(|| format!("{body}_joint{}", before + 1), str::to_owned);
        let axis = Vector3::from(self.array::<3>(node, "axis")?.unwrap_or([0.0, 0.0, 1.0]));
        let axis = Unit::try_new(axis, 1e-12).ok_or_else(|| {
            self.error(
                node,
                format!("`axis` of joint `{name}` has no direction; give a vector that is not 0"),
            )
        })?;
        let to_si = |value: f64| match kind {
            JointKind::Revolute => self.angle(value),
            JointKind::Prismatic => value,
        };
        let [damping, loss, armature] = [
            self.leading(node, "damping", 3, 0.0)?.0,
            self.number(node, "frictionloss", 0.0)?,
            self.number(node, "armature", 0.0)?,
        ];
        for (what, value) in [
            ("damping", damping),
            ("frictionloss", loss),
            ("armature", armature),
        ] {
            if value < 0.0 {
                return Err(self.error(
                    node,
                    format!("`{what}` of joint `{name}` is {value}, but it must be 0 or greater"),
                ));
            }
        }
        let viscous = if self.is_undamped { 0.0 } else { damping };
        let coulomb = if self.is_frictionless { 0.0 } else { loss };
        let point = Vector3::from(self.array::<3>(node, "pos")?.unwrap_or_default());
        let range = self
            .array::<2>(node, "range")?
            .map(|range| range.map(to_si));
        Ok(BodyJoint {
            kind,
            point: (placed.frame * nalgebra::Point3::from(point)).coords,
            axis: placed.frame.rotation * axis,
            reference: to_si(self.number(node, "ref", 0.0)?),
            friction: JointFriction {
                coulomb,
                viscous,
                offset: 0.0,
            },
            armature,
            range: range.filter(|[low, high]| {
                low < high && self.attribute(node, "limited") != Some("false")
            }),
            name,
            node,
        })
    }

    /// Reads `<inertial>` of a body.
    fn inertial(
        &self,
        inner: &[Placed<'a>],
        name: &str,
    ) -> Result<Option<SpatialInertia>, RobotError> {
        let mut all = inner.iter().filter(|n| n.node.has_tag_name("inertial"));
        let Some(Placed { node, frame }) = all.next() else {
            return Ok(None);
        };
        let node = *node;
        if let Some(second) = all.next() {
            return Err(self.error(
                second.node,
                format!("body `{name}` has a second <inertial>; remove one"),
            ));
        }
        let mass = self.number(node, "mass", f64::NAN)?;
        if !(mass >= 0.0) {
            return Err(self.error(
                node,
                format!("<inertial> of body `{name}` has no `mass` of 0 or greater, in kg"),
            ));
        }
        let pose = frame * self.pose(node)?;
        let full = self.array::<6>(node, "fullinertia")?;
        let about_centre = match (full, self.array::<3>(node, "diaginertia")?) {
            (Some([xx, yy, zz, xy, xz, yz]), _) => Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            (None, Some(diagonal)) => Matrix3::from_diagonal(&Vector3::from(diagonal)),
            (None, None) => {
                return Err(self.error(node, format!("<inertial> of body `{name}` has neither `diaginertia` nor `fullinertia`; add one, in kg·m²")));
            }
        };
        let r = pose.rotation.to_rotation_matrix();
        Ok(Some(SpatialInertia::from_centre(
            mass.max(self.bounds.mass),
            pose.translation.vector,
            r * self.bounded(about_centre) * r.transpose(),
        )))
    }

    /// Applies the bounds of the file to an inertia about the centre of mass.
    fn bounded(&self, inertia: Matrix3<f64>) -> Matrix3<f64> {
        let bounds = &self.bounds;
        if bounds.inertia <= 0.0 && !bounds.is_balanced {
            return inertia;
        }
        let mut principal = inertia.symmetric_eigen();
        let moments = &mut principal.eigenvalues;
        moments.apply(|moment| *moment = moment.max(bounds.inertia));
        if bounds.is_balanced && 2.0 * moments.max() > moments.sum() {
            moments.fill(moments.mean());
        }
        principal.recompose()
    }

    /// Returns the inertia of a body without any, if the file has bounds.
    fn bounded_nothing(&self, centre: Vector3<f64>) -> Option<SpatialInertia> {
        let bounds = &self.bounds;
        (bounds.mass > 0.0 || bounds.inertia > 0.0).then(|| {
            SpatialInertia::from_centre(
                bounds.mass.max(0.0),
                centre,
                self.bounded(Matrix3::zeros()),
            )
        })
    }
}
