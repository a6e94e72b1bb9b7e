//! The mass of a weighed load against the identified one: the one thing that a factor in all readings changes.
//!
//! A factor in all forces and moments, or in all torques, gives a load that weighs so much more and fits as well. So neither
//! poses nor a motion show it: only a mass that is known otherwise does.

use rig_data::{Unit, WRENCH_COLUMNS};
use rig_output::{format_significant, format_value};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::error::LoadError;
use crate::estimate::{CONTRADICTS, Estimate};
use crate::gain_error::ACCURACY;
use crate::options::{By, KnownMass};

/// Units of forces that a driver may give instead of N, with the unit of the moments that goes with each.
const UNITS: [[&str; 2]; 3] = [["kgf", "kgfm"], ["lbf", "lbfft"], ["mN", "mNm"]];

/// Comparison of the identified mass with a known one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MassCheck {
    /// What the load was measured by: the sensor or the torques.
    pub by: By,
    /// The known mass.
    pub known: KnownMass,
    /// Identified mass over the known one.
    pub factor: f64,
    /// Standard deviation of the factor.
    pub std: f64,
    /// Probability that both differ by chance as much as they do (Student's t).
    pub chance: f64,
}

impl MassCheck {
    /// Compares an estimate of the load with what is known of its mass. `beside` is the mass of a known tool that the
    /// estimate contains, kg. `None` if the data do not show the mass.
    pub(crate) fn of(found: &Estimate, by: By, known: KnownMass, beside: f64) -> Option<Self> {
        if !found.shown()[0] {
            return None;
        }
        let (all, own) = (known.mass + beside, found.std()[0]);
        let factor = found.values[0] / all;
        let std = own.hypot(factor * known.std) / all;
        let mut check = Self {
            by,
            known,
            factor,
            std,
            chance: 1.0,
        };
        check.chance = chance((factor - 1.0) / std, found.degrees_of_freedom);
        Some(check)
    }

    /// Returns true if the identified mass contradicts the known one.
    pub(crate) fn contradicts(&self) -> bool {
        self.chance < CONTRADICTS
    }

    /// Says how the masses differ; `None` if by no more than chance. `confirmed` if the other measurement, torques or sensor,
    /// shows the known mass and not this one.
    ///
    /// # Errors
    /// [`LoadError::Fault`] with the unit that the forces look like. `places` are the identified centre of mass and the
    /// origin of the sensor in the flange frame, m.
    pub(crate) fn words(
        &self,
        confirmed: bool,
        places: [[f64; 3]; 2],
        degrees_of_freedom: usize,
    ) -> Result<Option<String>, LoadError> {
        if !self.contradicts() {
            return Ok(None);
        }
        let factor = format_value(self.factor, self.std);
        let known = format_significant(self.known.mass, 4);
        let [shown, other, cause] = match self.by {
            By::Torque => [
                "The joint torques show",
                "the sensor confirms",
                "the torque constants of the joints that carry it look",
            ],
            By::Sensor | By::Both => match self.unit(degrees_of_freedom) {
                Some(units) => {
                    return Err(LoadError::Fault(unit_words(units, &factor, &known, places)));
                }
                None => [
                    "The sensor shows",
                    "the joint torques confirm",
                    "the gains of the forces look",
                ],
            },
        };
        if !confirmed && self.is_in_grams(degrees_of_freedom) {
            return Ok(Some(format!(
                "{shown} {factor} times the known mass of {known} kg (± one standard deviation): --mass looks like grams, and it is in kg."
            )));
        }
        let end = match confirmed {
            true => format!("; {other} the known mass."),
            false => ", or the known mass is.".to_owned(),
        };
        Ok(Some(format!(
            "{shown} {factor} times the known mass of {known} kg (± one standard deviation): {cause} off by this factor{end}"
        )))
    }

    /// Returns true if another measurement shows the known mass, and not that of this one.
    pub(crate) fn is_refuted_by(&self, other: &Self, degrees_of_freedom: usize) -> bool {
        !other.contradicts() && self.differs_from(other, degrees_of_freedom)
    }

    fn differs_from(&self, other: &Self, degrees_of_freedom: usize) -> bool {
        let deviations = (self.factor - other.factor) / self.std.hypot(other.std);
        chance(deviations, degrees_of_freedom) < CONTRADICTS
    }

    /// Says that sensor and torques show the same mass, and that it is not the known one; `None` if this is not so.
    pub(crate) fn both(sensor: &Self, torque: &Self, degrees_of_freedom: usize) -> Option<String> {
        let same = !sensor.differs_from(torque, degrees_of_freedom);
        (same && sensor.contradicts() && torque.contradicts()).then(|| {
            let [a, b] = [sensor, torque].map(|c| format_value(c.factor, c.std));
            format!(
                "The sensor shows {a} times the known mass of {} kg, and the joint torques show {b} times (± one standard deviation): two measurements agree, so the known mass looks wrong. Check its unit (--mass is in kg), what was weighed, and what else is mounted at the flange (--subtract).",
                format_significant(sensor.known.mass, 4)
            )
        })
    }

