//! An estimate with its uncertainty.

use rig_output::{format_interval, format_significant, format_value};
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

    /// Returns the 95 % interval, rounded as the value is by its standard deviation; a dash for a value that has none.
    pub fn interval_text(&self) -> String {
        if self.std == 0.0 {
            return "–".to_owned();
        }
        match self.relative() < EXACT {
            true => "less than 0.002 % about the value".to_owned(),
            false => format_interval(self.interval(), self.value, self.std),
        }
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

#[cfg(test)]
mod tests {
    use super::Value;

    #[test]
    fn an_interval_has_the_digits_of_its_width() {
        let of = |value: f64, std: f64| Value::new(value, std).interval_text();
        assert_eq!(of(1499.903, 0.043), "1499.819 to 1499.987");
        assert_eq!(of(25113.0, 58.0), "24999 to 25227");
        assert_eq!(of(1500.0, 0.0), "–");
        assert_eq!(of(1500.0, 1e-3), "less than 0.002 % about the value");
    }
}
