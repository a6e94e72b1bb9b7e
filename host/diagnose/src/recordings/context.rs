//! Constants of a diagnosis: the robot, its nominal model, the treatment of recordings.

use std::collections::HashMap;
use std::sync::Mutex;

use rig_shared::effects::{Channel, Instant, Kind, Memory};
use rig_shared::multibody::Chain;

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::effect_columns::{DELAY, Source};
use crate::description::described_effects::{DescribedEffects, candidate, gains};
use crate::description::parameter_prior::ParameterPrior;
use crate::faults::moves;
use crate::recordings::coherence;
use crate::rows::nominal::Nominal;
use crate::rows::nominal_torque::{Predicted, predict};
use crate::rows::one_way::OneWay;
use crate::rows::regression::{Column, Rows, combined, take_off};
use crate::search::fitted_candidate::FittedCandidate;
use rig_data::Compensated;
use rig_data::prepare::{
    Choice, LowPass, PrepareOptions, PreprocessingPlan, Recording, Survey, same_rate,
};
use rig_data::runs::{Run, runs_of};
use rig_model::effects::Effects;
use rig_model::robot::{JointKind, Robot};
use rig_numerics::statistics;

/// Least pass band before decimation for the waves of effects, Hz.
const LEAST_BAND: f64 = 30.0;

/// Prepared recordings under one treatment.
pub(crate) struct PreparedData {
    /// Recordings at the full rate.
    pub(crate) runs: Vec<Run>,
    /// Regression rows, without the torque of the held parameters.
    pub(crate) rows: Rows,
    /// Treatment of these recordings, at their own sample rate.
    pub(crate) treatment: PreprocessingPlan,
}

impl PreparedData {
    /// Returns the filter of positions before differentiation.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if the filter cannot be built.
    pub(crate) fn position_filter(&self) -> Result<LowPass, DiagnoseError> {
        position_filter(&self.treatment)
    }
}

/// Everything that is constant during a diagnosis.
pub(crate) struct DiagnosisContext<'a> {
    /// The given robot, without its effects.
    pub(crate) robot: &'a Robot,
    /// The described effects.
    pub(crate) stated: &'a DescribedEffects,
    /// Held effects whose torque is subtracted, and those of the rig without external loads.
    held: [Option<(Effects, Chain<f64>)>; 2],
    /// Base parameters of the robot.
    pub(crate) nominal: Nominal,
    /// Which of them are free.
    pub(crate) anchor: ParameterPrior,
    treatment: PreprocessingPlan,
    /// Joints whose rows near standstill are used; None before they are known.
    pub(crate) rests: Option<Vec<usize>>,
    /// Joints that move in one direction only. Their constant torques are held.
    pub(crate) one_way: Vec<OneWay>,
}

impl<'a> DiagnosisContext<'a> {
    /// Creates the context for a robot. The training recordings decide on the treatment of all.
    ///
    /// # Errors
    /// [`DiagnoseError`].
    pub(crate) fn of(
        stated: &'a DescribedEffects,
        training: &[&dyn Recording],
    ) -> Result<Self, DiagnoseError> {
        let robot = &stated.robot;
        let nominal = Nominal::of(robot)?;
        let anchor = ParameterPrior::of(robot, &nominal, stated);
        Ok(Self {
            robot,
            stated,
            held: [stated.taken_off(false)?, stated.taken_off(true)?],
            anchor,
            nominal,
            treatment: treatment_of(training, robot)?,
            rests: None,
            one_way: Vec::new(),
        })
    }

    /// Returns a base parameter's name. If a joint moves in one direction, its friction includes the constant.
    pub(crate) fn expression(&self, parameter: usize) -> String {
        let own = (self.one_way.iter()).find(|own| own.friction() == parameter);
        own.map_or_else(
            || self.nominal.base.expression(parameter),
            |own| own.named(self.anchor.prior[own.constant()]),
        )
    }

    /// Reads training recordings and subtracts the torque of held effects and parameters.
    ///
    /// # Errors
    /// [`DiagnoseError`].
    pub(crate) fn load(
        &self,
        recordings: &[&dyn Recording],
    ) -> Result<PreparedData, DiagnoseError> {
        self.prepared(recordings, &self.treatment)
    }

