//! What every request costs the control tick that serves it, whatever the rig does meanwhile; and a watchdog that finds each
//! part that has stopped.

use std::collections::BTreeSet;

use rig_link::LinkError;
use rig_mcu::board::BoardFaults;
use rig_mcu::chip::CONTROL_EXCEPTION;
use rig_mcu::emulation::Silenced;
use rig_mcu::peripheral::rcc::Cause;
use rig_mcu::time::{from_seconds, to_seconds};
use rig_shared::control::ControlKind;
use rig_shared::trajectory::{HARMONICS, Trajectory};
use rig_shared::wire::message::{CrashKind, Refusal, Report, Request, RequestBody};
use rig_shared::wire::{MAX_FRAME, MessageDecoder, encode};
use rig_tests::{excitation, wait};

use crate::budget::{Budget, PERIOD, mixed_effects};
use crate::faults::off_after;
use crate::{BoardSession, bench, board, hang_still, health, moving};

/// Name of a request; a new one does not compile before it is here, and does not pass before it is in [`all`].
fn name(body: &RequestBody) -> &'static str {
    match body {
        RequestBody::Hello => "Hello",
        RequestBody::KeepAlive => "KeepAlive",
        RequestBody::Arm => "Arm",
        RequestBody::Disarm => "Disarm",
        RequestBody::Start => "Start",
        RequestBody::Stop => "Stop",
        RequestBody::ClearFault => "ClearFault",
        RequestBody::SetTrajectory(_) => "SetTrajectory",
        RequestBody::SetGains(_) => "SetGains",
        RequestBody::SetControl(_) => "SetControl",
        RequestBody::SetModel(_) => "SetModel",
        RequestBody::SetFriction(_) => "SetFriction",
        RequestBody::SetPrecompensation(_) => "SetPrecompensation",
        RequestBody::SetLimits(_) => "SetLimits",
        RequestBody::SetEstimator(_) => "SetEstimator",
        RequestBody::StartStream => "StartStream",
        RequestBody::StopStream => "StopStream",
        RequestBody::GetSnapshot => "GetSnapshot",
        RequestBody::SetPosition(_) => "SetPosition",
        RequestBody::Store => "Store",
        RequestBody::Capture(_) => "Capture",
        RequestBody::GetCapture => "GetCapture",
        RequestBody::SetEffects(_) => "SetEffects",
    }
}

/// Requests there are.
const KINDS: usize = 23;

/// Every request, in an order in which those that follow make sense.
fn all() -> Vec<RequestBody> {
    let (_, own) = rig_firmware::nameplate::one_link();
    vec![
        RequestBody::Hello,
        RequestBody::StartStream,
        RequestBody::KeepAlive,
        RequestBody::ClearFault,
        RequestBody::SetPosition(0.3),
        RequestBody::SetLimits(own.limits),
        RequestBody::SetGains(own.gains),
        RequestBody::SetControl(ControlKind::Adaptive),
        RequestBody::SetModel(own.model),
        RequestBody::SetFriction(own.friction),
        RequestBody::SetPrecompensation(own.precompensation),
        RequestBody::SetEstimator(own.estimator),
        RequestBody::SetEffects(mixed_effects().into_iter().collect()),
        RequestBody::SetTrajectory(excitation(90, 5, 1)),
        RequestBody::Store,
        RequestBody::Capture(100),
        RequestBody::GetCapture,
        RequestBody::GetSnapshot,
        RequestBody::Stop,
        RequestBody::StopStream,
        RequestBody::Start,
        RequestBody::Arm,
        RequestBody::Disarm,
    ]
}

/// Cycles of the dearest tick about a request, carried out or refused.
fn dearest(line: &mut BoardSession, body: &RequestBody) -> (f64, Option<Refusal>) {
    board(line).clear_costs();
    let refusal = match line.request(body.clone()) {
        Ok(_) => None,
        Err(LinkError::Refused { refusal, .. }) => Some(refusal),
        Err(other) => panic!("{body:?}: {other:?}"),
    };
    // What follows from it is worked out in the ticks after.
    wait(line, 0.005);
    let cost = board(line).cost(CONTROL_EXCEPTION);
    (cost.worst_cycles as f64, refusal)
}

