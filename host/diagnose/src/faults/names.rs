//! Names of the factors between a column and its right value.

use crate::outcome::FaultKind;
use rig_model::robot::{Joint, JointKind};

/// A cause of a factor between a column and its right value; `f64` are described motor turns per joint turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Cause {
    /// A torque in a thousandth of its unit, or a current in mA.
    TorqueInMilli(JointKind),
    /// A torque in a thousand of its unit, or a current in A for mA.
    TorqueInKilo(JointKind),
    /// A torque constant per degree.
    PerDegree,
    /// A motor constant per rpm, or kgf·cm.
    PerRpmOrKgf,
    /// A motor constant per rpm.
    PerRpm,
    /// A torque before the gear.
    BeforeGear(f64),
    /// A torque with the ratio applied twice.
    TorqueThroughGearTwice(f64),
    /// A described ratio that is inverted.
    UpsideDown(f64),
    /// A position in degrees.
    Degrees,
    /// A position converted from degrees to rad twice.
    DegreesTwice,
    /// A position in turns.
    Turns,
    /// A position in mm.
    Millimetres,
    /// A position converted from mm to m twice.
    MillimetresTwice,
    /// A position of twice its size.
    Double,
    /// A position of half its size.
    Half,
    /// A position of the motor.
    MotorAngle(f64),
    /// A position with the ratio applied twice.
    AngleThroughGearTwice(f64),
    /// A velocity in revolutions per minute.
    Rpm,
    /// A velocity in degrees per second.
    DegreesPerSecond,
    /// A velocity in turns per second.
    TurnsPerSecond,
    /// A velocity in mm/s.
    MillimetresPerSecond,
    /// A velocity of the motor.
    MotorSpeed,
    /// A velocity of the motor in revolutions per minute.
    MotorRpm,
}

/// A cause with its factor.
struct Named {
    factor: f64,
    /// Relative frequency of the cause.
    weight: f64,
    cause: Cause,
}

impl Named {
    fn new(factor: f64, cause: Cause) -> Self {
        Self {
            factor,
            weight: 1.0,
            cause,
        }
    }

    /// Makes a cause less frequent.
    fn seldom(self) -> Self {
        Self {
            weight: 0.15,
            ..self
        }
    }
}

/// The name of a factor: all likely causes, the likeliest first.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Name(pub(crate) Vec<Cause>);

impl Name {
    /// Returns true if the likeliest cause is an error of the description.
    pub(crate) fn is_of_description(&self) -> bool {
        matches!(self.0.first(), Some(Cause::UpsideDown(_)))
    }

    /// Returns the kind of the fault, by the likeliest cause.
    pub(crate) fn kind(&self) -> FaultKind {
        let of_ratio = |cause: &Cause| {
            matches!(
                cause,
                Cause::BeforeGear(_)
                    | Cause::TorqueThroughGearTwice(_)
                    | Cause::UpsideDown(_)
                    | Cause::Double
                    | Cause::Half
                    | Cause::MotorAngle(_)
                    | Cause::AngleThroughGearTwice(_)
            )
        };
        match self.0.first().is_some_and(of_ratio) {
            true => FaultKind::Ratio,
            false => FaultKind::Unit,
        }
    }
}

/// Standard deviation of the logarithm of a torque factor: the uncertainty of a description (`robot::worth`).
const SPREAD: f64 = core::f64::consts::LN_2;
/// Largest distance of a name's factor from the torque's, standard deviations.
const NEAR: f64 = 1.2;
/// Least likelihood of a name, as a share of the best one's.
const LIKELY: f64 = 1.0 / 3.0;
/// Ratio within which gravity's period or the velocity determine a factor.
const CLOSE: f64 = 1.12;

/// Returns motor turns per joint turn, if the described ratio is far enough from one.
pub(crate) fn ratio(joint: &Joint) -> Option<f64> {
    let ratio = joint.drive.as_ref()?.gear_ratio.abs();
    (ratio > 1.5 || (ratio > 0.0 && ratio < 0.67)).then_some(ratio)
}

/// Returns true if a torque `factor` times too large may come from a ratio that was left out or applied twice.
pub(crate) fn is_ratio(joint: &Joint, factor: f64) -> bool {
    let apart = |r: f64| (factor.abs() / r).ln().abs() <= 1.6f64.ln();
    ratio(joint).is_some_and(|r| apart(r) || apart(1.0 / r))
}

