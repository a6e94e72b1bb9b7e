//! Trajectories as samples.

use std::collections::BTreeMap;
use std::path::Path;

use super::content::TrajectoryFile;
use crate::ExciteError;
use rig_data::{Column, RecordingWriter};
use rig_model::robot::{JointKind, Robot};

/// Reference positions at evenly spaced instants.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledReference {
    /// Sample period, s.
    pub period: f64,
    /// Per joint, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Per joint, rad/s or m/s; empty if the file does not contain it.
    pub velocity: Vec<Vec<f64>>,
    /// Per joint, rad/s² or m/s²; empty if the file does not contain it.
    pub acceleration: Vec<Vec<f64>>,
}

impl SampledReference {
    /// Creates positions only: `way(joint, t)` from the middle of each joint's range.
    pub fn about_middle(
        robot: &Robot,
        period: f64,
        seconds: f64,
        way: impl Fn(usize, f64) -> f64,
    ) -> Self {
        let rows = (seconds / period).round() as usize;
        let position = (robot.middle_position().iter().enumerate())
            .map(|(j, middle)| {
                let instants = (0..rows).map(|k| k as f64 * period);
                instants.map(|t| middle + way(j, t)).collect()
            })
            .collect();
        Self {
            period,
            position,
            velocity: Vec::new(),
            acceleration: Vec::new(),
        }
    }

    /// Creates `count` sines of `size` rad or m per joint, the slowest of `slowest` seconds, with phases `phase(joint,
    /// harmonic)` in rad. They fade in over two seconds, from rest in the middle of the range.
    pub fn eased_sines(
        robot: &Robot,
        [period, seconds]: [f64; 2],
        (count, size, slowest): (u32, f64, f64),
        phase: impl Fn(usize, u32) -> f64,
    ) -> Self {
        let turn = core::f64::consts::TAU / slowest;
        Self::about_middle(robot, period, seconds, |j, t| {
            let share = (t / 2.0).min(1.0);
            let sines = (1..=count).map(|h| {
                let phase = phase(j, h);
                (turn * f64::from(h) * t + phase).sin() - phase.sin()
            });
            share.powi(2) * (3.0 - 2.0 * share) * size * sines.sum::<f64>()
        })
    }

    /// Writes a `.csv`: columns t, and per joint q, qd, qdd and the same positions again as ref, so that it can be read as a
    /// recording. Velocities and accelerations must be there. The file is written completely or not at all.
    ///
    /// # Errors
    /// [`ExciteError`]: an error of the operating system.
    pub fn save(&self, path: &Path, robot: &Robot) -> Result<(), ExciteError> {
        let joints = self.position.len();
        let mut columns = vec![Column::new("t", "s")];
        for k in 1..=joints {
            let unit = match robot.joints.get(k - 1).map(|j| j.kind) {
                Some(JointKind::Prismatic) => "m",
                _ => "rad",
            };
            for (name, over) in [("q", ""), ("qd", "/s"), ("qdd", "/s^2"), ("ref", "")] {
                columns.push(Column::new(&format!("{name}{k}"), &format!("{unit}{over}")));
            }
        }
        let rate = (1.0 / self.period * 1e9).round() / 1e9;
        let mut writer = RecordingWriter::create(path, &columns, &BTreeMap::new())?;
        for row in 0..self.position.first().map_or(0, Vec::len) {
            let mut values = vec![row as f64 / rate];
            for j in 0..joints {
                let q = self.position[j][row];
                values.extend([q, self.velocity[j][row], self.acceleration[j][row], q]);
            }
            writer.push_row(&values)?;
        }
        Ok(writer.finish()?)
    }
}

impl TrajectoryFile {
    /// Samples the reference at evenly spaced instants, from the first to the last within the motion and one beyond,
    /// where all joints are at rest again.
    ///
    /// # Errors
    /// [`ExciteError::Option`] for a rate that is not between 1 Hz and 1 MHz, and for a motion in which the drive is
    /// switched off, because only the rig determines how the joint coasts.
    pub fn sampled(&self, rate: f64) -> Result<SampledReference, ExciteError> {
        check_rate(rate)?;
        if let Some(off) = self.drive_off {
            return Err(ExciteError::Option {
                name: "time of drive_off",
                value: format!("{off} s"),
                right: "samples are of a motion that is driven to its end; run this file with `rig record`, which switches the drive off".into(),
            });
        }
        // Rounding errors must not add a sample to a duration of a whole number of samples.
        let last = (self.duration() * rate - 1e-6).ceil().max(0.0) as usize;
        let each = |pick: fn(&rig_shared::trajectory::Reference<f64>) -> f64, offset: bool| {
            self.joints
                .iter()
                .map(|j| {
                    let base = if offset { j.start } else { 0.0 };
                    (0..=last)
                        .map(|k| base + pick(&j.trajectory.at(k as f64 / rate)))
                        .collect()
                })
                .collect::<Vec<Vec<f64>>>()
        };
        Ok(SampledReference {
            period: 1.0 / rate,
            position: each(|r| r.position, true),
            velocity: each(|r| r.velocity, false),
            acceleration: each(|r| r.acceleration, false),
        })
    }
}

/// Refuses a rate (Hz) that is not between 1 Hz and 1 MHz.
pub(super) fn check_rate(rate: f64) -> Result<(), ExciteError> {
    if !(1.0..=1e6).contains(&rate) {
        return Err(ExciteError::Option {
            name: "rate",
            value: format!("{rate} Hz"),
            right: "it must be between 1 and 1000000 Hz".into(),
        });
    }
    Ok(())
}