#[test]
fn every_request_keeps_to_the_budget_whatever_the_rig_does() {
    let kinds: BTreeSet<&str> = all().iter().map(name).collect();
    assert_eq!((kinds.len(), all().len()), (KINDS, KINDS));
    let mut text = String::new();
    let mut worst = 0.0_f64;
    let mut line = bench(90);
    // The start, which makes the state on it, is the stack's deepest; what runs afterwards is looked at for itself.
    board(&mut line).forget_stack();
    for state in ["disarmed", "holding", "running"] {
        for body in all() {
            let ends = matches!(body, RequestBody::Disarm | RequestBody::Stop);
            // As dear as it gets beside: the adaptive law, and effects of each sort.
            let ready: &[RequestBody] = &[
                RequestBody::Disarm,
                RequestBody::SetControl(ControlKind::Adaptive),
                RequestBody::SetEffects(mixed_effects().into_iter().collect()),
                RequestBody::SetTrajectory(excitation(90, 5, 1)),
            ];
            let armed = board(&mut line).with_board(|b| b.bridge().enabled);
            if state != "disarmed" && !armed {
                for told in ready {
                    line.request(told.clone()).unwrap();
                }
                hang_still(&mut line);
                line.request(RequestBody::Arm).unwrap();
                wait(&mut line, 0.3);
                if state == "running" {
                    line.request(RequestBody::Start).unwrap();
                    wait(&mut line, 0.5);
                }
            }
            let (cycles, refusal) = dearest(&mut line, &body);
            worst = worst.max(cycles);
            let said = refusal.map_or(String::new(), |refusal| format!(" {refusal:?}"));
            text += &format!(
                "{state}, {}: {:.1} %{said}\n",
                name(&body),
                100.0 * cycles / PERIOD
            );
            if state == "disarmed" || (state == "running" && ends) {
                line.request(RequestBody::Disarm).unwrap();
            }
        }
        line.request(RequestBody::Disarm).unwrap();
    }
    let most = Budget::read().any.request_cycles_worst;
    let (stack, room) = board(&mut line).stack();
    println!("{text}requests' worst = {worst:.0}, stack {stack} of {room}");
    assert!(
        worst <= 0.5 * PERIOD && worst <= most,
        "a request takes too much of the tick's period ({worst} cycles):\n{text}"
    );
    assert!(
        stack <= Budget::read().running_stack_bytes,
        "{stack} of {room}"
    );
}

/// Number of the interrupt in which the watchdog is fed: CORDIC's, 100 of the chip's own (RM0440, vector table).
const FEEDER: u16 = 16 + 100;

/// The watchdog is fed only when every part has reported. The task that sends is stopped by its hardware; of those that wait for
/// it with a time limit the report is taken away. The tick has a watch of its own besides: `tick_watch.rs`.
#[test]
fn each_part_that_stops_is_found_by_the_watchdog() {
    type Stop = fn(&mut BoardSession);
    fn silence(line: &mut BoardSession, bits: u8) {
        let emulated = board(line);
        let reported = emulated.image().symbol_with("8watchdog10CHECKED_IN");
        let (address, _) = reported.unwrap();
        emulated.silenced = Some(Silenced {
            exception: FEEDER,
            address,
            bits,
        });
    }
    // Seconds within which the chip must start anew; the watchdog's clock is right to a few per cent (DS12288, LSI).
    let parts: [(&str, Stop, f64, u8); 4] = [
        (
            // It stops with its next frame, which is an estimate every 50 ms.
            "telemetry",
            |line| board(line).with_board(|b| b.faults.line_blocked = true),
            0.17,
            2,
        ),
        ("receiver", |line| silence(line, 4), 0.65, 4),
        ("storage", |line| silence(line, 8), 0.65, 8),
        ("precheck", |line| silence(line, 16), 0.65, 16),
    ];
    for (part, stop, within, bit) in parts {
        let mut line = moving(91);
        stop(&mut line);
        let from = board(&mut line).with_chip(|chip| chip.work.now);
        let emulated = board(&mut line);
        let mut now = from;
        while emulated.resets.is_empty() && now < from + from_seconds(1.0) {
            now += from_seconds(1e-3);
            emulated.run_until(now).unwrap();
        }
        let Some((at, cause)) = emulated.resets.first().copied() else {
            panic!("{part}: a second without it, and no reset");
        };
        let after = to_seconds(at - from);
        println!("{part}: started anew after {after:.3} s");
        assert_eq!(cause, Cause::Watchdog, "{part}");
        assert!(after < within, "{part}: {after} s");
        assert!(!emulated.with_board(|b| b.bridge().enabled), "{part}");
        // The next start tells which part it was.
        emulated.silenced = None;
        emulated.with_board(|b| b.faults = BoardFaults::default());
        emulated.run_for(0.05).unwrap();
        let crash = health(&mut line).crash.unwrap();
        println!("{part}: {:#07b}", crash.silent);
        assert_eq!(crash.kind, CrashKind::Watchdog, "{part}");
        assert_eq!(crash.silent & bit, bit, "{part}");
    }
}

/// The motion that takes longest to precheck.
fn longest(seed: u64) -> Trajectory<f32> {
    let mut longest = excitation(seed, 5, 1);
    if let Trajectory::Fourier(motion) = &mut longest {
        motion.sine = [1e-5; HARMONICS].into_iter().collect();
        motion.cosine = motion.sine.clone();
        // As many points as there can be: two ramps of four periods.
        motion.ramp_us = 4 * motion.period_us;
    }
    longest
}

