//! What recordings lack, in words.

use core::f64::consts::TAU;

use crate::columns::waves::SPANNED;
use crate::experiment::testable::missing::Missing;
use crate::experiment::testable::needs::{STEADY, TURNS, WARMING};
use rig_model::robot::{Joint, JointKind};
use rig_output::format_unit;

/// Returns what is missing for an effect on a joint, a clause.
pub(super) fn why(joint: &Joint, missing: Missing) -> String {
    let (unit, force) = joint.kind.units();
    match missing {
        Missing::Torque => "neither torque nor motor current was recorded".to_owned(),
        Missing::Motion { range } => format!("the joint moves by {:.4} in all", range.max(0.0)),
        Missing::Span { span, shortest } => format!(
            "the joint moves over {span:.3} {unit}; the shortest wave that is looked for is {shortest:.3} {unit} long, and over less than {:.3} {unit} it looks like other friction or a constant",
            SPANNED * shortest
        ),
        Missing::Reversals { found, least } => {
            format!("the joint reverses {found} times, {least} are needed")
        }
        Missing::SlowMotion { speed, slow, fast } => format!(
            "the motion lasts {slow:.1} s in all below {speed:.3} {unit}/s and {fast:.1} s above {:.3} {unit}/s; {STEADY} s of each are needed",
            3.0 * speed
        ),
        Missing::SpeedRange {
            typical,
            highest,
            least,
        } => format!(
            "the highest speed, {highest:.3} {unit}/s, is {:.2} times the typical one, {typical:.3} {unit}/s; {least} times are needed",
            highest / typical.max(f64::MIN_POSITIVE)
        ),
        Missing::Travel { range, least } => format!(
            "the joint moves over {range:.2} rad; over less than {least:.2} rad the effect looks like gravity or a constant"
        ),
        Missing::GearRatio => {
            let known = match joint.kind {
                JointKind::Revolute => "; waves over the joint's own turn alone were looked for",
                JointKind::Prismatic => "",
            };
            format!(
                "no drive with a gear ratio is described, so that the motor's angle is not known{known}"
            )
        }
        Missing::SlowTurns {
            turns,
            speed,
            ratio,
        } => format!(
            "the motor makes {turns:.1} turns below {speed} rad/s (of the joint {:.3} {unit}/s); {TURNS} are needed",
            speed / ratio
        ),
        Missing::LoadRange { range, mean, least } => {
            let force = format_unit(force);
            format!(
                "the transmitted torque varies by {range:.3} {force} about a mean of {mean:.3} {force}; {least:.3} are needed"
            )
        }
        Missing::Duration { longest, least } => {
            format!("the longest recording lasts {longest:.1} s, {least:.0} s are needed")
        }
        Missing::Voltage => "the motor's voltage was not recorded".to_owned(),
        Missing::Temperature => "no temperature was recorded".to_owned(),
        Missing::Warming { rise } => {
            format!("the temperature varies by {rise:.1} K, {WARMING} K are needed")
        }
        Missing::OtherJoint { alone: true } => "the robot has no other joint".to_owned(),
        Missing::OtherJoint { alone: false } => "no other joint moves".to_owned(),
        Missing::Prior => "the description does not state the inertial values of this link and those it carries, so that a change of them cannot be told from their values".to_owned(),
    }
}

/// Returns what to record for an effect on joint `n` (from 1), a clause.
pub(super) fn remedy(joint: &Joint, n: usize, missing: Missing) -> String {
    let unit = joint.kind.units().0;
    let fixed = match missing {
        Missing::Torque => {
            return format!("record tau{n}, or i{n} with the torque constant in the description");
        }
        Missing::Span { shortest, .. } => {
            return format!(
                "a motion over {:.3} {unit} or more, as far as the limits allow",
                SPANNED * shortest
            );
        }
        Missing::SlowMotion { speed, .. } => {
            return format!(
                "constant speeds from {:.4} {unit}/s on, both ways: `rig excite --kind sweep`",
                0.1 * speed
            );
        }
        Missing::Travel { least, .. } => {
            return format!("a motion over {least:.2} rad or more, as far as the limits allow");
        }
        Missing::SlowTurns { speed, ratio, .. } => {
            return format!(
                "constant speed of {:.3} {unit}/s over {:.3} of travel, both ways",
                0.5 * (speed / ratio),
                TURNS * TAU / ratio
            );
        }
        Missing::Duration { least, .. } => {
            return format!("one motion repeated from cold for {least:.0} s or more");
        }
        Missing::Voltage => return format!("record u{n}, or duty{n} with supply"),
        Missing::Temperature => return format!("record temp{n} from cold to warm"),
        Missing::Motion { .. } => "record a motion of this joint",
        Missing::Reversals { .. } => "slow reversals: `rig excite --kind reversals`",
        Missing::SpeedRange { .. } => "speeds from slow to the limit: `rig excite --kind sweep`",
        Missing::GearRatio if joint.kind == JointKind::Revolute => {
            "give [joint.drive] with gear_ratio"
        }
        Missing::GearRatio => {
            "give [joint.drive] with gear_ratio, for a screw 2π over its lead in m"
        }
        Missing::LoadRange { .. } => {
            "the same motion with and without a payload, or over poses with and without gravity"
        }
        Missing::Warming { .. } => "one motion repeated from cold until it is warm",
        Missing::OtherJoint { .. } => {
            "a motion of the other joints while this one stands, then of both"
        }
        Missing::Prior => {
            "identify the robot without the change first (`rig identify`), and diagnose with what it writes"
        }
    };
    fixed.to_owned()
}
