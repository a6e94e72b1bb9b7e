//! The chain of bodies that is the robot, and what is merged into it.

use std::path::Path;

use nalgebra::{Isometry3, Vector3};
use rig_shared::multibody::MAX_JOINTS;
use roxmltree::Document;

use super::actuators::{Drive, Drives};
use super::elements::Reader;
use super::left_out::left_out;
use super::tree::{BodyJoint, Tree};
use crate::robot::error::{Place, RobotError};
use crate::robot::urdf::{Body, Chain, ChainChoice, SpatialInertia};

/// A chain, and gravity in the frame of the world, m/s².
pub(in crate::robot) struct Read {
    pub chain: Chain,
    pub gravity: [f64; 3],
}

/// The bodies on the way to the tip.
struct Selected<'t, 'a> {
    tree: &'t Tree<'a>,
    path: Vec<usize>,
    /// Index in `path` of the first body whose joints move.
    first: usize,
    choice: &'t ChainChoice,
}

/// Returns true for XML whose outermost element is that of MJCF.
pub(in crate::robot) fn is_mjcf(text: &str) -> bool {
    text.contains("<mujoco")
        && Document::parse(text).is_ok_and(|d| d.root_element().has_tag_name("mujoco"))
}

/// Reads the chain that `choice` selects from the text of a file; `path` only names it in messages.
pub(in crate::robot) fn read(
    text: &str,
    path: &Path,
    choice: &ChainChoice,
) -> Result<Read, RobotError> {
    let document = Document::parse(text).map_err(|e| RobotError::Urdf {
        path: path.into(),
        place: Place {
            line: e.pos().row as usize,
            column: e.pos().col as usize,
        },
        message: format!("this is not well-formed XML ({e}), but an MJCF file is"),
    })?;
    let reader = Reader::new(path, &document)?;
    let tree = Tree::read(&reader)?;
    let selected = Selected::new(&reader, &tree, choice)?;
    let root = document.root_element();
    let mut gravity = [0.0, 0.0, -9.81];
    for option in root.children().filter(|n| n.has_tag_name("option")) {
        gravity = reader.array::<3>(option, "gravity")?.unwrap_or(gravity);
    }
    if reader.is_off("gravity") {
        gravity = [0.0; 3];
    }
    let drives = Drives::read(&reader, &tree)?;
    let mut chain = selected.chain(&reader, &drives)?;
    chain.name = root.attribute("model").unwrap_or("robot").to_owned();
    chain.file = path.display().to_string();
    chain.remarks.extend(left_out(&reader, &drives)?);
    Ok(Read { chain, gravity })
}

impl<'t, 'a> Selected<'t, 'a> {
    /// Finds the chain: by its tip, or by the rules that hold for URDF.
    fn new(
        reader: &Reader<'a>,
        tree: &'t Tree<'a>,
        choice: &'t ChainChoice,
    ) -> Result<Self, RobotError> {
        let named = |name: &str, option: &str| {
            let found = tree.bodies.iter().position(|body| body.name == name);
            found.ok_or_else(|| RobotError::Chain {
                path: reader.path.into(),
                message: format!("{option} is \"{name}\", but the file has no body of this name"),
            })
        };
        let tip = match &choice.tip {
            Some(tip) => named(tip, "--tip")?,
            None => tip_by_rule(reader, tree)?,
        };
        let path = tree.path_to(tip);
        let first = match &choice.base {
            None => 0,
            Some(base) => {
                let base = named(base, "--base")?;
                let at = path.iter().position(|body| *body == base);
                // The chain begins at the base, whose own joints are before it.
                at.ok_or_else(|| RobotError::Chain {
                    path: reader.path.into(),
                    message: format!(
                        "--base is \"{}\", but it is not on the way to `{}`",
                        tree.bodies[base].name, tree.bodies[tip].name
                    ),
                })? + 1
            }
        };
        for (joint, _) in &choice.locks {
            let is_it = |own: &BodyJoint<'_>| own.name == *joint;
            if !tree.bodies.iter().any(|body| body.joints.iter().any(is_it)) {
                return Err(RobotError::Chain {
                    path: reader.path.into(),
                    message: format!(
                        "--lock names joint `{joint}`, but the file has no joint of this name"
                    ),
                });
            }
        }
        Ok(Self {
            tree,
            path,
            first,
            choice,
        })
    }

    /// Returns the position at which a joint is held: as chosen, or the one nearest to zero.
    fn held(&self, joint: &BodyJoint<'_>) -> f64 {
        let chosen = self
            .choice
            .locks
            .iter()
            .find(|(name, _)| *name == joint.name);
        let [low, high] = joint.range.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        chosen.map_or(0.0_f64.clamp(low, high), |(_, value)| *value)
    }

    fn is_locked(&self, joint: &BodyJoint<'_>) -> bool {
        self.choice
            .locks
            .iter()
            .any(|(name, _)| *name == joint.name)
    }

    /// Adds a body beside the chain, and all bodies in it, to the body that carries them.
    fn merge(
        &self,
        body: usize,
        carrier: &Isometry3<f64>,
        into: &mut Body,
        locked: &mut Vec<String>,
    ) {
        let own = &self.tree.bodies[body];
        let mut frame = carrier * own.pose;
        for joint in &own.joints {
            frame *= joint.at(self.held(joint));
            locked.push(joint.name.clone());
        }
        if let Some(inertia) = &own.inertia {
            let part = inertia.seen_from(&frame);
            into.inertia = into.inertia.plus(&part);
            if own.joints.is_empty() {
                into.heavy.push(own.name.clone());
            } else {
                into.locked = into.locked.plus(&part);
            }
        }
        for child in &own.children {
            self.merge(*child, &frame, into, locked);
        }
    }

