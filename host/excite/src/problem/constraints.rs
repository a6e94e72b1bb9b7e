//! Penalties of the limits on position, velocity, acceleration and points.

use rig_shared::multibody::point_position;

use super::penalty::{MARGIN, Pass, both_sides, penalty};
use super::state::Problem;
use crate::ExciteError;

impl Problem<'_> {
    /// Returns the penalties of position, velocity and acceleration.
    pub(super) fn kinematic(&mut self, pass: Pass) -> f64 {
        let mut sum = 0.0;
        let samples = self.basis.samples();
        for order in 0..3 {
            for (j, bounds) in self.frame.bounds.iter().enumerate() {
                let (middle, limit) = match order {
                    0 => (bounds.middle(), bounds.half()),
                    1 => (0.0, bounds.velocity),
                    _ => match bounds.acceleration {
                        Some(limit) => (0.0, limit),
                        None => continue,
                    },
                };
                let multipliers = &mut self.multipliers[order][j * samples..(j + 1) * samples];
                let motion = self.motion[order].column(j);
                let mut adjoint = self.adjoint[order].column_mut(j);
                for s in 0..samples {
                    let share = (motion[s] - middle) / limit;
                    let (value, force) = both_sides(share, &mut multipliers[s], self.weight, pass);
                    sum += value;
                    adjoint[s] += force / limit;
                }
            }
        }
        sum
    }

    /// Returns the penalties of the cranks' ranges.
    pub(super) fn cranks(&mut self, pass: Pass) -> f64 {
        let (n, samples) = (self.joints(), self.basis.samples());
        let mut sum = 0.0;
        for (number, limit) in self.frame.combined.iter().enumerate() {
            for s in 0..samples {
                let angle = limit.at((0..n).map(|j| self.motion[0][(s, j)]));
                let share = (angle - limit.middle()) / limit.half();
                let multipliers = &mut self.crank_multipliers[number * samples + s];
                let (value, force) = both_sides(share, multipliers, self.weight, pass);
                sum += value;
                for (j, weight) in limit.weights.iter().enumerate() {
                    self.adjoint[0][(s, j)] += force * weight / limit.half();
                }
            }
        }
        sum
    }

    /// Returns the penalties of the points that must stay within planes.
    pub(super) fn cartesian(&mut self, pass: Pass) -> Result<f64, ExciteError> {
        let (n, samples) = (self.joints(), self.basis.samples());
        let mut sum = 0.0;
        let mut jacobian = vec![[0.0; 3]; n];
        for (number, plane) in self.frame.planes.iter().enumerate() {
            for s in 0..samples {
                let q: Vec<f64> = (0..n).map(|j| self.motion[0][(s, j)]).collect();
                let at = point_position(
                    &self.frame.plain,
                    &q,
                    plane.link,
                    plane.point,
                    &mut jacobian,
                )?;
                let c = (plane.least - plane.height(at)) / plane.reach + MARGIN;
                let multiplier = &mut self.plane_multipliers[number * samples + s];
                let (value, force) = penalty(c, multiplier, self.weight, pass);
                sum += value;
                if force != 0.0 {
                    for (j, column) in jacobian.iter().enumerate() {
                        self.adjoint[0][(s, j)] -= force * plane.height(*column) / plane.reach;
                    }
                }
            }
        }
        Ok(sum)
    }
}
