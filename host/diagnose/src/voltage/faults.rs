//! Faulty recordings of a voltage-driven joint.

use crate::DiagnoseError;
use crate::faults::names;
use crate::faults::names::Name;
use crate::outcome::FaultKind;
use crate::voltage::fit::WINDOW;
use crate::voltage::free_run::travel;
use crate::voltage::log::{Log, floor};
use crate::voltage::plant::Plant;
use crate::voltage::start::{back_emf, left_of_voltage, start};
use rig_data::prepare::{Recording, first_block};
use rig_data::{Implausible, JUDGED_ROWS, plausibility};
use rig_model::robot::{Joint, JointKind, Robot};

/// Least length of the training recordings, in windows of a fit.
pub(crate) const FEWEST_WINDOWS: f64 = 5.0;
/// Least travel of the joint, in encoder steps.
pub(crate) const FEWEST_STEPS: f64 = 20.0;

/// Least share of the travel in each direction for a joint that turns both ways.
const BOTH_WAYS: f64 = 0.1;
/// Relative change below which a voltage is that of a supply.
const STEADY: f64 = 0.1;
/// Ratio of residuals below which another factor of the position is believed.
const BETTER: f64 = 0.35;
/// Ratio within which the back-EMF is the described one: friction adds to it, and the torque constant is uncertain.
const UNCERTAIN: f64 = 5.0;
/// Ratio within which a factor is a hundred; a thousandth and a duty cycle are as near beyond it.
const HUNDRED: f64 = 2.5;
/// Largest duty cycle, with rounding.
const FULL: f64 = 1.01;
/// Largest delay of a voltage that is searched, s.
const LONGEST: f64 = 0.15;
/// Longest delay from filters and buses, s.
const SHORTEST: f64 = 0.01;
/// Share of the largest voltage by which one without its sign may be below zero: noise.
const ONE_SENSE: f64 = 0.02;

/// What a voltage looks like by its back-EMF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum VoltageUnit {
    /// mV
    Milli,
    /// kV
    Kilo,
    /// Hundredths of a volt.
    Centi,
    /// A share of the supply.
    Duty,
    /// None that has a name.
    Unknown,
}

/// A fault of a recording, or of all.
#[derive(Clone, Debug)]
pub(crate) enum Wrong {
    /// An implausible column.
    Implausible(Implausible),
    /// Recordings of too few seconds.
    TooShort { duration: f64 },
    /// A joint at rest.
    Still,
    /// A voltage of the other sense.
    Turned,
    /// A voltage of zero.
    Dead,
    /// A voltage that stays within limits, V, while the joint turns both ways.
    Supply { low: f64, high: f64 },
    /// A position that fits the voltage if multiplied by `factor`.
    PositionScaled {
        factor: f64,
        name: Name,
        /// Residual shares of the voltage's squares, as recorded and with the factor.
        left: [f64; 2],
    },
    /// A voltage in another unit.
    VoltageScaled {
        unit: VoltageUnit,
        /// Back-EMF, V·s/rad, found and described.
        emf: [f64; 2],
    },
    /// A voltage that is `by` seconds behind the position.
    Late {
        by: f64,
        /// Residual shares of the voltage's squares, as recorded and with the shift.
        left: [f64; 2],
    },
    /// A voltage without its sign.
    Magnitude {
        /// Residual shares of the voltage's squares, as recorded and with the sense of the motion.
        left: [f64; 2],
    },
}

impl Wrong {
    /// Returns the kind of the fault.
    pub(crate) fn kind(&self) -> FaultKind {
        match self {
            Self::Implausible(Implausible::NotSeconds { .. }) => FaultKind::Clock,
            Self::Implausible(Implausible::Jump { .. }) => FaultKind::Jump,
            Self::TooShort { .. } => FaultKind::TooShort,
            Self::Still => FaultKind::NotMoving,
            Self::Turned => FaultKind::Sign,
            Self::PositionScaled { name, .. } => name.kind(),
            Self::Implausible(_)
            | Self::Dead
            | Self::Supply { .. }
            | Self::VoltageScaled { .. } => FaultKind::Unit,
            Self::Late { .. } => FaultKind::Clock,
            Self::Magnitude { .. } => FaultKind::Magnitude,
        }
    }
}