    fn chain(&self, reader: &Reader<'a>, drives: &Drives<'a>) -> Result<Chain, RobotError> {
        let mut bodies: Vec<Body> = Vec::new();
        // The frame of the present body in that of the last joint, or in the world.
        let mut frame = Isometry3::identity();
        let mut locked = Vec::new();
        for (at, index) in self.path.iter().enumerate() {
            let own = &self.tree.bodies[*index];
            frame *= own.pose;
            for joint in &own.joints {
                if at < self.first || self.is_locked(joint) {
                    frame *= joint.at(self.held(joint));
                    locked.push(joint.name.clone());
                    continue;
                }
                if bodies.len() == MAX_JOINTS {
                    return Err(reader.error(joint.node, format!("this is movable joint {} of the chain, but a robot has at most {MAX_JOINTS}", MAX_JOINTS + 1)));
                }
                let drive = drives.of.get(joint.name.as_str()).copied();
                let to_axis = Isometry3::from(joint.point);
                bodies.push(moved(
                    reader,
                    joint,
                    &own.name,
                    frame * joint.at(0.0) * to_axis,
                    drive,
                ));
                frame = to_axis.inverse();
            }
            let Some(last) = bodies.last_mut() else {
                continue;
            };
            if let Some(inertia) = &own.inertia {
                last.inertia = last.inertia.plus(&inertia.seen_from(&frame));
                last.heavy.push(own.name.clone());
            }
            let next = self.path.get(at + 1);
            for child in own.children.iter().filter(|child| Some(*child) != next) {
                self.merge(*child, &frame, last, &mut locked);
            }
        }
        if bodies.is_empty() {
            let root = reader.document.root_element();
            return Err(reader.error(
                root,
                "no joint moves; a robot has at least one hinge or slide".into(),
            ));
        }
        let remark = (!locked.is_empty()).then(|| {
            format!(
                "{}: joints that are held, and what they carry is part of the body before them: {}. Choose otherwise with --base, --tip and --lock.",
                reader.path.display(),
                locked.join(", ")
            )
        });
        Ok(Chain {
            name: String::new(),
            file: String::new(),
            base: "world".into(),
            bodies,
            tip: frame,
            tip_link: String::new(),
            beyond_tip: Vec::new(),
            remarks: remark.into_iter().collect(),
            notes: Vec::new(),
        })
    }
}

/// Returns the body that a joint moves, without inertia.
fn moved(
    reader: &Reader<'_>,
    joint: &BodyJoint<'_>,
    link: &str,
    origin: Isometry3<f64>,
    drive: Option<Drive>,
) -> Body {
    let gear = drive.map(|own| own.gear).filter(|gear| *gear != 1.0);
    let (more_armature, more_damping) = drive.map_or((0.0, 0.0), |d| (d.armature, d.damping));
    let armature = joint.armature + more_armature;
    let mut friction = joint.friction.clone();
    friction.viscous += more_damping;
    let nothing = SpatialInertia::from_centre(0.0, Vector3::zeros(), nalgebra::Matrix3::zeros());
    Body {
        joint: joint.name.clone(),
        place: reader.place(joint.node),
        link: link.to_owned(),
        heavy: Vec::new(),
        kind: joint.kind,
        mimic: None,
        origin,
        axis: joint.axis.into_inner(),
        inertia: nothing,
        locked: nothing,
        limits: None,
        friction: (friction.viscous > 0.0 || friction.coulomb > 0.0).then_some(friction),
        reduction: gear,
        // The armature is the inertia at the joint.
        rotor_inertia: (armature > 0.0).then(|| armature / gear.map_or(1.0, |gear| gear * gear)),
    }
}

/// Finds the tip of the only long branch. At a fork, a branch with more than twice as many joints as every other is followed;
/// branches of equal length that have at most half as many joints as the chain before them are a gripper, before which the
/// chain ends.
fn tip_by_rule(reader: &Reader<'_>, tree: &Tree<'_>) -> Result<usize, RobotError> {
    let longest = |bodies: &[usize]| {
        let depth = |body: &usize| tree.depth(*body);
        let most = bodies.iter().map(depth).max().unwrap_or(0);
        let mut found = bodies.iter().filter(|body| depth(body) == most);
        let others = bodies.iter().map(depth).filter(|n| *n < most).max();
        (
            found.next().copied(),
            found.next().is_some(),
            most,
            others.unwrap_or(0),
        )
    };
    let roots: Vec<usize> = (0..tree.bodies.len())
        .filter(|body| tree.bodies[*body].parent.is_none())
        .collect();
    let mut next = roots;
    let mut tip = None;
    let mut joints = 0;
    loop {
        let (first, is_shared, most, second) = longest(&next);
        let Some(body) = first.filter(|_| most > 0) else {
            break;
        };
        let is_gripper = is_shared && tip.is_some() && 2 * most <= joints;
        if is_gripper {
            break;
        }
        if is_shared || most <= 2 * second {
            let names: Vec<&str> = (tree.bodies.iter())
                .filter(|body| body.children.is_empty())
                .map(|body| body.name.as_str())
                .collect();
            return Err(RobotError::Chain {
                path: reader.path.into(),
                message: format!(
                    "the bodies branch, and no branch is the robot by its length; choose the body that the chain ends at with --tip, for instance {}",
                    names.join(", ")
                ),
            });
        }
        joints += tree.bodies[body].joints.len();
        tip = Some(body);
        next.clone_from(&tree.bodies[body].children);
    }
    tip.ok_or_else(|| {
        let root = reader.document.root_element();
        reader.error(
            root,
            "no body has a joint; a robot has at least one hinge or slide".to_owned(),
        )
    })
}
