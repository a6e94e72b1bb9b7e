//! The parameters that a motion should identify, and the sizes of their columns.

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rig_shared::multibody::{COLUMN_NAMES, INERTIAL_PARAMETERS};

use crate::ExciteError;
use crate::bounds::Bounds;
use crate::frame::{Frame, subtract_means};

/// Number of states for the size of a column; the size is a unit and need not be precise.
const SIZE_STATES: usize = 4000;
/// Seed of these states and of those for the base parameters. Not the user's seed, so that results of different seeds
/// are comparable.
pub(super) const SIZE_SEED: u64 = 1;
/// Number of states that decide which parameters of a load are identifiable: far more than parameters.
const RANK_STATES: usize = 200;
/// Share of a column outside the span of others below which it depends on them. Rounding gives 10⁻¹⁵ and less than
/// 10⁻¹² after the projection; a parameter that shows in one part in 10⁶ of the readings cannot be identified.
const DEPENDENT: f64 = 1e-6;

/// Random states within the limits.
struct States<'a> {
    bounds: &'a [Bounds],
    /// Angular frequency of the fastest harmonic, rad/s.
    fastest: f64,
    random: rand_pcg::Pcg64,
    /// Position, velocity, acceleration.
    state: [Vec<f64>; 3],
}

impl<'a> States<'a> {
    fn new(frame: &'a Frame) -> Self {
        Self {
            bounds: &frame.bounds,
            fastest: frame.schedule.omega() * frame.schedule.harmonics as f64,
            random: rand_pcg::Pcg64::seed_from_u64(SIZE_SEED),
            state: [(); 3].map(|()| vec![0.0; frame.bounds.len()]),
        }
    }

    /// Draws the next state.
    fn draw(&mut self) -> [&[f64]; 3] {
        let random = &mut self.random;
        let mut symmetric = |limit: f64| limit * (2.0 * random.random::<f64>() - 1.0);
        let [q, qd, qdd] = &mut self.state;
        for (j, b) in self.bounds.iter().enumerate() {
            q[j] = b.middle() + symmetric(b.half());
            qd[j] = symmetric(b.velocity);
            // Acceleration of the fastest harmonic at the velocity limit, if that is smaller.
            let reachable = b.velocity * self.fastest;
            qdd[j] = symmetric(b.acceleration.map_or(reachable, |a| a.min(reachable)));
        }
        [q, qd, qdd]
    }
}

/// Returns the root mean square of each column over states within the limits.
pub(super) fn column_sizes(frame: &Frame) -> Result<Vec<f64>, ExciteError> {
    let mut states = States::new(frame);
    let mut squares = vec![0.0; frame.columns.len()];
    for _ in 0..SIZE_STATES {
        let rows = frame.regressor(states.draw())?;
        for (sum, column) in squares.iter_mut().zip(rows.column_iter()) {
            *sum += (column.iter().zip(&frame.weights))
                .map(|(entry, weight)| (weight * entry).powi(2))
                .sum::<f64>();
        }
    }
    Ok(squares
        .iter()
        .map(|s| (s / SIZE_STATES as f64).sqrt())
        .collect())
}

/// Returns which of the frame's columns are independent; a column that depends on earlier ones is left out.
pub(super) fn independent(frame: &Frame) -> Result<Vec<bool>, ExciteError> {
    let readings = frame.readings();
    let mut rows = DMatrix::zeros(RANK_STATES * readings, frame.columns.len());
    let mut states = States::new(frame);
    for k in 0..RANK_STATES {
        let own = frame.regressor(states.draw())?;
        rows.rows_mut(k * readings, readings).copy_from(&own);
    }
    if frame.wrist.is_some() {
        subtract_means(&mut rows, readings);
    }
    for mut row in rows.row_iter_mut().enumerate() {
        row.1.scale_mut(frame.weights[row.0 % readings]);
    }
    let largest = rows.amax();
    let mut basis: Vec<nalgebra::DVector<f64>> = Vec::new();
    Ok(rows
        .column_iter()
        .map(|column| {
            let size = column.norm();
            let mut rest = column.into_owned();
            // Twice, against rounding (Giraud et al. 2005).
            for _ in 0..2 {
                for direction in &basis {
                    rest.axpy(-direction.dot(&rest), direction, 1.0);
                }
            }
            let is_independent = rest.norm() > DEPENDENT * size && size > DEPENDENT * largest;
            if is_independent {
                basis.push(rest.normalize());
            }
            is_independent
        })
        .collect())
}

/// Returns the names of a load's parameters.
pub(super) fn load_names() -> [&'static str; INERTIAL_PARAMETERS] {
    core::array::from_fn(|k| COLUMN_NAMES[k])
}
