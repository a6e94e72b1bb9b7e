//! Stiffness of the drives from the displacement of the tool point under a known wrench, with the motors held.
//!
//! δx = J·δq_motor + Σ a_k·(a_k·w)/c_k − Σ a_k·h_k·direction_k + offset, with the columns a_k of J·R⁻¹: linear in the
//! compliances 1/c_k and in the hysteresis h_k (rad or m). Only the translation is measured. Movements of the motors are
//! taken from their encoders. A gap adds a_k·(gap/2)·sign(spring), see [`super::fit`].
//!
//! The links yield under weight and wrench, which changes the columns and the torques. The regression keeps those of the motors'
//! pose. What the balance of the links ([`super::equilibrium`]) displaces beyond them, by the stiffness found so far, is
//! subtracted from the reading, and the regression is repeated. The twist of a drive whose stiffness is not shown counts as zero
//! there.
//!
//! Leaves out: gaps that are crossed at other torques than the described weight tells, if several recordings have several such torques; elasticity of base and links, which counts as that of the drives.

use std::collections::BTreeMap;

use rig_model::robot::{JointKind, Robot};
use rig_output::{format_significant, format_unit};
use statrs::distribution::{ContinuousCDF, Normal};

use super::advice::advice;
use super::equilibrium::Equilibrium;
use super::fit::{Fit, Lack, Row, fit, refit, shows, without_gaps};
use super::link::{NEGATIVE, NOT_SHOWN};
use super::result::{Deflection, DriveLoading};
use super::windows::{Course, Slow, means, noise, range, window_rows};
use super::wrench::{DISPLACEMENT, torques, wrench};
use crate::drives::listed_pose;
use crate::error::ComplianceError;
use crate::sag::TWIST;
use crate::signals::Signals;
use crate::tool_point::ToolPoint;
use crate::value::Value;

/// Largest movement of a held motor within a recording, rad or m.
const HELD: f64 = 0.02;
/// Arm below which the tool point lies on the axes, m.
const ARMLESS: f64 = 1e-9;
/// Probability that noise alone makes the hysteresis of any drive look impossible.
const IMPOSSIBLE: f64 = 0.01;
/// Share of the range of the load after a turning point in which friction changes its sign.
const TRANSITION: f64 = 0.15;
/// Share of the largest load times arm from which on a drive's turning points count.
const MATERIAL: f64 = 0.05;
/// Share of the largest arm from which on a window is shown in the figure of a drive: over a small arm its residual says nothing.
const SHOWN_ARM: f64 = 0.3;
/// Displacement along recorded axes over that along others, of equal springs, below which the wrong axis was recorded. By judgement: an
/// axis that sees less is no choice of anybody.
const ACROSS: f64 = 0.02;
/// Fewest windows.
const FEWEST: usize = 12;
/// Regressions at most. Each one leaves the twist, a small angle, times the error of the one before.
const PASSES: usize = 6;
/// Relative change of every compliance that ends them.
const SETTLED: f64 = 1e-6;

/// One stretch at one pose.
struct Held {
    /// Columns a_k, rows dx dy dz: [axis][drive].
    arms: [Vec<f64>; 3],
    /// Torque of each drive by window, of the wrench.
    loads: Vec<Vec<f64>>,
    /// Slow course of these torques; one width for all drives.
    slow: Vec<Slow>,
    /// Torque of each drive by the weight at the start; of what is described.
    weight: Vec<f64>,
    /// Displacement as it was read, for each measured axis.
    read: [Option<Vec<f64>>; 3],
    /// Displacement by the springs at constant columns and torques.
    displacement: [Option<Vec<f64>>; 3],
    /// Pose, and position of the motors by window: [window][joint].
    pose: Vec<f64>,
    motors: Vec<Vec<f64>>,
    /// Reading of the wrench by window.
    force: Vec<[f64; 6]>,
}

