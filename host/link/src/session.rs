//! The conversation with the rig: greeting, requests that are carried out once, keep-alive messages.
//!
//! One request is active at a time and keeps its number when it is sent again. If the rig has already answered a
//! number, it only repeats the answer ([`AnswerLog`](rig_shared::wire::AnswerLog)). A request is thus carried out once,
//! even if the line loses it or its answer. `Hello` clears the numbers in the rig.

use std::collections::VecDeque;
use std::time::Duration;

use rig_shared::wire::frame::parse;
use rig_shared::wire::message::{Acknowledge, Greeting, Report, Request, RequestBody};
use rig_shared::wire::{
    Decoder, FrameCounts, MAX_FRAME, MAX_PAYLOAD, PROTOCOL_VERSION, encode, schema,
    version_of_greeting,
};

use super::error::LinkError;
use super::port::Port;

/// Time-outs of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SessionSettings {
    /// Waiting time for an acknowledgement before a request is sent again.
    pub timeout: Duration,
    /// Total number of attempts per request.
    pub attempts: u32,
    /// Longest silence towards the rig before a keep-alive message.
    pub keep_alive: Duration,
}

impl Default for SessionSettings {
    /// 100 ms are many times the round trip over USB. Ten attempts fail by chance once in 10⁷ times on a line that
    /// loses a fifth of all frames. A silence of 100 ms is a fraction of the rig's time-out.
    fn default() -> Self {
        Self {
            timeout: Duration::from_millis(100),
            attempts: 10,
            keep_alive: Duration::from_millis(100),
        }
    }
}

/// Longest wait for bytes while an answer is awaited, after which the wait may be abandoned.
const PUMP: Duration = Duration::from_millis(10);

/// A conversation with a rig after its greeting.
pub struct Session<P> {
    port: P,
    settings: SessionSettings,
    decoder: Decoder<MAX_PAYLOAD>,
    unknown_messages: u64,
    acknowledgements: Vec<Acknowledge>,
    greetings: Vec<(u16, u64, Option<Greeting>)>,
    inbox: VecDeque<Report>,
    next_id: u16,
    last_sent: Duration,
    greeting: Greeting,
}

impl<P: Port> Session<P> {
    /// Greets the rig on `port`.
    ///
    /// # Errors
    /// [`LinkError::NoAnswer`], [`LinkError::WrongProtocol`], [`LinkError::WrongSchema`],
    /// [`LinkError::BadGreeting`], or a failed line.
    pub fn open(port: P, settings: SessionSettings) -> Result<Self, LinkError> {
        let mut session = Self {
            last_sent: port.now(),
            port,
            settings,
            decoder: Decoder::new(),
            unknown_messages: 0,
            acknowledgements: Vec::new(),
            greetings: Vec::new(),
            inbox: VecDeque::new(),
            next_id: 0,
            greeting: Greeting {
                protocol: 0,
                schema: 0,
                firmware: Default::default(),
                control_rate_hz: 0,
                telemetry_decimation: 0,
                estimator_decimation: 0,
                counts_per_motor_turn: 0,
                gear_ratio: 0.0,
                torque_constant: 0.0,
            },
        };
        session.greeting = session.greet()?;
        Ok(session)
    }

    /// Returns the rig's greeting.
    pub fn greeting(&self) -> &Greeting {
        &self.greeting
    }

    /// Returns the time-outs of this session.
    pub fn settings(&self) -> SessionSettings {
        self.settings
    }

    /// Returns the port, for inspection.
    pub fn port(&self) -> &P {
        &self.port
    }

    /// Returns the port, for changes (for example of an emulated rig's environment).
    pub fn port_mut(&mut self) -> &mut P {
        &mut self.port
    }

    /// Returns the frames so far.
    pub fn frames(&self) -> FrameCounts {
        FrameCounts {
            bad_message: self.unknown_messages,
            ..self.decoder.counts()
        }
    }

    /// Sends `body`, which the rig carries out once, and waits for the answer. Reports received in the meantime are
    /// kept for [`Session::next_report`].
    ///
    /// # Errors
    /// [`LinkError::Refused`], [`LinkError::NoAnswer`], or a failed line.
    pub fn request(&mut self, body: RequestBody) -> Result<(), LinkError> {
        self.request_unless(body, || false).map(|_| ())
    }

    /// As [`Session::request`], but stops waiting as soon as `abandon` returns true, and then returns false: the rig
    /// may carry the request out, or not. A later request is carried out after it.
    ///
    /// # Errors
    /// [`LinkError::Refused`], [`LinkError::NoAnswer`], or a failed line.
    pub fn request_unless(
        &mut self,
        body: RequestBody,
        abandon: impl Fn() -> bool,
    ) -> Result<bool, LinkError> {
        let name = name_of(&body);
        let (id, frame) = self.frame(body)?;
        self.acknowledgements.clear();
        let answer = self.exchange(&name, &frame, |session| {
            let found = session.acknowledgements.iter().find(|one| one.id == id);
            match found {
                Some(one) => Some(Some(one.result)),
                None => abandon().then_some(None),
            }
        })?;
        match answer {
            None => Ok(false),
            Some(Ok(())) => Ok(true),
            Some(Err(refusal)) => Err(LinkError::Refused {
                request: name,
                refusal,
            }),
        }
    }

