//! Experiments in words.

use crate::experiment::family::{Family, Hands};
use crate::experiment::lookup::Remedy;
use crate::experiment::primitives::{Figures, Primitive};
use rig_excite::COASTING;
use rig_model::robot::{Joint, Robot};
use rig_output::format_unit;

/// Motion file named in the experiment's text; the caller writes it beside `diagnosis.json`.
pub const FILE: &str = "next_experiment.toml";

/// Returns the remedy for two effects of a joint (from 0): what to do, to record and to expect.
pub(super) fn remedy(remedy: Remedy, joint: usize) -> String {
    let text = match remedy {
        Remedy::DriveOffLog => DRIVE_OFF,
        Remedy::PullsOff => TAKE_OFF,
        Remedy::CurrentAndVoltage => CURRENT_TOO,
        Remedy::OneJointAtATime => ONE_AT_A_TIME,
        Remedy::Reversals => GRAVITY_CLOSES,
        Remedy::BeyondResonance => BEYOND_RESONANCE,
        Remedy::FastLift => LIFT,
        Remedy::WholeRange => WIDE,
        Remedy::FastAndSlow => FAST_AND_SLOW,
        Remedy::BaseTurned => TURNED,
        Remedy::WarmUp => COLD_AND_WARM,
        Remedy::PayloadSwap => TWO_LOADS,
        Remedy::Speeds => SPEEDS,
        Remedy::LoadOrSpeed => LOAD_OR_SPEED,
        Remedy::Registry(separated_by) => &format!(
            "Run the constant speeds; record t, q{{k}} and tau{{k}}. What tells them apart: {}.",
            separated_by.unwrap_or("the same motion with another payload and at another speed")
        ),
    };
    text.replace("{k}", &(joint + 1).to_string())
}

// `{k}` is the number of the joint.
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

/// Returns instructions: first `pulls_off`, then the motion, its separation in standard deviations, and the rivals that
/// it leaves open.
pub(super) fn deciding(
    robot: &Robot,
    joint: usize,
    primitive: &Primitive,
    separation: f64,
    pulls_off: Option<Remedy>,
    left: &[String],
) -> String {
    let run = running(robot, joint, primitive);
    let mut text = match pulls_off {
        Some(first) => format!("{} {run}", remedy(first, joint)),
        None => format!("{run} {}", by_hand(primitive.hands)),
    };
    text.push_str(&format!(
        " The predictions of the rivals that a motion tells apart lie {separation:.0} standard deviations of the noise apart along it."
    ));
    if !left.is_empty() {
        text.push_str(&format!(
            " Of {} no motion tells one from another: should they be left, the next diagnosis says what does.",
            left.join(" and ")
        ));
    }
    text
}

/// Returns sentences: the manual work, and how to use the recordings.
fn by_hand(hands: Hands) -> &'static str {
    match hands {
        Hands::None => "Give what it records with --data beside the others.",
        Hands::Payload => {
            "Record it twice: as the robot is, and with a payload of about half the link's mass fixed to it. Diagnose each by itself, the second with the payload in its description."
        }
        Hands::BaseOnItsSide => {
            "Record it twice: as the robot stands, and with the base turned on its side so that the joint's axis is vertical. Diagnose each by itself, the second with `gravity` along that axis in its description."
        }
    }
}

/// Returns sentences on how to run the motion.
pub(super) fn running(robot: &Robot, joint: usize, primitive: &Primitive) -> String {
    let (start, seconds) = (primitive.start, primitive.duration());
    let own = &robot.joints[joint];
    let how = if robot.joints.len() == 1 {
        let clamp = match primitive.family {
            Family::LockedRotor => ", clamp it",
            _ => "",
        };
        let after = match primitive.drive_off {
            Some(_) => format!(" --seconds {COASTING}"),
            None => String::new(),
        };
        format!(
            "bring the joint to {start:.4}{clamp} and run it with `rig record --port PORT --robot R --trajectory {FILE} --home {start:.4}{after} --out next.csv` (`--emulated` for the emulated rig; {FILE} lies in the folder of --out)"
        )
    } else {
        format!(
            "bring joint {} to {start:.4} {}, the others to the middle of their ranges, and let your controller follow it; `rig simulate` shows it first",
            own.name,
            format_unit(own.kind.units().0),
        )
    };
    format!(
        "{FILE} holds {} about {start:.4}, {seconds:.0} s: {how}.",
        figures(own, &primitive.figures)
    )
}

/// Returns the figures of a motion, a noun with its complements.
fn figures(joint: &Joint, figures: &Figures) -> String {
    let (unit, effort) = joint.kind.units();
    match figures {
        Figures::Speeds {
            slowest,
            fastest,
            span,
        } => format!(
            "eight constant speeds from {slowest:.4} to {fastest:.4} {unit}/s, both ways, over {span:.3} {unit} in all"
        ),
        Figures::Triangles { amplitudes, speed } => {
            let amplitudes: Vec<String> = amplitudes.iter().map(|a| format!("{a:.4}")).collect();
            format!(
                "three slow triangles each of {} {unit} to either side at {speed:.4} {unit}/s",
                amplitudes.join(", ")
            )
        }
        Figures::Chirp {
            hz: [start, end],
            amplitude,
            again,
        } => format!(
            "a swept sine from {start:.3} to {end:.2} Hz of up to {amplitude:.4} {unit}, and again at {again} of its amplitude"
        ),
        Figures::Steps { step, seconds } => format!(
            "steps of {step:.4} {unit} up and down in {seconds:.2} s each, after rests of 4 s"
        ),
        Figures::Coast { speed } => format!(
            "a pass at {speed:.4} {unit}/s, in the middle of which the drive is switched off and the joint coasts"
        ),
        Figures::Sine {
            periods,
            amplitude,
            hz,
        } => format!("{periods} periods of a sine of {amplitude:.4} {unit} at {hz:.3} Hz"),
        Figures::Levels { position, torque } => format!(
            "thirteen levels of up to {position:.5} {unit} to either side, of which the controller makes up to {torque:.3} {effort} while the joint is clamped"
        ),
    }
}
