//! Pairs that torque along a motion cannot separate, with their remedies.

use rig_shared::effects::{Confusion, Kind};

use crate::experiment::family::Family;

/// Kind of a remedy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Remedy {
    /// A log with the drive off.
    DriveOffLog,
    /// A motion without external loads.
    PullsOff,
    /// Current and voltage together.
    CurrentAndVoltage,
    /// Motions of one joint at a time.
    OneJointAtATime,
    /// A fast motion against gravity.
    FastLift,
    /// A motion over the whole range.
    WholeRange,
    /// One motion at two speeds.
    FastAndSlow,
    /// One motion with the base as it stands and turned.
    BaseTurned,
    /// A motion from cold to warm.
    WarmUp,
    /// One motion with two payloads.
    PayloadSwap,
    /// A motion alone.
    Motion(Family),
}

impl Remedy {
    /// Returns the name in results.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::DriveOffLog => OFF_LOG,
            Self::PullsOff => PULLS_OFF,
            Self::CurrentAndVoltage => "current-and-voltage",
            Self::OneJointAtATime => "one-joint-at-a-time",
            Self::FastLift => "fast-lift",
            Self::WholeRange => "whole-range",
            Self::FastAndSlow => "fast-and-slow",
            Self::BaseTurned => "base-turned",
            Self::WarmUp => "warm-up",
            Self::PayloadSwap => "payload-swap",
            Self::Motion(family) => family.name(),
        }
    }
}

/// The remedy for a pair.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Split {
    pub(crate) kind: Remedy,
    /// Sentences: what to do, to record and to expect; `{k}` is the joint's number.
    pub(crate) text: String,
    /// Motion to run, if any.
    pub(crate) motion: Option<Family>,
    /// True if it needs more than the rig alone: a load, a turned base, another sensor.
    pub(crate) hands: bool,
}

/// Name in results of the log with the drive off …
pub const OFF_LOG: &str = "drive-off-log";
/// … and of a motion without external loads.
pub const PULLS_OFF: &str = "pulls-taken-off";

const DRIVE_OFF: &str = "Record two seconds with the drive off (`rig record` without a trajectory leaves the rig disarmed) and give them with --drive-off. The mean of tau{k} (or i{k}) there is the sensor's own offset, because no current flows: about the size in question, it is current_offset; about zero, it is not. With u{k} recorded in motion the same shows as R times the offset between the voltage and what current and speed account for.";
const TAKE_OFF: &str = "Take off whatever can pull on the joint from outside (hoses, cables, springs), run the motion of the training once more (or, where it is not at hand, the one given here) with the same columns recorded, and give that recording with --pulls-off. A torque from outside is gone there, friction that differs by direction stays; where there was nothing to take off, that settles it as well. No motion alone tells the two apart: while the joint moves both are the same constant, and at rest they widen the same band.";
const TURNED: &str = "Run the motion twice: as the robot stands, and with its base turned by 180 degrees about the vertical or, better, laid on its side so that gravity does nothing. Record t, q{k} and tau{k} each time and diagnose each by itself, the second with `gravity` in its description as it then acts on the base. What belongs to gravity changes with the base; what belongs to the encoder, the gear or a cable stays.";
const GRAVITY_CLOSES: &str = "Run the reversals where gravity is strongest, and again about a position where it does nothing; record t, q{k} and tau{k}. Gravity keeps the teeth together, so lost motion from backlash shows at the second place only; what winds up by friction or twist shows at both. A second encoder on the link (ql{k}) shows it directly.";
const FAST_AND_SLOW: &str = "Run the sine, and again at a third of its speed; record t, q{k} and tau{k}. An error of the encoder or of the timing grows with the square of the speed, inertia included; a torque of gear, gravity or cable stays the same at both.";
const BEYOND_RESONANCE: &str = "Run the chirp, whose second pass is smaller; record t, q{k} and tau{k} at 500 Hz or more. A delay goes on turning the phase in proportion to the frequency; a twisting shaft has an antiresonance, which a payload moves to lower frequency; play changes with the amplitude.";
const CURRENT_TOO: &str = "Record the motor's current i{k} beside its voltage u{k}: with the joint clamped, so that the controller makes steps of the torque each way of positions that it cannot reach (give that recording with --clamped), or, where it cannot be clamped, during slow reversals (with --data). What the bridge loses stands between voltage and current; friction stands in the current itself.";
const ONE_AT_A_TIME: &str = "Run the motion of this joint alone, the others held, then that of the other joint alone, then both together; record t, q and tau of all joints. A coupling shows in this joint while only the other one moves; what belongs to this joint alone does not.";
const LIFT: &str = "Run the sine at full speed; record t, q{k} and tau{k}, and give a description identified before the change as --robot. A payload adds inertia in a fixed proportion to its weight, a tilt adds none.";
const TWO_LOADS: &str = "Run the constant speeds twice: as the robot is, and with a payload of about half the link's mass; record t, q{k} and tau{k} and diagnose each by itself, the second with the payload in its description. What belongs to load or current grows with it, what belongs to the position or the magnets stays.";
const COLD_AND_WARM: &str = "Run the motion from cold until the gear is warm, and keep the order of speeds random; record t, q{k}, tau{k} and, if there is a sensor, temp{k}. What falls with warmth changes from the first to the last period at the same speed; what depends on speed or current does not.";
const WIDE: &str = "Run the sine over the whole range; record t, q{k} and tau{k}. Over more than two thirds of a turn a spring goes on growing where gravity turns back and a constant stays; taking the cable off and repeating decides it at any range.";
const SPEEDS: &str = "Run the constant speeds; record t, q{k} and tau{k}. What depends on the speed shows at constant speed, what remembers the last reversal has died out there.";
const LOAD_OR_SPEED: &str = "Run the constant speeds; record t, q{k} and tau{k}. At constant speed no acceleration asks for torque, so that what is left belongs to the speed; what belongs to load or current shows where gravity is lifted slowly.";

