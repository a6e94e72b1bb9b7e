//! Needs of effects that recordings do not meet.

use core::f64::consts::TAU;

use rig_shared::effects::{Channel, Kind, Need};

use crate::columns::waves;
use crate::experiment::testable::evidence::Evidence;
use crate::experiment::testable::missing::Missing;
use rig_data::runs::Run;
use rig_model::robot::{Joint, JointKind, Robot};

/// Least time in slow and in fast motion for a law of the speed, s.
pub(crate) const STEADY: f64 = 0.5;
/// Motor turns that show a period.
pub(crate) const TURNS: f64 = 2.0;
/// Temperature rise that changes friction by more than the noise, K.
pub(crate) const WARMING: f64 = 3.0;
/// Speed limit of the revolute joints for which the registry's speeds are given, rad/s. Prismatic joints use the same
/// share of their fastest motion.
const USUAL: f64 = 5.0;

/// Returns what `runs` lack to show the effect on a joint (from 0); `None` if they can.
pub(crate) fn missing(kind: Kind, robot: &Robot, joint: usize, runs: &[Run]) -> Option<Missing> {
    let about = kind.about();
    let own = robot.joints.get(joint)?;
    let evidence = Evidence::of(runs, joint);
    if !evidence.torque && about.channel != Channel::Voltage {
        return Some(Missing::Torque);
    }
    let range = evidence.range[1] - evidence.range[0];
    if !evidence.moves() {
        return Some(Missing::Motion { range });
    }
    let needed = Needed {
        robot,
        joint,
        runs,
        evidence: &evidence,
    };
    (about.needs.iter())
        .find_map(|need| needed.lacking(*need))
        .or_else(|| unspanned(kind, own, range))
}

/// Returns the missing range for a wave along the position.
fn unspanned(kind: Kind, joint: &Joint, span: f64) -> Option<Missing> {
    let shortest = waves::none_shown(kind, joint, span)?;
    Some(Missing::Span { span, shortest })
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
            Need::Voltage => (!self.evidence.voltage).then_some(Missing::Voltage),
            Need::Temperature => self.temperature(),
            Need::OtherJoint => self.other_joint(),
            Need::Prior => self.prior(),
        }
    }

    fn is_revolute(&self) -> bool {
        self.robot.joints[self.joint].kind == JointKind::Revolute
    }

    fn reversals(&self, least: u32) -> Option<Missing> {
        let found = self.evidence.reversals;
        (found < least).then_some(Missing::Reversals { found, least })
    }

    fn slow_motion(&self, speed: f64) -> Option<Missing> {
        let evidence = self.evidence;
        let speed = if self.is_revolute() {
            speed
        } else {
            speed / USUAL * evidence.speeds()[1]
        };
        let (slow, fast) = (evidence.slow(speed), evidence.fast(3.0 * speed));
        (slow < STEADY || fast < STEADY).then_some(Missing::SlowMotion { speed, slow, fast })
    }

    fn speed_range(&self, least: f64) -> Option<Missing> {
        let [typical, highest] = self.evidence.speeds();
        (highest < least * typical).then_some(Missing::SpeedRange {
            typical,
            highest,
            least,
        })
    }

    fn travel(&self, turns: f64) -> Option<Missing> {
        let range = self.evidence.range[1] - self.evidence.range[0];
        let least = turns * TAU;
        (range < least).then_some(Missing::Travel { range, least })
    }

    fn slow_turns(&self, speed: f64) -> Option<Missing> {
        let drive = self.robot.joints[self.joint].drive.as_ref();
        let ratio = drive.map(|d| d.gear_ratio.abs()).filter(|r| *r > 0.0);
        let Some(ratio) = ratio else {
            return Some(Missing::GearRatio);
        };
        let turns = ratio * self.evidence.slow_way(speed / ratio) / TAU;
        (turns < TURNS).then_some(Missing::SlowTurns {
            turns,
            speed,
            ratio,
        })
    }

    fn load_range(&self, least: f64) -> Option<Missing> {
        let [range, mean] = self.evidence.loads();
        let least = least * mean;
        (range < least).then_some(Missing::LoadRange { range, mean, least })
    }

    fn duration(&self, least: f64) -> Option<Missing> {
        let longest = self.evidence.duration;
        (longest < least).then_some(Missing::Duration { longest, least })
    }

    fn temperature(&self) -> Option<Missing> {
        match self.evidence.warming {
            None => Some(Missing::Temperature),
            Some(rise) if rise < WARMING => Some(Missing::Warming { rise }),
            Some(_) => None,
        }
    }

    fn other_joint(&self) -> Option<Missing> {
        let count = self.robot.joints.len();
        let moves = |j: usize| j != self.joint && Evidence::of(self.runs, j).moves();
        (!(0..count).any(moves)).then_some(Missing::OtherJoint { alone: count == 1 })
    }

    fn prior(&self) -> Option<Missing> {
        let mut carried = self.robot.joints[self.joint..].iter();
        let stated = carried.all(|j| j.inertial.as_ref().is_some_and(|i| i.mass > 0.0));
        (!stated).then_some(Missing::Prior)
    }
}