/// Reads all stretches. Returns them, the rows of the regression and the number of windows.
fn read(
    tool: &ToolPoint<'_>,
    stretches: &[&Signals],
) -> Result<(Vec<Held>, Vec<Row>, usize), ComplianceError> {
    let size = window_rows(stretches.iter().map(|s| s.len()).sum());
    let held = (stretches.iter())
        .map(|signals| hold(tool, signals, size))
        .collect::<Result<Vec<_>, _>>()?;
    refuse_noise(&held, stretches, size)?;
    let (rows, windows) = rows(&held, &ranges(&held, tool.count()));
    Ok((held, rows, windows))
}

/// Range of the torque of each drive over all stretches.
fn ranges(held: &[Held], count: usize) -> Vec<f64> {
    (0..count)
        .map(|k| range(held.iter().flat_map(|h| &h.slow[k].values)))
        .collect()
}

/// How well the springs explain displacements.
pub(super) struct Judged {
    pub lack: Lack,
    /// Number of drives whose stiffness is shown.
    pub shown: usize,
    /// Number of drives whose stiffness would be negative.
    pub negative: usize,
}

impl Judged {
    /// Returns true if stiffness is shown, with one sign.
    pub(super) fn positive(&self) -> bool {
        (self.shown > 0) != (self.negative > 0)
    }
}

/// Judges how well the springs, without gaps, explain displacements; `None` if they cannot be read.
pub(super) fn judged(tool: &ToolPoint<'_>, stretches: &[&Signals]) -> Option<Judged> {
    let (_, rows, windows) = read(tool, stretches).ok()?;
    let found = (windows >= FEWEST)
        .then(|| without_gaps(&rows, tool.count()))
        .flatten()?;
    let seen = |k: &usize| !found.estimate.hidden[*k];
    let shown = |k: &usize| {
        let own = found.value(*k);
        own.value > 0.0 && own.relative() < NOT_SHOWN
    };
    let negative = |k: &usize| found.value(*k).value < -NEGATIVE * found.value(*k).std;
    let count = |of: &dyn Fn(&usize) -> bool| (0..tool.count()).filter(seen).filter(of).count();
    Some(Judged {
        shown: count(&shown),
        negative: count(&negative),
        lack: found.lack,
    })
}

/// What displacements of the tool point show.
pub(super) struct ByTool {
    pub drives: Vec<DriveLoading>,
    pub lack: Lack,
    /// Says that the displacement is not that of springs.
    pub told: Option<String>,
    /// Names the recordings that are too short.
    pub unused: Vec<String>,
}

/// Finds the stiffness of all drives from displacements of the tool point.
///
/// # Errors
/// [`ComplianceError`]: a pose that changes within a recording, a column that is missing, too few windows.
pub(super) fn by_tool(
    tool: &ToolPoint<'_>,
    stretches: &[&Signals],
) -> Result<ByTool, ComplianceError> {
    let n = tool.count();
    let (mut held, mut rows, windows) = read(tool, stretches)?;
    let mut found = (windows >= FEWEST)
        .then(|| fit(&rows, n, true))
        .flatten()
        .ok_or_else(|| {
            ComplianceError::Recording(format!(
                "The recordings of the loaded tool point have {windows} usable windows, {FEWEST} are needed: change the force slowly, to and fro, and record more rows."
            ))
        })?;
    if settle(tool, &mut held, &mut rows, found.clone())? {
        found = fit(&rows, n, true).unwrap_or(found);
    }
    let told = found.lack.told("m").map(|told| crooked(tool, &told));
    let mut drives = Vec::new();
    for k in 0..n {
        drives.push(drive(tool, k, &held, &rows, &found)?);
    }
    if let (true, Some(reason)) = (
        drives.iter().all(|own| own.stiffness.is_none()),
        across(&held),
    ) {
        for own in &mut drives {
            own.missing = Some(reason.clone());
        }
    }
    Ok(ByTool {
        drives,
        lack: found.lack,
        told,
        unused: unused(stretches, &rows),
    })
}

