//! The control tick: one function for board, emulated rig and tests.

mod compensate;
mod estimation;

use rig_shared::control::{Measured, current, law};
use rig_shared::encoder;
use rig_shared::safety::monitor::{self, Readings};
use rig_shared::safety::{Fault, FaultRecord, Limit, LimitSet, Mode, Reaction, SnapshotSample};
use rig_shared::trajectory::Reference;
use rig_shared::units::Duty;
use rig_shared::wire::message::{Estimate, StateSample};

use crate::calibration::calibrate;
use crate::config::Config;
use crate::motor_brake::MotorBrake;
use crate::reference::Braking;
use crate::sample::{Command, Sample};
use crate::state::{Run, State};
use crate::window::Tick;

/// Output of a control tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Output {
    /// For the bridge.
    pub command: Command,
    /// A complete telemetry window: the tick at which it began, and its sample.
    pub state: Option<(u64, StateSample)>,
    /// The on-line estimate, if it is due.
    pub estimate: Option<Estimate>,
    /// This tick itself, as snapshot and capture keep it.
    pub tick: SnapshotSample,
    /// A fault that has just latched.
    pub fault: Option<FaultRecord>,
}

/// Runs one control tick. Takes the samples of one trigger, returns the command that acts from the next trigger on.
///
/// Not inlined: `firmware/fast_code.list` names it.
#[inline(never)]
pub fn step(config: &Config, state: &mut State, sample: Sample) -> Output {
    state.apply_changes(config);
    let readings = convert(config, state, sample);
    let mut output = Output::default();
    let fault = monitor::step(
        &config.monitor,
        &state.settings.limits,
        &mut state.monitor,
        &readings,
    )
    .or_else(|| board_fault(&sample));
    state.fault_cause_active = fault.is_some() || sample.stop_switch_open;
    let fault = fault
        .or_else(|| {
            let calibrating = state.mode == Mode::Calibrating;
            calibrating.then(|| calibrate(config, state, sample.current, readings.temperature))?
        })
        .or_else(|| check_host(config, state))
        .or_else(|| stop_switch_fault(state, sample.stop_switch_open));
    if let Some((fault, value)) = fault {
        output.fault = latch_fault(state, fault, value);
    }
    let mut limits = state.marks;
    limits.set(Limit::LateTick, sample.late_ticks > 0);
    state.reference = reference(config, state, &mut limits);
    let DriveOutput {
        duty,
        torque,
        explained,
    } = if state.mode.drives() && state.tick >= state.run.bridge_ready_tick {
        drive(config, state, &readings, &mut limits)
    } else {
        DriveOutput::default()
    };
    let (duty, bridge) = if state.motor_brake.is_some() {
        // Single values: a reference to what is returned would have it copied in every tick.
        let motor = [readings.current, readings.supply, readings.velocity];
        let duty = brake_after_fault(config, state, motor);
        (duty, state.motor_brake.is_some())
    } else {
        (duty, state.mode.drives())
    };
    state.drive_torque = torque;
    state.limits = limits;

    let tick = Tick {
        position: state.counts,
        velocity: state.velocity,
        current: readings.current,
        voltage: state.duty * readings.supply,
        reference: state.reference.position,
        torque,
        explained,
        position_error: state.position_error,
        limits,
    };
    output.tick = SnapshotSample {
        tick: state.tick,
        position: state.counts,
        current: readings.current,
        duty: state.duty,
        supply: readings.supply,
        reference: state.reference.position,
    };
    state.snapshot.push(output.tick);
    output.state = telemetry(config, state, &tick);
    output.estimate = estimation::feed_estimator(config, state, &tick);
    output.command = Command {
        duty: Duty(duty),
        bridge,
    };
    // The duty that has acted during this tick makes the last edge before the next tick's samples. Bits of positive numbers
    // are in the order of the numbers, and integers are compared in fewer cycles.
    let unsettled = state.duty.abs().to_bits() > config.settled_duty.to_bits();
    state.marks = LimitSet::default();
    state.marks.set(Limit::Unsettled, unsettled);
    state.duty = duty;
    state.tick += 1;
    output
}