/// Returns the faults of the recordings `given` (training, hold-out) with their rows `read`, each with the names of its
/// recordings; empty if there are none.
///
/// # Errors
/// Errors of reading.
pub(crate) fn faults(
    robot: &Robot,
    plant: &Plant,
    given: &[&[&dyn Recording]; 2],
    read: &[&[Log]; 2],
) -> Result<Vec<(Wrong, String)>, DiagnoseError> {
    let joint = &robot.joints[0];
    let mut found = Vec::new();
    for source in given.iter().copied().flatten() {
        let first = first_block(*source, JUDGED_ROWS)?;
        let wrong = first.map(|block| plausibility(&block, robot));
        let wrong = wrong.into_iter().flatten().map(Wrong::Implausible);
        found.extend(wrong.map(|wrong| (wrong, source.label())));
    }
    if !found.is_empty() {
        return Ok(found);
    }
    let train = read[0];
    let wrong = (too_short(train).or_else(|| still(train)))
        .or_else(|| dead(train))
        .or_else(|| changed(train))
        .or_else(|| turned(plant, train).map(|turned| without_sense(train).unwrap_or(turned)))
        .or_else(|| position_scale(joint, train))
        .or_else(|| voltage_scale(joint, plant, train));
    found.extend(wrong.map(|wrong| {
        let labels = given[0].iter().map(|source| source.label());
        (wrong, labels.collect::<Vec<_>>().join(", "))
    }));
    Ok(found)
}

/// Returns a fault if the recordings are too short to learn from.
fn too_short(logs: &[Log]) -> Option<Wrong> {
    let duration: f64 = logs.iter().map(Log::duration).sum();
    (duration < FEWEST_WINDOWS * WINDOW).then_some(Wrong::TooShort { duration })
}

/// Returns a fault if the joint stands still.
fn still(logs: &[Log]) -> Option<Wrong> {
    let least = FEWEST_STEPS * 12.0_f64.sqrt() * floor(logs);
    (!(travel(logs) > least)).then_some(Wrong::Still)
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
    (start(plant, logs, true).is_none() && start(plant, &turned, true).is_some())
        .then_some(Wrong::Turned)
}

/// Returns a fault if a voltage is always zero, or constant while the joint turns both ways.
fn dead(logs: &[Log]) -> Option<Wrong> {
    let all = || logs.iter().flat_map(|log| &log.u);
    let most = all().fold(0.0_f64, |most, u| most.max(u.abs()));
    if most == 0.0 {
        return Some(Wrong::Dead);
    }
    let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), u| {
        (low.min(*u), high.max(*u))
    });
    (turns_both_ways(logs) && high - low < STEADY * most).then_some(Wrong::Supply { low, high })
}

/// Returns true if the joint travels in both directions.
fn turns_both_ways(logs: &[Log]) -> bool {
    let travel = |sense: f64| -> f64 {
        let steps = logs.iter().flat_map(|log| log.q.windows(2));
        steps.map(|q| (sense * (q[1] - q[0])).max(0.0)).sum()
    };
    let (forth, back) = (travel(1.0), travel(-1.0));
    forth.min(back) > BOTH_WAYS * (forth + back)
}

/// Returns the logs with other voltages.
fn with_voltages(logs: &[Log], change: impl Fn(&Log) -> Vec<f64>) -> Vec<Log> {
    let other = |log: &Log| Log {
        u: change(log),
        ..log.clone()
    };
    logs.iter().map(other).collect()
}

