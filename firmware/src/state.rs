//! State of the running rig.

use rig_shared::compensation::{self, Compensation};
use rig_shared::control::{current, law};
use rig_shared::encoder;
use rig_shared::estimation::{OneLinkEstimator, RowCounter, SettingsFault, one_link};
use rig_shared::safety::monitor::MonitorState;
use rig_shared::safety::{FaultLatch, LimitSet, Mode, Snapshot};
use rig_shared::trajectory::{Extremes, PreparedTrajectory, Reference};
use rig_shared::wire::message::SelfTest;

use crate::config::{Config, Settings};
use crate::derived::Derived;
use crate::motor_brake::MotorBrake;
use crate::reference::Braking;
use crate::stop_switch::StopSwitch;
use crate::window::Window;

/// Control ticks that the fault snapshot keeps.
pub const SNAPSHOT_TICKS: usize = 512;

/// Everything that one control tick passes to the next.
#[derive(Clone, Debug)]
pub struct State {
    /// Index of the next control tick, from 0 at power on.
    pub tick: u64,
    /// Mode.
    pub mode: Mode,
    /// The loaded trajectory and its extremes.
    pub trajectory: Option<(PreparedTrajectory<f32>, Extremes<f32>)>,
    /// True while settings are being stored: then only `Disarm` and requests about the session are carried out.
    pub storing: bool,
    /// The first fault since the last clearing.
    pub latch: FaultLatch,
    /// The ticks around that fault.
    pub snapshot: Snapshot<SNAPSHOT_TICKS>,
    /// Tick of the last message from the host.
    pub last_contact_tick: u64,
    /// Measured joint position, rad; 0 is the position at power on until the host sets it.
    pub position: f32,
    /// Estimated joint velocity, rad/s.
    pub velocity: f32,
    /// True if the host has set the position of the link since power on.
    pub position_known: bool,
    /// Reference of the last tick.
    pub reference: Reference<f32>,
    /// Limits that acted in the last tick.
    pub limits: LimitSet,
    /// True if the cause of a fault acts now, latched or not.
    pub fault_cause_active: bool,
    /// The on-line estimator.
    pub estimator: OneLinkEstimator<f32>,
    pub(crate) settings: Settings,
    pub(crate) derived: Derived,
    /// The settings have changed since `derived` was computed.
    pub(crate) derived_outdated: bool,
    /// The effects have changed since `settings` was updated.
    pub(crate) effects_changed: bool,
    /// This tick has time for a request.
    accepts_request: bool,
    /// The effects of the settings, checked.
    pub(crate) compensation: Compensation<f32>,
    pub(crate) effects: compensation::State<f32>,
    /// Constant current error according to the effects, A.
    pub(crate) current_error: f32,
    /// Voltage loss of the bridge according to the effects, V.
    pub(crate) lost_voltage: f32,
    /// Part of this loss compensated in the last tick, V.
    pub(crate) compensated_voltage: f32,
    /// Correction of the position by the effects in this tick, rad.
    pub(crate) position_error: f32,
    /// Torque ordered in the last tick, N·m.
    pub(crate) drive_torque: f32,
    /// Temperature at the end of the calibration, °C.
    pub(crate) start_temperature: f32,
    /// Temperature rise above that one, K.
    pub(crate) temperature_rise: f32,
    pub(crate) calibration: Calibration,
    pub(crate) encoder: encoder::State<f32>,
    /// Unwrapped counts at power on.
    pub(crate) origin: Option<i64>,
    /// Unwrapped counts of the last tick, from `origin`.
    pub(crate) counts: i64,
    pub(crate) monitor: MonitorState,
    pub(crate) law: law::State<f32>,
    pub(crate) current_loop: current::State<f32>,
    pub(crate) telemetry: Window,
    pub(crate) estimation: Window,
    /// The estimator's previous window: its regressor belongs to the instant between two.
    pub(crate) previous_window: Option<Window>,
    /// Rows of the estimator by what became of them.
    pub(crate) rows: RowCounter,
    /// The estimator must restart.
    pub(crate) restart_due: bool,
    pub(crate) updates_since_report: u16,
    /// The estimate must be reported with the next tick.
    pub(crate) report_due: bool,
    /// Duty cycle that acts during this tick.
    pub(crate) duty: f32,
    /// Marks of the next tick's readings.
    pub(crate) marks: LimitSet,
    pub(crate) run: Run,
    /// Present if the motor brakes after a fault.
    pub(crate) motor_brake: Option<MotorBrake>,
    pub(crate) stop_switch: StopSwitch,
    /// Part of the protection that failed the self-test at the start: the rig is not armed.
    pub(crate) failed_test: Option<SelfTest>,
}

