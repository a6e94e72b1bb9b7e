//! A trajectory run through the simulated closed loop, with the result as a recording.

use std::collections::BTreeMap;
use std::path::Path;

use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::interpolation::Samples;
use super::random::drawn;
use super::wrist_readings::{Carried, WristReadings, wrench_columns};
use super::{ExciteError, SampledReference};
use rig_data::{Column, RecordingWriter};
use rig_model::robot::{Joint, JointKind, Robot};
use rig_model::simulate::{
    Inputs, Model, Motion, STAND_IN_BANDWIDTH, Since, closed_loop_watched, controllers,
};
use rig_numerics::statistics;

/// Time that the controlled model stands before the recording begins, so that gravity is balanced, s.
pub const SETTLING: f64 = 1.0;
/// Time constant of the substitute controller's feedback, s.
const TIME_CONSTANT: f64 = 1.0 / (core::f64::consts::TAU * STAND_IN_BANDWIDTH);
/// RMS deviation from the reference, as a share of the joint's motion, above which a note is given.
const OFF: f64 = 0.1;
/// Longest step of the simulation, s: a hundredth of the controllers' fastest time constant.
pub const STEP: f64 = 0.25e-3;

/// White normal noise of the measured columns, standard deviations; 0 for none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// Position, rad or m.
    pub position: f64,
    /// Velocity, rad/s or m/s.
    pub velocity: f64,
    /// Torque, N·m or N.
    pub torque: f64,
}

/// Result of the simulated rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// Sample period, s.
    pub period: f64,
    /// Per joint, reference positions.
    pub reference: Vec<Vec<f64>>,
    /// Position, velocity and torque as measured, noise included.
    pub motion: Motion,
    /// Readings of the wrist sensor, fx fy fz, N, mx my mz, N·m, noise included; none without a sensor.
    pub wrench: Option<[Vec<f64>; 6]>,
    /// Notes for the user, one sentence each.
    pub notes: Vec<String>,
}

/// Simulates the described robot along `reference`, which starts at rest.
///
/// The recording begins after the model has stood at the first reference for one second. The controllers run at every
/// step of the simulation, at most 0.25 ms, for every rate of the recording. A loop that ran once per recorded sample,
/// at 250 Hz, was not stable in all poses of an arm and gave torque bursts from limit to limit. A described controller
/// has only the reference. A substitute also gets the described torque of the reference, without which dry friction
/// holds a light link. `progress` receives the completed and the total number of steps.
///
/// # Errors
/// [`ExciteError`]: noise that is not 0 or more, a robot without inertial parameters, gains that do not fit it.
pub fn replay(
    robot: &Robot,
    reference: &SampledReference,
    noise: Noise,
    seed: u64,
    progress: impl FnMut(u64, u64),
) -> Result<Replay, ExciteError> {
    replay_carrying(robot, &Carried::default(), reference, noise, seed, progress)
}

