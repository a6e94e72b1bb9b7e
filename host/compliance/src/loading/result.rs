//! What static loading shows of a drive.

use rig_output::format_significant;
use serde::Serialize;

use crate::value::Value;

/// Torque at which a gap is crossed over the range of the load, beyond which the described weight is wrong. By judgement: about the
/// width that counts as crossing, on both sides.
const MISPLACED: f64 = 0.1;

/// How the deflection was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Deflection {
    /// By an encoder on the link (`ql`), against the torque of the motor, in slow motion.
    LinkByTorque,
    /// By an encoder on the link (`ql`), against a wrench at the tool point, with the motors held.
    LinkByWrench,
    /// By a dial gauge or tracker at the tool point (`dx dy dz`), against a wrench there, with the motors held.
    Tool,
}

impl Deflection {
    /// Returns the measurement in words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::LinkByTorque => "link encoder against motor torque",
            Self::LinkByWrench => "link encoder against wrench",
            Self::Tool => "tool point against wrench",
        }
    }
}

/// What static loading shows of one drive.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriveLoading {
    /// Name of the joint.
    pub joint: String,
    /// Index of the joint, from 0.
    pub index: usize,
    /// Measurement.
    pub by: Deflection,
    /// c; `None` if this loading does not show it.
    pub stiffness: Option<Value>,
    /// Half the distance of loading and unloading, as a torque of the drive; `None` if it cannot be told from the others'.
    pub hysteresis: Option<Value>,
    /// Whole gap, in the drive's coordinate; `None` if there is no significant one, or if the torque keeps its sign.
    pub gap: Option<Value>,
    /// Torque of the drive at which the gap is crossed, by the described weight.
    pub gap_torque: Option<f64>,
    /// True if the torque of the spring changed its sign, so that a gap would show.
    pub reverses: bool,
    /// Smallest and largest torque of the spring.
    pub load: [f64; 2],
    /// Windows of rows.
    pub windows: usize,
    /// Reason and remedy if the stiffness is not shown.
    pub missing: Option<String>,
    /// What to know about the estimate.
    #[serde(skip)]
    pub warnings: Vec<String>,
    /// Torque and twist of the windows, loading (growing) and unloading (falling).
    #[serde(skip)]
    pub points: [Vec<[f64; 2]>; 2],
}

impl DriveLoading {
    /// A measurement that shows nothing yet.
    pub(crate) fn new(joint: String, index: usize, by: Deflection) -> Self {
        Self {
            joint,
            index,
            by,
            stiffness: None,
            hysteresis: None,
            gap: None,
            gap_torque: None,
            reverses: false,
            load: [0.0; 2],
            windows: 0,
            missing: None,
            warnings: Vec::new(),
            points: Default::default(),
        }
    }

    /// Adds a gap that is crossed at a torque `zero` of a unit, and tells if the described weight does not put it there.
    pub(crate) fn add_gap(&mut self, half: Value, zero: f64, unit: &str) {
        self.gap = Some(Value::new(2.0 * half.value, 2.0 * half.std));
        self.gap_torque = Some(zero);
        self.reverses = true;
        if zero.abs() > MISPLACED * (self.load[1] - self.load[0]) {
            self.warnings.push(format!(
                "The gap of joint \"{}\" is crossed where the load is {} {unit} by the description, but a gap is crossed at 0: the described weight of the links is not that of this arm, or the force has a bias, which do not change stiffness and gap; or the force has another unit (N is meant), or the pose or the tool point is not the given one, which change the stiffness.",
                self.joint,
                format_significant(zero, 2)
            ));
        }
    }
}

/// What all loading recordings show.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LoadingFindings {
    /// One entry per drive and measurement.
    pub drives: Vec<DriveLoading>,
    /// Root mean square of what the springs leave of the displacement of the tool point, m.
    pub residual: Option<f64>,
    /// What to know about the result.
    pub warnings: Vec<String>,
}

impl LoadingFindings {
    /// Says which units were taken for granted, what another one would do, and what checks it; `None` if the motors' torques gave
    /// the load.
    pub fn assumed(&self) -> Option<String> {
        let is_by = |by: Deflection| self.drives.iter().any(|own| own.by == by);
        let (what, other, check) = match (is_by(Deflection::Tool), is_by(Deflection::LinkByWrench))
        {
            (true, _) => (
                "forces in N and displacements in m",
                "kgf make all stiffnesses 9.8 times too small, and inches 39 times",
                "read the force of a known weight, and the displacement of a feeler gauge",
            ),
            (false, true) => (
                "forces in N",
                "kgf make all stiffnesses 9.8 times too small",
                "read the force of a known weight",
            ),
            (false, false) => return None,
        };
        Some(format!(
            "assumed where no --unit was given: {what}; another unit shows in no such recording ({other}): {check}"
        ))
    }
}
