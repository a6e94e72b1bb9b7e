//! Effects beyond the standard model: one file each, read alike by the simulator, the identifier, the diagnosis and the
//! firmware's precompensation.
//!
//! An effect adds a torque to what the drive has to give: τ = Y·π + Σ βₖ·hₖ(η; motion). The βₖ (*gains*) enter linearly,
//! the η (*shapes*) do not; hidden states are driven by the motion itself. A few effects act elsewhere ([`Channel`]): on
//! what a sensor reads, between motor and link, or between command and voltage.
//!
//! Adding an effect is adding its file and one line to the `registry!` below.

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

/// Most gains of one effect.
pub const GAINS: usize = 4;
/// Most shapes of one effect.
pub const SHAPES: usize = 4;
/// Most hidden states of one effect.
pub const MEMORY: usize = 4;

/// What an effect sees at one instant. Joint-side, SI.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Instant<T> {
    /// rad or m
    pub position: T,
    /// rad/s or m/s
    pub velocity: T,
    /// rad/s² or m/s²
    pub acceleration: T,
    /// Direction of motion, −1 to 1; stands apart from the velocity because near rest it is the caller's to know.
    pub direction: T,
    /// Angle of the motor, rad.
    pub motor_angle: T,
    /// Torque of the motor as its current and nominal constant say, times the ratio, N·m.
    pub drive_torque: T,
    /// Change of the drive torque, N·m/s.
    pub drive_rate: T,
    /// Torque that the gear transmits to the link, friction and the drive's own inertia taken off, N·m.
    pub load: T,
    /// Dry and viscous friction of the joint as its model has them without effects, against positive motion, N·m.
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
    /// Friction of other effects that acts through the joint's contact over that of the model, 1: by so much farther the contact
    /// is bent before it slides.
    pub beside: T,
}

impl<T: Real> Instant<T> {
    /// How far a contact is moved on since the last instant, rad.
    #[inline(always)]
    fn way(&self) -> T {
        self.velocity * self.period
    }

    /// All friction that acts through the joint's contact over that of the model, 1.
    #[inline(always)]
    fn whole(&self) -> T {
        // Fits and precompensation may state a little less friction than none.
        (T::ONE + self.beside).max(T::from_f64(LEAST_FRICTION))
    }
}

/// Of a contact's own friction effects may take all off but this share.
const LEAST_FRICTION: f64 = 0.1;

/// Cosine and sine of an order of an angle, as [`Law::terms`] has them.
#[inline(always)]
fn wave<T: Real>(order: T, angle: T) -> [T; GAINS] {
    let (sine, cosine) = (order * angle).sin_cos();
    [cosine, sine, T::ZERO, T::ZERO]
}

/// The equations of one effect.
trait Law {
    /// What it is.
    const ABOUT: About;
    /// Of what it is a sinusoid, where it is one.
    const PERIODIC: Option<Periodic> = None;
    /// Names of the shapes that a description may leave out; they are 0 then.
    const OPTIONAL: &'static [&'static str] = &[];

    /// Torque per unit of each gain, N·m, and the hidden state one period on. States start at 0.
    fn terms<T: Real>(
        shapes: &[T; SHAPES],
        memory: &mut [T; MEMORY],
        at: &Instant<T>,
    ) -> [T; GAINS];

    /// The hidden state after so many seconds of which nothing is known, s: it begins anew.
    fn rested<T: Real>(_shapes: &[T; SHAPES], memory: &mut [T; MEMORY], _seconds: T) {
        *memory = [T::ZERO; MEMORY];
    }
}

