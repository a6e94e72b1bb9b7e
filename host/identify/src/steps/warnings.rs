//! Warnings of an identification.

use std::f64::consts::TAU;

use crate::estimators::fit::MOST_PASSES;
use crate::options::{ModelKind, Options};
use crate::treatment::cutoff;
use crate::uncertainty::estimate::Estimate;
use crate::uncertainty::residual::{LEAST_ERROR, ResidualReport};
use crate::unmodelled::lag::Lag;
use crate::warning::{AtJoint, JointFinding, LEAST_STRETCHES, MEMORIES, Part, Unsettled, Warning};
use rig_data::prepare::{PreprocessingPlan, Survey};
use rig_model::robot::{Joint, JointKind, Robot};

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
    /// Returns the warnings.
    pub(crate) fn warnings(&self) -> Vec<Warning> {
        let treatment = self.treatment;
        let mut warnings = cutoff::doubts(treatment, self.robot);
        let surveys = self.surveys.iter().chain(self.holdout_surveys);
        warnings
            .extend(surveys.filter_map(|survey| survey.note.clone().map(Warning::Interpolated)));
        for (survey, own) in self.holdout_surveys.iter().zip(self.treatments) {
            if own.sample_rate != treatment.sample_rate {
                warnings.push(Warning::OtherRate {
                    label: survey.label.clone(),
                    rates: [own.sample_rate, treatment.sample_rate],
                    decimation: own.decimation,
                    edges: [own.parallel_edge, treatment.parallel_edge],
                });
            }
        }
        warnings.extend(self.lag.map(|lag| {
            Warning::TorqueLead {
                joint: (lag.joint)
                    .filter(|_| self.robot.joints.len() > 1)
                    .map(|j| self.robot.joints[j].name.clone()),
                lead: lag.lead,
                sample: treatment.dt(),
            }
        }));
        let samples = treatment.torque_lead / treatment.dt();
        if samples.abs() > MOST_LED {
            warnings.push(Warning::LongLead { samples });
        }
        let row_period = match self.options.model {
            ModelKind::Differential => treatment.decimation,
            ModelKind::Integral => self.stride,
        } as f64
            * treatment.dt();
        if !self.converged {
            warnings.push(Warning::Unsettled {
                by: Unsettled::Robust,
                passes: MOST_PASSES,
                moved: None,
            });
        }
        let stretches = self.instants as f64 / (MEMORIES * self.estimate.memory_rows);
        // Rounding of a recording without noise has no memory that counts.
        let inexact = self
            .train
            .iter()
            .any(|own| own.relative_error > LEAST_ERROR);
        if stretches < LEAST_STRETCHES && inexact {
            warnings.push(Warning::FewStretches {
                memory: self.estimate.memory_rows * row_period,
                stretches,
            });
        }
        let condition = self.estimate.scaled_condition;
        if condition > 100.0 {
            warnings.push(Warning::IllConditioned { condition });
        }
        let joints = self.train.iter().enumerate();
        let findings = joints.flat_map(|(j, report)| {
            let joint = &self.robot.joints[j];
            let found = self.of_joint(j, report);
            found.into_iter().map(|what| JointFinding {
                joint: joint.name.clone(),
                units: joint.kind.units(),
                what,
            })
        });
        warnings.extend(Warning::of_joints(findings.collect()));
        warnings
    }

    fn of_joint(&self, j: usize, report: &ResidualReport) -> Vec<AtJoint> {
        if self.surveys.iter().all(|s| s.joints[j].still()) {
            let at = (self.surveys.first()).map_or(f64::NAN, |s| s.joints[j].position[0]);
            return vec![AtJoint::Still(at)];
        }
        let mut findings = Vec::new();
        if report.relative_error > 0.3 {
            findings.push(AtJoint::Unexplained(report.relative_error));
        }
        if let Some(held) = self.holdout.map(|held| &held[j])
            && held.rms > 1.5 * report.rms
            && held.relative_error > LEAST_ERROR
        {
            findings.push(AtJoint::WorseOnHoldout {
                rms: held.rms,
                times: held.rms / report.rms,
            });
        }
        findings.extend(self.unjudged(j, report));
        let creeping = creep(&self.robot.joints[j], self.surveys, j);
        findings.extend(creeping.filter(|_| report.rows > 0));
        findings
    }

    /// Reports a joint without usable rows for the fit or the judgement.
    fn unjudged(&self, j: usize, report: &ResidualReport) -> Vec<AtJoint> {
        let none_held = self.holdout.is_some_and(|held| held[j].rows == 0);
        let slowest = self.treatment.speed_threshold[j];
        let unjudged = |part: Part, surveys: &[Survey]| {
            let noise = surveys
                .iter()
                .all(|s| s.joints[j].only_noise(s.sample_rate));
            match noise {
                true => AtJoint::OnlyNoise { part, slowest },
                false => AtJoint::NoRow { part, slowest },
            }
        };
        let trained = (report.rows == 0).then(|| unjudged(Part::Training, self.surveys));
        let held = none_held.then(|| unjudged(Part::Holdout, self.holdout_surveys));
        trained.into_iter().chain(held).collect()
    }
}

/// Returns the largest travel of the joint at `place` in any recording, if it only creeps.
fn creep(joint: &Joint, surveys: &[Survey], place: usize) -> Option<AtJoint> {
    let travel = surveys
        .iter()
        .map(|survey| survey.joints[place].position)
        .map(|[low, high]| high - low)
        .fold(0.0, f64::max);
    let limits = joint.limits.as_ref().map(|limits| limits.position);
    let range = limits.map_or(f64::INFINITY, |[low, high]| high - low);
    let range = match joint.kind {
        JointKind::Revolute => range.min(TAU),
        JointKind::Prismatic => range,
    };
    (range.is_finite() && travel < CREEP * range).then_some(AtJoint::Creeps {
        travel,
        share: CREEP,
    })
}
