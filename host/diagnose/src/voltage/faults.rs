//! Faulty recordings of a voltage-driven joint.

use crate::DiagnoseError;
use crate::faults::names;
use crate::outcome::{About, DataFault, FaultKind};
use crate::voltage::fit::WINDOW;
use crate::voltage::free_run::travel;
use crate::voltage::log::{Log, floor};
use crate::voltage::plant::Plant;
use crate::voltage::start::{left_of_voltage, start};
use rig_data::prepare::{Recording, first_block};
use rig_data::{Implausible, JUDGED_ROWS, plausibility};
use rig_model::robot::{Joint, JointKind, Robot};
use rig_output::{format_significant, format_trimmed};

/// Least length of the training recordings, in windows of a fit.
const FEWEST_WINDOWS: f64 = 5.0;
/// Least travel of the joint, in encoder steps.
const FEWEST_STEPS: f64 = 20.0;

/// Least share of the travel in each direction for a joint that turns both ways.
const BOTH_WAYS: f64 = 0.1;
/// Relative change below which a voltage is that of a supply.
const STEADY: f64 = 0.1;
/// Ratio of residuals below which another factor of the position is believed.
const BETTER: f64 = 0.35;
/// Ratio within which a factor is a thousand: friction adds to the back-EMF, the torque constant is uncertain.
const THOUSAND: f64 = 5.0;

/// A fault's kind and text.
type Wrong = (FaultKind, String);

/// Returns the faults of the recordings `given` (training, hold-out) with their rows `read`; empty if there are none.
///
/// # Errors
/// Errors of reading.
pub(crate) fn faults(
    robot: &Robot,
    plant: &Plant,
    given: &[&[&dyn Recording]; 2],
    read: &[&[Log]; 2],
) -> Result<Vec<DataFault>, DiagnoseError> {
    let joint = &robot.joints[0];
    let fault = |(kind, text): Wrong, recording: String| DataFault {
        kind,
        about: About::Recording,
        recording,
        joint: joint.name.clone(),
        certain: true,
        text,
    };
    let mut found = Vec::new();
    for source in given.iter().copied().flatten() {
        let wrong = implausible(robot, *source)?.into_iter();
        found.extend(wrong.map(|wrong| fault(wrong, source.label())));
    }
    if !found.is_empty() {
        return Ok(found);
    }
    let train = read[0];
    let wrong = (too_short(train).or_else(|| still(train)))
        .or_else(|| dead(train))
        .or_else(|| turned(plant, train))
        .or_else(|| position_scale(joint, train))
        .or_else(|| voltage_scale(joint, plant, train));
    found.extend(wrong.map(|wrong| {
        let labels = given[0].iter().map(|source| source.label());
        fault(wrong, labels.collect::<Vec<_>>().join(", "))
    }));
    Ok(found)
}

/// Returns what cannot be in the first rows of a recording.
///
/// # Errors
/// Errors of reading.
fn implausible(robot: &Robot, source: &dyn Recording) -> Result<Vec<Wrong>, DiagnoseError> {
    let first = first_block(source, JUDGED_ROWS)?;
    let wrong = first.map(|block| plausibility(&block, robot));
    let named = wrong.into_iter().flatten().map(|what| {
        let kind = match what {
            Implausible::NotSeconds { .. } => FaultKind::Clock,
            Implausible::Jump { .. } => FaultKind::Jump,
            _ => FaultKind::Unit,
        };
        (kind, format!("{what}."))
    });
    Ok(named.collect())
}

/// Returns a fault if the recordings are too short to learn from.
fn too_short(logs: &[Log]) -> Option<Wrong> {
    let duration: f64 = logs.iter().map(Log::duration).sum();
    (duration < FEWEST_WINDOWS * WINDOW).then(|| {
        (
            FaultKind::TooShort,
            format!(
                "The recordings give {duration:.2} s of motion; without torque or current at least {} s are needed.",
                FEWEST_WINDOWS * WINDOW
            ),
        )
    })
}

