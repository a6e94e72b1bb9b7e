//! Faults injected at the hardware: the bridge is off in time, the right fault is latched, its snapshot can be had.

use rig_link::LinkError;
use rig_mcu::board::BoardFaults;
use rig_mcu::chip::{CONTROL_EXCEPTION, Chip};
use rig_mcu::cpu::{Cpu, Memory, Register};
use rig_mcu::peripheral::rcc::Cause;
use rig_mcu::time::{NEVER, from_seconds, to_seconds};
use rig_shared::safety::{Fault, FaultRecord, Limit, Reaction};
use rig_shared::trajectory::{Staircase, Trajectory};
use rig_shared::wire::encode;
use rig_shared::wire::message::{
    Bounded, CrashKind, Refusal, Report, Request, RequestBody, ResetCause,
};
use rig_tests::{calibrated, excitation, in_parallel, wait};

use crate::crash::assert_interrupted_code;
use crate::{
    BoardSession, awaited, bench, board, greeted, hang_still, health, moving, powered, snapshot,
};

/// Seconds from now until the bridge is off for good; none if it is still on after `within`.
pub(crate) fn off_after(line: &mut BoardSession, within: f64) -> Option<f64> {
    let board = board(line);
    let begin = board.with_chip(|chip| chip.work.now);
    let end = begin + from_seconds(within);
    let step = from_seconds(2e-5);
    let mut now = begin;
    while now < end {
        now += step;
        board.run_until(now).unwrap();
        if !board.with_board(|b| b.bridge().enabled) {
            let edge = board.with_board(|b| b.enable_edges.last().copied());
            return edge.map(|(at, _)| to_seconds(at.saturating_sub(begin)));
        }
    }
    None
}

/// Seconds from now until a fault has latched, in a run of `within` seconds; none if it has not.
pub(crate) fn latched_after(line: &mut BoardSession, within: f64) -> Option<f64> {
    let emulated = board(line);
    let begin = emulated.with_chip(|chip| chip.triggers);
    emulated.run_for(within).unwrap();
    snapshot_of_fault(line).map(|record| record.tick.saturating_sub(begin) as f64 * 1e-4)
}

/// The latched fault, if there is one.
pub(crate) fn snapshot_of_fault(line: &mut BoardSession) -> Option<FaultRecord> {
    match line.request(RequestBody::Arm) {
        Err(LinkError::Refused {
            refusal: Refusal::FaultLatched,
            ..
        }) => Some(snapshot(line).0),
        _ => None,
    }
}

/// Asserts that the motor has braked: the bridge is on with both wires at one potential, and the link hardly moves.
pub(crate) fn assert_braked(line: &mut BoardSession, name: &str) {
    let (bridge, truth) = board(line).with_board(|b| (b.bridge(), b.plant().truth()));
    let resets = board(line).resets.clone();
    let text = format!("{name}: {bridge:?}, {resets:?}, {truth:?}");
    assert!(bridge.enabled && bridge.duty == 0.0, "{text}");
    assert!(
        truth.velocity.abs() < 0.3,
        "{name}: {} rad/s",
        truth.velocity
    );
}

pub(crate) fn refused(line: &mut BoardSession, body: RequestBody) -> Refusal {
    match line.request(body) {
        Err(LinkError::Refused { refusal, .. }) => refusal,
        other => panic!("not refused: {other:?}"),
    }
}

fn cut(faults: &mut BoardFaults) {
    faults.channel_a_cut = true;
    faults.channel_b_cut = true;
    faults.index_cut = true;
}

