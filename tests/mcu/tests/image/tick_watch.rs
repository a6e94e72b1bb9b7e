//! A control tick that hangs or does not come: bridge off in time, and the code that ran is known after the next start.

use rig_mcu::chip::CONTROL_EXCEPTION;
use rig_mcu::cpu::{Cpu, Memory, Register};
use rig_mcu::peripheral::rcc::Cause;
use rig_mcu::time::from_seconds;
use rig_shared::wire::message::{Crash, CrashKind, ResetCause};

use crate::crash::assert_interrupted_code;
use crate::faults::off_after;
use crate::{BoardSession, board, health, moving};

/// Longest time from the last control tick to the bridge off, s: the watch of 1.52 ms, a tick, and the warning's handler.
const LIMIT: f64 = 1.65e-3;

/// Runs into a control tick, outside any block of conditional instructions, and returns the program counter.
fn in_the_tick(line: &mut BoardSession) -> u32 {
    let emulated = board(line);
    for _ in 0..10_000 {
        let until = emulated.with_chip(|chip| chip.work.now) + from_seconds(1e-6);
        emulated.run_until(until).unwrap();
        let running = emulated.with_chip(|chip| chip.nvic.running());
        // Of the state of such a block, ICI/IT, in the program status.
        let conditional = emulated.cpu().get(Register::Xpsr) & 0x0600_FC00 != 0;
        if running == Some(CONTROL_EXCEPTION) && !conditional {
            return emulated.cpu().get(Register::Pc) & !1;
        }
    }
    panic!("no control tick");
}

/// What the next start tells.
fn told(line: &mut BoardSession) -> (ResetCause, Crash) {
    board(line).run_for(0.1).unwrap();
    let report = health(line);
    assert!(!board(line).with_board(|b| b.bridge().enabled));
    (report.reset, report.crash.unwrap())
}

/// An endless loop in the control tick: the bridge is off within 1.65 ms, and the next start names the instruction.
#[test]
fn a_control_tick_that_hangs_is_switched_off_and_its_place_is_told() {
    let mut line = moving(110);
    let place = in_the_tick(&mut line);
    let emulated = board(&mut line);
    // A branch to itself.
    assert!(emulated.cpu().store(place, &[0xFE, 0xE7]));
    emulated.cpu().forget_code(place, 2);
    let after = off_after(&mut line, 0.2).unwrap();
    println!("bridge off {:.3} ms after the tick hung", 1e3 * after);
    assert!(after < LIMIT, "{after} s");
    let (reset, crash) = told(&mut line);
    assert!(matches!(
        board(&mut line).resets[..],
        [(_, Cause::Software)]
    ));
    assert_eq!(
        (reset, crash.kind),
        (ResetCause::Software, CrashKind::TickStopped)
    );
    assert_eq!(crash.pc & !1, place, "{crash:x?}");
    assert_interrupted_code(&mut line, &crash);
}

/// The converter's trigger does not come any more, so that nothing controls the motor: likewise.
#[test]
fn a_control_tick_that_does_not_come_is_found_as_fast() {
    let mut line = moving(111);
    board(&mut line).with_board(|b| b.faults.trigger_lost = true);
    let after = off_after(&mut line, 0.2).unwrap();
    println!("bridge off {:.3} ms after the last trigger", 1e3 * after);
    assert!(after < LIMIT, "{after} s");
    board(&mut line).with_board(|b| b.faults.trigger_lost = false);
    let (_, crash) = told(&mut line);
    assert_eq!(crash.kind, CrashKind::TickStopped);
    assert_interrupted_code(&mut line, &crash);
}

/// An endless loop with interrupts disabled: the warning cannot come, the reset does. No record says where it was.
#[test]
fn a_hang_with_interrupts_disabled_is_reset_as_fast() {
    let mut line = moving(112);
    let place = in_the_tick(&mut line);
    let emulated = board(&mut line);
    emulated.cpu().set(Register::Primask, 1);
    assert!(emulated.cpu().store(place, &[0xFE, 0xE7]));
    emulated.cpu().forget_code(place, 2);
    let after = off_after(&mut line, 0.2).unwrap();
    println!("bridge off {:.3} ms after the hang", 1e3 * after);
    assert!(after < LIMIT, "{after} s");
    let (reset, crash) = told(&mut line);
    assert!(matches!(
        board(&mut line).resets[..],
        [(_, Cause::WindowWatchdog)]
    ));
    assert_eq!(
        (reset, crash.kind),
        (ResetCause::Watchdog, CrashKind::Watchdog)
    );
    assert_eq!((crash.pc, crash.silent), (0, 0));
}
