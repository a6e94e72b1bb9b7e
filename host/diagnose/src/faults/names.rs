//! Names of the factors between a column and its right value.

use crate::outcome::FaultKind;
use rig_model::robot::{Joint, JointKind};
use rig_output::format_trimmed;

/// A cause of a factor.
struct Named {
    factor: f64,
    /// Relative frequency of the cause.
    weight: f64,
    name: String,
    /// True if it concerns the gear ratio.
    ratio: bool,
}

impl Named {
    fn new(factor: f64, name: impl Into<String>) -> Self {
        Self {
            factor,
            weight: 1.0,
            name: name.into(),
            ratio: false,
        }
    }

    /// Makes a cause less frequent.
    fn seldom(self) -> Self {
        Self {
            weight: 0.15,
            ..self
        }
    }

    fn of_ratio(self) -> Self {
        Self {
            ratio: true,
            ..self
        }
    }
}

/// The name of a factor.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Name {
    /// All likely causes, the likeliest first, joined.
    pub(crate) text: String,
    /// True if the likeliest concerns the gear ratio.
    pub(crate) ratio: bool,
}

impl Name {
    /// Returns the kind of the fault.
    pub(crate) fn kind(&self) -> FaultKind {
        if self.ratio {
            FaultKind::Ratio
        } else {
            FaultKind::Unit
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
fn ratio(joint: &Joint) -> Option<f64> {
    let ratio = joint.drive.as_ref()?.gear_ratio.abs();
    (ratio > 1.5 || (ratio > 0.0 && ratio < 0.67)).then_some(ratio)
}

/// Returns true if a torque `factor` times too large may come from a ratio that was left out or applied twice.
pub(crate) fn is_ratio(joint: &Joint, factor: f64) -> bool {
    let apart = |r: f64| (factor.abs() / r).ln().abs() <= 1.6f64.ln();
    ratio(joint).is_some_and(|r| apart(r) || apart(1.0 / r))
}

/// Returns the text on a ratio that seems inverted.
fn upside_down(ratio: f64) -> String {
    format!(
        "as if gear_ratio stood upside down: it is {}, motor turns per joint turn are wanted, and {} fits",
        format_trimmed(ratio, 4),
        format_trimmed(1.0 / ratio, 4)
    )
}

/// Joins names, the likeliest first.
fn joined(mut likely: Vec<(f64, Named)>) -> Option<Name> {
    likely.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let ratio = likely.first()?.1.ratio;
    let names: Vec<String> = likely.into_iter().map(|(_, named)| named.name).collect();
    Some(Name {
        text: names.join(", or "),
        ratio,
    })
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
    let (small, large) = match joint.kind {
        JointKind::Revolute => ("mN·m (N·mm)", "kN·m"),
        JointKind::Prismatic => ("mN", "kN"),
    };
    let per_degree = "as a constant per degree would make it";
    let mut list = vec![
        Named::new(
            1000.0,
            format!("as {small} for the joint's unit or mA for A would be (1000 times too large)"),
        ),
        Named::new(
            1e-3,
            format!("as {large} or A for mA would be (1000 times too small)"),
        ),
        Named::new(57.296, per_degree).seldom(),
        Named::new(1.0 / 57.296, per_degree).seldom(),
        Named::new(
            9.549,
            "as a motor constant per rpm (or kgf·cm for N·m) would make it",
        )
        .seldom(),
        Named::new(1.0 / 9.549, "as a motor constant per rpm would make it").seldom(),
    ];
    match ratio(joint) {
        Some(n) if n < 1.0 => list.push(Named::new(n * n, upside_down(n)).of_ratio()),
        Some(n) => {
            let before = format!("as the motor's torque is before its gear ({n} to 1)");
            let twice = format!("as if the gear ratio ({n}) had been applied twice");
            list.push(Named::new(1.0 / n, before).of_ratio());
            list.push(Named::new(n, twice).of_ratio());
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
            Named::new(1.0 / 57.296, "it looks like degrees; give it in rad"),
            Named::new(57.296, "it has been turned from degrees to rad twice"),
            Named::new(
                core::f64::consts::TAU,
                "it looks like turns; give it in rad",
            ),
        ],
        JointKind::Prismatic => vec![
            Named::new(1e-3, "it looks like millimetres; give it in m"),
            Named::new(1000.0, "it has been turned from mm to m twice"),
        ],
    };
    for (factor, word) in [(0.5, "twice"), (2.0, "half")] {
        let text = format!(
            "it is {word} what it should be; check the gear ratio and the counts of the encoder"
        );
        list.push(Named::new(factor, text).of_ratio());
    }
    match ratio(joint) {
        Some(n) if n < 1.0 => list.push(Named::new(n * n, upside_down(n)).of_ratio()),
        Some(n) => {
            let motor =
                format!("it looks like the angle of the motor; divide it by the gear ratio {n}");
            let twice = format!("it has been divided by the gear ratio {n} twice");
            list.push(Named::new(1.0 / n, motor).of_ratio());
            list.push(Named::new(n, twice).of_ratio());
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
            Named::new(core::f64::consts::PI / 30.0, "revolutions per minute"),
            Named::new(1.0 / 57.296, "degrees per second"),
            Named::new(core::f64::consts::TAU, "turns per second"),
        ],
        JointKind::Prismatic => vec![Named::new(1e-3, "millimetres per second")],
    };
    if let Some(n) = ratio(joint) {
        list.push(Named::new(1.0 / n, "the speed of the motor"));
        list.push(Named::new(
            core::f64::consts::PI / (30.0 * n),
            "revolutions per minute of the motor",
        ));
    }
    close(factor, list)
}

/// Returns the name of a clock that runs `factor` times too fast.
pub(crate) fn of_clock(factor: f64) -> &'static str {
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
