//! Coupled drives and cranks in a design: motor columns, motor torque, and limits on combinations of joints.

use rig_shared::dual::Dual;
use rig_shared::scalar::Real;
use rig_shared::transmission::{MOTOR_COLUMNS, Transmission, TransmissionError, motor_column};

use crate::ExciteError;
use crate::bounds::Bounds;
use crate::interval::Interval;
use crate::lanes::L;
use crate::motor_limits::MotorBounds;
use crate::sign::SIGN_WIDTH;
use rig_model::robot::Robot;
use rig_model::simulate::{Motors, SimulateError};

/// Number of derivatives per pass over dual numbers.
const AT_ONCE: usize = 4;
type D = Dual<L, AT_ONCE>;

/// Largest number of passes in search of a bound of the motors' torques. In a cell of a proof the first one succeeds: the
/// ratios hardly change there.
const BOUNDING_PASSES: usize = 20;
/// Share by which a pass widens its bound, so that the next one lies strictly within it.
const INFLATION: f64 = 1e-3;
/// More than the relative rounding error of a sum of products of positive numbers, one for each joint.
const SUMS: f64 = 1e-14;

/// Drives that move several joints or have a varying ratio, for every scalar type of a design.
pub(super) struct Drives {
    pub plain: Transmission<f64>,
    pub lanes: Transmission<L>,
    dual: Transmission<D>,
    pub enclosing: Transmission<Interval>,
    /// Prior parameters, 3 per motor.
    pub parameters: Vec<f64>,
    /// Per motor, the speed within which the optimiser smooths the sign of its velocity.
    widths: Vec<f64>,
    /// Limits of the motors; empty if there are none.
    pub limits: Vec<MotorBounds>,
}

fn wrong(e: TransmissionError) -> ExciteError {
    SimulateError::from(e).into()
}

impl Drives {
    /// Returns the drives of a robot, with a share of their motors' speed limits; none if every drive moves its own
    /// joint at a constant ratio.
    pub(super) fn of(
        robot: &Robot,
        motors: Option<Motors>,
        bounds: &[Bounds],
        speed: f64,
    ) -> Result<Option<Self>, ExciteError> {
        let Some(motors) = motors else {
            return Ok(None);
        };
        let n = bounds.len();
        let mut directions = vec![0.0; n * n];
        motors
            .transmission
            .motor_directions(&robot.middle_position(), &mut directions)
            .map_err(wrong)?;
        let fastest = |row: &[f64]| -> f64 {
            row.iter()
                .zip(bounds)
                .map(|(d, b)| d.abs() * b.velocity)
                .sum()
        };
        Ok(Some(Self {
            widths: directions
                .chunks_exact(n)
                // A simple drive has no direction and no columns.
                .map(|row| (SIGN_WIDTH * fastest(row)).max(f64::MIN_POSITIVE.sqrt()))
                .collect(),
            limits: MotorBounds::all(robot, speed),
            plain: motors.transmission,
            lanes: robot.transmission_of().map_err(wrong)?,
            dual: robot.transmission_of().map_err(wrong)?,
            enclosing: robot.transmission_of().map_err(wrong)?,
            parameters: motors.parameters.as_flattened().to_vec(),
        }))
    }

    /// Computes the columns of the motors, n × 3n, with smoothed signs of their velocities.
    pub(super) fn columns(&self, state: [&[L]; 3], out: &mut [L]) -> Result<(), ExciteError> {
        smooth_columns(&self.lanes, state, &self.widths, out)
    }

    /// Adds the derivatives of Σ weight·column by positions, velocities and accelerations; `weights` is n × 3n.
    pub(super) fn add_gradient(
        &self,
        state: [&[L]; 3],
        weights: &[L],
        by: &mut [Vec<L>; 3],
    ) -> Result<(), ExciteError> {
        let n = state[0].len();
        let mut columns = vec![D::ZERO; n * n * MOTOR_COLUMNS];
        for first in (0..3 * n).step_by(AT_ONCE) {
            let lifted = [0, 1, 2].map(|order| -> Vec<D> {
                let lift = |(j, value): (usize, &L)| match (order * n + j)
                    .checked_sub(first)
                    .filter(|k| *k < AT_ONCE)
                {
                    Some(k) => D::variable(*value, k),
                    None => D::constant(*value),
                };
                state[order].iter().enumerate().map(lift).collect()
            });
            let [q, qd, qdd] = &lifted;
            smooth_columns(&self.dual, [q, qd, qdd], &self.widths, &mut columns)?;
            for k in 0..AT_ONCE.min(3 * n - first) {
                let (order, j) = ((first + k) / n, (first + k) % n);
                for (weight, column) in weights.iter().zip(&columns) {
                    by[order][j] += *weight * column.derivative[k];
                }
            }
        }
        Ok(())
    }
}

