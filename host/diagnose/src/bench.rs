//! What stays the same during a diagnosis: the robot, its nominal model, how recordings are treated.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use rig_shared::effects::{Channel, Instant, Kind, Memory};
use rig_shared::multibody::Chain;

use super::DiagnoseError;
use super::anchor::Anchor;
use super::coherent;
use super::columns::{Candidate, DELAY, Source};
use super::fit::Evidence;
use super::floor;
use super::one_way::OneWay;
use super::predicted::{Predicted, predict};
use super::profile::Profile;
use super::refit::Refit;
use super::rows::{Column, ILLEGIBLE, Nominal, Rows, combined};
use super::sanity::moves;
use super::stated::{Stated, candidate, gains};
use rig_data::Compensated;
use rig_data::prepare::{Choice, LowPass, PrepareOptions, Recording, Survey, Treatment, same_rate};
use rig_data::runs::{Run, runs_of};
use rig_model::effects::Effects;
use rig_model::robot::{JointKind, Robot};

/// Least pass band that the waves of effects need of the low-pass before thinning, Hz.
const LEAST_BAND: f64 = 30.0;

/// Times the squares that a rest explains from which on rows about it hold more than that.
const LOUD: f64 = 1.2;

/// Recordings under one treatment.
pub(super) struct Loaded {
    /// At the full rate.
    pub(super) runs: Vec<Run>,
    /// Less what the held parameters contribute.
    pub(super) rows: Rows,
    /// Of these recordings, at their own rate.
    pub(super) treatment: Treatment,
}

impl Loaded {
    /// What positions pass before they are differentiated.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] where there is no such filter.
    pub(super) fn position_filter(&self) -> Result<LowPass, DiagnoseError> {
        position_filter(&self.treatment)
    }
}

/// Everything that stays the same during a diagnosis.
pub(super) struct Bench<'a> {
    /// As it was given, without its effects.
    pub(super) robot: &'a Robot,
    /// The effects that it was given with.
    pub(super) stated: &'a Stated,
    /// What recordings are freed of, and those of the rig with nothing that pulls on it.
    held: [Option<(Effects, Chain<f64>)>; 2],
    /// Its base parameters.
    pub(super) nominal: Nominal,
    /// Which of them are free.
    pub(super) anchor: Anchor,
    treatment: Treatment,
    /// Joints of which rows about rests are used.
    rests: Vec<usize>,
    /// Joints that move in one direction only, whose constant torques are held.
    pub(super) one_way: Vec<OneWay>,
}

impl<'a> Bench<'a> {
    /// For a robot and the recordings that decide on the treatment of all.
    ///
    /// # Errors
    /// [`DiagnoseError`].
    pub(super) fn of(
        stated: &'a Stated,
        training: &[&dyn Recording],
    ) -> Result<Self, DiagnoseError> {
        let robot = &stated.robot;
        let nominal = Nominal::of(robot)?;
        let anchor = Anchor::of(robot, &nominal, stated);
        Ok(Self {
            robot,
            stated,
            held: [stated.taken_off(false)?, stated.taken_off(true)?],
            anchor,
            nominal,
            treatment: treatment_of(training, robot)?,
            rests: Vec::new(),
            one_way: Vec::new(),
        })
    }

    /// What a base parameter is called: of a joint that moves in one direction only, its dry friction with the constant in it.
    pub(super) fn expression(&self, parameter: usize) -> String {
        let own = (self.one_way.iter()).find(|own| own.friction() == parameter);
        own.map_or_else(
            || self.nominal.base.expression(parameter),
            |own| own.named(self.anchor.prior[own.constant()]),
        )
    }

    /// Reads recordings to learn from and takes off what the held effects and parameters contribute.
    ///
    /// # Errors
    /// [`DiagnoseError`].
    pub(super) fn load(&self, recordings: &[&dyn Recording]) -> Result<Loaded, DiagnoseError> {
        self.loaded(recordings, &self.treatment)
    }

    /// The same of recordings held back, at their own rate.
    ///
    /// # Errors
    /// [`DiagnoseError`]: two rates among them, or one that cannot hold the band.
    pub(super) fn load_held(&self, recordings: &[&dyn Recording]) -> Result<Loaded, DiagnoseError> {
        let joints = self.robot.joints.len();
        let mut own: Option<Treatment> = None;
        for recording in recordings {
            let survey = Survey::take(*recording, joints)?;
            match &own {
                None => own = Some(self.treatment.at_rate_of(&survey)?),
                Some(treatment) => same_rate(&survey, treatment.sample_rate)?,
            }
        }
        self.loaded(recordings, own.as_ref().unwrap_or(&self.treatment))
    }

