//! What the hardware does by itself, and what of it the program finds: comparators, encoder wires and index, lock-up, flash
//! errors, the bridge's wake-up, the converter's reference, heat across a reset.

use rig_link::LinkError;
use rig_mcu::board::BoardFaults;
use rig_mcu::chip::Chip;
use rig_mcu::peripheral::rcc::Cause;
use rig_mcu::rig::power_on;
use rig_mcu::time::{NEVER, from_seconds, to_seconds};
use rig_shared::safety::Fault;
use rig_shared::trajectory::{Staircase, Trajectory};
use rig_shared::wire::message::{CrashKind, Refusal, RequestBody, ResetCause, WATCHED_PARTS};
use rig_tests::{calibrated, excitation, wait};

use crate::crash::assert_interrupted_code;
use crate::faults::{latched_after, off_after, refused, snapshot_of_fault};
use crate::{
    BoardSession, bench, board, captured, greeted, hang_still, health, image, moving, place, plant,
    powered, snapshot,
};

/// Whether TIM1's outputs are on, after so many seconds in which the processor does nothing.
fn outputs_after(line: &mut BoardSession, seconds: f64, injure: impl FnOnce(&mut Chip)) -> bool {
    let until = board(line).with_chip(|chip| {
        injure(chip);
        chip.held_until = chip.work.now + from_seconds(seconds);
        chip.held_until
    });
    board(line).run_until(until).unwrap();
    board(line).with_chip(|chip| chip.timer(1).main_output())
}

/// A short in the motor's wires, either way, faster than a tick: off within 5 µs and without the program, told as what it is,
/// and the ticks before and after kept at 10 kHz.
#[test]
fn a_short_is_switched_off_by_the_comparators_and_kept_in_the_capture() {
    for (seed, current) in [(70, 9.0), (71, -9.0)] {
        let mut line = moving(seed);
        assert!(!outputs_after(&mut line, 5e-6, |chip| {
            chip.board.faults.short = Some(current);
        }));
        wait(&mut line, 0.1);
        let (record, _) = snapshot(&mut line);
        assert_eq!(record.fault, Fault::OverCurrent, "{current} A");
        board(&mut line).with_board(|b| b.faults.short = None);
        let ticks = captured(&mut line);
        assert!(
            ticks
                .windows(2)
                .all(|pair| pair[1].tick == pair[0].tick + 1)
        );
        let at = ticks.iter().position(|tick| tick.tick == record.tick);
        let at = at.unwrap();
        assert_eq!((ticks.len(), ticks.len() - 1 - at), (1536, 192));
        assert!(ticks[..at].iter().any(|tick| tick.duty != 0.0));
        assert!(ticks[at + 1..].iter().all(|tick| tick.duty == 0.0));
        line.request(RequestBody::ClearFault).unwrap();
        hang_still(&mut line);
        line.request(RequestBody::Arm).unwrap();
        wait(&mut line, 0.05);
        assert!(board(&mut line).with_board(|b| b.bridge().enabled));
    }
}

