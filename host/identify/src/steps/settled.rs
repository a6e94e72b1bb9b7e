//! Identification with effects that depend on the friction of their joint: their torque depends on the identified
//! parameters.

use rig_shared::multibody::{COLUMNS, column};

use super::solve::identify_beside;
use crate::description::identified_robot::identified_robot;
use crate::error::IdentifyError;
use crate::identification::Identification;
use crate::options::Options;
use rig_data::prepare::Recording;
use rig_model::robot::Robot;

/// Largest relative change of the drives' friction and inertia at convergence.
const SETTLED: f64 = 1e-3;
/// Largest number of passes.
const MOST_PASSES: usize = 12;

/// Identifies `robot` from `training` and checks the result on `holdout`. With effects that depend on the friction of
/// their joint, it repeats the identification with the new friction until it converges.
///
/// # Errors
/// [`IdentifyError`]: recordings that cannot be used, a motion that excites nothing, a singular problem.
pub fn identify(
    robot: &Robot,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
) -> Result<Identification, IdentifyError> {
    let placed = robot.placed_effects();
    let heeded = placed
        .iter()
        .any(|p| p.effect.kind.depends_on_joint_friction());
    let mut beside = robot.standard_parameters();
    for pass in 1..=MOST_PASSES {
        let mut found = identify_beside(robot, training, holdout, options, &beside)?;
        if !heeded {
            return Ok(found);
        }
        let next = identified_robot(robot, &found).0.standard_parameters();
        if moved(&beside, &next) <= SETTLED {
            if pass > 1 {
                found.procedure.push(format!("Effects go by the friction of their joint: {pass} passes, each with the friction that the one before had found."));
            }
            return Ok(found);
        }
        beside = next;
    }
    Err(IdentifyError::Unsettled {
        what: "What the effects of the description take off, which goes by the friction that is identified from the rest,",
        passes: MOST_PASSES,
    })
}

/// Returns the largest relative change of a joint's friction or drive inertia.
fn moved(from: &[[f64; COLUMNS]], to: &[[f64; COLUMNS]]) -> f64 {
    let columns = [column::VISCOUS, column::COULOMB, column::DRIVE_INERTIA];
    let pairs = from.iter().zip(to);
    pairs
        .flat_map(|(a, b)| columns.map(|c| (a[c] - b[c]).abs() / b[c].abs().max(f64::MIN_POSITIVE)))
        .fold(0.0, f64::max)
}
