//! Faults injected at the plant: brake or bridge off, the right one latched first, explained by its snapshot, cleared.
#![allow(clippy::unwrap_used, clippy::panic)]

use rig_link::LinkError;
use rig_plant::effect::dead_time::DeadTime;
use rig_plant::effect::end_stops::EndStops;
use rig_plant::effect::winding_temperature::WindingTemperature;
use rig_plant::{Faults, PlantConfig};
use rig_shared::effects::{Effect, Kind};
use rig_shared::safety::{Fault, Mode, Reaction};
use rig_shared::trajectory::{Staircase, Trajectory};
use rig_shared::wire::message::{Bounded, Refusal, RequestBody};
use rig_tests::{
    Line, bench, calibrated, connect, driven, excitation, in_parallel, nameplate, snapshot, wait,
};

fn refused(line: &mut Line, body: RequestBody) -> Refusal {
    match line.request(body) {
        Err(LinkError::Refused { refusal, .. }) => refusal,
        other => panic!("not refused: {other:?}"),
    }
}

fn inject(line: &mut Line, change: impl Fn(&mut Faults)) {
    change(line.port_mut().device_mut().plant_mut().faults_mut());
}

fn mode(line: &Line) -> Mode {
    line.port().device().state().mode
}

/// A rig in the middle of an excitation, moving.
fn moving(seed: u64) -> Line {
    let (mut line, _) = bench(seed);
    line.request(RequestBody::SetTrajectory(excitation(seed, 5, 5)))
        .unwrap();
    line.request(RequestBody::Arm).unwrap();
    line.request(RequestBody::Start).unwrap();
    wait(&mut line, 3.3);
    assert_eq!(mode(&line), Mode::Running);
    line
}

/// The snapshot over the wire: consecutive ticks, the fault's among them with many before it.
fn check_snapshot(line: &mut Line, fault: Fault) {
    let (record, ticks) = snapshot(line);
    assert_eq!(record.fault, fault);
    assert!(ticks.windows(2).all(|pair| pair[1] == pair[0] + 1));
    let place = ticks.iter().position(|tick| *tick == record.tick).unwrap();
    assert!(
        place > 400 && place < ticks.len() - 1,
        "{place} of {}",
        ticks.len()
    );
}

