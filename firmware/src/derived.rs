//! Constants derived from configuration and settings; computed when those change, never in the tick.

use rig_shared::control::{adaptive, current, law};
use rig_shared::encoder;

use crate::config::{Config, Settings};
use crate::sample::EDGE_CLOCK_HZ;

/// Bound on |s| below which the adaptive law does not learn, rad/s. It is about the velocity observer's ripple and the
/// tracking noise of a rig at rest, where learning would only drift.
const ADAPTATION_DEAD_ZONE: f32 = 0.02;
/// Largest share of the supply that the bridge may use. The rest is for dead time and bootstrap refresh.
const DUTY_LIMIT: f32 = 0.95;

/// Share of the peak current below which the bridge's voltage loss fades.
const FADE: f32 = 0.02;

/// Constants of the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derived {
    /// Control period, s.
    pub period: f32,
    /// Estimator period, s.
    pub estimator_period: f32,
    /// Joint angle of one encoder count, rad.
    pub radians_per_count: f32,
    /// Motor angle of one encoder count, rad.
    pub motor_radians_per_count: f32,
    /// Joint torque per motor current, N·m/A.
    pub torque_per_ampere: f32,
    /// Control ticks per period of the clock that times the encoder's edges.
    pub ticks_per_edge_period: f32,
    /// Lag of the current loop: whole ticks, and the remaining share of a tick.
    pub lag: (u8, f32),
    /// Compensated share of the bridge's loss per wanted ampere, 1/A.
    pub fade_per_ampere: f32,
    /// Velocity observer.
    pub observer: encoder::Config<f32>,
    /// Position law.
    pub law: law::Config<f32>,
    /// Current loop.
    pub current: current::Config<f32>,
}

impl Derived {
    /// Computes the constants.
    #[inline(never)]
    pub fn new(config: &Config, settings: &Settings) -> Self {
        let rate = config.rates.control_hz as f32;
        let period = 1.0 / rate;
        let counts_per_joint_turn =
            config.encoder.counts_per_motor_turn as f32 * config.drive.gear_ratio;
        let limits = &settings.limits;
        let current = current::Config::design(&config.drive, &settings.gains, period, DUTY_LIMIT);
        // `validation` refuses bandwidths whose lag exceeds the remembered ticks.
        let lag = current.lag * rate;
        let whole = lag as u8;
        Self {
            period,
            estimator_period: f32::from(config.rates.estimator_decimation) * period,
            radians_per_count: core::f32::consts::TAU / counts_per_joint_turn,
            motor_radians_per_count: core::f32::consts::TAU
                / config.encoder.counts_per_motor_turn as f32,
            torque_per_ampere: config.drive.joint_torque(1.0),
            ticks_per_edge_period: rate / EDGE_CLOCK_HZ as f32,
            fade_per_ampere: 1.0 / (FADE * limits.peak_current),
            observer: encoder::Config::new(config.encoder.observer_bandwidth, rate),
            law: law::Config {
                kind: settings.control,
                gains: settings.gains,
                design_inertia: settings.model.inertia,
                model: settings.model,
                friction: settings.friction,
                precompensation: settings.precompensation,
                adaptation: adaptive::Adaptation::design(
                    settings.gains.adaptation,
                    settings.estimator.lower,
                    settings.estimator.upper,
                    limits.torque,
                    limits.velocity,
                    ADAPTATION_DEAD_ZONE,
                ),
                torque_limit: limits.torque,
                period,
            },
            lag: (whole, lag - f32::from(whole)),
            current,
        }
    }
}
