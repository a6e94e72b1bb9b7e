//! Names of factors in words.

use crate::faults::names::{Cause, Name};
use rig_model::robot::JointKind;
use rig_output::format_trimmed;

/// Returns all causes, joined: clauses, of a velocity its units.
pub(crate) fn name(name: &Name) -> String {
    let causes: Vec<String> = name.0.iter().map(|own| cause(*own)).collect();
    causes.join(", or ")
}

fn cause(cause: Cause) -> String {
    let fixed = match cause {
        Cause::TorqueInMilli(kind) => {
            let small = match kind {
                JointKind::Revolute => "mN·m (N·mm)",
                JointKind::Prismatic => "mN",
            };
            return format!(
                "as {small} for the joint's unit or mA for A would be (1000 times too large)"
            );
        }
        Cause::TorqueInKilo(kind) => {
            let large = match kind {
                JointKind::Revolute => "kN·m",
                JointKind::Prismatic => "kN",
            };
            return format!("as {large} or A for mA would be (1000 times too small)");
        }
        Cause::BeforeGear(n) => {
            return format!("as the motor's torque is before its gear ({n} to 1)");
        }
        Cause::TorqueThroughGearTwice(n) => {
            return format!("as if the gear ratio ({n}) had been applied twice");
        }
        Cause::UpsideDown(n) => {
            return format!(
                "as if gear_ratio stood upside down: it is {}, motor turns per joint turn are wanted, and {} fits",
                format_trimmed(n, 4),
                format_trimmed(1.0 / n, 4)
            );
        }
        Cause::Double | Cause::Half => {
            return format!(
                "it is {} what it should be; check the gear ratio and the counts of the encoder",
                if cause == Cause::Half {
                    "half"
                } else {
                    "twice"
                }
            );
        }
        Cause::MotorAngle(n) => {
            return format!(
                "it looks like the angle of the motor; divide it by the gear ratio {n}"
            );
        }
        Cause::AngleThroughGearTwice(n) => {
            return format!("it has been divided by the gear ratio {n} twice");
        }
        Cause::PerDegree => "as a constant per degree would make it",
        Cause::PerRpmOrKgf => "as a motor constant per rpm (or kgf·cm for N·m) would make it",
        Cause::PerRpm => "as a motor constant per rpm would make it",
        Cause::Degrees => "it looks like degrees; give it in rad",
        Cause::DegreesTwice => "it has been turned from degrees to rad twice",
        Cause::Turns => "it looks like turns; give it in rad",
        Cause::Millimetres => "it looks like millimetres; give it in m",
        Cause::MillimetresTwice => "it has been turned from mm to m twice",
        Cause::Rpm => "revolutions per minute",
        Cause::DegreesPerSecond => "degrees per second",
        Cause::TurnsPerSecond => "turns per second",
        Cause::MillimetresPerSecond => "millimetres per second",
        Cause::MotorSpeed => "the speed of the motor",
        Cause::MotorRpm => "revolutions per minute of the motor",
    };
    fixed.to_owned()
}

/// Returns the unit of a clock that runs `factor` times too fast, and its correction.
pub(super) fn clock(factor: f64) -> &'static str {
    let seconds = [
        (1e6, "microseconds; give it in s"),
        (1000.0, "milliseconds; give it in s"),
        (1.0 / 60.0, "minutes; give it in s"),
        (1e-3, "thousands of seconds; give it in s"),
    ];
    seconds
        .iter()
        .find(|(f, _)| (factor / f).ln().abs() <= 0.47)
        .map_or("something else than seconds; give it in s", |(_, name)| {
            name
        })
}
