//! Drives coupled to joints: motor coordinates Ψ as functions of the joint coordinates q (the book's φ).
//!
//! One motor per joint. Motor k turns by
//!
//! Ψ_k = F_k(q) = Σ_j g_kj·q_j + (2π/p)·√(s + m·cos φ − n·sin φ) + zero, φ = Σ_j c_j·q_j + offset,
//!
//! with constant ratios g (gears, bevels, a coupled wrist) and, where a ball screw turns a crank, its length over its
//! lead p: s = l₁² + l₂² + l₃² and m, n from the crank l₁ and the two legs l₂, l₃ of the screw's anchor (Kozłowski
//! 1998, the IRp-6). With J = ∂F/∂q the powers on both sides are the same, τᵀq̇ = τ_motorᵀΨ̇, so that
//!
//! Ψ̇ = J·q̇, Ψ̈ = J·q̈ + J̇·q̇, τ = Jᵀ·τ_motor.
//!
//! # Parameters of the motors
//! After the 14·n columns of [`multibody`](crate::multibody) a regressor has three per motor ([`MOTOR_COLUMN_NAMES`]):
//! inertia, viscous and Coulomb friction of the motor, except the part that the joint's own `Ia`, `fv`, `fc` describe.
//! Their factors depend on the drive ([`DriveKind`]; r_j = J_kj/J_kk, s = Σ_j r_j·q̇_j, torque of joint i):
//!
//! | column | simple | coupled | varying |
//! | --- | --- | --- | --- |
//! | `Iam` | 0 | r_i·ṡ − \[i ≠ k\]·r_i²·q̈_i | J_ki·Ψ̈_k |
//! | `fvm` | 0 | r_i·s − r_i²·q̇_i | J_ki·Ψ̇_k |
//! | `fcm` | 0 | r_i·sgn s | J_ki·sgn Ψ̇_k |
//!
//! For a coupled drive the values are those seen at its own joint. The motor's part on the diagonal of another joint
//! belongs to that joint's `Ia` and `fv`. This is the convention under which the coupled wrists of the Stäubli arms are
//! published (Gautier 1991; Khalil & Dombre 2002, ch. 12). For a varying drive the values are the motor's own. The
//! joint of a coupled or varying drive has no `Ia` if only the motor turns there: `Iam` describes that inertia. It has
//! one if another motor adds to the joint, or if gear and shaft have an inertia of their own
//! ([`Transmission::has_joint_inertia`], [`DriveMap::joint_inertia`]).
//!
//! Leaves out: more or fewer motors than joints, backlash and elasticity of gears, mass of the screws and rods (they
//! turn with the links beside them), screw friction that grows with the load, the gyroscopic torque of rotors. Leaves
//! out also the first moment of a crank that turns with a sum of joint angles about the shoulder of a parallelogram
//! (the IRp-6's with φ₃ = q₂ + q₃). It has the weight of a first moment of the outer link, without the coupling of the
//! two links that a crank at the elbow has. The serial chain can describe only one of these two properties.

mod columns;
mod dynamics;
mod inverse;
mod map;
mod solve;
#[cfg(test)]
mod tests;

use core::fmt;

use heapless::Vec;

pub use dynamics::MotorSpace;
pub use inverse::MOST_STEPS;

use crate::multibody::{MAX_JOINTS, MultibodyError};
use crate::scalar::Real;

/// Number of parameters, and so of regressor columns, of a motor.
pub const MOTOR_COLUMNS: usize = 3;

/// Names of the motor parameters in their order; the motor's number (from 1) is appended.
///
/// | name | meaning | unit, coupled drive | unit, varying drive |
/// | --- | --- | --- | --- |
/// | `Iam` | inertia of the rotor | kg·m² (kg), at the drive's own joint | kg·m², at the motor |
/// | `fvm` | viscous friction of the motor | N·m·s/rad (N·s/m), at the own joint | N·m·s/rad, at the motor |
/// | `fcm` | Coulomb friction of the motor | N·m (N), at the own joint | N·m, at the motor |
pub const MOTOR_COLUMN_NAMES: [&str; MOTOR_COLUMNS] = ["Iam", "fvm", "fcm"];

/// Indices of the parameters within the [`MOTOR_COLUMNS`] of a motor.
pub mod motor_column {
    /// Rotor inertia.
    pub const INERTIA: usize = 0;
    /// Viscous friction.
    pub const VISCOUS: usize = 1;
    /// Coulomb friction.
    pub const COULOMB: usize = 2;
}

/// A ball screw that turns a crank: a term of a motor's position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScrewMap<'a> {
    /// Advance of the nut per turn of the motor, m; negative if the screw shortens as the motor turns forwards.
    pub lead: f64,
    /// s, m².
    pub constant: f64,
    /// m, the factor of cos φ, m².
    pub cosine: f64,
    /// n, the factor of −sin φ, m².
    pub sine: f64,
    /// c: the crank's angle is Σ c_j·q_j + offset.
    pub weights: &'a [f64],
    /// Crank's angle at q = 0, rad.
    pub offset: f64,
}

