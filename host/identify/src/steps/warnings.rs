//! Warnings of an identification.

use std::f64::consts::TAU;

use crate::estimators::fit::MOST_PASSES;
use crate::options::{ModelKind, Options};
use crate::treatment::cutoff;
use crate::uncertainty::estimate::Estimate;
use crate::uncertainty::residual::ResidualReport;
use crate::unmodelled::lag::Lag;
use rig_data::prepare::{PreprocessingPlan, Survey};
use rig_model::robot::{Joint, JointKind, Robot};
use rig_output::{Finding, format_significant, format_unit, one_a_kind};

/// Share of a joint's range below which its motion may be gear twist, by judgement: 0.4 degrees of a turn.
const CREEP: f64 = 1e-3;
/// Lead in samples above which it is questioned: drives and buses take a few.
const MOST_LED: f64 = 10.0;

/// Recordings and fit of an identification.
pub(crate) struct Heard<'a> {
    pub robot: &'a Robot,
    pub options: &'a Options,
    pub surveys: &'a [Survey],
    pub holdout_surveys: &'a [Survey],
    pub treatment: &'a PreprocessingPlan,
    /// Treatment of each hold-out recording.
    pub treatments: &'a [PreprocessingPlan],
    /// Samples between the windows of the integral model.
    pub stride: usize,
    pub lag: Option<Lag>,
    /// True if a robust fit converged.
    pub converged: bool,
    pub instants: u64,
    pub estimate: &'a Estimate,
    pub train: &'a [ResidualReport],
    pub holdout: Option<&'a [ResidualReport]>,
}