/// What switches the outputs off for a moment, shorter than a control tick, is known by the flag of its own break input. What
/// is shorter than the filters (1.5 and 0.75 µs) does nothing. The comparators act 0.5 µs after the current.
#[test]
fn a_short_break_is_told_by_its_cause_and_a_spike_is_filtered() {
    type Injury = fn(&mut BoardFaults);
    const LINE: Injury = |faults| faults.fault_line = true;
    const SHORT: Injury = |faults| faults.short = Some(9.0);
    const BOTH: Injury = |faults| (faults.fault_line, faults.short) = (true, Some(9.0));
    for (seed, name, injure, seconds, expected) in [
        (90, "line", LINE, 20e-6, Some((Fault::Driver, Some(1.0)))),
        (91, "spike of the line", LINE, 1e-6, None),
        (
            92,
            "current",
            SHORT,
            20e-6,
            Some((Fault::OverCurrent, None)),
        ),
        (93, "spike of the current", SHORT, 1.0e-6, None),
        (94, "both", BOTH, 20e-6, Some((Fault::Driver, Some(3.0)))),
    ] {
        let mut line = moving(seed);
        let emulated = board(&mut line);
        emulated.with_board(|b| injure(&mut b.faults));
        let until = emulated.with_chip(|chip| chip.work.now) + from_seconds(seconds);
        emulated.run_until(until).unwrap();
        emulated.with_board(|b| b.faults = BoardFaults::default());
        let on = emulated.with_chip(|chip| chip.timer(1).main_output());
        assert_eq!(on, expected.is_none(), "{name}");
        wait(&mut line, 0.01);
        let Some((fault, value)) = expected else {
            assert_eq!(snapshot_of_fault(&mut line), None, "{name}");
            continue;
        };
        let (record, _) = snapshot(&mut line);
        assert_eq!(record.fault, fault, "{name}: {record:?}");
        assert!(
            value.is_none_or(|value| value == record.value),
            "{name}: {record:?}"
        );
    }
}

/// A fault of the chip itself is no fault of the bridge: the value says so.
#[test]
fn a_sag_of_the_chip_s_supply_is_told_as_its_own() {
    let mut line = moving(97);
    board(&mut line).with_board(|b| b.faults.logic_supply = Some(2.7));
    assert!(off_after(&mut line, 3e-4).is_some());
    let (record, _) = snapshot(&mut line);
    assert_eq!((record.fault, record.value), (Fault::Driver, 4.0));
}

/// The converter never gets ready, which the start waits for: the watchdog resets the chip, again and again. Once the converter is
/// sound, the start ends and tells it.
#[test]
fn a_start_that_does_not_end_is_reset_and_told() {
    let mut emulated = powered(98);
    emulated.with_board(|b| b.faults.converter_dead = true);
    emulated.run_for(0.4).unwrap();
    let resets: Vec<f64> = (emulated.resets.iter())
        .map(|(at, _)| to_seconds(*at))
        .collect();
    println!("reset after {resets:?} s");
    // Before it the memories are set up, at 16 MHz.
    assert!(resets.len() == 3 && resets[0] < 0.12, "{resets:?}");
    assert!((emulated.resets.iter()).all(|(_, cause)| *cause == Cause::Watchdog));
    assert!(emulated.with_board(|b| b.enable_edges.is_empty()));
    emulated.with_board(|b| b.faults.converter_dead = false);
    emulated.run_for(0.1).unwrap();
    let mut line = greeted(emulated);
    let report = health(&mut line);
    assert_eq!(report.reset, ResetCause::Watchdog);
    let crash = report.crash.unwrap();
    let part = |silent: u8| WATCHED_PARTS[silent.trailing_zeros() as usize];
    assert_eq!(crash.kind, CrashKind::Watchdog);
    assert_eq!(part(crash.silent), "the start of the program", "{crash:?}");
    assert_eq!(board(&mut line).resets.len(), 3);
    // A start that ends leaves no record.
    board(&mut line).reset(Cause::Watchdog);
    wait(&mut line, 0.1);
    assert_eq!(health(&mut line).crash.unwrap().silent, 0);
}

/// Below the comparators' 6 A and above the checks' 4.8 A: the checks take three ticks.
#[test]
fn what_the_comparators_let_through_the_checks_find() {
    let mut line = moving(72);
    assert!(outputs_after(&mut line, 5e-6, |chip| {
        chip.board.faults.short = Some(5.4);
    }));
    let after = off_after(&mut line, 1e-3).unwrap();
    assert!((2e-4..6e-4).contains(&after), "{after}");
    assert_eq!(snapshot(&mut line).0.fault, Fault::OverCurrent);
}