macro_rules! registry {
    ($($(#[$meta:meta])* $kind:ident in $module:ident),+ $(,)?) => {
        /// Which effect. On the wire it is its place in the registry; the wire's fingerprint holds the names in
        /// their order, so that ends with different registries refuse each other.
        #[derive(
            Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, Schema,
        )]
        pub enum Kind {
            $($(#[$meta])* $kind),+
        }

        impl Kind {
            /// All, in the order of the catalogue.
            pub const ALL: &'static [Self] = &[$(Self::$kind),+];

            /// What it is.
            pub const fn about(self) -> &'static About {
                match self {
                    $(Self::$kind => &<$module::$kind as Law>::ABOUT),+
                }
            }

            /// Of what it is a sinusoid, where it is one.
            pub const fn periodic(self) -> Option<Periodic> {
                match self {
                    $(Self::$kind => <$module::$kind as Law>::PERIODIC),+
                }
            }

            /// Names of the shapes that a description may leave out; they are 0 then.
            pub const fn optional(self) -> &'static [&'static str] {
                match self {
                    $(Self::$kind => <$module::$kind as Law>::OPTIONAL),+
                }
            }

            /// Torque per unit of each gain, N·m, and the hidden state one period on. States start at 0.
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

            /// [`Self::terms`] without the laws that nothing compensates, and without the periodic ones, which are turned with the
            /// angle instead: a chip need not hold their code. 0 for them.
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
    /// Friction of teeth and bearings that carry more.
    LoadFriction in load_friction,
    /// Tight spots.
    PositionFriction in position_friction,
    /// Friction with memory of distance, after Dahl.
    PreslidingDahl in presliding_dahl,
    /// Friction with memory of distance and of speed, after Canudas de Wit.
    PreslidingLugre in presliding_lugre,
    /// Friction with memory of distance: elements that slip one after the other.
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
    /// Play between the teeth of a gear.
    Backlash in backlash,
    /// A shaft or gear that twists under load.
    JointElasticity in joint_elasticity,
    /// A code disc or magnet off the motor's axis.
    EncoderEccentricityMotor in encoder_eccentricity_motor,
    /// A code disc or magnet off the joint's axis.
    EncoderEccentricityJoint in encoder_eccentricity_joint,
    /// What the current sensor reads when no current flows.
    CurrentOffset in current_offset,
    /// A torque constant that falls at high current.
    TorqueSaturation in torque_saturation,
    /// A torque or current that is read later than the position.
    MeasurementDelay in measurement_delay,
    /// Gravity that does not stand where the description says.
    GravityTilt in gravity_tilt,
    /// A mass on the link.
    Payload in payload,
    /// A cable or hose that pulls the joint back.
    Spring in spring,
    /// Voltage that half-bridges lose.
    DriveDeadzone in drive_deadzone,
    /// Terms of another joint's motion.
    InertiaCoupling in inertia_coupling,
    /// A constant torque.
    TorqueOffset in torque_offset,
}

impl Kind {
    /// Returns true for what pulls on a joint from outside the robot (cables, hoses, springs), so that it can be taken off.
    pub const fn is_external(self) -> bool {
        matches!(self, Self::TorqueOffset | Self::Spring)
    }

    /// How many of the parameters are gains; they come first.
    pub fn gains(self) -> usize {
        self.about().gains.len()
    }

    /// Gap, stiffness and damping of a transmission with these shapes, as [`transmitted`] takes them; none for what
    /// does not act between motor and link.
    pub fn transmission<T: Real>(self, shapes: &[T; SHAPES]) -> Option<[T; 3]> {
        match self {
            Self::Backlash => Some([shapes[0], shapes[1], shapes[2]]),
            Self::JointElasticity => Some([T::ZERO, shapes[0], shapes[1]]),
            _ => None,
        }
    }

    /// Share of the joint's friction that acts behind a transmission with these shapes; none for what does not act
    /// between motor and link.
    pub fn link_friction<T: Real>(self, shapes: &[T; SHAPES]) -> Option<T> {
        match self {
            Self::Backlash => Some(shapes[3]),
            Self::JointElasticity => Some(shapes[2]),
            _ => None,
        }
    }

    /// Whether it takes viscous friction off as the joint warms.
    pub const fn is_warming(self) -> bool {
        matches!(
            self,
            Self::ViscousWarmupTime | Self::ViscousWarmupTemperature | Self::ViscousWarmupHeat
        )
    }

    /// Whether its law goes by the joint's own friction: heat of it, or what of the drive's torque is left for a gear to transmit.
    pub const fn heeds_friction(self) -> bool {
        matches!(self, Self::LoadFriction | Self::ViscousWarmupHeat)
    }

    /// Whether its torque acts on the link: a gear transmits it, friction under load grows with it, and a shaft is twisted by it.
    pub const fn on_the_link(self) -> bool {
        matches!(
            self,
            Self::Spring | Self::GravityTilt | Self::InertiaCoupling | Self::TorqueOffset
        )
    }

    /// The kind with this name and law, as a description writes them.
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
    /// Which.
    pub kind: Kind,
    /// In the order of [`About::gains`]; 0 beyond.
    pub gains: [T; GAINS],
    /// In the order of [`About::shapes`]; 0 beyond.
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
    /// An effect of a kind with its `gains` and `shapes` in the order of [`About`]; 0 beyond them. An effect has room
    /// for [`GAINS`] and [`SHAPES`] of them: what is beyond that is no value of any kind, and is not looked at.
    pub fn new(kind: Kind, gains: &[T], shapes: &[T]) -> Self {
        let value = |list: &[T], k: usize| list.get(k).copied().unwrap_or(T::ZERO);
        Self {
            kind,
            gains: core::array::from_fn(|k| value(gains, k)),
            shapes: core::array::from_fn(|k| value(shapes, k)),
        }
    }

    /// Torque that the drive has to give because of it, N·m, and the hidden state one period on.
    #[inline(always)]
    pub fn torque(&self, memory: &mut Memory<T>, at: &Instant<T>) -> T {
        let terms = self.kind.terms(&self.shapes, &mut memory.0, at);
        self.gains
            .iter()
            .zip(terms)
            .fold(T::ZERO, |sum, (gain, term)| sum + *gain * term)
    }

    /// The hidden state after `seconds` of which nothing is known, as in a gap of a recording: heat goes its way as in a joint at
    /// rest, and what remembers a distance begins anew.
    pub fn rested(&self, mut memory: Memory<T>, seconds: T) -> Memory<T> {
        self.kind.rested(&self.shapes, &mut memory.0, seconds);
        memory
    }
}
