//! The lines between the chip's pins and the board around it.

use super::error::ChipError;
use super::state::{Chip, DelayedOutput};
use crate::board::Bridge;
use crate::peripheral::Refusal;
use crate::peripheral::gpio::Function;
use crate::peripheral::lpuart::LineError;
use crate::ripple::Ripple;
use crate::time::{Instant, from_seconds, to_seconds};

impl Chip {
    /// Applies changes of the board at once, without waiting for an event.
    pub fn see_board(&mut self) {
        self.update_pins();
        if let Err(refusal) = self.update_bridge(self.work.now) {
            self.fail(ChipError::Hardware(refusal));
        }
    }

    /// Sets the levels of the stop switch (PB14) and its strap (PB15): ground, or the chip's own pull.
    fn set_stop_pins(&mut self) {
        let grounded = [self.board.stop_switch_closed, self.board.stop_strap];
        for (pin, grounded) in [14, 15].into_iter().zip(grounded) {
            let high = !grounded && self.gpio[1].pulls_up(pin);
            self.gpio[1].set_outside(pin, high);
        }
    }

    /// Sets the pins that the board drives: the receiving line idle, the fault line, the stop switch.
    pub(super) fn set_pins(&mut self) {
        self.gpio[0].set_outside(3, true);
        self.set_stop_pins();
        let fault = self.board.fault_pin(self.work.now);
        self.gpio[1].set_outside(12, fault);
    }

    /// Returns the codes on PC1, PC0, PC2, if these pins are analogue.
    pub(super) fn codes(&self) -> Codes {
        let [current, supply, temperature] = [(0, 1), (1, 0), (2, 2)].map(|(input, pin)| {
            (self.gpio[2].function(pin) == Function::Analogue).then(|| self.board.code(input))
        });
        Codes {
            reference: self.board.reference_code(),
            current,
            supply,
            temperature,
            ripple: self.board.ripple(),
            middle: self.tim[0].underflow(self.work.now),
        }
    }

    /// Updates the pins that the board drives.
    pub(super) fn update_pins(&mut self) {
        self.set_stop_pins();
        let high = self.board.fault_pin(self.work.now);
        if self.gpio[1].set_outside(12, high) && self.syscfg.port_of(12) == 1 {
            self.exti.edge(12, high);
        }
        if self.gpio[1].function(12) == Function::Alternate(6) {
            self.tim[0].set_break_pin(self.work.now, high);
        }
        self.compare();
        let low = self.board.faults.logic_supply;
        let low = low.is_some_and(|supply| self.pwr.detects_low(supply));
        let break_down = low && self.syscfg.breaks_on_low_supply();
        // A clock failure acts independently of SYSCFG.
        self.tim[0].set_system_break(break_down || self.rcc.clock_failed());
    }

    /// Compares the current sense on PC1 (COMP3's second input) and PB0 (COMP4's first) with DAC3.
    pub(super) fn compare(&mut self) {
        let [low, high] = self.board.sense_extremes();
        let wired = |port: usize, pin, sense| {
            let analogue = self.gpio[port].function(pin) == Function::Analogue;
            (analogue && !self.board.faults.comparators_dead).then_some(sense)
        };
        // A comparator acts at any instant of a pulse: COMP3 sees its highest current, COMP4 its lowest.
        let pb0 = wired(1, 0, low).filter(|_| !self.board.faults.second_sense_open);
        let pc1 = wired(2, 1, high);
        let third = self.comp.compare(3, [None, pc1], self.dac.output(0));
        let fourth = self.comp.compare(4, [pb0, None], self.dac.output(1));
        for (place, (number, output)) in [(3, third), (4, fourth)].into_iter().enumerate() {
            let output = self.delayed(place, output);
            self.tim[0].set_comparator(self.work.now, number, output);
        }
    }

