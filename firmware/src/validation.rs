//! Checks that values are physical and within the ratings of the rig's parts; written so that NaN is refused.

use core::fmt;

use rig_shared::compensation::Compensation;
use rig_shared::control::Gains;
use rig_shared::estimation::EstimatorSettings;
use rig_shared::friction::Friction;
use rig_shared::link::LinkParameters;
use rig_shared::precompensation::PrecompensationSettings;
use rig_shared::safety::Limits;
use rig_shared::wire::message::{Bounded, Refusal};

use crate::bound::{at_least, at_most, positive};
use crate::config::{Config, Settings};

/// Slowest current loop, as a share of the control rate. Its lag must fit the remembered ticks of the effects
/// ([`HISTORY_TICKS`](rig_shared::compensation::HISTORY_TICKS)). At 10 kHz 39 Hz, enough for a position loop of 4 Hz
/// ([`Gains::design`]).
const MIN_CURRENT_BANDWIDTH: f32 = 1.0 / 256.0;
/// Fastest current loop, as a share of the control rate. At a tenth the loop's delay of a tick gives a damping ratio of
/// 0.45, and less above it (the poles of z² − z + 1 − exp(−2π·share)).
const MAX_CURRENT_BANDWIDTH: f32 = 0.1;
/// Largest share of the velocity that an eccentric encoder may cause; above it a correction could change its sign.
const MAX_VELOCITY_SLOPE: f32 = 0.5;
/// Largest voltage loss of a bridge as a share of the lowest supply: the check of the encoder cannot see a voltage that
/// counts as lost.
const MAX_VOLTAGE_LOSS: f32 = 0.125;

/// Largest bandwidth of the position and velocity loops as a share of the current loop's: there the current's lag takes 14°
/// of phase (the arc tangent of a quarter).
const MAX_LOOP_SHARE: f32 = 0.25;
/// Smallest acceleration, rad/s², and speed, rad/s, that the torque rating must give an inertia and a viscous friction. A
/// slower rig moves in no experiment of this project.
const MIN_ACCELERATION: f32 = 1.0;
const MIN_SPEED: f32 = 1.0;
/// Highest speed at which the rig may be armed, rad/s: ten times the velocity observer's ripple at rest, and a hold catches
/// the link within 0.01 rad.
pub const MAX_ARM_VELOCITY: f32 = 0.2;

/// Returns true if all settings that the host may replace are valid.
pub(crate) fn settings(config: &Config, settings: &Settings) -> bool {
    limits(config, &settings.limits).is_ok()
        && gains(config, &settings.gains).is_ok()
        && friction(config, &settings.friction).is_ok()
        && model(config, &settings.model).is_ok()
        && loops(&settings.gains, &settings.model).is_ok()
        && precompensation(&settings.precompensation).is_ok()
        && estimator(config, &settings.estimator).is_ok()
        && Compensation::new(&settings.effects)
            .is_ok_and(|compensation| effects(config, &compensation).is_ok())
}

/// Checks limits against the ratings of the rig. Not inlined, like the checks below: each is called from two places.
#[inline(never)]
pub(crate) fn limits(config: &Config, limits: &Limits<f32>) -> Result<(), Refusal> {
    let ratings = &config.ratings;
    for (quantity, value, rating) in [
        (Bounded::SpeedLimit, limits.velocity, ratings.velocity),
        (
            Bounded::AccelerationLimit,
            limits.acceleration,
            ratings.acceleration,
        ),
        (Bounded::TorqueLimit, limits.torque, ratings.torque),
        (
            Bounded::ContinuousCurrent,
            limits.continuous_current,
            ratings.continuous_current,
        ),
        (
            Bounded::PeakCurrent,
            limits.peak_current,
            ratings.peak_current,
        ),
    ] {
        positive(quantity, value)?;
        at_most(quantity, value, rating)?;
    }
    let (low, high) = (limits.position_low, limits.position_high);
    at_least(Bounded::PositionLimit, low, ratings.position_low)?;
    at_most(Bounded::PositionLimit, high, ratings.position_high)?;
    positive(Bounded::PositionRange, high - low)?;
    // A continuous current above the peak.
    at_least(
        Bounded::PeakCurrent,
        limits.peak_current,
        limits.continuous_current,
    )
}

