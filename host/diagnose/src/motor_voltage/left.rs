//! Unexplained remainder of a motor's voltage.

use crate::levels::BEYOND_FLOOR;
use crate::motor_voltage::winding::Left;
use crate::outcome::Place;

/// Least share of the residual that a coordinate must explain; an inverter's own noise explains less …
const LEFT: f64 = 0.2;
/// … or least ratio of the residual to its floor, without a coordinate.
const FAR_BEYOND_FLOOR: f64 = 3.0;
/// Least residual as a share of the voltage: a sensor's dead band and an unnamed small dead zone left 0.2 and 0.5 %.
const LEAST: f64 = 0.01;
/// Share of a dead zone's squares that it may leave: no inverter fades exactly like the law.
const SHADOW: f64 = 0.02;

/// Residual of a winding's equation on the voltage of a joint.
pub(crate) struct Rest<'a> {
    /// Name of the joint.
    pub(crate) joint: &'a str,
    /// RMS of the voltage, V.
    pub(crate) voltage: f64,
    /// Residual RMS without a dead zone and with the one found, V.
    pub(crate) rms: [f64; 2],
    /// Noise floor of the voltage, V, if a motion was repeated.
    pub(crate) floor: Option<f64>,
}

impl Rest<'_> {
    /// Returns what is above the noise, unless negligible. `place` is the residual's strongest dependence.
    pub(crate) fn left(self, place: impl FnOnce() -> Option<Place>) -> Option<Left> {
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
        (left > LEAST * self.voltage).then(|| Left {
            joint: self.joint.to_owned(),
            rms: left,
            ratio: rms / noise.sqrt().max(f64::MIN_POSITIVE),
            place,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left(rms: [f64; 2], floor: Option<f64>, share: f64) -> Option<Left> {
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
        .left(|| Some(place))
    }

    #[test]
    fn what_is_small_or_goes_with_nothing_is_no_remainder() {
        let found = left([0.1, 0.1], Some(0.05), 0.5);
        assert!(found.is_some_and(|left| (left.ratio - 2.0).abs() < 1e-12));
        // Less than a hundredth of the voltage.
        assert!(left([0.03, 0.03], Some(0.01), 0.5).is_none());
        // Neither related to the current nor far above the floor …
        assert!(left([0.1, 0.1], Some(0.05), 0.1).is_none());
        // … and far above it.
        assert!(left([0.2, 0.2], Some(0.05), 0.1).is_some());
        assert!(left([0.2, 0.2], None, 0.1).is_none());
        // The fading of a dead zone of half a volt.
        assert!(left([0.5, 0.07], Some(0.05), 0.5).is_none());
    }
}
