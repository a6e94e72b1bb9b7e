//! The simulated closed-loop motion of an identified model, in step with the recording.

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;
use rig_shared::multibody::{COLUMNS, Chain};
use rig_shared::transmission::{DriveKind, MOTOR_COLUMNS};

use super::problem::Problem;
use super::twin::Companion;
use crate::added_torque::added_torque;
use crate::bodies::consistent::consistent;
use crate::bodies::prior::Prior;
use crate::bodies::quadratic::Quadratic;
use crate::error::IdentifyError;
use crate::estimator::Estimator;
use crate::rows::factor::TriangularFactor;
use rig_data::prepare::{LowPass, PrepareError, first_block};
use rig_data::{Block, JUDGED_ROWS, strange_references};
use rig_model::effects::Effects;
use rig_model::robot::{Controller, Robot};
use rig_model::simulate::{Model, Motors, Stepper};

/// Number of rows in the parabola that gives the initial state of a stretch.
const FIRST_ROWS: usize = 21;
/// Simulation steps per sample.
const SUBSTEPS: u32 = 4;
/// Cut-off of the substitute for a missing reference, as a multiple of the highest frequency of the motion.
const SMOOTHING: f64 = 1.5;

/// Source of a motion without measurement noise.
pub(crate) enum Source {
    /// Model and described controllers, driven by the recorded reference.
    Loop(Vec<Controller>),
    /// The recorded reference itself, which an ideal computed-torque controller follows.
    Reference,
    /// The measured position after a low-pass close to the motion.
    Smoothed(LowPass),
}

/// Usability of the recorded references.
#[derive(Clone, Copy, PartialEq, Eq)]
enum References {
    /// Some are missing.
    Missing,
    /// All are present; some have another unit or sense than their positions.
    Strange,
    /// All are present.
    Usable,
}

impl References {
    fn of(problem: &Problem) -> Result<Self, IdentifyError> {
        let mut found = Self::Usable;
        for recording in problem.sources {
            let Some(block) = first_block(*recording, JUDGED_ROWS)? else {
                continue;
            };
            if block.joints.iter().any(|j| j.reference.is_none()) {
                return Ok(Self::Missing);
            }
            if !strange_references(&block, problem.robot).is_empty() {
                found = Self::Strange;
            }
        }
        Ok(found)
    }
}

fn stated_controllers(problem: &Problem) -> Option<Vec<Controller>> {
    let joints = problem.robot.joints.iter();
    joints.map(|j| j.controller.clone()).collect()
}

const LOOP: &str = "the closed loop of the identified model and the description's controllers, driven by the recorded reference";

impl Source {
    /// Returns the closed loop of description and recordings, and a text about it.
    ///
    /// # Errors
    /// [`IdentifyError::NoLoop`] if they define none, [`IdentifyError::StrangeReference`] if the references do not
    /// match the motion and the estimator that needs them was not requested by name.
    pub(crate) fn closed_loop(problem: &Problem) -> Result<(Self, String), IdentifyError> {
        let references = References::of(problem)?;
        match (references, stated_controllers(problem)) {
            (References::Missing, _) | (_, None) => Err(IdentifyError::NoLoop),
            (References::Strange, _) if problem.options.estimator != Estimator::OutputError => {
                Err(IdentifyError::StrangeReference)
            }
            (_, Some(controllers)) => Ok((Self::Loop(controllers), LOOP.into())),
        }
    }

    /// Returns the best source that description and recordings allow, and a text about it.
    pub(crate) fn of(problem: &Problem) -> Result<(Self, String), IdentifyError> {
        let references = References::of(problem)?;
        if references == References::Usable {
            if let Some(controllers) = stated_controllers(problem) {
                return Ok((Self::Loop(controllers), LOOP.into()));
            }
            return Ok((
                Self::Reference,
                "the recorded reference, which the loop of the identified model and a computed-torque controller designed from it follows (the description has no [joint.controller] for every joint)".into(),
            ));
        }
        let treatment = problem.plan.treatment;
        let cutoff = (SMOOTHING * treatment.motion_frequency).min(0.8 * treatment.cutoff);
        let low_pass =
            LowPass::butterworth(4, cutoff, treatment.sample_rate).ok_or(PrepareError::Cutoff {
                cutoff,
                rate: treatment.sample_rate,
                nyquist: treatment.sample_rate / 2.0,
            })?;
        Ok((
            Self::Smoothed(low_pass),
            format!(
                "the measured position behind a low-pass of {cutoff:.3} Hz, because {}; noise below that frequency is still in it",
                match references {
                    References::Strange =>
                        "the recorded references (columns ref<k>) are in another unit or sense than the positions",
                    _ => "the recordings have no reference (columns ref<k>)",
                }
            ),
        ))
    }
}

/// Returns the physically consistent model nearest to values of the base columns, in the metric of the data.
pub(crate) fn nearest(
    problem: &Problem,
    factor: &TriangularFactor,
    prior: &Prior,
    full: &[f64],
) -> Result<Vec<f64>, IdentifyError> {
    let (r, _) = factor.system();
    let right = &r * DVector::from_column_slice(full);
    let data = Quadratic {
        matrix: r * &problem.base.combination,
        right,
    };
    Ok(consistent(&data, prior)?.parameters)
}

