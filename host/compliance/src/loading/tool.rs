//! Stiffness of the drives from the displacement of the tool point under a known wrench, with the motors held.
//!
//! δx = J·δq_motor + Σ a_k·(a_k·w)/c_k − Σ a_k·h_k·direction_k + offset, with the columns a_k of J·R⁻¹: linear in the
//! compliances 1/c_k and in the hysteresis h_k (rad or m). Only the translation is measured. Movements of the motors are
//! taken from their encoders.
//!
//! Leaves out: gaps, the change of the weight's torque as the links themselves yield, elasticity of base and links, which counts as that of the drives.

use rig_model::robot::Robot;
use rig_output::format_significant;
use rig_shared::multibody::{Chain, gravity_vector};

use super::advice::advice;
use super::instrument::{Estimate, Regression};
use super::link::{NOT_SHOWN, range};
use super::result::{Deflection, DriveLoading};
use super::windows::{Course, courses, means, window_rows};
use super::wrench::{DISPLACEMENT, torques, wrench};
use crate::drives::listed_pose;
use crate::error::ComplianceError;
use crate::signals::Signals;
use crate::tool_point::ToolPoint;
use crate::value::Value;

/// Largest movement of a held motor within a recording, rad or m.
const HELD: f64 = 0.02;
/// Share of the range of the load after a turning point in which friction changes its sign.
const TRANSITION: f64 = 0.15;
/// Share of the largest load times arm from which on a drive's turning points count.
const MATERIAL: f64 = 0.05;
/// Fewest windows.
const FEWEST: usize = 12;

/// One stretch at one pose.
struct Held {
    /// Columns a_k, rows dx dy dz: [axis][drive].
    arms: [Vec<f64>; 3],
    /// Torque of each drive by window.
    loads: Vec<Vec<f64>>,
    /// Displacement without that of the motors, for each measured axis.
    displacement: [Option<Vec<f64>>; 3],
}

/// Finds the stiffness of all drives from displacements of the tool point.
///
/// # Errors
/// [`ComplianceError`]: a pose that changes within a recording, a column that is missing, too few windows.
pub(super) fn by_tool(
    tool: &ToolPoint<'_>,
    stretches: &[&Signals],
) -> Result<(Vec<DriveLoading>, f64), ComplianceError> {
    let rows = window_rows(stretches.iter().map(|s| s.len()).sum());
    let mut held = Vec::new();
    for signals in stretches {
        held.push(hold(tool, signals, rows)?);
    }
    let n = tool.count();
    let ranges: Vec<f64> = (0..n)
        .map(|k| range(held.iter().flat_map(|h| &h.loads[k])))
        .collect();
    let (regression, windows) = regression(&held, &ranges);
    let found = (windows >= FEWEST)
        .then(|| regression.solve())
        .flatten()
        .ok_or_else(|| {
            ComplianceError::Recording(format!(
                "The recordings of the loaded tool point have {windows} usable windows, {FEWEST} are needed: change the force slowly, to and fro, and record more rows."
            ))
        })?;
    let mut drives = Vec::new();
    for k in 0..n {
        drives.push(drive(tool, k, &held, &found, windows)?);
    }
    Ok((drives, regression.residual(&found)))
}

/// Reads a stretch at one pose.
fn hold(tool: &ToolPoint<'_>, signals: &Signals, rows: usize) -> Result<Held, ComplianceError> {
    let n = tool.count();
    let mut pose = Vec::with_capacity(n);
    for (k, joint) in signals.joints.iter().enumerate() {
        let moved = range(joint.q.iter());
        if moved > HELD {
            return Err(ComplianceError::Recording(format!(
                "{}: joint \"{}\" moves by {} {} while the tool point is loaded; hold the motors, and give one recording for each pose.",
                signals.label,
                tool.robot().joints[k].name,
                format_significant(moved, 3),
                tool.robot().joints[k].kind.units().0
            )));
        }
        pose.push(rig_numerics::statistics::mean(&joint.q));
    }
    let (_, jacobian) = tool.jacobian(&pose)?;
    let (_, per_twist) = tool.per_twist(&pose)?;
    let force = wrench(signals)?.map(|list| means(&list, rows));
    let motors: Vec<Vec<f64>> = signals.joints.iter().map(|j| means(&j.q, rows)).collect();
    let loads = loads(tool, &pose, &force, &motors)?;
    for name in DISPLACEMENT {
        let list = signals.column(name).unwrap_or_default();
        if let Some(row) = list.iter().position(|d| !d.is_finite()) {
            return Err(ComplianceError::Recording(format!(
                "{}: {name} at t = {} s is not a number; correct the field.",
                signals.label, signals.t[row]
            )));
        }
    }
    let displacement = std::array::from_fn(|axis| {
        let read = means(signals.column(DISPLACEMENT[axis])?, rows);
        Some(
            (read.iter().enumerate())
                .map(|(i, d)| {
                    let moved = (0..n).map(|j| jacobian[(axis, j)] * (motors[j][i] - pose[j]));
                    d - moved.sum::<f64>()
                })
                .collect(),
        )
    });
    Ok(Held {
        arms: std::array::from_fn(|axis| (0..n).map(|k| per_twist[(axis, k)]).collect()),
        loads,
        displacement,
    })
}

