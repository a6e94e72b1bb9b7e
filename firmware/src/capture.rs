//! A burst of control ticks kept in RAM at the full control rate, without the averaging of the telemetry.
//!
//! The ring runs until the host or a fault triggers it, and stops a chosen number of ticks later. So it holds ticks
//! before and after the trigger.

use rig_shared::safety::SnapshotSample;

/// Control ticks that the capture keeps: 0.15 s at 10 kHz.
pub const CAPTURE_TICKS: usize = 1536;

/// A tick in less memory. Its number follows from its place, its position from the position of the last tick. Duty and
/// supply are finer than the resolution of bridge and converter.
#[derive(Clone, Copy, Debug)]
struct Packed {
    counts: i32,
    current: f32,
    reference: f32,
    /// Range −1 to 1 in 65 534 steps about 32 768; the bridge has 8500.
    duty: u16,
    /// Unit 2⁻¹⁰ V, up to 64 V; the converter's code is 9 mV.
    supply: u16,
}

/// Steps of the duty from 0 to 1, and the code of 0.
const DUTY_STEPS: f32 = 32_767.0;
const DUTY_ZERO: f32 = 32_768.0;
/// Steps of the supply per volt.
const SUPPLY_STEPS: f32 = 1024.0;

/// Rounds to the nearest; values out of range saturate. Via 32 bits, which the chip converts in one instruction.
#[inline(always)]
fn quantise(x: f32) -> u16 {
    ((x + 0.5) as u32).min(0xFFFF) as u16
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Running,
    /// Ticks still to be kept.
    Triggered(u16),
    Complete,
}

/// A ring of the last [`CAPTURE_TICKS`] control ticks.
#[derive(Clone, Debug)]
pub struct Capture {
    ring: [Packed; CAPTURE_TICKS],
    next: usize,
    filled: usize,
    phase: Phase,
    /// Number and position of the last tick kept: copying all of it takes longer.
    last_tick: u64,
    last_position: i64,
}

impl Default for Capture {
    fn default() -> Self {
        Self::new()
    }
}

impl Capture {
    /// Ticks kept after a fault: an eighth is enough to show the fault reaction.
    pub const AFTER_FAULT: u16 = (CAPTURE_TICKS / 8) as u16;

    /// Returns a running, empty capture.
    pub const fn new() -> Self {
        Self {
            ring: [Packed {
                counts: 0,
                current: 0.0,
                reference: 0.0,
                duty: 0,
                supply: 0,
            }; CAPTURE_TICKS],
            next: 0,
            filled: 0,
            phase: Phase::Running,
            last_tick: 0,
            last_position: 0,
        }
    }

    /// Keeps a tick, unless the capture is complete.
    pub fn push(&mut self, sample: &SnapshotSample) {
        match &mut self.phase {
            Phase::Complete => return,
            Phase::Triggered(0) => {
                self.phase = Phase::Complete;
                return;
            }
            Phase::Triggered(remaining) => *remaining -= 1,
            Phase::Running => {}
        }
        if let Some(slot) = self.ring.get_mut(self.next) {
            *slot = Packed {
                // The low half: the rest follows from the last tick, because no joint turns 2³¹ counts in a burst.
                counts: sample.position as i32,
                current: sample.current,
                reference: sample.reference,
                duty: quantise(DUTY_STEPS * sample.duty + DUTY_ZERO),
                supply: quantise(SUPPLY_STEPS * sample.supply),
            };
        }
        (self.last_tick, self.last_position) = (sample.tick, sample.position);
        self.next = if self.next + 1 < CAPTURE_TICKS {
            self.next + 1
        } else {
            0
        };
        self.filled = (self.filled + 1).min(CAPTURE_TICKS);
    }

    /// Stops the ring `after` ticks from now, at most its length. Discards a complete capture for a new one.
    pub fn trigger(&mut self, after: u16) {
        if self.is_complete() {
            self.next = 0;
            self.filled = 0;
        }
        self.phase = Phase::Triggered(after.min(CAPTURE_TICKS as u16));
    }

