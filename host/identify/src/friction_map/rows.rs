//! The rows of a sweep and their means over passes.

use super::map::{DroppedPass, FrictionMapOptions, FrictionPoint};
use super::passes::{Signal, Stretch, slope};
use rig_numerics::autocorrelation::Autocorrelation;
use rig_numerics::statistics;

/// All rows of a sweep, moving or not.
#[derive(Clone, Default)]
pub(super) struct Rows {
    pub(super) position: Signal,
    /// Filtered speed, rad/s or m/s.
    pub(super) speed: Vec<f64>,
    /// Torque, N·m or N.
    pub(super) tau: Vec<f64>,
    /// Torque of the identified model without the joint's own friction, N·m or N.
    pub(super) model: Vec<f64>,
    /// The same with the joint's own friction.
    pub(super) whole: Vec<f64>,
    /// Torque of the identified model at rest: gravity and the constant torque, N·m or N.
    pub(super) weight: Vec<f64>,
    pub(super) saturated: Vec<bool>,
    pub(super) unsettled: Vec<bool>,
}

/// Number of parts of a pass; the joint must advance in each.
pub(super) const PARTS: usize = 10;

impl Rows {
    /// Returns the points of all passes, sorted by speed, and the dropped passes.
    pub(super) fn points(
        &self,
        stretches: &[Stretch],
        options: &FrictionMapOptions,
    ) -> (Vec<FrictionPoint>, Vec<DroppedPass>) {
        let (mut points, mut dropped) = (Vec::new(), Vec::new());
        for stretch in stretches {
            match self.point(stretch, options) {
                Ok(point) => points.push(point),
                Err(why) => dropped.push(DroppedPass {
                    speed: stretch.speed,
                    start: stretch.from,
                    duration: stretch.to - stretch.from,
                    why,
                }),
            }
        }
        points.sort_by(|a, b| a.speed.total_cmp(&b.speed));
        (points, dropped)
    }

    /// Returns the mean of a pass, or the reason why it has none.
    fn point(&self, pass: &Stretch, options: &FrictionMapOptions) -> Result<FrictionPoint, String> {
        let t = &self.position.t;
        let duration = pass.to - pass.from;
        let settle = options.settle.max(options.settle_share * duration);
        let first = t.partition_point(|t| *t < pass.from + settle);
        // The position filter also spreads the motion after a pass into its end.
        let end = t.partition_point(|t| *t <= pass.to - options.settle);
        let rows = first..end.max(first);
        let left = match rows.clone().next_back() {
            Some(last) => t[last] - t[first],
            None => 0.0,
        };
        // Rows at 100 Hz cover up to a tenth less than the time between the ends.
        if rows.len() < PARTS {
            return Err(format!(
                "{} rows are left after {settle:.3} s of settling and at the ends of the recording, less than {PARTS}",
                rows.len()
            ));
        }
        if left < 0.85 * options.shortest {
            return Err(format!(
                "{left:.3} s are left after {settle:.3} s of settling and at the ends of the recording, less than {:.3} s",
                options.shortest
            ));
        }
        for (marks, what) in [
            (&self.saturated, "the torque is at its limit"),
            (
                &self.unsettled,
                "the current was read before its amplifier had settled",
            ),
        ] {
            let marked = marks[rows.clone()].iter().filter(|s| **s).count();
            if marked > 0 {
                return Err(format!("{what} in {marked} of {} rows", rows.len()));
            }
        }
        let x = &self.position.x;
        let speed = slope(&t[rows.clone()], &x[rows.clone()])
            .ok_or_else(|| "its rows have one time".to_owned())?;
        // Ten rows have nine intervals.
        let parts = PARTS.min(rows.len() - 1);
        let edge = |part: usize| first + part * (rows.len() - 1) / parts;
        let stopped = (0..parts)
            .filter(|part| (x[edge(part + 1)] - x[edge(*part)]) * pass.speed <= 0.0)
            .count();
        if stopped > 0 {
            return Err(format!(
                "the joint stands or turns back in {stopped} of its {parts} parts (it sticks and slips, or does not follow)"
            ));
        }
        let friction: Vec<f64> = (self.tau[rows.clone()].iter())
            .zip(&self.model[rows.clone()])
            .map(|(tau, model)| tau - model)
            .collect();
        let (mean, std) = mean_with_std(&friction);
        Ok(FrictionPoint {
            speed,
            friction: mean,
            std,
            start: pass.from,
            duration,
            rows: (rows.start, rows.end),
        })
    }
}

/// Returns the means over tenths.
pub(super) fn tenths(values: &[f64]) -> [f64; PARTS] {
    std::array::from_fn(|part| {
        let edge = |part: usize| part * values.len() / PARTS;
        let own = &values[edge(part)..edge(part + 1)];
        statistics::mean_or_zero(own)
    })
}

/// Returns the mean and its standard deviation: the larger of the one from the correlation of rows and the one from the
/// means of the tenths. The second detects slow changes over the pass.
fn mean_with_std(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = statistics::mean(values);
    let mut memory = Autocorrelation::default();
    let mut squares = 0.0;
    for value in values {
        memory.push(value - mean);
        squares += (value - mean).powi(2);
    }
    let by_rows = (squares / n * memory.correlation_time() / n).sqrt();
    let tenths = tenths(values);
    let spread = statistics::squares_about_mean(&tenths);
    let by_tenths = (spread / (PARTS * (PARTS - 1)) as f64).sqrt();
    (mean, by_rows.max(by_tenths))
}
