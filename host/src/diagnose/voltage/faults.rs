//! Recordings of a voltage-driven joint that cannot be what they say.

use super::fit::WINDOW;
use super::free_run::travel;
use super::log::Log;
use super::plant::Plant;
use super::start::start;
use super::{DiagnoseError, floor};
use crate::data::{Implausible, JUDGED_ROWS, plausibility};
use crate::diagnose::outcome::{About, DataFault};
use crate::prepare::{Recording, first_block};
use crate::robot::Robot;

/// Windows of a fit that the training recordings have to give.
const FEWEST_WINDOWS: f64 = 5.0;
/// Steps of the encoder that the joint has to move by at least.
const FEWEST_STEPS: f64 = 20.0;

/// What is wrong with the recordings `given` (training, held back), whose rows are `read`; empty where all is well.
///
/// # Errors
/// What reading gives.
pub(super) fn faults(
    robot: &Robot,
    plant: &Plant,
    given: &[&[&dyn Recording]; 2],
    read: &[&[Log]; 2],
) -> Result<Vec<DataFault>, DiagnoseError> {
    let joint = &robot.joints[0].name;
    let fault = |kind: &str, recording: String, text: String| DataFault {
        kind: kind.into(),
        about: About::Recording,
        recording,
        joint: joint.clone(),
        certain: true,
        text,
    };
    let mut found = Vec::new();
    for source in given.iter().copied().flatten() {
        let first = first_block(*source, JUDGED_ROWS)?;
        let wrong = first.map(|block| plausibility(&block, robot));
        found.extend(wrong.into_iter().flatten().map(|what| {
            let kind = match what {
                Implausible::NotSeconds { .. } => "clock",
                Implausible::Jump { .. } => "jump",
                _ => "unit",
            };
            fault(kind, source.label(), format!("{what}."))
        }));
    }
    if !found.is_empty() {
        return Ok(found);
    }
    let train = read[0];
    let all = || {
        let labels = given[0].iter().map(|source| source.label());
        labels.collect::<Vec<_>>().join(", ")
    };
    let duration: f64 = train.iter().map(Log::duration).sum();
    if duration < FEWEST_WINDOWS * WINDOW {
        found.push(fault(
            "too-short",
            all(),
            format!(
                "The recordings give {duration:.2} s of motion; without torque or current at least {} s are needed.",
                FEWEST_WINDOWS * WINDOW
            ),
        ));
        return Ok(found);
    }
    let least = FEWEST_STEPS * 12.0_f64.sqrt() * floor(train);
    if !(travel(train) > least) {
        found.push(fault(
            "not-moving",
            all(),
            format!("The joint does not move by {FEWEST_STEPS} steps of its encoder; record a motion, or check that the position column is alive."),
        ));
        return Ok(found);
    }
    let turned: Vec<Log> = (train.iter().cloned())
        .map(|log| Log {
            u: log.u.iter().map(|u| -u).collect(),
            ..log
        })
        .collect();
    // A voltage that drives nothing has no sense to be wrong.
    if start(plant, train, true).is_none() && start(plant, &turned, true).is_some() {
        found.push(fault(
            "sign",
            all(),
            "u1 drives the joint against its sense: the torque per volt comes out negative. Turn the sign of u1 (or of the duty cycle), or that of q1.".into(),
        ));
    }
    Ok(found)
}
