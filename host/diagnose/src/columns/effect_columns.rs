//! Torque columns of an effect, computed from the measured motion.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::Vector3;
use rig_shared::effects::{Channel, Effect, GAINS, Instant, Kind, Parameter, SHAPES, Scale};
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::scalar::Real as _;

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::kinds::is_gear;
use crate::columns::slopes::Slopes;
use crate::columns::transmission::Driven;
use crate::columns::transmission::observer::Seen;
use crate::recordings::external_load;
use crate::rows::lanes::ABREAST;
use crate::rows::nominal::Nominal;
use crate::rows::nominal_torque::Predicted;
use crate::rows::regression::Column;
use crate::rows::thinning::Thinning;
use rig_data::runs::{Run, travel};
use rig_identify::FieldTorque;
use rig_model::batch::each_by;
use rig_model::effects::outruns;
use rig_model::robot::{Robot, unit_of};

mod gears;
mod predictions;

/// Data for the columns.
pub(crate) struct Source<'a> {
    /// The robot.
    pub(crate) robot: &'a Robot,
    /// The recordings.
    pub(crate) runs: &'a [Run],
    /// Base parameters and geometry.
    pub(crate) nominal: &'a Nominal,
    /// Filter and decimation of the columns.
    pub(crate) thinning: &'a Thinning,
    /// Samples that the rows leave out, run by run and joint by joint.
    pub(crate) left_out: &'a [Vec<Vec<bool>>],
    /// Predictions of the present model, run by run.
    pub(crate) predicted: Vec<Predicted>,
    /// Identified base parameters.
    pub(crate) values: Vec<f64>,
    /// True for joints whose constant torque is fitted in the nominal model, whatever external load acts.
    pub(crate) free_constants: Vec<bool>,
    /// Delay of each joint at which its delay column is computed, s.
    pub(crate) delays: Vec<f64>,
    /// Contact deflection of joints with presliding, from −1 to 1, by run and joint. Friction through the contact uses
    /// it instead of the direction of motion.
    pub(crate) bent: HashMap<(usize, usize), Vec<f64>>,
    /// Ratio of the other friction through those contacts to the model's Coulomb friction, by run and joint.
    pub(crate) beside: HashMap<(usize, usize), Vec<f64>>,
    /// Equations of the gear twist, by run and joint, computed on first use.
    pub(crate) driven: Mutex<HashMap<(usize, usize), Arc<Driven>>>,
    /// Observer inputs from the recorded torque for observer-based gears, by run and joint.
    pub(crate) seen: HashMap<(usize, usize), Seen>,
    /// Derivatives of the torque, by run and joint, computed on first use.
    pub(crate) slopes: Mutex<HashMap<(usize, usize), Arc<Slopes>>>,
}

/// Initial delay for a delay column, s. At 10 ms the first-order expansion would be 2 % off at 3 Hz.
pub(crate) const DELAY: f64 = 0.002;

/// Effects with a torque linear in the filtered motion, or nearly so: it has already passed the position filter.
const OF_THE_FILTERED_MOTION: [Kind; 2] = [Kind::InertiaCoupling, Kind::JointElasticity];

