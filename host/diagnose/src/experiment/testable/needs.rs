//! Needs of effects that recordings do not meet.

use core::f64::consts::TAU;

use rig_shared::effects::{Channel, Kind, Need};

use crate::columns::waves;
use crate::experiment::testable::evidence::Evidence;
use crate::outcome::NotTestable;
use rig_data::runs::Run;
use rig_model::robot::{Joint, JointKind, Robot};
use rig_output::format_unit;

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
    let found = |missing: Missing| NotTestable {
        effect: about.name.to_owned(),
        joint: own.name.clone(),
        why: missing.why,
        experiment: missing.experiment,
    };
    if !evidence.torque && about.channel != Channel::Voltage {
        return Some(found(Missing {
            why: "neither torque nor motor current was recorded".to_owned(),
            experiment: format!(
                "record tau{0}, or i{0} with the torque constant in the description",
                joint + 1
            ),
        }));
    }
    if !evidence.moves() {
        return Some(found(Missing {
            why: format!(
                "the joint moves by {:.4} in all",
                (evidence.range[1] - evidence.range[0]).max(0.0)
            ),
            experiment: "record a motion of this joint".to_owned(),
        }));
    }
    let needed = Needed {
        robot,
        joint,
        runs,
        evidence: &evidence,
    };
    (about.needs.iter())
        .find_map(|need| needed.lacking(*need))
        .or_else(|| unspanned(kind, own, evidence.range[1] - evidence.range[0]))
        .map(found)
}

/// Returns the missing range and the remedy for a wave along the position.
fn unspanned(kind: Kind, joint: &Joint, span: f64) -> Option<Missing> {
    let shortest = waves::none_shown(kind, joint, span)?;
    let unit = joint.kind.units().0;
    let least = waves::SPANNED * shortest;
    Some(Missing {
        why: format!(
            "the joint moves over {span:.3} {unit}; the shortest wave that is looked for is {shortest:.3} {unit} long, and over less than {least:.3} {unit} it looks like other friction or a constant"
        ),
        experiment: format!("a motion over {least:.3} {unit} or more, as far as the limits allow"),
    })
}

/// Data that recordings lack, and the remedy.
struct Missing {
    /// A clause.
    why: String,
    /// What to record, a clause.
    experiment: String,
}

/// Recordings of one joint, to compare with the needs of effects.
struct Needed<'a> {
    robot: &'a Robot,
    /// From 0.
    joint: usize,
    runs: &'a [Run],
    evidence: &'a Evidence,
}

