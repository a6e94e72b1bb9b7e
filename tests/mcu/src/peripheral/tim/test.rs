#![allow(clippy::unwrap_used)]

use super::timer::*;
use crate::time::NEVER;

const CLOCK: u64 = 24;

#[test]
fn centre_aligned_with_repetition_updates_once_in_two_periods() {
    let mut tim = Tim::new(1, CLOCK);
    for (offset, value) in [
        (ARR, 4250),
        (RCR, 3),
        (CCMR1, 0x6868),
        (CCER, 0x11),
        (BDTR, MOE),
        (CR2, 2 << 20),
        (EGR, 1),
        (SR, 0),
        (CR1, 0x20 | ARPE),
    ] {
        tim.write(0, offset, value).unwrap();
    }
    tim.take_trgo2();
    tim.write(1000, CR1, 0x20 | ARPE | CEN).unwrap();
    // Two periods of 2 · 4250 ticks.
    let period = 4 * 4250 * CLOCK;
    assert_eq!(tim.due(), 1000 + period);
    // Preloaded: no effect before the update.
    tim.write(2000, CCR1, 2125).unwrap();
    tim.advance(1000 + period - 1);
    assert_eq!(tim.take_trgo2(), None);
    assert_eq!(tim.output(0).unwrap(), Some(0.0));
    assert_eq!(tim.read(1000 + period - 1, CNT).unwrap(), 1, "nearly down");
    tim.advance(1000 + period);
    assert_eq!(tim.take_trgo2(), Some(1000 + period));
    assert_eq!(tim.output(0).unwrap(), Some(0.5));
    assert_eq!(tim.read(1000 + period + 10 * CLOCK, CNT).unwrap(), 10);
    assert_eq!(tim.updates, 1);
}

#[test]
fn compare_flags_of_a_free_running_timer() {
    let mut tim = Tim::new(3, CLOCK);
    for (offset, value) in [(PSC, 169), (EGR, 1), (SR, 0), (CCR1, 0x8000), (DIER, 2)] {
        tim.write(0, offset, value).unwrap();
    }
    tim.write(0, CR1, CEN).unwrap();
    let tick = 170 * CLOCK;
    assert_eq!(tim.due(), 0x8000 * tick);
    tim.advance(0x8000 * tick - 1);
    assert_eq!(tim.read(0, SR).unwrap() & 2, 0);
    tim.advance(0x8000 * tick);
    assert_eq!(tim.read(0, SR).unwrap() & 2, 2);
    tim.write(0, SR, !2).unwrap();
    tim.advance(0x10000 * tick);
    assert_eq!(tim.read(0x10000 * tick, CNT).unwrap(), 0);
    // CC1 waits for the next round, the others match at 0.
    assert_eq!(tim.read(0, SR).unwrap() & 3, 1);
    assert_eq!(tim.due(), 0x18000 * tick);
}

#[test]
fn break_takes_the_outputs_and_holds_them() {
    let mut tim = Tim::new(1, CLOCK);
    tim.write(0, BDTR, BKE | MOE).unwrap();
    tim.set_break_pin(0, true);
    assert!(tim.main_output());
    tim.set_break_pin(0, false);
    assert!(!tim.main_output());
    tim.write(0, BDTR, BKE | MOE).unwrap();
    assert!(!tim.main_output(), "while the pin is low");
    tim.set_break_pin(0, true);
    assert!(!tim.main_output(), "not by itself");
    tim.write(0, BDTR, BKE | MOE).unwrap();
    assert!(tim.main_output());
    assert!(tim.read(0, SR).unwrap() & BIF != 0);
}