/// Names the recordings that are too short for any row to count.
fn unused(stretches: &[&Signals], rows: &[Row]) -> Vec<String> {
    let counts = |s: usize| rows.iter().any(|row| row.stretch == s);
    (stretches.iter().enumerate())
        .filter(|(s, signals)| signals.len() < FEWEST && !counts(*s))
        .map(|(_, signals)| {
            format!(
                "{} is not used: it has too few rows ({}) for a force that changes slowly, to and fro.",
                signals.label,
                signals.len()
            )
        })
        .collect()
}

/// Takes the weight's and the wrench's change by the yielding links from the displacements of all stretches, by a first fit of its
/// rows. Returns false if nothing changed.
fn settle(
    tool: &ToolPoint<'_>,
    held: &mut [Held],
    rows: &mut Vec<Row>,
    mut found: Fit,
) -> Result<bool, ComplianceError> {
    let n = tool.count();
    let balance = Equilibrium::new(tool)?;
    let mut springs = Spring::all(rows, &found, n);
    for pass in 0..PASSES {
        if !straighten(&balance, held, &springs)? {
            return Ok(pass > 0);
        }
        *rows = self::rows(held, &ranges(held, n)).0;
        let Some(next) = refit(rows, &found) else {
            break;
        };
        found = next;
        let before = std::mem::replace(&mut springs, Spring::all(rows, &found, n));
        let settled = (before.iter().zip(&springs))
            .all(|(a, b)| (a.compliance - b.compliance).abs() <= SETTLED * b.compliance);
        if settled {
            break;
        }
    }
    Ok(true)
}

/// Says that the displacement is not that of springs.
fn crooked(tool: &ToolPoint<'_>, told: &str) -> String {
    let [x, y, z] = tool.offset();
    format!(
        "The displacement of the tool point does not follow the force as the springs of the joints do: {told}. Is the tool point, where force and gauge act, at --tool {x} {y} {z} (m, flange frame)? Check axes, signs and units of force and displacement too; elasticity of links and base, drift, and a stiffness that grows with the load leave such a residual as well. The standard deviations contain it."
    )
}

/// Says that the force moves the tool point along axes of which no displacement was recorded. `None` if it moves it along a recorded
/// one.
fn across(held: &[Held]) -> Option<String> {
    let mut moved = [0.0f64; 3];
    for own in held {
        for (axis, moved) in moved.iter_mut().enumerate() {
            let each = own.arms[axis].iter().zip(&own.slow);
            let size = |(arm, slow): (&f64, &Slow)| arm.abs() * range(slow.values.iter());
            *moved = each.map(size).fold(*moved, f64::max);
        }
    }
    let recorded = |axis: &usize| held.iter().any(|own| own.read[*axis].is_some());
    let (seen, unseen): (Vec<usize>, Vec<usize>) = (0..3).partition(recorded);
    let most = |list: &[usize]| list.iter().map(|axis| moved[*axis]).fold(0.0, f64::max);
    if most(&seen) > ACROSS * most(&unseen) {
        return None;
    }
    let best = (unseen.into_iter()).max_by(|a, b| moved[*a].total_cmp(&moved[*b]))?;
    let axis = ["x", "y", "z"][best];
    let names: Vec<&str> = seen.iter().map(|axis| DISPLACEMENT[*axis]).collect();
    Some(format!(
        "The force moves the tool point along {axis} (base axes), but of its displacement only {} was recorded, along which it hardly moves. Record {}, or check whether the columns of the displacement, or those of the force, are exchanged.",
        names.join(", "),
        DISPLACEMENT[best]
    ))
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
    let force: Vec<[f64; 6]> = (0..force[0].len())
        .map(|i| force.each_ref().map(|list| list[i]))
        .collect();
    let motors: Vec<Vec<f64>> = (0..force.len())
        .map(|i| motors.iter().map(|list| list[i]).collect())
        .collect();
    let (loads, weight) = loads(tool, &pose, &force, &motors)?;
    for name in DISPLACEMENT {
        let list = signals.column(name).unwrap_or_default();
        if let Some(row) = list.iter().position(|d| !d.is_finite()) {
            return Err(ComplianceError::Recording(format!(
                "{}: {name} at t = {} s is not a number; correct the field.",
                signals.label, signals.t[row]
            )));
        }
    }
    plausible(signals, &jacobian)?;
    let read = DISPLACEMENT.map(|name| Some(means(signals.column(name)?, rows)));
    let displacement = std::array::from_fn(|axis| {
        let read: &Vec<f64> = read[axis].as_ref()?;
        Some(
            (read.iter().zip(&motors))
                .map(|(d, motors)| {
                    let moved = (0..n).map(|j| jacobian[(axis, j)] * (motors[j] - pose[j]));
                    d - moved.sum::<f64>()
                })
                .collect(),
        )
    });
    let arms = std::array::from_fn(|axis| (0..n).map(|k| per_twist[(axis, k)]).collect());
    Ok(Held {
        slow: slow(&arms, &loads),
        arms,
        loads,
        weight,
        read,
        displacement,
        pose,
        motors,
        force,
    })
}