impl Heard<'_> {
    /// Returns the warnings, one or more sentences each.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let treatment = self.treatment;
        let mut warnings = cutoff::doubts(treatment, self.robot);
        warnings.extend(
            self.surveys
                .iter()
                .chain(self.holdout_surveys)
                .filter_map(|survey| survey.note.clone()),
        );
        for (survey, own) in self.holdout_surveys.iter().zip(self.treatments) {
            if own.sample_rate != treatment.sample_rate {
                warnings.push(format!(
                    "{} is sampled at {} Hz, the training data at {} Hz: its errors are of one row in {} and up to {:.3} Hz, those of the training data up to {:.3} Hz.",
                    survey.label, own.sample_rate, treatment.sample_rate, own.decimation, own.parallel_edge, treatment.parallel_edge
                ));
            }
        }
        warnings.extend(self.lag.map(|lag| lag.said(treatment.dt())));
        let led = treatment.torque_lead / treatment.dt();
        if led.abs() > MOST_LED {
            warnings.push(format!(
                "--torque-lead shifts the torque by {} samples, where a command that is held acts half a sample late: it is given in s.",
                format_significant(led, 3)
            ));
        }
        let row_period = match self.options.model {
            ModelKind::Differential => treatment.decimation,
            ModelKind::Integral => self.stride,
        } as f64
            * treatment.dt();
        if !self.converged {
            warnings.push(format!(
                "The robust fit had not settled after {MOST_PASSES} passes; its values may still move."
            ));
        }
        let groups = self.instants as f64 / (10.0 * self.estimate.memory_rows);
        if groups < 8.0 {
            warnings.push(format!(
                "The residuals remember {:.2} s, so the recording holds only {groups:.1} independent stretches; the intervals, formed from eight, may be too narrow. A longer recording would mend that.",
                self.estimate.memory_rows * row_period
            ));
        }
        if self.estimate.scaled_condition > 100.0 {
            warnings.push(format!(
                "The condition number of the scaled regressor is {:.0}: the motion tells some parameters apart badly; look at their intervals.",
                self.estimate.scaled_condition
            ));
        }
        let joints = self.train.iter().enumerate();
        let findings = joints.flat_map(|(j, report)| self.of_joint(j, report));
        warnings.extend(one_a_kind(findings.collect()));
        warnings
    }

    fn of_joint(&self, j: usize, report: &ResidualReport) -> Vec<Finding> {
        let name = &self.robot.joints[j].name;
        let (length, effort) = self.robot.joints[j].kind.units();
        if self.surveys.iter().all(|s| s.joints[j].still()) {
            let at = (self.surveys.first()).map_or(f64::NAN, |s| s.joints[j].position[0]);
            return vec![Finding {
                kind: "still",
                size: 0.0,
                sentence: format!(
                    "Joint {name} stands still at {at} {length} in all training recordings. Its torque was not used, because at rest friction or a brake carries any part of it: its friction, constant torque and drive inertia are those of the description or guesses, and its link counts as one with the link before it. Record a motion of it for more, or make it type=\"fixed\" in the URDF where it never moves."
                ),
                short: format!("{name} (at {at} {length})"),
            }];
        }
        let mut findings = Vec::new();
        if report.relative_error > 0.3 {
            let left = 100.0 * report.relative_error;
            findings.push(Finding {
                kind: "unexplained",
                size: left,
                sentence: format!(
                    "Joint {name}: the model leaves {left:.0} % of the torque unexplained on the data it was fitted to. Look at its zero, axis and lengths in the description, at the order of the columns, and at the robot for what no rigid model has."
                ),
                short: format!("{name} ({left:.0} %)"),
            });
        }
        if let Some(held) = self.holdout.map(|held| &held[j])
            && held.rms > 1.5 * report.rms
        {
            let times = held.rms / report.rms;
            let rms = format!(
                "{} {}",
                format_significant(held.rms, 4),
                format_unit(effort)
            );
            findings.push(Finding {
                kind: "worse on the hold-out",
                size: times,
                sentence: format!(
                    "Joint {name}: the residual on the hold-out ({rms}) is {times:.1} times that on the training data."
                ),
                short: format!("{name} ({rms}, {times:.1} times)"),
            });
        }
        findings.extend(self.unjudged(j, report));
        if let Some(way) = creep(&self.robot.joints[j], self.surveys, j).filter(|_| report.rows > 0)
        {
            findings.push(Finding {
                kind: "creep",
                size: 0.0,
                sentence: format!(
                    "Joint {name} moves by {way} in all training recordings, less than {CREEP} of its range. That may be no more than its drive or gear giving way: friction and inertia of such a motion are not those of one that turns the joint. Record a larger motion of it, or make it fixed in the description."
                ),
                short: format!("{name} ({way})"),
            });
        }
        findings
    }

    /// Reports a joint without usable rows for the fit or the judgement.
    fn unjudged(&self, j: usize, report: &ResidualReport) -> Vec<Finding> {
        let name = &self.robot.joints[j].name;
        let (length, _) = self.robot.joints[j].kind.units();
        let none_held = self.holdout.is_some_and(|held| held[j].rows == 0);
        let slowest = format_significant(self.treatment.speed_threshold[j], 2);
        let unjudged = |which: &str, kinds: [&'static str; 2], surveys: &[Survey]| {
            let noise = surveys
                .iter()
                .all(|s| s.joints[j].only_noise(s.sample_rate));
            let sentence = match noise {
                true => format!(
                    "Joint {name} stands still in the {which} but for the noise of its encoder: no row is faster than {slowest} {length}/s, so nothing is said of its torque there. Record a motion of it for more, or make it type=\"fixed\" in the URDF where it never moves."
                ),
                false => format!(
                    "Joint {name}: every row of the {which} was left out (slower than {slowest} {length}/s, or at the torque limit), so nothing is said of its torque there; look at its position for jumps, or give --min-speed."
                ),
            };
            Finding {
                kind: kinds[usize::from(noise)],
                size: 0.0,
                sentence,
                short: format!("{name} ({slowest} {length}/s)"),
            }
        };
        let trained = (report.rows == 0).then(|| {
            let kinds = ["no row", "noise alone"];
            unjudged("training data", kinds, self.surveys)
        });
        let held = none_held.then(|| {
            let kinds = ["no row held back", "noise alone held back"];
            unjudged("hold-out", kinds, self.holdout_surveys)
        });
        trained.into_iter().chain(held).collect()
    }
}

/// Describes the largest travel of the joint at `place` in any recording, if it only creeps.
fn creep(joint: &Joint, surveys: &[Survey], place: usize) -> Option<String> {
    let travel = surveys
        .iter()
        .map(|survey| survey.joints[place].position)
        .map(|[low, high]| high - low)
        .fold(0.0, f64::max);
    let limits = joint.limits.as_ref().map(|limits| limits.position);
    let range = limits.map_or(f64::INFINITY, |[low, high]| high - low);
    let (range, unit) = match joint.kind {
        JointKind::Revolute => (range.min(TAU), "rad"),
        JointKind::Prismatic => (range, "m"),
    };
    (range.is_finite() && travel < CREEP * range)
        .then(|| format!("{} {unit}", format_significant(travel, 2)))
}