/// Same as [`replay`], with a load at the flange.
///
/// The load is a part of the last link, also in the torque that a substitute controller gets. If the robot has a wrist
/// sensor, it reads the load's wrench of the simulated motion before any noise, with the mean acceleration of the
/// simulation steps before and after the sample ([`LinkMotion`](rig_model::simulate::LinkMotion)). Bias and noise are
/// added, and readings are clipped at the sensor's ranges. [`LoadWrench`] says what is left out; filters and delays of
/// the sensor's electronics are left out too.
///
/// The noise of the sensor is drawn after that of the joints, so that a sensor does not change the joints' columns.
///
/// # Errors
/// Same as [`replay`]; a load with a first moment, but no mass.
///
/// [`LoadWrench`]: rig_model::simulate::LoadWrench
pub fn replay_carrying(
    robot: &Robot,
    carried: &Carried,
    reference: &SampledReference,
    noise: Noise,
    seed: u64,
    mut progress: impl FnMut(u64, u64),
) -> Result<Replay, ExciteError> {
    check_noise(noise)?;
    carried.check()?;
    let mut readings = WristReadings::of(robot, carried)?;
    let carrying = carried.load.as_ref().map(|load| robot.with_load(load));
    let robot = carrying.as_ref().unwrap_or(robot);
    let model = Model::from_robot(robot)?;
    let start: Vec<f64> = reference
        .position
        .iter()
        .map(|q| q.first().copied().unwrap_or(0.0))
        .collect();
    let (controllers, stand_ins) = controllers(robot, &model, &start)?;
    let mut notes: Vec<String> = stand_in_note(&stand_ins).into_iter().collect();
    notes.extend(model.effects.unsimulated());
    let (step, cells) = cells(reference.period);
    let settling = (SETTLING / reference.period).ceil() as usize * cells;
    let asked = asked_positions(reference, &start, settling, cells);
    let total = asked.iter().map(Vec::len).min().unwrap_or(0);
    let gains = controllers.iter().zip(&robot.joints).map(|(own, joint)| {
        let stand_in = joint.controller.is_none();
        stand_in.then_some(own.torque_gain * own.velocity_gain)
    });
    let gains: Vec<Option<f64>> = gains.collect();
    let feed_forward = feed_forward(&model, &gains, &asked, step)?;
    let inputs = Inputs {
        period: step,
        reference: &asked,
        feed_forward: &feed_forward,
        added: &[],
        q: &start,
        v: &vec![0.0; start.len()],
        substeps: (step / STEP).ceil().max(1.0) as u32,
        held: false,
    };
    let is_recorded = |k: usize| k >= settling && (k - settling).is_multiple_of(cells);
    let mut motion = closed_loop_watched(
        robot,
        &model,
        &controllers,
        &inputs,
        &Since::default(),
        |k, links| {
            if let Some(readings) = readings.as_mut().filter(|_| is_recorded(k)) {
                readings.push(links);
            }
            progress(k as u64 + 1, total as u64);
        },
    )?;
    notes.extend(saturation_notes(robot, &motion, step, total));
    notes.extend(tracking_notes(robot, &motion, &asked));
    for series in [&mut motion.q, &mut motion.qd, &mut motion.tau] {
        for list in series {
            *list = list.iter().skip(settling).step_by(cells).copied().collect();
        }
    }
    let mut random = Pcg64::seed_from_u64(seed);
    disturb(&mut motion, noise, &mut random);
    if let Some(readings) = &mut readings {
        notes.extend(readings.disturb(carried, &mut random));
    }
    Ok(Replay {
        period: reference.period,
        reference: reference.position.clone(),
        motion,
        wrench: readings.map(|readings| readings.rows),
        notes,
    })
}

/// Rejects noise that is no standard deviation.
fn check_noise(noise: Noise) -> Result<(), ExciteError> {
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
    Ok(())
}

/// Returns a note on joints with a substitute for the controller, if there are any.
fn stand_in_note(stand_ins: &[String]) -> Option<String> {
    (!stand_ins.is_empty()).then(|| {
        format!(
            "No [joint.controller] is described for {}; a stand-in of {STAND_IN_BANDWIDTH} Hz bandwidth with feed-forward \
             of the reference ran {}.",
            stand_ins.join(", "),
            if stand_ins.len() == 1 { "it" } else { "each" }
        )
    })
}

/// Returns the reference at every cell, after `settling` cells at its start.
fn asked_positions(
    reference: &SampledReference,
    start: &[f64],
    settling: usize,
    cells: usize,
) -> Vec<Vec<f64>> {
    reference
        .position
        .iter()
        .zip(start)
        .map(|(q, first)| {
            let rest = std::iter::repeat_n(*first, settling);
            rest.chain(refined(q, cells)).collect()
        })
        .collect()
}

