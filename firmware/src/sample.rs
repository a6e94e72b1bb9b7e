//! Interface between the control application and the board or emulated rig.

use rig_shared::safety::monitor::Breaks;
use rig_shared::units::{AdcCode, Duty, EncoderCount};

/// Clock of the timer that captures the encoder's edges, Hz.
pub const EDGE_CLOCK_HZ: u32 = 170_000_000;

/// Pulses of the bridge per second. A pulse drives for the share |duty| of its period and brakes for the rest.
pub const PWM_HZ: u32 = 20_000;

/// Longest time from the middle of the current's samples to the first or last of them, ns.
pub const SAMPLE_HALF_SPAN_NS: u32 = 1310;

/// Inputs of one control tick, started by one hardware trigger. A converter reads its inputs one after the other, and
/// the encoder is read afterwards: on the board about 9 µs after the middle of the current's samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sample {
    /// Encoder timer, motor side.
    pub encoder: EncoderCount,
    /// Time from the encoder's last edge to that reading, in periods of [`EDGE_CLOCK_HZ`], if a timer has captured the
    /// edge.
    pub edge_age: Option<u32>,
    /// Motor current, converter code.
    pub current: AdcCode,
    /// Supply voltage, converter code.
    pub supply: AdcCode,
    /// Motor temperature, converter code.
    pub temperature: AdcCode,
    /// What has switched the bridge's outputs off.
    pub breaks: Breaks,
    /// Control ticks that were missed since the last one, or finished after the next was due.
    pub late_ticks: u8,
    /// Counts by which the encoder's index disagrees, or 0 if both channels changed at once; `None` without
    /// contradiction.
    pub encoder_wrong: Option<i32>,
    /// One of the encoder's wires is undriven.
    pub encoder_open: bool,
    /// The stop switch is open, or its wire is broken. Never true if no switch is fitted.
    pub stop_switch_open: bool,
    /// Remaining bytes if the stack is near its end.
    pub stack_left: Option<u32>,
}

/// Output of one control tick. It takes effect at the next tick's sampling instant (preloaded PWM).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Bridge duty cycle; 0 while the bridge is off.
    pub duty: Duty,
    /// True if the bridge's outputs are driven. Off leaves the motor open-circuit.
    pub bridge: bool,
}

/// Linear conversion of converter codes: quantity = (code − zero) · per_code.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaling {
    /// Code at zero current (nominal; the offset is measured at start).
    pub current_zero: f32,
    /// A per code.
    pub current_per_code: f32,
    /// V per code, zero at code 0.
    pub supply_per_code: f32,
    /// Temperature at code 0, °C.
    pub temperature_at_zero: f32,
    /// °C per code.
    pub temperature_per_code: f32,
}

/// Allowed ratio of the converter's reference to the nominal one: the range of a working regulator.
const SUPPLY: [f32; 2] = [0.94, 1.06];

impl Scaling {
    /// Corrects the scaling for a converter reference of `supply` times its nominal 3.3 V. Returns false if no working
    /// board has that reference. The current's zero stays: amplifier and converter share that reference.
    pub fn correct(&mut self, supply: f32) -> bool {
        let possible = (SUPPLY[0]..=SUPPLY[1]).contains(&supply);
        if possible {
            self.current_per_code *= supply;
            self.supply_per_code *= supply;
            self.temperature_per_code *= supply;
        }
        possible
    }
}

impl Default for Scaling {
    /// Returns the scaling of a mid-supply current sense of ±16.5 A, a 1:11 supply divider and a 10 mV/K sensor with
    /// 0.5 V at 0 °C (the common analogue one) into a 3.3 V, 12-bit converter.
    fn default() -> Self {
        Self {
            current_zero: 2048.0,
            current_per_code: 33.0 / 4096.0,
            supply_per_code: 3.3 * 11.0 / 4096.0,
            temperature_at_zero: -50.0,
            temperature_per_code: 330.0 / 4096.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_mean_more_of_a_higher_reference() {
        let nominal = Scaling::default();
        let mut scaling = nominal;
        assert!(scaling.correct(1.0));
        assert_eq!(scaling, nominal);
        assert!(scaling.correct(1.03));
        assert!((scaling.current_per_code / nominal.current_per_code - 1.03).abs() < 1e-6);
        for impossible in [0.5, 1.2, f32::NAN, f32::INFINITY] {
            let mut scaling = nominal;
            assert!(!scaling.correct(impossible));
            assert_eq!(scaling, nominal);
        }
    }
}