impl Source<'_> {
    /// Returns one column per gain.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn columns(
        &self,
        candidate: &Candidate,
        shapes: &[f64; SHAPES],
    ) -> Result<Vec<Column>, DiagnoseError> {
        self.columns_by(1, candidate, shapes)
    }

    /// Returns one column per gain for each of several shapes; threads share the runs.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn columns_of(
        &self,
        threads: usize,
        candidate: &Candidate,
        shapes: &[[f64; SHAPES]],
    ) -> Result<Vec<Vec<Column>>, DiagnoseError> {
        let parts = each_by(self.runs.len(), threads, |r| {
            self.of_run(candidate, shapes, r)
        });
        joined(parts)
    }

    /// Returns one column per gain; threads share the runs.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn columns_by(
        &self,
        threads: usize,
        candidate: &Candidate,
        shapes: &[f64; SHAPES],
    ) -> Result<Vec<Column>, DiagnoseError> {
        let all = self.columns_of(threads, candidate, std::slice::from_ref(shapes))?;
        Ok(all.into_iter().next().unwrap_or_default())
    }

    /// Returns one column per gain for each of several shapes, along one run.
    fn of_run(
        &self,
        candidate: &Candidate,
        shapes: &[[f64; SHAPES]],
        r: usize,
    ) -> Result<Vec<Vec<Column>>, DiagnoseError> {
        let none: Column = vec![None; self.nominal.joints()];
        let mut all = vec![vec![none; self.gains(candidate).len()]; shapes.len()];
        for (some, columns) in shapes.chunks(ABREAST).zip(all.chunks_mut(ABREAST)) {
            let full = self.at_full_rate(candidate, some, r)?;
            let (mut places, mut signals) = (Vec::new(), Vec::new());
            for (s, of_shapes) in full.into_iter().enumerate() {
                for (g, column) in of_shapes.into_iter().enumerate() {
                    for (j, signal) in column.into_iter().enumerate() {
                        if let Some(signal) = signal {
                            places.push((s, g, j));
                            signals.push(signal);
                        }
                    }
                }
            }
            let left_out: Vec<&[bool]> = (places.iter())
                .map(|&(.., j)| self.left_out[r][j].as_slice())
                .collect();
            let thinned = if OF_THE_FILTERED_MOTION.contains(&candidate.kind) {
                self.thinning.thinned(&signals, &left_out)
            } else {
                self.thinning.thinned_raw(&signals, &left_out)
            };
            for ((s, g, j), thin) in places.into_iter().zip(thinned) {
                columns[s][g][j] = Some(thin);
            }
        }
        Ok(all)
    }

    /// Returns the longest operating time at the end of a recording, s.
    pub(crate) fn running(&self) -> f64 {
        let ran = |run: &Run| run.t.last().map_or(0.0, |t| t - run.began);
        self.runs.iter().map(ran).fold(0.0, f64::max)
    }

    /// Returns the highest speed of a joint, rad/s or m/s.
    pub(crate) fn fastest(&self, joint: usize) -> f64 {
        let speeds = (self.runs.iter()).flat_map(|run| &run.joints[joint].qd);
        speeds.fold(0.0, |most, v| v.abs().max(most))
    }

    /// Returns the identified Coulomb friction of a joint, at least 0.
    pub(crate) fn coulomb(&self, joint: usize) -> f64 {
        self.friction(joint)[1].max(0.0)
    }

    /// Returns the gains of a candidate. The gains of a tilt are angles of gravity as a whole. The preload of a spring
    /// has no gain where a constant is free.
    pub(crate) fn gains(&self, candidate: &Candidate) -> Vec<Parameter> {
        let kind = candidate.kind;
        if is_gear(kind) {
            // 1 if mass and load are right; until they are, the fit may change it a little.
            return vec![Parameter {
                name: "share",
                unit: "1",
                bounds: [0.3, 3.0],
                range: [0.3, 3.0],
                scale: Scale::Linear,
                meaning: "of the torque that the twist changes",
            }];
        }
        if kind == Kind::Spring && self.free_constants[candidate.joint] {
            return kind.about().gains[..1].to_vec();
        }
        if kind != Kind::GravityTilt {
            return kind.about().gains.to_vec();
        }
        let angle = |name| Parameter {
            name,
            unit: "rad",
            bounds: [f64::NEG_INFINITY, f64::INFINITY],
            range: [0.005, 0.2],
            scale: Scale::Logarithmic,
            meaning: "turn of the base",
        };
        match self.nominal.tilt_axes().len() {
            0 => Vec::new(),
            1 => vec![angle("angle")],
            _ => vec![angle("angle_1"), angle("angle_2")],
        }
    }

    /// Returns the unit of a candidate's parameter on its joint, ASCII. A tilt is an angle on every joint.
    pub(crate) fn unit(&self, candidate: &Candidate, parameter: &Parameter) -> String {
        if candidate.kind == Kind::GravityTilt {
            parameter.unit.to_owned()
        } else {
            unit_of(parameter, self.robot.joints[candidate.joint].kind)
        }
    }

    /// Returns one column per gain for each of the shapes over one run, joint by joint, at the full rate.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    fn at_full_rate(
        &self,
        candidate: &Candidate,
        shapes: &[[f64; SHAPES]],
        r: usize,
    ) -> Result<Vec<Vec<Column>>, DiagnoseError> {
        let own = |signal: Vec<f64>| {
            let mut column: Column = vec![None; self.nominal.joints()];
            column[candidate.joint] = Some(signal);
            column
        };
        if is_gear(candidate.kind) {
            let signals = self.twisted(candidate, shapes, r)?;
            return Ok(signals.into_iter().map(|s| vec![own(s)]).collect());
        }
        let (run, predicted) = (&self.runs[r], &self.predicted[r]);
        let gains = self.gains(candidate).len();
        if external_load::is_gone(candidate.kind, run) {
            let nothing = vec![own(vec![0.0; run.len()]); gains];
            return Ok(vec![nothing; shapes.len()]);
        }
        let of_one = |shapes: &[f64; SHAPES]| match (candidate.kind, candidate.kind.about().channel)
        {
            (Kind::MeasurementDelay, _) => {
                let torque = &predicted.torque[candidate.joint];
                let delay = self.delays[candidate.joint];
                let change = (late(torque, delay * run.rate).iter().zip(torque))
                    .map(|(late, now)| (late - now) / delay)
                    .collect();
                Ok(vec![own(change)])
            }
            (Kind::GravityTilt, _) => self.tilted(run),
            (_, Channel::Position) => {
                let slopes = self.slopes(candidate.joint, r)?;
                let errors = self.terms(candidate, shapes, r);
                Ok((errors.iter().take(gains))
                    .map(|error| slopes.misread(error, 1.0 / run.rate))
                    .collect())
            }
            _ => {
                let terms = self.terms(candidate, shapes, r);
                Ok(terms.into_iter().take(gains).map(own).collect())
            }
        };
        shapes.iter().map(of_one).collect()
    }

    /// Returns the effect's terms sample by sample.
    fn terms(&self, candidate: &Candidate, shapes: &[f64; SHAPES], r: usize) -> Vec<Vec<f64>> {
        self.along(candidate, shapes, r, false)
    }

    /// Returns the effect's terms sample by sample; with `whole` as if the motion were always positive.
    fn along(
        &self,
        candidate: &Candidate,
        shapes: &[f64; SHAPES],
        r: usize,
        whole: bool,
    ) -> Vec<Vec<f64>> {
        let (run, predicted) = (&self.runs[r], &self.predicted[r]);
        let bent = (self.bent.get(&(r, candidate.joint)))
            .filter(|_| candidate.kind.acts_through_contact());
        let beside =
            (self.beside.get(&(r, candidate.joint))).filter(|_| candidate.kind.is_presliding());
        let joint = &run.joints[candidate.joint];
        let ratio = self.robot.joints[candidate.joint].gear_ratio();
        let other = candidate.other.and_then(|k| run.joints.get(k));
        let load = &predicted.load[candidate.joint];
        let drive = &predicted.torque[candidate.joint];
        let [viscous, coulomb] = self.friction(candidate.joint);
        let first_temperature = joint
            .temperature
            .as_ref()
            .and_then(|t| t.first().copied())
            .unwrap_or(0.0);
        let gains = candidate.kind.about().gains.len();
        let mut out = vec![Vec::with_capacity(run.len()); gains];
        let effect = Effect::new(candidate.kind, &[], shapes);
        let mut memory =
            (run.thermal_history).state_after(&effect, candidate.joint, [viscous, coulomb]);
        for k in 0..run.len() {
            let slid = match bent {
                Some(bent) => bent[k],
                None => joint.qd[k].sgn(),
            };
            let at = Instant {
                position: joint.q[k],
                velocity: joint.qd[k],
                acceleration: joint.qdd[k],
                direction: if whole { 1.0 } else { slid },
                motor_angle: ratio * joint.q[k],
                drive_torque: drive[k],
                load: load[k],
                friction: coulomb * slid + viscous * joint.qd[k],
                time: run.t[k] - run.began,
                temperature_rise: joint
                    .temperature
                    .as_ref()
                    .map_or(0.0, |t| t[k] - first_temperature),
                other: other.map_or([0.0; 3], |o| [o.q[k], o.qd[k], o.qdd[k]]),
                period: 1.0 / run.rate,
                travel: travel([&joint.q, &joint.qd], k, 1.0 / run.rate),
                extra_friction_ratio: beside.map_or(0.0, |beside| beside[k]),
                // Delays and payloads have separate columns.
                drive_rate: 0.0,
                gravity: 0.0,
            };
            let terms: [f64; GAINS] =
                if outruns(candidate.kind, shapes, ratio * joint.qd[k], at.period) {
                    [0.0; GAINS]
                } else {
                    candidate.kind.terms(shapes, &mut memory.0, &at)
                };
            for (list, term) in out.iter_mut().zip(terms) {
                list.push(term);
            }
        }
        out
    }

    pub(crate) fn slopes(&self, joint: usize, r: usize) -> Result<Arc<Slopes>, DiagnoseError> {
        let known = || self.slopes.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(slopes) = known().get(&(r, joint)) {
            return Ok(slopes.clone());
        }
        // No lock here, so that other threads continue.
        let slopes = Arc::new(Slopes::of(
            self.nominal,
            &self.values,
            joint,
            &self.runs[r],
        )?);
        known().insert((r, joint), slopes.clone());
        Ok(slopes)
    }

    /// Returns the identified viscous and Coulomb friction of a joint.
    pub(crate) fn friction(&self, joint: usize) -> [f64; 2] {
        [column::VISCOUS, column::COULOMB].map(|place| {
            let c = joint * COLUMNS + place;
            let k = self.nominal.base.columns.iter().position(|b| *b == c);
            k.map_or(0.0, |k| self.values[k])
        })
    }

    /// Returns the described drive inertia of a joint that is grouped with the link's. It is 0 where the drive inertia
    /// is a base parameter of its own.
    pub(crate) fn drive_inertia(&self, joint: usize) -> f64 {
        if self.nominal.has_own_drive_inertia(joint) {
            return 0.0;
        }
        self.robot.standard_parameters()[joint][column::DRIVE_INERTIA]
    }

    /// Returns the torque of a base tilt by a unit angle, one column for each horizontal axis that matters.
    ///
    /// Tilted gravity also acts on parameters without effect before, such as first moments along a vertical axis. They
    /// are not base parameters, so the description gives them.
    fn tilted(&self, run: &Run) -> Result<Vec<Column>, DiagnoseError> {
        let failed = |e: &dyn std::fmt::Display| DiagnoseError::Model(e.to_string());
        let n = self.nominal.joints();
        let mut parameters = self.robot.standard_parameters();
        let base = &self.nominal.base;
        let prior = self.nominal.stated(self.robot);
        for ((&c, value), prior) in base.columns.iter().zip(&self.values).zip(&prior) {
            if c < n * COLUMNS {
                parameters[c / COLUMNS][c % COLUMNS] += value - prior;
            }
        }
        let gravity = Vector3::from(self.robot.gravity);
        let axes = self.nominal.tilt_axes();
        // Gravity turns opposite to the base, and the torque is linear in gravity.
        let fields = (axes.iter()).map(|axis| gravity.cross(&Vector3::from(*axis)).into());
        let chain = self.robot.chain().map_err(|e| failed(&e))?;
        let mut tilted = FieldTorque::new(&chain, fields, parameters);
        let mut columns: Vec<Column> = vec![vec![Some(Vec::new()); n]; axes.len()];
        for k in 0..run.len() {
            let q = run.joints.iter().map(|joint| joint.q[k]);
            let torque = tilted.at(q).map_err(|e| failed(&e))?;
            for (column, torque) in columns.iter_mut().zip(torque) {
                for (signal, torque) in column.iter_mut().flatten().zip(torque) {
                    signal.push(*torque);
                }
            }
        }
        Ok(columns)
    }
}