/// What is known of the spring of a drive, in coordinates of its twist.
#[derive(Clone, Copy, Debug, Default)]
struct Spring {
    compliance: f64,
    hysteresis: f64,
    /// Half a gap.
    half: f64,
    /// Torque at which the gap is crossed.
    zero: f64,
    friction: f64,
}

impl Spring {
    /// Springs of all drives; rigid where the stiffness is not shown.
    fn all(rows: &[Row], found: &Fit, count: usize) -> Vec<Self> {
        let values = &found.estimate.values;
        (0..count)
            .map(|k| {
                let Some(compliance) = determined(rows, found, k) else {
                    return Self::default();
                };
                let gap = found.gap(k);
                Self {
                    compliance: compliance.value,
                    hysteresis: match found.estimate.hidden[count + k] {
                        true => 0.0,
                        false => values[count + k],
                    },
                    half: gap.map_or(0.0, |(_, column)| values[column]),
                    zero: gap.map_or(0.0, |(gap, _)| gap.zero),
                    friction: found.friction(k),
                }
            })
            .collect()
    }

    /// Twist beside that of the load: `load` decides the side of the gap.
    fn step(&self, load: f64, direction: f64) -> f64 {
        let side = (load - self.friction * direction - self.zero).signum();
        self.half * side - self.hysteresis * direction
    }
}

/// Takes from the displacement what the balance of the links displaces beyond the linear regression. Returns false, and changes
/// nothing, if the springs hold the links nowhere near the motors.
fn straighten(
    balance: &Equilibrium<'_, '_>,
    held: &mut [Held],
    springs: &[Spring],
) -> Result<bool, ComplianceError> {
    let ranges = ranges(held, springs.len());
    let mut all = Vec::with_capacity(held.len());
    for own in held.iter() {
        let mut directions = vec![vec![0.0; springs.len()]; own.force.len()];
        for (i, direction) in settled(own, &ranges) {
            directions[i] = direction;
        }
        let mut beyond = Vec::with_capacity(own.force.len());
        let start = balance.place(&own.pose)?;
        for (i, direction) in directions.iter().enumerate() {
            let step =
                |k: usize| springs[k].step(own.slow[k].values[i] - own.weight[k], direction[k]);
            let twist = |k: usize, load: f64| springs[k].compliance * load + step(k);
            let Some(links) = balance.links(&own.motors[i], &own.force[i], twist)? else {
                return Ok(false);
            };
            let place = balance.place(&links)?;
            beyond.push([0, 1, 2].map(|axis| {
                let linear: f64 = (0..springs.len())
                    .map(|k| own.arms[axis][k] * twist(k, own.loads[k][i]))
                    .sum();
                place[axis] - start[axis] - linear
            }));
        }
        all.push(beyond);
    }
    for (own, beyond) in held.iter_mut().zip(&all) {
        for (axis, read) in own.read.iter().enumerate() {
            own.displacement[axis] = read.as_ref().map(|read| {
                (read.iter().zip(beyond))
                    .map(|(d, beyond)| d - beyond[axis])
                    .collect()
            });
        }
    }
    Ok(true)
}

