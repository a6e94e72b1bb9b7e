//! Units of columns and their factors to SI.

use std::f64::consts::{PI, TAU};

/// Unit of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Its usual sign in ASCII.
    pub name: &'static str,
    /// Value in SI units of one unit.
    pub factor: f64,
    /// Measured quantities.
    pub of: &'static str,
}

const ANGLE: &str = "angle";
const LENGTH: &str = "length";
const TIME: &str = "time";
const SPEED: &str = "velocity";
const EFFORT: &str = "torque or force";
const CURRENT: &str = "current";
const VOLTAGE: &str = "voltage";

/// Names, the first of which is printed; factor to SI; quantity.
const UNITS: [(&[&str], f64, &str); 38] = [
    (&["rad"], 1.0, ANGLE),
    (&["mrad"], 1e-3, ANGLE),
    (&["deg", "degree", "degrees", "°"], PI / 180.0, ANGLE),
    (&["rev", "turn", "turns"], TAU, ANGLE),
    (&["m"], 1.0, LENGTH),
    (&["mm"], 1e-3, LENGTH),
    (&["in", "inch", "inches"], 0.0254, LENGTH),
    (&["ft", "foot", "feet"], 0.3048, LENGTH),
    (&["s", "sec", "secs", "seconds"], 1.0, TIME),
    (&["ms", "msec", "millis", "milliseconds"], 1e-3, TIME),
    (
        &["us", "µs", "μs", "usec", "micros", "microseconds"],
        1e-6,
        TIME,
    ),
    (&["ns", "nsec", "nanos", "nanoseconds"], 1e-9, TIME),
    (&["rad/s"], 1.0, SPEED),
    (&["deg/s", "°/s", "dps"], PI / 180.0, SPEED),
    (&["rpm"], TAU / 60.0, SPEED),
    (&["rev/s", "rps"], TAU, SPEED),
    (&["m/s"], 1.0, SPEED),
    (&["mm/s"], 1e-3, SPEED),
    (&["in/s"], 0.0254, SPEED),
    (&["ft/s"], 0.3048, SPEED),
    (&["Nm", "N·m", "N*m", "N.m"], 1.0, EFFORT),
    (
        &["mNm", "mN·m", "mN*m", "mN.m", "Nmm", "N·mm", "N*mm"],
        1e-3,
        EFFORT,
    ),
    (&["cNm", "Ncm", "N·cm"], 1e-2, EFFORT),
    (&["kNm", "kN·m"], 1e3, EFFORT),
    (&["kgcm", "kgfcm", "kgf·cm", "kg·cm"], 0.098_066_5, EFFORT),
    // A kilogram-force is 9.80665 N, a pound-force 4.4482216152605 N and a foot 0.3048 m by definition.
    (&["kgfm", "kgf·m", "kgf*m"], 9.806_65, EFFORT),
    (
        &[
            "lbfft", "lbf·ft", "lbf*ft", "ft·lbf", "ft*lbf", "ft-lbf", "lbf-ft", "ft-lb", "lb-ft",
        ],
        1.355_817_948_331_400_4,
        EFFORT,
    ),
    (
        &[
            "lbfin", "lbf·in", "lbf*in", "in·lbf", "in*lbf", "in-lbf", "lbf-in", "in-lb", "lb-in",
        ],
        0.112_984_829_027_616_7,
        EFFORT,
    ),
    (&["kgf"], 9.806_65, EFFORT),
    (&["lbf"], 4.448_221_615_260_5, EFFORT),
    (&["N"], 1.0, EFFORT),
    (&["mN"], 1e-3, EFFORT),
    (&["kN"], 1e3, EFFORT),
    (&["A", "amp", "amps"], 1.0, CURRENT),
    (&["mA"], 1e-3, CURRENT),
    (&["V", "volt", "volts"], 1.0, VOLTAGE),
    (&["mV"], 1e-3, VOLTAGE),
    (&["degC", "°C", "celsius"], 1.0, "temperature"),
];

impl Unit {
    /// Returns the unit of this name. Case counts in short names (`mN` and `MN` are not the same), and not in words.
    pub fn named(name: &str) -> Option<Self> {
        let name = name.trim();
        let fits = |own: &&str| match own.chars().count() {
            ..=3 => *own == name,
            _ => own.eq_ignore_ascii_case(name),
        };
        let found = UNITS.iter().find(|(names, ..)| names.iter().any(fits));
        found.map(|(names, factor, of)| Self {
            name: names.first().copied().unwrap_or_default(),
            factor: *factor,
            of,
        })
    }

    /// Returns all names for a message.
    pub fn list() -> String {
        let names: Vec<&str> = UNITS
            .iter()
            .filter_map(|(names, ..)| names.first().copied())
            .collect();
        names.join(", ")
    }

