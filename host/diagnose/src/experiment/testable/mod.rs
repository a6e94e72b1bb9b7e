//! Effects that recordings cannot show, with the missing data and the remedy.
//!
//! Leaves out: whether the effect is large enough; see the detectable sizes.

mod evidence;

#[cfg(test)]
mod tests;

use core::f64::consts::TAU;

use rig_shared::effects::{Channel, Confusion, Kind, Need};

use crate::columns::waves;
use crate::outcome::NotTestable;
use crate::recordings::external_load;
use rig_data::runs::Run;
use rig_model::robot::{Joint, JointKind, Robot};
use rig_output::format_unit;

use evidence::Evidence;

/// Least time in slow and in fast motion for a law of the speed, s.
const STEADY: f64 = 0.5;
/// Motor turns that show a period.
const TURNS: f64 = 2.0;
/// Temperature rise that changes friction by more than the noise, K.
const WARMING: f64 = 3.0;
/// Speed limit of the revolute joints for which the registry's speeds are given, rad/s. Prismatic joints use the same
/// share of their fastest motion.
const USUAL: f64 = 5.0;

/// Returns the reason why `runs` cannot show the effect on a joint (index from 0); `None` if they can.
pub fn not_testable(kind: Kind, robot: &Robot, joint: usize, runs: &[Run]) -> Option<NotTestable> {
    let about = kind.about();
    let own = robot.joints.get(joint)?;
    let evidence = Evidence::of(runs, joint);
    let found = |why: String, experiment: String| NotTestable {
        effect: about.name.to_owned(),
        joint: own.name.clone(),
        why,
        experiment,
    };
    if !evidence.torque && about.channel != Channel::Voltage {
        return Some(found(
            "neither torque nor motor current was recorded".to_owned(),
            format!(
                "record tau{0}, or i{0} with the torque constant in the description",
                joint + 1
            ),
        ));
    }
    if !evidence.moves() {
        return Some(found(
            format!(
                "the joint moves by {:.4} in all",
                (evidence.range[1] - evidence.range[0]).max(0.0)
            ),
            "record a motion of this joint".to_owned(),
        ));
    }
    (about.needs.iter())
        .find_map(|need| lacking(*need, robot, joint, runs, &evidence))
        .or_else(|| unspanned(kind, own, evidence.range[1] - evidence.range[0]))
        .map(|(why, experiment)| found(why, experiment))
}

/// Returns the missing range and the remedy for a wave along the position.
fn unspanned(kind: Kind, joint: &Joint, span: f64) -> Option<(String, String)> {
    let shortest = waves::none_shown(kind, joint, span)?;
    let unit = joint.kind.units().0;
    let least = waves::SPANNED * shortest;
    Some((
        format!(
            "the joint moves over {span:.3} {unit}; the shortest wave that is looked for is {shortest:.3} {unit} long, and over less than {least:.3} {unit} it looks like other friction or a constant"
        ),
        format!("a motion over {least:.3} {unit} or more, as far as the limits allow"),
    ))
}

/// Returns the effects that are collinear with this one in torque and motion, and the remedies. Pairs that these runs
/// resolve by a voltage or by a run without external loads are left out.
pub fn confounded(kind: Kind, joint: usize, runs: &[Run]) -> Vec<&'static Confusion> {
    let voltage = !runs.is_empty()
        && runs
            .iter()
            .all(|run| run.joints.get(joint).is_some_and(|j| j.voltage.is_some()));
    let outside = |name: &str| Kind::named(name, None).is_some_and(Kind::is_external);
    let by_pull =
        |with: &str| external_load::told_apart(runs) && kind.is_external() != outside(with);
    (kind.about().confused.iter())
        .filter(|c| c.exact && !by_pull(c.with))
        .filter(|c| !(voltage && c.separated_by.contains("voltage")))
        .collect()
}

