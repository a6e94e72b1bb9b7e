//! Halts of the processor by a debugger while the rig drives.

use rig_mcu::time::{from_seconds, to_seconds};
use rig_shared::safety::Fault;
use rig_shared::wire::message::RequestBody;
use rig_tests::wait;

use crate::{BoardSession, bench, board, hang_still, health, moving, snapshot};

/// Length of a halt, s: three times as long as the watchdog waits, and a whole number of control ticks.
const HALT: f64 = 0.3;

/// Halts the processor from now on, and returns whether the motor is open all the time.
fn is_open_during_halt(line: &mut BoardSession) -> bool {
    let emulated = board(line);
    let begin = emulated.with_chip(|chip| {
        let now = chip.work.now;
        chip.halt_until(now + from_seconds(HALT));
        now
    });
    let is_driven = |b: &mut rig_mcu::board::Board| b.bridge().enabled;
    let mut open = !emulated.with_board(is_driven);
    for step in 1..300 {
        let now = begin + from_seconds(HALT * f64::from(step) / 300.0);
        emulated.run_until(now).unwrap();
        open &= !emulated.with_board(is_driven);
    }
    emulated.run_until(begin + from_seconds(HALT)).unwrap();
    open
}

/// Seconds from the trigger of the samples to the next underflow of the pulses' ramp.
fn lead(line: &mut BoardSession) -> f64 {
    board(line).with_chip(|chip| {
        let now = chip.work.now;
        let trigger = chip.timer(4).due();
        let underflow = chip.timer(1).underflow(now).unwrap();
        (to_seconds(underflow) - to_seconds(trigger)).rem_euclid(50e-6)
    })
}

/// The debugger halts a rig that moves: the motor is open at once and stays so. Behind the halt a fault is latched, and the
/// watchdog has not acted.
#[test]
fn a_halt_by_the_debugger_opens_the_motor_at_once() {
    let mut line = moving(48);
    assert!(is_open_during_halt(&mut line));
    wait(&mut line, 0.02);
    let (record, _) = snapshot(&mut line);
    println!("after the halt: {record:?}");
    assert_eq!(board(&mut line).resets, []);
}

/// The rig held its position. Behind the halt the control tick finds that it was late. After that the samples have the same
/// phase to the pulses, and the rig can be armed.
#[test]
fn a_halted_control_tick_knows_that_it_is_late() {
    let mut line = bench(49);
    line.request(RequestBody::Arm).unwrap();
    wait(&mut line, 0.2);
    let before = lead(&mut line);
    assert!(is_open_during_halt(&mut line));
    wait(&mut line, 0.02);
    assert_eq!(snapshot(&mut line).0.fault, Fault::Deadline);
    assert_eq!(board(&mut line).resets, []);
    let after = lead(&mut line);
    println!(
        "samples {:.3} and {:.3} us before",
        1e6 * before,
        1e6 * after
    );
    // Two cycles.
    assert!((after - before).abs() < 12e-9, "{before} s, {after} s");
    line.request(RequestBody::ClearFault).unwrap();
    hang_still(&mut line);
    line.request(RequestBody::Arm).unwrap();
    wait(&mut line, 0.1);
    assert!(board(&mut line).with_board(|b| b.bridge().enabled));
    assert_eq!(health(&mut line).crash, None);
}
