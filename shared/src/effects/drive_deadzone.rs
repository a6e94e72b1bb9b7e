//! Voltage that half-bridges lose while both switches are open.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct DriveDeadzone;

impl Law for DriveDeadzone {
    const ABOUT: About = About {
        name: "drive_deadzone",
        law: None,
        title: "dead zone of the inverter",
        equation: "voltage at the motor = commanded voltage − volts · sgn(current)",
        source: "Holtz 1992; volts = dead time · PWM frequency · supply, plus the drop of the switches",
        channel: Channel::Voltage,
        direction: Direction::Indifferent,
        gains: &[Parameter {
            name: "volts",
            unit: "V",
            bounds: [0.0, f64::INFINITY],
            range: [0.05, 3.0],
            scale: Scale::Logarithmic,
            meaning: "voltage that is lost",
        }],
        shapes: &[],
        signature: "in the voltage alone, constant, of the current's sign",
        confused: &[
            Confusion {
                with: "stribeck",
                exact: false,
                separated_by: "a measured current: with the voltage alone, friction at rest and a dead zone look the same",
            },
            Confusion {
                with: "presliding",
                exact: false,
                separated_by: "a measured current",
            },
        ],
        needs: &[Need::Voltage],
        compensable: false,
        leaves_out: "the fade at currents below the ripple",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        [at.drive_torque.sgn(), T::ZERO, T::ZERO, T::ZERO]
    }
}