/// Converts raw codes to quantities. Units begin only here.
fn convert(config: &Config, state: &mut State, sample: Sample) -> Readings {
    let scaling = &config.scaling;
    let age = sample
        .edge_age
        .map(|age| age as f32 * state.derived.ticks_per_edge_period);
    let motion = encoder::step(
        &state.derived.observer,
        &mut state.encoder,
        sample.encoder,
        age,
    );
    let origin = *state.origin.get_or_insert(motion.counts);
    let counts = motion.counts - origin;
    // At the first tick both are zero: the counter's value at power on is not a jump.
    let step = counts - state.counts;
    state.counts = counts;
    // Exact to a count up to 2²⁴ counts, about 40 joint turns; the position limits keep a rig far below. In 32 bits,
    // which the chip converts by hardware: 5000 joint turns.
    state.position = counts as i32 as f32 * state.derived.radians_per_count;
    state.velocity = motion.velocity * state.derived.radians_per_count;
    let (position, velocity) = (state.position, state.velocity);
    compensate::correct(config, state);
    let temperature = scaling.temperature_at_zero
        + f32::from(sample.temperature.0) * scaling.temperature_per_code;
    state.temperature_rise = temperature - state.start_temperature;
    // The checks use the sensor readings, the laws the corrected values.
    Readings {
        breaks: sample.breaks,
        late_ticks: sample.late_ticks,
        current_code: sample.current.0,
        current_at_rail: sample.current.at_rail(),
        current: (f32::from(sample.current.0) - state.calibration.zero_code)
            * scaling.current_per_code,
        supply: f32::from(sample.supply.0) * scaling.supply_per_code,
        temperature,
        encoder_step: step as i32,
        encoder_open: sample.encoder_open,
        position,
        velocity,
        duty: state.duty,
        lost_voltage: state.compensated_voltage,
        driving: state.mode.drives() && state.tick > state.run.bridge_ready_tick,
        braking: state.motor_brake.is_some(),
    }
}

/// Returns a fault that the board found in itself or its encoder.
fn board_fault(sample: &Sample) -> Option<(Fault, f32)> {
    if let Some(counts) = sample.encoder_wrong {
        return Some((Fault::EncoderSignal, counts as f32));
    }
    sample.stack_left.map(|left| (Fault::Stack, left as f32))
}

/// Handles a silent host: first a controlled stop, then the fault.
fn check_host(config: &Config, state: &mut State) -> Option<(Fault, f32)> {
    if !state.mode.drives() {
        return None;
    }
    let silent = state.tick.saturating_sub(state.last_contact_tick);
    let silent_limit = u64::from(config.host_silent_ticks);
    if silent > silent_limit && state.mode == Mode::Running {
        brake(state);
    }
    (silent > silent_limit + u64::from(config.host_lost_ticks))
        .then_some((Fault::HostSilent, silent as f32 * state.derived.period))
}

/// Returns the fault of a stop switch that is open, or was opened during this motion.
#[inline(always)]
fn stop_switch_fault(state: &mut State, is_open: bool) -> Option<(Fault, f32)> {
    let stops = is_open || state.stop_switch.stopping;
    stops.then(|| check_stop_switch(state, is_open))?
}

/// Ends the motion of a rig whose stop switch is open, or was opened during this motion: first by a controlled stop, then
/// by the fault. Not inlined because it is rare.
#[inline(never)]
fn check_stop_switch(state: &mut State, is_open: bool) -> Option<(Fault, f32)> {
    if is_open {
        state.stop_switch.closed_since = state.tick + 1;
    }
    state.stop_switch.stopping = matches!(state.mode, Mode::Running | Mode::Stopping);
    match state.mode {
        Mode::Running => {
            brake(state);
            None
        }
        Mode::Holding => Some((Fault::StopSwitch, 0.0)),
        Mode::Stopping | Mode::Calibrating | Mode::Disarmed | Mode::Fault => None,
    }
}

