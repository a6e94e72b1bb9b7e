//! Values that are fixed while the rig runs (rates, nameplate, thresholds), and values that the host may replace.

use micromath::F32Ext;
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
use serde::{Deserialize, Serialize};

use crate::sample::{PWM_HZ, SAMPLE_HALF_SPAN_NS, Scaling};

/// Rates, as integers so that every dependent constant is exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rates {
    /// Control ticks per second.
    pub control_hz: u32,
    /// Control ticks averaged into one telemetry sample.
    pub telemetry_decimation: u16,
    /// Control ticks averaged into one estimator update.
    pub estimator_decimation: u16,
    /// Estimator updates between two reports of the estimate.
    pub estimate_report_decimation: u16,
}

impl Default for Rates {
    fn default() -> Self {
        Self::TEMPLATE
    }
}

impl Rates {
    /// Control at 10 kHz, telemetry and estimator at 1 kHz, the estimate reported at 20 Hz.
    pub const TEMPLATE: Self = Self {
        control_hz: 10_000,
        telemetry_decimation: 10,
        estimator_decimation: 10,
        estimate_report_decimation: 50,
    };

    /// Returns the estimator updates per second.
    pub fn estimator_hz(&self) -> f32 {
        self.control_hz as f32 / f32::from(self.estimator_decimation.max(1))
    }

    /// Returns the telemetry samples per second.
    pub fn telemetry_hz(&self) -> f32 {
        self.control_hz as f32 / f32::from(self.telemetry_decimation.max(1))
    }
}

/// Motor encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    /// Counts per motor turn after quadrature.
    pub counts_per_motor_turn: u32,
    /// Bandwidth of the velocity observer, Hz.
    pub observer_bandwidth: f32,
    /// Levels of A (2) and B (1) during the index pulse.
    pub index_levels: u8,
}

/// Thermal time constant of the winding, s.
const THERMAL_TIME: f32 = 10.0;

/// Values that are fixed while the rig runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Rates.
    pub rates: Rates,
    /// Converter scaling.
    pub scaling: Scaling,
    /// Motor and gear.
    pub drive: Drive<f32>,
    /// Motor encoder.
    pub encoder: Encoder,
    /// Thresholds of the checks.
    pub monitor: MonitorConfig,
    /// Ratings of the rig's parts: no limit may exceed them ([`ratings`]).
    pub ratings: Limits<f32>,
    /// Ticks for measuring the current offset at the start.
    pub calibration_ticks: u32,
    /// Largest plausible current offset, A.
    pub largest_offset: f32,
    /// Silence of the host after which the rig stops, ticks.
    pub host_silent_ticks: u32,
    /// Time from the bridge's enable to active outputs, ticks; no motion is commanded meanwhile.
    pub wake_ticks: u32,
    /// Largest duty at which the current's samples have settled ([`settled_duty`]).
    pub settled_duty: f32,
    /// Further silence after which the bridge is switched off and the fault latches, ticks.
    pub host_lost_ticks: u32,
}

impl Config {
    /// Derives the configuration from the parts, the rates, the limits for which the parts were chosen, and the settling
    /// time of the current amplifier, ns.
    pub fn new(
        rates: Rates,
        drive: Drive<f32>,
        encoder: Encoder,
        limits: &Limits<f32>,
        sense_settling_ns: u32,
    ) -> Self {
        let rate = rates.control_hz;
        let counts_per_radian =
            encoder.counts_per_motor_turn as f32 * drive.gear_ratio.abs() / core::f32::consts::TAU;
        let period = 1.0 / rate as f32;
        Self {
            rates,
            scaling: Scaling::default(),
            drive,
            encoder,
            monitor: MonitorConfig {
                period,
                supply: [18.0, 30.0],
                temperature: 85.0,
                current_margin: 1.5,
                velocity_margin: 1.25,
                position_margin: 0.1,
                // Four times the fastest allowed speed: no motor is faster, so larger steps are a fault.
                largest_step: F32Ext::ceil(4.0 * limits.velocity * counts_per_radian * period)
                    as i32
                    + 4,
                persistence: 3,
                voltage: VoltageModel::new(&drive, encoder.counts_per_motor_turn, period),
                stuck_ticks: rate / 20,
                stuck_duty: 0.02,
                thermal_time: THERMAL_TIME,
                heat_forget: period / THERMAL_TIME,
                late_window: rate / 10,
            },
            ratings: ratings(limits, 1.0 / counts_per_radian),
            calibration_ticks: rate / 2,
            largest_offset: 0.5,
            host_silent_ticks: rate / 2,
            wake_ticks: wake_ticks(rate),
            settled_duty: settled_duty(sense_settling_ns),
            host_lost_ticks: rate,
        }
    }