/// Joins the columns of several runs.
fn joined(
    parts: impl IntoIterator<Item = Result<Vec<Vec<Column>>, DiagnoseError>>,
) -> Result<Vec<Vec<Column>>, DiagnoseError> {
    let mut parts = parts.into_iter();
    let mut all = parts.next().transpose()?.unwrap_or_default();
    for part in parts {
        for (to, from) in all
            .iter_mut()
            .flatten()
            .flatten()
            .zip(part?.into_iter().flatten().flatten())
        {
            if let Some(from) = from {
                to.get_or_insert_default().extend(from);
            }
        }
    }
    Ok(all)
}

fn add(to: &mut [Vec<f64>], from: &[Vec<f64>]) {
    for (to, from) in to.iter_mut().zip(from) {
        for (to, x) in to.iter_mut().zip(from) {
            *to += x;
        }
    }
}

/// Delays a signal by `samples` (fractional). The first value fills the start.
fn late(signal: &[f64], samples: f64) -> Vec<f64> {
    let whole = samples.floor();
    let part = samples - whole;
    let at = |k: usize, back: usize| signal[k.saturating_sub(back)];
    (0..signal.len())
        .map(|k| {
            let back = whole as usize;
            (1.0 - part) * at(k, back) + part * at(k, back + 1)
        })
        .collect()
}