/// Returns the duty cycle while the motor brakes, from its current, A, the supply, V, and the joint's velocity, rad/s. Ends
/// the brake if it gives a voltage although its current may not be known, or the speed has grown. Without a voltage the
/// motor is short-circuited, which cannot drive it. Not inlined because it is rare.
#[inline(never)]
fn brake_after_fault(
    config: &Config,
    state: &mut State,
    [current, supply, velocity]: [f32; 3],
) -> f32 {
    let Some(brake) = &mut state.motor_brake else {
        return 0.0;
    };
    let now = SnapshotSample {
        current,
        duty: state.duty,
        supply,
        ..SnapshotSample::default()
    };
    let limits = &state.settings.limits;
    let hard_limit = limits.velocity * config.monitor.velocity_margin;
    let grown = brake.speed_has_grown(velocity, [limits.velocity, hard_limit]);
    let peak = limits.peak_current;
    let duty = brake.step(&config.drive, &state.derived, peak, &now);
    if duty != 0.0 && (grown || state.monitor.converter_is_suspect()) {
        state.motor_brake = None;
        return 0.0;
    }
    duty
}

/// Ends every motion as the fault allows, latches the fault and keeps the snapshot. Not inlined because it is rare.
#[inline(never)]
fn latch_fault(state: &mut State, fault: Fault, value: f32) -> Option<FaultRecord> {
    let encoder_failed = matches!(
        fault,
        Fault::EncoderJump | Fault::EncoderLost | Fault::EncoderSignal
    );
    match fault.reaction() {
        // Also while the rig brakes after another fault.
        Reaction::Coast => state.motor_brake = None,
        // The brake limits the current, so it needs its sensor.
        Reaction::Brake if state.mode.drives() && !state.monitor.converter_is_suspect() => {
            state.motor_brake = Some(MotorBrake::default());
        }
        // A bridge that is off stays off. So does one whose current may not be known. A brake goes on.
        Reaction::Brake => {}
    }
    let record = FaultRecord {
        fault,
        tick: state.tick,
        value,
    };
    state.mode = Mode::Fault;
    if encoder_failed {
        // After this fault the encoder no longer gives the position of the link, nor its speed.
        state.position_known = false;
        if let Some(brake) = &mut state.motor_brake {
            brake.ignore_encoder();
        }
    }
    let first = state.latch.latch(record);
    if first {
        state.snapshot.freeze();
    }
    first.then_some(record)
}

/// Begins a controlled stop from the present reference.
pub(crate) fn brake(state: &mut State) {
    state.run.braking = Braking::from(state.reference);
    state.mode = Mode::Stopping;
}

/// Returns the reference of this tick by mode. Ends modes that end by themselves.
fn reference(config: &Config, state: &mut State, limits: &mut LimitSet) -> Reference<f32> {
    let Run {
        start,
        length,
        base,
        ..
    } = state.run;
    let at_rest = |position| Reference {
        position,
        ..Reference::default()
    };
    let desired = match state.mode {
        Mode::Calibrating | Mode::Disarmed | Mode::Fault => return at_rest(state.position),
        Mode::Holding => at_rest(base),
        Mode::Running => {
            let elapsed = state.tick.saturating_sub(start);
            match &state.trajectory {
                Some((trajectory, _)) if elapsed < length => {
                    let offset = trajectory.at_tick(elapsed, config.rates.control_hz);
                    Reference {
                        position: base + offset.position,
                        ..offset
                    }
                }
                _ => {
                    state.run.base = state.reference.position;
                    state.mode = Mode::Holding;
                    at_rest(state.reference.position)
                }
            }
        }
        Mode::Stopping => {
            let next = state
                .run
                .braking
                .step(state.settings.limits.acceleration, state.derived.period);
            if state.run.braking.at_rest() {
                state.run.base = next.position;
                state.mode = Mode::Holding;
            }
            next
        }
    };
    let silent =
        state.tick.saturating_sub(state.last_contact_tick) > u64::from(config.host_silent_ticks);
    limits.set(Limit::HostSilent, silent);
    within_range(&state.settings.limits, desired, limits)
}