#[test]
fn each_fault_ends_the_motion_in_time_latches_and_keeps_its_snapshot() {
    type Injury = fn(&mut Chip);
    // What is done, what must be latched, seconds until the bridge must be off or brake.
    let cases: [(&str, Injury, Fault, f64); 12] = [
        (
            "encoder's cable cut",
            |c| cut(&mut c.board.faults),
            Fault::EncoderLost,
            0.015,
        ),
        (
            "encoder's channel A cut",
            |c| c.board.faults.channel_a_cut = true,
            Fault::EncoderLost,
            0.015,
        ),
        (
            "current converter at its rail",
            |c| c.board.faults.stuck[0] = Some(4095),
            Fault::AdcStuck,
            0.001,
        ),
        (
            "current converter stuck",
            |c| {
                c.board.faults.stuck[0] = Some(2048);
                // They would see the current that the converter does not, and come first.
                c.board.faults.comparators_dead = true;
            },
            Fault::AdcStuck,
            0.1,
        ),
        (
            "current converter stuck, with comparators",
            |c| c.board.faults.stuck[0] = Some(2048),
            Fault::OverCurrent,
            0.1,
        ),
        (
            "over-current",
            |c| c.board.faults.stuck[0] = Some(2048 + 1500),
            Fault::OverCurrent,
            0.001,
        ),
        (
            "supply breaks down",
            |c| c.board.plant_mut().faults_mut().supply = Some(12.0),
            Fault::Supply,
            0.001,
        ),
        (
            "driver fault",
            |c| c.board.faults.driver = true,
            Fault::Driver,
            0.0003,
        ),
        (
            "chip's own supply sags",
            |c| c.board.faults.logic_supply = Some(2.7),
            Fault::Driver,
            0.0003,
        ),
        (
            "motor too hot",
            |c| c.board.faults.stuck[2] = Some(2000),
            Fault::Temperature,
            0.001,
        ),
        (
            "interrupt late",
            |c| c.held_until = c.work.now + from_seconds(250e-6),
            Fault::Deadline,
            0.0006,
        ),
        (
            "external torque",
            |c| c.board.plant_mut().faults_mut().external_torque = 60.0,
            Fault::OverSpeed,
            0.05,
        ),
    ];
    let mut wrong = Vec::new();
    let mut text = String::new();
    for (case, (name, injure, expected, within)) in cases.into_iter().enumerate() {
        let mut line = moving(case as u64 + 10);
        board(&mut line).with_chip(injure);
        let after = match expected.reaction() {
            Reaction::Coast => off_after(&mut line, within),
            Reaction::Brake => latched_after(&mut line, within),
        };
        let Some(after) = after.filter(|after| *after <= within) else {
            let latched = snapshot_of_fault(&mut line);
            wrong.push(format!("{name}: not in {within} s, {after:?} {latched:?}"));
            continue;
        };
        // Against 60 N·m from outside no brake of the motor holds: its current reaches the comparators.
        if expected.reaction() == Reaction::Brake && name != "external torque" {
            wait(&mut line, 0.5);
            assert_braked(&mut line, name);
        }
        let (record, ticks) = snapshot(&mut line);
        text += &format!(
            "{name:<32} {:?} after {:.2} ms\n",
            record.fault,
            1e3 * after
        );
        // The chip's pulls move a wire that is cut. Where such an edge meets one of the other channel, both change at once, which
        // is found first: it depends on the cycle in which the compiler's code pulls.
        let by_edges = expected == Fault::EncoderLost
            && name.ends_with("cut")
            && record.fault == Fault::EncoderSignal
            && record.value == 0.0;
        if record.fault != expected && !by_edges {
            wrong.push(format!("{name}: {record:?}"));
        }
        let place = ticks.iter().position(|tick| *tick == record.tick);
        if !ticks.windows(2).all(|pair| pair[1] == pair[0] + 1) || place.is_none_or(|p| p < 400) {
            wrong.push(format!(
                "{name}: snapshot of {} ticks, fault at {place:?}",
                ticks.len()
            ));
        }
        assert_eq!(
            refused(&mut line, RequestBody::Arm),
            Refusal::FaultLatched,
            "{name}"
        );
    }
    println!("{text}");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// A break that is not the pin's has a flag of its own, which must be cleared before the outputs come on again. And they
/// come on without the duty that they went off with.
#[test]
fn after_a_sag_of_its_own_supply_the_board_drives_again_from_standstill() {
    let mut line = moving(36);
    board(&mut line).with_board(|b| b.faults.logic_supply = Some(2.7));
    assert!(off_after(&mut line, 3e-4).is_some());
    assert!(!board(&mut line).with_chip(|chip| chip.timer(1).main_output()));
    assert_eq!(snapshot(&mut line).0.fault, Fault::Driver);
    assert_eq!(
        refused(&mut line, RequestBody::ClearFault),
        Refusal::CauseActing
    );
    board(&mut line).with_board(|b| b.faults.logic_supply = None);
    wait(&mut line, 0.5);
    line.request(RequestBody::ClearFault).unwrap();
    hang_still(&mut line);
    line.request(RequestBody::Arm).unwrap();
    wait(&mut line, 0.01);
    let (output, bridge, first) = board(&mut line).with_chip(|chip| {
        let output = chip.timer(1).main_output();
        (output, chip.board.bridge(), chip.board.first_duty)
    });
    assert!(output && bridge.enabled && bridge.duty != 0.0, "{bridge:?}");
    assert_eq!(first, 0.0, "the duty that the bridge began with");
}

/// The rings of snapshot and capture are let go of within a tick that costs no more than another.
#[test]
fn clearing_a_fault_takes_no_longer_than_another_tick() {
    let mut line = moving(37);
    board(&mut line).with_board(|b| b.faults.driver = true);
    assert!(off_after(&mut line, 3e-4).is_some());
    board(&mut line).with_board(|b| b.faults.driver = false);
    wait(&mut line, 0.1);
    board(&mut line).clear_costs();
    line.request(RequestBody::ClearFault).unwrap();
    let cost = board(&mut line).cost(CONTROL_EXCEPTION);
    println!("{} cycles in the worst tick", cost.worst_cycles);
    assert!(cost.count > 3 && cost.worst_cycles < 8500, "{cost:?}");
    hang_still(&mut line);
    line.request(RequestBody::Arm).unwrap();
}

#[test]
fn a_crystal_that_stops_switches_off_and_starts_anew_without_it() {
    let mut line = moving(38);
    board(&mut line).with_board(|b| b.faults.crystal_dead = true);
    assert!(off_after(&mut line, 1e-4).is_some());
    board(&mut line).run_for(0.1).unwrap();
    assert!(matches!(
        board(&mut line).resets[..],
        [(_, Cause::Software)]
    ));
    let report = health(&mut line);
    assert!(!report.crystal && report.reset == ResetCause::Software);
    let crash = report.crash.unwrap();
    assert_eq!(crash.kind, CrashKind::ClockStopped);
    assert_interrupted_code(&mut line, &crash);
    assert!(!board(&mut line).with_board(|b| b.bridge().enabled));
}

/// Limits by which no check would act are refused, and so is any while the bridge is on.
#[test]
fn limits_beyond_what_the_parts_stand_are_refused() {
    let mut line = bench(39);
    let (config, settings) = rig_firmware::nameplate::one_link();
    let mut limits = settings.limits;
    limits.peak_current = 1e8;
    let beyond = RequestBody::SetLimits(limits);
    let expected = Refusal::OutOfBounds {
        quantity: Bounded::PeakCurrent,
        value: 1e8,
        bound: config.ratings.peak_current,
    };
    assert_eq!(refused(&mut line, beyond), expected);
    line.request(RequestBody::SetLimits(config.ratings))
        .unwrap();
    limits = settings.limits;
    line.request(RequestBody::SetLimits(limits)).unwrap();
    line.request(RequestBody::Arm).unwrap();
    let driving = RequestBody::SetLimits(limits);
    assert_eq!(refused(&mut line, driving), Refusal::WrongMode);
}

#[test]
fn the_break_input_acts_without_the_processor() {
    let mut line = moving(30);
    let off = board(&mut line).with_chip(|chip| {
        // The driver reports, but goes on; nothing runs for a millisecond.
        chip.board.faults.fault_line = true;
        chip.held_until = chip.work.now + from_seconds(1e-3);
        chip.work.now
    });
    board(&mut line)
        .run_until(off + from_seconds(2e-4))
        .unwrap();
    assert!(!board(&mut line).with_chip(|chip| chip.timer(1).main_output()));
    wait(&mut line, 0.01);
    let (record, _) = snapshot(&mut line);
    // The ticks that were missed meanwhile come second.
    assert_eq!(record.fault, Fault::Driver, "{record:?}");
}

#[test]
fn a_silent_host_is_waited_for_then_stopped_then_latched() {
    let mut line = moving(31);
    let after = latched_after(&mut line, 2.0).unwrap();
    assert!((1.4..=1.6).contains(&after), "{after} s of silence");
    assert_braked(&mut line, "host silent");
    assert_eq!(snapshot(&mut line).0.fault, Fault::HostSilent);
    assert_eq!(refused(&mut line, RequestBody::Arm), Refusal::FaultLatched);
    // The brake goes with the fault, or before it by a request.
    line.request(RequestBody::Disarm).unwrap();
    assert!(!board(&mut line).with_board(|b| b.bridge().enabled));
    line.request(RequestBody::ClearFault).unwrap();
}

/// What became of a link that was held when the host died.
struct Sinking {
    seed: u64,
    /// Angle at which it was held, from level, rad.
    angle: f64,
    /// Fastest motion in the next 4 s, rad/s.
    fastest: f64,
    /// Speed at which the short-circuited motor without any friction bears the whole gravity torque, rad/s.
    bound: f64,
}

fn sinking(seed: u64, angle: f64) -> Sinking {
    let mut line = bench(seed);
    let start = board(&mut line).with_board(|b| b.plant().truth().position);
    let hold = Staircase {
        levels: [(angle - start) as f32].into_iter().collect(),
        move_us: 2_000_000,
        dwell_us: 20_000_000,
    };
    line.request(RequestBody::SetTrajectory(Trajectory::Staircase(hold)))
        .unwrap();
    line.request(RequestBody::Arm).unwrap();
    line.request(RequestBody::Start).unwrap();
    wait(&mut line, 2.8);
    let held = board(&mut line).with_board(|b| b.plant().truth());
    assert!((held.position - angle).abs() < 0.1 && held.velocity.abs() < 0.01);
    let mut fastest = 0.0_f64;
    for _ in 0..4000 {
        board(&mut line).run_for(1e-3).unwrap();
        let velocity = board(&mut line).with_board(|b| b.plant().truth().velocity);
        fastest = fastest.max(velocity.abs());
    }
    assert_eq!(snapshot(&mut line).0.fault, Fault::HostSilent);
    let plant = board(&mut line).with_board(|b| b.plant().config().clone());
    let of = plant.equivalent();
    let gravity = of.gravity_cos.hypot(of.gravity_sin);
    let torque_per_ampere = plant.mechanism.ratio * plant.motor.torque_constant;
    Sinking {
        seed,
        angle,
        fastest,
        bound: gravity * plant.motor.resistance / torque_per_ampere.powi(2),
    }
}

/// A link held level falls with the bridge off. After the host has died, the short-circuited motor lets it sink: with six
/// drawn rigs, held level and above and below it, never faster than gravity and winding alone allow. The rig of the first
/// seed stays below 0.3 rad/s.
#[test]
fn a_link_held_level_sinks_slowly_when_the_host_has_died() {
    const ANGLES: [f64; 3] = [0.0, 0.4, -0.4];
    let found = in_parallel(6, |index| sinking(43 + index, ANGLES[index as usize % 3]));
    for of in &found {
        println!(
            "seed {}, held at {} rad: {:.3} rad/s at most, bound {:.3}",
            of.seed, of.angle, of.fastest, of.bound
        );
        assert!(of.fastest > 0.05 && of.fastest < of.bound, "{}", of.seed);
    }
    assert!(found[0].fastest < 0.3, "{} rad/s", found[0].fastest);
}

/// One control tick that comes late is told in the recording, and the motion goes on; another soon after it is a fault.
#[test]
fn a_single_late_tick_is_tolerated_and_told() {
    let mut line = moving(44);
    line.request(RequestBody::StartStream).unwrap();
    let late = |line: &mut BoardSession| {
        board(line).with_chip(|chip| chip.held_until = chip.work.now + from_seconds(135e-6));
    };
    late(&mut line);
    awaited(&mut line, |report| match report {
        Report::Batch(batch) => batch
            .samples
            .iter()
            .any(|sample| sample.limits.has(Limit::LateTick))
            .then_some(()),
        _ => None,
    });
    wait(&mut line, 0.2);
    assert_eq!(snapshot_of_fault(&mut line), None);
    for _ in 0..2 {
        late(&mut line);
        board(&mut line).run_for(0.01).unwrap();
    }
    assert_eq!(snapshot(&mut line).0.fault, Fault::Deadline);
}

/// One delay is one late tick, whenever in the period it begins: a tick that begins late may also end after the next is due.
#[test]
fn a_single_delay_is_tolerated_at_any_phase() {
    let mut line = moving(49);
    let mut wrong = Vec::new();
    for phase in 0..20 {
        let emulated = board(&mut line);
        let before = emulated.with_chip(|chip| chip.triggers);
        while emulated.with_chip(|chip| chip.triggers) == before {
            let until = emulated.with_chip(|chip| chip.work.now) + from_seconds(5e-7);
            emulated.run_until(until).unwrap();
        }
        emulated.run_for(5e-6 * f64::from(phase)).unwrap();
        emulated.with_chip(|chip| chip.held_until = chip.work.now + from_seconds(135e-6));
        wait(&mut line, 0.12);
        if let Some(record) = snapshot_of_fault(&mut line) {
            wrong.push(format!("{} µs: {record:?}", 5 * phase));
            line = moving(50 + phase as u64);
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// A command to switch off, once for each of its bits wrong, while the rig moves: none is carried out.
#[test]
fn a_corrupted_command_is_counted_and_changes_nothing() {
    let mut line = moving(32);
    let before = health(&mut line).bad_requests;
    let mut frame = [0; 64];
    let disarm = Request {
        id: 0x8000,
        body: RequestBody::Disarm,
    };
    let length = encode(&disarm, &mut frame).unwrap();
    // The last byte ends the frame.
    let bits = 8 * (length - 1);
    for bit in 0..bits {
        let mut wrong = frame;
        wrong[bit / 8] ^= 1 << (bit % 8);
        board(&mut line).with_chip(|chip| chip.send(&wrong[..length]));
        wait(&mut line, 2e-3);
    }
    wait(&mut line, 0.1);
    let report = health(&mut line);
    let counted = report.bad_requests - before;
    // A bit may make a zero, which cuts the frame in two.
    assert!(
        (bits..=2 * bits).contains(&(counted as usize)),
        "{counted} counted of {bits}"
    );
    assert!(board(&mut line).with_board(|b| b.bridge().enabled));
    // As it should have come.
    board(&mut line).with_chip(|chip| chip.send(&frame[..length]));
    assert!(off_after(&mut line, 0.01).is_some());
}

#[test]
fn a_stack_near_its_end_is_a_fault() {
    let mut line = moving(33);
    let (end, _) = board(&mut line).image().symbol("_stack_end").unwrap();
    // As deep as if the stack had come down to its guard.
    assert!(board(&mut line).cpu().store(end + 1024, &[0x11; 16]));
    assert!(latched_after(&mut line, 0.001).is_some());
    assert_eq!(snapshot(&mut line).0.fault, Fault::Stack);
    wait(&mut line, 0.5);
    assert_braked(&mut line, "stack");
    assert_eq!(refused(&mut line, RequestBody::Arm), Refusal::FaultLatched);
}

#[test]
fn a_stack_past_its_end_resets_the_chip_with_the_bridge_off() {
    let mut line = moving(34);
    let (end, _) = board(&mut line).image().symbol("_stack_end").unwrap();
    let board_ = board(&mut line);
    board_.faults_expected = true;
    board_.cpu().set(Register::Sp, end + 16);
    let from = board_.with_chip(|chip| chip.work.now);
    let step = from_seconds(1e-4);
    board_.run_until(from + step).unwrap();
    let (resets, faults) = (board_.resets.clone(), board_.faults.clone());
    assert!(!faults.is_empty());
    let off = board_.with_chip(|chip| !chip.timer(1).main_output() || !chip.board.bridge().enabled);
    assert!(off, "after 0.1 ms: {resets:?} {faults:?}");
    board_.run_for(3.0).unwrap();
    assert!(
        !board_.resets.is_empty(),
        "neither the firmware nor the watchdog started it anew"
    );
    assert!(!board_.with_board(|b| b.bridge().enabled));
}

#[test]
fn a_processor_that_hangs_is_reset_by_the_watchdog() {
    let mut line = moving(35);
    board(&mut line).with_chip(|chip| chip.held_until = NEVER);
    let after = off_after(&mut line, 3.0).unwrap();
    println!("bridge off {after:.4} s after the processor stopped");
    assert!(after < 1.65e-3, "{after} s");
    board(&mut line).with_chip(|chip| chip.held_until = 0);
    assert!(matches!(
        board(&mut line).resets[..],
        [(_, Cause::WindowWatchdog)]
    ));
    board(&mut line).run_for(0.1).unwrap();
    let report = health(&mut line);
    assert_eq!(report.reset, ResetCause::Watchdog);
    // No part could note who was silent.
    let crash = report.crash.unwrap();
    assert_eq!((crash.kind, crash.silent), (CrashKind::Watchdog, 0));
    assert!(!board(&mut line).with_board(|b| b.bridge().enabled));
}

/// The winding's thermal mean above its rating: off, and not to be cleared before it has cooled.
#[test]
fn a_motor_loaded_beyond_its_rating_is_switched_off_and_must_cool() {
    let mut line = bench(40);
    let (_, settings) = rig_firmware::nameplate::one_link();
    let mut limits = settings.limits;
    limits.continuous_current = 0.1;
    line.request(RequestBody::SetLimits(limits)).unwrap();
    line.request(RequestBody::SetTrajectory(excitation(40, 5, 2)))
        .unwrap();
    line.request(RequestBody::Arm).unwrap();
    line.request(RequestBody::Start).unwrap();
    wait(&mut line, 3.0);
    assert_eq!(snapshot(&mut line).0.fault, Fault::Overload);
    assert_braked(&mut line, "overload");
    assert_eq!(
        refused(&mut line, RequestBody::ClearFault),
        Refusal::CauseActing
    );
}

/// 0.8 A read with the bridge off: nothing is armed until it has been measured anew.
#[test]
fn an_implausible_current_offset_is_a_fault_until_it_is_measured_anew() {
    let mut emulated = powered(41);
    emulated.with_board(|b| b.faults.stuck[0] = Some(2048 + 100));
    let mut line = greeted(emulated);
    wait(&mut line, 0.7);
    assert_eq!(snapshot(&mut line).0.fault, Fault::CurrentOffset);
    assert_eq!(refused(&mut line, RequestBody::Arm), Refusal::FaultLatched);
    board(&mut line).with_board(|b| b.faults.stuck[0] = None);
    line.request(RequestBody::ClearFault).unwrap();
    assert_eq!(refused(&mut line, RequestBody::Arm), Refusal::WrongMode);
    calibrated(&mut line);
    line.request(RequestBody::Arm).unwrap();
}

/// Bytes that the logs have written to the debug probe's channel: its write position, in a ring that nobody reads.
fn logged(line: &mut BoardSession) -> u32 {
    let emulated = board(line);
    let (block, _) = emulated.image().symbol("_SEGGER_RTT").unwrap();
    // Behind the name and the two numbers of channels: name, buffer, size, write, read of the first.
    let [write, read] = [block + 24 + 12, block + 24 + 16];
    let at = emulated.word(write);
    // As a probe that has read everything.
    assert!(emulated.cpu().store(read, &at.to_le_bytes()));
    at
}

/// Each fault and each change of the mode leaves a line in the log, and a tick without any leaves none.
#[test]
fn faults_and_changes_of_the_mode_are_logged() {
    let mut line = bench(46);
    let mut last = logged(&mut line);
    let mut grown = |line: &mut BoardSession| {
        wait(line, 0.1);
        let now = logged(line);
        core::mem::replace(&mut last, now) != now
    };
    assert!(!grown(&mut line));
    line.request(RequestBody::Arm).unwrap();
    assert!(grown(&mut line));
    board(&mut line).with_board(|b| b.faults.driver = true);
    assert!(grown(&mut line));
    assert!(!grown(&mut line));
}
