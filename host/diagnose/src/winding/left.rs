//! What nothing explains of a motor's voltage.

use crate::judge::BEYOND_FLOOR;
use crate::outcome::{Place, Remainder};
use rig_output::format_significant;

/// Share of what is left of the voltage that a coordinate must explain to be more than an inverter's own unrest …
const LEFT: f64 = 0.2;
/// … or times the floor that is left, whatever it goes with.
const FAR_BEYOND_FLOOR: f64 = 3.0;
/// Least of it, as a share of the voltage: a dead band of the sensor and a dead zone too small for a name left 0.2 and 0.5 %.
const LEAST: f64 = 0.01;
/// Share of the squares that a dead zone takes away which it may leave: no inverter fades just so.
const SHADOW: f64 = 0.02;

/// What a winding's equation leaves of the voltage of a joint.
pub(super) struct Rest<'a> {
    /// Name of the joint.
    pub(super) joint: &'a str,
    /// RMS of the voltage, V.
    pub(super) voltage: f64,
    /// Left without a dead zone and with the one found, V.
    pub(super) rms: [f64; 2],
    /// Of the voltage's noise, V, where a motion was repeated.
    pub(super) floor: Option<f64>,
}

impl Rest<'_> {
    /// What of it is no noise; none where that is nothing to speak of. `place` is what the rest goes with most.
    pub(super) fn remainder(self, place: impl FnOnce() -> Option<Place>) -> Option<Remainder> {
        let [before, rms] = self.rms;
        if rms <= LEAST * self.voltage {
            return None;
        }
        let shadow = SHADOW * (before * before - rms * rms).max(0.0);
        let place = place().filter(|p| p.share > LEFT);
        let far = (self.floor).is_some_and(|floor| rms > FAR_BEYOND_FLOOR * floor);
        let least = (BEYOND_FLOOR * self.floor.unwrap_or(0.0)).powi(2) + shadow;
        if (place.is_none() && !far) || rms * rms <= least {
            return None;
        }
        let noise = match self.floor {
            Some(floor) => floor * floor,
            None => place.as_ref().map_or(1.0, |p| 1.0 - p.share) * rms * rms,
        };
        let left = (rms * rms - noise).max(0.0).sqrt();
        let where_to = place.as_ref().map_or_else(
            || "It goes with neither current nor speed alone.".to_owned(),
            |place| place.text.clone(),
        );
        (left > LEAST * self.voltage).then(|| Remainder {
            joint: self.joint.to_owned(),
            rms: left,
            unit: "V".to_owned(),
            ratio: rms / noise.sqrt().max(f64::MIN_POSITIVE),
            text: format!(
                "Of the motor's voltage at joint {} {} V RMS are left that are no noise, and no effect of the library explains them. {where_to} The inverter may be the cause, or a sensor whose current stands for the torque: then the torque is bent as well. Nothing else is concluded from this voltage.",
                self.joint,
                format_significant(left, 3),
            ),
            places: (place.into_iter()).map(of_the_voltage).collect(),
            doubt: true,
        })
    }
}

/// A place that says of what it is.
pub(super) fn of_the_voltage(place: Place) -> Place {
    Place {
        text: format!("Of the motor's voltage: {}", place.text),
        ..place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left(rms: [f64; 2], floor: Option<f64>, share: f64) -> Option<Remainder> {
        let place = Place {
            joint: "link".into(),
            coordinate: "current of the motor".into(),
            interval: [0.0, 1.0],
            unit: "A".into(),
            share,
            p_value: 1e-6,
            text: String::new(),
        };
        Rest {
            joint: "link",
            voltage: 4.0,
            rms,
            floor,
        }
        .remainder(|| Some(place))
    }

    #[test]
    fn what_is_small_or_goes_with_nothing_is_no_remainder() {
        let found = left([0.1, 0.1], Some(0.05), 0.5);
        assert!(found.is_some_and(|left| (left.ratio - 2.0).abs() < 1e-12));
        // Under a hundredth of the voltage.
        assert!(left([0.03, 0.03], Some(0.01), 0.5).is_none());
        // Neither with the current nor far beyond the floor …
        assert!(left([0.1, 0.1], Some(0.05), 0.1).is_none());
        // … and far beyond it.
        assert!(left([0.2, 0.2], Some(0.05), 0.1).is_some());
        assert!(left([0.2, 0.2], None, 0.1).is_none());
        // What a dead zone of half a volt fades by.
        assert!(left([0.5, 0.07], Some(0.05), 0.5).is_none());
    }
}