    /// Splits `q1 [deg]`, `q1 (deg)`, `q1/deg` and `q1_deg` into name and unit. A part behind `_` counts only if it has
    /// two letters or more, because `pos_m` may be a motor, and is neither `in` nor `ft`: an input, a force and torque sensor.
    pub fn split(name: &str) -> Option<(&str, Self)> {
        let name = name.trim();
        for (open, close) in [('[', ']'), ('(', ')')] {
            let parts = name.strip_suffix(close).and_then(|n| n.rsplit_once(open));
            if let Some((name, unit)) = parts {
                return Self::named(unit).map(|unit| (name.trim_end(), unit));
            }
        }
        let (before, unit) = name.rsplit_once(['_', '/', ' '])?;
        let is_long = unit.chars().count() > 1 && !["in", "ft"].contains(&unit);
        (is_long && !before.is_empty())
            .then(|| Self::named(unit).map(|unit| (before.trim_end(), unit)))
            .flatten()
    }

    /// Splits `q1 [grad]` into name and text in the brackets, if that is no known unit.
    pub(super) fn unknown(name: &str) -> Option<(&str, &str)> {
        let name = name.trim();
        [('[', ']'), ('(', ')')]
            .into_iter()
            .find_map(|(open, close)| {
                let (bare, unit) = name.strip_suffix(close)?.rsplit_once(open)?;
                Self::named(unit).is_none().then(|| (bare.trim_end(), unit))
            })
    }

    /// Splits a name like [`Unit::split`], also one whose unit stands before a number: `q_deg_1`, `tau_mNm2`.
    pub fn stated(name: &str) -> Option<(&str, Self)> {
        let before = name.trim().trim_end_matches(|c: char| c.is_ascii_digit());
        Self::split(name).or_else(|| Self::split(before.trim_end_matches(['_', '/', ' '])))
    }

    /// Returns true for a unit of straight motion, false for one of rotation; `None` for another quantity.
    pub fn is_linear(self) -> Option<bool> {
        match self.of {
            LENGTH => Some(true),
            ANGLE => Some(false),
            SPEED => Some(["m/s", "mm/s", "in/s", "ft/s"].contains(&self.name)),
            EFFORT => Some(self.name.ends_with(['N', 'f'])),
            _ => None,
        }
    }

    /// Returns true for a unit of SI as the columns have it.
    pub fn is_si(self) -> bool {
        self.factor == 1.0
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn units_are_found_in_names_as_people_write_them() {
        for (text, name, unit) in [
            ("q1 [deg]", "q1", "deg"),
            ("q1(°)", "q1", "deg"),
            ("Time (ms)", "Time", "ms"),
            ("time_us", "time", "us"),
            ("tau1 [N·m]", "tau1", "Nm"),
            ("speed_rpm", "speed", "rpm"),
            ("q1/rad", "q1", "rad"),
            ("dx [in]", "dx", "in"),
            ("q2 (ft)", "q2", "ft"),
            ("mx [in*lbf]", "mx", "lbfin"),
        ] {
            let (found, own) = Unit::split(text).unwrap();
            assert_eq!((found, own.name), (name, unit), "{text}");
        }
        for text in [
            "q1",
            "q_m",
            "position_2",
            "tau_J",
            "i [x]",
            "_deg",
            "u_in",
            "fx_ft",
        ] {
            assert!(Unit::split(text).is_none(), "{text}");
        }
        assert_eq!(Unit::unknown("q1 [grad]"), Some(("q1", "grad")));
        assert!(Unit::unknown("q1 [deg]").is_none() && Unit::unknown("q1").is_none());
        assert_eq!(Unit::named("Nmm").unwrap().factor, 1e-3);
        for (text, unit) in [
            ("q_deg1", "deg"),
            ("tau_mNm_2", "mNm"),
            ("speed_rpm", "rpm"),
        ] {
            assert_eq!(Unit::stated(text).unwrap().1.name, unit, "{text}");
        }
        for text in ["q1", "q_m1", "position_2", "deg1", "12"] {
            assert!(Unit::stated(text).is_none(), "{text}");
        }
        let linear = |name| Unit::named(name).unwrap().is_linear();
        for name in [
            "m", "mm", "in", "ft", "m/s", "mm/s", "in/s", "N", "mN", "kN", "kgf", "lbf",
        ] {
            assert_eq!(linear(name), Some(true), "{name}");
        }
        for name in ["rad", "deg/s", "rpm", "Nm", "kgcm", "kgfm", "lbfft"] {
            assert_eq!(linear(name), Some(false), "{name}");
        }
        assert!(Unit::named("MN").is_none());
        // By definition an inch is 0.0254 m, a foot 12 of them, and a pound-force 0.45359237 kg times 9.80665 m/s².
        let factor = |name| Unit::named(name).unwrap().factor;
        for (name, exact) in [
            ("feet", 12.0 * factor("inch")),
            ("lbf", 0.453_592_37 * 9.806_65),
            ("ft*lbf", factor("lbf") * factor("ft")),
            ("in*lbf", factor("lbf") * factor("in")),
        ] {
            assert!((factor(name) / exact - 1.0).abs() < 1e-14, "{name}");
        }
        assert!((Unit::named("rpm").unwrap().factor * 60.0 - TAU).abs() < 1e-15);
    }
}