/// Returns the slow course of each drive's torque, with the width that the most loaded drive needs.
fn slow(arms: &[Vec<f64>; 3], loads: &[Vec<f64>]) -> Vec<Slow> {
    let size = |k: &usize| range(loads[*k].iter()) * arm(arms, *k);
    let most = (0..loads.len()).max_by(|a, b| size(a).total_cmp(&size(b)));
    let reach = most.map_or(1, |k| Slow::clear(&loads[k]).reach);
    loads.iter().map(|own| Slow::of(own, reach)).collect()
}

/// Refuses recordings of which the most loaded one does not show its turning points for noise.
fn refuse_noise(
    held: &[Held],
    stretches: &[&Signals],
    window: usize,
) -> Result<(), ComplianceError> {
    let size = |(own, k): (&Held, usize)| range(own.slow[k].values.iter()) * arm(&own.arms, k);
    let all =
        (held.iter().enumerate()).flat_map(|(s, own)| (0..own.slow.len()).map(move |k| (s, k)));
    let most = all.max_by(|a, b| size((&held[a.0], a.1)).total_cmp(&size((&held[b.0], b.1))));
    let Some((s, k)) = most.filter(|(s, k)| !held[*s].slow[*k].is_clear()) else {
        return Ok(());
    };
    let force = wrench(stretches[s])?.map(|list| noise(&means(&list, window)));
    let (own, rows) = (stretches[s], stretches[s].len());
    // Over a longer time as many windows more are averaged.
    let needed = held[s].slow[k].shortage() * rows as f64;
    Err(ComplianceError::Recording(format!(
        "{}: the force is too noisy for a recording of {rows} rows ({} s), or changes too fast: it has a noise of {} N (standard deviation of the mean of {window} rows) beside its slow course, and its turning points are not seen. Load in the same way for longer ({} rows or more at this noise), change the force further, or filter force and displacement alike.",
        own.label,
        format_significant(rows as f64 / own.rate(), 3),
        format_significant(force[..3].iter().copied().fold(0.0, f64::max), 2),
        format_significant(needed, 2)
    )))
}

/// Length of the arm of a drive.
fn arm(arms: &[Vec<f64>; 3], k: usize) -> f64 {
    arms.iter().map(|a| a[k] * a[k]).sum::<f64>().sqrt()
}

/// Refuses a displacement that no small twist of the joints gives.
fn plausible(signals: &Signals, jacobian: &nalgebra::DMatrix<f64>) -> Result<(), ComplianceError> {
    let arm: f64 = (jacobian.column_iter())
        .map(|c| c.fixed_rows::<3>(0).norm())
        .sum();
    if arm <= ARMLESS {
        return Err(ComplianceError::Recording(format!(
            "{}: the tool point lies on the axes of all joints, so a force there turns no joint and no twist moves it. Give --tool X Y Z, the point in the flange frame (m) at which the force acts and the displacement is measured.",
            signals.label
        )));
    }
    for name in DISPLACEMENT {
        let moved = range(signals.column(name).unwrap_or_default().iter());
        if moved > TWIST * arm {
            return Err(ComplianceError::Recording(format!(
                "{}: {name} changes by {} m, but a twist of {TWIST} rad (m) of every joint moves the tool point by {} m at most at this pose. Record the displacement in metres (1 mm is 0.001), and check --tool.",
                signals.label,
                format_significant(moved, 3),
                format_significant(TWIST * arm, 3)
            )));
        }
    }
    Ok(())
}

