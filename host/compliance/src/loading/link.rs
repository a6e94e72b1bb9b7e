//! Twist of the drives by encoders on the links.
//!
//! twist = R·(q − ql) in motion, and Ψ(q) − Ψ(ql) with the motors held, where Ψ is the position of the drives: the ratio R of a
//! screw changes on the way. It is modelled as twist = (f − fh·direction)/c + offset. In slow motion f is the torque of the motor, R⁻ᵀ·τ, and fh
//! the Coulomb friction between motor and spring, whose sign is that of the motion; the torque that accelerates the described
//! motor is subtracted. With the motors held f is the torque
//! of the described weight and of the wrench at the tool point, R⁻ᵀ·(g − Jᵀ·w), and fh the hysteresis of the gear, whose sign is that of the load's change.
//! A gap adds half its width with the sign of the spring's torque. With a wrench the load at which it is crossed is searched, because
//! it depends on the described weight.
//!
//! With the motors held weight and wrench act on the link where it stands, q − twist. A link encoder has an unknown zero, so the
//! twist in the first window is unknown, too. It is the measured one less the offset of the regression: the regression is
//! repeated with it. The twist of a drive whose stiffness is not shown counts as zero there.

use rig_model::robot::Robot;
use rig_output::{format_significant, format_unit};
use rig_shared::transmission::DriveKind;

use super::equilibrium::Equilibrium;
use super::fit::{Fit, Row, fit, shows};
use super::result::{Deflection, DriveLoading};
use super::windows::{Course, Slow, TURN, courses, is_within_run, means, range, window_rows};
use super::wrench::{has_wrench, torques, wrench};
use crate::error::ComplianceError;
use crate::signals::Signals;
use crate::tool_point::ToolPoint;
use crate::value::Value;

/// Largest plausible change of a twist, rad or m. By judgement: gears twist by milliradians.
const TWIST: f64 = 0.2;
/// Share of the range of the load after a turning point in which friction changes its sign.
const TRANSITION: f64 = 0.1;
/// Multiple of the friction torque by which the load changes until friction has changed its sign: 2, and some margin.
const FRICTION_TURNS: f64 = 2.5;
/// Share of a usual movement of a window below which the joint counts as resting.
const MOVES: f64 = 0.2;
/// Relative standard deviation of 1/c beyond which the stiffness is not shown.
pub(super) const NOT_SHOWN: f64 = 0.2;
/// Standard deviations beyond which a negative compliance shows a wrong sign.
pub(super) const NEGATIVE: f64 = 2.0;
/// Relative spread of the speed from which on viscous friction is estimated.
const SPEEDS: f64 = 0.2;
/// Fewest windows.
const FEWEST: usize = 20;
/// Regressions with the motors held. The twist is a small angle ε, so that each one leaves ε times the error of the one before.
const PASSES: usize = 4;

/// One window.
#[derive(Clone, Copy, Debug)]
struct Window {
    stretch: usize,
    load: f64,
    /// Mean load of the neighbours.
    instrument: f64,
    twist: f64,
    speed: f64,
    moves: bool,
    course: Course,
}

/// Columns of the regression.
const LOAD: usize = 0;
const DIRECTION: usize = 1;

/// What the stretches with link encoders show of one drive.
struct Found {
    loading: DriveLoading,
    /// Twist in the first window of each stretch, of those that have one.
    first: Vec<Option<f64>>,
}

/// Finds the stiffness of all drives from stretches with link encoders, of those that have the encoders that they need.
///
/// # Errors
/// [`ComplianceError`].
pub(super) fn by_links(
    tool: &ToolPoint<'_>,
    stretches: &[&Signals],
) -> Result<Vec<DriveLoading>, ComplianceError> {
    let n = tool.count();
    let mut first = vec![vec![0.0; n]; stretches.len()];
    let mut passes = 0;
    loop {
        let found = (0..n)
            .map(|k| by_link(tool, stretches, k, &first))
            .collect::<Result<Vec<_>, _>>()?;
        passes += 1;
        let held = (found.iter().flatten()).any(|own| own.loading.by == Deflection::LinkByWrench);
        if !held || passes == PASSES {
            return Ok(found.into_iter().flatten().map(|own| own.loading).collect());
        }
        for (s, (first, signals)) in first.iter_mut().zip(stretches).enumerate() {
            let twist: Vec<f64> = (found.iter())
                .map(|own| own.as_ref().and_then(|own| own.first[s]).unwrap_or(0.0))
                .collect();
            let motors: Vec<f64> = (signals.joints.iter())
                .map(|j| j.q.first().copied().unwrap_or(0.0))
                .collect();
            yielded(tool, &motors, &twist, first)?;
        }
    }
}