    /// Returns the lower and upper current codes at which comparators switch the bridge off: the over-current threshold
    /// of the checks at the highest rated limit.
    pub fn current_thresholds(&self) -> [u16; 2] {
        let max_current = self.monitor.current_margin * self.ratings.peak_current;
        let codes = max_current / self.scaling.current_per_code.abs();
        // Casts saturate at 0. A threshold at the converter's own end does not act, and only the checks remain.
        [-codes, codes].map(|codes| ((self.scaling.current_zero + codes) as u16).min(4095))
    }
}

/// Returns the ticks from the enable of the listed bridge to active outputs: at most 1 ms (DRV8874, SLVSF66, t_WAKE),
/// plus one partial tick.
pub const fn wake_ticks(control_hz: u32) -> u32 {
    control_hz.div_ceil(1000) + 1
}

/// Returns the largest duty at which every sample of the current comes at least `settling_ns` after the last edge of the
/// bridge.
///
/// The samples are centred on the middle of a braking interval, so the last edge lies (1 − |duty|)/2 of a pulse before
/// their middle. Both directions count: which of them moves the amplifier's inputs depends on the wire with the shunt.
/// Duty 0 has no edges.
pub fn settled_duty(settling_ns: u32) -> f32 {
    let before = 1e-9 * (settling_ns.saturating_add(SAMPLE_HALF_SPAN_NS)) as f32;
    (1.0 - 2.0 * PWM_HZ as f32 * before).max(0.0)
}

/// Returns the ratings of parts that were chosen for these limits. Currents and torque: 25 % more, because over-current
/// is detected at one and a half times the peak current and the listed bridge bears 6 A. Speed: twice, acceleration:
/// four times, which the encoder checks still follow. Positions: the range in which an `f32` holds every count exactly.
pub fn ratings(limits: &Limits<f32>, radians_per_count: f32) -> Limits<f32> {
    const EXACT_COUNTS: f32 = 16_777_216.0;
    let max_position = EXACT_COUNTS * radians_per_count.abs();
    Limits {
        position_low: -max_position,
        position_high: max_position,
        velocity: 2.0 * limits.velocity,
        acceleration: 4.0 * limits.acceleration,
        torque: 1.25 * limits.torque,
        continuous_current: 1.25 * limits.continuous_current,
        peak_current: 1.25 * limits.peak_current,
    }
}

/// Values that the host may replace while the rig stands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Control law.
    pub control: ControlKind,
    /// Feedback gains.
    pub gains: Gains<f32>,
    /// Model behind the feed-forward.
    pub model: LinkParameters<f32>,
    /// Friction law for the precompensation.
    pub friction: Friction<f32>,
    /// Use of the friction law near zero speed.
    pub precompensation: PrecompensationSettings<f32>,
    /// Effects compensated in addition to the friction law.
    pub effects: Effects<f32>,
    /// Limits.
    pub limits: Limits<f32>,
    /// On-line estimator.
    pub estimator: EstimatorSettings<f32>,
}

#[cfg(test)]
mod tests {
    use super::settled_duty;

    /// A pulse of 50 µs: at the returned duty the braking interval is as long before its middle as the amplifier needs, and
    /// the first sample is held 1.31 µs before the middle.
    #[test]
    fn the_settled_duty_leaves_the_amplifier_its_time() {
        for settling in [0_u32, 2000, 9600, 20_000] {
            let duty = f64::from(settled_duty(settling));
            let braking = (1.0 - duty) * 50e-6;
            let first = 0.5 * braking - 1.31e-6;
            assert!(
                (first - 1e-9 * f64::from(settling)).abs() < 1e-11,
                "{settling}"
            );
        }
        assert!((settled_duty(9600) - 0.5636).abs() < 1e-6);
        // Longer than half a pulse: only a bridge without edges gives settled samples.
        assert!(settled_duty(30_000).abs() < f32::MIN_POSITIVE);
        assert!(settled_duty(u32::MAX).abs() < f32::MIN_POSITIVE);
    }

    #[test]
    fn comparators_act_between_the_checks_and_the_ends_of_the_converter() {
        let (config, settings) = crate::nameplate::one_link();
        let [lower, upper] = config.current_thresholds();
        // 6 A at 8.06 mA a code: the rating of the listed bridge.
        assert_eq!([lower, upper], [1303, 2792]);
        let checked = settings.limits.peak_current * config.monitor.current_margin;
        let of = |code: u16| (f32::from(code) - 2048.0) * config.scaling.current_per_code;
        assert!(of(upper) > checked && of(lower) < -checked);
    }
}