/// Holds a reference at the edge of the position range.
fn within_range(
    range: &rig_shared::safety::Limits<f32>,
    desired: Reference<f32>,
    limits: &mut LimitSet,
) -> Reference<f32> {
    let position = desired
        .position
        .max(range.position_low)
        .min(range.position_high);
    let outside = position != desired.position;
    limits.set(Limit::Position, outside);
    if outside {
        Reference {
            position,
            ..Reference::default()
        }
    } else {
        desired
    }
}

/// Result of driving in one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct DriveOutput {
    duty: f32,
    /// Commanded joint torque, N·m.
    torque: f32,
    /// Torque that effects beyond the standard model explain, N·m.
    explained: f32,
}

/// Computes effects and position law, then the current loop.
fn drive(config: &Config, state: &mut State, now: &Readings, limits: &mut LimitSet) -> DriveOutput {
    let measured = Measured {
        position: state.position,
        velocity: state.velocity,
    };
    let effects = compensate::torque(config, state);
    let torque = law::step(
        &state.derived.law,
        &mut state.law,
        measured,
        state.reference,
        effects.feedforward,
    );
    limits.set(Limit::Torque, torque.limited);
    let desired = config.drive.current(torque.value);
    let peak = state.settings.limits.peak_current;
    let target = desired.max(-peak).min(peak);
    limits.set(Limit::Current, target != desired);
    // The direction is that of the expected current, not of the noisy or the target current. It fades where the ripple
    // crosses zero.
    let expected = current::predict(&state.derived.current, &mut state.current_loop, target);
    let fade = (expected * state.derived.fade_per_ampere).clamp(-1.0, 1.0);
    state.compensated_voltage = state.lost_voltage * fade;
    let output = current::step(
        &state.derived.current,
        &mut state.current_loop,
        current::Input {
            reference: target,
            current: now.current - state.current_error,
            back_emf: config.drive.back_emf(state.velocity) + state.compensated_voltage,
            supply: now.supply,
        },
    );
    limits.set(Limit::Voltage, output.limited);
    DriveOutput {
        duty: output.duty,
        torque: torque.value,
        explained: effects.explained,
    }
}