    /// The same for the hold-out, at its own sample rate.
    ///
    /// # Errors
    /// [`DiagnoseError`] for two sample rates, or for one that is too low for the band.
    pub(crate) fn load_held(
        &self,
        recordings: &[&dyn Recording],
    ) -> Result<PreparedData, DiagnoseError> {
        let joints = self.robot.joints.len();
        let mut own: Option<PreprocessingPlan> = None;
        for recording in recordings {
            let survey = Survey::take(*recording, joints)?;
            match &own {
                None => own = Some(self.treatment.at_rate_of(&survey)?),
                Some(treatment) => same_rate(&survey, treatment.sample_rate)?,
            }
        }
        self.prepared(recordings, own.as_ref().unwrap_or(&self.treatment))
    }

    fn prepared(
        &self,
        recordings: &[&dyn Recording],
        treatment: &PreprocessingPlan,
    ) -> Result<PreparedData, DiagnoseError> {
        let position = position_filter(treatment)?;
        let mut runs = Vec::new();
        for (k, &recording) in recordings.iter().enumerate() {
            let rate = treatment.sample_rate;
            runs.extend(match &self.held[usize::from(recording.unburdened())] {
                Some((effects, chain)) => {
                    let freed = Compensated::new(recording, effects, chain, treatment, false)?;
                    runs_of(&freed, k, rate, &position)?
                }
                None => runs_of(recording, k, rate, &position)?,
            });
        }
        self.rows(runs, treatment)
    }

