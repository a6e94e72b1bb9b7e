//! TIM2: the motor's quadrature encoder, with input filter and index.
//!
//! The counter runs freely over 32 bits and wraps. If the index is wired it sets the counter to 0 when counting up, and
//! to its top when counting down (RM0440, TIM2, "Encoder index"). Whole turns lie between two index pulses, so the step
//! of a tick with an index is known modulo a turn. A difference to the possible motion of the motor means lost or false
//! counts. Between two pulses the counter stays within a turn of 0; beyond that a pulse is missing. The timer's own
//! check of the index (TIM2_SR.IERRF) compares with the counter's ends and does not fit a 32-bit counter, so it is not
//! used. The flag for a change of both channels at once (TERRF) is used.
//!
//! The index acts in one of the four states of the channels (TIM2_ECR.IPOS), so its own width does not matter.
//!
//! TIM5 times the edges. TIM2 outputs the clock of its counter as a trigger (TIM2_CR2.MMS = 8, "encoder clock output"),
//! which is TIM5's ITR1 (RM0440, TIM2/TIM3/TIM4/TIM5, "Internal trigger connection"). There it captures a count that
//! runs freely at 170 MHz (CC1S = 3: channel 1 captures on TRC, the internal trigger). Edge and count pass the same
//! filter, so they belong together. Both keep the filter's delay, 1.1 µs. Its step, 0.19 µs, is the resolution of an
//! edge time.

use core::num::NonZeroU32;

use embassy_stm32::pac::timer::vals::{
    CcmrInputCcs, Ckd, Etp, Etps, FilterValue, Idir, Mms, Sms, Ts,
};
use embassy_stm32::pac::{RCC, TIM2, TIM5};
use rig_firmware::config::Encoder;
use rig_firmware::sample::EDGE_CLOCK_HZ;
use rig_shared::units::EncoderCount;

use super::clock::CORE_HZ;
use super::pins::EncoderPins;

// TIM5 counts the core clock: its bus is not divided.
const _: () = assert!(EDGE_CLOCK_HZ == CORE_HZ);

/// Allowed change of step between two ticks, in addition to half of the last step, counts: four times the hardest
/// allowed acceleration (60 rad/s² at the joint are 0.04 counts per tick squared).
const STEP_TOLERANCE: u32 = 4;

/// Reading of the counter in one tick.
pub(crate) struct Reading {
    pub(crate) count: EncoderCount,
    /// Time since the last edge, periods of [`EDGE_CLOCK_HZ`].
    pub(crate) edge_age: u32,
    /// Counts by which the index disagrees, or 0 if both channels changed at once.
    pub(crate) error: Option<i32>,
}

/// Returns the shortest step that is equal to `step` modulo a turn.
fn wrap_to_half_turn(step: i32, turn: NonZeroU32) -> i32 {
    let rest = step.unsigned_abs() % turn;
    let shortest = if rest > turn.get() / 2 {
        (rest as i32).wrapping_sub(turn.get() as i32)
    } else {
        rest as i32
    };
    if step < 0 {
        shortest.wrapping_neg()
    } else {
        shortest
    }
}

/// The counter, extended so that the index does not reset it.
pub(crate) struct EncoderTimer {
    counts_per_turn: NonZeroU32,
    last: u32,
    step: i32,
    count: u16,
    indexed: bool,
}

