//! Self-test of the ways that switch the outputs off, once at the start. The bridge sleeps meanwhile, so its inputs may move.
//!
//! 1. The outputs come on and go off by command: both pins are read back.
//! 2. For each comparator: its threshold is moved to the other side of the present current, which must switch the outputs off
//!    without the program, and set the flag of their break input.
//!
//! Not found: a current sense that floats where it happens to pass, and what fails later.

use embassy_stm32::pac::TIM1;
use embassy_stm32::pac::timer::vals::Ocm;
use rig_shared::wire::message::SelfTest;

use super::clock::CORE_HZ;
use super::comparator;
use super::pins::{are_bridge_inputs, is_bridge_asleep};
use super::pwm::clear_breaks;

/// Settling of a moved threshold, and of the pins, µs: DAC3 at most 1 (DS12288, t_SETTLING without buffer), comparator and
/// pins less.
const SETTLING_US: u32 = 5;

fn settle() {
    cortex_m::asm::delay(SETTLING_US * (CORE_HZ / 1_000_000));
}

fn set_outputs(on: bool) {
    TIM1.bdtr().modify(|w| w.set_moe(on));
    settle();
}

/// Forces both channels high, or gives them back to the pulses.
fn force_high(forced: bool) {
    let mode = if forced {
        Ocm::FORCE_ACTIVE
    } else {
        Ocm::PWM_MODE1
    };
    TIM1.ccmr_output(0).modify(|w| {
        w.set_ocm(0, mode);
        w.set_ocm(1, mode);
    });
}

/// Runs the self-test with TIM1 set up, its outputs idle and connected, and the comparators as the only source of a break. Returns the
/// first part that fails.
pub(crate) fn run(thresholds: [u16; 2]) -> Option<SelfTest> {
    force_high(true);
    let failed = find_failure(thresholds);
    set_outputs(false);
    force_high(false);
    clear_breaks();
    failed
}

fn find_failure([lower, upper]: [u16; 2]) -> Option<SelfTest> {
    clear_breaks();
    set_outputs(true);
    let came_on = is_bridge_asleep() && are_bridge_inputs(true);
    set_outputs(false);
    if !came_on || !are_bridge_inputs(false) {
        return Some(SelfTest::Outputs);
    }
    [
        (SelfTest::UpperComparator, [lower, lower]),
        (SelfTest::LowerComparator, [upper, upper]),
    ]
    .into_iter()
    .find(|(_, moved)| !switches_off(*moved, [lower, upper]))
    .map(|(part, _)| part)
}

/// Returns true if thresholds on the other side of the current switch the outputs off.
fn switches_off(moved: [u16; 2], thresholds: [u16; 2]) -> bool {
    clear_breaks();
    set_outputs(true);
    let on = are_bridge_inputs(true);
    comparator::set_thresholds(moved);
    settle();
    let off = are_bridge_inputs(false) && TIM1.sr().read().bif(1);
    comparator::set_thresholds(thresholds);
    settle();
    on && off
}