    /// Returns the rows of runs, without the torque of the held parameters.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn rows(
        &self,
        runs: Vec<Run>,
        treatment: &PreprocessingPlan,
    ) -> Result<PreparedData, DiagnoseError> {
        let rows = self.rows_of(&runs, treatment, self.rests.as_deref())?;
        Ok(PreparedData {
            runs,
            rows,
            treatment: treatment.clone(),
        })
    }

    /// Returns the rows of prepared recordings with all samples near standstill, of a joint alone if one is given. Its rows near
    /// standstill are then used.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn rows_with_rests(
        &self,
        prepared: &PreparedData,
        joint: Option<usize>,
    ) -> Result<Rows, DiagnoseError> {
        self.rows_of(
            &prepared.runs,
            &prepared.treatment,
            joint.as_ref().map(std::slice::from_ref),
        )
    }

    /// Returns rows, with the samples near standstill of the joints `rests`. None: with those of all joints, whose rows near
    /// standstill are not used.
    fn rows_of(
        &self,
        runs: &[Run],
        treatment: &PreprocessingPlan,
        rests: Option<&[usize]>,
    ) -> Result<Rows, DiagnoseError> {
        // Where a joint moves in one direction only, so does friction.
        let one_way = |joint| self.one_way.iter().any(|own| own.joint == joint);
        let count = |joint| rests.is_none_or(|rests| rests.contains(&joint) || one_way(joint));
        let mut rows = Rows::of(runs, &self.nominal, treatment, &count)?;
        let held = self.anchor.held_torque(&rows);
        take_off(&mut rows.torque, &held);
        for &joint in rests.into_iter().flatten() {
            rows.use_rests(joint);
        }
        for own in &self.one_way {
            own.leave_out_rests(&mut rows);
        }
        Ok(rows)
    }

    /// Returns the sample rate of the training data, Hz.
    pub(crate) fn rate(&self) -> f64 {
        self.treatment.sample_rate
    }

    /// Returns true if the nominal model fits a constant torque of a joint, whatever external load acts. A spring's
    /// preload is then part of it, unless the description states the spring.
    fn lets_constant_free(&self, joint: usize) -> bool {
        let states_spring = (self.stated.free().iter())
            .map(candidate)
            .any(|c| c.kind == Kind::Spring && c.joint == joint);
        !self.stated.loads_separable
            && !states_spring
            && !self.anchor.holds_constant(joint, &self.nominal)
    }

    /// Returns the data for columns, with a model of these base parameters.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn source<'s>(
        &'s self,
        prepared: &'s PreparedData,
        values: &[f64],
    ) -> Result<Source<'s>, DiagnoseError> {
        let predicted = (prepared.runs.iter())
            .map(|run| predict(&self.nominal, self.robot, values, run))
            .collect::<Result<Vec<Predicted>, _>>()?;
        Ok(Source {
            robot: self.robot,
            runs: &prepared.runs,
            nominal: &self.nominal,
            thinning: &prepared.rows.thinning,
            left_out: &prepared.rows.left_out,
            predicted,
            values: values.to_vec(),
            free_constants: (0..self.robot.joints.len())
                .map(|j| self.lets_constant_free(j))
                .collect(),
            bent: HashMap::new(),
            beside: HashMap::new(),
            delays: vec![DELAY; self.robot.joints.len()],
            driven: Mutex::default(),
            seen: HashMap::new(),
            slopes: Mutex::default(),
        })
    }

    /// Returns the torque residual of a model, joint by joint over the rows, from base parameters and gains of the
    /// columns.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn remaining(
        &self,
        prepared: &PreparedData,
        [values, gains]: [&[f64]; 2],
        chosen: &[FittedCandidate],
    ) -> Result<Vec<Vec<f64>>, DiagnoseError> {
        let source = (self.source(prepared, values)?)
            .loaded_by(chosen, gains)?
            .following(&prepared.rows, chosen, gains)?
            .smoothed();
        let rows = &prepared.rows;
        let mut columns = Vec::new();
        for profile in chosen {
            columns.extend(source.columns(&profile.candidate, &profile.shapes)?);
        }
        let nominal = rows.nominal.iter().zip(self.anchor.beyond_held(values));
        let effects = columns.iter().zip(gains.iter().copied());
        let mut residual = rows.torque.clone();
        take_off(
            &mut residual,
            &combined(rows.joints(), nominal.chain(effects)),
        );
        Ok(residual)
    }

    /// Returns the RMS residual per joint of the unchanged description, including its effects.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn frozen(&self, prepared: &PreparedData) -> Result<Vec<f64>, DiagnoseError> {
        let (mut all, mut effects) = (Vec::new(), Vec::new());
        for placed in self.stated.free() {
            let gains = gains(&placed);
            // One column per gain; computed along these recordings later.
            effects.push(FittedCandidate::unjudged(
                candidate(&placed),
                placed.effect.shapes,
                vec![Column::new(); gains.len()],
            ));
            all.extend(gains);
        }
        let mut residual = self.remaining(prepared, [&self.anchor.prior, &all], &effects)?;
        for placed in self.stated.given_up() {
            let mut torque = Vec::with_capacity(prepared.rows.count);
            for run in &prepared.runs {
                let of_row = |&position: &f64| {
                    let at = Instant {
                        position,
                        ..Instant::default()
                    };
                    placed.effect.torque(&mut Memory::default(), &at)
                };
                let along: Vec<f64> = run.joints[placed.joint].q.iter().map(of_row).collect();
                prepared.rows.thinning.pick(&along, &mut torque);
            }
            let own = residual[placed.joint].iter_mut().zip(torque);
            own.for_each(|(left, torque)| *left -= torque);
        }
        Ok(rms(&prepared.rows, &residual))
    }

    /// Returns the RMS residual per joint of a model on the used rows.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn unseen(
        &self,
        held_out: &PreparedData,
        fitted: [&[f64]; 2],
        chosen: &[FittedCandidate],
    ) -> Result<Vec<f64>, DiagnoseError> {
        Ok(rms(
            &held_out.rows,
            &self.remaining(held_out, fitted, chosen)?,
        ))
    }
}

/// Returns the RMS per joint on the used rows.
fn rms(rows: &Rows, residual: &[Vec<f64>]) -> Vec<f64> {
    (residual.iter().zip(&rows.keep))
        .map(|(r, keep)| statistics::rms_of_kept(r, keep))
        .collect()
}

fn position_filter(treatment: &PreprocessingPlan) -> Result<LowPass, DiagnoseError> {
    (treatment.position_filter())
        .ok_or_else(|| DiagnoseError::Model("its position filter cannot be built.".into()))
}