/// Corrects what the joints yield by, motor minus link, where the drives have a twist: one step of Newton's method, because the ratio of a
/// screw changes on the way.
fn yielded(
    tool: &ToolPoint<'_>,
    motors: &[f64],
    twist: &[f64],
    yields: &mut [f64],
) -> Result<(), ComplianceError> {
    let drives = tool.drives();
    let links: Vec<f64> = (motors.iter().zip(yields.iter()))
        .map(|(motor, own)| motor - own)
        .collect();
    let (held, at) = (drives.positions(motors)?, drives.positions(&links)?);
    let inverse = drives.inverse(&links)?;
    for (j, own) in yields.iter_mut().enumerate() {
        *own += (0..twist.len())
            .map(|k| inverse[(j, k)] * (twist[k] - (held[k] - at[k])))
            .sum::<f64>();
    }
    Ok(())
}

/// Finds the stiffness of drive `k`. `first`: motor minus link of each joint in the first window of each stretch. `None` if no
/// stretch has the encoders that it needs.
fn by_link(
    tool: &ToolPoint<'_>,
    stretches: &[&Signals],
    k: usize,
    first: &[Vec<f64>],
) -> Result<Option<Found>, ComplianceError> {
    let robot = tool.robot();
    let row = tool.drives().rows(&robot.middle_position())?;
    let needed: Vec<usize> = (0..robot.joints.len())
        .filter(|j| row[(k, *j)].abs() > 1e-9 * row.row(k).norm())
        .collect();
    let usable: Vec<usize> = (0..stretches.len())
        .filter(|s| (needed.iter()).all(|j| stretches[*s].joints[*j].link.is_some()))
        .collect();
    if usable.is_empty() {
        return Ok(None);
    }
    let by_wrench = usable.iter().all(|s| has_wrench(stretches[*s]));
    let rows = window_rows(usable.iter().map(|s| stretches[*s].len()).sum());
    let mut series = Vec::new();
    for s in &usable {
        let at = by_wrench.then_some(first[*s].as_slice());
        let own = Series::of(tool, stretches[*s], k, at, rows)?;
        plausible(robot, stretches[*s], k, &own)?;
        series.push(own);
    }
    let windows = collect(&series, by_wrench);
    let by = match by_wrench {
        true => Deflection::LinkByWrench,
        false => Deflection::LinkByTorque,
    };
    let (loading, offsets) = estimate(robot, k, by, &windows);
    let mut twists = vec![None; stretches.len()];
    if let Some(stiffness) = loading.stiffness {
        for (place, (s, own)) in usable.iter().zip(&series).enumerate() {
            // A stretch that hardly loads this drive has no offset of its own.
            let offset = offsets.get(place).copied().flatten();
            let offset = offset.unwrap_or_else(|| own.unloaded(stiffness.value));
            twists[*s] = own.twist.first().map(|twist| twist - offset);
        }
    }
    Ok(Some(Found {
        loading,
        first: twists,
    }))
}

