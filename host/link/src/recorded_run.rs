//! One experiment, recorded to a file and in memory.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use rig_shared::trajectory::Trajectory;
use rig_shared::wire::message::{Estimate, RequestBody};

use rig_data::{Column, DataError, RecordingWriter};

use super::experiment::{Experiment, run};
use super::{
    COLUMNS, Converter, Event, LinkError, LossReport, Port, Row, Session, UNITS, describe_fault,
};

/// Leaves a rig at rest, disarmed, for `seconds` of its own time.
///
/// # Errors
/// Errors of the link.
pub fn pause<P: Port>(session: &mut Session<P>, seconds: f64) -> Result<(), LinkError> {
    let waiting = Experiment {
        rest: seconds,
        ..Experiment::default()
    };
    run(session, &waiting, |_| ControlFlow::Continue(()))?;
    Ok(())
}

/// Reason why an experiment was not recorded completely.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The line to the rig.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The file.
    #[error(transparent)]
    Data(#[from] DataError),
    /// The rig stopped by itself.
    #[error("The rig has stopped. {0}")]
    Fault(String),
}

/// A recorded run.
pub struct RecordedRun {
    /// All samples received.
    pub rows: Vec<Row>,
    /// All on-line estimates received, with their time, s.
    pub estimates: Vec<(f64, Estimate)>,
    /// Counts of received and lost samples.
    pub losses: LossReport,
    /// Time at which the trajectory ended and the rest started, s.
    pub motion_end: f64,
}

impl RecordedRun {
    /// Runs a trajectory and writes the received samples to `path`.
    ///
    /// # Errors
    /// An error of the link or the file, or a fault of the rig.
    pub fn record<P: Port>(
        session: &mut Session<P>,
        settings: Vec<RequestBody>,
        motion: &Trajectory<f64>,
        rest: f64,
        path: &Path,
    ) -> Result<Self, RunError> {
        let greeting = session.greeting().clone();
        let converter = Converter::new(&greeting);
        let rate = f64::from(greeting.control_rate_hz);
        let columns: Vec<Column> = COLUMNS
            .iter()
            .zip(UNITS)
            .map(|(name, unit)| Column::new(name, unit))
            .collect();
        let mut writer = RecordingWriter::create(path, &columns, &BTreeMap::new())?;
        let experiment = Experiment {
            settings,
            trajectory: Some(motion.to_f32()),
            rest,
            ..Experiment::default()
        };
        let (mut rows, mut estimates) = (Vec::new(), Vec::new());
        let mut trouble = None;
        let losses = run(session, &experiment, |event| {
            match event {
                Event::Samples {
                    first_tick,
                    samples,
                } => {
                    for (k, sample) in samples.iter().enumerate() {
                        let row = converter.row(first_tick, k, sample);
                        if let Err(error) = writer.push_row(&row.values()) {
                            trouble = Some(RunError::Data(error));
                            return ControlFlow::Break(());
                        }
                        rows.push(row);
                    }
                }
                Event::Estimate(estimate) => {
                    estimates.push((estimate.tick as f64 / rate, *estimate))
                }
                Event::Fault(record) => {
                    trouble = Some(RunError::Fault(describe_fault(record, rate)));
                    return ControlFlow::Break(());
                }
                Event::Gap { .. } | Event::Snapshot(_) | Event::Capture(_) | Event::Health(_) => {}
            }
            ControlFlow::Continue(())
        })?;
        if let Some(trouble) = trouble {
            return Err(trouble);
        }
        writer.finish()?;
        let motion_end = rows.last().map_or(0.0, |row: &Row| row.t) - rest;
        Ok(Self {
            rows,
            estimates,
            losses,
            motion_end,
        })
    }

    /// Returns the RMS tracking error during the trajectory, rad.
    pub fn tracking_rms(&self) -> f64 {
        let moving = self.rows.iter().filter(|row| row.t < self.motion_end);
        let (sum, count) = moving.fold((0.0, 0u32), |(sum, n), row| {
            (sum + (row.q1 - row.ref1).powi(2), n + 1)
        });
        (sum / f64::from(count.max(1))).sqrt()
    }

    /// Returns the range of positions during the last half of the rest, rad; it shows a limit cycle.
    pub fn rest_span(&self) -> f64 {
        let end = self.rows.last().map_or(0.0, |row| row.t);
        let late = self
            .rows
            .iter()
            .filter(|row| row.t > 0.5 * (self.motion_end + end));
        let (low, high) = late.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), row| {
            (low.min(row.q1), high.max(row.q1))
        });
        (high - low).max(0.0)
    }
}
