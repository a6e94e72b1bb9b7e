//! A trajectory followed by a voltage-driven joint, as a recording.

use std::collections::BTreeMap;
use std::path::Path;

use rand::SeedableRng;
use rand_pcg::Pcg64;

use crate::voltage::driven::{DrivenError, Reference, VoltageModel, reference_of};
use rig_data::DataError;
use rig_data::{Column, EffortNeed, RecordingWriter, Source};
use rig_excite::{ExciteError, Noise, SETTLING, drawn, load_reference};
use rig_model::robot::Robot;

/// Reasons why a trajectory cannot be followed under voltage.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The description has no model under voltage, or its simulation ends early.
    #[error(transparent)]
    Driven(#[from] DrivenError),
    /// The trajectory.
    #[error(transparent)]
    Trajectory(#[from] ExciteError),
    /// A recording cannot be read or written.
    #[error(transparent)]
    Data(#[from] DataError),
}

/// Motion of the simulated joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VoltageReplay {
    /// s
    pub t: Vec<f64>,
    /// Reference position, rad or m.
    pub reference: Vec<f64>,
    /// Measured position with noise, rad or m.
    pub position: Vec<f64>,
    /// Measured velocity with noise, rad/s or m/s.
    pub velocity: Vec<f64>,
    /// Voltage at the motor, V.
    pub voltage: Vec<f64>,
    /// Supply, V.
    pub supply: Vec<f64>,
    /// Notes for the user, one sentence each.
    pub notes: Vec<String>,
}

/// Simulates a description's only joint under voltage along the trajectory of a file, with the described controller and
/// supply. A recording is followed at its own instants, from its own first state. A trajectory of `rig excite` starts
/// after the model has stood at its first reference for one second.
///
/// # Errors
/// [`ReplayError`]: a file without a reference, a description without a controller or voltage parameters.
pub fn replay_voltage(
    robot: &Robot,
    path: &Path,
    rate: f64,
    noise: Noise,
    seed: u64,
) -> Result<VoltageReplay, ReplayError> {
    let model = VoltageModel::of(robot)?;
    let (reference, settling) = reference(robot, path, rate)?;
    let states = model.replay(&robot.joints[0].name, &reference)?;
    let mut random = Pcg64::seed_from_u64(seed);
    let mut disturbed = |value: f64, deviation: f64| value + drawn(&mut random, deviation);
    let mut done = VoltageReplay {
        notes: model
            .left_out
            .into_iter()
            .map(crate::voltage::sentences::left_out)
            .collect(),
        ..VoltageReplay::default()
    };
    let rows = reference.t.iter().zip(&reference.position).zip(&states);
    let first = reference.t.get(settling).copied().unwrap_or(0.0);
    for ((t, position), state) in rows.skip(settling) {
        done.t.push(if settling > 0 { t - first } else { *t });
        done.reference.push(*position);
        done.position
            .push(disturbed(state.position, noise.position));
        done.velocity
            .push(disturbed(state.velocity, noise.velocity));
        done.voltage.push(state.voltage);
        done.supply.push(state.supply);
    }
    Ok(done)
}

/// Returns the reference of a file, and its number of settling rows.
fn reference(robot: &Robot, path: &Path, rate: f64) -> Result<(Reference, usize), ReplayError> {
    let designed = path
        .extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("toml"));
    if !designed {
        let source = Source::open_with(path, robot, EffortNeed::Optional)?;
        if let Some(reference) = reference_of(&source)? {
            return Ok((reference, 0));
        }
    }
    let sampled = load_reference(path, robot, rate)?;
    let settling = (SETTLING / sampled.period).ceil() as usize;
    let first = sampled.position[0].first().copied().unwrap_or(0.0);
    let rest = std::iter::repeat_n(first, settling);
    let position: Vec<f64> = rest.chain(sampled.position[0].iter().copied()).collect();
    let reference = Reference {
        t: (0..position.len())
            .map(|k| k as f64 * sampled.period)
            .collect(),
        position,
        start: [first, 0.0],
    };
    Ok((reference, settling))
}

impl VoltageReplay {
    /// Writes the recording: t, q1, qd1, u1, supply and ref1. The file appears complete or not at all.
    ///
    /// # Errors
    /// [`ReplayError::Data`].
    pub fn save(&self, path: &Path, robot: &Robot) -> Result<(), ReplayError> {
        let length = robot.joints[0].kind.units().0;
        let columns = [
            Column::new("t", "s"),
            Column::new("q1", length),
            Column::new("qd1", &format!("{length}/s")),
            Column::new("u1", "V"),
            Column::new("supply", "V"),
            Column::new("ref1", length),
        ];
        let metadata = BTreeMap::from([
            ("robot".to_owned(), robot.name.clone()),
            ("source".to_owned(), "simulation".to_owned()),
        ]);
        let mut writer = RecordingWriter::create(path, &columns, &metadata)?;
        for k in 0..self.t.len() {
            writer.push_row(&[
                self.t[k],
                self.position[k],
                self.velocity[k],
                self.voltage[k],
                self.supply[k],
                self.reference[k],
            ])?;
        }
        Ok(writer.finish()?)
    }
}
