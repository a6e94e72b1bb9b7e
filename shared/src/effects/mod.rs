//! Effects beyond the standard model, one file each. Simulator, identifier, diagnosis and the firmware's
//! precompensation use the same laws.
//!
//! An effect adds a torque to the drive's torque: τ = Y·π + Σ βₖ·hₖ(η; motion). The βₖ (*gains*) enter linearly, the
//! η (*shapes*) do not; the motion drives the hidden states. A few effects act elsewhere ([`Channel`]): on a sensor
//! reading, between motor and link, or between command and voltage.
//!
//! To add an effect, add its file and one line to the `registry!` below.

mod about;
mod asymmetric_coulomb;
mod backlash;
mod cogging;
mod contact;
mod current_offset;
mod drive_deadzone;
mod encoder_eccentricity_joint;
mod encoder_eccentricity_motor;
mod gear_eccentricity;
mod gravity_tilt;
mod inertia_coupling;
mod joint_elasticity;
mod load_friction;
mod measurement_delay;
mod payload;
mod position_friction;
mod presliding_dahl;
mod presliding_lugre;
mod presliding_maxwell;
mod quadratic_drag;
mod spring;
mod stribeck;
mod stribeck_exponential;
#[cfg(test)]
mod tests;
mod torque_offset;
mod torque_ripple;
mod torque_saturation;
mod viscous_warmup_heat;
mod viscous_warmup_temperature;
mod viscous_warmup_time;

pub use about::{About, Channel, Confusion, Direction, Need, Parameter, Periodic, Scale};
pub use backlash::transmitted;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::compensation::Role;
use crate::scalar::Real;

/// Maximum number of gains of an effect.
pub const GAINS: usize = 4;
/// Maximum number of shapes of an effect.
pub const SHAPES: usize = 4;
/// Maximum number of hidden states of an effect.
pub const MEMORY: usize = 4;

/// Inputs of an effect at one instant. Joint-side, SI.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Instant<T> {
    /// rad or m
    pub position: T,
    /// rad/s or m/s
    pub velocity: T,
    /// rad/s² or m/s²
    pub acceleration: T,
    /// Direction of motion, −1 to 1. Not derived from the velocity: near rest the caller decides it.
    pub direction: T,
    /// Angle of the motor, rad.
    pub motor_angle: T,
    /// Torque of the motor by its current and nominal constant, times the ratio, N·m.
    pub drive_torque: T,
    /// Change of the drive torque, N·m/s.
    pub drive_rate: T,
    /// Torque that the gear transmits to the link, without friction and the drive's own inertia, N·m.
    pub load: T,
    /// Dry and viscous friction of the joint by its model without effects, against positive motion, N·m.
    pub friction: T,
    /// Torque of gravity per kg·m of first moment along x of the link's frame, m/s².
    pub gravity: T,
    /// Running time, s.
    pub time: T,
    /// Temperature above that at the start, K; 0 where it is not measured.
    pub warming: T,
    /// Position, velocity and acceleration of the other joint that the effect names; 0 where it names none.
    pub other: [T; 3],
    /// Time since the last instant, s.
    pub period: T,
    /// Ratio of other effects' friction that acts through the joint's contact to the model's friction, 1. The contact
    /// bends farther by this ratio before it slides.
    pub beside: T,
}

impl<T: Real> Instant<T> {
    /// Returns the travel of the contact since the last instant, rad.
    #[inline(always)]
    fn way(&self) -> T {
        self.velocity * self.period
    }

    /// Returns the ratio of all friction that acts through the joint's contact to the model's friction, 1.
    #[inline(always)]
    fn whole(&self) -> T {
        // Fits and precompensation may give a slightly negative friction.
        (T::ONE + self.beside).max(T::from_f64(LEAST_FRICTION))
    }
}

/// Smallest share of a contact's own friction that remains when effects reduce it, 1.
const LEAST_FRICTION: f64 = 0.1;

/// Returns cosine and sine of order times angle, as terms for [`Law::terms`].
#[inline(always)]
fn wave<T: Real>(order: T, angle: T) -> [T; GAINS] {
    let (sine, cosine) = (order * angle).sin_cos();
    [cosine, sine, T::ZERO, T::ZERO]
}

