//! Proof that a Fourier motion stays within its limits at every instant, not only at samples.
//!
//! Time is cut into cells. Within a cell of length h a function deviates from the straight line between its ends by at
//! most h²/8 times the bound of its second derivative. The bounds follow from the coefficients and the envelope. So
//! positions, velocities and accelerations become intervals. Inverse dynamics over intervals gives that of the torque,
//! for any number of joints. A cell in which a velocity can change its sign counts Coulomb friction in both directions.

use rig_shared::multibody::{COLUMNS, Chain, inverse_dynamics, point_position};
use rig_shared::scalar::Real;
use rig_shared::transmission::MOTOR_COLUMNS;

use super::ExciteError;
use super::frame::Frame;
use super::interval::Interval;
use super::schedule::JointMotion;
use rig_model::simulate::SimulateError;

/// Number of cells per period of the fastest harmonic: the proof then costs less than 1 % of a limit.
const CELLS: usize = 512;

/// Largest absolute values of the quintic envelope's derivatives of order 0 to 4, times the ramp's length to that
/// power (10s³ − 15s⁴ + 6s⁵ on 0 ≤ s ≤ 1).
const ENVELOPE: [f64; 5] = [1.0, 1.875, 5.773_502_691_896_26, 60.0, 360.0];
const BINOMIAL: [[f64; 5]; 5] = [
    [1.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0],
    [1.0, 2.0, 1.0, 0.0, 0.0],
    [1.0, 3.0, 3.0, 1.0, 0.0],
    [1.0, 4.0, 6.0, 4.0, 1.0],
];

/// Bounds of a joint's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Lowest and highest position, rad or m.
    pub position: [f64; 2],
    /// Highest speed, rad/s or m/s.
    pub velocity: f64,
    /// Highest acceleration, rad/s² or m/s².
    pub acceleration: f64,
    /// Highest torque or force by the prior parameters, N·m or N; none if they are unknown.
    pub torque: Option<f64>,
}

/// Bounds of a motion.
pub(super) struct Reached {
    /// Per joint.
    pub joints: Vec<Reach>,
    /// Per crank of the frame: lowest and highest sum of its joints' angles, rad.
    pub combined: Vec<[f64; 2]>,
    /// Per plane of the frame: smallest distance along its normal, m.
    pub heights: Vec<f64>,
}

/// Returns a bound of the derivative of this order of envelope times series.
fn derivative_bound(order: usize, omega: f64, coefficients: &[f64], ramp: Option<f64>) -> f64 {
    let harmonics = coefficients.len() / 2;
    let series = |m: usize| -> f64 {
        (0..harmonics)
            .map(|k| {
                let amplitude = coefficients[k].hypot(coefficients[harmonics + k]);
                (omega * (k + 1) as f64).powi(m as i32) * amplitude
            })
            .sum()
    };
    match ramp {
        None => series(order),
        Some(length) => (0..=order)
            .map(|j| BINOMIAL[order][j] * ENVELOPE[j] / length.powi(j as i32) * series(order - j))
            .sum(),
    }
}

