//! Runs a stream and knows what of it is missing.

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

/// What comes out of a recording, in the order of the stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event<'a> {
    /// Consecutive samples; the first one's window began at `first_tick`.
    Samples {
        /// Control tick.
        first_tick: u64,
        /// One per telemetry period.
        samples: &'a [StateSample],
    },
    /// Samples that are missing here.
    Gap {
        /// Control tick at which the first missing window began.
        first_tick: u64,
        /// How many.
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
    /// How the board is.
    Health(&'a Health),
}

/// What to record.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordSettings {
    /// Stop after so many samples, received or missing; `None`: only when the callback breaks.
    pub samples: Option<u64>,
    /// Requests to send as soon as the stream runs, in this order (`Arm`, `Start`, …).
    pub at_start: Vec<RequestBody>,
    /// A request to send once so many samples have come or are known to be missing.
    pub later: Option<(u64, RequestBody)>,
    /// Longest silence of the rig before the recording is given up.
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

/// What became of every sample of a recording: `taken` = `received` + `lost`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LossReport {
    /// Samples the rig took.
    pub taken: u64,
    /// Samples the rig sent.
    pub sent: u64,
    /// Samples received.
    pub received: u64,
    /// Samples missing, wherever they were lost.
    pub lost: u64,
    /// Of these, dropped by the rig because its transmit queue was full.
    pub dropped_by_rig: u64,
    /// Of these, lost on the line.
    pub lost_on_line: u64,
    /// Holes in the stream.
    pub gaps: u64,
    /// Batches that came twice and were not used again.
    pub duplicates: u64,
    /// Batches that came after a later one and were not used.
    pub late: u64,
    /// Batches that contradicted the rest and were not used.
    pub inconsistent: u64,
    /// Frames spoilt by the line, of any message.
    pub bad_frames: u64,
    /// All frames of the recording, by fate.
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

/// Records one stream: every sample that comes, and every hole, goes to `on_event`, which may break it off.
///
/// Whatever stream ran before is ended first, so that nothing of it can get in.
///
/// # Errors
/// A refused request, a rig that falls silent, or a broken line; what was recorded until then has gone to
/// `on_event`, but losses at the end are unknown.
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
    // On a line that keeps the order, nothing of an old stream comes after its end.
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
    /// Of the stream that may have run before: its samples are nobody's.
    Before,
    /// Of the stream that is recorded.
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
            // An end that comes before it is asked for is the old stream's, said twice.
            self.take(&report);
        }
        Ok(())
    }

    /// Samples that have come or are known to be missing.
    fn so_far(&self) -> u64 {
        let counts = self.reassembly.counts();
        counts.received + counts.missing
    }

    fn is_complete(&self, settings: &RecordSettings) -> bool {
        let so_far = self.so_far();
        self.broken_off || settings.samples.is_some_and(|wanted| so_far >= wanted)
    }

    /// Ends the stream and gives its totals. They come once per request, so that a new request asks again.
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
            // Estimates may go on for ever: what counts is the time since the question.
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
                // A refused batch is counted by the reassembly.
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
