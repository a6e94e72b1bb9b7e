//! A trajectory run through the simulated closed loop, as a recording would show it.

use std::collections::BTreeMap;
use std::path::Path;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::{ExciteError, SampledReference};
use crate::data::{Column, RecordingWriter};
use crate::robot::Robot;
use crate::simulate::{Inputs, Model, Motion, STAND_IN_BANDWIDTH, closed_loop, controllers};

/// The model stands in its controller for so long before the recording begins that gravity has found its balance, s.
const SETTLING: f64 = 1.0;
/// Longest step of the simulation, s: a hundredth of the fastest time constant that the controllers here have.
pub(crate) const STEP: f64 = 0.25e-3;

/// White normal noise of the measured columns, standard deviations; 0 for none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// rad or m
    pub position: f64,
    /// rad/s or m/s
    pub velocity: f64,
    /// N·m or N
    pub torque: f64,
}

/// What the simulated rig did.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// Sample period, s.
    pub period: f64,
    /// Per joint, reference positions.
    pub reference: Vec<Vec<f64>>,
    /// Position, velocity and torque as measured, noise included.
    pub motion: Motion,
    /// What the user should know, one sentence each.
    pub notes: Vec<String>,
}

/// Simulates the robot of a description following `reference`, which is at rest where it begins.
///
/// The recording begins when the model has stood at the first reference for one second. The controllers run at every step of the
/// simulation, 0.25 ms at most, whatever the rate of the recording: a loop that runs once a recorded sample, at 250 Hz, was not
/// stable in all poses of an arm and made bursts of torque from limit to limit. `progress` is told how many samples are done, and of
/// how many.
///
/// # Errors
/// [`ExciteError`]: noise that is not 0 or more, a robot without inertial parameters, gains that do not fit it.
pub fn replay(
    robot: &Robot,
    reference: &SampledReference,
    noise: Noise,
    seed: u64,
    mut progress: impl FnMut(u64, u64),
) -> Result<Replay, ExciteError> {
    for (name, value) in [
        ("position noise", noise.position),
        ("velocity noise", noise.velocity),
        ("torque noise", noise.torque),
    ] {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(ExciteError::Option {
                name,
                value: value.to_string(),
                right: "it is a standard deviation: 0 or more".into(),
            });
        }
    }
    let model = Model::from_robot(robot)?;
    let start: Vec<f64> = reference
        .position
        .iter()
        .map(|q| q.first().copied().unwrap_or(0.0))
        .collect();
    let (controllers, stand_ins) = controllers(robot, &model, &start)?;
    let mut notes = Vec::new();
    if !stand_ins.is_empty() {
        notes.push(format!(
            "No [joint.controller] is described for {}; a stand-in of {STAND_IN_BANDWIDTH} Hz bandwidth ran {}.",
            stand_ins.join(", "),
            if stand_ins.len() == 1 { "it" } else { "each" }
        ));
    }
    notes.extend(model.effects.unsimulated());
    let settling = (SETTLING / reference.period).ceil() as usize;
    let with_rest: Vec<Vec<f64>> = reference
        .position
        .iter()
        .zip(&start)
        .map(|(q, first)| {
            let rest = std::iter::repeat_n(*first, settling);
            rest.chain(q.iter().copied()).collect()
        })
        .collect();
    let total = with_rest.iter().map(Vec::len).min().unwrap_or(0) as u64;
    let inputs = Inputs {
        period: reference.period,
        reference: &with_rest,
        added: &[],
        q: &start,
        v: &vec![0.0; start.len()],
        substeps: (reference.period / STEP).ceil().max(1.0) as u32,
        held: false,
    };
    let mut motion = closed_loop(robot, &model, &controllers, &inputs, |done| {
        progress(done as u64, total);
    })?;
    for (joint, cut) in robot.joints.iter().zip(&motion.saturated) {
        if *cut > 0 {
            notes.push(format!(
                "The torque limit of joint \"{}\" cut in at {cut} of {total} samples; there the motion is not the reference's.",
                joint.name
            ));
        }
    }
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut disturb = |series: &mut Vec<Vec<f64>>, deviation: f64| {
        for list in series {
            list.drain(..settling.min(list.len()));
            for value in list.iter_mut() {
                // Drawn also where the deviation is 0: one noise must not change the other's numbers.
                let unit: f64 = StandardNormal.sample(&mut random);
                *value += deviation * unit;
            }
        }
    };
    disturb(&mut motion.q, noise.position);
    disturb(&mut motion.qd, noise.velocity);
    disturb(&mut motion.tau, noise.torque);
    Ok(Replay {
        period: reference.period,
        reference: reference.position.clone(),
        motion,
        notes,
    })
}

impl Replay {
    /// Writes the recording: t, and per joint q, qd, tau and ref. The file appears whole or not at all.
    ///
    /// # Errors
    /// [`ExciteError::Data`].
    pub fn save(&self, path: &Path, robot: &Robot) -> Result<(), ExciteError> {
        let mut columns = vec![Column::new("t", "s")];
        for (k, joint) in robot.joints.iter().enumerate() {
            let (length, force) = joint.kind.units();
            let speed = format!("{length}/s");
            for (name, unit) in [
                ("q", length),
                ("qd", &speed),
                ("tau", force),
                ("ref", length),
            ] {
                columns.push(Column::new(&format!("{name}{}", k + 1), unit));
            }
        }
        let metadata = BTreeMap::from([
            ("robot".to_owned(), robot.name.clone()),
            ("source".to_owned(), "simulation".to_owned()),
        ]);
        let mut writer = RecordingWriter::create(path, &columns, &metadata)?;
        for row in 0..self.motion.q.first().map_or(0, Vec::len) {
            let mut values = vec![row as f64 * self.period];
            for j in 0..robot.joints.len() {
                values.extend([
                    self.motion.q[j][row],
                    self.motion.qd[j][row],
                    self.motion.tau[j][row],
                    self.reference[j][row],
                ]);
            }
            writer.push_row(&values)?;
        }
        Ok(writer.finish()?)
    }
}