/// Returns a fault if the joint stands still.
fn still(logs: &[Log]) -> Option<Wrong> {
    let least = FEWEST_STEPS * 12.0_f64.sqrt() * floor(logs);
    (!(travel(logs) > least)).then(|| {
        (
            FaultKind::NotMoving,
            format!("The joint does not move by {FEWEST_STEPS} steps of its encoder; record a motion, or check that the position column is alive."),
        )
    })
}

/// Returns a fault if the voltage drives the joint against its sense.
fn turned(plant: &Plant, logs: &[Log]) -> Option<Wrong> {
    let turned: Vec<Log> = (logs.iter().cloned())
        .map(|log| Log {
            u: log.u.iter().map(|u| -u).collect(),
            ..log
        })
        .collect();
    // A voltage that drives nothing has no wrong sense.
    (start(plant, logs, true).is_none() && start(plant, &turned, true).is_some()).then(|| {
        (
            FaultKind::Sign,
            "u1 drives the joint against its sense: the torque per volt comes out negative. Turn the sign of u1 (or of the duty cycle), or that of q1.".into(),
        )
    })
}

/// Returns a fault if a voltage is always zero, or constant while the joint turns both ways.
fn dead(logs: &[Log]) -> Option<Wrong> {
    let all = || logs.iter().flat_map(|log| &log.u);
    let most = all().fold(0.0_f64, |most, u| most.max(u.abs()));
    if most == 0.0 {
        return Some((
            FaultKind::Unit,
            "u1 is 0 in every row while the joint moves; check that the column is the motor's voltage and was recorded.".into(),
        ));
    }
    let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), u| {
        (low.min(*u), high.max(*u))
    });
    let travel = |sense: f64| -> f64 {
        let steps = logs.iter().flat_map(|log| log.q.windows(2));
        steps.map(|q| (sense * (q[1] - q[0])).max(0.0)).sum()
    };
    let (forth, back) = (travel(1.0), travel(-1.0));
    let both = forth.min(back) > BOTH_WAYS * (forth + back);
    let text = || {
        let number = |x: f64| format_trimmed(x, 4);
        let stays = match number(low) == number(high) {
            true => format!("at {} V", number(low)),
            false => format!("between {} and {} V", number(low), number(high)),
        };
        format!(
            "u1 stays {stays} while the joint turns both ways: it looks like the supply. Give the voltage at the motor, or the duty cycle as duty1 with the supply as supply."
        )
    };
    (both && high - low < STEADY * most).then(|| (FaultKind::Unit, text()))
}

/// Returns a fault if gravity's period shows a multiple of the joint's position.
fn position_scale(joint: &Joint, logs: &[Log]) -> Option<Wrong> {
    if joint.kind == JointKind::Prismatic {
        return None;
    }
    let recorded = left_of_voltage(logs, 1.0)?;
    let (factor, own) = (names::factors_of_position(joint).into_iter())
        .filter_map(|factor| Some((factor, left_of_voltage(logs, factor)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let name = names::of_position(joint, factor)?;
    (own < BETTER * recorded).then(|| {
        let percent = |share: f64| format_significant(100.0 * share, 2);
        let text = format!(
            "q1 fits its voltage {} times as large (the model then leaves {} % of the voltage's squares, as recorded {} %): {}.",
            format_trimmed(factor, 4),
            percent(own),
            percent(recorded),
            name.text
        );
        (name.kind(), text)
    })
}

/// Returns a fault if the back-EMF is a thousand times the described, or a thousandth.
fn voltage_scale(joint: &Joint, plant: &Plant, logs: &[Log]) -> Option<Wrong> {
    let emf = joint.drive.as_ref()?.torque_constant * plant.ratio.abs();
    let found = start(plant, logs, false)?[2];
    let factor = found / emf;
    let what = match factor {
        f if (f / 1e3).ln().abs() < THOUSAND.ln() => "mV",
        f if (f * 1e3).ln().abs() < THOUSAND.ln() => "kV",
        _ => return None,
    };
    let number = |x: f64| format_significant(x, 3);
    Some((
        FaultKind::Unit,
        format!(
            "u1 looks like {what}: the back-EMF comes out at {} V·s/rad, where the description's torque constant and gear ratio make {}; give it in V.",
            number(found),
            number(emf)
        ),
    ))
}