/// Checks gains for themselves; [`loops`] checks them with a model.
#[inline(never)]
pub(crate) fn gains(config: &Config, gains: &Gains<f32>) -> Result<(), Refusal> {
    at_least(Bounded::ProportionalGain, gains.proportional, 0.0)?;
    positive(Bounded::DerivativeGain, gains.derivative)?;
    at_least(Bounded::AdaptationGain, gains.adaptation, 0.0)?;
    let (quantity, bandwidth) = (Bounded::CurrentLoop, gains.current_bandwidth);
    let rate = config.rates.control_hz as f32;
    at_least(quantity, bandwidth, MIN_CURRENT_BANDWIDTH * rate)?;
    at_most(quantity, bandwidth, MAX_CURRENT_BANDWIDTH * rate)?;
    if gains.is_valid() {
        Ok(())
    } else {
        Err(Refusal::BadValue)
    }
}

/// Checks a model against the ratings of the rig.
#[inline(never)]
pub(crate) fn model(config: &Config, model: &LinkParameters<f32>) -> Result<(), Refusal> {
    if !model.to_array().iter().all(|value| value.is_finite()) {
        return Err(Refusal::BadValue);
    }
    let torque = config.ratings.torque;
    positive(Bounded::Inertia, model.inertia)?;
    at_most(Bounded::Inertia, model.inertia, torque / MIN_ACCELERATION)?;
    // Each alone first, so that the squares are finite.
    let (cos, sin) = (model.gravity_cos, model.gravity_sin);
    at_most(Bounded::Gravity, cos.abs().max(sin.abs()), torque)?;
    at_most(Bounded::Gravity, libm::sqrtf(cos * cos + sin * sin), torque)?;
    at_least(Bounded::ViscousFriction, model.viscous, 0.0)?;
    at_most(Bounded::ViscousFriction, model.viscous, torque / MIN_SPEED)?;
    at_least(Bounded::DryFriction, model.coulomb, 0.0)?;
    at_most(Bounded::DryFriction, model.coulomb, torque)?;
    at_most(Bounded::Offset, model.offset.abs(), torque)
}

/// Checks a friction law against the ratings of the rig.
#[inline(never)]
pub(crate) fn friction(config: &Config, friction: &Friction<f32>) -> Result<(), Refusal> {
    let Friction {
        coulomb,
        viscous,
        breakaway_excess,
        load_coefficient,
        ..
    } = *friction;
    let torque = config.ratings.torque;
    at_least(Bounded::DryFriction, coulomb, 0.0)?;
    at_least(Bounded::DryFriction, breakaway_excess, 0.0)?;
    at_least(Bounded::LoadFriction, load_coefficient, 0.0)?;
    let dry = coulomb + breakaway_excess + load_coefficient * torque;
    at_most(Bounded::DryFriction, dry, torque)?;
    at_least(Bounded::ViscousFriction, viscous, 0.0)?;
    at_most(Bounded::ViscousFriction, viscous, torque / MIN_SPEED)?;
    let (of_dry, of_viscous) = (friction.coulomb_asymmetry, friction.viscous_asymmetry);
    at_most(Bounded::DryAsymmetry, of_dry.abs(), coulomb)?;
    at_most(Bounded::ViscousAsymmetry, of_viscous.abs(), viscous)?;
    at_least(Bounded::StribeckVelocity, friction.stribeck_velocity, 0.0)?;
    if breakaway_excess > 0.0 {
        positive(Bounded::StribeckVelocity, friction.stribeck_velocity)?;
    }
    friction.check().map_err(|_| Refusal::BadValue)
}

