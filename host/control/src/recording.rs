//! A motion as a recording.

use std::collections::BTreeMap;
use std::path::Path;

use super::closed_loop::Trace;
use super::error::ControlError;
use rig_data::{Column, RecordingWriter};
use rig_model::robot::Robot;
use rig_shared::trajectory::Reference;

/// Writes a motion with the columns t and, for each joint, q and qd (as measured), tau and ref. A motion on a surface also
/// has `pressed`, the true force along the normal, N.
///
/// # Errors
/// [`ControlError::Data`] if the file cannot be written.
pub fn save(
    path: &Path,
    robot: &Robot,
    trace: &Trace,
    reference: &[Vec<Reference<f64>>],
) -> Result<(), ControlError> {
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
    if !trace.force.is_empty() {
        columns.push(Column::new("pressed", "N"));
    }
    let metadata = BTreeMap::from([
        ("robot".to_owned(), robot.name.clone()),
        ("source".to_owned(), "simulation".to_owned()),
    ]);
    let mut writer = RecordingWriter::create(path, &columns, &metadata)?;
    for k in 0..trace.q.first().map_or(0, Vec::len) {
        let mut row = vec![k as f64 * trace.period];
        for (j, series) in reference.iter().enumerate() {
            row.extend([
                trace.measured[j][k],
                trace.velocity[j][k],
                trace.torque[j][k],
                series[k].position,
            ]);
        }
        row.extend(trace.force.get(k));
        writer.push_row(&row)?;
    }
    Ok(writer.finish()?)
}
