//! Reads a trajectory as samples.

use std::path::Path;

use super::content::TrajectoryFile;
use super::samples::SampledReference;
use crate::ExciteError;
use rig_data::{EffortNeed, Source};
use rig_model::robot::Robot;

/// Reads a trajectory as samples: a `.toml` trajectory sampled at `rate` (Hz), or the `ref` columns of a sampled one
/// (its `q` columns if there are none) at its own rate.
///
/// # Errors
/// [`ExciteError`] with the place of the error.
pub fn load_reference(
    path: &Path,
    robot: &Robot,
    rate: f64,
) -> Result<SampledReference, ExciteError> {
    let extension = path
        .extension()
        .and_then(|e| e.to_str())
        .map(str::to_ascii_lowercase);
    if extension.as_deref() == Some("toml") {
        let file = TrajectoryFile::load(path)?;
        file.fits(robot, path)?;
        return file.sampled(rate);
    }
    let source = Source::open_with(path, robot, EffortNeed::Optional)?;
    let mut sampled = SampledReference {
        period: source.sampling().period,
        position: vec![Vec::new(); robot.joints.len()],
        velocity: Vec::new(),
        acceleration: Vec::new(),
    };
    let uneven = |row| ExciteError::Uneven {
        path: path.into(),
        row,
    };
    for (k, block) in source.read_all()?.0.iter().enumerate() {
        if source.sampling().irregular || k > 0 {
            return Err(uneven(block.first_line));
        }
        for (to, from) in sampled.position.iter_mut().zip(&block.joints) {
            to.extend(from.reference.as_ref().unwrap_or(&from.q));
        }
    }
    // One sample has no period.
    if sampled.period <= 0.0 {
        return Err(uneven(1));
    }
    Ok(sampled)
}