/// Returns the missing data for one need, and the remedy.
fn lacking(
    need: Need,
    robot: &Robot,
    joint: usize,
    runs: &[Run],
    evidence: &Evidence,
) -> Option<(String, String)> {
    let own = &robot.joints[joint];
    let revolute = own.kind == JointKind::Revolute;
    let unit = if revolute { "rad/s" } else { "m/s" };
    let force = format_unit(own.kind.units().1);
    match need {
        Need::Reversals(least) => (evidence.reversals < least).then(|| {
            (
                format!(
                    "the joint reverses {} times, {least} are needed",
                    evidence.reversals
                ),
                "slow reversals: `rig excite --kind reversals`".to_owned(),
            )
        }),
        Need::SlowMotion(speed) => {
            let speed = if revolute {
                speed
            } else {
                speed / USUAL * evidence.speeds()[1]
            };
            let (slow, fast) = (evidence.slow(speed), evidence.fast(3.0 * speed));
            (slow < STEADY || fast < STEADY).then(|| {
                (
                    format!(
                        "the motion lasts {slow:.1} s in all below {speed:.3} {unit} and {fast:.1} s above {:.3} {unit}; {STEADY} s of each are needed",
                        3.0 * speed
                    ),
                    format!("constant speeds from {:.4} {unit} on, both ways: `rig excite --kind sweep`", 0.1 * speed),
                )
            })
        }
        Need::SpeedRange(least) => {
            let [typical, highest] = evidence.speeds();
            (highest < least * typical).then(|| {
                (
                    format!("the highest speed, {highest:.3} {unit}, is {:.2} times the typical one, {typical:.3} {unit}; {least} times are needed", highest / typical.max(f64::MIN_POSITIVE)),
                    "speeds from slow to the limit: `rig excite --kind sweep`".to_owned(),
                )
            })
        }
        // A prismatic joint has no turns; its range is fixed.
        Need::Travel(_) if !revolute => None,
        Need::Travel(turns) => {
            let range = evidence.range[1] - evidence.range[0];
            (range < turns * TAU).then(|| {
                (
                    format!("the joint moves over {range:.2} rad; over less than {:.2} rad the effect looks like gravity or a constant", turns * TAU),
                    format!("a motion over {:.2} rad or more, as far as the limits allow", turns * TAU),
                )
            })
        }
        Need::SlowTurns(speed) => {
            let ratio = own
                .drive
                .as_ref()
                .map(|d| d.gear_ratio.abs())
                .filter(|r| *r > 0.0);
            let Some(ratio) = ratio else {
                return Some((
                    if revolute {
                        "no drive with a gear ratio is described, so that the motor's angle is not known; waves over the joint's own turn alone were looked for"
                    } else {
                        "no drive with a gear ratio is described, so that the motor's angle is not known"
                    }
                    .to_owned(),
                    if revolute {
                        "give [joint.drive] with gear_ratio"
                    } else {
                        "give [joint.drive] with gear_ratio, for a screw 2π over its lead in m"
                    }
                    .to_owned(),
                ));
            };
            let slow = speed / ratio;
            let turns = ratio * evidence.slow_way(slow) / TAU;
            (turns < TURNS).then(|| {
                (
                    format!("the motor makes {turns:.1} turns below {speed} rad/s (of the joint {slow:.3} {unit}); {TURNS} are needed"),
                    format!("constant speed of {:.3} {unit} over {:.3} of travel, both ways", 0.5 * slow, TURNS * TAU / ratio),
                )
            })
        }
        Need::LoadRange(least) => {
            let [range, mean] = evidence.loads();
            (range < least * mean).then(|| {
                (
                    format!("the transmitted torque varies by {range:.3} {force} about a mean of {mean:.3} {force}; {:.3} are needed", least * mean),
                    "the same motion with and without a payload, or over poses with and without gravity".to_owned(),
                )
            })
        }
        Need::Duration(least) => (evidence.duration < least).then(|| {
            (
                format!(
                    "the longest recording lasts {:.1} s, {least:.0} s are needed",
                    evidence.duration
                ),
                format!("one motion repeated from cold for {least:.0} s or more"),
            )
        }),
        Need::Voltage => (!evidence.voltage).then(|| {
            (
                "the motor's voltage was not recorded".to_owned(),
                format!("record u{0}, or duty{0} with supply", joint + 1),
            )
        }),
        Need::Temperature => match evidence.warming {
            None => Some((
                "no temperature was recorded".to_owned(),
                format!("record temp{} from cold to warm", joint + 1),
            )),
            Some(rise) if rise < WARMING => Some((
                format!("the temperature varies by {rise:.1} K, {WARMING} K are needed"),
                "one motion repeated from cold until it is warm".to_owned(),
            )),
            Some(_) => None,
        },
        Need::OtherJoint => {
            let moves = |j: &usize| *j != joint && Evidence::of(runs, *j).moves();
            (!(0..robot.joints.len()).any(|j| moves(&j))).then(|| {
                (
                    if robot.joints.len() == 1 {
                        "the robot has no other joint".to_owned()
                    } else {
                        "no other joint moves".to_owned()
                    },
                    "a motion of the other joints while this one stands, then of both".to_owned(),
                )
            })
        }
        Need::Prior => {
            let stated = robot.joints[joint..]
                .iter()
                .all(|j| j.inertial.as_ref().is_some_and(|i| i.mass > 0.0));
            (!stated).then(|| {
                (
                    "the description does not state the inertial values of this link and those it carries, so that a change of them cannot be told from their values".to_owned(),
                    "identify the robot without the change first (`rig identify`), and diagnose with what it writes".to_owned(),
                )
            })
        }
    }
}
