//! Waves along a joint's position that a motion shows.
//!
//! Over less than its length a wave looks like a parabola, or less. It is then nearly collinear with offset and Coulomb
//! friction, and all three are far from their true values. Position-dependent friction of a revolute joint is exempt:
//! it repeats with the turn by its nature, and changes its sign with the direction.

use core::f64::consts::TAU;

use rig_shared::effects::{Kind, Periodic, SHAPES};

use crate::search::shapes::grid;
use rig_data::runs::Run;
use rig_model::robot::{Joint, JointKind};

/// Wave lengths that a motion must span before the wave is tried: one to identify it, the rest to see it repeat.
pub(crate) const SPANNED: f64 = 1.5;

/// Returns the position range of a joint, rad or m.
pub(crate) fn span(runs: &[Run], joint: usize) -> f64 {
    let all = || {
        (runs.iter())
            .filter_map(|run| run.joints.get(joint))
            .flat_map(|j| j.q.iter().copied())
    };
    let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| {
        (low.min(q), high.max(q))
    });
    (high - low).max(0.0)
}

/// Returns true if an effect repeats with the motor's angle.
pub(crate) fn is_of_the_motor(kind: Kind) -> bool {
    matches!(
        kind.periodic(),
        Some(Periodic::Motor | Periodic::MotorTimesDrive)
    )
}

/// Returns true if the motor's angle is known. A revolute joint without a described ratio counts as driven directly.
pub(crate) fn motor_is_known(joint: &Joint) -> bool {
    ratio_is_described(joint) || joint.kind == JointKind::Revolute
}

/// Returns true if the description has a gear ratio; else a revolute joint's angle stands for its motor's.
pub(crate) fn ratio_is_described(joint: &Joint) -> bool {
    (joint.drive.as_ref()).is_some_and(|drive| drive.gear_ratio != 0.0)
}

/// Returns the wave length of an effect on a joint, rad or m; `None` if it is no wave.
fn length(kind: Kind, joint: &Joint, order: f64) -> Option<f64> {
    let ratio = if is_of_the_motor(kind) {
        joint.gear_ratio().abs()
    } else if kind == Kind::PositionFriction && joint.kind == JointKind::Prismatic {
        1.0
    } else {
        return None;
    };
    Some(TAU / (ratio * order))
}

/// Returns true if a motion over `span` shows an effect with these shapes, or if it is no wave.
pub(crate) fn shown(kind: Kind, joint: &Joint, shapes: &[f64; SHAPES], span: f64) -> bool {
    length(kind, joint, shapes[0]).is_none_or(|length| span >= SPANNED * length)
        && (motor_is_known(joint) || !is_of_the_motor(kind))
}

/// Returns the length of the shortest tried wave if a motion over `span` shows none of them.
pub(crate) fn none_shown(kind: Kind, joint: &Joint, span: f64) -> Option<f64> {
    let points = grid(kind);
    let lengths = (points.iter()).filter_map(|shapes| length(kind, joint, shapes[0]));
    let shortest = lengths.fold(f64::INFINITY, f64::min);
    (shortest.is_finite() && span < SPANNED * shortest).then_some(shortest)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use rig_model::robot::{EMPS, ONE_LINK_TEMPLATE, Robot};

    fn joint(text: &str) -> Joint {
        let robot = Robot::from_toml(text, "robot.toml".as_ref()).unwrap();
        robot.joints[0].clone()
    }

    fn order(order: f64) -> [f64; SHAPES] {
        [order, 0.0, 0.0, 0.0]
    }

    const OF_THE_MOTOR: [Kind; 4] = [
        Kind::Cogging,
        Kind::TorqueRipple,
        Kind::GearEccentricity,
        Kind::EncoderEccentricityMotor,
    ];

    #[test]
    fn a_slide_without_a_drive_has_no_motor_angle() {
        let mut slide = joint(EMPS);
        for kind in OF_THE_MOTOR {
            assert!(!shown(kind, &slide, &order(84.0), 100.0), "{kind:?}");
        }
        // A screw with a lead of 20 mm: 12 turns over the axis.
        slide.drive = joint(ONE_LINK_TEMPLATE)
            .drive
            .map(|drive| rig_model::robot::Drive {
                gear_ratio: TAU / 0.02,
                ..drive
            });
        for kind in OF_THE_MOTOR {
            assert!(shown(kind, &slide, &order(1.0), 0.25), "{kind:?}");
            assert!(!shown(kind, &slide, &order(1.0), 0.025), "{kind:?}");
            assert!(shown(kind, &slide, &order(2.0), 0.025), "{kind:?}");
        }
    }

    #[test]
    fn friction_along_a_slide_is_no_wave_longer_than_the_way() {
        let slide = joint(EMPS);
        let kind = Kind::PositionFriction;
        assert!(!shown(kind, &slide, &order(4.0), 0.25));
        assert_eq!(none_shown(kind, &slide, 0.25), Some(TAU / 4.0));
        assert!(shown(kind, &slide, &order(4.0), 3.0));
        // On a revolute joint part of a turn is enough.
        assert!(shown(kind, &joint(ONE_LINK_TEMPLATE), &order(1.0), 3.0));
        assert_eq!(none_shown(kind, &joint(ONE_LINK_TEMPLATE), 3.0), None);
    }

    #[test]
    fn a_geared_link_shows_a_turn_of_its_motor_and_a_direct_drive_only_as_much_as_it_turns() {
        let mut link = joint(ONE_LINK_TEMPLATE);
        let kind = Kind::GearEccentricity;
        assert!(shown(kind, &link, &order(1.0), 0.5));
        link.drive = None;
        assert!(!shown(kind, &link, &order(1.0), 3.4));
        assert!(!shown(kind, &link, &order(1.0), TAU));
        assert!(shown(kind, &link, &order(2.0), 5.0));
        // An effect that is no wave needs no span.
        assert!(shown(Kind::Stribeck, &link, &order(0.01), 0.0));
    }
}