#[test]
fn too_high_a_supply_is_a_fault_as_too_low_a_one_is() {
    let mut line = moving(73);
    board(&mut line).with_board(|b| b.plant_mut().faults_mut().supply = Some(33.0));
    assert!(off_after(&mut line, 1e-3).is_some());
    let (record, _) = snapshot(&mut line);
    assert!(
        record.fault == Fault::Supply && record.value > 30.0,
        "{record:?}"
    );
}

/// Waits until a cut of these wires changes as many levels as asked for: the chip's pulls take them over.
fn wait_for_changes(line: &mut BoardSession, cut: [bool; 2], wanted: &[usize]) {
    for _ in 0..1000 {
        let changes = board(line).with_chip(|chip| {
            let (levels, pulls) = (chip.board.levels(), chip.encoder_pulls());
            (0..2).filter(|&k| cut[k] && levels[k] != pulls[k]).count()
        });
        if wanted.contains(&changes) {
            return;
        }
        board(line).run_for(1e-4).unwrap();
    }
    panic!("a cut of {cut:?} never changes {wanted:?} levels");
}

/// At rest, where no motion could tell: a wire that nothing drives follows the chip's own pull. A whole cable may come off
/// while both pulls differ from the levels: both channels then change at once, which is a wrong step of its own.
#[test]
fn a_cut_encoder_wire_is_found_at_rest() {
    let both = [true, true];
    for (seed, cut, changes, expected) in [
        (74, both, &[0, 1][..], Fault::EncoderLost),
        (74, both, &[2], Fault::EncoderSignal),
        (75, [true, false], &[0, 1], Fault::EncoderLost),
        (76, [false, true], &[0, 1], Fault::EncoderLost),
    ] {
        let mut line = bench(seed);
        line.request(RequestBody::Arm).unwrap();
        wait(&mut line, 0.5);
        wait_for_changes(&mut line, cut, changes);
        board(&mut line).with_board(|b| {
            [b.faults.channel_a_cut, b.faults.channel_b_cut] = cut;
        });
        let after = latched_after(&mut line, 0.03);
        println!("{cut:?}: {after:?} s");
        assert!(
            after.is_some_and(|after| after < 0.015),
            "{cut:?}: {after:?}"
        );
        let (record, _) = snapshot(&mut line);
        assert_eq!(record.fault, expected, "{cut:?}");
        assert!(expected != Fault::EncoderSignal || record.value == 0.0);
        // It acts whether the bridge is on or off.
        wait(&mut line, 0.015);
        let clear = RequestBody::ClearFault;
        assert_eq!(refused(&mut line, clear), Refusal::CauseActing);
    }
}

/// Pressed against a stop with all that the limits allow.
#[test]
fn a_blocked_link_is_an_overload() {
    let mut rig = plant(77);
    let start = rig.initial_position;
    rig.mechanism.end_stops = rig.mechanism.end_stops.map(|mut stops| {
        stops.range = [start - 0.1, start + 0.1];
        stops
    });
    let mut line = greeted(power_on(image(), rig, 77).unwrap());
    calibrated(&mut line);
    let away = Staircase {
        levels: [0.8].into_iter().collect(),
        move_us: 1_000_000,
        dwell_us: 20_000_000,
    };
    line.request(RequestBody::SetTrajectory(Trajectory::Staircase(away)))
        .unwrap();
    line.request(RequestBody::Arm).unwrap();
    line.request(RequestBody::Start).unwrap();
    wait(&mut line, 6.0);
    assert_eq!(snapshot(&mut line).0.fault, Fault::Overload);
}