/// Decides on the treatment as for an identification, but with a band wider than that of the motion.
///
/// # Errors
/// [`DiagnoseError`].
pub(crate) fn treatment_of(
    recordings: &[&dyn Recording],
    robot: &Robot,
) -> Result<PreprocessingPlan, DiagnoseError> {
    let options = PrepareOptions::default();
    let surveys = (recordings.iter())
        .map(|r| Survey::take(*r, robot.joints.len()))
        .collect::<Result<Vec<_>, _>>()?;
    let limits = robot.torque_limits();
    // An identification uses the torque residual of the model here. The diagnosis looks for that residual, and a low
    // cut-off would smooth it away.
    let first = PreprocessingPlan::decide(&surveys, &options, &limits)?;
    let (surveys, options, first) = match end_of_motion(recordings, &surveys, &first)? {
        None => (surveys, options, first),
        Some(end) => {
            let surveys: Vec<Survey> = (surveys.iter())
                .map(|s| s.ending_at(&vec![end; s.joints.len()]))
                .collect();
            let options = PrepareOptions {
                cutoff: Choice::Fixed(end),
                ..options
            };
            let mut treatment = PreprocessingPlan::decide(&surveys, &options, &limits)?;
            treatment.spectral_cutoff = Some(first.cutoff);
            (surveys, options, treatment)
        }
    };
    let band = (10.0 * first.motion_frequency)
        .max(LEAST_BAND)
        .min(first.cutoff);
    let step = ((0.4 * first.sample_rate / band).floor() as usize).max(1);
    let step = step.min(first.decimation.max(1));
    Ok(first.decimated(step, &surveys, &options, &limits)?)
}

/// Returns the upper end of the motion by its torque, Hz, if the position spectrum cannot show it. Then noise dominates
/// the acceleration below the highest motion frequency. Noise above that frequency does not matter, however high it is.
/// A cut-off without headroom would distort the motion.
fn end_of_motion(
    recordings: &[&dyn Recording],
    surveys: &[Survey],
    first: &PreprocessingPlan,
) -> Result<Option<f64>, DiagnoseError> {
    let doubtful = (first.spectra.iter()).any(|s| s.crossing.min(s.clean) < s.motion);
    if !doubtful {
        return Ok(None);
    }
    let longest = surveys.iter().map(|s| s.longest).min().unwrap_or(0);
    let (joints, rate) = (first.spectra.len(), first.sample_rate);
    let end = coherence::highest(recordings, joints, rate, longest)?;
    let swing = first.spectra.iter().map(|s| s.swing()).fold(0.0, f64::max);
    Ok(end.filter(|end| (swing..first.cutoff).contains(end)))
}

/// Returns every effect on every joint that the torque can show.
pub(crate) fn library(robot: &Robot, runs: &[Run], without: &[Kind]) -> Vec<Candidate> {
    let n = robot.joints.len();
    let mut list = Vec::new();
    for &kind in Kind::ALL {
        if without.contains(&kind)
            || kind.about().channel == Channel::Voltage
            || kind == Kind::Payload
        {
            continue;
        }
        for joint in 0..n {
            // A tilt belongs to the base. Every other effect needs motion of its joint.
            let stirs = runs.iter().any(|run| moves(run, joint));
            if !stirs && kind != Kind::GravityTilt {
                continue;
            }
            let at = |other| Candidate::on(kind, joint).naming(other);
            let warm = runs.iter().all(|r| r.joints[joint].temperature.is_some());
            match kind {
                Kind::InertiaCoupling => {
                    list.extend((0..n).filter(|k| *k != joint).map(|k| at(Some(k))))
                }
                Kind::ViscousWarmupTemperature if !warm => {}
                // A prismatic joint has no turn.
                Kind::EncoderEccentricityJoint
                    if robot.joints[joint].kind == JointKind::Prismatic => {}
                // One tilt for the whole base.
                Kind::GravityTilt if joint > 0 => {}
                _ => list.push(at(None)),
            }
        }
    }
    list
}
