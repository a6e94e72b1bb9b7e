//! An estimate with its uncertainty.

use rig_output::{format_significant, format_value};
use serde::Serialize;

/// Standard deviations that half of a 95 % interval has, for many degrees of freedom.
pub(crate) const NORMAL_95: f64 = 1.96;

/// Standard deviation over the value below which its digits say nothing: no sensor of force or displacement is exact to 0.001 %.
const EXACT: f64 = 1e-5;

/// An estimate with its standard deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Value {
    /// Estimate.
    pub value: f64,
    /// Standard deviation; 0 for a value that was given without one.
    pub std: f64,
}

impl Value {
    /// Creates an estimate.
    pub const fn new(value: f64, std: f64) -> Self {
        Self { value, std }
    }

    /// Returns the 95 % interval of the normal distribution.
    pub fn interval(&self) -> [f64; 2] {
        let half = NORMAL_95 * self.std;
        [self.value - half, self.value + half]
    }

    /// Returns the reciprocal with its standard deviation to first order.
    pub fn reciprocal(&self) -> Self {
        Self::new(1.0 / self.value, self.std / (self.value * self.value))
    }

    /// Returns the value with one standard deviation, or alone if it has none.
    pub fn text(&self) -> String {
        if self.std == 0.0 {
            return format_significant(self.value, 5);
        }
        match self.relative() < EXACT {
            true => format!("{} ± less than 0.001 %", format_significant(self.value, 6)),
            false => format_value(self.value, self.std),
        }
    }

    /// Standard deviation over the magnitude.
    pub fn relative(&self) -> f64 {
        self.std / self.value.abs()
    }
}
