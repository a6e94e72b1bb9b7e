//! The kinds of effects: the registry of their laws.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::about::{About, Periodic};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::compensation::Role;
use crate::scalar::Real;

macro_rules! registry {
    ($($(#[$meta:meta])* $kind:ident in $module:ident),+ $(,)?) => {
        /// Kind of effect. On the wire it is its index in the registry. The wire's fingerprint holds the names in
        /// order, so that two ends with different registries refuse each other.
        #[derive(
            Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, Schema,
        )]
        pub enum Kind {
            $($(#[$meta])* $kind),+
        }

        impl Kind {
            /// All kinds, in the order of the catalogue.
            pub const ALL: &'static [Self] = &[$(Self::$kind),+];

            /// Returns the description.
            pub const fn about(self) -> &'static About {
                match self {
                    $(Self::$kind => &<super::$module::$kind as Law>::ABOUT),+
                }
            }

            /// Returns the angle of a sinusoidal effect, none for others.
            pub const fn periodic(self) -> Option<Periodic> {
                match self {
                    $(Self::$kind => <super::$module::$kind as Law>::PERIODIC),+
                }
            }

            /// Names of the shapes that a description may leave out; they are then 0.
            pub const fn optional(self) -> &'static [&'static str] {
                match self {
                    $(Self::$kind => <super::$module::$kind as Law>::OPTIONAL),+
                }
            }

            /// Returns the torque per unit of each gain, N·m, and advances the hidden state, 0 at first, by a period.
            #[inline(always)]
            pub fn terms<T: Real>(
                self,
                shapes: &[T; SHAPES],
                memory: &mut [T; MEMORY],
                at: &Instant<T>,
            ) -> [T; GAINS] {
                match self {
                    $(Self::$kind => super::$module::$kind::terms(shapes, memory, at)),+
                }
            }

            pub(super) fn after_pause<T: Real>(self, shapes: &[T; SHAPES], memory: &mut [T; MEMORY], seconds: T) {
                match self {
                    $(Self::$kind => super::$module::$kind::after_pause(shapes, memory, seconds)),+
                }
            }

            /// Returns [`Self::terms`] of the compensated laws that are not periodic, and 0 for all others. A chip
            /// then need not hold the code of the others. Periodic laws are rotated with their angle instead.
            #[inline(always)]
            pub(crate) fn compensated_terms<T: Real>(
                self,
                shapes: &[T; SHAPES],
                memory: &mut [T; MEMORY],
                at: &Instant<T>,
            ) -> [T; GAINS] {
                match self {
                    $(Self::$kind => {
                        if const {
                            Role::from_about(&<super::$module::$kind as Law>::ABOUT).is_some()
                                && <super::$module::$kind as Law>::PERIODIC.is_none()
                        } {
                            super::$module::$kind::terms(shapes, memory, at)
                        } else {
                            [T::ZERO; GAINS]
                        }
                    }),+
                }
            }
        }
    };
}

