//! Words for quantities beyond their bounds.

use rig_output::format_significant;
use rig_shared::wire::message::Bounded;

const UNIT: &str = "check its unit";
const RATING: &str = "a limit is above 0 and within the ratings of the rig's parts";
const SMALLER: &str = "make the motion smaller or slower";
const CORRECTION: &str = "mend the part, or leave the effect out";

/// Describes a quantity beyond its bound, with the remedy.
pub(crate) fn out_of_bounds(quantity: Bounded, value: f32, bound: f32) -> String {
    let (what, unit, remedy) = of_the_rig(quantity)
        .or_else(|| of_a_motion(quantity))
        .or_else(|| of_a_loop(quantity))
        .unwrap_or_else(|| of_a_model(quantity));
    let [value, bound] = [value, bound].map(|number| format_significant(f64::from(number), 4));
    let unit = if unit.is_empty() {
        String::new()
    } else {
        format!(" {unit}")
    };
    format!("{what} is {value}{unit}, and the bound is {bound}{unit}: {remedy}")
}

type Words = (&'static str, &'static str, &'static str);

/// Limits of the rig.
fn of_the_rig(quantity: Bounded) -> Option<Words> {
    Some(match quantity {
        Bounded::SpeedLimit => ("the limit of the speed", "rad/s", RATING),
        Bounded::AccelerationLimit => ("the limit of the acceleration", "rad/s^2", RATING),
        Bounded::TorqueLimit => ("the limit of the torque", "N*m", RATING),
        Bounded::ContinuousCurrent => ("the continuous current", "A", RATING),
        Bounded::PeakCurrent => (
            "the peak current",
            "A",
            "it is at least the continuous current and within the rating of the rig's parts",
        ),
        Bounded::PositionLimit => ("the end of the position range", "rad", UNIT),
        Bounded::PositionRange => (
            "the width of the position range",
            "rad",
            "the low end comes first",
        ),
        _ => return None,
    })
}

/// What the link does or should do.
fn of_a_motion(quantity: Bounded) -> Option<Words> {
    Some(match quantity {
        Bounded::ArmPosition => (
            "the position of the link",
            "rad",
            "move the link into its range, correct --home, or widen the limits while disarmed",
        ),
        Bounded::ArmVelocity => (
            "the speed of the link",
            "rad/s",
            "wait until it hangs still",
        ),
        Bounded::IdleCurrent => (
            "the motor current with the bridge off",
            "A",
            "look for a short circuit in the bridge, for an enable that does not go low, and at the current sense",
        ),
        Bounded::MotionSpeed => ("the speed of the motion", "rad/s", SMALLER),
        Bounded::MotionAcceleration => ("the acceleration of the motion", "rad/s^2", SMALLER),
        Bounded::MotionPosition => (
            "the position that the motion reaches from here",
            "rad",
            "make the motion smaller, move the link, or correct --home",
        ),
        Bounded::Home => ("the position to be set", "rad", UNIT),
        _ => return None,
    })
}

/// Gains and bandwidths.
fn of_a_loop(quantity: Bounded) -> Option<Words> {
    Some(match quantity {
        Bounded::PositionLoop => (
            "the natural frequency of the position loop, sqrt(kp/J),",
            "rad/s",
            "lower the proportional gain or raise the bandwidth of the current loop",
        ),
        Bounded::VelocityLoop => (
            "the bandwidth of the velocity loop, kd/J,",
            "rad/s",
            "lower the derivative gain or raise the bandwidth of the current loop",
        ),
        Bounded::ProportionalGain => ("the proportional gain", "N*m/rad", "no gain is negative"),
        Bounded::DerivativeGain => (
            "the derivative gain",
            "N*m*s/rad",
            "without it the link is not damped",
        ),
        Bounded::AdaptationGain => ("the adaptation gain", "1/s", "no gain is negative"),
        Bounded::CurrentLoop => (
            "the bandwidth of the current loop",
            "Hz",
            "choose it between 1/256 and 1/10 of the control rate",
        ),
        _ => return None,
    })
}

/// Models, effects and estimator.
fn of_a_model(quantity: Bounded) -> Words {
    match quantity {
        Bounded::Gravity => ("the gravity torque of the model", "N*m", UNIT),
        Bounded::DryFriction => ("the friction torque at rest", "N*m", UNIT),
        Bounded::ViscousFriction => ("the viscous friction", "N*m*s/rad", UNIT),
        Bounded::Offset => ("the constant torque of the model", "N*m", UNIT),
        Bounded::LoadFriction => ("the friction per torque of the load", "", UNIT),
        Bounded::DryAsymmetry => (
            "the difference of the Coulomb friction between the directions",
            "N*m",
            "it is at most the Coulomb friction",
        ),
        Bounded::ViscousAsymmetry => (
            "the difference of the viscous friction between the directions",
            "N*m*s/rad",
            "it is at most the viscous friction",
        ),
        Bounded::StribeckVelocity => ("the Stribeck velocity", "rad/s", UNIT),
        Bounded::FrictionShare => (
            "the compensated share of the friction",
            "",
            "choose it between 0 and 1",
        ),
        Bounded::FrictionShareAtRest => (
            "the share of the friction that is compensated at rest",
            "",
            "choose it between 0 and the share in motion, and below 1",
        ),
        Bounded::VelocityThreshold => ("the velocity threshold of the friction", "rad/s", UNIT),
        Bounded::EstimatorMemory => ("the memory of the on-line estimator", "s", UNIT),
        Bounded::EstimatorBandwidth => (
            "the bandwidth of the on-line estimator",
            "Hz",
            "choose it above 0 and at most a tenth of the estimator's rate",
        ),
        Bounded::SlipVelocity => ("the slip velocity of the on-line estimator", "rad/s", UNIT),
        Bounded::EstimatorBand => (
            "the width of a parameter's band in the on-line estimator",
            "in the parameter's unit",
            "the lower end comes first",
        ),
        Bounded::CurrentCorrection => ("the correction of the current", "A", CORRECTION),
        Bounded::VoltageCorrection => ("the voltage loss of the bridge", "V", CORRECTION),
        Bounded::EncoderCorrection => (
            "the encoder's error as a share of the velocity",
            "",
            CORRECTION,
        ),
        Bounded::Inertia
        // These are described above; named here so that a new quantity does not compile without its words.
        | Bounded::SpeedLimit
        | Bounded::AccelerationLimit
        | Bounded::TorqueLimit
        | Bounded::ContinuousCurrent
        | Bounded::PeakCurrent
        | Bounded::PositionLimit
        | Bounded::PositionRange
        | Bounded::ArmPosition
        | Bounded::ArmVelocity
        | Bounded::IdleCurrent
        | Bounded::MotionSpeed
        | Bounded::MotionAcceleration
        | Bounded::MotionPosition
        | Bounded::PositionLoop
        | Bounded::VelocityLoop
        | Bounded::ProportionalGain
        | Bounded::DerivativeGain
        | Bounded::AdaptationGain
        | Bounded::CurrentLoop
        | Bounded::Home => ("the inertia of the model", "kg*m^2", UNIT),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantity_is_told_with_value_bound_and_units() {
        for (quantity, expected) in [
            (
                Bounded::PeakCurrent,
                "the peak current is 8.000 A, and the bound is 4.000 A: it is at least the continuous current and within the rating of the rig's parts",
            ),
            (
                Bounded::MotionSpeed,
                "the speed of the motion is 8.000 rad/s, and the bound is 4.000 rad/s: make the motion smaller or slower",
            ),
            (
                Bounded::FrictionShare,
                "the compensated share of the friction is 8.000, and the bound is 4.000: choose it between 0 and 1",
            ),
            (
                Bounded::Inertia,
                "the inertia of the model is 8.000 kg*m^2, and the bound is 4.000 kg*m^2: check its unit",
            ),
        ] {
            assert_eq!(out_of_bounds(quantity, 8.0, 4.0), expected);
        }
    }
}
