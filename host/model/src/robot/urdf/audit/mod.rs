//! Looks for values of a URDF file that no robot has.
//!
//! Looks at all links and joints of the file, and at the inertia matrix of the chain that is the robot. Leaves out meshes,
//! whose extent stands in other files.

mod finding;
mod limits;
mod links;
mod motion;
mod scale;
mod shapes;

use std::cell::RefCell;
use std::path::Path;

use super::choice::ChainChoice;
use super::prefixes::declared;
use super::read::read;
use super::reader::{Reader, parsed};
use crate::robot::dh::convert;
use crate::robot::error::RobotError;

pub use finding::{Audit, AuditCheck, AuditFinding};

/// Checks the values of a URDF file. `path` only names it in messages; `choice` selects the chain whose inertia matrix is
/// checked, at poses drawn with `seed`.
///
/// # Errors
/// The text is no URDF, with the line of the first fault.
pub fn audit(
    text: &str,
    path: &Path,
    choice: &ChainChoice,
    seed: u64,
) -> Result<Audit, RobotError> {
    let declared = declared(text);
    let document = parsed(&declared.text, path)?;
    let reader = Reader {
        path,
        document: &document,
        remarks: RefCell::default(),
        unknown: RefCell::default(),
    };
    let tree = reader.tree()?;
    let mut audit = Audit::default();
    let bodies = links::bodies(&reader, &tree)?;
    links::masses(&mut audit, &bodies);
    links::moments(&mut audit, &bodies);
    links::massless(&mut audit, &tree, &bodies, &reader);
    links::copies(&mut audit, &bodies);
    shapes::shapes(&mut audit, &reader, &tree, &bodies)?;
    scale::lengths(&mut audit, &reader, &tree, &bodies)?;
    limits::limits(&mut audit, &reader, &tree)?;
    match read(text, path, choice) {
        Ok(chain) => {
            let places: Vec<_> = (chain.bodies.iter())
                .filter(|body| body.mimic.is_none())
                .map(|body| body.place)
                .collect();
            let robot = convert(&chain).robot;
            motion::inertia_matrices(&mut audit, &robot, &places, seed);
            scale::gravity(&mut audit, &robot, &places, seed);
        }
        Err(why) => audit.unchecked.push(format!(
            "The inertia matrix was not checked, for no chain could be read: {why}."
        )),
    }
    let order = |own: &AuditFinding| (own.place.line, own.place.column);
    audit.findings.sort_by_key(order);
    Ok(audit)
}

#[cfg(test)]
mod tests;