/// Torque of each drive by window: of the wrench, and of the weight as the motors move a little. Then the torque of the weight at
/// the start, which the springs hold.
fn loads(
    tool: &ToolPoint<'_>,
    pose: &[f64],
    force: &[[f64; 6]],
    motors: &[Vec<f64>],
) -> Result<(Vec<Vec<f64>>, Vec<f64>), ComplianceError> {
    let n = tool.count();
    let balance = Equilibrium::new(tool)?;
    let inverse = tool.drives().inverse(pose)?;
    let before = balance.weight(pose)?;
    let mut loads = vec![Vec::with_capacity(force.len()); n];
    for (force, place) in force.iter().zip(motors) {
        let pushed = torques(tool, pose, force)?;
        let weight = balance.weight(place)?;
        for (k, own) in loads.iter_mut().enumerate() {
            // f = R⁻ᵀ·τ.
            let joint = (0..n).map(|j| inverse[(j, k)] * (pushed[j] - weight[j] + before[j]));
            own.push(joint.sum());
        }
    }
    let weight = (0..n).map(|k| (0..n).map(|j| inverse[(j, k)] * before[j]).sum());
    Ok((loads, weight.collect()))
}

/// Forms the rows of the regression; its columns are the compliances, the hystereses and an offset per stretch and axis.
/// Returns also the number of windows.
fn rows(held: &[Held], ranges: &[f64]) -> (Vec<Row>, usize) {
    let mut rows = Vec::new();
    let mut windows = 0;
    for (stretch, own) in held.iter().enumerate() {
        let settled = settled(own, ranges);
        for axis in 0..3 {
            let Some(read) = &own.displacement[axis] else {
                continue;
            };
            for (w, (i, directions)) in settled.iter().enumerate() {
                let group = 3 * stretch + axis;
                rows.push(Row {
                    group,
                    y: read[*i],
                    window: windows + w,
                    ..row(own, *i, axis, directions, group, 3 * held.len())
                });
            }
        }
        windows += settled.len();
    }
    (rows, windows)
}

/// Windows away from turning points, with the direction of each drive that is loaded, 0 of the others.
fn settled(own: &Held, ranges: &[f64]) -> Vec<(usize, Vec<f64>)> {
    let n = ranges.len();
    let courses: Vec<Vec<Course>> = (0..n)
        .map(|k| own.slow[k].courses(&own.loads[k], ranges[k]))
        .collect();
    let size = |k: usize| range(own.slow[k].values.iter()) * arm(&own.arms, k);
    let most = (0..n).map(size).fold(0.0, f64::max);
    let material: Vec<usize> = (0..n)
        .filter(|k| size(*k) > MATERIAL * most && own.slow[*k].is_loaded())
        .collect();
    (1..own.loads.first().map_or(0, Vec::len).saturating_sub(1))
        .filter(|i| {
            material.iter().all(|k| {
                let course = &courses[*k];
                course[*i].direction != 0.0 && course[*i].travel > TRANSITION * ranges[*k]
            })
        })
        .map(|i| {
            let direction = |k: usize| match material.contains(&k) {
                true => courses[k][i].direction,
                false => 0.0,
            };
            (i, (0..n).map(direction).collect())
        })
        .collect()
}

/// One row without its reading.
fn row(own: &Held, i: usize, axis: usize, directions: &[f64], group: usize, offsets: usize) -> Row {
    let n = directions.len();
    let arms = own.arms[axis].clone();
    let beside = |k: usize| own.slow[k].values[i];
    let load = (0..n).map(|k| arms[k] * own.loads[k][i]);
    let friction = (0..n).map(|k| -arms[k] * directions[k]);
    let offset = (0..offsets).map(|o| f64::from(u8::from(o == group)));
    Row {
        x: load.chain(friction).chain(offset).collect(),
        z: (0..n).map(|k| arms[k] * beside(k)).collect(),
        y: 0.0,
        group,
        loads: (0..n).map(|k| beside(k) - own.weight[k]).collect(),
        weight: own.weight.clone(),
        directions: directions.to_vec(),
        window: 0,
        stretch: group / 3,
        arms,
    }
}

/// Returns the compliance of drive `k` if the rows show it.
fn determined(rows: &[Row], found: &Fit, k: usize) -> Option<Value> {
    let own = found.value(k);
    (own.value > 0.0 && own.relative() < NOT_SHOWN && shows(rows, found, k)).then_some(own)
}