/// Laws of friction that falls as the joint starts to slide.
const STRIBECK: [Kind; 2] = [Kind::Stribeck, Kind::StribeckExponential];
/// Errors of encoders.
const ENCODERS: [Kind; 2] = [
    Kind::EncoderEccentricityMotor,
    Kind::EncoderEccentricityJoint,
];
/// Effects that another load separates.
const OF_LOAD: [Kind; 4] = [
    Kind::TorqueRipple,
    Kind::LoadFriction,
    Kind::Cogging,
    Kind::TorqueSaturation,
];

/// Returns the registry's entry on the pair.
pub(crate) fn confused([a, b]: [Kind; 2]) -> Option<&'static Confusion> {
    let of = |x: Kind, y: Kind| {
        let mut all = x.about().confused.iter();
        all.find(|c| c.with == y.about().name)
    };
    of(a, b).or_else(|| of(b, a))
}

/// Returns the remedy for the pair.
pub(crate) fn split(pair: [Kind; 2]) -> Split {
    (of_pair(pair).or_else(|| of_one(pair))).unwrap_or_else(|| of_registry(pair))
}

/// A motion that the rig alone can run.
fn made(kind: Remedy, text: &str, motion: Family) -> Split {
    Split {
        kind,
        text: text.to_owned(),
        motion: Some(motion),
        hands: false,
    }
}

/// A motion that is the remedy by itself.
fn by_motion(motion: Family, text: &str) -> Split {
    made(Remedy::Motion(motion), text, motion)
}

/// A remedy that needs more than the rig alone.
fn by_hand(kind: Remedy, text: &str, motion: Family) -> Split {
    Split {
        hands: true,
        ..made(kind, text, motion)
    }
}

/// Returns the remedy for pairs with one of their own, and for kinds whose remedy comes before that of any pair.
fn of_pair([a, b]: [Kind; 2]) -> Option<Split> {
    let is = |x: Kind, y: Kind| [a, b] == [x, y] || [b, a] == [x, y];
    let has = |kind: Kind| a == kind || b == kind;
    let gear = has(Kind::Backlash) || has(Kind::JointElasticity);
    Some(if has(Kind::CurrentOffset) {
        Split {
            kind: Remedy::DriveOffLog,
            text: DRIVE_OFF.to_owned(),
            motion: None,
            hands: false,
        }
    } else if is(Kind::AsymmetricCoulomb, Kind::TorqueOffset) {
        by_hand(Remedy::PullsOff, TAKE_OFF, Family::ConstantSpeeds)
    } else if has(Kind::DriveDeadzone) {
        by_hand(Remedy::CurrentAndVoltage, CURRENT_TOO, Family::LockedRotor)
    } else if has(Kind::InertiaCoupling) {
        made(Remedy::OneJointAtATime, ONE_AT_A_TIME, Family::Sine)
    } else if is(Kind::JointElasticity, Kind::MeasurementDelay) {
        by_motion(Family::Chirp, BEYOND_RESONANCE)
    } else if gear {
        by_motion(Family::ReversalsUnderLoad, GRAVITY_CLOSES)
    } else if is(Kind::Payload, Kind::GravityTilt) {
        made(Remedy::FastLift, LIFT, Family::Sine)
    } else if is(Kind::Spring, Kind::GravityTilt) || is(Kind::Spring, Kind::TorqueOffset) {
        made(Remedy::WholeRange, WIDE, Family::Sine)
    } else {
        return None;
    })
}

/// Returns the remedy by one kind of the pair.
fn of_one([a, b]: [Kind; 2]) -> Option<Split> {
    let has = |kinds: &[Kind]| kinds.contains(&a) || kinds.contains(&b);
    let friction = has(&STRIBECK) || a.is_presliding() || b.is_presliding();
    Some(if has(&ENCODERS) && !has(&[Kind::GravityTilt]) {
        made(Remedy::FastAndSlow, FAST_AND_SLOW, Family::Sine)
    } else if has(&[Kind::GravityTilt]) {
        by_hand(Remedy::BaseTurned, TURNED, Family::Sine)
    } else if a.is_viscous_warmup() || b.is_viscous_warmup() {
        made(Remedy::WarmUp, COLD_AND_WARM, Family::WarmUp)
    } else if has(&[Kind::QuadraticDrag]) {
        by_motion(Family::ConstantSpeeds, LOAD_OR_SPEED)
    } else if has(&OF_LOAD) {
        by_hand(Remedy::PayloadSwap, TWO_LOADS, Family::ConstantSpeeds)
    } else if friction {
        by_motion(Family::ConstantSpeeds, SPEEDS)
    } else {
        return None;
    })
}

/// Returns constant speeds, with the registry's words on what separates the pair.
fn of_registry(pair: [Kind; 2]) -> Split {
    let text = format!(
        "Run the constant speeds; record t, q{{k}} and tau{{k}}. What tells them apart: {}.",
        confused(pair).map_or(
            "the same motion with another payload and at another speed",
            |c| c.separated_by
        )
    );
    by_motion(Family::ConstantSpeeds, &text)
}