    fn loaded(
        &self,
        recordings: &[&dyn Recording],
        treatment: &Treatment,
    ) -> Result<Loaded, DiagnoseError> {
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

    /// The rows of runs, less what the held parameters contribute.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn rows(
        &self,
        runs: Vec<Run>,
        treatment: &Treatment,
    ) -> Result<Loaded, DiagnoseError> {
        let mut rows = Rows::of(&runs, &self.nominal, treatment)?;
        let held = self.anchor.held_torque(&rows);
        take_off(&mut rows.torque, &held);
        for &joint in &self.rests {
            rows.use_rests(joint);
        }
        for own in &self.one_way {
            own.leave_out_rests(&mut rows);
        }
        Ok(Loaded {
            runs,
            rows,
            treatment: treatment.clone(),
        })
    }

    /// Decides by the training data of which joints rows about rests are used: where they hold more than a rest makes of dry
    /// friction that nobody knows, something shows there. Whether there is such a joint.
    ///
    /// # Errors
    /// [`DiagnoseError`] of the fit.
    pub(super) fn look_about_rests(&mut self, loaded: &Loaded) -> Result<bool, DiagnoseError> {
        let rows = &loaded.rows;
        let refit = Refit::of(self, rows)?;
        let values = &refit.before.values;
        let source = self.source(loaded, &self.anchor.values(values))?;
        let known = combined(rows.joints(), refit.free.iter().zip(values.iter().copied()));
        let mut residual = rows.torque.clone();
        take_off(&mut residual, &known);
        let loud = |j: &usize| {
            let Some([about, elsewhere]) = rows.about_rests(*j, &residual[*j]) else {
                return true;
            };
            about > LOUD * (elsewhere + (ILLEGIBLE * source.coulomb(*j)).powi(2))
        };
        self.rests = (0..rows.joints()).filter(loud).collect();
        Ok(!self.rests.is_empty())
    }

    /// Samples a second of what is learnt from.
    pub(super) fn rate(&self) -> f64 {
        self.treatment.sample_rate
    }

    /// Whether a joint's constant torque is fitted as part of the nominal model, whatever pulls on the joint: the preload of a spring
    /// is part of it then, but where the description states that spring.
    fn lets_constant_free(&self, joint: usize) -> bool {
        let states_spring = (self.stated.free().iter())
            .map(candidate)
            .any(|c| c.kind == Kind::Spring && c.joint == joint);
        !self.stated.pulls_told
            && !states_spring
            && !self.anchor.holds_constant(joint, &self.nominal)
    }

    /// What columns are formed from, with a model of these base parameters.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn source<'s>(
        &'s self,
        loaded: &'s Loaded,
        values: &[f64],
    ) -> Result<Source<'s>, DiagnoseError> {
        let predicted = (loaded.runs.iter())
            .map(|run| predict(&self.nominal, self.robot, values, run))
            .collect::<Result<Vec<Predicted>, _>>()?;
        Ok(Source {
            robot: self.robot,
            runs: &loaded.runs,
            nominal: &self.nominal,
            thinning: &loaded.rows.thinning,
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

    /// What a model leaves of recordings' torque, joint by joint over the rows: of its base parameters and the gains of the
    /// effects' columns.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn remaining(
        &self,
        loaded: &Loaded,
        [values, gains]: [&[f64]; 2],
        chosen: &[Profile],
    ) -> Result<Vec<Vec<f64>>, DiagnoseError> {
        let source = (self.source(loaded, values)?)
            .loaded_by(chosen, gains)?
            .following(&loaded.rows, chosen, gains)?
            .smoothed();
        let rows = &loaded.rows;
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

    /// RMS per joint of what the description as it stands leaves, its effects among it.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn frozen(&self, loaded: &Loaded) -> Result<Vec<f64>, DiagnoseError> {
        let (mut all, mut effects) = (Vec::new(), Vec::new());
        for placed in self.stated.free() {
            let gains = gains(&placed);
            effects.push(Profile {
                candidate: candidate(&placed),
                shapes: placed.effect.shapes,
                // As many as gains; they are formed along these recordings.
                columns: Arc::new(vec![Column::new(); gains.len()]),
                evidence: Evidence::default(),
                vanished: None,
                followed: None,
                otherwise: None,
                heard: false,
                doubled: false,
            });
            all.extend(gains);
        }
        let mut residual = self.remaining(loaded, [&self.anchor.prior, &all], &effects)?;
        for placed in self.stated.given_up() {
            let mut torque = Vec::with_capacity(loaded.rows.count);
            for run in &loaded.runs {
                let of_row = |&position: &f64| {
                    let at = Instant {
                        position,
                        ..Instant::default()
                    };
                    placed.effect.torque(&mut Memory::default(), &at)
                };
                let along: Vec<f64> = run.joints[placed.joint].q.iter().map(of_row).collect();
                loaded.rows.thinning.pick(&along, &mut torque);
            }
            let own = residual[placed.joint].iter_mut().zip(torque);
            own.for_each(|(left, torque)| *left -= torque);
        }
        Ok(rms(&loaded.rows, &residual))
    }

    /// RMS per joint of what a model leaves on the rows used.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn unseen(
        &self,
        sealed: &Loaded,
        fitted: [&[f64]; 2],
        chosen: &[Profile],
    ) -> Result<Vec<f64>, DiagnoseError> {
        Ok(rms(&sealed.rows, &self.remaining(sealed, fitted, chosen)?))
    }
}

