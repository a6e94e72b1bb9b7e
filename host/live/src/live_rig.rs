//! The thread of the line: takes the telemetry, carries out orders one by one, and lets a stop pass before them.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use rig_link::experiment::{stop_time, when_calibrated};
use rig_link::{
    Converter, Event, LinkError, LossReport, Port, Row, Session, Stream, describe_fault,
};
use rig_model::robot::Robot;
use rig_shared::safety::{LimitSet, Mode};
use rig_shared::wire::message::{Refusal, RequestBody};

use super::error::LiveError;
use super::hub::{Action, Answer, Hub, Order, Refused};
use super::motion::Motion;
use super::packet::Packet;
use super::recording::Recording;
use super::status::{Hello, MotionStatus, RecordingStatus, Status, StopPhase, StopStatus};

/// Time between two packets of samples: 25 a second.
const PACKET: Duration = Duration::from_millis(40);
/// Longest wait for a report, after which orders are looked at.
const POLL: Duration = Duration::from_millis(5);
/// Silence after which the line counts as failed, as for a recording.
const SILENCE: Duration = Duration::from_secs(1);
/// Time after which an armed rig is stopped when no page is open. A page that is loaded again takes less.
const UNWATCHED: Duration = Duration::from_secs(3);
/// Time over which the speed of the stream is measured.
const SPEED_WINDOW: Duration = Duration::from_secs(2);
/// Largest distance between the link and the start of a motion, rad, as for `rig record`.
const START_TOLERANCE: f64 = 0.02;
/// Time that the last status has to reach the clients.
const FAREWELL: Duration = Duration::from_millis(300);

/// What the live view does with the rig.
pub struct RigSettings {
    /// Name of the source, such as `emulated rig`.
    pub source: String,
    /// Requests sent first.
    pub settings: Vec<RequestBody>,
    /// The motion loaded first.
    pub motion: Option<Motion>,
    /// The description that motions must fit.
    pub robot: Option<Robot>,
    /// Folder of the recordings.
    pub folder: PathBuf,
}

/// The program around the live view.
pub trait Surroundings {
    /// Returns true if the program has been asked to end.
    fn ended(&self) -> bool;
    /// Tells which hidden file is being written, to be removed if the program must end at once.
    fn writing(&self, hidden: Option<&Path>);
    /// Prints a sentence for the user.
    fn say(&self, sentence: &str);
}

/// Shows and commands the rig until the program is asked to end.
///
/// # Errors
/// A failed line, or a recording that cannot be written.
pub(crate) fn run<P: Port>(
    session: &mut Session<P>,
    settings: RigSettings,
    hub: &Arc<Hub>,
    orders: &Receiver<Order>,
    surroundings: &dyn Surroundings,
) -> Result<LossReport, LiveError> {
    let mut hello = Hello::new(settings.source.clone());
    let greeting = session.greeting();
    let converter = Converter::new(greeting);
    hello.firmware = greeting.firmware.as_str().to_owned();
    hello.sample_rate = 1.0 / converter.period();
    hello.torque_per_ampere = f64::from(greeting.gear_ratio * greeting.torque_constant);
    hello.described = settings.settings.iter().find_map(|body| match body {
        RequestBody::SetModel(model) => Some(model.to_array()),
        _ => None,
    });
    let mut log = Log::new(converter, f64::from(greeting.control_rate_hz), hub.clone());
    log.status.notice = send_settings(session, &settings)?;
    hub.set_hello(serde_json::to_string(&hello).unwrap_or_default());
    let stream = Stream::start(session, |event| log.take(&event))?;
    let mut rig = LiveRig {
        stop_time: stop_time(&settings.settings),
        session,
        stream,
        log,
        settings,
        hub,
        orders,
        surroundings,
        stops: 0,
        stopping: None,
        drive_off: None,
        unwatched: None,
        last_report: Instant::now(),
    };
    let result = rig.watch();
    rig.end(result)
}

/// Brings the rig to a defined state. Returns a remark if a latched fault has prevented it.
fn send_settings<P: Port>(
    session: &mut Session<P>,
    settings: &RigSettings,
) -> Result<Option<String>, LinkError> {
    when_calibrated(session, RequestBody::Disarm)?;
    let motion = settings.motion.as_ref().map(Motion::request);
    for body in settings.settings.iter().cloned().chain(motion) {
        match when_calibrated(session, body) {
            Err(
                error @ LinkError::Refused {
                    refusal: Refusal::FaultLatched,
                    ..
                },
            ) => {
                return Ok(Some(format!(
                    "{error} The settings were not sent: clear the fault and start `rig live` again."
                )));
            }
            other => other?,
        }
    }
    Ok(None)
}