/// Returns a fault if a voltage at another time, or with the sense of the motion, fits far better; of both the better.
fn changed(logs: &[Log]) -> Option<Wrong> {
    let recorded = left_of_voltage(logs, 1.0)?;
    let late = late(logs);
    let size = magnitude(logs);
    let least = |own: &Option<(f64, Wrong)>| own.as_ref().map_or(f64::INFINITY, |own| own.0);
    let best = match least(&size) < least(&late) {
        true => size,
        false => late,
    };
    best.filter(|(left, _)| *left < BETTER * recorded)
        .map(|(_, wrong)| wrong)
}

/// Returns the shift of the voltage with the least residual, and that residual.
fn late(logs: &[Log]) -> Option<(f64, Wrong)> {
    let recorded = left_of_voltage(logs, 1.0)?;
    let (time, rows) = logs.iter().fold((0.0, 0), |(time, rows), log| {
        (time + log.duration(), rows + log.t.len())
    });
    let step = time / rows.max(1) as f64;
    let reach = (LONGEST / step).ceil() as i64;
    let moved = |by: i64| {
        let moved = with_voltages(logs, |log| {
            let last = log.u.len() as i64 - 1;
            let at = |k: i64| log.u[(k + by).clamp(0, last.max(0)) as usize];
            (0..=last).map(at).collect()
        });
        left_of_voltage(&moved, 1.0)
    };
    let (by, left) = (-reach..=reach)
        .filter_map(|by| Some((by, moved(by)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    // At the end of the search nothing shows a minimum.
    let found = by.abs() < reach && by.abs() as f64 * step > SHORTEST;
    found.then_some((
        left,
        Wrong::Late {
            by: by as f64 * step,
            left: [recorded, left],
        },
    ))
}

/// Returns a lost sign in place of a wrong one, if the voltage has one sense while the joint turns both ways.
fn without_sense(logs: &[Log]) -> Option<Wrong> {
    magnitude(logs).map(|(_, wrong)| wrong)
}

/// Returns the residual of the voltage with the sense of the motion, if it has one sense only as recorded.
fn magnitude(logs: &[Log]) -> Option<(f64, Wrong)> {
    let all = || logs.iter().flat_map(|log| &log.u);
    let most = all().fold(0.0_f64, |most, u| most.max(u.abs()));
    if all().any(|u| *u < -ONE_SENSE * most) || !turns_both_ways(logs) {
        return None;
    }
    let signed = with_voltages(logs, |log| {
        let sense = |k: usize| log.slope(k)[0].signum();
        (0..log.u.len()).map(|k| log.u[k] * sense(k)).collect()
    });
    let (recorded, left) = (left_of_voltage(logs, 1.0)?, left_of_voltage(&signed, 1.0)?);
    Some((
        left,
        Wrong::Magnitude {
            left: [recorded, left],
        },
    ))
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
    (own < BETTER * recorded).then_some(Wrong::PositionScaled {
        factor,
        name,
        left: [recorded, own],
    })
}

/// Returns a fault if the recordings show the back-EMF, and it is far from the described one.
fn voltage_scale(joint: &Joint, plant: &Plant, logs: &[Log]) -> Option<Wrong> {
    let emf = joint.drive.as_ref()?.torque_constant * plant.ratio.abs();
    let found = back_emf(plant, logs)?;
    let factor = found / emf;
    let most = (logs.iter().flat_map(|log| &log.u)).fold(0.0_f64, |most, u| most.max(u.abs()));
    let near = |unit: f64| (factor / unit).ln().abs();
    let unit = match () {
        () if near(1.0) < UNCERTAIN.ln() => return None,
        () if near(1e3) < UNCERTAIN.ln() && near(1e3) < near(100.0) => VoltageUnit::Milli,
        () if near(100.0) < HUNDRED.ln() => VoltageUnit::Centi,
        () if near(1e-3) < UNCERTAIN.ln() => VoltageUnit::Kilo,
        () if factor < 1.0 && most <= FULL => VoltageUnit::Duty,
        () => VoltageUnit::Unknown,
    };
    Some(Wrong::VoltageScaled {
        unit,
        emf: [found, emf],
    })
}
