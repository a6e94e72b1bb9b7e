//! Part of the session that runs in the control tick: requests in, events out, each in bounded time.

use rig_shared::safety::SnapshotSample;
use rig_shared::wire::AnswerLog;
use rig_shared::wire::message::{Acknowledge, Refusal, RequestBody};

use crate::capture::Capture;
use crate::config::{Config, Settings};
use crate::event::{Event, FollowUp, RecordedTick};
use crate::prechecked_request::PrecheckedRequest;
use crate::request::{execute, execute_urgent};
use crate::state::State;
use crate::step::Output;
use crate::urgent_request::UrgentRequest;

/// Destination of events.
pub trait EventSink {
    /// Takes a whole event, or returns false if there is no room.
    fn push(&mut self, event: Event) -> bool;

    /// Returns true if there is room for the parts of a snapshot in addition to other events.
    fn has_room(&self) -> bool {
        true
    }
}

impl<F: FnMut(Event) -> bool> EventSink for F {
    fn push(&mut self, event: Event) -> bool {
        self(event)
    }
}

/// State of the session in the tick.
#[derive(Clone, Debug, Default)]
pub struct TickSession {
    answer_log: AnswerLog,
    /// Next tick of the snapshot to send, while it is sent.
    snapshot: Option<u16>,
    /// Next tick of the capture to send, while it is sent.
    capture: Option<u16>,
    /// Number of the pending request to store the settings.
    pending_store: Option<u16>,
    /// Telemetry windows that found no room since the last sent one.
    missed_windows: u32,
    /// The same since power on.
    dropped_windows: u32,
}

/// Emits an answer as an event. Not inlined because it is rare, and its copies take room.
#[inline(never)]
fn send_answer(acknowledge: Acknowledge, follow_up: FollowUp, events: &mut impl EventSink) {
    events.push(Event::Answer(acknowledge, follow_up));
}

impl TickSession {
    /// Returns the state at power on.
    pub fn new() -> Self {
        Self::default()
    }

    /// Executes a request and emits the answer as an event. Returns the settings if they must be stored: call
    /// [`TickSession::finish_store`] afterwards, which sends the answer. Not inlined because it is rare.
    #[inline(never)]
    pub fn serve(
        &mut self,
        config: &Config,
        state: &mut State,
        capture: &mut Capture,
        prechecked: &PrecheckedRequest,
        events: &mut impl EventSink,
    ) -> Option<Settings> {
        state.last_contact_tick = state.tick;
        let (id, body) = (prechecked.request.id, &prechecked.request.body);
        if matches!(body, RequestBody::Hello) {
            self.answer_log.clear();
        }
        if let Some(earlier) = self.answer_log.stored_answer(id) {
            send_answer(earlier, FollowUp::None, events);
            return None;
        }
        // A repeated request while storing: the answer is still to come.
        if self.pending_store == Some(id) {
            return None;
        }
        let result = execute(config, state, prechecked);
        if result.is_ok() && matches!(body, RequestBody::Store) {
            self.pending_store = Some(id);
            return Some(*state.settings());
        }
        let follow_up = match result {
            Ok(()) => self.follow_up(state, capture, body),
            Err(_) => FollowUp::None,
        };
        let acknowledge = self.answer_log.record(id, result);
        send_answer(acknowledge, follow_up, events);
        None
    }

    /// Executes an urgent request and emits the answer as an event. Not inlined because it is rare.
    #[inline(never)]
    pub fn serve_urgent(
        &mut self,
        state: &mut State,
        request: UrgentRequest,
        events: &mut impl EventSink,
    ) {
        state.last_contact_tick = state.tick;
        let acknowledge = match self.answer_log.stored_answer(request.id) {
            Some(earlier) => earlier,
            None => {
                let result = execute_urgent(state, request.body);
                self.answer_log.record(request.id, result)
            }
        };
        send_answer(acknowledge, FollowUp::None, events);
    }

    /// Refuses a request without executing it, and emits the answer as an event. Not inlined because it is rare.
    #[inline(never)]
    pub fn refuse(&mut self, id: u16, refusal: Refusal, events: &mut impl EventSink) {
        let acknowledge = match self.answer_log.stored_answer(id) {
            Some(earlier) => earlier,
            None => self.answer_log.record(id, Err(refusal)),
        };
        send_answer(acknowledge, FollowUp::None, events);
    }