/// Closes a telemetry window when it is full.
fn telemetry(config: &Config, state: &mut State, tick: &Tick) -> Option<(u64, StateSample)> {
    let first_tick = state.window_start();
    let window = state
        .telemetry
        .push(tick, config.rates.telemetry_decimation)?;
    let sample = StateSample {
        position_sum: window.position,
        velocity: window.mean(window.velocity),
        current: window.mean(window.current),
        voltage: window.mean(window.voltage),
        reference: window.mean(window.reference),
        torque_command: window.mean(window.torque),
        limits: window.limits,
        mode: state.mode,
    };
    Some((first_tick, sample))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    extern crate std;

    use super::*;
    use crate::nameplate::one_link;
    use crate::prechecked_request::precheck;
    use crate::request::execute;
    use rig_shared::effects::{Effect, Kind};
    use rig_shared::units::{AdcCode, EncoderCount};
    use rig_shared::wire::message::{Request, RequestBody};
    use std::{format, println};

    /// A sensor reading of 5 A is an over-current although an effect counts 0.4 A of it as an error; 4.6 A is none. The
    /// record holds the sensor's reading.
    #[test]
    fn the_checks_see_the_sensor_s_current() {
        let (config, settings) = one_link();
        assert_eq!(
            settings.limits.peak_current * config.monitor.current_margin,
            4.8
        );
        let mut state = State::new(&config, settings).unwrap();
        let code =
            |amperes: f32| AdcCode((2048.0 + amperes / config.scaling.current_per_code) as u16);
        let sample = |amperes: f32| Sample {
            current: code(amperes),
            supply: AdcCode((24.0 / config.scaling.supply_per_code) as u16),
            temperature: AdcCode(900),
            ..Sample::default()
        };
        while state.mode == Mode::Calibrating {
            assert_eq!(step(&config, &mut state, sample(0.0)).fault, None);
        }
        let torque = config.drive.joint_torque(0.4);
        let effect = Effect::new(Kind::CurrentOffset, &[torque], &[]);
        for body in [
            RequestBody::SetEffects([effect].into_iter().collect()),
            RequestBody::Arm,
        ] {
            let request = Request { id: 1, body };
            execute(&config, &mut state, &precheck(&config, request)).unwrap();
            for _ in 0..20 {
                step(&config, &mut state, sample(0.0));
            }
        }
        assert!((state.current_error - 0.4).abs() < 1e-6 && state.mode == Mode::Holding);
        let mut fault = None;
        for _ in 0..3 {
            let output = step(&config, &mut state, sample(5.0));
            assert!((output.tick.current - 5.0).abs() < 0.01);
            fault = fault.or(output.fault);
        }
        assert_eq!(fault.map(|record| record.fault), Some(Fault::OverCurrent));
    }

    /// One open reading begins the controlled stop in its own tick, from the present speed of the reference. The switch
    /// closes again in the next tick, and the fault follows all the same once the reference rests.
    #[test]
    fn one_open_reading_acts_in_its_own_tick() {
        let (mut config, settings) = one_link();
        // The motor of these samples stands still whatever its voltage.
        config.monitor.voltage.floor = f32::INFINITY;
        let mut state = State::new(&config, settings).unwrap();
        // A code that changes: the brake ends if the converter may be stuck.
        let sample = |tick: u64, stop_switch_open| Sample {
            current: AdcCode(2048 + (tick % 3) as u16),
            supply: AdcCode((24.0 / config.scaling.supply_per_code) as u16),
            temperature: AdcCode(900),
            stop_switch_open,
            ..Sample::default()
        };
        while state.mode == Mode::Calibrating {
            let tick = state.tick;
            step(&config, &mut state, sample(tick, false));
        }
        state.mode = Mode::Running;
        state.reference = Reference {
            velocity: 1.5,
            ..Reference::default()
        };
        let begin = state.tick;
        step(&config, &mut state, sample(begin, true));
        assert_eq!(state.mode, Mode::Stopping);
        let deceleration = state.settings().limits.acceleration;
        let change = deceleration * state.derived.period;
        assert!((state.reference.velocity - (1.5 - change)).abs() < 1e-6);
        assert_eq!(state.reference.acceleration.round(), -deceleration);
        let mut fault = None;
        while fault.is_none() {
            let tick = state.tick;
            fault = step(&config, &mut state, sample(tick, false)).fault;
            assert!(state.tick < begin + 2000);
        }
        let record = fault.unwrap();
        assert_eq!(record.fault, Fault::StopSwitch);
        // v/a = 25 ms.
        assert!((250..=253).contains(&(record.tick - begin)), "{record:?}");
        assert!(state.brakes() && state.mode == Mode::Fault);
    }

    /// The samples of a tick follow the last edge of the pulse that acted during the tick before. Its duty decides, in both
    /// directions.
    #[test]
    fn a_current_read_soon_after_an_edge_is_marked_in_the_next_tick() {
        let (config, settings) = one_link();
        let mut state = State::new(&config, settings).unwrap();
        let mut marks = |duty: f32| {
            state.duty = duty;
            [0; 3].map(|_| {
                step(&config, &mut state, Sample::default());
                state.limits.has(Limit::Unsettled)
            })
        };
        for duty in [0.57, -0.57, 0.95, -0.95] {
            assert_eq!(marks(duty), [false, true, false], "{duty}");
        }
        for duty in [0.0, 0.56, -0.56] {
            assert_eq!(marks(duty), [false; 3], "{duty}");
        }
    }

    /// New effects start from zero: the state of a cogging in N·m is never used as radians of an encoder's error, in
    /// any tick of the request.
    #[test]
    fn effects_that_are_replaced_leave_nothing_behind() {
        let (config, settings) = one_link();
        let send = |state: &mut State, body| {
            let request = Request { id: 1, body };
            execute(&config, state, &precheck(&config, request)).unwrap();
        };
        let set = |effect| RequestBody::SetEffects([effect].into_iter().collect());
        let sample = Sample {
            current: AdcCode(2048),
            supply: AdcCode((24.0 / config.scaling.supply_per_code) as u16),
            temperature: AdcCode(900),
            ..Sample::default()
        };
        for phase in 0..20 {
            let mut state = State::new(&config, settings).unwrap();
            while state.mode == Mode::Calibrating {
                step(&config, &mut state, sample);
            }
            send(&mut state, RequestBody::SetPosition(0.2));
            send(
                &mut state,
                set(Effect::new(Kind::Cogging, &[0.3, 0.2], &[12.0])),
            );
            send(&mut state, RequestBody::Arm);
            for _ in 0..40 + phase {
                step(&config, &mut state, sample);
            }
            let small = Effect::new(Kind::EncoderEccentricityMotor, &[1e-5, 1e-5], &[1.0]);
            send(&mut state, set(small));
            for _ in 0..40 {
                step(&config, &mut state, sample);
                assert!(
                    state.position_error.abs() < 2e-5,
                    "{phase}: {}",
                    state.position_error
                );
            }
            assert_ne!(state.position_error, 0.0);
        }
    }

    /// A winding and a link without friction behind a bridge, in steps of a tenth of a tick.
    struct Bench {
        config: Config,
        state: State,
        velocity: f32,
        position: f32,
        current: f32,
        command: Command,
    }

    impl Bench {
        /// The rig measures its offset and is armed, then the link is brought to `velocity`, rad/s.
        fn turning(velocity: f32) -> Self {
            let (config, settings) = one_link();
            let mut bench = Self {
                state: State::new(&config, settings).unwrap(),
                config,
                velocity: 0.0,
                position: 0.0,
                current: 0.0,
                command: Command::default(),
            };
            while bench.state.mode == Mode::Calibrating {
                bench.tick(2048);
            }
            // The observer of the velocity follows this acceleration without overshoot.
            for tick in 0..2000_u16 {
                bench.velocity = velocity * f32::from(tick.min(1000)) / 1000.0;
                bench.tick(2048 + tick % 3);
            }
            bench.state.mode = Mode::Holding;
            bench
        }

        /// One tick in which the converter reads `code`.
        fn tick(&mut self, code: u16) -> Output {
            let drive = self.config.drive;
            let counts = self.position / self.state.derived.radians_per_count;
            let sample = Sample {
                encoder: EncoderCount(counts as i64 as u16),
                current: AdcCode(code),
                supply: AdcCode((24.0 / self.config.scaling.supply_per_code) as u16),
                temperature: AdcCode(900),
                ..Sample::default()
            };
            let output = step(&self.config, &mut self.state, sample);
            let dt = 0.1 * self.state.derived.period;
            for _ in 0..10 {
                let voltage = self.command.duty.0 * 24.0;
                let rest =
                    voltage - drive.resistance * self.current - drive.back_emf(self.velocity);
                self.current += dt * rest / drive.inductance;
                if !self.command.bridge {
                    self.current = 0.0;
                }
                let torque = drive.joint_torque(self.current);
                self.velocity += dt * torque / 0.17;
                self.position += dt * self.velocity;
            }
            self.command = output.command;
            output
        }

        /// The fault comes while the motor already brakes at 3.2 A.
        fn brake(&mut self, fault: Fault) {
            self.current = -3.2_f32.copysign(self.velocity);
            let voltage = self.config.drive.back_emf(self.velocity) + 0.6 * self.current;
            self.command = Command {
                duty: Duty(voltage / 24.0),
                bridge: true,
            };
            self.state.duty = self.command.duty.0;
            latch_fault(&mut self.state, fault, 0.0);
            assert!(self.state.brakes());
        }
    }

    /// Code of a current, A.
    fn code_of(config: &Config, current: f32) -> u16 {
        (2048.0 + current / config.scaling.current_per_code) as u16
    }

    /// The reading of the current stays beyond the peak while the rig brakes, from the start or after 5 ms: an integrator
    /// that believes it would drive the link on. The bridge goes off within 3 ms, and the link is hardly faster.
    #[test]
    fn a_brake_whose_current_reading_freezes_never_drives() {
        for velocity in [1.0_f32, 3.0, 6.0, -6.0] {
            for frozen in [3.21, 3.5, 4.7_f32] {
                for sound in [0, 50] {
                    let mut bench = Bench::turning(velocity);
                    bench.brake(Fault::HostSilent);
                    for _ in 0..sound {
                        let code = code_of(&bench.config, bench.current);
                        bench.tick(code);
                    }
                    let begin = bench.velocity.abs();
                    let code = code_of(&bench.config, -frozen.copysign(velocity));
                    let (mut fastest, mut on) = (0.0_f32, 0);
                    for _ in 0..5000 {
                        on += i32::from(bench.tick(code).command.bridge);
                        fastest = fastest.max(bench.velocity.abs());
                    }
                    let case = format!("{velocity} {frozen} {sound}: {begin} {fastest} {on}");
                    assert!(fastest < begin + 0.05, "{case}");
                    assert!(on < 30 && !bench.state.brakes(), "{case}");
                }
            }
        }
    }

    /// The reading is wrong but alive: its code changes. The voltage stays below the back-EMF at first, and the growing speed
    /// ends the brake, or the hard limit does.
    #[test]
    fn a_brake_that_lets_the_speed_grow_ends() {
        for velocity in [1.0_f32, 3.0, 6.0, 7.2, 8.0] {
            let mut bench = Bench::turning(velocity);
            bench.brake(Fault::HostSilent);
            let mut fastest = 0.0_f32;
            for tick in 0..20_000 {
                let code = code_of(&bench.config, -4.0) + tick % 3;
                bench.tick(code);
                fastest = fastest.max(bench.velocity.abs());
            }
            let case = format!("{velocity}: {fastest}");
            println!("{case}");
            assert!(!bench.state.brakes(), "{case}");
            let allowed = (velocity + 1.5).min(7.5_f32.max(velocity + 0.375));
            assert!(fastest < allowed + 0.1, "{case}");
        }
    }

    /// With a sound sensor the same bench brakes to rest, also after the encoder has failed and shows another speed.
    #[test]
    fn a_brake_with_a_sound_sensor_comes_to_rest() {
        for (velocity, fault) in [
            (6.0, Fault::HostSilent),
            (-8.0, Fault::OverSpeed),
            (6.0, Fault::EncoderLost),
        ] {
            let mut bench = Bench::turning(velocity);
            bench.brake(fault);
            let mut largest = 0.0_f32;
            for tick in 0..5000_u16 {
                if fault == Fault::EncoderLost {
                    bench.position += 2e-6 * f32::from(tick);
                }
                let code = code_of(&bench.config, bench.current) + tick % 3;
                bench.tick(code);
                largest = largest.max(bench.current.abs());
            }
            let case = format!("{fault:?}: {} rad/s, {largest} A", bench.velocity);
            assert!(bench.state.brakes(), "{case}");
            assert!(bench.velocity.abs() < 0.05 && largest < 4.0, "{case}");
        }
    }
}
