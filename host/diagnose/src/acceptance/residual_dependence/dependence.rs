//! Dependence of a residual on a coordinate of the motion.

/// Dependence of a joint's residual on a coordinate.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Dependence {
    /// Name of the joint.
    pub(crate) joint: String,
    /// The coordinate: `velocity`, `position`, `motor angle`, …
    pub(crate) coordinate: String,
    /// Interval of the coordinate with most of the excess.
    pub(crate) interval: [f64; 2],
    /// Unit of the interval, ASCII.
    pub(crate) unit: String,
    /// Share of the excess over the noise floor that the coordinate alone explains.
    pub(crate) share: f64,
    /// p-value corrected for the number of coordinates.
    pub(crate) p_value: f64,
    /// Its form.
    pub(crate) form: Form,
}

/// Form of a dependence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// Along a coordinate of the motion.
    Along {
        /// True if the interval is the whole range of the coordinate.
        whole_range: bool,
        /// Its symmetry about zero, if it has a clear one.
        parity: Option<Parity>,
    },
    /// Frequencies of the residual that comes back in each run.
    Repeated,
}

/// Symmetry of a dependence about zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parity {
    /// It changes its sign with the coordinate.
    Odd,
    /// It does not.
    Even,
}