    /// Returns the output of a comparator behind its delay: it rises late.
    fn delayed(&mut self, place: usize, output: bool) -> bool {
        let now = self.work.now;
        let delay = from_seconds(self.board.comparator_delay);
        let Some(state) = self.comparators.get_mut(place) else {
            return output;
        };
        if !output {
            *state = DelayedOutput::default();
        } else if !state.high {
            let at = *state.rises.get_or_insert(now + delay);
            self.deadline = self.deadline.min(at);
            if at <= now {
                *state = DelayedOutput {
                    high: true,
                    rises: None,
                };
            }
        }
        state.high
    }

    /// Sets the bridge from PWM and enable pin. PA8 and PA9 by alternate function 6 (DS12288 table 13).
    pub(super) fn update_bridge(&mut self, now: Instant) -> Result<(), Refusal> {
        let mut half = [0.0; 2];
        for (k, level) in half.iter_mut().enumerate() {
            let pin = 8 + k as u32;
            let function = self.gpio[0].function(pin);
            *level = match function {
                Function::Alternate(6) => self.tim[0].output(k)?.unwrap_or(0.0),
                Function::Output => f64::from(u8::from(self.gpio[0].drives_high(pin))),
                _ => 0.0,
            };
            // The pin's input sees its own output.
            if function == Function::Alternate(6) {
                self.gpio[0].set_outside(pin, *level > 0.5);
            }
        }
        let enable = self.gpio[1].drives_high(5);
        self.board.set_bridge(
            now,
            Bridge {
                duty: half[0] - half[1],
                // Both inputs low all the time: open.
                enabled: enable && half != [0.0; 2],
                enable,
            },
        );
        Ok(())
    }

    /// Returns for each channel of the encoder whether the chip pulls its pin up, PA0 and PA1.
    pub fn encoder_pulls(&self) -> [bool; 2] {
        [0, 1].map(|pin| self.gpio[0].pulls_up(pin))
    }

    /// Passes the encoder's edges up to now to the timers that count and time them: PA0, PA1 by alternate function 1.
    pub(super) fn count_edges(&mut self) {
        let edges = self.board.edges(self.work.now, self.encoder_pulls());
        for (pin, level) in self.board.levels().into_iter().enumerate() {
            self.gpio[0].set_outside(pin as u32, level);
        }
        let wired = (0..2).all(|pin| self.gpio[0].function(pin) == Function::Alternate(1));
        if wired {
            let tim = self.timer(2);
            tim.quadrature(edges.counts);
            if edges.skewed {
                tim.transition_error();
            }
            if let Some(index) = edges.index {
                tim.index(index.upwards, index.since);
            }
            if let Some(last) = edges.last
                && tim.sends_encoder_clock()
            {
                self.timer(5).internal_trigger_1(last);
            }
        }
    }

    /// Sends bytes of the host to the serial line. They reach the port only if PA3 is set up for it.
    pub fn send(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.send_byte(byte, None);
        }
    }

    /// Sends a byte of the host likewise, with a fault of the line.
    pub fn send_byte(&mut self, byte: u8, error: Option<LineError>) {
        if self.gpio[0].function(3) == Function::Alternate(12) {
            self.lpuart.receive_byte(self.work.now, byte, error);
            self.deadline = 0;
        }
    }

    /// Returns the bytes sent on PA2 since the last call.
    pub fn take_sent(&mut self) -> Vec<u8> {
        core::mem::take(&mut self.lpuart.sent)
    }
}

/// Inputs of the converter's pins: codes, and the ripple of the current within a pulse.
pub(super) struct Codes {
    reference: u16,
    current: Option<u16>,
    supply: Option<u16>,
    temperature: Option<u16>,
    ripple: Ripple,
    /// Middle of a braking interval, if there are pulses.
    middle: Option<Instant>,
}

pub(super) fn code_of(codes: &Codes, channel: u32, held: Instant) -> Option<u16> {
    match channel {
        6 => codes.supply,
        7 => codes.current.map(|code| match codes.middle {
            Some(middle) => codes.ripple.on(code, to_seconds(held) - to_seconds(middle)),
            None => code,
        }),
        8 => codes.temperature,
        // VREFINT.
        18 => Some(codes.reference),
        _ => None,
    }
}