/// Returns notes on joints at their torque limit, of `total` steps.
fn saturation_notes(robot: &Robot, motion: &Motion, step: f64, total: usize) -> Vec<String> {
    let mut notes = Vec::new();
    for (joint, cut) in robot.joints.iter().zip(&motion.saturated) {
        if *cut > 0 {
            notes.push(format!(
                "The torque limit of joint \"{}\" cut in for {:.3} of {:.3} s; there the motion is not the reference's.",
                joint.name,
                *cut as f64 * step,
                total as f64 * step,
            ));
        }
    }
    notes
}

/// Returns notes on joints with a large tracking error.
fn tracking_notes(robot: &Robot, motion: &Motion, asked: &[Vec<f64>]) -> Vec<String> {
    let mut notes = Vec::new();
    for ((joint, q), asked) in robot.joints.iter().zip(&motion.q).zip(asked) {
        let (off, moved) = followed(q, asked);
        if off > OFF * moved {
            let of = match moved > 0.0 {
                true => format!(
                    "{:.0} % of the motion that was asked for",
                    100.0 * off / moved
                ),
                false => "though it should rest".to_owned(),
            };
            notes.push(format!(
                "Joint \"{}\" is off its reference by {off} {unit} RMS, {of}: the recording shows what it did, not what was designed.",
                joint.name,
                off = rig_output::format_significant(off, 4),
                unit = joint.kind.units().0,
            ));
        }
    }
    notes
}

/// Adds noise to the measured columns.
fn disturb(motion: &mut Motion, noise: Noise, random: &mut Pcg64) {
    for (series, deviation) in [
        (&mut motion.q, noise.position),
        (&mut motion.qd, noise.velocity),
        (&mut motion.tau, noise.torque),
    ] {
        for list in series {
            for value in list.iter_mut() {
                *value += drawn(random, deviation);
            }
        }
    }
}

/// Returns the RMS deviation of a joint, and the RMS of its reference about the mean.
fn followed(q: &[f64], asked: &[f64]) -> (f64, f64) {
    let count = asked.len() as f64;
    let mean = statistics::mean(asked);
    let (mut off, mut moved) = (0.0, 0.0);
    for (q, asked) in q.iter().zip(asked) {
        off += (q - asked).powi(2);
        moved += (asked - mean).powi(2);
    }
    ((off / count).sqrt(), (moved / count).sqrt())
}

/// Splits a sample period into cells of at most a sixteenth of the substitute's time constant; returns their length in
/// s and number. Otherwise references and feed-forward of a slow recorder would have steps that a fast one's lack.
fn cells(period: f64) -> (f64, usize) {
    let cells = (16.0 * period / TIME_CONSTANT).ceil().max(1.0);
    (period / cells, cells as usize)
}

/// Interpolates the series with `cells` values per sample. It is at rest before it begins.
fn refined(list: &[f64], cells: usize) -> Vec<f64> {
    if cells == 1 {
        return list.to_vec();
    }
    let count = list.len().saturating_sub(1) * cells + list.len().min(1);
    let samples = Samples {
        period: 1.0,
        position: list,
        rates: None,
    };
    let value = |cell: usize| samples.at(cell as f64 / cells as f64).position;
    (0..count).map(value).collect()
}

/// Returns sample `k` with its neighbours, one before and two after it.
fn around(list: &[f64], k: usize) -> [f64; 4] {
    let (before, now) = (list[k.saturating_sub(1)], list[k]);
    let next = list.get(k + 1).copied().unwrap_or(now);
    let last = before + 3.0 * (next - now);
    [before, now, next, list.get(k + 2).copied().unwrap_or(last)]
}