/// Checks that gains leave the current loop room, for the inertia of the model.
#[inline(never)]
pub(crate) fn loops(gains: &Gains<f32>, model: &LinkParameters<f32>) -> Result<(), Refusal> {
    let bound = MAX_LOOP_SHARE * core::f32::consts::TAU * gains.current_bandwidth;
    let natural = libm::sqrtf(gains.proportional / model.inertia);
    at_most(Bounded::PositionLoop, natural, bound)?;
    at_most(
        Bounded::VelocityLoop,
        gains.derivative / model.inertia,
        bound,
    )
}

/// Checks that a link may be armed where it is and at its speed, rad and rad/s.
pub(crate) fn arming(limits: &Limits<f32>, position: f32, velocity: f32) -> Result<(), Refusal> {
    at_most(Bounded::ArmPosition, position, limits.position_high)?;
    at_least(Bounded::ArmPosition, position, limits.position_low)?;
    at_most(Bounded::ArmVelocity, velocity.abs(), MAX_ARM_VELOCITY)
}

/// Checks the settings of the precompensation.
#[inline(never)]
pub(crate) fn precompensation(settings: &PrecompensationSettings<f32>) -> Result<(), Refusal> {
    // The adaptive law smooths its sign with it, with or without friction precompensation.
    positive(Bounded::VelocityThreshold, settings.velocity_threshold)?;
    if settings.enabled {
        let (gain, at_rest) = (settings.gain, settings.gain_at_rest);
        at_least(Bounded::FrictionShare, gain, 0.0)?;
        at_most(Bounded::FrictionShare, gain, 1.0)?;
        at_least(Bounded::FrictionShareAtRest, at_rest, 0.0)?;
        at_most(Bounded::FrictionShareAtRest, at_rest, gain)?;
        if at_rest >= 1.0 {
            return Err(Refusal::OutOfBounds {
                quantity: Bounded::FrictionShareAtRest,
                value: at_rest,
                bound: 1.0,
            });
        }
    }
    settings.check().map_err(|_| Refusal::BadValue)
}

/// Checks the settings of the on-line estimator.
#[inline(never)]
pub(crate) fn estimator(config: &Config, settings: &EstimatorSettings<f32>) -> Result<(), Refusal> {
    let rate = config.rates.estimator_hz();
    positive(Bounded::EstimatorMemory, settings.memory)?;
    positive(Bounded::EstimatorBandwidth, settings.bandwidth)?;
    at_most(Bounded::EstimatorBandwidth, settings.bandwidth, 0.1 * rate)?;
    at_least(Bounded::SlipVelocity, settings.slip_velocity, 0.0)?;
    for (low, high) in settings.lower.iter().zip(&settings.upper) {
        positive(Bounded::EstimatorBand, high - low)?;
    }
    settings.check(rate).map_err(|_| Refusal::BadValue)
}

/// A correction beyond the possible error of a sensor or bridge: it would hide a fault, or reverse a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CorrectionTooLarge {
    /// The current's constant error, A.
    CurrentOffset {
        /// Value of the effects.
        value: f32,
        /// Largest allowed value.
        limit: f32,
    },
    /// The voltage loss of the bridge, V.
    DriveDeadzone {
        /// Value of the effects.
        value: f32,
        /// Largest allowed value.
        limit: f32,
    },
    /// Velocity caused by the encoder's error, as a share of the velocity.
    EncoderEccentricity {
        /// Value of the effects.
        value: f32,
        /// Largest allowed value.
        limit: f32,
    },
}

impl fmt::Display for CorrectionTooLarge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::CurrentOffset { value, limit } => write!(
                f,
                "current_offset makes {value} A of the reading its error, and the rig takes {limit} A at most: mend the sensor"
            ),
            Self::DriveDeadzone { value, limit } => write!(
                f,
                "drive_deadzone says that the bridge loses {value} V, and the rig takes {limit} V at most: an eighth of the least supply"
            ),
            Self::EncoderEccentricity { value, limit } => write!(
                f,
                "encoder_eccentricity makes up {value} of the velocity, and the rig takes {limit} at most: beyond it the correction could turn the velocity's sense round"
            ),
        }
    }
}

impl core::error::Error for CorrectionTooLarge {}

