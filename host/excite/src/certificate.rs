//! Proof that a Fourier motion stays within its limits at every instant, not only at samples.
//!
//! Time is cut into cells. Within a cell of length h a function deviates from the straight line between its ends by at
//! most h²/8 times the bound of its second derivative. The bounds follow from the coefficients and the envelope. So
//! positions, velocities and accelerations become intervals. Inverse dynamics over intervals gives that of the torque,
//! for any number of joints. A cell in which a velocity can change its sign counts Coulomb friction in both directions.

use rig_shared::multibody::{COLUMNS, Chain, column, inverse_dynamics, point_position};
use rig_shared::scalar::Real;
use rig_shared::trajectory::Trajectory;
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

/// Bounds of a motor's motion, on the motor side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorReach {
    /// Lowest and highest angle, rad.
    pub position: [f64; 2],
    /// Highest speed, rad/s.
    pub velocity: f64,
    /// Highest torque by the prior parameters, N·m; none if they are unknown.
    pub torque: Option<f64>,
}

/// Bounds of a motion.
pub(super) struct Reached {
    /// Per joint.
    pub joints: Vec<Reach>,
    /// Per motor; empty if none of coupled drives has limits.
    pub motors: Vec<MotorReach>,
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
    let schedule = &frame.schedule;
    let ramp = f64::from(schedule.ramp_us) * 1e-6;
    let period = f64::from(schedule.period_us) * 1e-6;
    let whole = if schedule.periods > 0 { period } else { 0.0 };
    let down = ramp + period * f64::from(schedule.periods);
    let per_second = (CELLS * schedule.harmonics) as f64 / period;
    let mut proof = Proof::new(frame, motions, chain)?;
    // One period represents all of them.
    for (from, length, ramp) in [
        (0.0, ramp, Some(ramp)),
        (ramp, whole, None),
        (down, ramp, Some(ramp)),
    ] {
        let cells = (length * per_second).ceil() as usize;
        let h = length / cells.max(1) as f64;
        proof.cover(&Segment {
            from,
            ramp,
            cells,
            h,
        })?;
    }
    Ok(proof.reached)
}

/// A part of the motion: a ramp or one whole period.
struct Segment {
    /// Start, s.
    from: f64,
    /// Length of the ramp, s; none for the period at full amplitude.
    ramp: Option<f64>,
    /// Number of cells.
    cells: usize,
    /// Length of a cell, s.
    h: f64,
}

/// Bounds of a motion, extended cell by cell.
struct Proof<'a> {
    frame: &'a Frame,
    chain: &'a Chain<Interval>,
    motions: &'a [JointMotion],
    trajectories: Vec<Trajectory<f64>>,
    /// Prior parameters without the parts that describe coupled motors, if the description has them all.
    rows: Option<Vec<[Interval; COLUMNS]>>,
    /// Prior parameters of the motors; empty if all drives are simple.
    parameters: Vec<[Interval; MOTOR_COLUMNS]>,
    /// Bounds so far.
    reached: Reached,
    /// Position, velocity and acceleration of each joint within the cell.
    state: Vec<[Interval; 3]>,
    /// Torques of the joints within the cell without those that the motors take themselves.
    links: Vec<Interval>,
    /// Torques that the motors take themselves, at the motors.
    motors: Vec<Interval>,
    /// Torques of the joints.
    tau: Vec<Interval>,
    jacobian: Vec<[f64; 3]>,
}