/// Returns what the loading shows of drive `k`.
fn drive(
    tool: &ToolPoint<'_>,
    k: usize,
    held: &[Held],
    rows: &[Row],
    found: &Fit,
) -> Result<DriveLoading, ComplianceError> {
    let n = tool.count();
    let robot = tool.robot();
    let mut result = DriveLoading::new(robot.joints[k].name.clone(), k, Deflection::Tool);
    result.windows = found.windows;
    let loads: Vec<f64> = held.iter().flat_map(|h| h.loads[k].clone()).collect();
    let low = loads.iter().copied().fold(f64::INFINITY, f64::min);
    result.load = [low, low + range(loads.iter())];
    let compliance = found.value(k);
    if determined(rows, found, k).is_none() {
        let random = found.estimate.std(k) < NOT_SHOWN * compliance.value.abs();
        // A systematic residual alone hides it, however small it is beside the whole displacement. One that is not small makes the
        // random part wide, too: its windows are correlated.
        let lacking = found.lack.systematic > 0.0 && (random || found.lack.told("m").is_some());
        let told = (lacking && shows(rows, found, k)).then(|| found.lack.words("m"));
        let opposite = !found.estimate.hidden[k] && compliance.value < -NEGATIVE * compliance.std;
        result.missing = Some(match (opposite, told) {
            (true, _) => opposite_sign(&result.joint),
            (false, Some(told)) => format!(
                "The stiffness of joint \"{}\" is uncertain by more than {} %. {}",
                result.joint,
                100.0 * NOT_SHOWN,
                crooked(tool, &told)
            ),
            (false, None) => match without_hysteresis(held, k) {
                Some(bound) => hidden_by_hysteresis(tool, k, bound),
                None => missing(tool, robot, k)?,
            },
        });
        return Ok(result);
    }
    let stiffness = compliance.reciprocal();
    result.stiffness = Some(stiffness);
    let torque = |v: Value| Value::new(v.value * stiffness.value, v.std * stiffness.value);
    if !found.estimate.hidden[n + k] && found.estimate.values[n + k] != 0.0 {
        result.hysteresis = Some(torque(found.value(n + k)));
        let own = torque(Value::new(
            found.estimate.values[n + k],
            found.estimate.std(n + k),
        ));
        if own.value < -beyond_chance(n) * own.std {
            result.warnings.push(format!(
                "The hysteresis of joint \"{}\" comes out as {} ± {}, but friction makes it positive: the displacement does not belong to this load. Check --tool, and axes and signs of force and displacement.",
                result.joint,
                format_significant(own.value, 3),
                format_significant(own.std, 2)
            ));
        }
    }
    result.reverses = found.reverses(rows, k);
    if let Some((gap, column)) = found.gap(k) {
        let unit = format_unit(robot.joints[k].kind.units().1);
        result.add_gap(found.value(column), gap.zero, &unit);
    }
    result.points = partial_twists(rows, found, k);
    Ok(result)
}

/// Returns the standard deviations below zero that any of `drives` values reaches with the probability [`IMPOSSIBLE`].
fn beyond_chance(drives: usize) -> f64 {
    Normal::standard().inverse_cdf(1.0 - IMPOSSIBLE / drives.max(1) as f64)
}

/// Torque and twist of a spring by window, of growing and of falling torque: what the spring and the hysteresis of the drive
/// explain, with the whole residual over its arm (component plus residual, Larsen & McCleary 1972). Of each window the axis
/// with the largest arm counts.
fn partial_twists(rows: &[Row], found: &Fit, k: usize) -> [Vec<[f64; 2]>; 2] {
    let values = &found.estimate.values;
    let n = rows.first().map_or(0, |row| row.arms.len());
    let gap = found.gap(k);
    let mut best: BTreeMap<usize, &Row> = BTreeMap::new();
    for row in rows {
        let own = best.entry(row.window).or_insert(row);
        if row.arms[k].abs() > own.arms[k].abs() {
            *own = row;
        }
    }
    let most = best
        .values()
        .fold(0.0, |m: f64, row| m.max(row.arms[k].abs()));
    let mut points = [Vec::new(), Vec::new()];
    for row in best.values() {
        let (arm, direction) = (row.arms[k], row.directions[k]);
        if direction == 0.0 || arm.abs() < SHOWN_ARM * most {
            continue;
        }
        let load = row.x[k] / arm;
        let step = gap.map_or(0.0, |(gap, column)| {
            let spring = row.loads[k] - found.friction(k) * direction;
            values[column] * (spring - gap.zero).signum()
        });
        let twist = values[k] * load - values[n + k] * direction + step + found.left(row) / arm;
        // The weight of the links loads the spring as well: the gap is crossed at a torque of the spring.
        let weight = -row.weight[k];
        points[usize::from(direction < 0.0)].push([load + weight, twist + values[k] * weight]);
    }
    points
}

