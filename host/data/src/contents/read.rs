//! Reads what a file holds.

use std::path::Path;

use super::intake::refusal;
use super::likely::propose;
use super::messages::messages;
use super::stored_columns::stored_columns;
use super::table::table;
use super::text::text;
use super::topic::Contents;
use crate::error::DataError;
use crate::form::{Arrays, Form};
use crate::joint_names::is_in_joint;
use rig_model::robot::Robot;

/// Reads what a file of measurements, or a folder of rosbag2, holds, and tries whether `rig identify` reads it: for `robot`,
/// if it is known. `advance` takes the number of bytes read so far; all are read twice.
///
/// # Errors
/// [`DataError`]: a file that cannot be read, or of a format that is not supported. Damaged, missing and unusual parts are
/// no error; [`Contents::faults`] names them.
pub fn contents(
    path: &Path,
    robot: Option<&Robot>,
    advance: &mut dyn FnMut(u64),
) -> Result<Contents, DataError> {
    let (form, bytes) = Form::of(path)?;
    let joints = robot.map_or(&[][..], |robot| robot.joints.as_slice());
    let joints: Vec<String> = joints.iter().map(|joint| joint.name.clone()).collect();
    let (format, mut topics, remarks, faults) = match &form {
        Form::Csv => {
            let found = text(path, advance)?;
            ("text table", vec![found.topic], found.remarks, found.faults)
        }
        Form::Arrays(form) => {
            let (topic, remarks) = table(path, *form)?;
            let format = match form {
                Arrays::NumPy => "NumPy archive",
                Arrays::Matlab | Arrays::Matlab73 => "MATLAB file",
            };
            (format, vec![topic], remarks, Vec::new())
        }
        Form::Parquet => {
            let (topic, remarks) = stored_columns(path, advance)?;
            ("Parquet file", vec![topic], remarks, Vec::new())
        }
        Form::Messages(files) => {
            let found = messages(path, files, advance)?;
            let format = if path.is_dir() {
                "bag of rosbag2"
            } else {
                "log of messages"
            };
            (format, found.topics, found.remarks, found.faults)
        }
    };
    for channel in topics.iter_mut().flat_map(|topic| &mut topic.channels) {
        if !channel.is_element && is_in_joint(&channel.name, &joints) {
            channel.unit = None;
        }
    }
    let mut proposal = propose(&topics, &joints);
    if !proposal.columns.is_empty() {
        let mut second = |read: u64| advance(bytes + read);
        proposal.refusal = refusal(path, &proposal, &topics, robot, &mut second);
    }
    let time = proposal.columns.iter().find(|own| own.column == "t");
    for topic in &mut topics {
        match (topic.name.is_empty(), time) {
            (false, _) => topic.time.set_unit("s"),
            (true, Some(time)) => topic.time.set_unit(time.unit.unwrap_or("s")),
            (true, None) => {}
        }
    }
    Ok(Contents {
        format,
        bytes,
        topics,
        remarks,
        faults,
        proposal,
    })
}