impl EncoderTimer {
    /// Sets TIM2 up and starts it.
    pub(crate) fn new(pins: EncoderPins, encoder: &Encoder) -> Self {
        pins.connect();
        RCC.apb1enr1().modify(|w| w.set_tim2en(true));
        let timer = TIM2;
        // Filters sample at a quarter of 170 MHz / 8: six equal samples are 1.1 µs. At 6 rad/s of the joint the
        // template's encoder has 10 µs between two edges of a channel.
        timer.cr1().write(|w| w.set_ckd(Ckd::DIV4));
        timer.ccmr_input(0).write(|w| {
            for channel in 0..2 {
                w.set_ccs(channel, CcmrInputCcs::TI4);
                w.set_icf(channel, FilterValue::FDTS_DIV8_N6);
            }
        });
        timer.ccer().write_value(Default::default());
        timer.arr().write_value(u32::MAX);
        timer.smcr().write(|w| {
            w.set_sms(Sms::ENCODER_MODE_3);
            w.set_etf(FilterValue::FDTS_DIV8_N6);
            w.set_etps(Etps::DIV1);
            w.set_etp(Etp::NOT_INVERTED);
        });
        // Direction and position are set before the index is enabled (RM0440, TIM2_ECR: with IE reset).
        timer.ecr().write(|w| {
            w.set_idir(Idir::BOTH);
            w.set_ipos(encoder.index_levels);
        });
        timer.ecr().modify(|w| w.set_ie(true));
        timer.sr().write_value(Default::default());
        timer.cr2().write(|w| w.set_mms(Mms::ENCODER_CLOCK_OUTPUT));
        // The slave must be ready before the master starts.
        time_edges();
        timer.cr1().modify(|w| w.set_cen(true));
        Self {
            counts_per_turn: NonZeroU32::new(encoder.counts_per_motor_turn)
                .unwrap_or(NonZeroU32::MIN),
            last: timer.cnt().read(),
            step: 0,
            count: 0,
            indexed: false,
        }
    }

    /// Reads the counter.
    #[inline(always)]
    pub(crate) fn read(&mut self) -> Reading {
        let timer = TIM2;
        // Read before the count: if an edge comes in between, its time is known to a few periods. Read after the count,
        // the time could belong to an edge that is not yet counted.
        let now = TIM5.cnt().read();
        let mut raw = timer.cnt().read();
        let flags = timer.sr().read();
        let mut error = None;
        if flags.idxif() || flags.terrif() {
            // Writing zero clears a flag, writing one keeps it (rc_w0): a flag that rises after the reading stays for
            // the next tick.
            let mut others = flags;
            others.0 = !flags.0;
            timer.sr().write_value(others);
            if flags.terrif() {
                error = Some(0);
            }
            // Read again, because the index may have come between counter and flags.
            raw = timer.cnt().read();
        }
        let mut step = raw.wrapping_sub(self.last) as i32;
        if flags.idxif() {
            let wrapped = wrap_to_half_turn(step, self.counts_per_turn);
            let difference = wrapped.wrapping_sub(self.step);
            if !self.indexed {
                // The first index only gives the start of a turn: the motion continues unchanged.
                self.indexed = true;
                step = self.step;
            } else {
                if difference.unsigned_abs() > STEP_TOLERANCE + self.step.unsigned_abs() / 2 {
                    // Lost counts or a false index: the cause is unknown, so the motion continues unchanged.
                    error = Some(difference);
                    step = self.step;
                } else {
                    step = wrapped;
                }
            }
        }
        let turn = self.counts_per_turn.get() as i32;
        let position = raw as i32;
        let out_of_turn =
            position >= turn + STEP_TOLERANCE as i32 || position < -turn - STEP_TOLERANCE as i32;
        if self.indexed && out_of_turn {
            // Reported once: without index the counter is still valid.
            self.indexed = false;
            error = Some(if position < 0 { -turn } else { turn });
        }
        let age = now.wrapping_sub(TIM5.ccr(0).read());
        self.last = raw;
        self.step = step;
        self.count = self.count.wrapping_add(step as u16);
        Reading {
            count: EncoderCount(self.count),
            // An edge after `now` would have a negative age.
            edge_age: if age > u32::MAX / 2 { 0 } else { age },
            error,
        }
    }
}

/// Sets TIM5 up and starts it.
fn time_edges() {
    RCC.apb1enr1().modify(|w| w.set_tim5en(true));
    let timer = TIM5;
    timer.arr().write_value(u32::MAX);
    timer.smcr().write(|w| w.set_ts(Ts::ITR1));
    timer
        .ccmr_input(0)
        .write(|w| w.set_ccs(0, CcmrInputCcs::TRC));
    timer.ccer().write(|w| w.set_cce(0, true));
    timer.cr1().write(|w| w.set_cen(true));
}
