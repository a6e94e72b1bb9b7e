//! Part of the conversation that runs in the control tick: requests in, notes out, each in bounded time.

use rig_shared::safety::SnapshotSample;
use rig_shared::wire::Ledger;
use rig_shared::wire::message::{Acknowledge, Refusal, RequestBody};

use crate::capture::Capture;
use crate::config::{Config, Settings};
use crate::examined::Examined;
use crate::note::{Kept, Note, Topic};
use crate::request::carry_out;
use crate::state::State;
use crate::step::Output;

/// Destination of notes.
pub trait Notes {
    /// Takes a whole note, or returns false if there is no room.
    fn put(&mut self, note: Note) -> bool;

    /// Returns true if there is room for the parts of a snapshot in addition to other notes.
    fn roomy(&self) -> bool {
        true
    }
}

impl<F: FnMut(Note) -> bool> Notes for F {
    fn put(&mut self, note: Note) -> bool {
        self(note)
    }
}

/// State of the conversation in the tick.
#[derive(Clone, Debug, Default)]
pub struct Clerk {
    ledger: Ledger,
    /// Next tick of the snapshot to send, while it is sent.
    snapshot: Option<u16>,
    /// Next tick of the capture to send, while it is sent.
    capture: Option<u16>,
    /// Number of the pending request to store the settings.
    storing: Option<u16>,
    /// Telemetry windows that found no room since the last sent one.
    missed: u32,
    /// The same since power on.
    dropped: u32,
}

impl Clerk {
    /// Returns the state at power on.
    pub fn new() -> Self {
        Self::default()
    }

    /// Carries out a request and notes the answer. Returns the settings if they must be stored: call [`Clerk::stored`]
    /// afterwards, which sends the answer. Not inlined because it is rare.
    #[inline(never)]
    pub fn serve(
        &mut self,
        config: &Config,
        state: &mut State,
        capture: &mut Capture,
        examined: &Examined,
        notes: &mut impl Notes,
    ) -> Option<Settings> {
        state.heard = state.tick;
        let (id, body) = (examined.request.id, &examined.request.body);
        if matches!(body, RequestBody::Hello) {
            self.ledger.clear();
        }
        if let Some(earlier) = self.ledger.answered(id) {
            notes.put(Note::Answer(earlier, Topic::None));
            return None;
        }
        // A repeated request while storing: the answer is still to come.
        if self.storing == Some(id) {
            return None;
        }
        let result = carry_out(config, state, examined);
        if result.is_ok() && matches!(body, RequestBody::Store) {
            self.storing = Some(id);
            return Some(*state.settings());
        }
        let topic = match result {
            Ok(()) => self.topic(state, capture, body),
            Err(_) => Topic::None,
        };
        let acknowledge = self.ledger.answer(id, result);
        notes.put(Note::Answer(acknowledge, topic));
        None
    }

    /// Ends storing the settings, and answers the request. Not inlined because it is rare.
    #[inline(never)]
    pub fn stored(
        &mut self,
        state: &mut State,
        result: Result<(), Refusal>,
        notes: &mut impl Notes,
    ) {
        state.storing = false;
        if let Some(id) = self.storing.take() {
            let acknowledge: Acknowledge = self.ledger.answer(id, result);
            notes.put(Note::Answer(acknowledge, Topic::None));
        }
    }

    fn topic(&mut self, state: &State, capture: &mut Capture, body: &RequestBody) -> Topic {
        match body {
            RequestBody::Capture(after) => {
                capture.trigger(*after);
                Topic::None
            }
            RequestBody::ClearFault => {
                capture.release();
                Topic::None
            }
            RequestBody::Hello => Topic::Greeting,
            RequestBody::StartStream => {
                // Windows that found no room before the stream do not count.
                self.missed = 0;
                Topic::StreamStart(state.window_start())
            }
            RequestBody::StopStream => Topic::StreamEnd,
            RequestBody::GetSnapshot => {
                self.snapshot = Some(0);
                Topic::Snapshot(state.latch.first())
            }
            RequestBody::GetCapture => {
                self.capture = Some(0);
                Topic::None
            }
            _ => Topic::None,
        }
    }

    /// Keeps the output of a control tick, and notes it.
    pub fn report(
        &mut self,
        state: &State,
        capture: &mut Capture,
        output: &Output,
        notes: &mut impl Notes,
    ) {
        capture.push(&output.tick);
        if let Some(fault) = output.fault {
            capture.trigger_by_fault();
            notes.put(Note::Fault(fault));
        }
        if let Some(estimate) = output.estimate {
            notes.put(Note::Estimate(estimate));
        }
        if let Some((_, sample)) = output.state {
            let missed = self.missed;
            self.missed = if notes.put(Note::Sample { sample, missed }) {
                0
            } else {
                self.dropped = self.dropped.saturating_add(1);
                missed.saturating_add(1)
            };
        }
        // One kept tick per control tick, so that the stream always has room.
        if (self.snapshot.is_some() || self.capture.is_some()) && notes.roomy() {
            self.pass_kept(state, capture, notes);
        }
    }

    /// Passes on one tick of the snapshot and one of the capture. Not inlined because it is rare.
    #[inline(never)]
    fn pass_kept(&mut self, state: &State, capture: &Capture, notes: &mut impl Notes) {
        self.pass_snapshot(state, notes);
        self.pass_capture(capture, notes);
    }

    /// Returns the telemetry windows that found no room since power on.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    fn pass_snapshot(&mut self, state: &State, notes: &mut impl Notes) {
        let Some(index) = self.snapshot else { return };
        // A running ring would mix parts of different times. Without a fault there is no snapshot.
        let faulty = state.latch.first().is_some();
        if faulty && !state.snapshot.is_frozen() {
            return;
        }
        let total = if faulty {
            state.snapshot.len() as u16
        } else {
            0
        };
        let sample = state.snapshot.get(usize::from(index)).copied();
        let kept = kept(index, total, sample);
        if notes.put(Note::Snapshot(kept)) {
            self.snapshot = following(kept);
        }
    }

    fn pass_capture(&mut self, capture: &Capture, notes: &mut impl Notes) {
        let Some(index) = self.capture else { return };
        if capture.is_awaited() {
            return;
        }
        let total = if capture.is_complete() {
            capture.len() as u16
        } else {
            0
        };
        let sample = capture.get(usize::from(index));
        let kept = kept(index, total, sample);
        if notes.put(Note::Capture(kept)) {
            self.capture = following(kept);
        }
    }
}

fn kept(index: u16, total: u16, sample: Option<SnapshotSample>) -> Kept {
    Kept {
        index,
        total,
        sample: sample.unwrap_or_default(),
    }
}

fn following(kept: Kept) -> Option<u16> {
    let next = kept.index + 1;
    (next < kept.total).then_some(next)
}
