//! TIM2: the motor's quadrature encoder, with input filter and index.
//!
//! The counter runs freely over 32 bits and wraps. Where the index is wired it sets the counter to 0 counting
//! up, to its top counting down (RM0440, TIM2, "Encoder index"); between two index pulses lie whole turns, so that the
//! step of a tick with an index is known modulo a turn. What the step then is beside what the motor can have
//! moved is counts that were lost or made up on the way. Between two of them the counter stays within a turn of 0; beyond it
//! one has not come. The timer's own check of the index (TIM2_SR.IERRF) compares with the counter's ends, which a counter of
//! 32 bits has elsewhere, and is not used; that both channels changed at once (TERRF) is.
//!
//! The index acts in one of the four states of the channels (TIM2_ECR.IPOS), so that its own width does not matter.
//!
//! TIM5 times the edges: TIM2 sends the clock of its counter out as a trigger (TIM2_CR2.MMS = 8, "encoder clock
//! output"), which is TIM5's ITR1 (RM0440, TIM2/TIM3/TIM4/TIM5, "Internal trigger connection"); there it captures a
//! count that runs freely at 170 MHz (CC1S = 3: channel 1 captures on TRC, the internal trigger). Edge and count pass
//! the same filter, so that they belong together; the filter's own delay, 1.1 µs, is left in both, and its step of 0.19 µs
//! is what an edge is timed to.

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

// TIM5 counts the core's clock: its bus is not divided.
const _: () = assert!(EDGE_CLOCK_HZ == CORE_HZ);

/// How far the step of a tick may be from that of the tick before, besides half of that step, counts: four times
/// the hardest acceleration that the limits allow (60 rad/s² at the joint are 0.04 counts in a tick squared).
const SLACK: u32 = 4;

/// What the counter says in one tick.
pub(crate) struct Reading {
    pub(crate) count: EncoderCount,
    /// Age of the last edge, periods of [`EDGE_CLOCK_HZ`].
    pub(crate) edge_age: u32,
    /// The index disagrees by so many counts, or the channels changed both at once (0).
    pub(crate) wrong: Option<i32>,
}

/// The step that is the same modulo a turn and the shortest.
fn within_half_a_turn(step: i32, turn: NonZeroU32) -> i32 {
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

/// The counter, made into one that no index resets.
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
        // Where and when before whether (RM0440, TIM2_ECR: with IE reset).
        timer.ecr().write(|w| {
            w.set_idir(Idir::BOTH);
            w.set_ipos(encoder.index_levels);
        });
        timer.ecr().modify(|w| w.set_ie(true));
        timer.sr().write_value(Default::default());
        timer.cr2().write(|w| w.set_mms(Mms::ENCODER_CLOCK_OUTPUT));
        // The slave listens before the master begins.
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
        // Before the count: of an edge that comes in between, the time is known to a few periods. After it would be
        // an edge that the count does not have yet.
        let now = TIM5.cnt().read();
        let mut raw = timer.cnt().read();
        let flags = timer.sr().read();
        let mut wrong = None;
        if flags.idxif() || flags.terrif() {
            // Written with zero a flag is cleared, with one it is left (rc_w0): one that has risen since it was read is for
            // the next tick.
            let mut others = flags;
            others.0 = !flags.0;
            timer.sr().write_value(others);
            if flags.terrif() {
                wrong = Some(0);
            }
            // Again, as the index may have come between counter and flags.
            raw = timer.cnt().read();
        }
        let mut step = raw.wrapping_sub(self.last) as i32;
        if flags.idxif() {
            let within = within_half_a_turn(step, self.counts_per_turn);
            let beside = within.wrapping_sub(self.step);
            if !self.indexed {
                // The first one only says where the turn begins: the motion goes on as it was.
                self.indexed = true;
                step = self.step;
            } else {
                if beside.unsigned_abs() > SLACK + self.step.unsigned_abs() / 2 {
                    // Counts that were lost, or an index that is none: nobody knows, so the motion goes on as it was.
                    wrong = Some(beside);
                    step = self.step;
                } else {
                    step = within;
                }
            }
        }
        let turn = self.counts_per_turn.get() as i32;
        let place = raw as i32;
        let beyond = place >= turn + SLACK as i32 || place < -turn - SLACK as i32;
        if self.indexed && beyond {
            // Told once: without index the counter is as good as any.
            self.indexed = false;
            wrong = Some(if place < 0 { -turn } else { turn });
        }
        let age = now.wrapping_sub(TIM5.ccr(0).read());
        self.last = raw;
        self.step = step;
        self.count = self.count.wrapping_add(step as u16);
        Reading {
            count: EncoderCount(self.count),
            // An edge since `now` is a negative age.
            edge_age: if age > u32::MAX / 2 { 0 } else { age },
            wrong,
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
