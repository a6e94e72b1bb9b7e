//! Faults of a description, each with the path of its key, and the checks of single numbers.

use super::joint::Joint;

/// Largest number of a description, in its written unit. It exceeds every robot's values, and products of such numbers
/// do not overflow.
pub(super) const MAX_NUMBER: f64 = 1e12;

/// One step of the path to a value in the tree of a description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// A key of a table.
    Key(&'static str),
    /// An index of a list.
    At(usize),
    /// A key of a table whose keys are names.
    Name(String),
}

/// A value that cannot be right.
#[derive(Debug)]
pub(super) struct Fault {
    pub key_path: Vec<Step>,
    pub what: String,
    pub found: String,
    pub advice: String,
}

/// Returns the fault of a number.
pub(super) fn fault(key_path: &[Step], what: &str, found: &f64, advice: &str) -> Fault {
    Fault {
        key_path: key_path.to_vec(),
        what: what.into(),
        found: written(*found),
        advice: advice.into(),
    }
}

/// Returns a number in the form that a person writes.
pub fn written(value: f64) -> String {
    let small = value != 0.0 && value.abs() < 1.0 / MAX_NUMBER;
    if (is_safe_magnitude(value) && !small) || !value.is_finite() {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// Returns true if products of `value` do not overflow.
pub fn is_safe_magnitude(value: f64) -> bool {
    value.abs() <= MAX_NUMBER
}

/// Requirement on a number.
#[derive(Clone, Copy)]
pub(super) enum Requirement {
    Finite,
    Positive,
    /// Greater than 0, of any size: a very large limit means no limit.
    Limit,
    NotNegative,
    NotZero,
}

pub(super) fn number(
    joint: &Joint,
    key_path: &[Step],
    what: &str,
    unit: &str,
    requirement: Requirement,
    value: f64,
) -> Result<(), Fault> {
    let (valid, advice) = match requirement {
        Requirement::Finite => (true, "a finite number"),
        Requirement::Positive | Requirement::Limit => (value > 0.0, "greater than 0"),
        Requirement::NotNegative => (value >= 0.0, "0 or greater"),
        Requirement::NotZero => (value != 0.0, "different from 0"),
    };
    let large = !matches!(requirement, Requirement::Limit)
        && value.is_finite()
        && !is_safe_magnitude(value);
    if valid && value.is_finite() && !large {
        return Ok(());
    }
    let what = format!("the {what} of joint `{}`", joint.name);
    let advice = if large {
        format!("it must be at most {MAX_NUMBER:e} in {unit}")
    } else {
        format!("it must be {advice}, in {unit}")
    };
    Err(fault(key_path, &what, &value, &advice))
}
