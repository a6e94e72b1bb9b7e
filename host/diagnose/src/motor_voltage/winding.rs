//! Results from the voltage of one joint's motor.

use crate::outcome::{Detectable, Map, Place, Step, Tried};
use crate::search::refusal;

/// Results from the voltage of one joint's motor.
pub(crate) struct Winding {
    /// From 0.
    pub(crate) joint: usize,
    /// Sensor reading without a current, as a torque at the joint, and its standard deviation, N·m or N.
    pub(crate) offset: [f64; 2],
    /// Back-EMF that contradicts the torque constant, V·s/rad.
    pub(crate) constant: Option<Contradiction>,
    /// Resistance that contradicts the description, Ω.
    pub(crate) resistance: Option<Contradiction>,
    /// The tried dead zone, without the reason for its refusal.
    pub(crate) tried: Tried,
    pub(crate) refused: Option<Refusal>,
    pub(crate) detectable: Option<Detectable>,
    pub(crate) dead_zone: Option<DeadZone>,
    pub(crate) left: Option<Left>,
}

/// A value by the voltage that differs from the described.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contradiction {
    /// Value and standard deviation.
    pub(crate) seen: [f64; 2],
    pub(crate) stated: f64,
}

/// Reason why a dead zone is rejected.
#[derive(Clone, Debug)]
pub(crate) enum Refusal {
    /// The user excludes it.
    LeftOut,
    /// It is not distinct along the current.
    NoVoltage,
    /// The evidence is not sufficient, as in the search.
    Evidence(refusal::Refusal),
    /// It is smaller than an inverter's.
    Small {
        volts: f64,
        /// Share of the residual that it takes.
        share: f64,
    },
}

/// Unexplained remainder of a motor's voltage.
#[derive(Clone, Debug)]
pub(crate) struct Left {
    /// Name of the joint.
    pub(crate) joint: String,
    /// RMS beyond the noise, V.
    pub(crate) rms: f64,
    /// Residual RMS over the noise.
    pub(crate) ratio: f64,
    /// Strongest dependence.
    pub(crate) place: Option<Place>,
}

/// A coefficient of the voltage's equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Resistance,
    BackEmf,
}

/// Reason why nothing follows from a voltage.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Lack {
    /// A voltage is recorded with the joint clamped alone, or the drive has none of its own.
    ClampedAlone,
    /// The motion does not separate resistance and back-EMF.
    Inseparable,
    /// They leave a share of the voltage's squares.
    Unexplained(f64),
    /// One of them would not be positive.
    NotPositive(Part),
}

/// A coefficient without and with a dead zone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moved {
    pub(crate) part: Part,
    pub(crate) before: f64,
    /// Value and standard deviation.
    pub(crate) after: [f64; 2],
}

/// A dead zone of the inverter.
pub(crate) struct DeadZone {
    /// True if the description states it.
    pub(crate) described: bool,
    pub(crate) volts: f64,
    /// Its entry in the result, without the reason.
    pub(crate) step: Step,
    /// Current below which it fades, A.
    pub(crate) fade: f64,
    /// Noise floor of the voltage, V.
    pub(crate) floor: f64,
    pub(crate) places: Vec<Place>,
    /// Resistance and back-EMF.
    pub(crate) moved: [Moved; 2],
    pub(crate) map: Map,
}

/// Returns true if any named dead zone is not in the description.
pub(crate) fn name_something(windings: &[Winding]) -> bool {
    let found = |w: &Winding| w.dead_zone.as_ref().is_some_and(|dead| !dead.described);
    windings.iter().any(found)
}

/// Returns true if the voltages contradict the description's values.
pub(crate) fn contradict(windings: &[Winding]) -> bool {
    windings.iter().any(|w| w.constant.is_some())
}
