//! The stop switch at PB14, normally closed, and the strap at PB15 that says that one is fitted.

use rig_shared::safety::Fault;
use rig_shared::wire::message::{Refusal, RequestBody, StopSwitchState};
use rig_tests::{calibrated, excitation, wait};

use crate::faults::{assert_braked, off_after, refused, snapshot_of_fault};
use crate::{BoardSession, board, captured, greeted, hang_still, health, place, powered, snapshot};

/// A board, calibrated, with a strap and a closed switch or without.
fn fitted(seed: u64, strap: bool, closed: bool) -> BoardSession {
    let mut emulated = powered(seed);
    emulated.with_board(|b| (b.stop_strap, b.stop_switch_closed) = (strap, closed));
    let mut line = greeted(emulated);
    calibrated(&mut line);
    place(&mut line);
    hang_still(&mut line);
    line
}

fn set_closed(line: &mut BoardSession, closed: bool) {
    board(line).with_board(|b| b.stop_switch_closed = closed);
}

/// A board with a closed switch in the middle of an excitation.
fn moving(seed: u64) -> BoardSession {
    let mut line = fitted(seed, true, true);
    line.request(RequestBody::SetTrajectory(excitation(seed, 5, 2)))
        .unwrap();
    line.request(RequestBody::Arm).unwrap();
    line.request(RequestBody::Start).unwrap();
    wait(&mut line, 1.6);
    line
}

/// Ticks from `at` to the first one in which a reference slowed down at `deceleration`, rad/s²: one after the straight line of
/// its speed meets the speed that it had before.
fn begin_of_stop(ticks: &[(u64, f64)], at: u64, deceleration: f64) -> f64 {
    let place = ticks.iter().position(|(tick, _)| *tick == at).unwrap();
    let speed = |from: usize, to: usize| {
        (ticks[to].1 - ticks[from].1) / (1e-4 * (ticks[to].0 - ticks[from].0) as f64)
    };
    // Mean speed of twenty ticks, that is the speed in their middle; and its change, to continue it.
    let (before, change) = (
        speed(place - 20, place),
        (speed(place - 20, place) - speed(place - 40, place - 20)) / 20.0,
    );
    // The same after fifty ticks of the stop.
    let after = speed(place + 40, place + 60);
    let slope = -1e-4 * deceleration * before.signum();
    // before + change·(t + 10) = after + slope·(t − 50), t from `at` on.
    (after - before - 10.0 * change - 50.0 * slope) / (change - slope) + 1.0
}

/// The switch is opened while the rig moves: from the next control tick on the reference slows down at the limit, the motor
/// brakes at the end, and the rig is armed again only when the switch has been closed for 50 ms.
#[test]
fn opening_the_stop_switch_stops_the_motion_within_a_tick() {
    let mut line = moving(70);
    set_closed(&mut line, false);
    let at = board(&mut line).with_chip(|chip| chip.triggers);
    wait(&mut line, 0.5);
    let (record, _) = snapshot(&mut line);
    assert_eq!(record.fault, Fault::StopSwitch);
    assert_braked(&mut line, "stop switch");
    let deceleration = rig_firmware::nameplate::one_link().1.limits.acceleration;
    let ticks: Vec<(u64, f64)> = captured(&mut line)
        .iter()
        .map(|tick| (tick.tick, f64::from(tick.reference)))
        .collect();
    let begin = begin_of_stop(&ticks, at, f64::from(deceleration));
    println!(
        "slows down {begin:.2} ticks after the next tick, {at}, at rest after {:.1} ms",
        0.1 * (record.tick - at) as f64
    );
    assert!((-0.5..=1.5).contains(&begin), "{begin} ticks after {at}");
    assert_eq!(refused(&mut line, RequestBody::Arm), Refusal::FaultLatched);
    let clear = RequestBody::ClearFault;
    assert_eq!(refused(&mut line, clear.clone()), Refusal::CauseActing);
    assert_eq!(health(&mut line).stop_switch, StopSwitchState::Open);
    line.request(RequestBody::Disarm).unwrap();
    hang_still(&mut line);
    set_closed(&mut line, true);
    line.request(clear).unwrap();
    assert_eq!(
        refused(&mut line, RequestBody::Arm),
        Refusal::StopSwitchOpen
    );
    // The contact bounces.
    wait(&mut line, 0.04);
    set_closed(&mut line, false);
    board(&mut line).run_for(3e-4).unwrap();
    set_closed(&mut line, true);
    wait(&mut line, 0.03);
    assert_eq!(
        refused(&mut line, RequestBody::Arm),
        Refusal::StopSwitchOpen
    );
    wait(&mut line, 0.05);
    line.request(RequestBody::Arm).unwrap();
}

/// An opening of one control tick ends the motion like a long one. While the rig holds, the fault latches at once.
#[test]
fn an_opening_of_one_tick_is_enough() {
    let mut line = moving(71);
    let blink = |line: &mut BoardSession| {
        set_closed(line, false);
        board(line).run_for(1.2e-4).unwrap();
        set_closed(line, true);
    };
    blink(&mut line);
    wait(&mut line, 0.5);
    assert_eq!(snapshot(&mut line).0.fault, Fault::StopSwitch);
    line.request(RequestBody::Disarm).unwrap();
    line.request(RequestBody::ClearFault).unwrap();
    hang_still(&mut line);
    line.request(RequestBody::Arm).unwrap();
    wait(&mut line, 0.1);
    let before = board(&mut line).with_chip(|chip| chip.triggers);
    blink(&mut line);
    wait(&mut line, 0.1);
    let (record, _) = snapshot(&mut line);
    assert_eq!(record.fault, Fault::StopSwitch);
    assert!(record.tick <= before + 2, "{record:?} after {before}");
}

/// Without strap and with an open line no switch is fitted. A closed switch is known without the strap; its opening counts.
#[test]
fn a_switch_is_known_by_its_strap_or_by_being_closed() {
    for (strap, closed, expected) in [
        (false, false, StopSwitchState::NotFitted),
        (true, false, StopSwitchState::Open),
        (false, true, StopSwitchState::Closed),
        (true, true, StopSwitchState::Closed),
    ] {
        let mut line = fitted(72, strap, closed);
        assert_eq!(health(&mut line).stop_switch, expected);
        if expected == StopSwitchState::Open {
            assert_eq!(
                refused(&mut line, RequestBody::Arm),
                Refusal::StopSwitchOpen
            );
            continue;
        }
        line.request(RequestBody::Arm).unwrap();
        wait(&mut line, 0.1);
        set_closed(&mut line, false);
        wait(&mut line, 0.1);
        let latched = snapshot_of_fault(&mut line).map(|record| record.fault);
        let stops = expected == StopSwitchState::Closed;
        assert_eq!(latched, stops.then_some(Fault::StopSwitch), "{expected:?}");
    }
}

/// Nothing of the switch delays a harder reaction: the bridge's fault line acts as without it.
#[test]
fn a_driver_fault_during_the_stop_opens_the_motor() {
    let mut line = moving(73);
    set_closed(&mut line, false);
    board(&mut line).run_for(1e-3).unwrap();
    board(&mut line).with_board(|b| b.faults.driver = true);
    assert!(off_after(&mut line, 3e-4).is_some());
    assert_eq!(snapshot(&mut line).0.fault, Fault::Driver);
}
