//! Writes a scenario's description and recordings as files for other programs.

use std::collections::BTreeMap;
use std::path::Path;

use super::error::ScenarioError;
use rig_data::prepare::InMemory;
use rig_data::{Block, Column, DataError, JointColumns, RecordingWriter};
use rig_model::robot::Robot;
use rig_output::write_whole;

/// Writes `robot.toml` and the given recordings, by name, into a folder that exists.
///
/// # Errors
/// A file cannot be written.
pub(super) fn write_all(
    folder: &Path,
    robot: &Robot,
    recordings: &[(&str, Option<&InMemory>)],
) -> Result<(), ScenarioError> {
    let failed = |error: &dyn std::fmt::Display| ScenarioError(error.to_string());
    let text = robot.to_toml().map_err(|error| failed(&error))?;
    write_whole(&folder.join("robot.toml"), text.as_bytes()).map_err(|error| failed(&error))?;
    for (name, recording) in recordings {
        if let Some(recording) = recording {
            write_csv(&folder.join(name), &recording.blocks).map_err(|error| failed(&error))?;
        }
    }
    Ok(())
}

fn write_csv(path: &Path, blocks: &[Block]) -> Result<(), DataError> {
    let joints = blocks.first().map_or(0, |block| block.joints.len());
    let mut columns = vec![Column::new("t", "s")];
    let every =
        |has: fn(&JointColumns) -> bool| (blocks.iter()).all(|block| block.joints.iter().all(has));
    let voltages = every(|joint| joint.voltage.is_some());
    let links = every(|joint| joint.link.is_some());
    for joint in 1..=joints {
        for (name, unit) in [("q", "rad"), ("tau", "N*m"), ("ref", "rad")] {
            columns.push(Column::new(&format!("{name}{joint}"), unit));
        }
        if voltages {
            columns.push(Column::new(&format!("u{joint}"), "V"));
        }
    }
    if links {
        columns.extend((1..=joints).map(|joint| Column::new(&format!("ql{joint}"), "rad")));
    }
    let mut writer = RecordingWriter::create(path, &columns, &BTreeMap::new())?;
    let mut row = Vec::with_capacity(columns.len());
    for block in blocks {
        for (k, &t) in block.t.iter().enumerate() {
            row.clear();
            row.push(t);
            for joint in &block.joints {
                let at = |column: Option<&Vec<f64>>| {
                    column.and_then(|c| c.get(k)).copied().unwrap_or(f64::NAN)
                };
                row.extend([
                    at(Some(&joint.q)),
                    at(Some(&joint.tau)),
                    at(joint.reference.as_ref()),
                ]);
                if voltages {
                    row.push(at(joint.voltage.as_ref()));
                }
            }
            if links {
                let links = block.joints.iter().filter_map(|j| j.link.as_ref());
                row.extend(links.map(|link| link.get(k).copied().unwrap_or(f64::NAN)));
            }
            writer.push_row(&row)?;
        }
    }
    writer.finish()
}