/// What the rig has sent.
struct Log {
    converter: Converter,
    control_rate: f64,
    hub: Arc<Hub>,
    status: Status,
    mode: Mode,
    last: Option<Row>,
    pending: Vec<Row>,
    received: u64,
    recording: Option<Recording>,
    failed: Option<LiveError>,
    flushed: Instant,
    speed: (Instant, u64),
}

impl Log {
    fn new(converter: Converter, control_rate: f64, hub: Arc<Hub>) -> Self {
        let now = Instant::now();
        Self {
            converter,
            control_rate,
            hub,
            status: Status::new(),
            mode: Mode::Calibrating,
            last: None,
            pending: Vec::new(),
            received: 0,
            recording: None,
            failed: None,
            flushed: now,
            speed: (now, 0),
        }
    }

    fn take(&mut self, event: &Event<'_>) {
        match event {
            Event::Samples {
                first_tick,
                samples,
            } => {
                for (k, sample) in samples.iter().enumerate() {
                    let row = self.converter.row(*first_tick, k, sample);
                    if self.mode == Mode::Fault && sample.mode != Mode::Fault {
                        self.status.fault = None;
                    }
                    self.mode = sample.mode;
                    self.status.limits |= sample.limits.0;
                    self.last = Some(row);
                    self.pending.push(row);
                    let written = self.recording.as_mut().map(|file| file.push(&row));
                    if let Some(Err(error)) = written {
                        self.recording = None;
                        self.failed = Some(error.into());
                    }
                }
            }
            Event::Gap { missing, .. } => {
                if let Some(file) = &mut self.recording {
                    file.lose(*missing);
                }
            }
            Event::Estimate(estimate) => {
                self.hub
                    .publish(Packet::estimate(estimate, self.control_rate));
            }
            Event::Fault(record) => {
                self.status.fault = Some(describe_fault(record, self.control_rate));
            }
            Event::Snapshot(_) | Event::Capture(_) | Event::Health(_) => {}
        }
    }

    /// Sends the samples since the last packet and the status, if it is time.
    fn publish(&mut self) {
        if self.flushed.elapsed() < PACKET {
            return;
        }
        self.flushed = Instant::now();
        let rows = std::mem::take(&mut self.pending);
        if !rows.is_empty() {
            let first = self.received;
            self.received += rows.len() as u64;
            self.hub.publish(Packet::samples(first, rows));
        }
        self.measure_speed();
        self.status.mode = self.mode.name();
        self.status.recording = self.recording.as_ref().map(|file| {
            let (samples, missing) = file.counts();
            RecordingStatus {
                file: file.path().display().to_string(),
                samples,
                missing,
            }
        });
        self.hub
            .set_status(serde_json::to_string(&self.status).unwrap_or_default());
        self.status.limits = LimitSet::default().0;
    }

    fn measure_speed(&mut self) {
        let (since, before) = self.speed;
        let elapsed = since.elapsed();
        if elapsed >= SPEED_WINDOW {
            let seconds = (self.received - before) as f64 * self.converter.period();
            self.status.speed = (before > 0).then(|| seconds / elapsed.as_secs_f64());
            self.speed = (Instant::now(), self.received);
        }
    }
}

/// A stop that has not yet switched the bridge off.
#[derive(Clone, Copy)]
struct Stopping {
    asked: Instant,
    /// The rig's time at which the bridge is switched off at the latest.
    latest: Duration,
}

struct LiveRig<'a, P> {
    session: &'a mut Session<P>,
    stream: Stream,
    log: Log,
    settings: RigSettings,
    hub: &'a Arc<Hub>,
    orders: &'a Receiver<Order>,
    surroundings: &'a dyn Surroundings,
    stop_time: Duration,
    /// Number of stops served.
    stops: u64,
    stopping: Option<Stopping>,
    /// The rig's time at which a motion with `drive_off` switches the bridge off.
    drive_off: Option<Duration>,
    /// Since when no page has been open.
    unwatched: Option<Instant>,
    last_report: Instant,
}

