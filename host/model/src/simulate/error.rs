//! Reasons why a motion could not be simulated.

use rig_output::{format_short, format_significant};
use rig_shared::multibody::{ChainError, MultibodyError};
use rig_shared::transmission::TransmissionError;
use thiserror::Error;

/// Why a motion could not be simulated.
#[derive(Debug, Error)]
pub enum SimulateError {
    /// Friction that feeds energy in.
    #[error(
        "{parameter} is {value}: friction below zero would drive the joint; give 0 or more, or identify it anew."
    )]
    NegativeFriction {
        /// Name with the joint's number.
        parameter: String,
        /// The value at fault.
        value: f64,
    },
    /// A link without inertia.
    #[error(
        "the inertia that joint {joint} has to move is not positive: give its link a mass and an inertia about its axis, or its drive a rotor inertia. Where joint_elasticity or backlash parts the drive from the link, the link needs its own."
    )]
    NotPositiveDefinite {
        /// From 1 at the base.
        joint: usize,
    },
    /// A joint has no inertia to move.
    #[error(
        "joint \"{joint}\" has no inertia to move, so it cannot be simulated: neither its link nor what follows has any about its axis, nor has its drive. Give the link mass and inertia, or the drive a rotor_inertia; `rig identify` writes a description that can."
    )]
    NoInertia {
        /// The joint's name.
        joint: String,
    },
    /// The motion left the range of finite numbers.
    #[error(
        "the simulated motion of joint \"{joint}\" grew beyond all bounds after {time:.3} s: the controller's gains do not fit the model."
    )]
    Diverged {
        /// The joint's name.
        joint: String,
        /// When, s.
        time: f64,
    },
    /// The chain cannot be built.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// Friction of coupled drives that feeds energy in.
    #[error(
        "the viscous friction of the coupled drives (fvm with fv of the joints they move) would drive some motion: its least damping is {least} N·m·s/rad; give the motors or the joints more, or identify them anew."
    )]
    DrivingFriction {
        /// Least eigenvalue of the damping matrix.
        least: f64,
    },
    /// Friction that would drive a joint because of effects.
    #[error(
        "the friction of joint {joint} with the description's effects would drive it at {velocity} (rad/s or m/s): it lies between {low} and {high} N·m (N), which must hold 0; give the joint more Coulomb friction, or the effects less."
    )]
    DrivingEffects {
        /// From 1 at the base.
        joint: usize,
        /// rad/s or m/s
        velocity: f64,
        /// Friction for motion backwards.
        low: f64,
        /// Friction for motion forwards.
        high: f64,
    },
    /// Viscous friction that warming made negative.
    #[error(
        "after {time:.3} s of motion joint {joint} has warmed so far that its viscous friction is {left} N·m·s/rad (N·s/m), and would drive it: the description gives it {viscous} cold; give viscous_warmup a smaller drop, or [joint.friction] viscous more."
    )]
    WarmedAway {
        /// From 1 at the base.
        joint: usize,
        /// When, s.
        time: f64,
        /// Viscous friction cold, N·m·s/rad or N·s/m.
        viscous: f64,
        /// Viscous friction at that time, N·m·s/rad or N·s/m.
        left: f64,
    },
    /// Backlash or elasticity without a second mass.
    #[error(
        "{effect} needs a motor with inertia on the other side of the gear, and the description has none; give rotor_inertia in [joint.drive]."
    )]
    NoRotor {
        /// The effect and its joint.
        effect: String,
    },
    /// A gear that would need steps without end.
    #[error(transparent)]
    TooStiff(Box<TooStiff>),
    /// Friction of a coupled drive on the link's side.
    #[error(
        "{effect}: link_friction is {share}, but the friction of a coupled drive or screw holds that of its motor, which stays on the motor's side; give link_friction = 0."
    )]
    LinkFriction {
        /// The effect and its joint.
        effect: String,
        /// The value at fault.
        share: f64,
    },
    /// The drives are invalid.
    #[error(transparent)]
    Drives(#[from] TransmissionError),
    /// Wrong lengths, or an inertia matrix that is not positive definite.
    #[error(transparent)]
    Multibody(#[from] MultibodyError),
}

/// A gear whose motion is faster than the simulation resolves.
#[derive(Debug, Error)]
#[error(
    "{effect} swings at {} Hz, and the simulation resolves {} Hz at most: {}. Give {key}, or a smaller {by} (SI units).",
    format_significant(*frequency, 3),
    format_short(*highest),
    light.said(*inertia),
    key = light.key()
)]
pub struct TooStiff {
    /// The effect and its joint.
    pub effect: String,
    /// Rate of spring and damping over 2π, Hz.
    pub frequency: f64,
    /// Highest frequency that is integrated, Hz.
    pub highest: f64,
    /// Key of the effect that contributes most.
    pub by: &'static str,
    /// The lighter side of the gear.
    pub light: Light,
    /// Its inertia in the coordinate of the stiffness, kg·m² or kg.
    pub inertia: f64,
}

/// A side of a gear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// The motor's.
    Rotor,
    /// The link's.
    Link,
}

impl Light {
    fn said(self, inertia: f64) -> String {
        let inertia = format_significant(inertia, 3);
        match self {
            Self::Rotor => format!("its rotor has {inertia} kg·m² (kg) behind the gear"),
            Self::Link => format!("its link has {inertia} kg·m² (kg)"),
        }
    }

    fn key(self) -> &'static str {
        match self {
            Self::Rotor => "a larger rotor_inertia in [joint.drive]",
            Self::Link => "the link a larger mass and inertia in [joint.inertial]",
        }
    }
}
