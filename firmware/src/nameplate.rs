//! Data of the rig: the one file to change for another motor, gear, encoder or sensor.
//!
//! The numbers equal those of `host/robots/one-link.toml`, which `rig init one-link` writes; a test of the host
//! compares them. The host sends or stores its own values (limits, gains, laws, models) over the wire.

use rig_shared::compensation::Effects;
use rig_shared::control::{ControlKind, Gains};
use rig_shared::drive::Drive;
use rig_shared::estimation::EstimatorSettings;
use rig_shared::friction::Friction;
use rig_shared::link::LinkParameters;
use rig_shared::precompensation::PrecompensationSettings;
use rig_shared::safety::Limits;

use crate::config::{Config, Encoder, Rates, Settings};

/// Rates of all periodic work.
pub const RATES: Rates = Rates::TEMPLATE;

/// Time from an edge at the bridge's inputs to the current amplifier's answer at the converter, ns: propagation and dead time
/// of the bridge, delay of the amplifier, and of a filter at the pin. The samples of the current are centred on the middle
/// of a braking interval, later by this time.
///
/// 600 ns for the bridge and 400 ns for the amplifier (400 kHz of bandwidth) are estimates for the listed parts. Measure it
/// on your board with an oscilloscope (docs/firmware.md, "Scaling").
pub const SENSE_DELAY_NS: u32 = 1000;

/// Time from an edge at the amplifier's inputs until its output is settled, ns. A current that is read earlier is marked
/// ([`rig_shared::safety::Limit::Unsettled`]), and the on-line estimator does not learn from it.
///
/// 9600 ns: an INA240 to 0.5 % (its data sheet SBOS662, "settling time"). 0 for a sensor without a common-mode step, such as
/// a Hall-effect sensor.
pub const SENSE_SETTLING_NS: u32 = 9600;

/// Returns the one-link rig of the template: its fixed values, and the settings until the host replaces them.
pub fn one_link() -> (Config, Settings) {
    one_link_at(RATES)
}

/// The same at other rates.
pub fn one_link_at(rates: Rates) -> (Config, Settings) {
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
    let encoder = Encoder {
        counts_per_motor_turn: 8192,
        observer_bandwidth: 200.0,
        index_levels: 0b00,
    };
    let config = Config::new(rates, drive, encoder, &limits, SENSE_SETTLING_NS);
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