#[test]
fn a_system_break_flags_itself_and_holds_the_outputs_until_that_is_cleared() {
    let mut tim = Tim::new(1, CLOCK);
    tim.write(0, BDTR, MOE).unwrap();
    tim.set_system_break(true);
    assert!(tim.main_output(), "the break is not enabled");
    tim.write(0, BDTR, BKE | MOE).unwrap();
    tim.set_system_break(true);
    assert!(!tim.main_output());
    assert_eq!(tim.read(0, SR).unwrap(), SBIF, "not the pin's flag");
    tim.write(0, SR, 0).unwrap();
    assert_eq!(tim.read(0, SR).unwrap(), SBIF, "it still acts");
    tim.set_system_break(false);
    tim.write(0, BDTR, BKE | MOE).unwrap();
    assert!(!tim.main_output(), "the flag is up");
    tim.write(0, SR, !SBIF).unwrap();
    tim.write(0, BDTR, BKE | MOE).unwrap();
    assert!(tim.main_output());
}

#[test]
fn a_timer_in_trigger_mode_starts_with_its_master_and_sends_its_updates() {
    let mut tim = Tim::new(4, CLOCK);
    for (offset, value) in [
        (ARR, 999),
        (CNT, 100),
        (CR2, MMS_UPDATE),
        (SMCR, SMS_TRIGGER),
    ] {
        tim.write(0, offset, value).unwrap();
    }
    tim.advance(5000 * CLOCK);
    assert_eq!(tim.take_trgo(), None, "it stands");
    tim.internal_trigger_0(5000 * CLOCK);
    assert_eq!(tim.read(5010 * CLOCK, CNT).unwrap(), 110);
    tim.advance(5900 * CLOCK);
    assert_eq!(tim.take_trgo(), Some(5900 * CLOCK));
    assert_eq!(tim.take_trgo(), None);
    assert!(Tim::new(3, CLOCK).write(0, SMCR, SMS_TRIGGER).is_err());
}

#[test]
fn comparators_break_by_their_own_polarity_and_only_where_they_are_let_through() {
    let mut tim = Tim::new(1, CLOCK);
    tim.write(0, BDTR, BKE | MOE).unwrap();
    tim.set_comparator(0, 3, true);
    assert!(tim.main_output(), "not let through");
    tim.set_comparator(0, 3, false);
    // BKCMP3E, inverted: high acts. BKCMP4E not inverted: low acts.
    tim.set_comparator(0, 4, true);
    tim.write(0, AF1, 1 | 1 << 3 | 1 << 12 | 1 << 4).unwrap();
    tim.set_comparator(0, 3, true);
    assert!(!tim.main_output() && tim.read(0, SR).unwrap() & BIF != 0);
    tim.set_comparator(0, 3, false);
    tim.write(0, BDTR, BKE | MOE).unwrap();
    assert!(tim.main_output());
    tim.set_comparator(0, 4, false);
    assert!(!tim.main_output());
    assert!(tim.write(0, AF1, 1 | 1 << 6).is_err());
}

/// The second input has its own flag, sources and filter. A level shorter than the filter's 8 samples at a 32nd of the clock does
/// nothing; one that stands for them switches off at that time.
#[test]
fn the_second_break_input_is_apart_and_filtered() {
    let length = 32 * 8 * CLOCK;
    let mut tim = Tim::new(1, CLOCK);
    let [bk2e, bk2p] = [1 << 24, 1 << 25];
    assert!(
        tim.write(0, BDTR, bk2e | bk2p).is_err(),
        "without OSSR and OSSI"
    );
    let on = BKE | bk2e | bk2p | 0xF << 20 | 3 << 10 | MOE;
    tim.write(0, AF2, 1 << 3).unwrap();
    tim.write(0, BDTR, on).unwrap();
    tim.set_comparator(0, 3, true);
    assert_eq!(tim.due(), length);
    tim.advance(length - 1);
    tim.set_comparator(length - 1, 3, false);
    assert!(tim.main_output() && tim.due() == NEVER, "too short");
    tim.set_comparator(length, 3, true);
    tim.advance(2 * length - 1);
    assert!(tim.main_output());
    tim.advance(2 * length);
    assert!(!tim.main_output());
    assert_eq!(tim.read(0, SR).unwrap(), B2IF, "not the first input's flag");
    tim.write(2 * length, SR, 0).unwrap();
    assert_eq!(tim.read(0, SR).unwrap(), B2IF, "it still acts");
    tim.write(2 * length, BDTR, on).unwrap();
    assert!(!tim.main_output());
}