/// The motion under way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Run {
    /// Tick at which the trajectory started.
    pub(crate) start: u64,
    /// Ticks that it takes.
    pub(crate) length: u64,
    /// Tick from which the bridge, just enabled, follows commands.
    pub(crate) bridge_ready_tick: u64,
    /// Base position of trajectory or hold, rad.
    pub(crate) base: f32,
    /// The stop in progress.
    pub(crate) braking: Braking,
}

/// The current offset, measured while the bridge is off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Calibration {
    pub(crate) ticks: u32,
    /// Sum of the codes: exact in an integer.
    pub(crate) sum: u64,
    /// Sum of their squares.
    pub(crate) squares: u64,
    /// Standard deviation of the measured offset, A.
    pub(crate) std: f32,
    /// Measured code at no current.
    pub(crate) zero_code: f32,
}

impl Calibration {
    /// Returns the standard deviation of the mean code, from the spread of the codes: n·Σc² − (Σc)² in integers,
    /// because the difference is small against its terms. Noise is assumed white from tick to tick; it dithers the
    /// converter's rounding, which is included.
    pub(crate) fn std_of_mean(&self) -> f32 {
        let n = u128::from(self.ticks.max(1));
        let spread = (n * u128::from(self.squares))
            .saturating_sub(u128::from(self.sum) * u128::from(self.sum));
        // n²·variance over n³ is the variance of the mean.
        libm::sqrtf(spread as f32) / (n as f32 * libm::sqrtf(n as f32))
    }
}

impl State {
    /// Notes the part of the protection that failed the self-test of the board, if any did.
    pub fn note_self_test(&mut self, failed: Option<SelfTest>) {
        self.failed_test = failed;
    }

    /// Returns the mean current of the last `ticks` control ticks, A; while the snapshot is frozen, of its last.
    pub(crate) fn mean_current(&self, ticks: usize) -> f32 {
        let held = self.snapshot.len();
        let from = held.saturating_sub(ticks);
        let last = (from..held).filter_map(|index| self.snapshot.get(index));
        let sum: f32 = last.map(|tick| tick.current).sum();
        sum / (held - from).max(1) as f32
    }

    /// Returns the state at power on: calibrating, bridge off.
    ///
    /// # Errors
    /// The fault of the estimator's settings.
    pub fn new(config: &Config, settings: Settings) -> Result<Self, SettingsFault> {
        let estimator = OneLinkEstimator::new(&settings.estimator, config.rates.estimator_hz())?;
        Ok(Self::with_estimator(config, settings, estimator))
    }

    /// Returns the state at power on with an estimator of these settings. Separate from [`State::new`] so that it can
    /// be built in place: it is too large to be passed on a chip's stack.
    pub fn with_estimator(
        config: &Config,
        settings: Settings,
        estimator: OneLinkEstimator<f32>,
    ) -> Self {
        let derived = Derived::new(config, &settings);
        // The firmware's own settings have no effects; stored settings were checked when they were read.
        let compensation = Compensation::new(&settings.effects).unwrap_or_default();
        Self {
            tick: 0,
            mode: Mode::Calibrating,
            trajectory: None,
            storing: false,
            latch: FaultLatch::default(),
            snapshot: Snapshot::default(),
            last_contact_tick: 0,
            position: 0.0,
            velocity: 0.0,
            position_known: false,
            reference: Reference::default(),
            limits: LimitSet::default(),
            fault_cause_active: false,
            estimator,
            settings,
            compensation,
            effects: compensation::State::default(),
            current_error: compensation.current_error(derived.torque_per_ampere),
            lost_voltage: compensation.lost_voltage(),
            compensated_voltage: 0.0,
            position_error: 0.0,
            drive_torque: 0.0,
            start_temperature: 0.0,
            temperature_rise: 0.0,
            derived,
            derived_outdated: false,
            effects_changed: false,
            accepts_request: false,
            calibration: Calibration {
                zero_code: config.scaling.current_zero,
                ..Calibration::default()
            },
            encoder: encoder::State::default(),
            origin: None,
            counts: 0,
            monitor: MonitorState::default(),
            law: law::State::default(),
            current_loop: current::State::default(),
            telemetry: Window::default(),
            estimation: Window::default(),
            previous_window: None,
            rows: RowCounter::default(),
            restart_due: false,
            updates_since_report: 0,
            report_due: false,
            duty: 0.0,
            marks: LimitSet::default(),
            run: Run::default(),
            motor_brake: None,
            stop_switch: StopSwitch::default(),
            failed_test: None,
        }
    }

