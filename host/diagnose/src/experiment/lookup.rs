//! Pairs that torque along a motion cannot separate, with their remedies.

use rig_shared::effects::{Confusion, Kind};

use crate::experiment::primitives::Family;

/// The remedy for a pair.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Split {
    /// Name in results.
    pub(crate) kind: &'static str,
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

/// Returns the registry's entry on the pair.
pub(crate) fn confused([a, b]: [Kind; 2]) -> Option<&'static Confusion> {
    let of = |x: Kind, y: Kind| {
        let mut all = x.about().confused.iter();
        all.find(|c| c.with == y.about().name)
    };
    of(a, b).or_else(|| of(b, a))
}

/// Returns the remedy for the pair, by names of the registry.
pub(crate) fn split([a, b]: [Kind; 2]) -> Split {
    let [a_name, b_name] = [a.about().name, b.about().name];
    let is = |x: &str, y: &str| (a_name == x && b_name == y) || (a_name == y && b_name == x);
    let has = |x: &str| a_name == x || b_name == x;
    let made = |kind, text: &str, motion| Split {
        kind,
        text: text.to_owned(),
        motion,
        hands: false,
    };
    let by_hand = |kind, text: &str, motion| Split {
        hands: true,
        ..made(kind, text, motion)
    };
    if has("current_offset") {
        made(OFF_LOG, DRIVE_OFF, None)
    } else if is("asymmetric_coulomb", "torque_offset") {
        by_hand(PULLS_OFF, TAKE_OFF, Some(Family::ConstantSpeeds))
    } else if has("drive_deadzone") {
        by_hand(
            "current-and-voltage",
            CURRENT_TOO,
            Some(Family::LockedRotor),
        )
    } else if has("inertia_coupling") {
        made("one-joint-at-a-time", ONE_AT_A_TIME, Some(Family::Sine))
    } else if is("joint_elasticity", "measurement_delay") {
        made(Family::Chirp.name(), BEYOND_RESONANCE, Some(Family::Chirp))
    } else if has("backlash") || has("joint_elasticity") {
        made(
            Family::ReversalsUnderLoad.name(),
            GRAVITY_CLOSES,
            Some(Family::ReversalsUnderLoad),
        )
    } else if is("payload", "gravity_tilt") {
        made("fast-lift", LIFT, Some(Family::Sine))
    } else if is("spring", "gravity_tilt") || is("spring", "torque_offset") {
        made("whole-range", WIDE, Some(Family::Sine))
    } else if has("encoder_eccentricity") && !has("gravity_tilt") {
        made("fast-and-slow", FAST_AND_SLOW, Some(Family::Sine))
    } else if has("gravity_tilt") {
        by_hand("base-turned", TURNED, Some(Family::Sine))
    } else if has("viscous_warmup") {
        made("warm-up", COLD_AND_WARM, Some(Family::WarmUp))
    } else if has("quadratic_drag") {
        made(
            Family::ConstantSpeeds.name(),
            LOAD_OR_SPEED,
            Some(Family::ConstantSpeeds),
        )
    } else if [
        "torque_ripple",
        "load_friction",
        "cogging",
        "torque_saturation",
    ]
    .into_iter()
    .any(has)
    {
        by_hand("payload-swap", TWO_LOADS, Some(Family::ConstantSpeeds))
    } else if has("stribeck") || has("presliding") {
        made(
            Family::ConstantSpeeds.name(),
            SPEEDS,
            Some(Family::ConstantSpeeds),
        )
    } else {
        let known = confused([a, b]);
        Split {
            kind: Family::ConstantSpeeds.name(),
            text: format!(
                "Run the constant speeds; record t, q{{k}} and tau{{k}}. What tells them apart: {}.",
                known.map_or(
                    "the same motion with another payload and at another speed",
                    |c| c.separated_by
                )
            ),
            motion: Some(Family::ConstantSpeeds),
            hands: false,
        }
    }
}
