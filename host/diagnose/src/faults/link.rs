//! Faults of a link encoder.

use crate::faults::finding::{Fault, Finding};
use crate::faults::{columns, names};
use rig_data::has_position_jump;
use rig_data::runs::Run;
use rig_model::robot::Robot;
use rig_numerics::statistics::mean_or_zero;

/// Range of link motion per joint encoder motion; backlash and twist take at most a part of a small motion.
const TOGETHER: [f64; 2] = [0.8, 1.25];

/// Returns a fault of joint `k`'s link encoder; the joint's own position is right.
pub(crate) fn fault(robot: &Robot, runs: &[&Run], k: usize) -> Option<Fault> {
    let joint = robot.joints.get(k)?;
    for run in runs {
        let Some(reading) = run.joints.get(k).and_then(|j| j.link_raw.as_ref()) else {
            continue;
        };
        // Its zero is free, so only a jump is a fault.
        if has_position_jump(&run.t, reading) {
            return Some(Fault::of_joint(k, Finding::LinkJumps));
        }
    }
    let factor = moves_by(runs, k)?;
    let [least, most] = TOGETHER;
    if (least..most).contains(&factor) {
        return None;
    }
    let found = if factor.abs() < 1e-4 {
        Finding::LinkStill
    } else if (-most..-least).contains(&factor) {
        Finding::LinkReversed
    } else {
        let name = names::of_position(joint, 1.0 / factor);
        Finding::LinkScaled { factor, name }
    };
    Some(Fault::of_joint(k, found))
}

/// Returns the link encoder's motion per motion of the joint's own; `None` if either is missing or does not move.
fn moves_by(runs: &[&Run], k: usize) -> Option<f64> {
    let (mut along, mut squares) = (0.0, 0.0);
    for run in runs.iter().filter(|run| columns::moves(run, k)) {
        let own = run.joints.get(k)?;
        let Some(reading) = &own.link_raw else {
            continue;
        };
        let (q, link) = (mean_or_zero(&own.q_raw), mean_or_zero(reading));
        for (a, b) in own.q_raw.iter().zip(reading) {
            along += (a - q) * (b - link);
            squares += (a - q).powi(2);
        }
    }
    (squares > 0.0).then(|| along / squares)
}
