//! The motors of a chain, built from their descriptions.

use heapless::Vec;

use super::drives::{DriveKind, DriveMap, MOTOR_COLUMNS, ScrewMap};
use super::error::{TransmissionError, check};
use crate::multibody::MAX_JOINTS;
use crate::scalar::Real;

/// A screw with its factor 2π/lead.
#[derive(Clone, Debug)]
pub(super) struct Screw<T> {
    pub(super) factor: T,
    pub(super) constant: T,
    pub(super) cosine: T,
    pub(super) sine: T,
    pub(super) weights: Vec<T, MAX_JOINTS>,
    pub(super) offset: T,
}

/// One motor.
#[derive(Clone, Debug)]
pub(super) struct Motor<T> {
    pub(super) kind: DriveKind,
    /// g; a coupled drive also has r = g/g_kk in `shares`.
    pub(super) ratios: Vec<T, MAX_JOINTS>,
    pub(super) shares: Vec<T, MAX_JOINTS>,
    pub(super) screw: Option<Screw<T>>,
    pub(super) zero: T,
}

/// The drives of a chain, one motor per joint.
#[derive(Clone, Debug)]
pub struct Transmission<T> {
    pub(super) motors: Vec<Motor<T>, MAX_JOINTS>,
    /// True if `Ia<k>` describes an inertia that no motor parameter describes.
    joint_inertia: Vec<bool, MAX_JOINTS>,
}

/// Converts `values` to `T`; there is one for each joint.
fn converted<T: Real>(values: &[f64]) -> Vec<T, MAX_JOINTS> {
    values.iter().map(|v| T::from_f64(*v)).collect()
}

/// Checks that all `values` of a `motor` (from 0) are finite.
fn finite(motor: usize, parameter: &'static str, values: &[f64]) -> Result<(), TransmissionError> {
    if values.iter().all(|v| v.is_finite()) {
        Ok(())
    } else {
        Err(TransmissionError::NotFinite { motor, parameter })
    }
}

impl<T: Real> Screw<T> {
    /// Builds the screw of a `motor` (from 0) on a chain of `n` joints.
    fn new(motor: usize, screw: &ScrewMap<'_>, n: usize) -> Result<Self, TransmissionError> {
        check("weights", n, screw.weights.len())?;
        finite(motor, "a weight of the crank's angle", screw.weights)?;
        finite(
            motor,
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
            return Err(TransmissionError::NoLead { motor });
        }
        if screw.constant + libm::hypot(screw.cosine, screw.sine) <= 0.0 {
            return Err(TransmissionError::NoScrew { motor });
        }
        Ok(Self {
            factor: T::from_f64(core::f64::consts::TAU / screw.lead),
            constant: T::from_f64(screw.constant),
            cosine: T::from_f64(screw.cosine),
            sine: T::from_f64(screw.sine),
            weights: converted(screw.weights),
            offset: T::from_f64(screw.offset),
        })
    }
}

impl<T: Real> Motor<T> {
    /// Builds the motor of joint `k` (from 0) on a chain of `n` joints.
    fn new(k: usize, drive: &DriveMap<'_>, n: usize) -> Result<Self, TransmissionError> {
        check("ratios", n, drive.ratios.len())?;
        finite(k, "a ratio", drive.ratios)?;
        finite(k, "the zero", &[drive.zero])?;
        let screw = match &drive.screw {
            None => None,
            Some(screw) => Some(Screw::new(k, screw, n)?),
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
        Ok(Self {
            kind,
            ratios: converted(drive.ratios),
            shares,
            screw,
            zero: T::from_f64(drive.zero),
        })
    }
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
            let motor = Motor::new(k, drive, n)?;
            let simple = motor.kind == DriveKind::Simple;
            // Both lists hold at most MAX_JOINTS entries: the count is checked above.
            let _ = motors.push(motor);
            let foreign = drives
                .iter()
                .enumerate()
                .any(|(m, d)| m != k && d.screw.is_none() && d.ratios.get(k) != Some(&0.0));
            let _ = joint_inertia.push(simple || foreign || drive.joint_inertia);
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

    /// Returns the turns of motor `motor` (from 0) per unit of the coordinate in which its inertia and its stiffness stand:
    /// its own ratio, or 1 for a varying drive, whose coordinate is the motor's. `None` past the end.
    pub fn own_turns(&self, motor: usize) -> Option<T> {
        let own = self.motors.get(motor)?;
        match own.kind {
            DriveKind::Varying => Some(T::ONE),
            DriveKind::Simple | DriveKind::Coupled => own.ratios.get(motor).copied(),
        }
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

impl<T: Real<Mask = bool>> Transmission<T> {
    /// Returns true if motor `motor` turns with joint `joint` (both from 0), at some position at least.
    pub fn turns_with(&self, motor: usize, joint: usize) -> bool {
        self.motors.get(motor).is_some_and(|own| {
            let weights = own.screw.iter().flat_map(|screw| screw.weights.get(joint));
            let mut entries = own.ratios.get(joint).into_iter().chain(weights);
            entries.any(|entry| T::ZERO.lt(entry.abs()))
        })
    }
}