impl<'a> Proof<'a> {
    /// Creates the bounds of the start, at rest.
    fn new(
        frame: &'a Frame,
        motions: &'a [JointMotion],
        chain: &'a Chain<Interval>,
    ) -> Result<Self, ExciteError> {
        let n = motions.len();
        let mut rows: Option<Vec<[Interval; COLUMNS]>> = frame
            .parameters
            .as_ref()
            .map(|rows| rows.iter().map(|row| row.map(Interval::from_f64)).collect());
        let mut parameters = Vec::new();
        if let Some(drives) = &frame.drives {
            let own = drives.parameters.chunks_exact(MOTOR_COLUMNS);
            parameters.extend(own.map(|p| [0, 1, 2].map(|c| Interval::from_f64(p[c]))));
            let mut parts = vec![[Interval::default(); 2]; n];
            let of_joints = drives.enclosing.joint_parts(&parameters, &mut parts);
            of_joints.map_err(SimulateError::from)?;
            for (row, [inertia, viscosity]) in rows.iter_mut().flatten().zip(parts) {
                row[column::DRIVE_INERTIA] -= inertia;
                row[column::VISCOUS] -= viscosity;
            }
        }
        let joints = motions
            .iter()
            .map(|m| Reach {
                position: [m.base, m.base],
                velocity: 0.0,
                acceleration: 0.0,
                torque: rows.as_ref().map(|_| 0.0),
            })
            .collect();
        let limited = frame.drives.as_ref().map_or(0, |d| d.limits.len());
        let motors = vec![
            MotorReach {
                position: [f64::INFINITY, f64::NEG_INFINITY],
                velocity: 0.0,
                torque: rows.as_ref().map(|_| 0.0),
            };
            limited
        ];
        Ok(Self {
            frame,
            chain,
            motions,
            trajectories: motions
                .iter()
                .map(|m| frame.schedule.trajectory(&m.coefficients))
                .collect(),
            rows,
            parameters,
            reached: Reached {
                joints,
                motors,
                combined: vec![[f64::INFINITY, f64::NEG_INFINITY]; frame.combined.len()],
                heights: vec![f64::INFINITY; frame.planes.len()],
            },
            state: vec![[Interval::default(); 3]; n],
            links: vec![Interval::default(); n],
            motors: vec![Interval::default(); n],
            tau: vec![Interval::default(); n],
            jacobian: vec![[0.0; 3]; n],
        })
    }

    /// Extends the bounds by all cells of a segment.
    fn cover(&mut self, segment: &Segment) -> Result<(), ExciteError> {
        let slack = self.slack(segment);
        let mut before: Vec<[f64; 3]> = (0..self.motions.len())
            .map(|j| self.at(segment, j, 0))
            .collect();
        let mut heights_before = self.heights_at(&before)?;
        for k in 1..=segment.cells {
            self.enclose(segment, k, &slack, &mut before);
            self.cover_cranks();
            self.cover_torques()?;
            self.cover_motors()?;
            if !self.frame.planes.is_empty() {
                let heights_now = self.heights_at(&before)?;
                self.cover_planes(segment.h, &heights_before, &heights_now);
                heights_before = heights_now;
            }
        }
        Ok(())
    }

    /// Returns per joint and order the largest deviation from a straight line within a cell.
    fn slack(&self, segment: &Segment) -> Vec<[f64; 3]> {
        let (omega, h) = (self.frame.schedule.omega(), segment.h);
        self.motions
            .iter()
            .map(|m| {
                [2, 3, 4].map(|order| {
                    derivative_bound(order, omega, &m.coefficients, segment.ramp) * h * h / 8.0
                })
            })
            .collect()
    }

    /// Returns position, velocity and acceleration of a joint at the end of cell `k`.
    fn at(&self, segment: &Segment, joint: usize, k: usize) -> [f64; 3] {
        // At the end of a segment the next one begins, continuously.
        let here = self.trajectories[joint].at(segment.from + segment.h * k as f64);
        [
            self.motions[joint].base + here.position,
            here.velocity,
            here.acceleration,
        ]
    }

    /// Returns the distance of each point along the normal of its plane.
    fn heights_at(&mut self, q: &[[f64; 3]]) -> Result<Vec<f64>, ExciteError> {
        let frame = self.frame;
        let q: Vec<f64> = q.iter().map(|state| state[0]).collect();
        let mut list = Vec::with_capacity(frame.planes.len());
        for plane in &frame.planes {
            let at = point_position(
                &frame.plain,
                &q,
                plane.link,
                plane.point,
                &mut self.jacobian,
            )?;
            list.push(plane.height(at));
        }
        Ok(list)
    }

