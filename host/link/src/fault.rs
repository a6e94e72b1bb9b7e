//! Faults of the board in words: the event, its value with unit, and the remedy.
//!
//! The table in docs/firmware.md gives more detail.

use rig_shared::safety::monitor::Breaks;
use rig_shared::safety::{Fault, FaultRecord};

use rig_output::format_significant;

/// Describes a latched fault, its time and its remedy in sentences. The name of the fault is in brackets, as in
/// docs/firmware.md. `control_rate` is the rate in the rig's greeting, ticks per second.
///
/// # Errors
/// None: a value that is not a number is written as such.
pub fn describe_fault(record: &FaultRecord, control_rate: f64) -> String {
    let at = record.tick as f64 / control_rate.max(f64::MIN_POSITIVE);
    format!(
        "{} [{:?}, at t = {at:.4} s]. {}",
        happened(record.fault, f64::from(record.value)),
        record.fault,
        remedy(record.fault)
    )
}

/// Describes the event, with the value in its unit; a clause without a full stop.
fn happened(fault: Fault, value: f64) -> String {
    let number = format_significant(value, 4);
    match fault {
        Fault::Driver => driver(Breaks(value as u8)).to_owned(),
        Fault::OverCurrent => format!("The motor current was too high: {number} A"),
        Fault::AdcStuck => format!(
            "The current reading stayed at one end of its range or did not change: converter code {number} of 0 to 4095"
        ),
        Fault::CurrentOffset => format!(
            "The current reading was {number} A at the start, while the bridge was off; at most 0.5 A is allowed"
        ),
        Fault::EncoderJump => format!(
            "The encoder jumped by {number} counts within one control tick, which is more than the motor can turn"
        ),
        Fault::EncoderLost => format!(
            "The encoder was lost: current and encoder leave {number} V of the motor's voltage unexplained"
        ),
        Fault::OverSpeed => format!(
            "The joint was too fast: {number} rad/s, more than 1.25 times its velocity limit"
        ),
        Fault::Position => {
            format!("The joint was at {number} rad, more than 0.1 rad beyond its position limits")
        }
        Fault::Supply => {
            format!("The supply voltage was {number} V; it must be between 18 V and 30 V")
        }
        Fault::Temperature => {
            format!("The motor or the bridge was at {number} °C; at most 85 °C is allowed")
        }
        Fault::Overload => format!(
            "The motor was overloaded: its thermal mean current of {number} A is above its continuous rating"
        ),
        Fault::Deadline => "A control tick did not finish in its period".to_owned(),
        Fault::HostSilent => format!("The rig heard nothing from this program for {number} s"),
        // If both channels change at once, there is no count.
        Fault::EncoderSignal if value == 0.0 => {
            "Both channels of the encoder changed at the same time".to_owned()
        }
        Fault::EncoderSignal => {
            format!("The index pulse of the encoder came {number} counts from where it belongs")
        }
        Fault::StopSwitch => {
            "The stop switch was opened, or its wire is broken; the motion was stopped".to_owned()
        }
        Fault::Stack => {
            format!(
                "The memory for the program's stack was nearly used up: {number} bytes were left"
            )
        }
    }
}

/// Describes what switched the outputs off: the sum of the causes.
fn driver(breaks: Breaks) -> &'static str {
    let line = breaks.has_any(Breaks::DRIVER);
    match (line, breaks.has_any(Breaks::OVER_CURRENT)) {
        _ if breaks.has_any(Breaks::CHIP) => {
            "The chip switched its outputs off by itself: its supply fell below 2.8 V, its clock stopped, a flash word was wrong, or its processor locked up"
        }
        (true, true) => {
            "The motor driver pulled its fault line, and the comparators saw a motor current beyond their limit"
        }
        (true, false) => {
            "The motor driver pulled its fault line; the comparators saw no over-current"
        }
        (false, _) => "The motor driver reported a fault, or the chip switched its outputs off",
    }
}