/// Says that the displacement follows the force with the wrong sign.
fn opposite_sign(name: &str) -> String {
    format!(
        "The displacement of the tool point follows the torque of joint \"{name}\", but with the opposite sign: the force is that on the environment instead of that on the robot, or the gauge counts the other way, or two axes are exchanged, or --tool is wrong. Correct the signs, the columns or the tool point."
    )
}

/// Returns the stiffness of drive `k` as it would be without hysteresis, by all windows; `None` if they do not show it
/// either.
fn without_hysteresis(held: &[Held], k: usize) -> Option<Value> {
    let n = held.first()?.loads.len();
    let (mut rows, mut windows) = (Vec::new(), 0);
    for (stretch, own) in held.iter().enumerate() {
        let count = own.loads.first().map_or(0, Vec::len);
        for (axis, read) in own.displacement.iter().enumerate() {
            let group = 3 * stretch + axis;
            for (i, y) in read.iter().flatten().enumerate() {
                rows.push(Row {
                    y: *y,
                    window: windows + i,
                    ..row(own, i, axis, &vec![0.0; n], group, 3 * held.len())
                });
            }
        }
        windows += count;
    }
    let found = without_gaps(&rows, n).filter(|found| !found.estimate.hidden[k])?;
    let own = found.value(k);
    (own.value > 0.0 && own.relative() < NOT_SHOWN).then(|| own.reciprocal())
}

/// Says that the levels of the load do not tell the spring from its hysteresis.
fn hidden_by_hysteresis(tool: &ToolPoint<'_>, k: usize, bound: Value) -> String {
    format!(
        "This loading does not tell the stiffness of joint \"{}\" from its hysteresis: the load has too few levels between its turning points, or turns before it has changed by {} % of its range. Change it slowly to and fro, or in steps with at least one level between the extremes on the way up and on the way down (0, 10, 20, 10, 0 N). Without hysteresis the stiffness would be {} {}; hysteresis makes it smaller.",
        tool.robot().joints[k].name,
        100.0 * TRANSITION,
        rig_output::format_value(bound.value, bound.std),
        rig_output::format_unit(tool.drives().unit(tool.robot(), k))
    )
}

/// Says which pose and force would show a drive.
fn missing(tool: &ToolPoint<'_>, robot: &Robot, k: usize) -> Result<String, ComplianceError> {
    let name = &robot.joints[k].name;
    Ok(match advice(tool, k)? {
        None => format!(
            "This loading does not show the stiffness of joint \"{name}\", and no force at the tool point loads it; choose another tool point (--tool), away from its axis, or use a link encoder or the frequency response."
        ),
        Some(found) => {
            let [x, y, z] = found
                .direction
                .map(|v| format!("{:.2}", if v.abs() < 5e-3 { 0.0 } else { v }));
            format!(
                "This loading does not show the stiffness of joint \"{name}\" apart from the others. A force along ({x}, {y}, {z}) in the base axes at the pose {} ({}) would: its arm is {} ({} % of the displacement if all drives were equally stiff).",
                listed_pose(&found.pose),
                match robot.joints.iter().all(|j| j.kind == JointKind::Revolute) {
                    true => "rad",
                    false => "rad or m",
                },
                format_significant(found.arm, 3),
                format_significant(100.0 * found.share, 2)
            )
        }
    })
}