    /// Returns the next report other than greeting and acknowledgement, or `None` after `timeout`. Sends keep-alive
    /// messages in the meantime.
    ///
    /// # Errors
    /// A failed line.
    pub fn next_report(&mut self, timeout: Duration) -> Result<Option<Report>, LinkError> {
        let deadline = self.port.now() + timeout;
        loop {
            self.keep_alive()?;
            if let Some(report) = self.inbox.pop_front() {
                return Ok(Some(report));
            }
            let left = deadline.saturating_sub(self.port.now());
            if left.is_zero() {
                return Ok(None);
            }
            self.pump(left.min(self.settings.keep_alive))?;
        }
    }

    /// Sends a keep-alive message if the last message is too old; its answer is not awaited.
    ///
    /// # Errors
    /// A failed line.
    pub fn keep_alive(&mut self) -> Result<(), LinkError> {
        if self.port.now().saturating_sub(self.last_sent) >= self.settings.keep_alive {
            // Answers to earlier keep-alive messages are not used.
            self.acknowledgements.clear();
            let (_, frame) = self.frame(RequestBody::KeepAlive)?;
            self.send(&frame)?;
        }
        Ok(())
    }

    fn greet(&mut self) -> Result<Greeting, LinkError> {
        let (_, frame) = self.frame(RequestBody::Hello)?;
        let (protocol, fingerprint, greeting) =
            self.exchange("Hello", &frame, |session| session.greetings.pop())?;
        self.greetings.clear();
        if protocol != PROTOCOL_VERSION {
            return Err(LinkError::WrongProtocol {
                rig: protocol,
                host: PROTOCOL_VERSION,
            });
        }
        let Some(greeting) = greeting.filter(|_| fingerprint == schema()) else {
            return Err(LinkError::WrongSchema {
                rig: fingerprint,
                host: schema(),
            });
        };
        let must_be_positive = [
            ("control_rate_hz", f64::from(greeting.control_rate_hz)),
            (
                "telemetry_decimation",
                f64::from(greeting.telemetry_decimation),
            ),
            (
                "counts_per_motor_turn",
                f64::from(greeting.counts_per_motor_turn),
            ),
            ("gear_ratio", f64::from(greeting.gear_ratio.abs())),
            ("torque_constant", f64::from(greeting.torque_constant.abs())),
        ];
        for (what, value) in must_be_positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(LinkError::BadGreeting { what, value });
            }
        }
        Ok(greeting)
    }

    /// Sends `frame` until `found` returns the answer from the received reports.
    fn exchange<T>(
        &mut self,
        name: &str,
        frame: &[u8],
        mut found: impl FnMut(&mut Self) -> Option<T>,
    ) -> Result<T, LinkError> {
        for _ in 0..self.settings.attempts {
            self.send(frame)?;
            let deadline = self.port.now() + self.settings.timeout;
            loop {
                if let Some(answer) = found(self) {
                    return Ok(answer);
                }
                let left = deadline.saturating_sub(self.port.now());
                if left.is_zero() {
                    break;
                }
                self.pump(left.min(PUMP))?;
            }
        }
        Err(LinkError::NoAnswer {
            request: name.to_owned(),
            attempts: self.settings.attempts,
            each: self.settings.timeout,
        })
    }

    /// Encodes a new request as a frame. A delimiter before it ends any incomplete frame on the line.
    fn frame(&mut self, body: RequestBody) -> Result<(u16, Vec<u8>), LinkError> {
        let request = name_of(&body);
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        let mut frame = [0; MAX_FRAME];
        let length = encode(&Request { id, body }, &mut frame)
            .map_err(|source| LinkError::Encode { request, source })?;
        let mut bytes = vec![0];
        bytes.extend_from_slice(frame.get(..length).unwrap_or_default());
        Ok((id, bytes))
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), LinkError> {
        self.port.write(frame)?;
        self.last_sent = self.port.now();
        Ok(())
    }

    /// Waits once for bytes and sorts the reports in them.
    fn pump(&mut self, timeout: Duration) -> Result<(), LinkError> {
        let mut bytes = [0; 4096];
        let count = self.port.read(&mut bytes, timeout)?;
        for byte in bytes.iter().take(count) {
            let Some(Ok(payload)) = self.decoder.push(*byte) else {
                continue;
            };
            match parse::<Report>(payload) {
                Ok(Report::Acknowledge(acknowledge)) => self.acknowledgements.push(acknowledge),
                Ok(Report::Greeting(greeting)) => {
                    self.greetings
                        .push((greeting.protocol, greeting.schema, Some(greeting)));
                }
                Ok(report) => self.inbox.push_back(report),
                Err(_) => match version_of_greeting(payload) {
                    Some((protocol, fingerprint)) => {
                        self.greetings.push((protocol, fingerprint, None))
                    }
                    None => self.unknown_messages += 1,
                },
            }
        }
        Ok(())
    }
}

/// Returns the name of a request without its content.
fn name_of(body: &RequestBody) -> String {
    let text = format!("{body:?}");
    text.split(['(', ' ', '{'])
        .next()
        .unwrap_or_default()
        .to_owned()
}