/// Forms the windows of all stretches.
fn collect(series: &[Series], by_wrench: bool) -> Vec<Window> {
    let range = range(series.iter().flat_map(|s| &s.place));
    let mut steps: Vec<f64> = (series.iter())
        .flat_map(|s| s.place.windows(3).map(|w| (w[2] - w[0]).abs()))
        .collect();
    steps.sort_by(f64::total_cmp);
    let usual = rig_numerics::statistics::percentile(&steps, 0.8);
    let mut all = Vec::new();
    for (stretch, own) in series.iter().enumerate() {
        // A load beside which noise is large has no turning points to be seen, and no windows.
        let slow = match by_wrench {
            true => Slow::clear(&own.load),
            false => Slow::of(&own.load, 1),
        };
        let courses = match by_wrench {
            true => slow.courses(&own.load, range),
            false => courses(&own.place, TURN * range),
        };
        for i in 1..own.load.len().saturating_sub(1) {
            let moved = own.place[i + 1] - own.place[i - 1];
            // The neighbours of a window beside a turning point lie on the other side of it.
            let alone = !by_wrench && !is_within_run(&courses, i, 1);
            // In motion friction depends on the speed, which is low on both sides of a turning point: what is left out
            // must be the same on both, or the friction there looks like a load.
            let near = match by_wrench {
                true => courses[i].travel,
                false => courses[i].travel.min(courses[i].ahead),
            };
            let far = near > TRANSITION * range;
            if alone || courses[i].direction == 0.0 || !far {
                continue;
            }
            all.push(Window {
                stretch,
                load: own.load[i],
                instrument: slow.values[i],
                twist: own.twist[i],
                speed: moved,
                moves: by_wrench || moved.abs() > MOVES * usual,
                course: courses[i],
            });
        }
    }
    if !by_wrench {
        all.retain(|w| w.moves);
    }
    all
}

/// Means over the windows of one stretch.
struct Series {
    load: Vec<f64>,
    twist: Vec<f64>,
    /// What decides the direction: the load with the motors held, the drive's position in motion.
    place: Vec<f64>,
}

/// Refuses a twist that no gear has: encoders with different units.
fn plausible(
    robot: &Robot,
    signals: &Signals,
    k: usize,
    own: &Series,
) -> Result<(), ComplianceError> {
    let twist = range(own.twist.iter());
    if robot.drive_kinds()[k] == DriveKind::Varying || !(twist > TWIST) {
        return Ok(());
    }
    let number = k + 1;
    Err(ComplianceError::Recording(format!(
        "{}: the twist of joint \"{}\" changes by {} {}, more than a loaded gear can. Motor (q{number}) and link (ql{number}) must have the same unit, rad or m (1° is 0.01745 rad), the same sign, and belong to the same joint.",
        signals.label,
        robot.joints[k].name,
        format_significant(twist, 3),
        robot.joints[k].kind.units().0
    )))
}

impl Series {
    /// Forms the means over windows of `rows` rows. `held`: with the motors held, motor minus link of each joint in the first
    /// window; the wrench then gives the load.
    fn of(
        tool: &ToolPoint<'_>,
        signals: &Signals,
        k: usize,
        held: Option<&[f64]>,
        rows: usize,
    ) -> Result<Self, ComplianceError> {
        let n = tool.count();
        let q: Vec<Vec<f64>> = signals.joints.iter().map(|j| means(&j.q, rows)).collect();
        let link: Vec<Option<Vec<f64>>> = (signals.joints.iter())
            .map(|j| j.link.as_ref().map(|l| means(l, rows)))
            .collect();
        let torque: Vec<Vec<f64>> = signals.joints.iter().map(|j| means(&j.tau, rows)).collect();
        let force = match held {
            Some(first) => Some((first, wrench(signals)?.map(|list| means(&list, rows)))),
            None => None,
        };
        if held.is_none() && torque.iter().any(Vec::is_empty) {
            return Err(ComplianceError::Recording(format!(
                "{} has link encoders, but neither joint torques (tau<k> or i<k>) nor a wrench at the tool point (fx … mz); the load of the springs is unknown.",
                signals.label
            )));
        }
        let balance = Equilibrium::new(tool)?;
        let count = q.first().map_or(0, Vec::len);
        let mut own = Self {
            load: Vec::with_capacity(count),
            twist: Vec::with_capacity(count),
            place: Vec::with_capacity(count),
        };
        let mut travelled = 0.0;
        for i in 0..count {
            let pose: Vec<f64> = q.iter().map(|list| list[i]).collect();
            let map = tool.drives().rows(&pose)?;
            let (at, joint) = match &force {
                None => (pose.clone(), torque.iter().map(|list| list[i]).collect()),
                Some((first, force)) => {
                    let place: Vec<f64> = (0..n)
                        .map(|j| match &link[j] {
                            Some(link) => q[j][0] - first[j] + link[i] - link[0],
                            None => pose[j],
                        })
                        .collect();
                    let mut load = balance.weight(&place)?;
                    let pushed = torques(tool, &place, &force.each_ref().map(|list| list[i]))?;
                    for (weight, pushed) in load.iter_mut().zip(&pushed) {
                        *weight -= pushed;
                    }
                    (place, load)
                }
            };
            let inverse = tool.drives().inverse(&at)?;
            // f = R⁻ᵀ·τ.
            let driven = |list: &[f64]| (0..n).map(|j| inverse[(j, k)] * list[j]).sum::<f64>();
            let load = driven(&joint);
            own.twist.push(match &force {
                Some(_) => tool.drives().positions(&pose)?[k] - tool.drives().positions(&at)?[k],
                None => (0..n)
                    .filter_map(|j| Some(map[(k, j)] * (pose[j] - link[j].as_ref()?[i])))
                    .sum(),
            });
            if i > 0 {
                travelled += (0..n)
                    .map(|j| map[(k, j)] * (q[j][i] - q[j][i - 1]))
                    .sum::<f64>();
            }
            own.place
                .push(if held.is_some() { load } else { travelled });
            own.load.push(load);
        }
        if held.is_none() {
            let seconds = rows as f64 / signals.rate();
            own.subtract_inertia(tool.drives().inertia(tool.robot(), k), seconds);
        }
        Ok(own)
    }