#[test]
fn a_missed_a_false_and_a_skewed_encoder_signal_are_told_apart() {
    type Injury = fn(&mut Chip);
    let turn = 8192.0_f32;
    let cases: [(&str, Injury, fn(f32) -> bool); 3] = [
        (
            "index cut",
            |c| c.board.faults.index_cut = true,
            |value| value.abs() == 8192.0,
        ),
        (
            "false index",
            |c| c.board.faults.false_index = true,
            |value| value != 0.0 && value.abs() <= 4096.0,
        ),
        (
            "both channels at once",
            |c| c.board.faults.skewed = true,
            |value| value == 0.0,
        ),
    ];
    for (k, (name, injure, expected)) in cases.into_iter().enumerate() {
        let mut line = moving(78 + k as u64);
        // Near a reversal the index may be missed for longer than the host may be silent.
        for _ in 0..300 {
            let velocity = board(&mut line).with_board(|b| b.plant().truth().velocity);
            if velocity.abs() > 1.0 {
                break;
            }
            wait(&mut line, 0.01);
        }
        let from = board(&mut line).with_board(|b| b.plant().truth().motor_position);
        board(&mut line).with_chip(injure);
        assert!(latched_after(&mut line, 1.0).is_some(), "{name}");
        let (record, _) = snapshot(&mut line);
        let to = board(&mut line).with_board(|b| b.plant().truth().motor_position);
        let counts = (to - from).abs() / core::f64::consts::TAU * f64::from(turn);
        println!("{name}: {record:?} after {counts:.0} counts");
        assert_eq!(record.fault, Fault::EncoderSignal, "{name}");
        assert!(expected(record.value), "{name}: {record:?}");
        line.request(RequestBody::ClearFault).unwrap();
    }
}

/// The outputs follow the enable after a millisecond at most: nothing is asked of them before, so that nothing winds up.
#[test]
fn the_bridge_is_given_its_time_to_wake() {
    let mut line = bench(81);
    for _ in 0..2 {
        line.request(RequestBody::Arm).unwrap();
        // Enabled first; the outputs stay off until it is awake.
        let enabled = (0..200).any(|_| {
            board(&mut line).run_for(1e-5).unwrap();
            board(&mut line).with_board(|b| b.bridge().enable)
        });
        assert!(enabled);
        wait(&mut line, 0.1);
        let (at, on) = board(&mut line).with_board(|b| b.enable_edges[b.enable_edges.len() - 1]);
        assert!(on && at >= board(&mut line).with_board(|b| b.awake()));
        assert_eq!(board(&mut line).with_board(|b| b.first_duty), 0.0);
        assert_ne!(board(&mut line).with_board(|b| b.bridge().duty), 0.0);
        line.request(RequestBody::Disarm).unwrap();
    }
}

/// A bridge that sleeps or wakes holds its fault line low. That is no fault, and the outputs come when the line is valid; a
/// line that stays low is one.
#[test]
fn a_fault_line_is_judged_only_while_the_bridge_is_awake() {
    let mut line = bench(87);
    assert!(!board(&mut line).with_chip(|chip| chip.board.fault_pin(chip.work.now)));
    line.request(RequestBody::Arm).unwrap();
    wait(&mut line, 0.1);
    assert!(board(&mut line).with_board(|b| b.bridge().enabled));
    // To sleep and awake again.
    line.request(RequestBody::Disarm).unwrap();
    wait(&mut line, 0.1);
    board(&mut line).with_board(|b| b.faults.fault_line = true);
    line.request(RequestBody::Arm).unwrap();
    wait(&mut line, 0.01);
    assert_eq!(snapshot(&mut line).0.fault, Fault::Driver);
    assert!(!board(&mut line).with_board(|b| b.bridge().enabled));
}

/// The chip's supply is the converter's reference: at 3.2 V every code is 3 % more, and is taken for what it is.
#[test]
fn codes_are_corrected_by_the_chip_s_own_reference() {
    let mut emulated = power_on(image(), plant(82), 82).unwrap();
    emulated.with_board(|b| b.faults.logic_supply = Some(3.2));
    let mut line = greeted(emulated);
    calibrated(&mut line);
    place(&mut line);
    line.request(RequestBody::Capture(100)).unwrap();
    wait(&mut line, 0.05);
    let ticks = captured(&mut line);
    let mean = ticks.iter().map(|tick| f64::from(tick.supply)).sum::<f64>() / ticks.len() as f64;
    let truth = board(&mut line).with_board(|b| b.plant().config().bridge.supply);
    println!("{mean:.3} V of {truth} V");
    assert!((mean - truth).abs() < 0.03, "{mean} V");
}