/// Returns the model's torques for its reference, and the torques from the reference's speed for the controllers' own
/// `gains`; one list per joint, empty without a gain. The torques are inverse dynamics with friction, averaged over a
/// time constant of the substitute on either side. So corners of the reference and steps of dry friction are smooth
/// enough for the feedback. Effects beyond the standard model are left to the feedback.
fn feed_forward(
    model: &Model,
    gains: &[Option<f64>],
    reference: &[Vec<f64>],
    step: f64,
) -> Result<Vec<Vec<f64>>, ExciteError> {
    let samples = reference.iter().map(Vec::len).min().unwrap_or(0);
    let mut sums = vec![vec![0.0]; gains.len()];
    let [mut q, mut qd, mut qdd, mut torque] = [(); 4].map(|()| vec![0.0; gains.len()]);
    for k in 0..samples.saturating_sub(1) {
        for (j, list) in reference.iter().enumerate() {
            let [a, b, c, d] = around(list, k);
            q[j] = 0.5 * (b + c);
            qd[j] = (c - b) / step;
            qdd[j] = 0.5 * (a - b - c + d) / step.powi(2);
        }
        model.inverse_dynamics(&q, &qd, &qdd, &mut torque)?;
        for (j, sum) in sums.iter_mut().enumerate() {
            sum.push(sum[k] + torque[j] + gains[j].unwrap_or(0.0) * qd[j]);
        }
    }
    let reach = (TIME_CONSTANT / step).round() as usize;
    let mean = |sum: &[f64], k: usize| {
        let (low, high) = (k.saturating_sub(reach), (k + reach).min(sum.len() - 1));
        (sum[high] - sum[low]) / (high - low) as f64
    };
    let smooth = |(sum, gain): (&Vec<f64>, &Option<f64>)| match gain {
        Some(_) if sum.len() > 1 => (0..samples).map(|k| mean(sum, k)).collect(),
        _ => Vec::new(),
    };
    Ok(sums.iter().zip(gains).map(smooth).collect())
}

impl Replay {
    /// Rounds the positions to the described encoders: 2π/(counts · gear ratio) of a revolute joint. Velocities keep
    /// their values, because no description tells how the robot derives them. A joint without `encoder_counts_per_rev`,
    /// prismatic, or with a drive of varying or coupled ratio is rounded to the step `otherwise` (rad or m), or not at
    /// all; returns one note for each.
    pub fn quantise(&mut self, robot: &Robot, otherwise: Option<f64>) -> Vec<String> {
        let mut notes = Vec::new();
        for (q, joint) in self.motion.q.iter_mut().zip(&robot.joints) {
            let step = match (encoder_step(joint), otherwise) {
                (Ok(step), _) => step,
                (Err(why), Some(step)) => {
                    notes.push(format!(
                        "The position of joint {} is rounded to steps of {step} {}: {why}.",
                        joint.name,
                        joint.kind.units().0
                    ));
                    step
                }
                (Err(why), None) => {
                    notes.push(format!(
                        "The position of joint {} is not quantised: {why}.",
                        joint.name
                    ));
                    continue;
                }
            };
            q.iter_mut().for_each(|q| *q = (*q / step).round() * step);
        }
        notes
    }

    /// Writes the recording: t, per joint q, qd, tau and ref, and the wrist sensor's readings if there are any. The file is written completely or not at all.
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
        if self.wrench.is_some() {
            columns.extend(wrench_columns());
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
            values.extend(self.wrench.iter().flatten().map(|axis| axis[row]));
            writer.push_row(&values)?;
        }
        Ok(writer.finish()?)
    }
}

/// Returns the step of a joint's encoder, rad, or why it has none.
fn encoder_step(joint: &Joint) -> Result<f64, &'static str> {
    let none = "its description has no encoder_counts_per_rev";
    let drive = joint.drive.as_ref().ok_or(none)?;
    let counts = drive.encoder_counts_per_rev.ok_or(none)?;
    if joint.kind != JointKind::Revolute || drive.screw.is_some() || !drive.couples.is_empty() {
        return Err("its drive has no constant ratio of a revolute joint");
    }
    Ok(core::f64::consts::TAU / (counts * drive.gear_ratio).abs())
}