    /// Returns the mean twist without that of the mean load: the twist that the encoders read without a load.
    fn unloaded(&self, stiffness: f64) -> f64 {
        let mean = rig_numerics::statistics::mean_or_zero;
        mean(&self.twist) - mean(&self.load) / stiffness
    }

    /// Subtracts the torque that accelerates the motor; `seconds` is the length of a window.
    fn subtract_inertia(&mut self, inertia: f64, seconds: f64) {
        for i in 1..self.place.len().saturating_sub(1) {
            let second = self.place[i + 1] - 2.0 * self.place[i] + self.place[i - 1];
            self.load[i] -= inertia * second / (seconds * seconds);
        }
    }
}

/// Rows of the regression of the twist.
fn rows(windows: &[Window]) -> Vec<Row> {
    let stretches = windows.iter().map(|w| w.stretch + 1).max().unwrap_or(0);
    let speeds: Vec<f64> = windows.iter().map(|w| w.speed.abs()).collect();
    let middle = rig_numerics::statistics::mean_or_zero(&speeds);
    let spread = rig_numerics::statistics::squares_about(&speeds, middle);
    let viscous = windows.iter().all(|w| w.moves)
        && (spread / speeds.len().max(1) as f64).sqrt() > SPEEDS * middle;
    (windows.iter().enumerate())
        .map(|(window, w)| {
            let mut x = vec![w.load, -w.course.direction];
            x.extend((0..stretches).map(|s| f64::from(u8::from(s == w.stretch))));
            if viscous {
                x.push(w.speed);
            }
            Row {
                x,
                z: vec![w.instrument],
                y: w.twist,
                group: w.stretch,
                arms: vec![1.0],
                loads: vec![w.instrument],
                weight: vec![0.0],
                directions: vec![w.course.direction],
                window,
                stretch: w.stretch,
            }
        })
        .collect()
}

