//! Rows of a model.

/// One equation at many instants: x·β = y.
#[derive(Clone, Debug, Default)]
pub struct Equation {
    /// Row-major, rows × columns.
    pub x: Vec<f64>,
    /// Torque, or the energy of a window scaled to a torque.
    pub y: Vec<f64>,
    /// True if the row is used.
    pub keep: Vec<bool>,
}

/// Rows of one piece.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Time, s (start of the window for the integral model).
    pub t: Vec<f64>,
    /// One per joint for the differential model, one for the integral model.
    pub equations: Vec<Equation>,
    /// Per joint, position at each row.
    pub q: Vec<Vec<f64>>,
    /// Per joint, velocity at each row.
    pub qd: Vec<Vec<f64>>,
}
