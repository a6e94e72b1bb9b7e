//! Settings of a closed loop.

use super::error::{ControlError, within};
use rig_shared::precompensation::PrecompensationSettings;

/// A control law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LawKind {
    /// Independent PID of the motors, with gravity and friction compensation.
    Pid,
    /// Computed torque.
    ComputedTorque,
    /// Slotine and Li's adaptive law, in base parameters.
    Adaptive,
    /// Force along the normal of a surface, motion along the surface.
    Hybrid,
    /// The tool as mass, spring and damper.
    Impedance,
}

impl LawKind {
    /// Returns the name for files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pid => "pid",
            Self::ComputedTorque => "computed-torque",
            Self::Adaptive => "adaptive",
            Self::Hybrid => "hybrid",
            Self::Impedance => "impedance",
        }
    }

    /// Returns true if the law presses the tool on a surface.
    pub fn is_contact(self) -> bool {
        matches!(self, Self::Hybrid | Self::Impedance)
    }
}

/// Settings of the loop.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Settings {
    /// Undamped natural frequency of the position loops, Hz.
    pub bandwidth: f64,
    /// Their damping ratio.
    pub damping: f64,
    /// Control ticks in a second, Hz. The torque is held in between.
    pub rate: f64,
    /// True if a torque acts one tick after its measurement, as it does where computing takes most of a tick.
    pub delay: bool,
    /// Encoder step of joints without a described encoder, rad or m at the joint; 0 for exact positions and velocities.
    pub resolution: f64,
    /// Share of dry friction that is compensated while sliding.
    pub friction_gain: f64,
    /// Share near rest.
    pub friction_gain_at_rest: f64,
    /// Measured speed below which the reference decides the direction of friction, rad/s or m/s.
    pub velocity_threshold: f64,
    /// Standard deviation of the measured force along each axis, N.
    pub force_noise: f64,
    /// Seed of the noise and of the wrong parameters.
    pub seed: u64,
}

impl Default for Settings {
    /// Friction settings are those of the firmware's nameplate.
    fn default() -> Self {
        Self {
            bandwidth: 5.0,
            damping: 1.0,
            rate: 1000.0,
            delay: true,
            resolution: 1e-5,
            friction_gain: 0.95,
            friction_gain_at_rest: 0.8,
            velocity_threshold: 0.01,
            force_noise: 0.0,
            seed: 1,
        }
    }
}

impl Settings {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`ControlError::Setting`].
    pub fn check(&self) -> Result<(), ControlError> {
        within(
            "rate",
            self.rate,
            50.0..=1e5,
            "it must be between 50 and 100000 Hz",
        )?;
        within(
            "bandwidth",
            self.bandwidth,
            0.05..=0.1 * self.rate,
            "it must be between 0.05 Hz and a tenth of the rate",
        )?;
        within(
            "damping",
            self.damping,
            0.1..=5.0,
            "it must be between 0.1 and 5",
        )?;
        within(
            "resolution",
            self.resolution,
            0.0..=0.01,
            "it must be between 0 and 0.01 rad or m",
        )?;
        within(
            "friction gain",
            self.friction_gain,
            0.0..=1.0,
            "it must be between 0 and 1",
        )?;
        within(
            "force noise",
            self.force_noise,
            0.0..=1e3,
            "it must be between 0 and 1000 N",
        )
    }

    /// ω, rad/s.
    pub(crate) fn omega(&self) -> f64 {
        core::f64::consts::TAU * self.bandwidth
    }

    /// Time between two ticks, s.
    pub(crate) fn period(&self) -> f64 {
        1.0 / self.rate
    }

    /// Returns the mean time from a measurement until its torque acts, s: the computing time, and half of the tick in which
    /// the torque is held.
    pub(crate) fn lateness(&self) -> f64 {
        (if self.delay { 1.5 } else { 0.5 }) * self.period()
    }

    pub(crate) fn friction(&self) -> PrecompensationSettings<f64> {
        PrecompensationSettings {
            enabled: self.friction_gain > 0.0,
            gain: self.friction_gain,
            gain_at_rest: self.friction_gain_at_rest.min(self.friction_gain),
            velocity_threshold: self.velocity_threshold,
        }
    }
}
