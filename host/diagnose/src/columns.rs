//! Columns of an effect from the measured motion.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::Vector3;
use rig_shared::effects::{
    Channel, Effect, GAINS, Instant, Kind, Memory, Parameter, SHAPES, Scale,
};
use rig_shared::multibody::{COLUMNS, Chain, bias_torque, column};
use rig_shared::scalar::Real as _;

use super::DiagnoseError;
use super::predicted::Predicted;
use super::profile::Profile;
use super::pull;
use super::rows::{Column, Nominal, Thinning};
use super::search::is_gear;
use super::slopes::Slopes;
use super::transmission::{ABREAST, Driven, Seen};
use rig_data::runs::Run;
use rig_model::batch::each_by;
use rig_model::effects::{outruns, over_coulomb};
use rig_model::robot::{Robot, unit_of};

mod gears;

/// What columns are formed from.
pub(super) struct Source<'a> {
    /// The robot.
    pub(super) robot: &'a Robot,
    /// The recordings.
    pub(super) runs: &'a [Run],
    /// Base parameters and geometry.
    pub(super) nominal: &'a Nominal,
    /// What columns pass.
    pub(super) thinning: &'a Thinning,
    /// The present model's word, run by run.
    pub(super) predicted: Vec<Predicted>,
    /// Identified base parameters.
    pub(super) values: Vec<f64>,
    /// Joints of which the nominal model holds a constant torque that is fitted, whatever pulls on them.
    pub(super) free_constants: Vec<bool>,
    /// Delay at which the column of each joint's delay is taken, s.
    pub(super) delays: Vec<f64>,
    /// How far the contacts of joints with presliding are bent, from −1 to 1, by run and joint: what acts through them has that in the
    /// place of the direction.
    pub(super) bent: HashMap<(usize, usize), Vec<f64>>,
    /// Friction that acts through those contacts over that of the model, by run and joint.
    pub(super) beside: HashMap<(usize, usize), Vec<f64>>,
    /// What twists obey, by run and joint, once it has been asked for.
    pub(super) driven: Mutex<HashMap<(usize, usize), Arc<Driven>>>,
    /// What the recorded torque tells of gears whose links are followed, by run and joint.
    pub(super) seen: HashMap<(usize, usize), Seen>,
    /// Slopes of the torque, by run and joint, once they have been asked for.
    pub(super) slopes: Mutex<HashMap<(usize, usize), Arc<Slopes>>>,
}

/// An effect on a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Candidate {
    /// Which.
    pub(super) kind: Kind,
    /// On which joint, from 0.
    pub(super) joint: usize,
    /// The other joint that it names.
    pub(super) other: Option<usize>,
    /// The bits of a wave's order; none of what is no wave, and of a wave whose order is still to be found.
    pub(super) order: Option<u64>,
}

impl Candidate {
    /// A kind on a joint, whatever its order.
    pub(super) const fn on(kind: Kind, joint: usize) -> Self {
        Self {
            kind,
            joint,
            other: None,
            order: None,
        }
    }

    /// The same with another joint that it names.
    pub(super) fn naming(self, other: Option<usize>) -> Self {
        Self { other, ..self }
    }

    /// The same with these shapes: waves of different orders are different effects, which add up.
    pub(super) fn shaped(self, shapes: &[f64; SHAPES]) -> Self {
        let wave = repeats_by_order(self.kind);
        Self {
            order: wave.then(|| shapes[0].to_bits()),
            ..self
        }
    }

    /// What a library holds of it: waves of all orders in one.
    pub(super) fn sort(self) -> Self {
        Self {
            order: None,
            ..self
        }
    }

    /// Whether they are two orders of one wave, which a joint may have both.
    pub(super) fn is_another_order(&self, other: &Self) -> bool {
        self.sort() == other.sort() && self.order != other.order
    }
}

/// Whether a kind is a torque that repeats with an angle: a joint may have it with several orders at once.
pub(super) fn repeats_by_order(kind: Kind) -> bool {
    kind.periodic().is_some() && kind.about().channel == Channel::Torque
}

/// Delay at which the column of a delay is taken until one is known, s: first order would be 2 % off at 3 Hz and 10 ms.
pub(super) const DELAY: f64 = 0.002;

/// Effects beside which the torque of the drive is asked for with all that is in the model. To a ripple, which repeats with an
/// angle, the nominal torque says enough; products of its wave with those of other effects bend to anything.
const OF_THE_DRIVE: [Kind; 2] = [Kind::TorqueSaturation, Kind::MeasurementDelay];