/// Estimates stiffness, hysteresis and gap of drive `k`. Returns also the twist that each stretch reads without a load, where the
/// windows show it.
fn estimate(
    robot: &Robot,
    k: usize,
    by: Deflection,
    windows: &[Window],
) -> (DriveLoading, Vec<Option<f64>>) {
    // A wrench gives the torque of the spring only as well as the weight is described.
    let search = by == Deflection::LinkByWrench;
    let mut kept = windows.to_vec();
    let mut found = solve(&kept, search);
    if let (Some(first), true) = (&found, search) {
        let friction = first.friction(0).abs();
        kept.retain(|w| w.course.travel > FRICTION_TURNS * friction);
        found = solve(&kept, search).or(found);
    }
    let mut result = DriveLoading::new(robot.joints[k].name.clone(), k, by);
    result.windows = kept.len();
    let Some(found) = found.filter(|f| shows(&rows(&kept), f, LOAD)) else {
        result.missing = Some(missing(robot, k, by));
        return (result, Vec::new());
    };
    let compliance = found.value(LOAD);
    let told = found.lack.told(robot.joints[k].kind.units().0);
    if !(compliance.value > 0.0 && compliance.relative() < NOT_SHOWN) {
        let opposite = compliance.value < -NEGATIVE * compliance.std;
        result.missing = Some(match (opposite, told) {
            (true, _) => opposite_sign(robot, k, by),
            (false, Some(told)) => format!("{} {ASK}", crooked(robot, k, &told)),
            (false, None) => missing(robot, k, by),
        });
        return (result, Vec::new());
    }
    let stiffness = compliance.reciprocal();
    result.stiffness = Some(stiffness);
    result.hysteresis = (!found.estimate.hidden[DIRECTION]).then(|| {
        let own = found.value(DIRECTION);
        Value::new(own.value * stiffness.value, own.std * stiffness.value)
    });
    result.warnings.extend(told.map(|told| {
        format!(
            "{} The standard deviation of the stiffness contains it. {ASK}",
            crooked(robot, k, &told)
        )
    }));
    result.reverses = found.reverses(&rows(&kept), 0);
    finish(&mut result, &kept, &found);
    if let Some((gap, column)) = found.gap(0) {
        let unit = format_unit(robot.joints[k].kind.units().1);
        result.add_gap(found.value(column), gap.zero, &unit);
    }
    result.windows = found.windows;
    let stretches = kept.iter().map(|w| w.stretch + 1).max().unwrap_or(0);
    let estimate = &found.estimate;
    let offsets = (2..2 + stretches).map(|c| (!estimate.hidden[c]).then_some(estimate.values[c]));
    (result, offsets.collect())
}

/// What a residual beyond noise may come from.
const ASK: &str = "Check signs, units and columns of load and encoder; a stiffness that grows with the twist, and hysteresis that is not constant, leave such a residual too.";

/// Says that the twist is no straight line.
fn crooked(robot: &Robot, k: usize, told: &str) -> String {
    format!(
        "The twist of joint \"{}\" does not follow its load as a spring with friction and gap does: {told}.",
        robot.joints[k].name
    )
}

/// Says that the twist follows the load with the wrong sign.
fn opposite_sign(robot: &Robot, k: usize, by: Deflection) -> String {
    let (name, number) = (&robot.joints[k].name, k + 1);
    let cause = match by {
        Deflection::LinkByTorque => format!("tau{number} is negated"),
        _ => "the force is that on the environment instead of that on the robot".to_owned(),
    };
    format!(
        "The twist of joint \"{name}\" follows its load, but with the opposite sign: {cause}, or q{number} (motor) and ql{number} (link) are exchanged. Correct the sign or the columns."
    )
}

/// Adds the range of the load and the points of the figure.
fn finish(result: &mut DriveLoading, windows: &[Window], found: &Fit) {
    let loads: Vec<f64> = (windows.iter())
        .map(|w| w.load - found.friction(0) * w.course.direction)
        .collect();
    let low = loads.iter().copied().fold(f64::INFINITY, f64::min);
    result.load = [low, low + range(loads.iter())];
    for w in windows {
        let side = usize::from(w.course.direction < 0.0);
        let offset = found.estimate.values[2 + w.stretch];
        result.points[side].push([w.load, w.twist - offset]);
    }
}

fn solve(windows: &[Window], search: bool) -> Option<Fit> {
    (windows.len() >= FEWEST)
        .then(|| fit(&rows(windows), 1, search))
        .flatten()
}

/// Says why the stiffness is not shown, and what would show it.
fn missing(robot: &Robot, k: usize, by: Deflection) -> String {
    let name = &robot.joints[k].name;
    let effort = format_significant(robot.torque_limits()[k].unwrap_or(f64::NAN) * 0.5, 2);
    let size = match robot.torque_limits()[k] {
        Some(_) => format!(
            " by about {effort} {}",
            format_unit(robot.joints[k].kind.units().1)
        ),
        None => String::new(),
    };
    match by {
        Deflection::LinkByTorque => format!(
            "The twist of joint \"{name}\" does not follow its torque beyond noise. Move the joint slowly (`rig excite --kind reversals --joint {name}`) where gravity or a spring at the tool changes its torque{size}."
        ),
        Deflection::LinkByWrench | Deflection::Tool => format!(
            "The load hardly turns joint \"{name}\". Change the force at the tool point slowly, to and fro, so that it loads this joint{size}."
        ),
    }
}