/// Returns upper bounds of each joint's motion, and lower bounds of the points' distances to their planes.
pub(super) fn reach(
    frame: &Frame,
    motions: &[JointMotion],
    chain: &Chain<Interval>,
) -> Result<Reached, ExciteError> {
    let n = motions.len();
    let schedule = &frame.schedule;
    let trajectories: Vec<_> = motions
        .iter()
        .map(|m| schedule.trajectory(&m.coefficients))
        .collect();
    let rows: Option<Vec<[Interval; COLUMNS]>> = frame
        .parameters
        .as_ref()
        .map(|rows| rows.iter().map(|row| row.map(Interval::from_f64)).collect());
    let mut reaches: Vec<Reach> = motions
        .iter()
        .map(|m| Reach {
            position: [m.base, m.base],
            velocity: 0.0,
            acceleration: 0.0,
            torque: rows.as_ref().map(|_| 0.0),
        })
        .collect();
    let mut combined = vec![[f64::INFINITY, f64::NEG_INFINITY]; frame.combined.len()];
    let mut motors = vec![Interval::default(); n * n * MOTOR_COLUMNS];
    let mut heights = vec![f64::INFINITY; frame.planes.len()];
    let ramp = f64::from(schedule.ramp_us) * 1e-6;
    let period = f64::from(schedule.period_us) * 1e-6;
    let whole = if schedule.periods > 0 { period } else { 0.0 };
    let down = ramp + period * f64::from(schedule.periods);
    let per_second = (CELLS * schedule.harmonics) as f64 / period;
    let mut state = vec![[Interval::default(); 3]; n];
    let mut tau = vec![Interval::default(); n];
    let mut jacobian = vec![[0.0; 3]; n];
    // One period represents all of them.
    for (from, length, on_ramp) in [(0.0, ramp, true), (ramp, whole, false), (down, ramp, true)] {
        let cells = (length * per_second).ceil() as usize;
        let h = length / cells.max(1) as f64;
        let slack: Vec<[f64; 3]> = motions
            .iter()
            .map(|m| {
                [2, 3, 4].map(|order| {
                    let ramp = on_ramp.then_some(ramp);
                    derivative_bound(order, schedule.omega(), &m.coefficients, ramp) * h * h / 8.0
                })
            })
            .collect();
        let at = |joint: usize, k: usize| {
            // At the end of a segment the next one begins, continuously.
            let here = trajectories[joint].at(from + h * k as f64);
            [
                motions[joint].base + here.position,
                here.velocity,
                here.acceleration,
            ]
        };
        let mut heights_at = |q: &[[f64; 3]]| -> Result<Vec<f64>, ExciteError> {
            let q: Vec<f64> = q.iter().map(|state| state[0]).collect();
            let mut list = Vec::with_capacity(frame.planes.len());
            for plane in &frame.planes {
                let at = point_position(&frame.plain, &q, plane.link, plane.point, &mut jacobian)?;
                list.push(plane.height(at));
            }
            Ok(list)
        };
        let mut before: Vec<[f64; 3]> = (0..n).map(|j| at(j, 0)).collect();
        let mut heights_before = heights_at(&before)?;
        for k in 1..=cells {
            for j in 0..n {
                let now = at(j, k);
                for d in 0..3 {
                    state[j][d] = Interval::hull(before[j][d], now[d]).widened(slack[j][d]);
                }
                before[j] = now;
                let reach = &mut reaches[j];
                let [q, qd, qdd] = state[j];
                reach.position[0] = reach.position[0].min(q.low);
                reach.position[1] = reach.position[1].max(q.high);
                reach.velocity = reach.velocity.max(qd.magnitude());
                reach.acceleration = reach.acceleration.max(qdd.magnitude());
            }
            for ([low, high], limit) in combined.iter_mut().zip(&frame.combined) {
                let mut sum = Interval::default();
                for (weight, s) in limit.weights.iter().zip(&state) {
                    sum += Interval::from_f64(*weight) * s[0];
                }
                (*low, *high) = (low.min(sum.low), high.max(sum.high));
            }
            if let Some(rows) = &rows {
                let [q, qd, qdd] =
                    [0, 1, 2].map(|d| state.iter().map(|s| s[d]).collect::<Vec<_>>());
                inverse_dynamics(chain, rows, &q, &qd, &qdd, &mut tau)?;
                if let Some(drives) = &frame.drives {
                    drives
                        .enclosing
                        .motor_columns(&q, &qd, &qdd, &mut motors)
                        .map_err(SimulateError::from)?;
                    for (t, row) in tau.iter_mut().zip(motors.chunks_exact(n * MOTOR_COLUMNS)) {
                        for (column, value) in row.iter().zip(&drives.parameters) {
                            *t += *column * Interval::from_f64(*value);
                        }
                    }
                }
                for (reach, t) in reaches.iter_mut().zip(&tau) {
                    reach.torque = reach.torque.map(|most| most.max(t.magnitude()));
                }
            }
            if !frame.planes.is_empty() {
                let heights_now = heights_at(&before)?;
                for (p, plane) in frame.planes.iter().enumerate() {
                    let bend = plane.acceleration_bound(&state) * h * h / 8.0;
                    let lowest = heights_before[p].min(heights_now[p]) - bend;
                    // Allow for rounding errors of sums of a few lengths.
                    heights[p] = heights[p].min(lowest - 1e-12 * plane.reach);
                }
                heights_before = heights_now;
            }
        }
    }
    Ok(Reached {
        joints: reaches,
        combined,
        heights,
    })
}