/// Torque of each drive by window: of the wrench, and of the weight as the motors move a little.
fn loads(
    tool: &ToolPoint<'_>,
    pose: &[f64],
    force: &[Vec<f64>; 6],
    motors: &[Vec<f64>],
) -> Result<Vec<Vec<f64>>, ComplianceError> {
    let wrong = |error: &dyn std::fmt::Display| ComplianceError::Model(error.to_string());
    let (n, robot) = (tool.count(), tool.robot());
    let chain = Chain::new(&robot.geometry(), robot.gravity).map_err(|e| wrong(&e))?;
    let parameters = robot.standard_parameters();
    let weight = |q: &[f64]| {
        let mut torque = vec![0.0; n];
        gravity_vector(&chain, &parameters, q, &mut torque)
            .map(|()| torque)
            .map_err(|e| wrong(&e))
    };
    let inverse = tool.drives().inverse(pose)?;
    let before = weight(pose)?;
    let mut loads = vec![Vec::with_capacity(force[0].len()); n];
    for i in 0..force[0].len() {
        let place: Vec<f64> = motors.iter().map(|list| list[i]).collect();
        let pushed = torques(tool, pose, &force.each_ref().map(|list| list[i]))?;
        let weight = weight(&place)?;
        for (k, own) in loads.iter_mut().enumerate() {
            // f = R⁻ᵀ·τ.
            let joint = (0..n).map(|j| inverse[(j, k)] * (pushed[j] - weight[j] + before[j]));
            own.push(joint.sum());
        }
    }
    Ok(loads)
}

/// Forms the regression; its columns are the compliances, the hystereses and an offset per stretch and axis. Returns also
/// the number of windows.
fn regression(held: &[Held], ranges: &[f64]) -> (Regression, usize) {
    let n = ranges.len();
    let offsets = 3 * held.len();
    let (mut regression, mut windows) = (Regression::default(), 0);
    for (stretch, own) in held.iter().enumerate() {
        let courses: Vec<Vec<Course>> = (0..n).map(|k| courses(&own.loads[k], ranges[k])).collect();
        let size = |k: usize| {
            let arm: f64 = own.arms.iter().map(|a| a[k] * a[k]).sum();
            range(own.loads[k].iter()) * arm.sqrt()
        };
        let most = (0..n).map(size).fold(0.0, f64::max);
        let material: Vec<usize> = (0..n).filter(|k| size(*k) > MATERIAL * most).collect();
        for i in 1..own.loads.first().map_or(0, Vec::len).saturating_sub(1) {
            let settled = material.iter().all(|k| {
                let course = &courses[*k];
                course[i].direction != 0.0
                    && course[i].travel > TRANSITION * ranges[*k]
                    && course[i - 1].run == course[i + 1].run
            });
            if !settled {
                continue;
            }
            windows += 1;
            for axis in 0..3 {
                let Some(read) = &own.displacement[axis] else {
                    continue;
                };
                let arm = &own.arms[axis];
                let mut x: Vec<f64> = (0..n).map(|k| arm[k] * own.loads[k][i]).collect();
                let mut z: Vec<f64> = (0..n)
                    .map(|k| arm[k] * 0.5 * (own.loads[k][i - 1] + own.loads[k][i + 1]))
                    .collect();
                let turned = |k: usize| match material.contains(&k) {
                    true => -arm[k] * courses[k][i].direction,
                    false => 0.0,
                };
                let offset = (0..offsets).map(|o| f64::from(u8::from(o == 3 * stretch + axis)));
                let rest: Vec<f64> = (0..n).map(turned).chain(offset).collect();
                x.extend(&rest);
                z.extend(&rest);
                regression.push(x, z, read[i], 3 * stretch + axis);
            }
        }
    }
    (regression, windows)
}

/// Returns what the loading shows of drive `k`.
fn drive(
    tool: &ToolPoint<'_>,
    k: usize,
    held: &[Held],
    found: &Estimate,
    windows: usize,
) -> Result<DriveLoading, ComplianceError> {
    let n = tool.count();
    let robot = tool.robot();
    let compliance = Value::new(found.values[k], found.std(k));
    let shown = !found.hidden[k] && compliance.value > 0.0 && compliance.relative() < NOT_SHOWN;
    let loads: Vec<f64> = held.iter().flat_map(|h| h.loads[k].clone()).collect();
    let low = loads.iter().copied().fold(f64::INFINITY, f64::min);
    let stiffness = shown.then(|| compliance.reciprocal());
    let hysteresis = stiffness.filter(|_| !found.hidden[n + k] && found.values[n + k] != 0.0);
    Ok(DriveLoading {
        joint: robot.joints[k].name.clone(),
        index: k,
        by: Deflection::Tool,
        stiffness,
        hysteresis: hysteresis
            .map(|c| Value::new(found.values[n + k] * c.value, found.std(n + k) * c.value)),
        gap: None,
        reverses: false,
        load: [low, low + range(loads.iter())],
        windows,
        missing: match shown {
            true => None,
            false => Some(missing(tool, robot, k)?),
        },
        points: Default::default(),
    })
}

/// Says which pose and force would show a drive.
fn missing(tool: &ToolPoint<'_>, robot: &Robot, k: usize) -> Result<String, ComplianceError> {
    let name = &robot.joints[k].name;
    Ok(match advice(tool, k)? {
        None => format!(
            "This loading does not show the stiffness of joint \"{name}\", and no force at the tool point loads it; choose another tool point (--tool), away from its axis, or use a link encoder or the frequency response."
        ),
        Some(found) => {
            let [x, y, z] = found.direction.map(|v| format!("{v:.2}"));
            format!(
                "This loading does not show the stiffness of joint \"{name}\" apart from the others. A force along ({x}, {y}, {z}) in the base axes at the pose {} would: its arm is {} ({} % of the displacement if all drives were equally stiff).",
                listed_pose(&found.pose),
                format_significant(found.arm, 3),
                format_significant(100.0 * found.share, 2)
            )
        }
    })
}
