//! Faults of a description, each with the way to its place, and the checks of single numbers.

use super::joint::Joint;

/// Largest number of a description, in its written unit. It exceeds every robot's values, and products of such numbers
/// do not overflow.
pub(super) const LARGEST: f64 = 1e12;

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
    pub way: Vec<Step>,
    pub what: String,
    pub found: String,
    pub right: String,
}

/// Returns the fault of a number.
pub(super) fn fault(way: &[Step], what: &str, found: &f64, right: &str) -> Fault {
    Fault {
        way: way.to_vec(),
        what: what.into(),
        found: written(*found),
        right: right.into(),
    }
}

/// Returns a number in the form that a person writes.
pub fn written(value: f64) -> String {
    let small = value != 0.0 && value.abs() < 1.0 / LARGEST;
    if (sound(value) && !small) || !value.is_finite() {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// Returns true if products of `value` do not overflow.
pub fn sound(value: f64) -> bool {
    value.abs() <= LARGEST
}

/// Requirement on a number.
#[derive(Clone, Copy)]
pub(super) enum Must {
    Finite,
    Positive,
    /// Greater than 0, of any size: a very large limit means no limit.
    Limit,
    NotNegative,
    NotZero,
}

pub(super) fn number(
    joint: &Joint,
    way: &[Step],
    what: &str,
    unit: &str,
    must: Must,
    value: f64,
) -> Result<(), Fault> {
    let (good, right) = match must {
        Must::Finite => (true, "a finite number"),
        Must::Positive | Must::Limit => (value > 0.0, "greater than 0"),
        Must::NotNegative => (value >= 0.0, "0 or greater"),
        Must::NotZero => (value != 0.0, "different from 0"),
    };
    let large = !matches!(must, Must::Limit) && value.is_finite() && !sound(value);
    if good && value.is_finite() && !large {
        return Ok(());
    }
    let what = format!("the {what} of joint `{}`", joint.name);
    let right = if large {
        format!("it must be at most {LARGEST:e} in {unit}")
    } else {
        format!("it must be {right}, in {unit}")
    };
    Err(fault(way, &what, &value, &right))
}
