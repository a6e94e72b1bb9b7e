//! Units of forces and moments that sensors and their drivers use.

use rig_data::WRENCH_COLUMNS;

use crate::settle::{DECISIVE, settled};
use crate::system::{Fit, Nuisance, Sensed};

/// A pair of units of which the ratio is not that of N·m and N.
#[derive(Debug)]
pub(crate) struct Unit {
    /// Unit of the forces and of the moments as the option `--unit` has them; `None` for N and N·m.
    forces: Option<&'static str>,
    moments: Option<&'static str>,
    /// Names it in a sentence.
    pub words: &'static str,
}

impl Unit {
    const fn of_forces(name: &'static str, words: &'static str) -> Self {
        Self {
            forces: Some(name),
            moments: None,
            words,
        }
    }

    const fn of_moments(name: &'static str, words: &'static str) -> Self {
        Self {
            forces: None,
            moments: Some(name),
            words,
        }
    }

    const fn of_both([force, moment]: [&'static str; 2], words: &'static str) -> Self {
        Self {
            forces: Some(force),
            moments: Some(moment),
            words,
        }
    }

    /// Returns the moments as read per moment in N·m, over the forces as read per force in N.
    fn factor(&self) -> f64 {
        let si = |name: Option<&str>| {
            let unit = name.and_then(rig_data::Unit::named);
            unit.map_or(1.0, |unit| unit.factor)
        };
        si(self.forces) / si(self.moments)
    }

    /// Returns the options of the command that convert it.
    pub(crate) fn options(&self) -> String {
        let (forces, moments) = WRENCH_COLUMNS.split_at(3);
        let of = |columns: &[&str], unit: Option<&str>| -> Vec<String> {
            let each = |unit: &str| {
                columns
                    .iter()
                    .map(move |c| format!("--unit {c}={unit}"))
                    .collect()
            };
            unit.map_or_else(Vec::new, each)
        };
        [of(forces, self.forces), of(moments, self.moments)]
            .concat()
            .join(" ")
    }
}

const UNITS: [Unit; 11] = [
    Unit::of_moments("Nmm", "the moments look like N·mm"),
    Unit::of_moments("Ncm", "the moments look like N·cm"),
    Unit::of_forces("kgf", "the forces look like kgf"),
    Unit::of_moments("kgfm", "the moments look like kgf·m"),
    Unit::of_moments("kgfcm", "the moments look like kgf·cm"),
    Unit::of_forces("mN", "the forces look like mN"),
    Unit::of_forces("lbf", "the forces look like lbf"),
    Unit::of_moments("lbfft", "the moments look like lbf·ft"),
    Unit::of_moments("lbfin", "the moments look like lbf·in"),
    Unit::of_both(
        ["lbf", "lbfft"],
        "forces and moments look like lbf and lbf·ft",
    ),
    Unit::of_both(
        ["lbf", "lbfin"],
        "forces and moments look like lbf and lbf·in",
    ),
];

/// Ratio of a scale to that of a unit beyond which it is not tried.
const NEAR: f64 = 1.5;

/// Returns the units that explain the readings as well as the estimated scale of the moments does.
pub(crate) fn named(sensed: &Sensed, fit: &Fit) -> Vec<&'static Unit> {
    let unknowns = fit.unknowns.without(Nuisance::Scale);
    let found = UNITS.iter().filter(|unit| {
        let change = unit.factor() / fit.mounting.scale;
        let fixed = |change: f64| settled(sensed, &fit.mounting.scaled(change), &unknowns).misfit();
        change.ln().abs() < NEAR.ln() && fixed(change) < fit.misfit() + DECISIVE
    });
    found.collect()
}

/// Lists the units in words, and the options that convert them.
pub(crate) fn alternatives(units: &[&Unit]) -> [String; 2] {
    let words: Vec<&str> = units.iter().map(|unit| unit.words).collect();
    let options: Vec<String> = units.iter().map(|unit| unit.options()).collect();
    [words.join(", or "), options.join(", or ")]
}

/// Distances of a centre of mass from the sensor that a load at a wrist has, m.
const LEVERS: [f64; 2] = [0.005, 0.5];

/// Returns the units of the moments for which the centre of mass of a load lies at a usual distance from the sensor.
/// `lever` is that in N and N·m.
pub(crate) fn by_lever(lever: f64) -> Vec<&'static Unit> {
    let [near, far] = LEVERS;
    let found = UNITS.iter().filter(|unit| {
        let is_simple = unit.forces.is_none() && unit.factor() >= 100.0;
        is_simple && (near..far).contains(&(lever / unit.factor()))
    });
    found.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A foot is 0.3048 m and an inch 0.0254 m, whatever the force.
    #[test]
    fn factors_are_those_of_the_definitions() {
        let factor = |words: &str| {
            let found = UNITS.iter().find(|unit| unit.words.ends_with(words));
            found.map_or(f64::NAN, Unit::factor)
        };
        for (words, definition) in [
            ("look like N·mm", 1e3),
            ("forces look like kgf", 9.806_65),
            ("look like kgf·m", 1.0 / 9.806_65),
            ("look like kgf·cm", 1.0 / 0.098_066_5),
            ("forces look like mN", 1e-3),
            ("lbf and lbf·ft", 1.0 / 0.3048),
            ("lbf and lbf·in", 1.0 / 0.0254),
        ] {
            assert!((factor(words) / definition - 1.0).abs() < 1e-12, "{words}");
        }
        // A name that the reader of recordings does not know would count as SI.
        let names = UNITS
            .iter()
            .flat_map(|unit| [unit.forces, unit.moments])
            .flatten();
        assert!(
            names
                .into_iter()
                .all(|name| rig_data::Unit::named(name).is_some())
        );
    }
}