/// Joins causes, the likeliest first.
fn joined(mut likely: Vec<(f64, Named)>) -> Option<Name> {
    likely.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let causes: Vec<Cause> = likely.into_iter().map(|(_, named)| named.cause).collect();
    (!causes.is_empty()).then_some(Name(causes))
}

/// Returns the names of a closely known factor, the nearest first.
fn close(factor: f64, list: Vec<Named>) -> Option<Name> {
    let near = |named: Named| {
        let apart = (factor.abs() / named.factor).ln().abs();
        (apart <= CLOSE.ln()).then_some((-apart, named))
    };
    joined(list.into_iter().filter_map(near).collect())
}

/// Returns the names of a torque factor; its uncertainty is that of the description's values.
pub(crate) fn of_torque(joint: &Joint, factor: f64) -> Option<Name> {
    let mut list = vec![
        Named::new(1000.0, Cause::TorqueInMilli(joint.kind)),
        Named::new(1e-3, Cause::TorqueInKilo(joint.kind)),
        Named::new(57.296, Cause::PerDegree).seldom(),
        Named::new(1.0 / 57.296, Cause::PerDegree).seldom(),
        Named::new(9.549, Cause::PerRpmOrKgf).seldom(),
        Named::new(1.0 / 9.549, Cause::PerRpm).seldom(),
    ];
    match ratio(joint) {
        Some(n) if n < 1.0 => list.push(Named::new(n * n, Cause::UpsideDown(n))),
        Some(n) => {
            list.push(Named::new(1.0 / n, Cause::BeforeGear(n)));
            list.push(Named::new(n, Cause::TorqueThroughGearTwice(n)));
        }
        None => {}
    }
    let apart = |named: &Named| (factor.abs() / named.factor).ln().abs() / SPREAD;
    let likelihood = |named: &Named| named.weight * (-0.5 * apart(named).powi(2)).exp();
    list.retain(|named| apart(named) < NEAR);
    let most = list.iter().map(likelihood).fold(0.0, f64::max);
    let likely = |named: Named| {
        let own = likelihood(&named);
        (own >= LIKELY * most).then_some((own, named))
    };
    joined(list.into_iter().filter_map(likely).collect())
}

/// Returns factors that correct a position, and their causes.
fn positions(joint: &Joint) -> Vec<Named> {
    let mut list = match joint.kind {
        JointKind::Revolute => vec![
            Named::new(1.0 / 57.296, Cause::Degrees),
            Named::new(57.296, Cause::DegreesTwice),
            Named::new(core::f64::consts::TAU, Cause::Turns),
        ],
        JointKind::Prismatic => vec![
            Named::new(1e-3, Cause::Millimetres),
            Named::new(1000.0, Cause::MillimetresTwice),
        ],
    };
    list.push(Named::new(0.5, Cause::Double));
    list.push(Named::new(2.0, Cause::Half));
    match ratio(joint) {
        Some(n) if n < 1.0 => list.push(Named::new(n * n, Cause::UpsideDown(n))),
        Some(n) => {
            list.push(Named::new(1.0 / n, Cause::MotorAngle(n)));
            list.push(Named::new(n, Cause::AngleThroughGearTwice(n)));
        }
        None => {}
    }
    list
}

/// Returns the named factors of a position.
pub(crate) fn factors_of_position(joint: &Joint) -> Vec<f64> {
    positions(joint).iter().map(|named| named.factor).collect()
}

/// Returns the name of a position that must be multiplied by `factor`.
pub(crate) fn of_position(joint: &Joint, factor: f64) -> Option<Name> {
    close(factor, positions(joint))
}

/// Returns the name of a measured velocity that must be multiplied by `factor`.
pub(crate) fn of_velocity(joint: &Joint, factor: f64) -> Option<Name> {
    let mut list = match joint.kind {
        JointKind::Revolute => vec![
            Named::new(core::f64::consts::PI / 30.0, Cause::Rpm),
            Named::new(1.0 / 57.296, Cause::DegreesPerSecond),
            Named::new(core::f64::consts::TAU, Cause::TurnsPerSecond),
        ],
        JointKind::Prismatic => vec![Named::new(1e-3, Cause::MillimetresPerSecond)],
    };
    if let Some(n) = ratio(joint) {
        list.push(Named::new(1.0 / n, Cause::MotorSpeed));
        list.push(Named::new(
            core::f64::consts::PI / (30.0 * n),
            Cause::MotorRpm,
        ));
    }
    close(factor, list)
}