registry! {
    /// Friction that falls as the joint starts to slide.
    Stribeck in stribeck,
    /// The same with a longer tail.
    StribeckExponential in stribeck_exponential,
    /// Friction that differs with the direction.
    AsymmetricCoulomb in asymmetric_coulomb,
    /// Drag of air and churning grease.
    QuadraticDrag in quadratic_drag,
    /// Friction of teeth and bearings that grows with the load.
    LoadFriction in load_friction,
    /// Friction that varies with the position: tight spots.
    PositionFriction in position_friction,
    /// Presliding friction (memory of distance), Dahl's law.
    PreslidingDahl in presliding_dahl,
    /// Presliding friction with memory of distance and speed, LuGre law (Canudas de Wit).
    PreslidingLugre in presliding_lugre,
    /// Presliding friction: elements that slip one after the other.
    PreslidingMaxwell in presliding_maxwell,
    /// Viscous friction that falls with running time.
    ViscousWarmupTime in viscous_warmup_time,
    /// Viscous friction that falls with a measured temperature.
    ViscousWarmupTemperature in viscous_warmup_temperature,
    /// Viscous friction that falls as friction heats the joint.
    ViscousWarmupHeat in viscous_warmup_heat,
    /// Detent torque of the motor's magnets.
    Cogging in cogging,
    /// A torque constant that varies with the motor's angle.
    TorqueRipple in torque_ripple,
    /// Torque of teeth whose lever arm varies over a turn.
    GearEccentricity in gear_eccentricity,
    /// Backlash of a gear.
    Backlash in backlash,
    /// A shaft or gear that twists under load.
    JointElasticity in joint_elasticity,
    /// A code disc or magnet off the motor's axis.
    EncoderEccentricityMotor in encoder_eccentricity_motor,
    /// A code disc or magnet off the joint's axis.
    EncoderEccentricityJoint in encoder_eccentricity_joint,
    /// Reading of the current sensor at zero current.
    CurrentOffset in current_offset,
    /// A torque constant that falls at high current.
    TorqueSaturation in torque_saturation,
    /// A torque or current reading that is delayed against the position.
    MeasurementDelay in measurement_delay,
    /// A direction of gravity that differs from the description.
    GravityTilt in gravity_tilt,
    /// A mass on the link.
    Payload in payload,
    /// A cable or hose that pulls the joint back.
    Spring in spring,
    /// Voltage loss of half-bridges.
    DriveDeadzone in drive_deadzone,
    /// Terms of another joint's motion.
    InertiaCoupling in inertia_coupling,
    /// A constant torque.
    TorqueOffset in torque_offset,
}

impl Kind {
    /// Returns true for pulls on a joint from outside the robot (cables, hoses, springs), which can be taken off.
    pub const fn is_external(self) -> bool {
        matches!(self, Self::TorqueOffset | Self::Spring)
    }

    /// Returns the number of gains; they come first among the parameters.
    pub fn gains(self) -> usize {
        self.about().gains.len()
    }

    /// Returns gap, stiffness and damping of a transmission with these shapes, as
    /// [`transmission_torque`](super::transmission_torque) takes them. None for an effect that does not act between
    /// motor and link.
    pub fn transmission<T: Real>(self, shapes: &[T; SHAPES]) -> Option<[T; 3]> {
        match self {
            Self::Backlash => Some([shapes[0], shapes[1], shapes[2]]),
            Self::JointElasticity => Some([T::ZERO, shapes[0], shapes[1]]),
            _ => None,
        }
    }

    /// Returns the share of the joint's friction behind a transmission with these shapes. None for an effect that
    /// does not act between motor and link.
    pub fn link_friction<T: Real>(self, shapes: &[T; SHAPES]) -> Option<T> {
        match self {
            Self::Backlash => Some(shapes[3]),
            Self::JointElasticity => Some(shapes[2]),
            _ => None,
        }
    }

    /// Returns true if it reduces viscous friction as the joint warms.
    pub const fn is_viscous_warmup(self) -> bool {
        matches!(
            self,
            Self::ViscousWarmupTime | Self::ViscousWarmupTemperature | Self::ViscousWarmupHeat
        )
    }

    /// Returns true if its law depends on the joint's own friction: by heat, or by the torque that the gear transmits.
    pub const fn depends_on_joint_friction(self) -> bool {
        matches!(self, Self::LoadFriction | Self::ViscousWarmupHeat)
    }

    /// Returns true if its torque acts on the link: the gear transmits it, load friction grows with it, a shaft twists.
    pub const fn acts_on_link(self) -> bool {
        matches!(
            self,
            Self::Spring | Self::GravityTilt | Self::InertiaCoupling | Self::TorqueOffset
        )
    }

    /// Returns the kind with this name and law, as a description writes them.
    pub fn from_name(name: &str, law: Option<&str>) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| {
            let about = kind.about();
            about.name == name && (law.is_none() || about.law == law)
        })
    }
}