/// Returns likely causes and their remedy, as sentences.
fn remedy(fault: Fault) -> &'static str {
    match fault {
        Fault::Driver => {
            "Check the motor's wires for a short circuit, the temperature of the bridge and its supply, and the chip's own supply."
        }
        Fault::OverCurrent => {
            "Check the motor's wires for a short circuit, and resistance and inductance in the nameplate or description."
        }
        Fault::AdcStuck => {
            "Check the wire and the supply of the current sensor. If the code is near 0 or 4095, the current went beyond the sensor's range (±16.5 A): lower limits.torque, or correct gear_ratio and torque_constant in the description."
        }
        Fault::CurrentOffset => {
            "Let the motor stand still while the rig starts, and check the reference of the current amplifier."
        }
        Fault::EncoderJump => {
            "Check the encoder's cable, its shield and its counts per turn in the nameplate or description."
        }
        Fault::EncoderLost => {
            "Check the encoder's cable and supply, the motor's wires, and that motor and encoder count in the same direction. Check encoder_counts_per_rev, gear_ratio, torque_constant and resistance too."
        }
        Fault::OverSpeed => {
            "Check the direction of motor and encoder, and that the motion leaves a margin to limits.velocity. A model of the link or a gear_ratio that is far off makes a controller overshoot."
        }
        Fault::Position => {
            "Check the direction of motor and encoder, --home, and that the motion leaves a margin to limits.position."
        }
        Fault::Supply => {
            "Check the supply, the emergency stop, and the bulk capacitor that takes up the braking energy."
        }
        Fault::Temperature => "Let the motor cool, and check the wire of the temperature sensor.",
        Fault::Overload => {
            "Let the motor cool to half of its rating. Then run a slower or smaller motion, or free the link if it was blocked."
        }
        Fault::StopSwitch => {
            "Close the switch and clear the fault. If nobody opened it, check its wire and the strap."
        }
        Fault::Deadline | Fault::Stack => {
            "This is an error of the firmware: please report it with the control ticks around the fault."
        }
        Fault::HostSilent => {
            "Check the cable, and that this program was not stopped or suspended meanwhile."
        }
        Fault::EncoderSignal => {
            "Check the encoder's cable and its index wire: they are disturbed, worn or loose."
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [(Fault, &str); 16] = [
        (Fault::Driver, ""),
        (Fault::OverCurrent, "1.471 A"),
        (Fault::AdcStuck, "code 1.471"),
        (Fault::CurrentOffset, "1.471 A"),
        (Fault::EncoderJump, "1.471 counts"),
        (Fault::EncoderLost, "1.471 V"),
        (Fault::OverSpeed, "1.471 rad/s"),
        (Fault::Position, "1.471 rad"),
        (Fault::Supply, "1.471 V"),
        (Fault::Temperature, "1.471 °C"),
        (Fault::Overload, "1.471 A"),
        (Fault::Deadline, ""),
        (Fault::HostSilent, "1.471 s"),
        (Fault::EncoderSignal, "1.471 counts"),
        (Fault::Stack, "1.471 bytes"),
        (Fault::StopSwitch, ""),
    ];

    #[test]
    fn every_fault_is_told_with_its_unit_its_time_and_a_remedy() {
        for (fault, value) in ALL {
            let record = FaultRecord {
                fault,
                tick: 20_269,
                value: 1.470_669_5,
            };
            let said = describe_fault(&record, 1e4);
            assert!(said.contains(value), "{said}");
            assert!(
                said.contains(&format!("[{fault:?}, at t = 2.0269 s]. ")),
                "{said}"
            );
            assert!(said.ends_with('.'), "{said}");
            // No number has more digits than a measurement.
            assert!(!said.contains("1.4706"), "{said}");
            for sentence in said.split(". ") {
                let words = sentence.split_whitespace().count();
                assert!(words <= 32, "{words} words: {sentence}");
            }
        }
    }

    #[test]
    fn what_switched_the_outputs_off_is_told() {
        let said = |value| {
            let record = FaultRecord {
                fault: Fault::Driver,
                tick: 0,
                value,
            };
            describe_fault(&record, 1e4)
        };
        assert!(said(1.0).contains("no over-current"), "{}", said(1.0));
        assert!(said(3.0).contains("beyond their limit"), "{}", said(3.0));
        for chip in [4.0, 7.0] {
            assert!(said(chip).contains("The chip switched"), "{}", said(chip));
        }
    }

    #[test]
    fn channels_that_changed_at_once_have_no_count_and_no_number_stays_a_word() {
        let said = |value| {
            let record = FaultRecord {
                fault: Fault::EncoderSignal,
                tick: 0,
                value,
            };
            describe_fault(&record, 1e4)
        };
        assert!(said(0.0).contains("at the same time") && !said(0.0).contains("0 counts"));
        assert!(!said(f32::NAN).contains("at the same time"));
    }
}
