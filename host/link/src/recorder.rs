//! Runs a stream and detects its missing parts.

use std::cell::Cell;
use std::fmt;
use std::ops::ControlFlow;
use std::time::Duration;

use rig_shared::safety::FaultRecord;
use rig_shared::wire::message::{
    Estimate, Health, Report, RequestBody, SnapshotPart, StateSample, StreamEnd,
};
use rig_shared::wire::{FrameCounts, Gap, LossCounts, Reassembly};

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
    mut on_event: impl FnMut(Event<'_>) -> ControlFlow<()>,
) -> Result<LossReport, LinkError> {
    let broken_off = Cell::new(false);
    let mut emit = |event: Event<'_>| {
        let ends = on_event(event).is_break();
        broken_off.set(broken_off.get() || ends);
    };
    let mut stream = Stream::start(session, &mut emit)?;
    for body in &settings.at_start {
        session.request(body.clone())?;
    }
    let mut later = settings.later.as_ref();
    while !broken_off.get() && settings.samples.is_none_or(|all| stream.so_far() < all) {
        if let Some((_, body)) = later.take_if(|(after, _)| stream.so_far() >= *after) {
            session.request(body.clone())?;
        }
        let Some(report) = session.next_report(settings.silence)? else {
            return Err(LinkError::Silent(settings.silence));
        };
        // An end before the request for it is a repeated end of the old stream.
        stream.take(&report, &mut emit);
    }
    stream.end(session, emit)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// A stream that may have run before: its samples are discarded.
    Before,
    /// The stream that is recorded.
    After,
}

/// A running stream. It numbers the samples and finds the missing ones, and passes everything to a callback.
pub struct Stream {
    reassembly: Reassembly,
    gaps: u64,
    frames_before: FrameCounts,
}

impl Stream {
    /// Ends the stream that may run, and starts a new one.
    ///
    /// # Errors
    /// A refused request, a missing answer, or a failed line.
    pub fn start<P: Port>(
        session: &mut Session<P>,
        mut on_event: impl FnMut(Event<'_>),
    ) -> Result<Self, LinkError> {
        let mut stream = Self {
            reassembly: Reassembly::new(session.greeting().telemetry_decimation),
            gaps: 0,
            frames_before: session.frames(),
        };
        // On a line that keeps the order, no sample of an old stream arrives after its end.
        stream.ask_end(session, Phase::Before, &mut on_event)?;
        session.request(RequestBody::StartStream)?;
        Ok(stream)
    }

    /// Returns the counts of samples and batches so far.
    pub fn counts(&self) -> LossCounts {
        self.reassembly.counts()
    }

    /// Returns the number of gaps so far.
    pub fn gaps(&self) -> u64 {
        self.gaps
    }

    /// Returns the number of frames since the start that the line damaged; `now` are the session's frames.
    pub fn bad_frames(&self, now: FrameCounts) -> u64 {
        now.bad() - self.frames_before.bad()
    }

    /// Takes the next report of the session.
    pub fn take(&mut self, report: &Report, mut on_event: impl FnMut(Event<'_>)) {
        match report {
            Report::Batch(batch) => {
                // The reassembly counts a refused batch.
                if let Ok(gap) = self.reassembly.accept(batch) {
                    self.gap(gap, &mut on_event);
                    on_event(Event::Samples {
                        first_tick: batch.first_tick,
                        samples: &batch.samples,
                    });
                }
            }
            Report::Estimate(estimate) => on_event(Event::Estimate(estimate)),
            Report::Fault(fault) => on_event(Event::Fault(fault)),
            Report::Snapshot(part) => on_event(Event::Snapshot(part)),
            Report::Capture(part) => on_event(Event::Capture(part)),
            Report::Health(health) => on_event(Event::Health(health)),
            Report::Greeting(_) | Report::Acknowledge(_) | Report::StreamEnd(_) => {}
        }
    }

    /// Ends the stream and counts what is missing at its end.
    ///
    /// # Errors
    /// A refused request, a missing answer, or a failed line.
    pub fn end<P: Port>(
        mut self,
        session: &mut Session<P>,
        mut on_event: impl FnMut(Event<'_>),
    ) -> Result<LossReport, LinkError> {
        let end = self.ask_end(session, Phase::After, &mut on_event)?;
        Ok(self.report(&end, session.frames()))
    }

    /// Returns the number of samples received or known to be missing.
    fn so_far(&self) -> u64 {
        let counts = self.reassembly.counts();
        counts.received + counts.missing
    }

    /// Ends the stream and returns its totals. They come once per request, so a new request asks again.
    fn ask_end<P: Port>(
        &mut self,
        session: &mut Session<P>,
        phase: Phase,
        on_event: &mut impl FnMut(Event<'_>),
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
                            self.gap(gap, on_event);
                            return Ok(*end);
                        }
                        Err(error) => mismatch = Some(error),
                    },
                    _ => self.take(&report, &mut *on_event),
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

    fn gap(&mut self, gap: Option<Gap>, on_event: &mut impl FnMut(Event<'_>)) {
        if let Some(Gap {
            first_tick,
            missing,
        }) = gap
        {
            self.gaps += 1;
            on_event(Event::Gap {
                first_tick,
                missing,
            });
        }
    }

    fn report(&self, end: &StreamEnd, after: FrameCounts) -> LossReport {
        let before = self.frames_before;
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
