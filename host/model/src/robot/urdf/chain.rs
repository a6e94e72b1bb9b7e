//! The chain of bodies that a URDF file describes.

use nalgebra::{Isometry3, Vector3};

use super::spatial::SpatialInertia;
use crate::robot::error::Place;
use crate::robot::joint::{JointFriction, JointKind, JointLimits};

/// A joint and the body that it moves.
#[derive(Debug)]
pub(in crate::robot) struct Body {
    pub joint: String,
    /// Line and column of the joint.
    pub place: Place,
    /// The link that the joint moves.
    pub link: String,
    /// Links of this body with an `<inertial>`: the link that the joint moves, and links fixed to it. Links behind locked
    /// joints are not among them.
    pub heavy: Vec<String>,
    pub kind: JointKind,
    /// How it follows a joint of the chain, if it does.
    pub mimic: Option<Mimic>,
    /// Frame of this joint (its child link) in the frame of the previous body at q = 0.
    pub origin: Isometry3<f64>,
    /// Unit vector of the axis in the joint's frame.
    pub axis: Vector3<f64>,
    /// Inertia in the joint's frame, including everything fixed to the link.
    pub inertia: SpatialInertia,
    /// The part of `inertia` that is behind locked joints.
    pub locked: SpatialInertia,
    pub limits: Option<JointLimits>,
    pub friction: Option<JointFriction>,
    pub reduction: Option<f64>,
    /// Inertia of the rotor on the motor side, kg·m².
    pub rotor_inertia: Option<f64>,
}

/// An axis moves as ratio · q + offset of a joint of the chain.
#[derive(Debug)]
pub(in crate::robot) struct Mimic {
    /// Name of the joint, which itself follows no other.
    pub joint: String,
    pub ratio: f64,
    pub offset: f64,
}

/// The movable bodies from the base outwards; gravity points along −z of the base link.
#[derive(Debug)]
pub(in crate::robot) struct Chain {
    pub name: String,
    /// Name of the file.
    pub file: String,
    /// The link in whose frame gravity points along −z: the root of the tree.
    pub base: String,
    pub bodies: Vec<Body>,
    /// Frame of the link that the chain ends at, in that of the link that the last joint moves.
    pub tip: Isometry3<f64>,
    /// Name of that link.
    pub tip_link: String,
    /// Links beyond it that fixed joints hold, and that have another frame.
    pub beyond_tip: Vec<String>,
    /// Remarks for the user, one sentence each.
    pub remarks: Vec<String>,
    /// Those of the remarks that need no action.
    pub notes: Vec<String>,
}