    /// Encloses the motion within cell `k` and extends the joints' bounds; `before` moves on to the cell's end.
    fn enclose(
        &mut self,
        segment: &Segment,
        k: usize,
        slack: &[[f64; 3]],
        before: &mut [[f64; 3]],
    ) {
        for j in 0..before.len() {
            let now = self.at(segment, j, k);
            for d in 0..3 {
                self.state[j][d] = Interval::hull(before[j][d], now[d]).widened(slack[j][d]);
            }
            before[j] = now;
            let reach = &mut self.reached.joints[j];
            let [q, qd, qdd] = self.state[j];
            reach.position[0] = reach.position[0].min(q.low);
            reach.position[1] = reach.position[1].max(q.high);
            reach.velocity = reach.velocity.max(qd.magnitude());
            reach.acceleration = reach.acceleration.max(qdd.magnitude());
        }
    }

    /// Extends the bounds of the cranks by the cell.
    fn cover_cranks(&mut self) {
        let limits = &self.frame.combined;
        for ([low, high], limit) in self.reached.combined.iter_mut().zip(limits) {
            let mut sum = Interval::default();
            for (weight, s) in limit.weights.iter().zip(&self.state) {
                sum += Interval::from_f64(*weight) * s[0];
            }
            (*low, *high) = (low.min(sum.low), high.max(sum.high));
        }
    }

    /// Extends the bounds of the torques by the cell, if the prior parameters are known.
    fn cover_torques(&mut self) -> Result<(), ExciteError> {
        let Some(rows) = &self.rows else {
            return Ok(());
        };
        let [q, qd, qdd] = [0, 1, 2].map(|d| self.state.iter().map(|s| s[d]).collect::<Vec<_>>());
        inverse_dynamics(self.chain, rows, &q, &qd, &qdd, &mut self.links)?;
        self.tau.copy_from_slice(&self.links);
        if let Some(drives) = &self.frame.drives {
            let t = &drives.enclosing;
            t.own_motor_torque(&self.parameters, &q, &qd, &qdd, &mut self.motors)
                .map_err(SimulateError::from)?;
            let mut turned = vec![Interval::default(); q.len()];
            t.joint_torque(&q, &self.motors, &mut turned)
                .map_err(SimulateError::from)?;
            for (total, of_motors) in self.tau.iter_mut().zip(&turned) {
                *total += *of_motors;
            }
        }
        for (reach, t) in self.reached.joints.iter_mut().zip(&self.tau) {
            reach.torque = reach.torque.map(|most| most.max(t.magnitude()));
        }
        Ok(())
    }

    /// Extends the bounds of limited motors by the cell. The torques of the joints are those of the cell.
    fn cover_motors(&mut self) -> Result<(), ExciteError> {
        let Some(drives) = self.frame.drives.as_ref().filter(|d| !d.limits.is_empty()) else {
            return Ok(());
        };
        let wrong = |e| ExciteError::from(SimulateError::from(e));
        let [q, qd] = [0, 1].map(|d| self.state.iter().map(|s| s[d]).collect::<Vec<_>>());
        let mut values = vec![Interval::default(); q.len()];
        let t = &drives.enclosing;
        t.motor_position(&q, &mut values).map_err(wrong)?;
        for (reach, angle) in self.reached.motors.iter_mut().zip(&values) {
            reach.position[0] = reach.position[0].min(angle.low);
            reach.position[1] = reach.position[1].max(angle.high);
        }
        t.motor_velocity(&q, &qd, &mut values).map_err(wrong)?;
        for (reach, speed) in self.reached.motors.iter_mut().zip(&values) {
            reach.velocity = reach.velocity.max(speed.magnitude());
        }
        if self.rows.is_some() {
            let carried = drives.enclosed_torques(&q, &self.links)?;
            let torques = carried.iter().zip(&self.motors).map(|(x, own)| *x + *own);
            for (reach, torque) in self.reached.motors.iter_mut().zip(torques) {
                reach.torque = reach.torque.map(|most| most.max(torque.magnitude()));
            }
        }
        Ok(())
    }

    /// Extends the bounds of the points' distances by a cell of length `h` between two instants.
    fn cover_planes(&mut self, h: f64, before: &[f64], now: &[f64]) {
        for (p, plane) in self.frame.planes.iter().enumerate() {
            let bend = plane.acceleration_bound(&self.state) * h * h / 8.0;
            let lowest = before[p].min(now[p]) - bend;
            // Allow for rounding errors of sums of a few lengths.
            let heights = &mut self.reached.heights;
            heights[p] = heights[p].min(lowest - 1e-12 * plane.reach);
        }
    }
}
