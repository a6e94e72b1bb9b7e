//! Single control ticks that the board stored.

use std::path::Path;
use std::time::Duration;

use rig_shared::safety::{FaultRecord, SnapshotSample};
use rig_shared::wire::message::{Greeting, Report, SnapshotPart};

use super::super::error::CommandError;
use rig_data::{Column, CsvWriter};
use rig_link::{Port, Session};

/// Longest wait for all parts of a capture, in addition to the time of the ticks that are still to be captured.
const PART_PATIENCE: Duration = Duration::from_secs(2);

/// Control ticks stored by the rig, and the fault that they belong to.
#[derive(Default)]
pub(super) struct Kept {
    pub(super) ticks: Vec<SnapshotSample>,
    pub(super) fault: Option<FaultRecord>,
}

/// Fetches the requested control ticks, part by part. `time`: time of the ticks that are still to be captured.
pub(super) fn fetch<P: Port>(
    session: &mut Session<P>,
    time: Duration,
    part_of: impl Fn(&Report) -> Option<&SnapshotPart>,
) -> Result<Kept, CommandError> {
    let begin = session.port().now();
    let (mut kept, mut total) = (Kept::default(), usize::MAX);
    while kept.ticks.len() < total {
        let left = (begin + PART_PATIENCE + time).saturating_sub(session.port().now());
        let report = session.next_report(left)?;
        if let Some(Report::Fault(record)) = &report {
            kept.fault = Some(*record);
        }
        let got = kept.ticks.len();
        let Some(report) = report else {
            return Err(CommandError::Sentence(format!(
                "The rig stopped sending after {got} of its stored control ticks; run the command again."
            )));
        };
        let Some(part) = part_of(&report) else {
            continue;
        };
        if usize::from(part.first) != got {
            return Err(CommandError::Sentence(format!(
                "A part of the stored control ticks, after tick {got}, was lost on the line; run the command again."
            )));
        }
        total = usize::from(part.total);
        kept.ticks.extend(part.samples.iter().copied());
    }
    Ok(kept)
}

/// Writes control ticks as CSV, in SI units.
pub(super) fn write(
    greeting: &Greeting,
    ticks: &[SnapshotSample],
    out: &Path,
) -> Result<(), CommandError> {
    let rate = f64::from(greeting.control_rate_hz);
    let per_count = core::f64::consts::TAU
        / (f64::from(greeting.counts_per_motor_turn) * f64::from(greeting.gear_ratio));
    let columns = [
        ("t", "s"),
        ("q1", "rad"),
        ("i1", "A"),
        ("duty1", ""),
        ("supply", "V"),
        ("ref1", "rad"),
    ];
    let mut writer = CsvWriter::create(out, &columns.map(|(name, unit)| Column::new(name, unit)))?;
    for sample in ticks {
        writer.push_row(&[
            sample.tick as f64 / rate,
            sample.position as f64 * per_count,
            f64::from(sample.current),
            f64::from(sample.duty),
            f64::from(sample.supply),
            f64::from(sample.reference),
        ])?;
    }
    writer.finish()?;
    Ok(())
}