    /// Ends storing the settings, and answers the request. Not inlined because it is rare.
    #[inline(never)]
    pub fn finish_store(
        &mut self,
        state: &mut State,
        result: Result<(), Refusal>,
        events: &mut impl EventSink,
    ) {
        state.storing = false;
        if let Some(id) = self.pending_store.take() {
            let acknowledge: Acknowledge = self.answer_log.record(id, result);
            send_answer(acknowledge, FollowUp::None, events);
        }
    }

    fn follow_up(&mut self, state: &State, capture: &mut Capture, body: &RequestBody) -> FollowUp {
        match body {
            RequestBody::Capture(after) => {
                capture.trigger(*after);
                FollowUp::None
            }
            RequestBody::ClearFault => {
                capture.release();
                FollowUp::None
            }
            RequestBody::Hello => FollowUp::Greeting,
            RequestBody::StartStream => {
                // Windows that found no room before the stream do not count.
                self.missed_windows = 0;
                FollowUp::StreamStart(state.window_start())
            }
            RequestBody::StopStream => FollowUp::StreamEnd,
            RequestBody::GetSnapshot => {
                self.snapshot = Some(0);
                FollowUp::Snapshot(state.latch.first())
            }
            RequestBody::GetCapture => {
                self.capture = Some(0);
                FollowUp::None
            }
            _ => FollowUp::None,
        }
    }

    /// Records the output of a control tick, and emits its events.
    pub fn report(
        &mut self,
        state: &State,
        capture: &mut Capture,
        output: &Output,
        events: &mut impl EventSink,
    ) {
        capture.push(&output.tick);
        if let Some(fault) = output.fault {
            capture.trigger_by_fault();
            events.push(Event::Fault(fault));
        }
        if let Some(estimate) = output.estimate {
            events.push(Event::Estimate(estimate));
        }
        if let Some((_, sample)) = output.state {
            let missed_windows = self.missed_windows;
            self.missed_windows = if events.push(Event::Sample {
                sample,
                missed_windows,
            }) {
                0
            } else {
                self.dropped_windows = self.dropped_windows.saturating_add(1);
                missed_windows.saturating_add(1)
            };
        }
        // One kept tick per control tick, so that the stream always has room.
        if (self.snapshot.is_some() || self.capture.is_some()) && events.has_room() {
            self.send_recordings(state, capture, events);
        }
    }

    /// Passes on one tick of the snapshot and one of the capture. Not inlined because it is rare.
    #[inline(never)]
    fn send_recordings(&mut self, state: &State, capture: &Capture, events: &mut impl EventSink) {
        self.send_snapshot_tick(state, events);
        self.send_capture_tick(capture, events);
    }

    /// Returns the telemetry windows that found no room since power on.
    pub fn dropped_windows(&self) -> u32 {
        self.dropped_windows
    }

    fn send_snapshot_tick(&mut self, state: &State, events: &mut impl EventSink) {
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
        let recorded_tick = recorded_tick(index, total, sample);
        if events.push(Event::Snapshot(recorded_tick)) {
            self.snapshot = next_index(recorded_tick);
        }
    }

    fn send_capture_tick(&mut self, capture: &Capture, events: &mut impl EventSink) {
        let Some(index) = self.capture else { return };
        if capture.is_triggered() {
            return;
        }
        let total = if capture.is_complete() {
            capture.len() as u16
        } else {
            0
        };
        let sample = capture.get(usize::from(index));
        let recorded_tick = recorded_tick(index, total, sample);
        if events.push(Event::Capture(recorded_tick)) {
            self.capture = next_index(recorded_tick);
        }
    }
}

fn recorded_tick(index: u16, total: u16, sample: Option<SnapshotSample>) -> RecordedTick {
    RecordedTick {
        index,
        total,
        sample: sample.unwrap_or_default(),
    }
}

fn next_index(recorded_tick: RecordedTick) -> Option<u16> {
    let next = recorded_tick.index + 1;
    (next < recorded_tick.total).then_some(next)
}