impl<P: Port> LiveRig<'_, P> {
    fn watch(&mut self) -> Result<(), LiveError> {
        let mut fault_asked = false;
        while !self.surroundings.ended() {
            if self.hub.stops() != self.stops {
                self.stop()?;
            } else if let Ok(order) = self.orders.try_recv() {
                let answer = self.obey(order.action)?;
                // A client that has gone needs no answer.
                let _gone = order.answer.send(answer);
            }
            self.pump()?;
            self.switch_off_when_due()?;
            self.stop_if_unwatched();
            if self.log.mode == Mode::Fault && self.log.status.fault.is_none() && !fault_asked {
                // The fault latched before this program listened: its snapshot names it.
                fault_asked = true;
                self.session.request(RequestBody::GetSnapshot)?;
            }
            fault_asked &= self.log.mode == Mode::Fault;
            self.count();
            self.log.publish();
            if let Some(error) = self.log.failed.take() {
                return Err(error);
            }
        }
        Ok(())
    }

    fn count(&mut self) {
        let counts = self.stream.counts();
        let status = &mut self.log.status;
        status.received = counts.received;
        status.missing = counts.missing;
        status.gaps = self.stream.gaps();
        status.bad_frames = self.stream.bad_frames(self.session.frames());
        status.motion = self.settings.motion.as_ref().map(|motion| MotionStatus {
            file: motion.name.clone(),
            joint: motion.joint.name.clone(),
            start: motion.joint.start,
            duration: motion.duration(),
        });
    }

    /// Takes the reports that have come; waits a moment for the first.
    fn pump(&mut self) -> Result<(), LinkError> {
        let Self {
            session,
            stream,
            log,
            ..
        } = self;
        let mut wait = POLL;
        while let Some(report) = session.next_report(wait)? {
            stream.take(&report, |event| log.take(&event));
            self.last_report = Instant::now();
            wait = Duration::ZERO;
        }
        if self.last_report.elapsed() > SILENCE {
            return Err(LinkError::Silent(SILENCE));
        }
        Ok(())
    }

    /// Serves a stop: first the request that brings the link to rest, before anything that waits. The bridge is
    /// switched off at rest; at once if the rig refuses, or if stop is asked for again.
    fn stop(&mut self) -> Result<(), LinkError> {
        let asked = Instant::now();
        self.stops = self.hub.stops();
        self.drive_off = None;
        let again = self.stopping.take().is_some();
        self.log.status.stop = StopStatus {
            count: self.stops,
            phase: StopPhase::Sent,
            ..StopStatus::default()
        };
        let confirmed = if again {
            Ok(false)
        } else {
            let (hub, stops) = (self.hub, self.stops);
            self.session
                .request_unless(RequestBody::Stop, || hub.stops() != stops)
        };
        let stopping = Stopping {
            asked,
            latest: self.session.port().now() + self.stop_time,
        };
        match confirmed {
            Ok(true) => {
                let stop = &mut self.log.status.stop;
                stop.phase = StopPhase::Confirmed;
                stop.answer_ms = Some(millis(asked));
                self.stopping = Some(stopping);
            }
            _ => self.switch_off(stopping)?,
        }
        while let Ok(order) = self.orders.try_recv() {
            let _gone = order
                .answer
                .send(Err("Not carried out, because of the stop.".into()));
        }
        Ok(())
    }

    /// Switches the bridge off and notes it as the end of a stop.
    fn switch_off(&mut self, stopping: Stopping) -> Result<(), LinkError> {
        let result = self.session.request(RequestBody::Disarm);
        let stop = &mut self.log.status.stop;
        if result.is_ok() {
            stop.phase = StopPhase::Off;
            stop.off_ms = Some(millis(stopping.asked));
            stop.answer_ms = stop.answer_ms.or(stop.off_ms);
        } else {
            stop.phase = StopPhase::Failed;
        }
        result
    }

    fn switch_off_when_due(&mut self) -> Result<(), LinkError> {
        let now = self.session.port().now();
        if let Some(stopping) = self.stopping {
            let moves = matches!(self.log.mode, Mode::Running | Mode::Stopping);
            if !moves || now >= stopping.latest {
                self.stopping = None;
                self.switch_off(stopping)?;
            }
        }
        if self.drive_off.is_some_and(|at| now >= at) {
            self.drive_off = None;
            self.session.request(RequestBody::Disarm)?;
        }
        Ok(())
    }

    /// Stops an armed rig that nobody watches.
    fn stop_if_unwatched(&mut self) {
        if self.hub.viewers() > 0 || !self.log.mode.drives() {
            self.unwatched = None;
            return;
        }
        let since = *self.unwatched.get_or_insert_with(Instant::now);
        if since.elapsed() > UNWATCHED {
            self.unwatched = None;
            self.log.status.notice =
                Some("The rig was stopped, because no page was open any more.".to_owned());
            self.hub.stop();
        }
    }

    /// Carries out an order.
    ///
    /// # Errors
    /// A failed line. What the rig refuses is an answer.
    fn obey(&mut self, action: Action) -> Result<Answer, LinkError> {
        match action {
            Action::Arm => self.ask(RequestBody::Arm, "Armed: the rig holds its position."),
            Action::Disarm => self.ask(RequestBody::Disarm, "The bridge is off."),
            Action::ClearFault => self.ask(
                RequestBody::ClearFault,
                "No fault is latched. After a fault of the encoder the position of the link is unknown: start again with --home.",
            ),
            Action::Start { shifted } => self.start(shifted),
            Action::Load { name, text } => self.load(&name, &text),
            Action::Record(on) => Ok(self.record(on)),
        }
    }

    /// Sends a request; a refusal is the answer.
    fn ask(&mut self, body: RequestBody, done: &str) -> Result<Answer, LinkError> {
        let (hub, stops) = (self.hub, self.stops);
        match self.session.request_unless(body, || hub.stops() != stops) {
            Ok(true) => Ok(Ok(done.to_owned())),
            Ok(false) => Ok(Err("Given up, because of the stop.".into())),
            Err(error @ LinkError::Refused { .. }) => Ok(Err(error.to_string().into())),
            Err(error) => Err(error),
        }
    }

    fn start(&mut self, shifted: bool) -> Result<Answer, LinkError> {
        let Some(motion) = &self.settings.motion else {
            return Ok(Err("No motion is loaded; choose a file first.".into()));
        };
        let (start, name, off) = (motion.joint.start, motion.name.clone(), motion.drive_off);
        let link = self.log.last.map_or(start, |row| row.q1);
        if !shifted && (link - start).abs() > START_TOLERANCE {
            return Ok(Err(Refused {
                text: format!(
                    "{name} starts at {start:.4} rad, but the link is at {link:.4} rad. Started from here, the whole motion is shifted by {:.4} rad; the rig checks its limits there.",
                    link - start
                ),
                shift: true,
            }));
        }
        let answer = self.ask(RequestBody::Start, &format!("{name} runs."))?;
        if answer.is_ok() {
            let now = self.session.port().now();
            self.drive_off = off
                .and_then(|off| Duration::try_from_secs_f64(off).ok())
                .map(|off| now + off);
        }
        Ok(answer)
    }

    fn load(&mut self, name: &str, text: &str) -> Result<Answer, LinkError> {
        let motion = match Motion::read(text, name, self.settings.robot.as_ref()) {
            Ok(motion) => motion,
            Err(error) => return Ok(Err(error.to_string().into())),
        };
        let done = format!(
            "{name} is loaded: {:.1} s, from {:.4} rad.",
            motion.duration(),
            motion.joint.start
        );
        let answer = self.ask(motion.request(), &done)?;
        if answer.is_ok() {
            self.settings.motion = Some(motion);
        }
        Ok(answer)
    }

    fn record(&mut self, on: bool) -> Answer {
        if !on {
            let Some(recording) = self.log.recording.take() else {
                return Err("No recording runs.".into());
            };
            self.surroundings.writing(None);
            let said = recording.finish().map_err(|error| error.to_string())?;
            self.surroundings.say(&said);
            return Ok(said);
        }
        if let Some(recording) = &self.log.recording {
            return Err(
                format!("{} is being recorded already.", recording.path().display()).into(),
            );
        }
        let recording = Recording::start(&self.settings.folder).map_err(|e| e.to_string())?;
        self.surroundings.writing(Some(recording.temporary()));
        let said = format!("Recording to {}.", recording.path().display());
        self.log.recording = Some(recording);
        Ok(said)
    }

    /// Brings the rig to rest, switches the bridge off and completes the recording, also after an error.
    fn end(mut self, result: Result<(), LiveError>) -> Result<LossReport, LiveError> {
        let stopped = self.rest();
        self.log.flushed = self
            .log
            .flushed
            .checked_sub(PACKET)
            .unwrap_or(self.log.flushed);
        self.log.status.ended = Some(match &result {
            Ok(()) => "`rig live` was ended.".to_owned(),
            Err(error) => error.to_string(),
        });
        let recorded = if self.log.recording.is_some() {
            self.record(false).map(|_| ())
        } else {
            Ok(())
        };
        self.count();
        self.log.publish();
        std::thread::sleep(FAREWELL);
        result?;
        stopped?;
        if let Err(refused) = recorded {
            self.surroundings.say(&refused.text);
        }
        let mut log = self.log;
        Ok(self.stream.end(self.session, |event| log.take(&event))?)
    }

    fn rest(&mut self) -> Result<(), LinkError> {
        if self.session.request(RequestBody::Stop).is_ok() {
            let until = self.session.port().now() + self.stop_time;
            while matches!(self.log.mode, Mode::Running | Mode::Stopping)
                && self.session.port().now() < until
            {
                self.pump()?;
            }
        }
        self.session.request(RequestBody::Disarm)
    }
}

/// Returns the milliseconds since a moment, to a tenth.
fn millis(since: Instant) -> f64 {
    (since.elapsed().as_secs_f64() * 1e4).round() / 10.0
}

#[cfg(test)]
#[path = "live_rig_test.rs"]
mod test;