/// RMS per joint on the rows used.
fn rms(rows: &Rows, residual: &[Vec<f64>]) -> Vec<f64> {
    (residual.iter().zip(&rows.keep))
        .map(|(r, keep)| floor::rms(r, keep))
        .collect()
}

fn position_filter(treatment: &Treatment) -> Result<LowPass, DiagnoseError> {
    (treatment.position_filter())
        .ok_or_else(|| DiagnoseError::Model("its position filter cannot be built.".into()))
}

/// Takes a column off signals, joint by joint.
fn take_off(signals: &mut [Vec<f64>], column: &Column) {
    for (signal, column) in signals.iter_mut().zip(column) {
        for (s, c) in signal.iter_mut().zip(column.iter().flatten()) {
            *s -= c;
        }
    }
}

/// Decides how recordings are treated: as for an identification, but with a band that shows more than the motion's own.
///
/// # Errors
/// [`DiagnoseError`].
pub(super) fn treatment_of(
    recordings: &[&dyn Recording],
    robot: &Robot,
) -> Result<Treatment, DiagnoseError> {
    let options = PrepareOptions::default();
    let surveys = (recordings.iter())
        .map(|r| Survey::take(*r, robot.joints.len()))
        .collect::<Result<Vec<_>, _>>()?;
    let limits = robot.torque_limits();
    // Not by what the model leaves of the torque, as an identification does: what it lacks is what is looked for, and a low cut-off
    // smears it away.
    let first = Treatment::decide(&surveys, &options, &limits)?;
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
            let mut treatment = Treatment::decide(&surveys, &options, &limits)?;
            treatment.cutoff_reason = format!(
                "{end:.3} Hz: up to there the torque goes with the acceleration. The spectrum of the position alone gives {:.3} Hz; its noise is not white (time stamps with jitter, a coarse encoder, or a position that was filtered before it was recorded).",
                first.cutoff
            );
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

/// Where the motion ends by what torque it takes, Hz, where the spectrum of the position cannot tell: noise is in its acceleration
/// below the highest frequency that it takes for motion. Noise beyond that frequency, however loud, leaves the motion known, and a
/// cut-off below its headroom would bend it.
fn end_of_motion(
    recordings: &[&dyn Recording],
    surveys: &[Survey],
    first: &Treatment,
) -> Result<Option<f64>, DiagnoseError> {
    let doubtful = (first.spectra.iter()).any(|s| s.crossing.min(s.clean) < s.motion);
    if !doubtful {
        return Ok(None);
    }
    let longest = surveys.iter().map(|s| s.longest).min().unwrap_or(0);
    let (joints, rate) = (first.spectra.len(), first.sample_rate);
    let end = coherent::highest(recordings, joints, rate, longest)?;
    let swing = first.spectra.iter().map(|s| s.swing()).fold(0.0, f64::max);
    Ok(end.filter(|end| (swing..first.cutoff).contains(end)))
}

/// Every effect on every joint that the torque can show.
pub(super) fn library(robot: &Robot, runs: &[Run], without: &[Kind]) -> Vec<Candidate> {
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
            // A tilt is one of the base; all else needs a motion of its own joint.
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
                // A slide has no turn.
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
