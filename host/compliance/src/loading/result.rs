//! What static loading shows of a drive.

use serde::Serialize;

use crate::value::Value;

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
    /// True if the torque of the spring changed its sign, so that a gap would show.
    pub reverses: bool,
    /// Smallest and largest torque of the spring.
    pub load: [f64; 2],
    /// Windows of rows.
    pub windows: usize,
    /// Reason and remedy if the stiffness is not shown.
    pub missing: Option<String>,
    /// Torque and twist of the windows, loading (growing) and unloading (falling).
    #[serde(skip)]
    pub points: [Vec<[f64; 2]>; 2],
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
