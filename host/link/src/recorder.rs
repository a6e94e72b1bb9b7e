//! Runs a stream and detects its missing parts.

use std::fmt;
use std::ops::ControlFlow;
use std::time::Duration;

use rig_shared::safety::FaultRecord;
use rig_shared::wire::message::{
    Estimate, Health, Report, RequestBody, SnapshotPart, StateSample, StreamEnd,
};
use rig_shared::wire::{FrameCounts, Gap, Reassembly};

use super::error::LinkError;
use super::port::Port;
use super::session::Session;

/// An event of a recording, in the order of the stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event<'a> {
    /// Consecutive samples; the window of the first one started at `first_tick`.
    Samples {
        /// Control tick.
        first_tick: u64,
        /// One per telemetry period.
        samples: &'a [StateSample],
    },
    /// Missing samples.
    Gap {
        /// Control tick at which the first missing window started.
        first_tick: u64,
        /// Number of missing samples.
        missing: u64,
    },
    /// The on-line estimate.
    Estimate(&'a Estimate),
    /// A fault has latched.
    Fault(&'a FaultRecord),
    /// Part of the fault's snapshot.
    Snapshot(&'a SnapshotPart),
    /// Part of the capture of single control ticks.
    Capture(&'a SnapshotPart),
    /// State of the board.
    Health(&'a Health),
}

/// Settings of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordSettings {
    /// Number of samples, received or missing, after which it stops; `None`: only the callback stops it.
    pub samples: Option<u64>,
    /// Requests sent as soon as the stream runs, in this order (`Arm`, `Start`, …).
    pub at_start: Vec<RequestBody>,
    /// A request sent after this number of samples, received or known to be missing.
    pub later: Option<(u64, RequestBody)>,
    /// Longest silence of the rig before the recording fails.
    pub silence: Duration,
}

impl Default for RecordSettings {
    fn default() -> Self {
        Self {
            samples: None,
            at_start: Vec::new(),
            later: None,
            silence: Duration::from_secs(1),
        }
    }
}

/// Counts of the samples of a recording: `taken` = `received` + `lost`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LossReport {
    /// Samples taken by the rig.
    pub taken: u64,
    /// Samples sent by the rig.
    pub sent: u64,
    /// Samples received.
    pub received: u64,
    /// Samples missing for any reason.
    pub lost: u64,
    /// Part of `lost`: dropped by the rig because its transmit queue was full.
    pub dropped_by_rig: u64,
    /// Part of `lost`: lost on the line.
    pub lost_on_line: u64,
    /// Gaps in the stream.
    pub gaps: u64,
    /// Batches received twice; the second is not used.
    pub duplicates: u64,
    /// Batches received after a later one; not used.
    pub late: u64,
    /// Batches that contradict the rest; not used.
    pub inconsistent: u64,
    /// Frames of any message that the line damaged.
    pub bad_frames: u64,
    /// All frames of the recording, by result.
    pub frames: FrameCounts,
}

impl fmt::Display for LossReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} of {} samples received, {} missing in {} gaps ({} dropped by the rig, {} lost on the line); {} bad frames, {} repeated and {} late batches",
            self.received,
            self.taken,
            self.lost,
            self.gaps,
            self.dropped_by_rig,
            self.lost_on_line,
            self.bad_frames,
            self.duplicates,
            self.late + self.inconsistent
        )
    }
}

