//! Rows along the simulated motion of a model, and its distance from the measured one.

use super::closed::{LoopMotion, ReferenceMotion, Source, model_of};
use super::problem::Problem;
use super::twin::{Companion, Twin, each_pair};
use crate::error::IdentifyError;
use crate::rows::equation::Rows;

/// Passes rows along the simulated motion together with the measured ones, for `source` and the model `standard`.
pub(crate) fn each_simulated(
    problem: &Problem,
    source: &Source,
    standard: &[f64],
    take: &mut dyn FnMut(usize, &Rows, &Rows),
) -> Result<(), IdentifyError> {
    match source {
        Source::Loop(controllers) => {
            let model = model_of(problem.robot, problem.plan.chain, standard)?;
            let make = |r: usize| {
                let period = 1.0 / problem.surveys[r].sample_rate;
                Ok(
                    Box::new(LoopMotion::new(problem.robot, controllers, &model, period)?)
                        as Box<dyn Companion>,
                )
            };
            each_pair(problem, &Twin::Made(&make), take)
        }
        Source::Reference => {
            let make = |_: usize| Ok(Box::new(ReferenceMotion) as Box<dyn Companion>);
            each_pair(problem, &Twin::Made(&make), take)
        }
        Source::Smoothed(low_pass) => each_pair(problem, &Twin::Smoothed(low_pass.clone()), take),
    }
}

/// Distance between simulated and measured motion.
pub(crate) struct Drift {
    sums: Vec<[f64; 4]>,
}

impl Drift {
    pub(crate) fn new(joints: usize) -> Self {
        Self {
            sums: vec![[0.0; 4]; joints],
        }
    }

    pub(crate) fn push(&mut self, measured: &Rows, simulated: &Rows) {
        for (sum, (a, b)) in self
            .sums
            .iter_mut()
            .zip(measured.q.iter().zip(&simulated.q))
        {
            for (x, y) in a.iter().zip(b) {
                sum[0] += 1.0;
                sum[1] += x;
                sum[2] += x * x;
                sum[3] += (x - y).powi(2);
            }
        }
    }

    /// Returns the RMS distance of each joint, as a share of the motion's spread.
    fn shares<'a>(&'a self, problem: &'a Problem) -> impl Iterator<Item = (&'a str, f64)> {
        let joints = self.sums.iter().zip(&problem.robot.joints);
        joints.map(|([n, sum, squares, off], joint)| {
            let n = n.max(1.0);
            let spread = (squares / n - (sum / n).powi(2)).max(f64::MIN_POSITIVE);
            (joint.name.as_str(), (off / n / spread).sqrt())
        })
    }

    /// Returns the joint with the largest distance.
    pub(crate) fn farthest<'a>(&'a self, problem: &'a Problem) -> Option<(&'a str, f64)> {
        self.shares(problem).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    pub(crate) fn words(&self, problem: &Problem) -> String {
        let shares: Vec<String> = self
            .shares(problem)
            .map(|(joint, share)| format!("{joint} {:.2} %", 100.0 * share))
            .collect();
        format!(
            "RMS distance of that motion from the measured one, as a share of the motion's spread: {}.",
            shares.join(", ")
        )
    }
}