    /// Triggers by a fault, unless a capture is being taken or waits to be fetched.
    pub fn trigger_by_fault(&mut self) {
        if self.phase == Phase::Running {
            self.trigger(Self::AFTER_FAULT);
        }
    }

    /// Starts the ring again.
    pub fn release(&mut self) {
        self.next = 0;
        self.filled = 0;
        self.phase = Phase::Running;
    }

    /// Returns true if a trigger has come and more ticks are to follow.
    pub fn is_triggered(&self) -> bool {
        matches!(self.phase, Phase::Triggered(_))
    }

    /// Returns true if the ring has stopped.
    pub fn is_complete(&self) -> bool {
        self.phase == Phase::Complete
    }

    /// Returns the number of ticks kept.
    pub fn len(&self) -> usize {
        self.filled
    }

    /// Returns true if no tick was kept yet.
    pub fn is_empty(&self) -> bool {
        self.filled == 0
    }

    /// Returns the `index`-th kept tick, 0 the oldest.
    pub fn get(&self, index: usize) -> Option<SnapshotSample> {
        if index >= self.filled {
            return None;
        }
        let oldest = if self.filled < CAPTURE_TICKS {
            0
        } else {
            self.next
        };
        let slot = oldest + index;
        let packed = self.ring.get(if slot < CAPTURE_TICKS {
            slot
        } else {
            slot - CAPTURE_TICKS
        })?;
        let age = (self.filled - 1 - index) as u64;
        let back = (self.last_position as i32).wrapping_sub(packed.counts);
        Some(SnapshotSample {
            tick: self.last_tick.saturating_sub(age),
            position: self.last_position - i64::from(back),
            current: packed.current,
            duty: (f32::from(packed.duty) - DUTY_ZERO) / DUTY_STEPS,
            supply: f32::from(packed.supply) / SUPPLY_STEPS,
            reference: packed.reference,
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn at(tick: u64) -> SnapshotSample {
        SnapshotSample {
            tick,
            // Across the wrap of the low half.
            position: i64::from(i32::MAX) - 1000 + 3 * tick as i64,
            current: tick as f32,
            ..SnapshotSample::default()
        }
    }

    #[test]
    fn holds_what_came_before_and_after_the_trigger() {
        let mut capture = Capture::new();
        for tick in 0..5000 {
            capture.push(&at(tick));
        }
        capture.trigger(100);
        assert!(capture.is_triggered());
        for tick in 5000..9000 {
            capture.push(&at(tick));
            capture.trigger_by_fault();
        }
        assert!(capture.is_complete());
        assert_eq!(capture.len(), CAPTURE_TICKS);
        for index in 0..CAPTURE_TICKS {
            let tick = 5100 - CAPTURE_TICKS as u64 + index as u64;
            assert_eq!(capture.get(index).unwrap(), at(tick));
        }
        assert!(capture.get(CAPTURE_TICKS).is_none());
    }

    #[test]
    fn duty_and_supply_are_kept_finer_than_they_come() {
        let mut capture = Capture::new();
        for (duty, supply) in [(0.95_f32, 23.987_f32), (-0.333, 36.3), (-1.0, 0.0)] {
            capture.push(&SnapshotSample {
                duty,
                supply,
                ..at(0)
            });
            let stored = capture.get(capture.len() - 1).unwrap();
            assert!((stored.duty - duty).abs() < 0.1 / 4250.0, "{stored:?}");
            assert!((stored.supply - supply).abs() < 1e-3, "{stored:?}");
        }
    }

    #[test]
    fn a_new_trigger_gives_up_the_old_burst_and_a_fault_does_not() {
        let mut capture = Capture::new();
        for tick in 0..10 {
            capture.push(&at(tick));
        }
        capture.trigger(0);
        capture.push(&at(10));
        capture.trigger_by_fault();
        assert!(capture.is_complete());
        assert_eq!(capture.get(9).unwrap(), at(9));
        capture.trigger(2);
        for tick in 20..30 {
            capture.push(&at(tick));
        }
        assert_eq!(capture.len(), 2);
        assert_eq!(capture.get(0).unwrap(), at(20));
        capture.release();
        assert!(capture.is_empty() && !capture.is_complete());
    }
}