/// Sends a request without waiting for its answer; returns the seconds that its bytes take.
fn send(line: &mut BoardSession, id: u16, body: RequestBody) -> f64 {
    let mut frame = [0; MAX_FRAME];
    let length = encode(&Request { id, body }, &mut frame).unwrap();
    board(line).with_chip(|chip| chip.send(&frame[..length]));
    // Start bit, eight bits, stop bit.
    length as f64 * 10.0 / 921_600.0
}

/// The answers to requests of [`send`] that come within `seconds`, in their order.
fn answers(line: &mut BoardSession, seconds: f64) -> Vec<(u16, Result<(), Refusal>)> {
    wait(line, seconds);
    let bytes = line.port_mut().device_mut().heard.replace(Vec::new());
    let mut answers = Vec::new();
    MessageDecoder::<Report>::default().feed(&bytes.unwrap_or_default(), |report| {
        if let Ok(Report::Acknowledge(answer)) = report
            && answer.id >= 0x8000
        {
            answers.push((answer.id, answer.result));
        }
    });
    answers
}

/// `Disarm` acts within two tenths of a millisecond of its last byte, and `Stop` is answered at once, while two motions are
/// being prechecked, which takes a quarter of a second.
#[test]
fn disarm_and_stop_wait_for_no_precheck() {
    let mut line = bench(93);
    assert_eq!(answers(&mut line, 0.0), []);
    line.request(RequestBody::Arm).unwrap();
    wait(&mut line, 0.3);
    for id in [0x8000, 0x8001] {
        send(&mut line, id, RequestBody::SetTrajectory(longest(93)));
        board(&mut line).run_for(0.004).unwrap();
    }
    let sent = send(&mut line, 0x8002, RequestBody::Disarm);
    let after = off_after(&mut line, 0.5).unwrap() - sent;
    println!("off {:.0} µs after the last byte of Disarm", 1e6 * after);
    assert!((0.0..2e-4).contains(&after), "{after} s");
    // The motions were being prechecked meanwhile.
    let order: Vec<u16> = answers(&mut line, 0.5).iter().map(|(id, _)| *id).collect();
    assert_eq!(order, [0x8002, 0x8000, 0x8001]);

    let mut line = moving(94);
    assert_eq!(answers(&mut line, 0.0), []);
    send(&mut line, 0x8000, RequestBody::SetTrajectory(longest(94)));
    board(&mut line).run_for(0.004).unwrap();
    send(&mut line, 0x8001, RequestBody::Stop);
    let stopped = answers(&mut line, 0.02);
    assert_eq!(stopped, [(0x8001, Ok(()))]);
}

/// A request that would move the rig, sent before a `Disarm` that overtakes it, must not be carried out after it.
#[test]
fn what_a_disarm_overtakes_does_not_arm() {
    let mut line = bench(95);
    assert_eq!(answers(&mut line, 0.0), []);
    send(&mut line, 0x8000, RequestBody::SetTrajectory(longest(95)));
    board(&mut line).run_for(0.004).unwrap();
    send(&mut line, 0x8001, RequestBody::Arm);
    board(&mut line).run_for(0.002).unwrap();
    send(&mut line, 0x8002, RequestBody::Disarm);
    let mut all = answers(&mut line, 0.5);
    all.sort_by_key(|(id, _)| *id);
    let expected = [
        (0x8000, Ok(())),
        (0x8001, Err(Refusal::Overtaken)),
        (0x8002, Ok(())),
    ];
    assert_eq!(all, expected);
    assert_eq!(board(&mut line).with_board(|b| b.enable_edges.clone()), []);
    // A later one is.
    line.request(RequestBody::Arm).unwrap();
}

/// The longest that there is to examine, again and again while the flash is written: nobody is starved, nothing starts anew.
#[test]
fn long_requests_in_a_row_starve_nobody() {
    let mut line = bench(92);
    let longest = longest(92);
    let begin = board(&mut line).seconds();
    line.request(RequestBody::SetTrajectory(longest.clone()))
        .unwrap();
    let one = board(&mut line).seconds() - begin;
    // Without waiting for answers, as a host that repeats them would.
    for (id, body) in (0x8000..).zip([
        RequestBody::SetTrajectory(longest.clone()),
        RequestBody::Store,
        RequestBody::SetTrajectory(longest.clone()),
        RequestBody::SetTrajectory(longest.clone()),
        RequestBody::SetTrajectory(longest.clone()),
        RequestBody::SetTrajectory(longest),
    ]) {
        send(&mut line, id, body);
        board(&mut line).run_for(0.004).unwrap();
    }
    board(&mut line).run_for(3.0).unwrap();
    println!("{one:.3} s to examine one");
    assert_eq!(board(&mut line).resets, []);
    assert!(one < 0.4, "{one} s");
    assert_eq!(health(&mut line).bad_requests, 0);
}
