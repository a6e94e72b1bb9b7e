//! The conversation with the rig: greeting, requests that are carried out once, signs of life.
//!
//! One request is under way at a time. It keeps its number when it is sent again, and the rig only answers a
//! number again that it has answered before ([`Ledger`](rig_shared::wire::Ledger)): a request is carried out
//! once, however often the line loses it or its answer. `Hello` has the rig forget the numbers.

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

/// How patient a session is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SessionSettings {
    /// Wait for an acknowledgement before a request is sent again.
    pub timeout: Duration,
    /// How often a request is sent in all.
    pub attempts: u32,
    /// Longest silence towards the rig.
    pub keep_alive: Duration,
}

impl Default for SessionSettings {
    /// 100 ms are many times the way to the rig and back over USB; ten attempts fail by chance once in 10⁷
    /// times on a line that loses a fifth of all frames. 100 ms of silence are a fraction of a rig's patience.
    fn default() -> Self {
        Self {
            timeout: Duration::from_millis(100),
            attempts: 10,
            keep_alive: Duration::from_millis(100),
        }
    }
}

/// A conversation with a rig that has been greeted.
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
    /// Greets the rig at the other end of `port`.
    ///
    /// # Errors
    /// [`LinkError::NoAnswer`], [`LinkError::WrongProtocol`], [`LinkError::WrongSchema`],
    /// [`LinkError::BadGreeting`], or a broken line.
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

    /// What the rig said of itself.
    pub fn greeting(&self) -> &Greeting {
        &self.greeting
    }

    /// How patient this session is.
    pub fn settings(&self) -> SessionSettings {
        self.settings
    }

    /// The port, to look into.
    pub fn port(&self) -> &P {
        &self.port
    }

    /// The port, to act upon (an emulated rig's surroundings, say).
    pub fn port_mut(&mut self) -> &mut P {
        &mut self.port
    }

    /// Frames seen so far.
    pub fn frames(&self) -> FrameCounts {
        FrameCounts {
            bad_message: self.unknown_messages,
            ..self.decoder.counts()
        }
    }

    /// Has the rig carry out `body`, once, and waits for its answer. Reports that come meanwhile are kept for
    /// [`Session::next_report`].
    ///
    /// # Errors
    /// [`LinkError::Refused`], [`LinkError::NoAnswer`], or a broken line.
    pub fn request(&mut self, body: RequestBody) -> Result<(), LinkError> {
        let name = name_of(&body);
        let (id, frame) = self.frame(body)?;
        self.acknowledgements.clear();
        let answer = self.exchange(&name, &frame, |session| {
            let found = session.acknowledgements.iter().find(|one| one.id == id);
            found.map(|one| one.result)
        })?;
        answer.map_err(|refusal| LinkError::Refused {
            request: name,
            refusal,
        })
    }

    /// The next report that is neither greeting nor acknowledgement; `None` when `timeout` has passed.
    /// Gives signs of life meanwhile.
    ///
    /// # Errors
    /// A broken line.
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

    /// Sends a sign of life where the last thing sent is too long ago; nobody waits for its answer.
    ///
    /// # Errors
    /// A broken line.
    pub fn keep_alive(&mut self) -> Result<(), LinkError> {
        if self.port.now().saturating_sub(self.last_sent) >= self.settings.keep_alive {
            // Nobody waits for the answers to the signs of life before.
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

    /// Sends `frame` until `found` finds the answer among what has come.
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
                self.pump(left)?;
            }
        }
        Err(LinkError::NoAnswer {
            request: name.to_owned(),
            attempts: self.settings.attempts,
            each: self.settings.timeout,
        })
    }

    /// A new request as a frame. A delimiter before it ends whatever the line may have left half-sent.
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

    /// Waits for bytes once and sorts the reports in them.
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

/// A request's name without its content.
fn name_of(body: &RequestBody) -> String {
    let text = format!("{body:?}");
    text.split(['(', ' ', '{'])
        .next()
        .unwrap_or_default()
        .to_owned()
}
