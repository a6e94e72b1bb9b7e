//! Faults of a link encoder.

use crate::faults::{columns, names};
use crate::outcome::{About, DataFault, FaultKind};
use rig_data::has_position_jump;
use rig_data::runs::Run;
use rig_model::robot::{JointKind, Robot};
use rig_numerics::statistics::mean_or_zero;

/// Range of link motion per joint encoder motion; backlash and twist take at most a part of a small motion.
const TOGETHER: [f64; 2] = [0.8, 1.25];

/// Returns a fault of joint `k`'s link encoder; the joint's own position is right.
pub(crate) fn fault(robot: &Robot, runs: &[&Run], k: usize) -> Option<DataFault> {
    let joint = robot.joints.get(k)?;
    let n = k + 1;
    let named = |kind: FaultKind, text: String| {
        Some(columns::fault(runs, kind, About::Motion, &joint.name, text))
    };
    for run in runs {
        let Some(reading) = run.joints.get(k).and_then(|j| j.link_raw.as_ref()) else {
            continue;
        };
        // Its zero is free, so only a jump is a fault.
        if has_position_jump(&run.t, reading) {
            return named(
                FaultKind::Jump,
                format!(
                    "ql{n} jumps from one row to the next, as where counts are lost or an angle begins again after a turn; give it unwrapped."
                ),
            );
        }
    }
    let factor = moves_by(runs, k)?;
    let [least, most] = TOGETHER;
    if (least..most).contains(&factor) {
        return None;
    }
    if factor.abs() < 1e-4 {
        return named(
            FaultKind::NotMoving,
            format!(
                "ql{n} stands still while q{n} moves; check that the encoder on the link is alive."
            ),
        );
    }
    let unit = match joint.kind {
        JointKind::Revolute => "rad",
        JointKind::Prismatic => "m",
    };
    if (-most..-least).contains(&factor) {
        return named(
            FaultKind::Sign,
            format!("ql{n} moves against q{n}; reverse its sense."),
        );
    }
    let (kind, what) = names::of_position(joint, 1.0 / factor).map_or_else(
        || {
            let unnamed = format!("give it in {unit} of the joint, and check its counts");
            (FaultKind::Unit, unnamed)
        },
        |name| (name.kind(), name.text),
    );
    named(
        kind,
        format!("ql{n} moves {factor:.4} times as far as q{n}; {what}."),
    )
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