/// Builds a model for simulation from standard parameters, with the drives of `robot`.
///
/// # Errors
/// [`IdentifyError::Model`] if the drives are no valid transmission.
pub(crate) fn model_of(
    robot: &Robot,
    chain: &Chain<f64>,
    standard: &[f64],
) -> Result<Model, IdentifyError> {
    let (joints, motors) = standard.split_at(robot.link_count() * COLUMNS);
    let motors = if robot.drive_kinds().iter().all(|k| *k == DriveKind::Simple) {
        None
    } else {
        Some(Motors {
            transmission: robot
                .transmission()
                .map_err(|e| IdentifyError::Model(e.to_string()))?,
            parameters: motors.as_chunks::<MOTOR_COLUMNS>().0.to_vec(),
        })
    };
    Model::assembled(
        robot,
        chain.clone(),
        joints.as_chunks::<COLUMNS>().0.to_vec(),
        motors,
    )
    .map_err(|e| IdentifyError::Model(e.to_string()))
}

/// Block-by-block simulation; the state carries over if a block continues the previous one.
pub(crate) struct LoopMotion<'a> {
    robot: &'a Robot,
    controllers: &'a [Controller],
    stepper: Stepper<'a>,
    effects: &'a Effects,
    period: f64,
    state: Option<(Vec<f64>, Vec<f64>)>,
}

impl<'a> LoopMotion<'a> {
    /// Creates the simulation of a recording sampled every `period` seconds.
    pub(crate) fn new(
        robot: &'a Robot,
        controllers: &'a [Controller],
        model: &'a Model,
        period: f64,
    ) -> Result<Self, IdentifyError> {
        Ok(Self {
            robot,
            controllers,
            stepper: Stepper::new(model).map_err(|e| IdentifyError::Simulation(e.to_string()))?,
            effects: &model.effects,
            period,
            state: None,
        })
    }
}

fn stopped(e: impl std::fmt::Display) -> PrepareError {
    PrepareError::Stopped(format!("The identified model cannot be simulated: {e}"))
}

fn references(block: &Block) -> Result<Vec<&Vec<f64>>, PrepareError> {
    block
        .joints
        .iter()
        .enumerate()
        .map(|(j, joint)| {
            joint
                .reference
                .as_ref()
                .ok_or_else(|| stopped(format!("column ref{} is missing.", j + 1)))
        })
        .collect()
}

impl Companion for LoopMotion<'_> {
    fn positions(&mut self, block: &Block) -> Result<Vec<Vec<f64>>, PrepareError> {
        let n = block.joints.len();
        let rows = block.len();
        let reference = references(block)?;
        let mut words = Vec::new();
        let added: Vec<Vec<f64>> = (0..n)
            .map(|j| added_torque(block, j, self.controllers, rows, &mut words))
            .collect();
        let (mut q, mut v) = match self.state.take() {
            Some(state) if block.continues => state,
            _ => first_state(block, self.period),
        };
        let mut positions = vec![Vec::with_capacity(rows); n];
        let mut torque = vec![0.0; n];
        let mut errors = vec![[0.0; 2]; n];
        let dt = self.period / f64::from(SUBSTEPS);
        for k in 0..rows {
            self.effects
                .position_errors(&q, &v, &mut errors)
                .map_err(stopped)?;
            for i in 0..n {
                let c = &self.controllers[i];
                let wish = c.torque_gain
                    * c.velocity_gain
                    * (c.position_gain * (reference[i][k] - q[i] - errors[i][0])
                        - v[i]
                        - errors[i][1])
                    + added[i][k];
                let limit = self.robot.joints[i]
                    .limits
                    .as_ref()
                    .and_then(|l| l.torque)
                    .unwrap_or(f64::INFINITY);
                torque[i] = wish.max(-limit).min(limit);
                positions[i].push(q[i]);
                if !(q[i].is_finite() && torque[i].is_finite()) {
                    return Err(stopped(format!(
                        "its joint {} grew beyond all bounds at {:.3} s; the gains of [joint.controller] do not fit.",
                        self.robot.joints[i].name, block.t[k]
                    )));
                }
            }
            for _ in 0..SUBSTEPS {
                self.stepper
                    .step(&mut q, &mut v, &torque, &[], dt)
                    .map_err(stopped)?;
            }
        }
        self.state = Some((q, v));
        Ok(positions)
    }
}

/// The recorded reference.
pub(crate) struct ReferenceMotion;

impl Companion for ReferenceMotion {
    fn positions(&mut self, block: &Block) -> Result<Vec<Vec<f64>>, PrepareError> {
        Ok(references(block)?.into_iter().cloned().collect())
    }
}

/// Returns position and velocity at the first row of a stretch, from a parabola through its first rows.
fn first_state(block: &Block, period: f64) -> (Vec<f64>, Vec<f64>) {
    let rows = FIRST_ROWS.min(block.len());
    let a = DMatrix::from_fn(rows, 3, |i, power| (i as f64).powi(power as i32));
    let svd = Svd::of(a);
    block
        .joints
        .iter()
        .map(|joint| {
            let y = DVector::from_fn(rows, |i, _| joint.q[i]);
            let x = svd.solve(&y, 1e-12);
            (x[0], x[1] / period)
        })
        .unzip()
}
