//! Simulated recordings.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use rig::commands::CommandError;
use rig_diagnose::voltage::replay_voltage;
use rig_excite::{Noise, load_reference, replay};
use rig_model::robot;

use crate::error::{Error, warn};
use crate::recording::{Recording, RecordingFile};
use crate::robot::Robot;
use crate::trajectory::Trajectory;
use crate::watch::{Watch, run};

/// The work of [`simulate`], without Python.
struct Job {
    rate: f64,
    noise: Noise,
    seed: u64,
}

impl Job {
    /// Simulates the robot along the trajectory in a file and writes the recording. Returns the notes.
    fn recorded(
        &self,
        robot: &robot::Robot,
        trajectory: &Path,
        out: &Path,
        watch: &Watch,
    ) -> Result<Vec<String>, CommandError> {
        if let [joint] = robot.joints.as_slice()
            && joint.voltage_controller.is_some()
            && joint.controller.is_none()
        {
            let done = replay_voltage(robot, trajectory, self.rate, self.noise, self.seed)?;
            done.save(out, robot)?;
            return Ok(done.notes);
        }
        let reference = load_reference(trajectory, robot, self.rate)?;
        let done = replay(robot, &reference, self.noise, self.seed, |done, total| {
            watch.at_or_unwind(done as f64 / total.max(1) as f64);
        })?;
        done.save(out, robot)?;
        Ok(done.notes)
    }
}

/// Simulate the robot following a trajectory, with its effects, drives and controller, as ``rig simulate``.
///
/// ``trajectory``: a :class:`Trajectory`, or the path of a .toml or .csv file. ``rate``: Hz.
/// ``noise_position``, ``noise_velocity``, ``noise_torque``: standard deviations, SI. Returns a :class:`Recording`.
#[pyfunction]
#[pyo3(signature = (
    robot, trajectory, *, rate = 1000.0, noise_position = 0.0, noise_velocity = 0.0, noise_torque = 0.0, seed = 1,
    name = "simulation", progress = None,
))]
pub(crate) fn simulate(
    py: Python<'_>,
    robot: &Robot,
    trajectory: &Bound<'_, PyAny>,
    rate: f64,
    noise_position: f64,
    noise_velocity: f64,
    noise_torque: f64,
    seed: u64,
    name: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<Recording> {
    let job = Job {
        rate,
        noise: Noise {
            position: noise_position,
            velocity: noise_velocity,
            torque: noise_torque,
        },
        seed,
    };
    let designed = trajectory
        .cast::<Trajectory>()
        .ok()
        .map(|own| own.get().file());
    let path: Option<PathBuf> = match designed {
        Some(_) => None,
        None => Some(trajectory.extract().map_err(|_| {
            Error::new_err(format!(
                "{trajectory} is no trajectory; give one of excite(), or the path of a .toml or .csv file."
            ))
        })?),
    };
    let description = robot.description();
    let name = name.to_owned();
    let (file, notes) = run(py, progress.as_ref(), &|text| text, move |watch| {
        let robot = &description.robot;
        let mut notes = Vec::new();
        let file = RecordingFile::temporary(&name, |out| {
            let beside = out.with_file_name("trajectory.toml");
            if let Some(designed) = &designed {
                designed.save(&beside, robot, rate)?;
            }
            let path = path.as_deref().unwrap_or(&beside);
            notes = job.recorded(robot, path, out, watch)?;
            Ok(())
        });
        Ok((file?, notes))
    })?;
    warn(py, &notes)?;
    Ok(Recording::of(file))
}