/// The equations of one effect.
trait Law {
    /// The description.
    const ABOUT: About;
    /// The angle of a sinusoidal effect.
    const PERIODIC: Option<Periodic> = None;
    /// Names of the shapes that a description may leave out; they are then 0.
    const OPTIONAL: &'static [&'static str] = &[];

    /// Returns the torque per unit of each gain, N·m, and advances the hidden state by one period. States start at 0.
    fn terms<T: Real>(
        shapes: &[T; SHAPES],
        memory: &mut [T; MEMORY],
        at: &Instant<T>,
    ) -> [T; GAINS];

    /// Advances the hidden state over a gap of `_seconds`, s. By default it is reset.
    fn rested<T: Real>(_shapes: &[T; SHAPES], memory: &mut [T; MEMORY], _seconds: T) {
        *memory = [T::ZERO; MEMORY];
    }
}

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
                    $(Self::$kind => &<$module::$kind as Law>::ABOUT),+
                }
            }

            /// Returns the angle of a sinusoidal effect, none for others.
            pub const fn periodic(self) -> Option<Periodic> {
                match self {
                    $(Self::$kind => <$module::$kind as Law>::PERIODIC),+
                }
            }

            /// Names of the shapes that a description may leave out; they are then 0.
            pub const fn optional(self) -> &'static [&'static str] {
                match self {
                    $(Self::$kind => <$module::$kind as Law>::OPTIONAL),+
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
                    $(Self::$kind => $module::$kind::terms(shapes, memory, at)),+
                }
            }

            fn rested<T: Real>(self, shapes: &[T; SHAPES], memory: &mut [T; MEMORY], seconds: T) {
                match self {
                    $(Self::$kind => $module::$kind::rested(shapes, memory, seconds)),+
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
                            Role::by(&<$module::$kind as Law>::ABOUT).is_some()
                                && <$module::$kind as Law>::PERIODIC.is_none()
                        } {
                            $module::$kind::terms(shapes, memory, at)
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

    /// Returns gap, stiffness and damping of a transmission with these shapes, as [`transmitted`] takes them. None
    /// for an effect that does not act between motor and link.
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
    pub const fn is_warming(self) -> bool {
        matches!(
            self,
            Self::ViscousWarmupTime | Self::ViscousWarmupTemperature | Self::ViscousWarmupHeat
        )
    }

    /// Returns true if its law depends on the joint's own friction: by heat, or by the torque that the gear transmits.
    pub const fn heeds_friction(self) -> bool {
        matches!(self, Self::LoadFriction | Self::ViscousWarmupHeat)
    }

    /// Returns true if its torque acts on the link: the gear transmits it, load friction grows with it, a shaft twists.
    pub const fn on_the_link(self) -> bool {
        matches!(
            self,
            Self::Spring | Self::GravityTilt | Self::InertiaCoupling | Self::TorqueOffset
        )
    }

    /// Returns the kind with this name and law, as a description writes them.
    pub fn named(name: &str, law: Option<&str>) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| {
            let about = kind.about();
            about.name == name && (law.is_none() || about.law == law)
        })
    }
}

/// One effect with its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Effect<T> {
    /// The kind.
    pub kind: Kind,
    /// In the order of [`About::gains`]; the others are 0.
    pub gains: [T; GAINS],
    /// In the order of [`About::shapes`]; the others are 0.
    pub shapes: [T; SHAPES],
}

/// Hidden state of one effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory<T>(pub [T; MEMORY]);

impl<T: Real> Default for Memory<T> {
    fn default() -> Self {
        Self([T::ZERO; MEMORY])
    }
}

impl<T: Real> Effect<T> {
    /// Returns an effect with `gains` and `shapes` in the order of [`About`]; the others are 0. Values beyond
    /// [`GAINS`] and [`SHAPES`] are ignored.
    pub fn new(kind: Kind, gains: &[T], shapes: &[T]) -> Self {
        let value = |list: &[T], k: usize| list.get(k).copied().unwrap_or(T::ZERO);
        Self {
            kind,
            gains: core::array::from_fn(|k| value(gains, k)),
            shapes: core::array::from_fn(|k| value(shapes, k)),
        }
    }

    /// Returns the drive torque due to the effect, N·m, and advances the hidden state by one period.
    #[inline(always)]
    pub fn torque(&self, memory: &mut Memory<T>, at: &Instant<T>) -> T {
        let terms = self.kind.terms(&self.shapes, &mut memory.0, at);
        self.gains
            .iter()
            .zip(terms)
            .fold(T::ZERO, |sum, (gain, term)| sum + *gain * term)
    }

    /// Returns the hidden state after a gap of `seconds`, as in a recording. Heat decays as in a joint at rest, and a
    /// memory of distance is reset.
    pub fn rested(&self, mut memory: Memory<T>, seconds: T) -> Memory<T> {
        self.kind.rested(&self.shapes, &mut memory.0, seconds);
        memory
    }
}