#[test]
fn encoder_wraps_both_ways_and_index_sets_zero() {
    let mut tim = Tim::new(2, CLOCK);
    tim.write(0, SMCR, 3).unwrap();
    tim.write(0, CR1, CEN).unwrap();
    tim.quadrature(-5);
    assert_eq!(tim.read(0, CNT).unwrap(), u32::MAX - 4);
    tim.quadrature(7);
    assert_eq!(tim.read(0, CNT).unwrap(), 2);
    tim.index(true, 0);
    assert_eq!(tim.read(0, CNT).unwrap(), 2, "index is not enabled");
    tim.write(0, ECR, 0x21).unwrap();
    tim.index(true, 0);
    assert_eq!(tim.read(0, CNT).unwrap(), 0);
    tim.quadrature(9);
    tim.index(true, 0);
    assert_eq!(tim.read(0, CNT).unwrap(), 9, "the first only");
    tim.write(0, ECR, 0xC1).unwrap();
    tim.index(true, 0);
    assert_eq!(tim.read(0, CNT).unwrap(), 9, "gated to another state");
    tim.transition_error();
    assert!(tim.read(0, SR).unwrap() & TERRF != 0);
    tim.write(0, ECR, 1).unwrap();
    tim.index(false, 3);
    assert_eq!(tim.read(0, CNT).unwrap(), u32::MAX - 3);
    assert!(tim.write(0, SMCR, 4).is_err());
}
#[test]
fn encoder_clock_captures_the_count_of_another_timer() {
    let mut encoder = Tim::new(2, CLOCK);
    encoder.write(0, SMCR, 3).unwrap();
    encoder.write(0, CR1, CEN).unwrap();
    assert!(!encoder.sends_encoder_clock());
    encoder.write(0, CR2, MMS_ENCODER_CLOCK).unwrap();
    assert!(encoder.sends_encoder_clock());

    let mut tim = Tim::new(5, CLOCK);
    for (offset, value) in [(ARR, u32::MAX), (SMCR, TS_ITR1), (CCMR1, 3), (CCER, 1)] {
        tim.write(0, offset, value).unwrap();
    }
    tim.write(1000, CR1, CEN).unwrap();
    tim.internal_trigger_1(1000 + 77 * CLOCK);
    assert_eq!(tim.read(0, SR).unwrap(), 2);
    assert_eq!(tim.read(1000 + 90 * CLOCK, CCR1).unwrap(), 77);
    assert_eq!(tim.read(0, SR).unwrap(), 0, "cleared by the load");
    tim.internal_trigger_1(1000 + 100 * CLOCK);
    tim.internal_trigger_1(1000 + 101 * CLOCK);
    assert_eq!(tim.read(0, SR).unwrap(), 2 | CC1OF);
    assert_eq!(tim.read(0, CCR1).unwrap(), 101);
    // An edge shortly before the counter wrapped, handled afterwards.
    let wrap = 1000 + (1_u64 << 32) * CLOCK;
    tim.advance(wrap + 5 * CLOCK);
    tim.internal_trigger_1(wrap - 3 * CLOCK);
    assert_eq!(tim.read(0, CCR1).unwrap(), u32::MAX - 2);
    tim.write(0, SMCR, 0).unwrap_err();
    assert!(Tim::new(3, CLOCK).write(0, SMCR, TS_ITR1).is_ok());
}

#[test]
fn captures_that_are_not_modelled_are_refused() {
    let refused = |number, smcr, ccmr| {
        let mut tim = Tim::new(number, CLOCK);
        tim.write(0, SMCR, smcr).unwrap();
        tim.write(0, CCMR1, ccmr).unwrap();
        tim.write(0, CCER, 1).is_err()
    };
    assert!(!refused(5, TS_ITR1, 3));
    assert!(refused(5, TS_ITR1, 3 | 0x10), "filter");
    assert!(refused(5, 0, 3), "another trigger");
    assert!(refused(3, TS_ITR1, 3), "another timer");
    assert!(refused(5, TS_ITR1, 1), "a pin");
}
