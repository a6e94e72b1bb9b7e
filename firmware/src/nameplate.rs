//! What the board is told about its rig: the one file to change for another motor, gear, encoder or sensor.
//!
//! The numbers are those of `host/robots/one-link.toml`, which `rig init one-link` writes; a test of the host
//! holds them together. What the host may replace (limits, gains, laws, models) it sends or stores over the wire.

use rig_shared::compensation::Effects;
use rig_shared::control::{ControlKind, Gains};
use rig_shared::drive::Drive;
use rig_shared::estimation::EstimatorSettings;
use rig_shared::friction::Friction;
use rig_shared::link::LinkParameters;
use rig_shared::precompensation::PrecompensationSettings;
use rig_shared::safety::Limits;
use rig_shared::safety::monitor::MonitorConfig;
use rig_shared::safety::voltage::VoltageModel;

use crate::config::{Config, Encoder, Rates, Settings, ratings, wake_ticks};
use crate::sample::Scaling;

/// The one-link rig of the template: what is fixed, and what holds until the host says otherwise.
pub fn one_link() -> (Config, Settings) {
    let rates = Rates::default();
    let rate = rates.control_hz;
    let limits = Limits {
        position_low: -3.1,
        position_high: 3.1,
        velocity: 6.0,
        acceleration: 60.0,
        torque: 8.0,
        continuous_current: 1.6,
        peak_current: 3.2,
    };
    let drive = Drive {
        gear_ratio: 50.0,
        rotor_inertia: 2.0e-5,
        torque_constant: 0.05,
        resistance: 0.6,
        inductance: 0.5e-3,
    };
    let counts_per_motor_turn = 8192;
    let config = Config {
        rates,
        scaling: Scaling::default(),
        drive,
        encoder: Encoder {
            counts_per_motor_turn,
            observer_bandwidth: 200.0,
            index_levels: 0b00,
        },
        monitor: MonitorConfig {
            period: 1.0 / rate as f32,
            supply: [18.0, 30.0],
            temperature: 85.0,
            current_margin: 1.5,
            velocity_margin: 1.25,
            position_margin: 0.1,
            // Four times the counts of a tick at 6 rad/s: 39.1.
            largest_step: 161,
            persistence: 3,
            voltage: VoltageModel::new(&drive, counts_per_motor_turn, 1.0 / rate as f32),
            stuck_ticks: rate / 20,
            stuck_duty: 0.02,
            thermal_time: 10.0,
        },
        ratings: ratings(&limits, (core::f64::consts::TAU / (8192.0 * 50.0)) as f32),
        calibration_ticks: rate / 2,
        largest_offset: 0.5,
        host_silent_ticks: rate / 2,
        wake_ticks: wake_ticks(rates.control_hz),
        host_lost_ticks: rate,
    };
    let settings = Settings {
        control: ControlKind::ProportionalDerivative,
        gains: Gains {
            // (2π·6 Hz)² and 2·(2π·6 Hz) times 0.17 kg·m².
            proportional: 241.607_93,
            derivative: 12.817_698,
            adaptation: 37.699_112,
            current_bandwidth: rate as f32 / 20.0,
        },
        model: LinkParameters {
            inertia: 0.17,
            gravity_cos: 2.943,
            gravity_sin: 0.0,
            viscous: 0.3,
            coulomb: 0.4,
            offset: 0.0,
        },
        friction: Friction {
            coulomb: 0.4,
            viscous: 0.3,
            ..Friction::default()
        },
        precompensation: PrecompensationSettings {
            enabled: false,
            gain: 0.95,
            gain_at_rest: 0.8,
            velocity_threshold: 0.01,
        },
        effects: Effects::default(),
        limits,
        estimator: EstimatorSettings {
            slip_velocity: 0.2,
            ..EstimatorSettings::for_band(
                [0.017, -8.0, -8.0, 0.0, 0.0, -4.0],
                [1.7, 8.0, 8.0, 8.0 / 6.0 * 4.0, 4.0, 4.0],
            )
        },
    };
    (config, settings)
}