    /// Returns the winding's heat from its own current, as a filtered square, A². It must survive a reset.
    pub fn heat(&self) -> f32 {
        self.monitor.heat
    }

    /// Continues with the heat of the winding ([`State::heat`]); an invalid number counts as zero. The overload state
    /// is unknown, so an overload is assumed until the winding is cool.
    pub fn restore_heat(&mut self, heat: f32) {
        self.monitor.heat = if heat > 0.0 { heat } else { 0.0 };
        self.monitor.overloaded = true;
    }

    /// Returns true if the motor brakes after a fault: the bridge is on although no law drives it.
    pub fn brakes(&self) -> bool {
        self.motor_brake.is_some()
    }

    /// Returns the present values of the settings that the host may replace.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the control tick at which the open telemetry window began.
    pub fn window_start(&self) -> u64 {
        self.tick - u64::from(self.telemetry.ticks)
    }

    /// Returns true if the tick has time for rare work: no periodic effect turns, no law is evaluated, and the
    /// estimator does not learn. If the estimator learns too often for such ticks, every tick counts as idle.
    fn is_idle(&self, config: &Config) -> bool {
        let rates = &config.rates;
        let learns = self.estimation.ticks + 1 >= rates.estimator_decimation;
        rates.estimator_decimation < 4 || (self.tick & 1 == 0 && !learns)
    }

    /// Applies changed settings or effects in a tick that has time, and decides if a request may be served in this
    /// tick.
    #[inline(always)]
    pub(crate) fn apply_changes(&mut self, config: &Config) {
        self.accepts_request = false;
        if !self.is_idle(config) {
            return;
        }
        if self.derived_outdated {
            self.derived_outdated = false;
            self.derived = Derived::new(config, &self.settings);
        } else if self.effects_changed {
            self.effects_changed = false;
            self.apply_effects();
        } else {
            self.accepts_request = true;
        }
    }

    /// Returns true if the finished tick also has time for a request. It is false while changes of the last request are
    /// pending, so each request is in force before the next is served.
    pub fn accepts_request(&self) -> bool {
        self.accepts_request
    }

    /// Replaces the effects and restarts the estimator: its old estimate includes torque that the effects now explain.
    pub(crate) fn replace_effects(&mut self, compensation: &Compensation<f32>) {
        self.compensation = *compensation;
        self.effects_changed = true;
        self.restart_estimator();
    }

    /// Updates values after the effects were replaced. Not inlined: rare code must not use the tick's fast memory.
    #[inline(never)]
    fn apply_effects(&mut self) {
        self.settings.effects = self.compensation.effects();
        self.effects = compensation::State::default();
        self.current_error = self
            .compensation
            .current_error(self.derived.torque_per_ampere);
        self.lost_voltage = self.compensation.lost_voltage();
    }

    /// Requests a restart of the estimator.
    ///
    /// It restarts in a later tick, because the tick that serves a request has a high load.
    pub(crate) fn restart_estimator(&mut self) {
        self.restart_due = true;
    }

    /// Replaces the estimator's constants. It restarts later, as with [`State::restart_estimator`].
    pub(crate) fn replace_estimator(&mut self, config: &one_link::Config<f32>) {
        self.estimator.reconfigure(config);
        self.restart_estimator();
    }
}
