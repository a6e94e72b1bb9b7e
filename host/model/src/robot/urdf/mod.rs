//! Reads and writes URDF.
//!
//! Leaves out visuals, collision shapes and calibration: they do not enter the dynamics.

mod edits;
mod original;
mod reader;
mod remarks;
mod schema;
mod spatial;
mod tree;
mod values;
mod write;

use std::cell::RefCell;
use std::path::Path;

use nalgebra::{Isometry3, Vector3};

use super::error::{Place, RobotError};
use super::inertia::negative_inertia;
use super::sizes::oversized;
use super::{JointFriction, JointKind, JointLimits, Robot};
use reader::{Reader, parsed};

pub use original::Original;
pub(super) use spatial::SpatialInertia;
pub use values::is_placeholder;
pub use write::Urdf;

/// A joint and the body that it moves.
#[derive(Debug)]
pub(in crate::robot) struct Body {
    pub joint: String,
    /// Line and column of the joint.
    pub place: Place,
    /// The link that the joint moves.
    pub link: String,
    /// Links of this body with an `<inertial>`: the link that the joint moves, and links fixed to it.
    pub heavy: Vec<String>,
    pub kind: JointKind,
    /// Frame of this joint (its child link) in the frame of the previous body at q = 0.
    pub origin: Isometry3<f64>,
    /// Unit vector of the axis in the joint's frame.
    pub axis: Vector3<f64>,
    /// Inertia in the joint's frame, including everything fixed to the link.
    pub inertia: SpatialInertia,
    pub limits: Option<JointLimits>,
    pub friction: Option<JointFriction>,
    pub reduction: Option<f64>,
}

/// The movable bodies from the base outwards; gravity points along −z of the base link.
#[derive(Debug)]
pub(in crate::robot) struct Chain {
    pub name: String,
    /// Name of the file.
    pub file: String,
    /// The base link.
    pub base: String,
    pub bodies: Vec<Body>,
    /// Remarks for the user, one sentence each.
    pub remarks: Vec<String>,
}

/// Reads the text of a file; `path` only names it in messages.
pub(super) fn read(text: &str, path: &Path) -> Result<Chain, RobotError> {
    let document = parsed(text, path)?;
    Reader {
        path,
        document: &document,
        remarks: RefCell::default(),
    }
    .chain()
}

/// Refuses a chain whose links, as `joints` describe them, are larger than any real link.
pub(super) fn check_sizes(chain: &Chain, robot: &Robot, path: &Path) -> Result<(), RobotError> {
    match oversized(&robot.joints).or_else(|| negative_inertia(robot)) {
        None => Ok(()),
        Some((k, fault)) => Err(RobotError::Value {
            path: path.into(),
            place: chain.bodies[k].place,
            what: fault.what,
            found: fault.found,
            right: fault.right,
        }),
    }
}