/// One motor's position as a function of the joint coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveMap<'a> {
    /// g: motor radians per radian (or metre) of each joint.
    pub ratios: &'a [f64],
    /// The screw, if there is one.
    pub screw: Option<ScrewMap<'a>>,
    /// Constant added, rad.
    pub zero: f64,
    /// True if gear and shaft have an inertia that turns with the joint and not with the motor.
    pub joint_inertia: bool,
}

/// Form of a motor's row of the Jacobian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveKind {
    /// Constant, with an entry for its own joint only.
    Simple,
    /// Constant, with entries for other joints too.
    Coupled,
    /// Depends on the position.
    Varying,
}

/// Reason why a transmission cannot be built or used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransmissionError {
    /// No motor, or more than [`MAX_JOINTS`].
    Count {
        /// Number of motors given.
        found: usize,
    },
    /// The length of a slice does not match the number of joints.
    WrongLength {
        /// Name of the argument.
        argument: &'static str,
        /// Length it must have.
        expected: usize,
        /// Length it has.
        found: usize,
    },
    /// A number of a motor's function is infinite or NaN.
    NotFinite {
        /// The motor, from 0.
        motor: usize,
        /// The parameter.
        parameter: &'static str,
    },
    /// The lead of a screw is zero.
    NoLead {
        /// The motor, from 0.
        motor: usize,
    },
    /// The screw's length is not a positive number at any angle.
    NoScrew {
        /// The motor, from 0.
        motor: usize,
    },
    /// A motor of constant ratios does not move its own joint.
    OwnRatioZero {
        /// The motor, from 0.
        motor: usize,
    },
    /// The Jacobian has no inverse here: a crank is at its dead centre, or motors turn alike.
    Singular {
        /// The motor whose row depends on those of the motors before it, from 0.
        motor: usize,
    },
    /// A screw would have to be shorter or longer than its crank allows.
    OutOfReach {
        /// The motor, from 0.
        motor: usize,
    },
    /// No joint position was found for the motor positions from the given start.
    NotFound {
        /// The motor with the largest remaining error, from 0.
        motor: usize,
    },
    /// A quantity of the chain could not be computed.
    Multibody(MultibodyError),
}