    /// Returns true if the known mass is a thousand times the identified one, within the accuracy of a sound sensor.
    fn is_in_grams(&self, degrees_of_freedom: usize) -> bool {
        let std = (self.std / self.factor).hypot(ACCURACY);
        chance((1e3 * self.factor - 1.0) / std, degrees_of_freedom) >= CONTRADICTS
    }

    /// Returns the units of forces and moments that the factor is that of, within the accuracy of a sound sensor.
    fn unit(&self, degrees_of_freedom: usize) -> Option<[&'static str; 2]> {
        UNITS.into_iter().find(|[force, _]| {
            // A reading in a larger unit is a smaller number.
            let is = self.factor * Unit::named(force).map_or(f64::NAN, |unit| unit.factor);
            let std = (self.std / self.factor).hypot(ACCURACY);
            chance((is - 1.0) / std, degrees_of_freedom) >= CONTRADICTS
        })
    }
}

/// Probability by chance of a deviation of either sign, in standard deviations.
fn chance(deviations: f64, degrees_of_freedom: usize) -> f64 {
    let freedom = degrees_of_freedom.max(1) as f64;
    match StudentsT::new(0.0, 1.0, freedom) {
        Ok(t) if deviations.is_finite() => 2.0 * t.sf(deviations.abs()),
        _ => 0.0,
    }
}

fn unit_words(
    [force, moment]: [&str; 2],
    factor: &str,
    known: &str,
    [centre, origin]: [[f64; 3]; 2],
) -> String {
    let [forces, moments] = [(0, force), (3, moment)].map(|(first, unit)| {
        let columns = &WRENCH_COLUMNS[first..first + 3];
        let all: Vec<String> = (columns.iter().map(|c| format!("--unit {c}={unit}"))).collect();
        all.join(" ")
    });
    let shorter = Unit::named(force).map_or(1.0, |unit| unit.factor);
    // The lever arm of the moments begins at the origin of the sensor.
    let place = |by: f64| -> String {
        let at = |k: usize| origin[k] + (centre[k] - origin[k]) / by;
        [0, 1, 2].map(|k| format_significant(at(k), 3)).join(", ")
    };
    format!(
        "The sensor shows {factor} times the known mass of {known} kg: the forces look like {force}. Give {forces}, and {moments} as well if the centre of mass is at {} m in the flange frame; with the moments in N·m it is at {} m.",
        place(1.0),
        place(shorter)
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_factor_is_judged_by_its_standard_deviation() {
        let known = KnownMass {
            mass: 2.0,
            std: 0.0,
        };
        let check = |factor: f64, std: f64| MassCheck {
            by: By::Torque,
            known,
            factor,
            std,
            chance: chance((factor - 1.0) / std, 19),
        };
        let said = |factor, std| check(factor, std).words(false, [[0.0; 3]; 2], 19).unwrap();
        assert_eq!(said(1.12, 0.05), None);
        let text = said(1.12, 0.01).unwrap();
        assert!(text.contains("1.120 ± 0.010 times"), "{text}");
        // 2 kg that were given as 2000.
        let text = said(0.00099995, 1e-7).unwrap();
        assert!(text.contains("--mass looks like grams"), "{text}");
        assert!(!said(0.0011, 1e-7).unwrap().contains("grams"));
        // Student's t of 19 degrees of freedom: 3.883 has two tails of 0.001.
        assert!(!check(1.0387, 0.01).contradicts() && check(1.0390, 0.01).contradicts());
    }

    #[test]
    fn two_measurements_that_agree_blame_the_known_mass() {
        let known = KnownMass {
            mass: 2.0,
            std: 0.0,
        };
        let check = |by: By, factor: f64, std: f64| MassCheck {
            by,
            known,
            factor,
            std,
            chance: chance((factor - 1.0) / std, 19),
        };
        let sensor = check(By::Sensor, 1.12, 0.001);
        let torque = |factor, std| check(By::Torque, factor, std);
        let both = |torque: &MassCheck| MassCheck::both(&sensor, torque, 19);
        let text = both(&torque(1.10, 0.01)).unwrap();
        assert!(text.contains("the known mass looks wrong"), "{text}");
        // One that differs, and one that cannot tell.
        assert_eq!(both(&torque(1.01, 0.01)), None);
        assert_eq!(both(&torque(1.05, 0.08)), None);
        let words = |other: &MassCheck| {
            let confirmed = sensor.is_refuted_by(other, 19);
            sensor.words(confirmed, [[0.0; 3]; 2], 19).unwrap().unwrap()
        };
        assert!(words(&torque(1.01, 0.01)).contains("the joint torques confirm the known mass"));
        assert!(words(&torque(1.05, 0.08)).contains("or the known mass is"));
    }
}