/// A processor that locks up, and a flash word that cannot be corrected, take the outputs without a program that runs.
#[test]
fn lock_up_and_flash_errors_take_the_outputs_in_hardware() {
    let mut line = moving(83);
    board(&mut line).with_chip(|chip| chip.held_until = NEVER);
    board(&mut line).with_chip(|chip| chip.lock_up());
    assert!(!board(&mut line).with_chip(|chip| chip.timer(1).main_output()));
    // Nothing runs until the watchdog bites.
    board(&mut line).run_for(0.5).unwrap();
    board(&mut line).with_chip(|chip| chip.held_until = 0);
    assert!(matches!(
        board(&mut line).resets[..],
        [(_, Cause::WindowWatchdog)]
    ));

    // In the program's bank: off at once, and started anew by the non-maskable interrupt.
    let mut line = moving(84);
    board(&mut line).with_chip(|chip| chip.flash_error(1));
    assert!(!board(&mut line).with_chip(|chip| chip.timer(1).main_output()));
    board(&mut line).run_for(0.1).unwrap();
    assert!(matches!(
        board(&mut line).resets[..],
        [(_, Cause::Software)]
    ));
    let report = health(&mut line);
    assert_eq!(report.reset, ResetCause::Software);
    let crash = report.crash.unwrap();
    assert_eq!(crash.kind, CrashKind::FlashError);
    assert_interrupted_code(&mut line, &crash);

    // In the settings' bank, as an interrupted store leaves it: off all the same, but the program goes on.
    let mut line = moving(85);
    board(&mut line).with_chip(|chip| chip.flash_error(2));
    assert!(!board(&mut line).with_chip(|chip| chip.timer(1).main_output()));
    wait(&mut line, 0.1);
    assert_eq!(snapshot(&mut line).0.fault, Fault::Driver);
    assert_eq!(board(&mut line).resets, []);
    line.request(RequestBody::ClearFault).unwrap();
    hang_still(&mut line);
    line.request(RequestBody::Arm).unwrap();
}

/// A motor that was overloaded before a reset is so after it, and has cooled no further than time says.
#[test]
fn a_reset_does_not_cool_the_motor() {
    let mut line = bench(86);
    let (_, settings) = rig_firmware::nameplate::one_link();
    let mut limits = settings.limits;
    limits.continuous_current = 0.1;
    line.request(RequestBody::SetLimits(limits)).unwrap();
    line.request(RequestBody::Store).unwrap();
    line.request(RequestBody::SetTrajectory(excitation(86, 5, 2)))
        .unwrap();
    line.request(RequestBody::Arm).unwrap();
    line.request(RequestBody::Start).unwrap();
    wait(&mut line, 3.0);
    assert_eq!(snapshot(&mut line).0.fault, Fault::Overload);
    for cause in [Cause::Software, Cause::Pin, Cause::Watchdog] {
        board(&mut line).reset(cause);
        wait(&mut line, 0.3);
        assert_eq!(snapshot(&mut line).0.fault, Fault::Overload, "{cause:?}");
        let clear = RequestBody::ClearFault;
        assert_eq!(refused(&mut line, clear), Refusal::CauseActing);
    }
    // Half of the heat has gone after 0.7 thermal times of 10 s.
    wait(&mut line, 8.0);
    line.request(RequestBody::ClearFault).unwrap();
    assert!(!matches!(
        line.request(RequestBody::Arm),
        Err(LinkError::Refused {
            refusal: Refusal::FaultLatched,
            ..
        })
    ));
}