impl fmt::Display for TransmissionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count { found } => write!(
                f,
                "There are {found} drives; there must be one a joint, 1 to {MAX_JOINTS}."
            ),
            Self::WrongLength {
                argument,
                expected,
                found,
            } => write!(f, "{argument} has length {found}; it must be {expected}."),
            Self::NotFinite { motor, parameter } => write!(
                f,
                "{parameter} of drive {} is not a finite number.",
                motor + 1
            ),
            Self::NoLead { motor } => write!(
                f,
                "The lead of the screw of drive {} is 0; it must be the advance a turn, in m.",
                motor + 1
            ),
            Self::NoScrew { motor } => write!(
                f,
                "The screw of drive {} has no length at any angle of its crank; correct its geometry.",
                motor + 1
            ),
            Self::OwnRatioZero { motor } => write!(
                f,
                "Drive {0} does not move joint {0}; each motor belongs to a joint that it moves.",
                motor + 1
            ),
            Self::Singular { motor } => write!(
                f,
                "At this position drive {} moves no joint that the drives before it do not move alike: its crank is at \
                 a dead centre, or its ratios repeat another's.",
                motor + 1
            ),
            Self::OutOfReach { motor } => write!(
                f,
                "The screw of drive {} cannot have the length that this motor position asks for.",
                motor + 1
            ),
            Self::NotFound { motor } => write!(
                f,
                "No joint position was found that gives motor {} this position.",
                motor + 1
            ),
            Self::Multibody(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for TransmissionError {}

impl From<MultibodyError> for TransmissionError {
    fn from(error: MultibodyError) -> Self {
        Self::Multibody(error)
    }
}

/// Checks that `argument` has the expected length.
#[inline(always)]
fn check(argument: &'static str, expected: usize, found: usize) -> Result<(), TransmissionError> {
    if expected == found {
        Ok(())
    } else {
        Err(TransmissionError::WrongLength {
            argument,
            expected,
            found,
        })
    }
}

/// A screw with its factor 2π/lead.
#[derive(Clone, Debug)]
struct Screw<T> {
    factor: T,
    constant: T,
    cosine: T,
    sine: T,
    weights: Vec<T, MAX_JOINTS>,
    offset: T,
}

/// One motor.
#[derive(Clone, Debug)]
struct Motor<T> {
    kind: DriveKind,
    /// g; a coupled drive also has r = g/g_kk in `shares`.
    ratios: Vec<T, MAX_JOINTS>,
    shares: Vec<T, MAX_JOINTS>,
    screw: Option<Screw<T>>,
    zero: T,
}

/// The drives of a chain, one motor per joint.
#[derive(Clone, Debug)]
pub struct Transmission<T> {
    motors: Vec<Motor<T>, MAX_JOINTS>,
    /// True if `Ia<k>` describes an inertia that no motor parameter describes.
    joint_inertia: Vec<bool, MAX_JOINTS>,
}

/// Converts `values` to `T`; there is one for each joint.
fn converted<T: Real>(values: &[f64]) -> Vec<T, MAX_JOINTS> {
    values.iter().map(|v| T::from_f64(*v)).collect()
}

impl<T: Real> Transmission<T> {
    /// Builds the transmission from one function per motor, base joint first.
    ///
    /// # Errors
    /// [`TransmissionError`]: numbers that are not finite, no drive, or a motor that never moves its own joint. The
    /// functions that need it check that the motors together move all joints ([`Self::joint_position`]).
    pub fn new(drives: &[DriveMap<'_>]) -> Result<Self, TransmissionError> {
        let n = drives.len();
        if n == 0 || n > MAX_JOINTS {
            return Err(TransmissionError::Count { found: n });
        }
        let mut motors: Vec<Motor<T>, MAX_JOINTS> = Vec::new();
        let mut joint_inertia: Vec<bool, MAX_JOINTS> = Vec::new();
        for (k, drive) in drives.iter().enumerate() {
            check("ratios", n, drive.ratios.len())?;
            let finite = |parameter, values: &[f64]| {
                if values.iter().all(|v| v.is_finite()) {
                    Ok(())
                } else {
                    Err(TransmissionError::NotFinite {
                        motor: k,
                        parameter,
                    })
                }
            };
            finite("a ratio", drive.ratios)?;
            finite("the zero", &[drive.zero])?;
            let screw = match &drive.screw {
                None => None,
                Some(screw) => {
                    check("weights", n, screw.weights.len())?;
                    finite("a weight of the crank's angle", screw.weights)?;
                    finite(
                        "the screw",
                        &[
                            screw.lead,
                            screw.constant,
                            screw.cosine,
                            screw.sine,
                            screw.offset,
                        ],
                    )?;
                    if screw.lead == 0.0 {
                        return Err(TransmissionError::NoLead { motor: k });
                    }
                    if screw.constant + libm::hypot(screw.cosine, screw.sine) <= 0.0 {
                        return Err(TransmissionError::NoScrew { motor: k });
                    }
                    Some(Screw {
                        factor: T::from_f64(core::f64::consts::TAU / screw.lead),
                        constant: T::from_f64(screw.constant),
                        cosine: T::from_f64(screw.cosine),
                        sine: T::from_f64(screw.sine),
                        weights: converted(screw.weights),
                        offset: T::from_f64(screw.offset),
                    })
                }
            };
            let own = drive.ratios[k];
            let others = || {
                let mut each = drive.ratios.iter().enumerate();
                each.any(|(j, r)| j != k && *r != 0.0)
            };
            let kind = if screw.is_some() {
                DriveKind::Varying
            } else if own == 0.0 {
                return Err(TransmissionError::OwnRatioZero { motor: k });
            } else if others() {
                DriveKind::Coupled
            } else {
                DriveKind::Simple
            };
            let shares = match kind {
                DriveKind::Coupled => drive.ratios.iter().map(|r| T::from_f64(r / own)).collect(),
                DriveKind::Simple | DriveKind::Varying => Vec::new(),
            };
            // Both lists hold at most MAX_JOINTS entries: the count is checked above.
            let _ = motors.push(Motor {
                kind,
                ratios: converted(drive.ratios),
                shares,
                screw,
                zero: T::from_f64(drive.zero),
            });
            let foreign = drives
                .iter()
                .enumerate()
                .any(|(m, d)| m != k && d.screw.is_none() && d.ratios.get(k) != Some(&0.0));
            let _ = joint_inertia.push(kind == DriveKind::Simple || foreign || drive.joint_inertia);
        }
        Ok(Self {
            motors,
            joint_inertia,
        })
    }

    /// Number of motors and of joints, n.
    #[inline(always)]
    pub fn joint_count(&self) -> usize {
        self.motors.len()
    }

    /// Number of motor parameters, 3·n.
    #[inline(always)]
    pub fn parameter_count(&self) -> usize {
        MOTOR_COLUMNS * self.motors.len()
    }

    /// Returns the kind of the drive `motor` (from 0); `None` past the end.
    pub fn kind(&self, motor: usize) -> Option<DriveKind> {
        self.motors.get(motor).map(|m| m.kind)
    }

    /// Returns true if every drive moves only its own joint at a constant ratio: all motor columns are then zero.
    pub fn is_simple(&self) -> bool {
        self.motors.iter().all(|m| m.kind == DriveKind::Simple)
    }

    /// Returns true if the Jacobian is the same at every position.
    pub fn is_constant(&self) -> bool {
        self.motors.iter().all(|m| m.screw.is_none())
    }

    /// Returns true if the regressor has the column `Ia` of a joint (from 0): for a simple drive, if another coupled
    /// motor adds to the joint's diagonal, and with [`DriveMap::joint_inertia`]. Elsewhere `Iam` replaces it, and the
    /// column counts as zero. Returns `false` past the end.
    pub fn has_joint_inertia(&self, joint: usize) -> bool {
        self.joint_inertia.get(joint).copied().unwrap_or(false)
    }
}
