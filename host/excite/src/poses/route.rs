//! The order of poses, and the moves between them.

use super::space::{Pose, Space};
use crate::ExciteError;
use crate::interval::Interval;
use crate::quintic_move::move_time;

/// Number of pieces of a move for the proof that points stay within their regions.
const PIECES: usize = 256;
/// Cost of a move that leaves a region, s: above any move that does not.
const BLOCKED: f64 = 1e6;

/// Moves between all pairs of poses.
pub(super) struct Moves {
    /// Shortest time, s; [`BLOCKED`] if the straight way between the poses leaves a region.
    times: Vec<Vec<f64>>,
}

impl Moves {
    /// Computes the moves between poses on straight lines of the joint positions.
    pub(super) fn of(space: &Space<'_>, poses: &[Pose]) -> Result<Self, ExciteError> {
        let n = poses.len();
        let mut times = vec![vec![0.0; n]; n];
        for i in 0..n {
            for k in 0..i {
                let time = if stays_inside(space, &poses[i].q, &poses[k].q)? {
                    time_between(space, &poses[i].q, &poses[k].q)
                } else {
                    BLOCKED
                };
                (times[i][k], times[k][i]) = (time, time);
            }
        }
        Ok(Self { times })
    }

    /// Returns the longest move of a closed tour, and its cost: as the moves of a staircase last equally long, the
    /// longest one counts for all of them, and the sum decides between equal ones.
    fn cost(&self, tour: &[usize]) -> (f64, f64) {
        let next = tour.iter().cycle().skip(1);
        let legs = tour.iter().zip(next).map(|(i, k)| self.times[*i][*k]);
        let (longest, sum) = legs.fold((0.0_f64, 0.0), |(most, sum), t| (most.max(t), sum + t));
        (longest, tour.len() as f64 * longest + sum)
    }

    /// Returns a short closed tour of all poses that begins with the first, and its longest move, s; `None` if each
    /// tour that was tried leaves a region. Nearest neighbours from every pose, then 2-opt (Croes 1958).
    pub(super) fn tour(&self) -> Option<(Vec<usize>, f64)> {
        let n = self.times.len();
        let mut best: Option<(f64, Vec<usize>)> = None;
        for first in 0..n {
            let tour = self.untangled(self.nearest_neighbours(first));
            let (_, cost) = self.cost(&tour);
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, tour));
            }
        }
        let (_, mut tour) = best?;
        let at = tour.iter().position(|k| *k == 0)?;
        tour.rotate_left(at);
        let (longest, _) = self.cost(&tour);
        (longest < BLOCKED).then_some((tour, longest))
    }

    fn nearest_neighbours(&self, first: usize) -> Vec<usize> {
        let mut tour = vec![first];
        let mut left: Vec<usize> = (0..self.times.len()).filter(|k| *k != first).collect();
        let mut here = first;
        while let Some(at) = (0..left.len())
            .min_by(|a, b| self.times[here][left[*a]].total_cmp(&self.times[here][left[*b]]))
        {
            here = left.remove(at);
            tour.push(here);
        }
        tour
    }

    fn untangled(&self, mut tour: Vec<usize>) -> Vec<usize> {
        let (_, mut least) = self.cost(&tour);
        loop {
            let mut gained = false;
            for i in 0..tour.len() {
                for k in i + 1..tour.len() {
                    tour[i..=k].reverse();
                    let (_, cost) = self.cost(&tour);
                    if cost < least - 1e-9 {
                        (least, gained) = (cost, true);
                    } else {
                        tour[i..=k].reverse();
                    }
                }
            }
            if !gained {
                return tour;
            }
        }
    }
}

/// Returns the shortest time of a straight move within the limits of all joints, s.
fn time_between(space: &Space<'_>, from: &[f64], to: &[f64]) -> f64 {
    let joints = space.bounds.iter().zip(from.iter().zip(to));
    joints
        .map(|(b, (from, to))| {
            let acceleration = b.acceleration.unwrap_or(f64::INFINITY);
            move_time((to - from).abs(), b.velocity, acceleration)
        })
        .fold(0.0, f64::max)
}

/// Returns true if all points of the regions provably stay inside on a straight move: between the ends of a piece of
/// length h a point is below their chord by at most h²/8 times the bound of its second derivative.
fn stays_inside(space: &Space<'_>, from: &[f64], to: &[f64]) -> Result<bool, ExciteError> {
    let h = 1.0 / PIECES as f64;
    let at = |share: f64| -> Vec<f64> {
        let ends = from.iter().zip(to);
        ends.map(|(a, b)| a + share * (b - a)).collect()
    };
    for plane in &space.planes {
        let mut before = space.height(plane, from)?;
        for piece in 0..PIECES {
            let (begin, end) = (at(h * piece as f64), at(h * (piece + 1) as f64));
            let state: Vec<[Interval; 3]> = (begin.iter().zip(&end))
                .map(|(a, b)| {
                    let speed = (b - a) / h;
                    [
                        Interval::hull(*a, *b),
                        Interval::hull(speed, speed),
                        Interval::default(),
                    ]
                })
                .collect();
            let now = space.height(plane, &end)?;
            let bend = plane.acceleration_bound(&state) * h * h / 8.0;
            if before.min(now) - bend < plane.least {
                return Ok(false);
            }
            before = now;
        }
    }
    Ok(true)
}