/// Rounds in which a saturation meets the torque that it makes: in each what is missing falls by half or more.
const OWN_ROUNDS: usize = 6;
/// Share of what a little more current would give that may be lost where the torque is predicted.
const MOST_LOST: f64 = 0.5;

/// Effects whose torque is linear in the filtered motion, or as good as: it has passed the position's filter with it.
const OF_THE_FILTERED_MOTION: [Kind; 2] = [Kind::InertiaCoupling, Kind::JointElasticity];

/// How far an effect of presliding is bent along the velocities of a run, `beside` so much other friction.
fn bent(effect: &Effect<f64>, velocities: &[f64], beside: &[f64], period: f64) -> Vec<f64> {
    let mut memory = Memory::default();
    let along = |(&velocity, &beside): (&f64, &f64)| {
        let at = Instant {
            velocity,
            period,
            beside,
            ..Instant::default()
        };
        effect.torque(&mut memory, &at);
        effect.bent(&memory, beside)
    };
    velocities.iter().zip(beside).map(along).collect()
}

impl Source<'_> {
    /// The same with the gears' load and the drives' torque as effects make them that are in the model; `gains` are those of
    /// their columns, one effect after the other.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn loaded_by(
        mut self,
        chosen: &[Profile],
        gains: &[f64],
    ) -> Result<Self, DiagnoseError> {
        let mut at = 0;
        for profile in chosen {
            let Candidate { kind, joint, .. } = profile.candidate;
            let own = &gains[at..at + profile.columns.len()];
            at += own.len();
            if kind == Kind::MeasurementDelay {
                self.delays[joint] = own[0].max(DELAY);
            }
            if kind.is_presliding() {
                let effect = Effect::new(kind, own, &profile.shapes);
                for (r, run) in self.runs.iter().enumerate() {
                    let beside = self.beside(joint, r, chosen, gains);
                    let bent = bent(&effect, &run.joints[joint].qd, &beside, 1.0 / run.rate);
                    self.bent.insert((r, joint), bent);
                    self.beside.insert((r, joint), beside);
                }
            }
        }
        let asked = (chosen.iter()).any(|p| OF_THE_DRIVE.contains(&p.candidate.kind));
        for r in 0..self.runs.len() {
            let load = self.sum(r, chosen, gains, &Kind::on_the_link)?;
            add(&mut self.predicted[r].load, &load);
            if !asked {
                continue;
            }
            // A late reading is no torque.
            let others = self.sum(r, chosen, gains, &|kind| !OF_THE_DRIVE.contains(&kind))?;
            add(&mut self.predicted[r].torque, &others);
            self.saturate(r, chosen, gains)?;
        }
        Ok(self)
    }

    /// Saturation in the predicted torque that its own law asks for. Where more than half of what a little more current would give
    /// is lost, a prediction is off by more than twice what the model is, and the recorded torque takes its place; elsewhere that
    /// would hold noise that is in what it is to explain.
    fn saturate(
        &mut self,
        r: usize,
        chosen: &[Profile],
        gains: &[f64],
    ) -> Result<(), DiagnoseError> {
        let mut at = 0;
        let mut saturated: Vec<(usize, f64)> = Vec::new();
        for profile in chosen {
            if profile.candidate.kind == Kind::TorqueSaturation && gains[at] > 0.0 {
                saturated.push((profile.candidate.joint, gains[at]));
            }
            at += profile.columns.len();
        }
        if saturated.is_empty() {
            return Ok(());
        }
        let rest = self.predicted[r].torque.clone();
        for _ in 0..OWN_ROUNDS {
            let own = self.sum(r, chosen, gains, &|kind| kind == Kind::TorqueSaturation)?;
            self.predicted[r].torque.clone_from(&rest);
            add(&mut self.predicted[r].torque, &own);
        }
        for (joint, coefficient) in saturated {
            // d(τ − c·τ³)/dτ is a half there.
            let most = (MOST_LOST / (3.0 * coefficient)).sqrt();
            let recorded = (self.thinning).calm(&self.runs[r].joints[joint].recorded());
            for (to, recorded) in self.predicted[r].torque[joint].iter_mut().zip(recorded) {
                if recorded.abs() > most {
                    *to = recorded;
                }
            }
        }
        Ok(())
    }

    /// Torque over a run, joint by joint, of the effects of some kinds.
    fn sum(
        &self,
        r: usize,
        chosen: &[Profile],
        gains: &[f64],
        counts: &dyn Fn(Kind) -> bool,
    ) -> Result<Vec<Vec<f64>>, DiagnoseError> {
        let mut sum = vec![vec![0.0; self.runs[r].len()]; self.nominal.joints()];
        let mut at = 0;
        for profile in chosen {
            let own = &gains[at..at + profile.columns.len()];
            at += own.len();
            if !counts(profile.candidate.kind) {
                continue;
            }
            let shapes = std::slice::from_ref(&profile.shapes);
            let columns = self.at_full_rate(&profile.candidate, shapes, r)?;
            for (column, gain) in columns.into_iter().flatten().zip(own) {
                for (to, signal) in sum.iter_mut().zip(column) {
                    for (to, x) in to.iter_mut().zip(signal.iter().flatten()) {
                        *to += gain * x;
                    }
                }
            }
        }
        Ok(sum)
    }

    /// One column a gain.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn columns(
        &self,
        candidate: &Candidate,
        shapes: &[f64; SHAPES],
    ) -> Result<Vec<Column>, DiagnoseError> {
        self.columns_by(1, candidate, shapes)
    }

    /// One column a gain for each of several shapes, the runs shared among threads.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn columns_of(
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

    /// One column a gain, the runs shared among threads.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn columns_by(
        &self,
        threads: usize,
        candidate: &Candidate,
        shapes: &[f64; SHAPES],
    ) -> Result<Vec<Column>, DiagnoseError> {
        let all = self.columns_of(threads, candidate, std::slice::from_ref(shapes))?;
        Ok(all.into_iter().next().unwrap_or_default())
    }

    /// For each of several shapes one column a gain, along one run.
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
            let thinned = if OF_THE_FILTERED_MOTION.contains(&candidate.kind) {
                self.thinning.thinned(&signals)
            } else {
                self.thinning.thinned_raw(&signals)
            };
            for ((s, g, j), thin) in places.into_iter().zip(thinned) {
                columns[s][g][j] = Some(thin);
            }
        }
        Ok(all)
    }

    /// The longest time that the joints have been running at the end of a recording, s.
    pub(super) fn running(&self) -> f64 {
        let ran = |run: &Run| run.t.last().map_or(0.0, |t| t - run.began);
        self.runs.iter().map(ran).fold(0.0, f64::max)
    }

    /// The highest speed that a joint reaches, rad/s or m/s.
    pub(super) fn fastest(&self, joint: usize) -> f64 {
        let speeds = (self.runs.iter()).flat_map(|run| &run.joints[joint].qd);
        speeds.fold(0.0, |most, v| v.abs().max(most))
    }

    /// Coulomb friction of a joint, as identified; 0 where it came out below that.
    pub(super) fn coulomb(&self, joint: usize) -> f64 {
        self.friction(joint)[1].max(0.0)
    }

    /// What a candidate's columns multiply. A tilt is one of gravity as a whole: its gains are angles. A spring's preload is part
    /// of a constant that is free.
    pub(super) fn gains(&self, candidate: &Candidate) -> Vec<Parameter> {
        let kind = candidate.kind;
        if is_gear(kind) {
            // 1 where mass and load are right; the fit may move it a little until they are.
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

    /// Unit of a candidate's parameter on its joint, ASCII. A tilt is an angle whatever the joint does.
    pub(super) fn unit(&self, candidate: &Candidate, parameter: &Parameter) -> String {
        if candidate.kind == Kind::GravityTilt {
            parameter.unit.to_owned()
        } else {
            unit_of(parameter, self.robot.joints[candidate.joint].kind)
        }
    }

    /// For each of the shapes one column a gain over one run, joint by joint, at the full rate.
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
        if pull::is_gone(candidate.kind, run) {
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

    /// Friction of a joint's effects that acts through its contact over that of the model, sample by sample.
    fn beside(&self, joint: usize, r: usize, chosen: &[Profile], gains: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.runs[r].len()];
        let [_, coulomb] = self.friction(joint);
        let mut at = 0;
        for profile in chosen {
            let own = &gains[at..at + profile.columns.len()];
            at += own.len();
            let candidate = &profile.candidate;
            if candidate.joint != joint || !candidate.kind.acts_through_contact() {
                continue;
            }
            let terms = self.along(candidate, &profile.shapes, r, true);
            for (term, gain) in terms.iter().zip(own) {
                for (to, term) in sum.iter_mut().zip(term) {
                    *to += gain * term;
                }
            }
        }
        for value in &mut sum {
            *value = over_coulomb(*value, coulomb);
        }
        sum
    }

    /// The effect's terms sample by sample.
    fn terms(&self, candidate: &Candidate, shapes: &[f64; SHAPES], r: usize) -> Vec<Vec<f64>> {
        self.along(candidate, shapes, r, false)
    }

    /// The effect's terms sample by sample, `whole` as if each went in the positive direction.
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
        let mut memory = (run.past).remembered(&effect, candidate.joint, [viscous, coulomb]);
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
                warming: joint
                    .temperature
                    .as_ref()
                    .map_or(0.0, |t| t[k] - first_temperature),
                other: other.map_or([0.0; 3], |o| [o.q[k], o.qd[k], o.qdd[k]]),
                period: 1.0 / run.rate,
                beside: beside.map_or(0.0, |beside| beside[k]),
                // Delays and payloads have columns of their own.
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

    pub(super) fn slopes(&self, joint: usize, r: usize) -> Result<Arc<Slopes>, DiagnoseError> {
        let known = || self.slopes.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(slopes) = known().get(&(r, joint)) {
            return Ok(slopes.clone());
        }
        // Others go on meanwhile.
        let slopes = Arc::new(Slopes::of(self, joint, &self.runs[r])?);
        known().insert((r, joint), slopes.clone());
        Ok(slopes)
    }

    /// Torque of a joint without friction and offset for a motion.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn inertial(
        &self,
        joint: usize,
        motion: [&[Vec<f64>]; 3],
    ) -> Result<Vec<f64>, DiagnoseError> {
        let mut torque = vec![0.0; motion[0].first().map_or(0, Vec::len)];
        self.nominal.columns(motion, &mut |k, j, column| {
            if j == joint && !self.nominal.is_drive(k) {
                for (to, y) in torque.iter_mut().zip(column) {
                    *to += self.values[k] * y;
                }
            }
        })?;
        Ok(torque)
    }

    /// Viscous and Coulomb friction of a joint, as identified.
    fn friction(&self, joint: usize) -> [f64; 2] {
        [column::VISCOUS, column::COULOMB].map(|place| {
            let c = joint * COLUMNS + place;
            let k = self.nominal.base.columns.iter().position(|b| *b == c);
            k.map_or(0.0, |k| self.values[k])
        })
    }

    /// Inertia of a joint's drive that stands in a combination with the link's, as the description has it; 0 where it is
    /// a base parameter by itself.
    pub(super) fn drive_inertia(&self, joint: usize) -> f64 {
        if self.nominal.has_own_drive_inertia(joint) {
            return 0.0;
        }
        self.robot.standard_parameters()[joint][column::DRIVE_INERTIA]
    }

    /// What a tilt of the base by a unit angle does to the torque: one column a horizontal axis that matters.
    ///
    /// Gravity from another side also acts on what it did not act on before, first moments along an upright axis for one:
    /// they are no base parameters, and taken from the description.
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
        for row in &mut parameters {
            row[column::DRIVE_INERTIA..].fill(0.0);
        }
        let gravity = Vector3::from(self.robot.gravity);
        let rest = vec![0.0; n];
        let (mut q, mut torque) = (vec![0.0; n], vec![0.0; n]);
        let mut columns = Vec::new();
        for axis in self.nominal.tilt_axes() {
            // The base turns one way, gravity as seen from it the other; its torque is linear in it.
            let change = gravity.cross(&Vector3::from(axis));
            let chain =
                Chain::new(&self.robot.geometry(), change.into()).map_err(|e| failed(&e))?;
            let mut signals = vec![Vec::with_capacity(run.len()); n];
            for k in 0..run.len() {
                for (q, joint) in q.iter_mut().zip(&run.joints) {
                    *q = joint.q[k];
                }
                bias_torque(&chain, &parameters, &q, &rest, &mut torque).map_err(|e| failed(&e))?;
                for (signal, torque) in signals.iter_mut().zip(&torque) {
                    signal.push(*torque);
                }
            }
            columns.push(signals.into_iter().map(Some).collect());
        }
        Ok(columns)
    }
}

/// Columns of runs, one run behind the other.
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

/// A signal that comes `samples` (not whole) later; the first value holds before it begins.
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