/// Records one stream: every sample and every gap goes to `on_event`, which may stop the recording.
///
/// A stream that ran before is ended first, so that its samples cannot get in.
///
/// # Errors
/// A refused request, a rig that falls silent, or a failed line. Samples before the error were passed to `on_event`,
/// but losses at the end are unknown.
pub fn record<P: Port>(
    session: &mut Session<P>,
    settings: &RecordSettings,
    on_event: impl FnMut(Event<'_>) -> ControlFlow<()>,
) -> Result<LossReport, LinkError> {
    let frames_before = session.frames();
    let mut run = Run {
        reassembly: Reassembly::new(session.greeting().telemetry_decimation),
        gaps: 0,
        broken_off: false,
        on_event,
    };
    // On a line that keeps the order, no sample of an old stream arrives after its end.
    run.end(session, Phase::Before)?;
    session.request(RequestBody::StartStream)?;
    for body in &settings.at_start {
        session.request(body.clone())?;
    }
    run.stream(session, settings)?;
    let end = run.end(session, Phase::After)?;
    Ok(run.report(&end, frames_before, session.frames()))
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// A stream that may have run before: its samples are discarded.
    Before,
    /// The stream that is recorded.
    After,
}

struct Run<F> {
    reassembly: Reassembly,
    gaps: u64,
    broken_off: bool,
    on_event: F,
}

impl<F: FnMut(Event<'_>) -> ControlFlow<()>> Run<F> {
    fn stream<P: Port>(
        &mut self,
        session: &mut Session<P>,
        settings: &RecordSettings,
    ) -> Result<(), LinkError> {
        let mut later = settings.later.as_ref();
        while !self.is_complete(settings) {
            if let Some((_, body)) = later.take_if(|(after, _)| self.so_far() >= *after) {
                session.request(body.clone())?;
            }
            let Some(report) = session.next_report(settings.silence)? else {
                return Err(LinkError::Silent(settings.silence));
            };
            // An end before the request for it is a repeated end of the old stream.
            self.take(&report);
        }
        Ok(())
    }

    /// Returns the number of samples received or known to be missing.
    fn so_far(&self) -> u64 {
        let counts = self.reassembly.counts();
        counts.received + counts.missing
    }

    fn is_complete(&self, settings: &RecordSettings) -> bool {
        let so_far = self.so_far();
        self.broken_off || settings.samples.is_some_and(|wanted| so_far >= wanted)
    }

    /// Ends the stream and returns its totals. They come once per request, so a new request asks again.
    fn end<P: Port>(
        &mut self,
        session: &mut Session<P>,
        phase: Phase,
    ) -> Result<StreamEnd, LinkError> {
        let patience = session.settings();
        let mut mismatch = None;
        for _ in 0..patience.attempts {
            session.request(RequestBody::StopStream)?;
            let deadline = session.port().now() + patience.timeout;
            // Estimates may continue forever, so the time counts from the request.
            while let Some(report) =
                session.next_report(deadline.saturating_sub(session.port().now()))?
            {
                match (&report, phase) {
                    (Report::StreamEnd(end), Phase::Before) => return Ok(*end),
                    (Report::Batch(_), Phase::Before) => {}
                    (Report::StreamEnd(end), Phase::After) => match self.reassembly.finish(end) {
                        Ok(gap) => {
                            self.gap(gap);
                            return Ok(*end);
                        }
                        Err(error) => mismatch = Some(error),
                    },
                    _ => self.take(&report),
                }
            }
        }
        Err(mismatch.map_or(
            LinkError::NoEnd {
                attempts: patience.attempts,
            },
            LinkError::from,
        ))
    }

    fn take(&mut self, report: &Report) {
        match report {
            Report::Batch(batch) => {
                // The reassembly counts a refused batch.
                if let Ok(gap) = self.reassembly.accept(batch) {
                    self.gap(gap);
                    self.emit(Event::Samples {
                        first_tick: batch.first_tick,
                        samples: &batch.samples,
                    });
                }
            }
            Report::Estimate(estimate) => self.emit(Event::Estimate(estimate)),
            Report::Fault(fault) => self.emit(Event::Fault(fault)),
            Report::Snapshot(part) => self.emit(Event::Snapshot(part)),
            Report::Capture(part) => self.emit(Event::Capture(part)),
            Report::Health(health) => self.emit(Event::Health(health)),
            Report::Greeting(_) | Report::Acknowledge(_) | Report::StreamEnd(_) => {}
        }
    }

    fn gap(&mut self, gap: Option<Gap>) {
        if let Some(Gap {
            first_tick,
            missing,
        }) = gap
        {
            self.gaps += 1;
            self.emit(Event::Gap {
                first_tick,
                missing,
            });
        }
    }

    fn emit(&mut self, event: Event<'_>) {
        self.broken_off |= (self.on_event)(event).is_break();
    }

    fn report(&self, end: &StreamEnd, before: FrameCounts, after: FrameCounts) -> LossReport {
        let counts = self.reassembly.counts();
        let frames = FrameCounts {
            good: after.good - before.good,
            bad_cobs: after.bad_cobs - before.bad_cobs,
            bad_crc: after.bad_crc - before.bad_crc,
            bad_message: after.bad_message - before.bad_message,
            too_long: after.too_long - before.too_long,
        };
        LossReport {
            taken: end.samples.saturating_add(end.dropped),
            sent: end.samples,
            received: counts.received,
            lost: counts.missing,
            dropped_by_rig: end.dropped,
            lost_on_line: counts.missing.saturating_sub(end.dropped),
            gaps: self.gaps,
            duplicates: counts.duplicates,
            late: counts.late,
            inconsistent: counts.inconsistent,
            bad_frames: frames.bad(),
            frames,
        }
    }
}