#[test]
fn each_fault_ends_the_motion_in_time_and_the_rig_works_again() {
    type Change = fn(&mut Faults);
    // Fault, what is done, seconds until it must latch, whether its cause can be seen afterwards.
    let cases: [(Fault, Change, f64, bool); 9] = [
        (Fault::EncoderLost, |f| f.encoder_cut = true, 1.0, false),
        (Fault::EncoderJump, |f| f.encoder_jump = 2000, 0.001, false),
        (
            Fault::AdcStuck,
            |f| f.current_stuck = Some(4095),
            0.001,
            true,
        ),
        (
            Fault::AdcStuck,
            |f| f.current_stuck = Some(2048),
            0.1,
            false,
        ),
        (
            Fault::OverCurrent,
            |f| f.current_stuck = Some(2048 + 1500),
            0.001,
            true,
        ),
        (Fault::Supply, |f| f.supply = Some(12.0), 0.001, true),
        (Fault::Driver, |f| f.driver = true, 0.001, true),
        (
            Fault::Temperature,
            |f| f.temperature_stuck = Some(2000),
            0.001,
            true,
        ),
        (Fault::Deadline, |f| f.overrun = true, 0.001, false),
    ];
    let mut wrong = Vec::new();
    for (case, (fault, change, within, seen)) in cases.into_iter().enumerate() {
        let mut line = moving(case as u64);
        inject(&mut line, change);
        wait(&mut line, within + 0.001);
        let record = line.port().device().state().latch.first();
        if mode(&line) != Mode::Fault || record.map(|r| r.fault) != Some(fault) {
            wrong.push(format!(
                "{case}: {fault:?} after {within} s: {:?} {record:?}",
                mode(&line)
            ));
            continue;
        }
        let brakes = fault.reaction() == Reaction::Brake;
        assert_eq!(line.port().device().state().brakes(), brakes, "{fault:?}");
        assert_eq!(refused(&mut line, RequestBody::Arm), Refusal::FaultLatched);
        check_snapshot(&mut line, fault);
        wait(&mut line, 0.2);
        if seen {
            assert_eq!(
                refused(&mut line, RequestBody::ClearFault),
                Refusal::CauseActing,
                "{fault:?}"
            );
        }
        // A jumped counter stays where it is: jumping back would be another fault.
        if fault != Fault::EncoderJump {
            inject(&mut line, |f| *f = Faults::default());
        }
        wait(&mut line, 2.0);
        // What the cut encoder missed shows as a jump when it is back.
        let cleared = line.request(RequestBody::ClearFault);
        if let Err(error) = cleared {
            let state = line.port().device().state();
            wrong.push(format!(
                "{case}: {fault:?}: {error} at {} rad, {} rad/s",
                state.position, state.velocity
            ));
            continue;
        }
        line.request(RequestBody::Arm).unwrap();
        wait(&mut line, 0.5);
        if mode(&line) != Mode::Holding {
            let record = line.port().device().state().latch.first();
            wrong.push(format!(
                "{case}: after {fault:?}: {:?} {record:?}",
                mode(&line)
            ));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn over_speed_position_and_overload_from_outside() {
    let mut line = moving(1);
    inject(&mut line, |f| f.external_torque = 60.0);
    wait(&mut line, 0.5);
    assert_eq!(
        line.port().device().state().latch.first().unwrap().fault,
        Fault::OverSpeed
    );
    check_snapshot(&mut line, Fault::OverSpeed);

    let (mut line, plant) = bench(2);
    let mut limits = nameplate(&plant).settings.limits;
    let here = line.port().device().state().position;
    (limits.position_low, limits.position_high) = (here - 0.05, here + 0.05);
    line.request(RequestBody::SetLimits(limits)).unwrap();
    line.request(RequestBody::Arm).unwrap();
    inject(&mut line, |f| f.external_torque = 14.0);
    wait(&mut line, 0.5);
    assert_eq!(
        line.port().device().state().latch.first().unwrap().fault,
        Fault::Position
    );

    let mut line = moving(3);
    inject(&mut line, |f| f.external_torque = 5.0);
    wait(&mut line, 12.0);
    assert_eq!(
        line.port().device().state().latch.first().unwrap().fault,
        Fault::Overload
    );
    inject(&mut line, |f| f.external_torque = 0.0);
    assert_eq!(
        refused(&mut line, RequestBody::ClearFault),
        Refusal::CauseActing
    );
    wait(&mut line, 8.0);
    line.request(RequestBody::ClearFault).unwrap();
}

fn latched(line: &Line) -> Option<Fault> {
    line.port().device().state().latch.first().map(|r| r.fault)
}

/// The current's reading freezes beyond the peak while the motor brakes after another fault. Believed, it would drive the
/// link on, in the direction in which it moves. The bridge goes off instead, and the first fault stays latched.
#[test]
fn a_current_reading_that_freezes_during_the_brake_ends_it() {
    for (seed, frozen) in [(1, 3.21_f64), (2, 3.6), (3, 4.7)] {
        let mut line = moving(seed);
        let truth = |line: &mut Line| line.port_mut().device_mut().plant_mut().truth();
        let mut waited = 0;
        while truth(&mut line).velocity.abs() < 2.0 {
            wait(&mut line, 1e-3);
            waited += 1;
            assert!(waited < 5000);
        }
        inject(&mut line, |f| f.temperature_stuck = Some(2000));
        wait(&mut line, 0.005);
        assert_eq!(latched(&line), Some(Fault::Temperature));
        assert!(line.port().device().state().brakes());
        let begin = truth(&mut line).velocity;
        // 33 A on 4096 codes.
        let code = 2048.0 - frozen.copysign(begin) * 4096.0 / 33.0;
        inject(&mut line, |f| f.current_stuck = Some(code as u16));
        // Once the bridge is off, the link falls.
        let (mut fastest, mut braked) = (0.0_f64, 0);
        while line.port().device().state().brakes() && braked < 300 {
            wait(&mut line, 1e-3);
            fastest = fastest.max(truth(&mut line).velocity * begin.signum());
            braked += 1;
        }
        println!("{begin:.2} rad/s, then {fastest:.2} rad/s at most in {braked} ms");
        assert!(fastest < begin.abs() + 0.1, "{begin} {fastest}");
        assert!(!line.port().device().state().brakes());
        assert_eq!(latched(&line), Some(Fault::Temperature));
    }
}

/// Cut while the rig holds: found from the winding's voltage once something moves the link, before it has moved far.
#[test]
fn an_encoder_lost_while_holding_is_found_when_the_link_moves() {
    let (mut line, _) = bench(8);
    line.request(RequestBody::Arm).unwrap();
    wait(&mut line, 0.5);
    inject(&mut line, |f| f.encoder_cut = true);
    wait(&mut line, 1.0);
    // Nothing has moved: nothing can tell.
    assert_eq!(latched(&line), None);
    let truth = |line: &mut Line| line.port_mut().device_mut().plant_mut().truth();
    let before = truth(&mut line).position;
    inject(&mut line, |f| f.external_torque = 5.0);
    let mut after = 0;
    while latched(&line).is_none() && after < 1000 {
        wait(&mut line, 1e-3);
        after += 1;
    }
    let way = truth(&mut line).position - before;
    println!("{after} ms, {way:.3} rad");
    assert_eq!(latched(&line), Some(Fault::EncoderLost));
    assert!(after <= 200 && way < 0.3, "{after} ms, {way} rad");
}

/// Against a stop with all that the limits allow: what heats the winding is named, not the encoder, which sees what there is.
#[test]
fn a_blocked_link_is_an_overload_and_no_lost_encoder() {
    let mut plant = PlantConfig::laboratory(9);
    let start = plant.initial_position;
    plant.mechanism.end_stops = plant.mechanism.end_stops.map(|stops| EndStops {
        range: [start - 0.1, start + 0.1],
        ..stops
    });
    let mut line = connect(&nameplate(&plant), plant, 9);
    calibrated(&mut line);
    let levels = [0.8_f32].into_iter().collect();
    let away = Staircase {
        levels,
        move_us: 1_000_000,
        dwell_us: 20_000_000,
    };
    line.request(RequestBody::SetTrajectory(Trajectory::Staircase(away)))
        .unwrap();
    line.request(RequestBody::Arm).unwrap();
    line.request(RequestBody::Start).unwrap();
    wait(&mut line, 6.0);
    assert_eq!(latched(&line), Some(Fault::Overload));
}

/// Ten minutes of the hardest motion that the limits allow, with a warm winding and dead time: no false fault.
#[test]
fn hard_motion_raises_no_fault() {
    let largest = in_parallel(2, |seed| {
        let mut plant = PlantConfig::laboratory(10 + seed);
        plant.bridge.dead_time = Some(DeadTime {
            voltage: 0.3,
            fade_current: 0.1,
        });
        plant.motor.temperature = Some(WindingTemperature {
            resistance: 0.0039,
            torque_constant: -0.002,
        });
        // 60 K above the surroundings with the RMS current of this motion.
        plant.ambient = 60.0;
        let motor = plant.motor;
        let mut line = connect(&nameplate(&plant), plant, 10 + seed);
        calibrated(&mut line);
        let mut unexplained = (0.0_f64, 0.0_f64);
        for k in 0..19 {
            let run = driven(&mut line, vec![], hard(100 * seed + k), 0.0);
            assert!(run.faults.is_empty(), "motion {k}: {:?}", run.faults);
            for row in &run.rows {
                let speed = motor_speed(row.qd1);
                let rest = row.u1 - motor.resistance * row.i1 - motor.torque_constant * speed;
                unexplained.0 += (rest - unexplained.0) / 20.0;
                unexplained.1 = unexplained.1.max(unexplained.0.abs());
            }
        }
        unexplained.1
    });
    println!("{largest:.2?} V unexplained at most");
}

/// The motor's speed at one of the joint, rad/s.
fn motor_speed(joint: f64) -> f64 {
    joint * PlantConfig::default().mechanism.ratio
}

/// 16 s of excitation at the limit of speed, as far as current for good and range allow.
fn hard(seed: u64) -> Trajectory<f32> {
    let Trajectory::Fourier(mut motion) = excitation(seed, 2, 6) else {
        panic!("an excitation is a Fourier series")
    };
    let all = Trajectory::Fourier(motion.clone()).extremes();
    let range = all.highest.max(-all.lowest);
    let more = (5.9 / all.velocity)
        .min(25.0 / all.acceleration)
        .min(1.4 / range);
    for part in motion.sine.iter_mut().chain(&mut motion.cosine) {
        *part *= more;
    }
    Trajectory::Fourier(motion)
}

#[test]
fn an_offset_out_of_band_at_start_is_measured_again_after_clearing() {
    let plant = PlantConfig::laboratory(4);
    let mut line = connect(&nameplate(&plant), plant, 4);
    inject(&mut line, |f| f.current_stuck = Some(2048 + 99));
    wait(&mut line, 0.6);
    assert_eq!(
        line.port().device().state().latch.first().unwrap().fault,
        Fault::CurrentOffset
    );
    for body in [
        RequestBody::Arm,
        RequestBody::Start,
        RequestBody::SetPosition(0.0),
        RequestBody::Store,
    ] {
        assert_eq!(refused(&mut line, body), Refusal::FaultLatched);
    }
    inject(&mut line, |f| *f = Faults::default());
    line.request(RequestBody::ClearFault).unwrap();
    assert_eq!(mode(&line), Mode::Calibrating);
    calibrated(&mut line);
    line.request(RequestBody::Arm).unwrap();
}

#[test]
fn a_fault_in_the_middle_of_calibration_leaves_it_to_be_done() {
    let plant = PlantConfig::laboratory(5);
    let mut line = connect(&nameplate(&plant), plant, 5);
    inject(&mut line, |f| f.driver = true);
    wait(&mut line, 0.1);
    assert_eq!(mode(&line), Mode::Fault);
    inject(&mut line, |f| f.driver = false);
    wait(&mut line, 0.01);
    line.request(RequestBody::ClearFault).unwrap();
    assert_eq!(mode(&line), Mode::Calibrating);
}

#[test]
fn a_silent_host_brings_a_controlled_stop_and_then_the_fault() {
    let mut line = moving(6);
    // Only the device runs: nothing is sent to it.
    let rig = line.port_mut().device_mut();
    let mut stood = false;
    for _ in 0..20_000 {
        rig.tick();
        stood |= rig.state().mode == Mode::Holding;
    }
    assert!(stood, "it comes to rest under control first");
    assert_eq!(rig.state().mode, Mode::Fault);
    assert_eq!(rig.state().latch.first().unwrap().fault, Fault::HostSilent);
}

#[test]
fn an_open_stop_switch_brings_a_controlled_stop_and_then_the_fault() {
    let mut line = moving(9);
    inject(&mut line, |f| f.stop_switch_open = true);
    line.port_mut().device_mut().tick();
    line.port_mut().device_mut().tick();
    assert_eq!(mode(&line), Mode::Stopping);
    wait(&mut line, 0.3);
    assert_eq!(latched(&line), Some(Fault::StopSwitch));
    assert!(line.port().device().state().brakes());
    assert_eq!(
        refused(&mut line, RequestBody::ClearFault),
        Refusal::CauseActing
    );
    inject(&mut line, |f| f.stop_switch_open = false);
    wait(&mut line, 0.01);
    line.request(RequestBody::ClearFault).unwrap();
    assert_eq!(
        refused(&mut line, RequestBody::Arm),
        Refusal::StopSwitchOpen
    );
}

#[test]
fn what_cannot_be_used_is_refused_and_changes_nothing() {
    let (mut line, plant) = bench(7);
    let good = nameplate(&plant).settings;
    let before = *line.port().device().state().settings();
    let mut gains = good.gains;
    gains.proportional = f32::NAN;
    let mut friction = good.friction;
    friction.coulomb = f32::NAN;
    let mut limits = good.limits;
    limits.torque = f32::NAN;
    let mut estimator = good.estimator;
    estimator.memory = f32::INFINITY;
    for body in [
        RequestBody::SetGains(gains),
        RequestBody::SetFriction(friction),
        RequestBody::SetLimits(limits),
        RequestBody::SetEstimator(estimator),
        RequestBody::SetPosition(f32::NAN),
    ] {
        assert_eq!(refused(&mut line, body), Refusal::BadValue);
    }
    assert_eq!(*line.port().device().state().settings(), before);
    assert_eq!(refused(&mut line, RequestBody::Start), Refusal::WrongMode);
    let fast = match excitation(1, 5, 5) {
        Trajectory::Fourier(mut shape) => {
            shape.sine.iter_mut().for_each(|x| *x *= 20.0);
            Trajectory::Fourier(shape)
        }
        other => other,
    };
    let refusal = refused(&mut line, RequestBody::SetTrajectory(fast));
    assert_eq!(bound(refusal), (Bounded::MotionSpeed, good.limits.velocity));
    line.request(RequestBody::Arm).unwrap();
    assert_eq!(
        refused(&mut line, RequestBody::Start),
        Refusal::NoTrajectory
    );
    assert_eq!(
        refused(&mut line, RequestBody::SetPosition(0.0)),
        Refusal::WrongMode
    );
}

/// The quantity and the bound of a refusal.
fn bound(refusal: Refusal) -> (Bounded, f32) {
    match refusal {
        Refusal::OutOfBounds {
            quantity, bound, ..
        } => (quantity, bound),
        other => panic!("{other:?}"),
    }
}

/// A link that is out of its range, or moves, is not armed: the reference would jump, or the link be caught with a jerk. And
/// no holding rig takes gains or models that it cannot have.
#[test]
fn what_a_user_may_not_ask_is_refused_with_its_bound() {
    let (mut line, plant) = bench(20);
    let limits = nameplate(&plant).settings.limits;
    for (position, expected) in [
        (limits.position_high + 0.09, limits.position_high),
        (limits.position_low - 0.09, limits.position_low),
    ] {
        line.request(RequestBody::SetPosition(position)).unwrap();
        let refusal = refused(&mut line, RequestBody::Arm);
        assert_eq!(bound(refusal), (Bounded::ArmPosition, expected));
    }
    line.request(RequestBody::SetPosition(plant.initial_position as f32))
        .unwrap();
    // 0.8 A with the bridge off, as through a shorted half bridge.
    inject(&mut line, |f| f.current_stuck = Some(2048 + 100));
    wait(&mut line, 0.01);
    let refusal = refused(&mut line, RequestBody::Arm);
    assert_eq!(bound(refusal), (Bounded::IdleCurrent, 0.5));
    inject(&mut line, |f| f.current_stuck = None);
    inject(&mut line, |f| f.external_torque = 3.0);
    wait(&mut line, 0.1);
    let refusal = refused(&mut line, RequestBody::Arm);
    assert_eq!(bound(refusal).0, Bounded::ArmVelocity);
    inject(&mut line, |f| f.external_torque = 0.0);
    wait(&mut line, 3.0);

    line.request(RequestBody::Arm).unwrap();
    wait(&mut line, 0.1);
    let own = nameplate(&plant).settings;
    let mut gains = own.gains;
    (gains.proportional, gains.derivative) = (1e9, 1e-6);
    let mut model = own.model;
    model.gravity_cos = 1e20;
    let mut friction = own.friction;
    friction.coulomb = 1e20;
    let mut slow = own.gains;
    slow.current_bandwidth = 1.0;
    let mut precompensation = own.precompensation;
    (precompensation.enabled, precompensation.gain) = (true, 1.2);
    let mut estimator = own.estimator;
    estimator.memory = -1.0;
    // As a torque, N·m.
    let offset = Effect::new(Kind::CurrentOffset, &[8.0], &[]);
    let before = *line.port().device().state().settings();
    for (body, quantity) in [
        (RequestBody::SetGains(gains), Bounded::PositionLoop),
        (RequestBody::SetGains(slow), Bounded::CurrentLoop),
        (RequestBody::SetModel(model), Bounded::Gravity),
        (RequestBody::SetFriction(friction), Bounded::DryFriction),
        (
            RequestBody::SetPrecompensation(precompensation),
            Bounded::FrictionShare,
        ),
        (
            RequestBody::SetEstimator(estimator),
            Bounded::EstimatorMemory,
        ),
        (
            RequestBody::SetEffects(core::iter::once(offset).collect()),
            Bounded::CurrentCorrection,
        ),
    ] {
        assert_eq!(bound(refused(&mut line, body)).0, quantity);
    }
    assert_eq!(*line.port().device().state().settings(), before);
    wait(&mut line, 0.1);
    assert_eq!(mode(&line), Mode::Holding);
}
