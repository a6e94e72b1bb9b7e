//! Fits the optimiser's result into the limits, with a proof.

use rig_shared::multibody::{Chain, point_position};

use super::ExciteError;
use super::certificate::{Reach, Reached, reach};
use super::frame::Frame;
use super::interval::Interval;
use super::schedule::JointMotion;
use rig_model::simulate::SimulateError;

/// Relative margin to every limit, so that a trajectory rounded to single precision still fits.
const ROUNDING: f64 = 1e-6;
/// Largest number of attempts to shrink a motion until the proof succeeds; each removes at least 0.1 %.
const SHRINKS: usize = 100;

/// The joint and the limit at fault.
pub(super) type Blame = (usize, &'static str);

/// A motion and its proved bounds, or the joint and limit at fault.
pub(super) type Fitted = Result<(Vec<JointMotion>, Reached), Blame>;

fn share(value: f64, limit: f64) -> f64 {
    if value > 0.0 {
        limit / value
    } else {
        f64::INFINITY
    }
}

/// Returns the joint and limit with the largest violation, and the factor that would repair it if it were proportional
/// to the amplitude; none without a violation.
fn worst(
    frame: &Frame,
    reached: &Reached,
    motions: &[JointMotion],
) -> Result<Option<(f64, Blame)>, ExciteError> {
    let mut rooms: Vec<(f64, Blame)> = Vec::new();
    for (j, (reach, b)) in reached.joints.iter().zip(&frame.bounds).enumerate() {
        let base = motions[j].base;
        let Reach {
            position: [low, high],
            velocity,
            acceleration,
            torque,
        } = *reach;
        let free = f64::INFINITY;
        rooms.extend([
            (share(high - base, b.high - base), (j, "position")),
            (share(base - low, base - b.low), (j, "position")),
            (share(velocity, b.velocity), (j, "velocity")),
            (
                b.acceleration.map_or(free, |a| share(acceleration, a)),
                (j, "acceleration"),
            ),
            (
                torque
                    .zip(b.torque)
                    .map_or(free, |(t, limit)| share(t, limit)),
                (j, "torque"),
            ),
        ]);
    }
    let base: Vec<f64> = motions.iter().map(|m| m.base).collect();
    for (limit, [low, high]) in frame.combined.iter().zip(&reached.combined) {
        let start = limit.at(base.iter().copied());
        rooms.extend([
            (
                share(high - start, limit.high - start),
                (limit.joint, "crank"),
            ),
            (
                share(start - low, start - limit.low),
                (limit.joint, "crank"),
            ),
        ]);
    }
    rooms.extend(of_motors(frame, reached, &base)?);
    let mut unused = vec![[0.0; 3]; base.len()];
    for (plane, lowest) in frame.planes.iter().zip(&reached.heights) {
        let at = point_position(&frame.plain, &base, plane.link, plane.point, &mut unused)?;
        let start = plane.height(at);
        rooms.push((
            share(start - lowest, start - plane.least),
            (plane.link, "workspace"),
        ));
    }
    Ok(rooms
        .into_iter()
        .map(|(factor, blame)| (factor * (1.0 - ROUNDING), blame))
        // NaN counts as outside.
        .filter(|(factor, _)| !(*factor >= 1.0))
        .min_by(|(a, _), (b, _)| a.total_cmp(b)))
}

/// Returns the rooms of the motors' limits about the start.
fn of_motors(
    frame: &Frame,
    reached: &Reached,
    start: &[f64],
) -> Result<Vec<(f64, Blame)>, ExciteError> {
    let Some(drives) = &frame.drives else {
        return Ok(Vec::new());
    };
    let mut angles = vec![0.0; start.len()];
    drives
        .plain
        .motor_position(start, &mut angles)
        .map_err(SimulateError::from)?;
    let mut rooms = Vec::new();
    for (j, (reach, limit)) in reached.motors.iter().zip(&drives.limits).enumerate() {
        let [low, high] = limit.range;
        let at = angles[j];
        // An unlimited torque may be unbounded.
        if let Some(torque) = reach.torque.filter(|_| limit.torque.is_finite()) {
            rooms.push((share(torque, limit.torque), (j, "motor torque")));
        }
        rooms.extend([
            (share(reach.position[1] - at, high - at), (j, "motor angle")),
            (share(at - reach.position[0], at - low), (j, "motor angle")),
            (share(reach.velocity, limit.velocity), (j, "motor speed")),
        ]);
    }
    Ok(rooms)
}

/// Scales a motion down about its start until the proof succeeds; returns joint and limit at fault if it fails.
pub(super) fn fit_within(
    frame: &Frame,
    enclosing: &Chain<Interval>,
    mut motions: Vec<JointMotion>,
) -> Result<Fitted, ExciteError> {
    let mut blame = (0, "position");
    for _ in 0..SHRINKS {
        let reached = reach(frame, &motions, enclosing)?;
        let Some((factor, at_fault)) = worst(frame, &reached, &motions)? else {
            return Ok(Ok((motions, reached)));
        };
        blame = at_fault;
        if !factor.is_finite() {
            break;
        }
        // Torque is not proportional to the amplitude, so at most 5 % at once.
        let factor = factor.clamp(0.95, 0.999);
        for motion in &mut motions {
            for c in &mut motion.coefficients {
                *c *= factor;
            }
        }
    }
    Ok(Err(blame))
}
