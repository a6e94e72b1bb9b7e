//! What changes while the rig runs.

use rig_shared::control::{current, law};
use rig_shared::encoder;
use rig_shared::estimation::{OneLinkEstimator, SettingsFault};
use rig_shared::safety::monitor::MonitorState;
use rig_shared::safety::{FaultLatch, LimitSet, Mode, Snapshot};
use rig_shared::trajectory::{Extremes, Reference, Trajectory};

use crate::config::{Config, Settings};
use crate::derived::Derived;
use crate::reference::Braking;
use crate::window::Window;

/// Control ticks that the fault snapshot keeps.
pub const SNAPSHOT_TICKS: usize = 512;

/// Everything that one control tick hands to the next.
#[derive(Clone, Debug)]
pub struct State {
    /// Index of the next control tick, from 0 at power on.
    pub tick: u64,
    /// Mode.
    pub mode: Mode,
    /// The loaded trajectory, and how far it goes.
    pub trajectory: Option<(Trajectory<f32>, Extremes<f32>)>,
    /// Settings are being stored: nothing but `Disarm` and the conversation is carried out meanwhile.
    pub storing: bool,
    /// The first fault since the last clearing.
    pub latch: FaultLatch,
    /// The ticks around that fault.
    pub snapshot: Snapshot<SNAPSHOT_TICKS>,
    /// Tick at which the host was last heard.
    pub heard: u64,
    /// Joint position as last measured, rad; 0 where the link stood at power on.
    pub position: f32,
    /// Joint velocity as last estimated, rad/s.
    pub velocity: f32,
    /// Reference of the last tick.
    pub reference: Reference<f32>,
    /// Limits that acted in the last tick.
    pub limits: LimitSet,
    /// The cause of a fault acts now, whether or not one is latched.
    pub cause_acting: bool,
    /// The on-line estimator.
    pub estimator: OneLinkEstimator<f32>,
    pub(crate) settings: Settings,
    pub(crate) derived: Derived,
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
    /// The estimator's previous window: its regressor lies midway between two.
    pub(crate) previous: Option<Window>,
    pub(crate) updates_since_report: u16,
    /// Duty cycle that acts during this tick.
    pub(crate) duty: f32,
    pub(crate) run: Run,
}

/// The motion under way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Run {
    /// Tick at which the trajectory started.
    pub(crate) start: u64,
    /// Position that trajectory or hold is about, rad.
    pub(crate) base: f32,
    /// The stop under way.
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
    /// Standard deviation of the mean code, from the codes' own spread: n·Σc² − (Σc)² in integers, as the
    /// difference is small against its terms. Noise is taken as white from tick to tick; the converter's
    /// rounding counts as it is dithered by the noise.
    pub(crate) fn std_of_mean(&self) -> f32 {
        let n = u128::from(self.ticks.max(1));
        let spread = (n * u128::from(self.squares))
            .saturating_sub(u128::from(self.sum) * u128::from(self.sum));
        // n²·variance over n³ is the variance of the mean.
        libm::sqrtf(spread as f32) / (n as f32 * libm::sqrtf(n as f32))
    }
}

impl State {
    /// The state at power on: calibrating, bridge off.
    ///
    /// # Errors
    /// What is wrong with the estimator's settings.
    pub fn new(config: &Config, settings: Settings) -> Result<Self, SettingsFault> {
        let estimator = OneLinkEstimator::new(&settings.estimator, config.rates.estimator_hz())?;
        Ok(Self::with(config, settings, estimator))
    }

    /// The state at power on with an estimator of these settings. Apart from [`State::new`] so that it can be
    /// made where it is to lie: it is too large to be passed about on a chip's stack.
    pub fn with(config: &Config, settings: Settings, estimator: OneLinkEstimator<f32>) -> Self {
        let derived = Derived::new(config, &settings);
        Self {
            tick: 0,
            mode: Mode::Calibrating,
            trajectory: None,
            storing: false,
            latch: FaultLatch::default(),
            snapshot: Snapshot::default(),
            heard: 0,
            position: 0.0,
            velocity: 0.0,
            reference: Reference::default(),
            limits: LimitSet::default(),
            cause_acting: false,
            estimator,
            settings,
            derived,
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
            previous: None,
            updates_since_report: 0,
            duty: 0.0,
            run: Run::default(),
        }
    }

    /// What the host may replace, as it is now.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Control tick at which the telemetry window now open began.
    pub fn window_start(&self) -> u64 {
        self.tick - u64::from(self.telemetry.ticks)
    }

    /// Replaces settings and everything that follows from them; nothing where they cannot be used.
    pub(crate) fn apply(
        &mut self,
        config: &Config,
        settings: Settings,
    ) -> Result<(), SettingsFault> {
        settings.estimator.check(config.rates.estimator_hz())?;
        self.derived = Derived::new(config, &settings);
        self.settings = settings;
        Ok(())
    }

    /// Has the estimator forget everything.
    pub(crate) fn restart_estimator(&mut self, config: &Config) -> Result<(), SettingsFault> {
        self.estimator =
            OneLinkEstimator::new(&self.settings.estimator, config.rates.estimator_hz())?;
        self.previous = None;
        Ok(())
    }
}
