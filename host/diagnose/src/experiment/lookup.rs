//! Pairs that torque along a motion cannot separate, with their remedies.

use rig_shared::effects::{Confusion, Kind};

use crate::experiment::family::Family;
use crate::experiment::kind::ExperimentKind;

/// Remedy for a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Remedy {
    /// A log with the drive off.
    DriveOffLog,
    /// A motion without external loads.
    PullsOff,
    /// Current and voltage together, of a clamped joint if it can be clamped.
    CurrentAndVoltage,
    /// Motions of one joint at a time.
    OneJointAtATime,
    /// Slow reversals with gravity and without.
    Reversals,
    /// Frequencies beyond the resonance.
    BeyondResonance,
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
    /// Constant speeds, for friction …
    Speeds,
    /// … for load or speed …
    LoadOrSpeed,
    /// … and for any other pair, with the registry's words on what separates it.
    Registry(Option<&'static str>),
}

impl Remedy {
    /// Returns the kind of the experiment, and the motion to run, if any.
    pub(crate) fn experiment(self) -> (ExperimentKind, Option<Family>) {
        let (kind, motion) = match self {
            Self::DriveOffLog => return (ExperimentKind::DriveOffLog, None),
            Self::PullsOff => (ExperimentKind::PullsOff, Family::ConstantSpeeds),
            Self::CurrentAndVoltage => (ExperimentKind::CurrentAndVoltage, Family::LockedRotor),
            Self::OneJointAtATime => (ExperimentKind::OneJointAtATime, Family::Sine),
            Self::FastLift => (ExperimentKind::FastLift, Family::Sine),
            Self::WholeRange => (ExperimentKind::WholeRange, Family::Sine),
            Self::FastAndSlow => (ExperimentKind::FastAndSlow, Family::Sine),
            Self::BaseTurned => (ExperimentKind::BaseTurned, Family::Sine),
            Self::WarmUp => (ExperimentKind::WarmUp, Family::WarmUp),
            Self::PayloadSwap => (ExperimentKind::PayloadSwap, Family::ConstantSpeeds),
            alone => {
                let family = match alone {
                    Self::Reversals => Family::ReversalsUnderLoad,
                    Self::BeyondResonance => Family::Chirp,
                    _ => Family::ConstantSpeeds,
                };
                (ExperimentKind::Motion(family), family)
            }
        };
        (kind, Some(motion))
    }

    /// Returns true if it needs more than the rig alone: a load, a turned base, another sensor.
    pub(crate) fn needs_hands(self) -> bool {
        let by_hand = [
            Self::PullsOff,
            Self::CurrentAndVoltage,
            Self::BaseTurned,
            Self::PayloadSwap,
        ];
        by_hand.contains(&self)
    }
}

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
pub(crate) fn split(pair: [Kind; 2]) -> Remedy {
    let registry = || Remedy::Registry(confused(pair).map(|c| c.separated_by));
    (of_pair(pair).or_else(|| of_one(pair))).unwrap_or_else(registry)
}

/// Returns the remedy for pairs with one of their own, and for kinds whose remedy comes before that of any pair.
fn of_pair([a, b]: [Kind; 2]) -> Option<Remedy> {
    let is = |x: Kind, y: Kind| [a, b] == [x, y] || [b, a] == [x, y];
    let has = |kind: Kind| a == kind || b == kind;
    let gear = has(Kind::Backlash) || has(Kind::JointElasticity);
    Some(if has(Kind::CurrentOffset) {
        Remedy::DriveOffLog
    } else if is(Kind::AsymmetricCoulomb, Kind::TorqueOffset) {
        Remedy::PullsOff
    } else if has(Kind::DriveDeadzone) {
        Remedy::CurrentAndVoltage
    } else if has(Kind::InertiaCoupling) {
        Remedy::OneJointAtATime
    } else if is(Kind::JointElasticity, Kind::MeasurementDelay) {
        Remedy::BeyondResonance
    } else if gear {
        Remedy::Reversals
    } else if is(Kind::Payload, Kind::GravityTilt) {
        Remedy::FastLift
    } else if is(Kind::Spring, Kind::GravityTilt) || is(Kind::Spring, Kind::TorqueOffset) {
        Remedy::WholeRange
    } else {
        return None;
    })
}

/// Returns the remedy by one kind of the pair.
fn of_one([a, b]: [Kind; 2]) -> Option<Remedy> {
    let has = |kinds: &[Kind]| kinds.contains(&a) || kinds.contains(&b);
    let friction = has(&STRIBECK) || a.is_presliding() || b.is_presliding();
    Some(if has(&ENCODERS) && !has(&[Kind::GravityTilt]) {
        Remedy::FastAndSlow
    } else if has(&[Kind::GravityTilt]) {
        Remedy::BaseTurned
    } else if a.is_viscous_warmup() || b.is_viscous_warmup() {
        Remedy::WarmUp
    } else if has(&[Kind::QuadraticDrag]) {
        Remedy::LoadOrSpeed
    } else if has(&OF_LOAD) {
        Remedy::PayloadSwap
    } else if friction {
        Remedy::Speeds
    } else {
        return None;
    })
}
