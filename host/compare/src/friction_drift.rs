//! Friction that changes during a recording: a warm-up is the commonest reason why repeated identifications differ.
//!
//! What a joint's friction leaves is compared with the friction itself, in stretches of time: the scale of a stretch is
//! 1 + Σ f·r / Σ f², with the fitted friction f and the residual r of its rows. A straight line through the scales is
//! tested against their scatter (Student), so that noise and errors of the model that come back in each period count as
//! scatter.
//!
//! Leaves out: the shape of the change, and friction that changes back before the end. A torque constant that drifts
//! looks alike.

use rig_identify::{Base, Equation};
use rig_shared::multibody::{COLUMNS, column};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Width of the stretches of a short recording, s.
const WIDTH: f64 = 1.0;
/// Number of stretches at which each two become one.
const MOST: usize = 64;
/// Fewest stretches with a line through them.
const FEWEST: usize = 8;

/// Friction that changes in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Drift {
    /// Joint, from 0.
    pub joint: usize,
    /// Change of the scale of its friction from the first stretch to the last.
    pub change: f64,
    /// Standard deviation of the change.
    pub std: f64,
    /// RMS torque of the change over that of the joint's torque.
    pub share: f64,
    /// Probability of a line this steep without a change.
    pub p: f64,
}

/// Sums of a joint over stretches of the time since the start of each recording.
#[derive(Clone, Debug)]
pub(crate) struct Stretches {
    /// Places of its friction among the base parameters.
    friction: Vec<usize>,
    width: f64,
    /// Σ f² and Σ f·r.
    sums: Vec<[f64; 2]>,
    /// Σ y² of the torque y.
    torque: f64,
}

impl Stretches {
    /// Begins for joint `joint`, from 0.
    pub(crate) fn new(base: &Base, joint: usize) -> Self {
        let own = [column::VISCOUS, column::COULOMB].map(|c| joint * COLUMNS + c);
        Self {
            friction: (0..base.len())
                .filter(|&k| own.contains(&base.columns[k]))
                .collect(),
            width: WIDTH,
            sums: Vec::new(),
            torque: 0.0,
        }
    }

    /// Takes row `k` at `time` since the start of its recording, with the torque of `values`, the base parameters.
    pub(crate) fn push(&mut self, (equation, k): (&Equation, usize), values: &[f64], time: f64) {
        let row = &equation.x[k * values.len()..(k + 1) * values.len()];
        let all: f64 = row.iter().zip(values).map(|(x, value)| x * value).sum();
        let friction: f64 = self.friction.iter().map(|&c| row[c] * values[c]).sum();
        while time >= self.width * MOST as f64 {
            self.sums = (self.sums.chunks(2))
                .map(|pair| [0, 1].map(|c| pair.iter().map(|sum| sum[c]).sum()))
                .collect();
            self.width *= 2.0;
        }
        let place = (time / self.width).max(0.0) as usize;
        if self.sums.len() <= place {
            self.sums.resize(place + 1, [0.0; 2]);
        }
        self.torque += equation.y[k].powi(2);
        let sum = &mut self.sums[place];
        *sum = [
            sum[0] + friction * friction,
            sum[1] + friction * (equation.y[k] - all),
        ];
    }

    /// Returns the line through the scales of the stretches; `None` if there are too few.
    pub(crate) fn drift(&self, joint: usize) -> Option<Drift> {
        let points: Vec<[f64; 3]> = (self.sums.iter().enumerate())
            .filter(|(_, sum)| sum[0] > 0.0)
            .map(|(k, sum)| [(k as f64 + 0.5) * self.width, sum[1] / sum[0], sum[0]])
            .collect();
        if points.len() < FEWEST {
            return None;
        }
        let all: f64 = points.iter().map(|[.., w]| w).sum();
        let mean = |c: usize| points.iter().map(|p| p[2] * p[c]).sum::<f64>() / all;
        let (time, scale) = (mean(0), mean(1));
        let sum = |of: &dyn Fn(&[f64; 3]) -> f64| points.iter().map(|p| p[2] * of(p)).sum::<f64>();
        let along = sum(&|p| (p[0] - time).powi(2));
        let slope = sum(&|p| (p[0] - time) * (p[1] - scale)) / along;
        let left = sum(&|p| (p[1] - scale - slope * (p[0] - time)).powi(2));
        let freedom = (points.len() - 2) as f64;
        let deviation = (left / freedom / along).sqrt();
        let t = slope / deviation;
        let student = StudentsT::new(0.0, 1.0, freedom).ok()?;
        let span = points[points.len() - 1][0] - points[0][0];
        t.is_finite().then(|| Drift {
            joint,
            change: slope * span,
            std: deviation * span,
            share: (slope * span).abs() * (all / self.torque).sqrt(),
            p: 2.0 * student.sf(t.abs()),
        })
    }
}