impl From<CorrectionTooLarge> for Refusal {
    fn from(correction: CorrectionTooLarge) -> Self {
        let (quantity, value, bound) = match correction {
            CorrectionTooLarge::CurrentOffset { value, limit } => {
                (Bounded::CurrentCorrection, value, limit)
            }
            CorrectionTooLarge::DriveDeadzone { value, limit } => {
                (Bounded::VoltageCorrection, value, limit)
            }
            CorrectionTooLarge::EncoderEccentricity { value, limit } => {
                (Bounded::EncoderCorrection, value, limit)
            }
        };
        Self::OutOfBounds {
            quantity,
            value,
            bound,
        }
    }
}

/// Checks that corrections of measured values stay within the possible errors of sensors and bridge.
///
/// # Errors
/// The first correction that does not.
pub fn effects(config: &Config, effects: &Compensation<f32>) -> Result<(), CorrectionTooLarge> {
    // False for NaN too.
    let is_within = |value: f32, limit: f32| value <= limit;
    let value = effects.current_error(config.drive.joint_torque(1.0)).abs();
    let limit = config.largest_offset;
    if !is_within(value, limit) {
        return Err(CorrectionTooLarge::CurrentOffset { value, limit });
    }
    let (value, limit) = (
        effects.lost_voltage(),
        MAX_VOLTAGE_LOSS * config.monitor.supply[0],
    );
    if !is_within(value, limit) {
        return Err(CorrectionTooLarge::DriveDeadzone { value, limit });
    }
    let (value, limit) = (
        effects.position_slope(config.drive.gear_ratio),
        MAX_VELOCITY_SLOPE,
    );
    if !is_within(value, limit) {
        return Err(CorrectionTooLarge::EncoderEccentricity { value, limit });
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::nameplate::one_link;
    use rig_shared::compensation::{Effects, HISTORY_TICKS};
    use rig_shared::effects::{Effect, Kind};

    #[test]
    fn the_nameplate_s_own_settings_are_usable() {
        let (config, own) = one_link();
        assert!(settings(&config, &own));
    }

    /// What a rig cannot be is refused with the value and its bound: loops faster than the current's, torques beyond the
    /// rating of 10 N·m.
    #[test]
    fn absurd_gains_and_models_are_refused_with_their_bounds() {
        let (config, own) = one_link();
        let bound_of = |refused: Result<(), Refusal>| match refused {
            Err(Refusal::OutOfBounds {
                quantity,
                value,
                bound,
            }) if !(value <= bound) => Some((quantity, bound)),
            _ => None,
        };
        let quarter = 0.25 * core::f32::consts::TAU * 500.0;
        for (proportional, derivative, expected) in [
            (1e9, 1e-6, Some((Bounded::PositionLoop, quarter))),
            (241.6, 1e4, Some((Bounded::VelocityLoop, quarter))),
            (241.6, 12.8, None),
        ] {
            let gains = Gains {
                proportional,
                derivative,
                ..own.gains
            };
            assert_eq!(bound_of(loops(&gains, &own.model)), expected);
        }
        let mut heavy = own.model;
        heavy.gravity_cos = 1e20;
        let gravity = Some((Bounded::Gravity, config.ratings.torque));
        assert_eq!(bound_of(model(&config, &heavy)), gravity);
        let mut stiff = own.friction;
        stiff.coulomb = 1e20;
        let dry = Some((Bounded::DryFriction, config.ratings.torque));
        assert_eq!(bound_of(friction(&config, &stiff)), dry);
        let mut broken = own.model;
        broken.inertia = f32::NAN;
        assert_eq!(model(&config, &broken), Err(Refusal::BadValue));
    }

    /// Each limit that is beyond its rating, 0 or in contradiction to another one is refused with value and bound.
    #[test]
    fn limits_are_refused_with_value_and_bound() {
        let (config, own) = one_link();
        let ratings = config.ratings;
        let refused = |change: fn(&mut Limits<f32>)| {
            let mut changed = own.limits;
            change(&mut changed);
            limits(&config, &changed).unwrap_err()
        };
        let expected = |quantity, value, bound| Refusal::OutOfBounds {
            quantity,
            value,
            bound,
        };
        assert_eq!(
            refused(|limits| limits.peak_current = 1e8),
            expected(Bounded::PeakCurrent, 1e8, ratings.peak_current)
        );
        assert_eq!(
            refused(|limits| limits.velocity = 0.0),
            expected(Bounded::SpeedLimit, 0.0, 0.0)
        );
        assert_eq!(
            refused(|limits| limits.torque = 10.5),
            expected(Bounded::TorqueLimit, 10.5, ratings.torque)
        );
        assert_eq!(
            refused(|limits| limits.acceleration = -1.0),
            expected(Bounded::AccelerationLimit, -1.0, 0.0)
        );
        assert_eq!(
            refused(|limits| limits.peak_current = 1.0),
            expected(Bounded::PeakCurrent, 1.0, own.limits.continuous_current)
        );
        assert_eq!(
            refused(|limits| limits.position_low = 4.0),
            expected(Bounded::PositionRange, own.limits.position_high - 4.0, 0.0)
        );
        assert_eq!(
            refused(|limits| limits.position_high = 1e4),
            expected(Bounded::PositionLimit, 1e4, ratings.position_high)
        );
        assert_eq!(
            refused(|limits| limits.torque = f32::NAN),
            Refusal::BadValue
        );
        assert_eq!(limits(&config, &ratings), Ok(()));
    }

    fn is_allowed(effect: Effect<f32>) -> bool {
        let mut all = Effects::default();
        all[0] = Some(effect);
        effects(&one_link().0, &Compensation::new(&all).unwrap()).is_ok()
    }

    #[test]
    fn corrections_beyond_what_a_sensor_can_be_wrong_by_are_refused() {
        // As a torque: 2.5 N·m/A.
        let offset = |torque| is_allowed(Effect::new(Kind::CurrentOffset, &[torque], &[]));
        assert!(offset(1.24) && offset(-1.24) && !offset(1.26) && !offset(-8.0));
        let loss = |volts| is_allowed(Effect::new(Kind::DriveDeadzone, &[volts], &[]));
        assert!(loss(2.0) && !loss(3.0) && !loss(24.0));
        // 0.5 rad of the position with one period per motor turn: order · 50 · amplitude is the share of the velocity.
        let of_motor = |order: f32, amplitude: f32| {
            let gains = [0.6 * amplitude, 0.8 * amplitude];
            is_allowed(Effect::new(
                Kind::EncoderEccentricityMotor,
                &gains,
                &[order],
            ))
        };
        assert!(of_motor(1.0, 0.0099) && !of_motor(1.0, 0.0101) && !of_motor(12.0, 0.02));
        let of_joint = |order| {
            let gains = [0.02, 0.0];
            is_allowed(Effect::new(
                Kind::EncoderEccentricityJoint,
                &gains,
                &[order],
            ))
        };
        assert!(of_joint(1.0) && of_joint(24.0) && !of_joint(26.0));
    }

    /// Every allowed bandwidth has a lag within the remembered ticks, and finite gains.
    #[test]
    fn current_loops_are_neither_too_slow_nor_too_fast() {
        let (config, mut settings) = one_link();
        for (hertz, valid) in [
            (1e-45_f32, false),
            (0.0, false),
            (39.0, false),
            (39.1, true),
            (500.0, true),
            (1000.0, true),
            (1010.0, false),
            (f32::INFINITY, false),
            (f32::NAN, false),
        ] {
            settings.gains.current_bandwidth = hertz;
            assert_eq!(gains(&config, &settings.gains).is_ok(), valid, "{hertz} Hz");
            if valid {
                let derived = crate::derived::Derived::new(&config, &settings);
                let (ticks, share) = derived.lag;
                assert!(usize::from(ticks) < HISTORY_TICKS - 1, "{ticks} ticks");
                assert!((0.0..1.0).contains(&share));
            }
        }
    }
}
