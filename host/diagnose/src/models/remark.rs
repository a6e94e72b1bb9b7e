//! Remarks on a fitted model.

use rig_shared::effects::Kind;

/// Remark on a fitted model. Joints count from 0.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ModelRemark {
    /// A sentence of the identification on how the base parameters were distributed over the links.
    OfIdentification(String),
    /// The data show another torque of a transmission than the description's inertia and load give.
    UnevenGear {
        /// The transmission.
        kind: Kind,
        /// Its joint.
        joint: usize,
        /// Torque in the data over that of the description.
        times: f64,
    },
    /// A parameter came out beyond its possible range.
    OutOfRange {
        /// Name of the parameter.
        parameter: &'static str,
        /// Name of its effect.
        effect: &'static str,
        /// Its joint.
        joint: usize,
        /// Value of the fit, SI.
        value: f64,
        /// Value of the description, SI.
        kept: f64,
        /// Unit, ASCII.
        unit: &'static str,
    },
    /// No physically consistent bodies were found.
    NoBodies {
        /// Message of the identification.
        error: String,
    },
    /// Consistent bodies increase the training residual.
    CostOfBodies {
        /// Joint with the largest increase.
        joint: usize,
        /// Increase of its RMS, per cent.
        percent: f64,
    },
}