impl Drives {
    /// Returns an enclosure of the motors' torques x, Jᵀ·x = τ, for positions and joint torques within intervals; all
    /// numbers if the positions vary too much.
    ///
    /// With C = J⁻ᵀ at the middle position and E = 1 − C·Jᵀ, x = C·τ + E·x. A u > 0 with |C·τ| + |E|·u < u bounds |x|, motor
    /// by motor and whatever their units: |E| then has a spectral radius below 1, and |x| ≤ (1 − |E|)⁻¹·|C·τ| ≤ u (Neumaier
    /// 1990, sections 3.7 and 4.1). Elimination over intervals would need a pivot that is the same at all positions.
    pub(super) fn enclosed_torques(
        &self,
        q: &[Interval],
        tau: &[Interval],
    ) -> Result<Vec<Interval>, ExciteError> {
        let n = q.len();
        let inverse = self.middle_inverse(q)?;
        let mut jacobian = vec![Interval::default(); n * n];
        self.enclosing.jacobian(q, &mut jacobian).map_err(wrong)?;
        let c = |i: usize, j: usize| Interval::from_f64(inverse[i * n + j]);
        let mut rest = vec![0.0; n * n];
        let mut first = vec![Interval::default(); n];
        for i in 0..n {
            for j in 0..n {
                let mut entry = Interval::from_f64(f64::from(u8::from(i == j)));
                for k in 0..n {
                    // (Jᵀ)_kj = J_jk.
                    entry -= c(i, k) * jacobian[j * n + k];
                }
                rest[i * n + j] = entry.magnitude();
                first[i] += c(i, j) * tau[j];
            }
        }
        // |C·τ| + |E|·u, and the second term alone.
        let bounds = |u: &[f64]| -> [Vec<f64>; 2] {
            let products = rest.chunks_exact(n).map(|row| row.iter().zip(u));
            let spread = products.map(|row| row.map(|(e, u)| e * u).sum::<f64>() * (1.0 + SUMS));
            let spread: Vec<f64> = spread.collect();
            let whole = first.iter().zip(&spread);
            [whole.map(|(x, s)| x.magnitude() + s).collect(), spread]
        };
        let mut bound: Vec<f64> = first.iter().map(|x| x.magnitude()).collect();
        for _ in 0..BOUNDING_PASSES {
            let largest = bound.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            let wider = |u: &f64| u + INFLATION * (u + largest);
            bound = bound.iter().map(wider).collect();
            let [next, spread] = bounds(&bound);
            if next.iter().zip(&bound).all(|(next, bound)| next < bound) {
                let each = first.iter().zip(spread);
                return Ok(each.map(|(x, spread)| x.widened(spread)).collect());
            }
            bound = next;
        }
        Ok(vec![Interval::hull(f64::NEG_INFINITY, f64::INFINITY); n])
    }

    /// Returns J⁻ᵀ in the middle of the positions, n × n.
    fn middle_inverse(&self, q: &[Interval]) -> Result<Vec<f64>, ExciteError> {
        let n = q.len();
        let middle: Vec<f64> = q.iter().map(|x| 0.5 * (x.low + x.high)).collect();
        let mut inverse = vec![0.0; n * n];
        let (mut unit, mut column) = (vec![0.0; n], vec![0.0; n]);
        for j in 0..n {
            unit.fill(0.0);
            unit[j] = 1.0;
            let solved = self.plain.motor_torque(&middle, &unit, &mut column);
            solved.map_err(wrong)?;
            for i in 0..n {
                inverse[i * n + j] = column[i];
            }
        }
        Ok(inverse)
    }
}

/// Computes the columns with Coulomb friction on s/√(s² + width²) instead of the sign of s.
fn smooth_columns<T: Real>(
    transmission: &Transmission<T>,
    [q, qd, qdd]: [&[T]; 3],
    widths: &[f64],
    out: &mut [T],
) -> Result<(), ExciteError> {
    let n = q.len();
    transmission.motor_columns(q, qd, qdd, out).map_err(wrong)?;
    let mut speeds = vec![T::ZERO; n];
    let mut directions = vec![T::ZERO; n * n];
    transmission
        .motor_speeds(q, qd, &mut speeds)
        .map_err(wrong)?;
    transmission
        .motor_directions(q, &mut directions)
        .map_err(wrong)?;
    for (k, (speed, width)) in speeds.iter().zip(widths).enumerate() {
        let sign = *speed / (speed.squared() + T::from_f64(width * width)).sqrt();
        for i in 0..n {
            out[(i * n + k) * MOTOR_COLUMNS + motor_column::COULOMB] = directions[k * n + i] * sign;
        }
    }
    Ok(())
}

/// A crank's range: a limit on Σ c_j·q_j.
pub(super) struct Combined {
    /// c, one per joint.
    pub weights: Vec<f64>,
    pub low: f64,
    pub high: f64,
    /// The joint named in errors: that of the drive.
    pub joint: usize,
}

impl Combined {
    pub(super) fn of(robot: &Robot) -> Vec<Self> {
        let cranks = robot.joints.iter().enumerate().filter(|(_, j)| {
            let screw = j.drive.as_ref().and_then(|d| d.screw.as_ref());
            screw.is_some_and(|s| s.range.is_some())
        });
        cranks
            .zip(robot.combined_limits())
            .map(|((joint, _), (weights, [low, high]))| Self {
                weights,
                low,
                high,
                joint,
            })
            .collect()
    }

    pub(super) fn at(&self, q: impl Iterator<Item = f64>) -> f64 {
        self.weights.iter().zip(q).map(|(c, x)| c * x).sum()
    }

    pub(super) fn half(&self) -> f64 {
        0.5 * (self.high - self.low)
    }

    pub(super) fn middle(&self) -> f64 {
        0.5 * (self.high + self.low)
    }
}

/// Moves `q` by the smallest steps, one crank after the other, until each is within `share` of its range about the
/// middle. Several rounds, because cranks share joints.
pub(super) fn into_cranks(combined: &[Combined], q: &mut [f64], share: f64) {
    for _ in 0..20 {
        for limit in combined {
            let square: f64 = limit.weights.iter().map(|c| c * c).sum();
            let now = limit.at(q.iter().copied()) - limit.middle();
            let within = now.clamp(-share * limit.half(), share * limit.half());
            if square > 0.0 {
                for (x, c) in q.iter_mut().zip(&limit.weights) {
                    *x += (within - now) * c / square;
                }
            }
        }
    }
}