impl Needed<'_> {
    /// Returns what is missing for one need.
    fn lacking(&self, need: Need) -> Option<Missing> {
        match need {
            Need::Reversals(least) => self.reversals(least),
            Need::SlowMotion(speed) => self.slow_motion(speed),
            Need::SpeedRange(least) => self.speed_range(least),
            // A prismatic joint has no turns; its range is fixed.
            Need::Travel(_) if !self.is_revolute() => None,
            Need::Travel(turns) => self.travel(turns),
            Need::SlowTurns(speed) => self.slow_turns(speed),
            Need::LoadRange(least) => self.load_range(least),
            Need::Duration(least) => self.duration(least),
            Need::Voltage => self.voltage(),
            Need::Temperature => self.temperature(),
            Need::OtherJoint => self.other_joint(),
            Need::Prior => self.prior(),
        }
    }

    fn is_revolute(&self) -> bool {
        self.robot.joints[self.joint].kind == JointKind::Revolute
    }

    /// Returns the unit of the joint's speed.
    fn speed_unit(&self) -> &'static str {
        if self.is_revolute() { "rad/s" } else { "m/s" }
    }

    fn reversals(&self, least: u32) -> Option<Missing> {
        let found = self.evidence.reversals;
        (found < least).then(|| Missing {
            why: format!("the joint reverses {found} times, {least} are needed"),
            experiment: "slow reversals: `rig excite --kind reversals`".to_owned(),
        })
    }

    fn slow_motion(&self, speed: f64) -> Option<Missing> {
        let (evidence, unit) = (self.evidence, self.speed_unit());
        let speed = if self.is_revolute() {
            speed
        } else {
            speed / USUAL * evidence.speeds()[1]
        };
        let (slow, fast) = (evidence.slow(speed), evidence.fast(3.0 * speed));
        (slow < STEADY || fast < STEADY).then(|| Missing {
            why: format!(
                "the motion lasts {slow:.1} s in all below {speed:.3} {unit} and {fast:.1} s above {:.3} {unit}; {STEADY} s of each are needed",
                3.0 * speed
            ),
            experiment: format!("constant speeds from {:.4} {unit} on, both ways: `rig excite --kind sweep`", 0.1 * speed),
        })
    }

    fn speed_range(&self, least: f64) -> Option<Missing> {
        let unit = self.speed_unit();
        let [typical, highest] = self.evidence.speeds();
        (highest < least * typical).then(|| Missing {
            why: format!("the highest speed, {highest:.3} {unit}, is {:.2} times the typical one, {typical:.3} {unit}; {least} times are needed", highest / typical.max(f64::MIN_POSITIVE)),
            experiment: "speeds from slow to the limit: `rig excite --kind sweep`".to_owned(),
        })
    }

    fn travel(&self, turns: f64) -> Option<Missing> {
        let range = self.evidence.range[1] - self.evidence.range[0];
        (range < turns * TAU).then(|| Missing {
            why: format!("the joint moves over {range:.2} rad; over less than {:.2} rad the effect looks like gravity or a constant", turns * TAU),
            experiment: format!("a motion over {:.2} rad or more, as far as the limits allow", turns * TAU),
        })
    }

    fn slow_turns(&self, speed: f64) -> Option<Missing> {
        let unit = self.speed_unit();
        let drive = self.robot.joints[self.joint].drive.as_ref();
        let ratio = drive.map(|d| d.gear_ratio.abs()).filter(|r| *r > 0.0);
        let Some(ratio) = ratio else {
            return Some(self.gear_ratio());
        };
        let slow = speed / ratio;
        let turns = ratio * self.evidence.slow_way(slow) / TAU;
        (turns < TURNS).then(|| Missing {
            why: format!("the motor makes {turns:.1} turns below {speed} rad/s (of the joint {slow:.3} {unit}); {TURNS} are needed"),
            experiment: format!("constant speed of {:.3} {unit} over {:.3} of travel, both ways", 0.5 * slow, TURNS * TAU / ratio),
        })
    }

    /// Describes a missing gear ratio.
    fn gear_ratio(&self) -> Missing {
        let (why, experiment) = if self.is_revolute() {
            (
                "no drive with a gear ratio is described, so that the motor's angle is not known; waves over the joint's own turn alone were looked for",
                "give [joint.drive] with gear_ratio",
            )
        } else {
            (
                "no drive with a gear ratio is described, so that the motor's angle is not known",
                "give [joint.drive] with gear_ratio, for a screw 2π over its lead in m",
            )
        };
        Missing {
            why: why.to_owned(),
            experiment: experiment.to_owned(),
        }
    }

    fn load_range(&self, least: f64) -> Option<Missing> {
        let force = format_unit(self.robot.joints[self.joint].kind.units().1);
        let [range, mean] = self.evidence.loads();
        (range < least * mean).then(|| Missing {
            why: format!("the transmitted torque varies by {range:.3} {force} about a mean of {mean:.3} {force}; {:.3} are needed", least * mean),
            experiment: "the same motion with and without a payload, or over poses with and without gravity".to_owned(),
        })
    }

    fn duration(&self, least: f64) -> Option<Missing> {
        let longest = self.evidence.duration;
        (longest < least).then(|| Missing {
            why: format!("the longest recording lasts {longest:.1} s, {least:.0} s are needed"),
            experiment: format!("one motion repeated from cold for {least:.0} s or more"),
        })
    }

    fn voltage(&self) -> Option<Missing> {
        (!self.evidence.voltage).then(|| Missing {
            why: "the motor's voltage was not recorded".to_owned(),
            experiment: format!("record u{0}, or duty{0} with supply", self.joint + 1),
        })
    }

    fn temperature(&self) -> Option<Missing> {
        match self.evidence.warming {
            None => Some(Missing {
                why: "no temperature was recorded".to_owned(),
                experiment: format!("record temp{} from cold to warm", self.joint + 1),
            }),
            Some(rise) if rise < WARMING => Some(Missing {
                why: format!("the temperature varies by {rise:.1} K, {WARMING} K are needed"),
                experiment: "one motion repeated from cold until it is warm".to_owned(),
            }),
            Some(_) => None,
        }
    }

    fn other_joint(&self) -> Option<Missing> {
        let count = self.robot.joints.len();
        let moves = |j: usize| j != self.joint && Evidence::of(self.runs, j).moves();
        (!(0..count).any(moves)).then(|| Missing {
            why: if count == 1 {
                "the robot has no other joint".to_owned()
            } else {
                "no other joint moves".to_owned()
            },
            experiment: "a motion of the other joints while this one stands, then of both"
                .to_owned(),
        })
    }

    fn prior(&self) -> Option<Missing> {
        let mut carried = self.robot.joints[self.joint..].iter();
        let stated = carried.all(|j| j.inertial.as_ref().is_some_and(|i| i.mass > 0.0));
        (!stated).then(|| Missing {
            why: "the description does not state the inertial values of this link and those it carries, so that a change of them cannot be told from their values".to_owned(),
            experiment: "identify the robot without the change first (`rig identify`), and diagnose with what it writes".to_owned(),
        })
    }
}
