//! Converts ROS `sensor_msgs/JointState` to rows; names are matched with the robot's joints.

use super::clock::{Clock, UNWANTED};
use super::flat_rows::in_nanoseconds;
use super::remark::Remark;
use super::ros_layout::Field;
use super::ros_message::{Encoding, JointSample};

/// Reason why a message is refused.
#[derive(Debug)]
pub(super) enum Refusal {
    /// The message contains only other joints: their names, quoted.
    Foreign(String),
    /// One clause that follows "message 3 on /joint_states".
    Message(String),
}

/// Converter from joint states to rows.
#[derive(Debug, Default)]
pub(super) struct JointStates {
    /// Names of the robot's joints.
    joints: Vec<String>,
    sample: JointSample,
    /// Text in front of the robot's names in the messages.
    prefix: String,
    /// Names of the previous message, as in [`JointSample`], and the positions of the robot's joints among them.
    known: (Vec<u8>, Vec<usize>),
    places: Vec<usize>,
    has_velocity: bool,
    has_effort: bool,
    clock: Clock,
    is_logged_time: bool,
    /// Time of the first message, whole seconds and nanoseconds.
    origin: (i64, i64),
    has_first: bool,
}

/// Characters that separate a prefix from a name.
const PARTING: [char; 5] = ['/', '_', '.', ':', '-'];

impl JointStates {
    pub(super) fn new(joints: &[String], clock: Clock) -> Self {
        Self {
            joints: joints.to_vec(),
            clock,
            ..Self::default()
        }
    }

    /// Reads a message; the first one determines the columns.
    pub(super) fn read(
        &mut self,
        message: &[u8],
        fields: &[Field],
        encoding: Encoding,
        log_time: u64,
    ) -> Result<(), Refusal> {
        let read = self.sample.read(message, fields, encoding);
        read.map_err(Refusal::Message)?;
        if (&self.sample.names, &self.sample.ends) != (&self.known.0, &self.known.1)
            || !self.has_first
        {
            self.find_joints()?;
        }
        let count = self.sample.ends.len();
        let (velocity, effort) = (&self.sample.velocity, &self.sample.effort);
        let arrays = [
            ("position", &self.sample.position, true),
            ("velocity", velocity, self.has_velocity),
            ("effort", effort, self.has_effort),
        ];
        for (name, values, needed) in arrays {
            if values.len() != count && (needed || !values.is_empty()) {
                let first = if self.has_first && name != "position" {
                    "; every message must have the arrays of the first"
                } else {
                    ""
                };
                return Err(Refusal::Message(format!(
                    "has {count} names but {} values of {name}{first}",
                    values.len()
                )));
            }
        }
        if !self.has_first {
            self.begin(log_time);
        }
        Ok(())
    }

    /// Stores the properties that all messages share with the first one.
    fn begin(&mut self, log_time: u64) {
        let sample = &self.sample;
        self.has_first = true;
        self.is_logged_time = self.is_zero() || self.clock == Clock::Log;
        self.origin = self.time(log_time);
        self.has_effort = !sample.effort.is_empty();
        self.has_velocity = !sample.velocity.is_empty()
            && self.places.iter().all(|k| !sample.velocity[*k].is_nan());
    }

    /// Returns true if the last message has no header stamp.
    fn is_zero(&self) -> bool {
        (self.sample.seconds, self.sample.nanoseconds) == (0, 0)
    }

    /// Returns true if the messages have torques.
    pub(super) fn has_effort(&self) -> bool {
        self.has_effort
    }

    fn time(&self, log_time: u64) -> (i64, i64) {
        if self.is_logged_time {
            // 2⁶⁴ ns are less than 2⁶³ s.
            let whole = (log_time / 1_000_000_000) as i64;
            (whole, (log_time % 1_000_000_000) as i64)
        } else {
            (self.sample.seconds, self.sample.nanoseconds)
        }
    }

    /// Returns the time of the last message, ns, and whether it is a header stamp.
    pub(super) fn absolute_time(&self, log_time: u64) -> (i128, bool) {
        (in_nanoseconds(self.time(log_time)), !self.is_logged_time)
    }

    /// Returns the columns and their names in messages.
    pub(super) fn columns(&self) -> (Vec<String>, Vec<String>) {
        let (mut names, mut labels) = (vec!["t".to_owned()], vec!["t".to_owned()]);
        for (prefix, quantity, there) in self.quantities() {
            if !there {
                continue;
            }
            for (k, joint) in self.joints.iter().enumerate() {
                names.push(format!("{prefix}{}", k + 1));
                labels.push(format!("{quantity} of joint \"{}{joint}\"", self.prefix));
            }
        }
        (names, labels)
    }

    fn quantities(&self) -> [(&'static str, &'static str, bool); 3] {
        [
            ("q", "position", true),
            ("qd", "velocity", self.has_velocity),
            ("tau", "effort", self.has_effort),
        ]
    }

    /// Writes the last message as a row of [`JointStates::columns`].
    pub(super) fn row(&self, log_time: u64, values: &mut [f64]) {
        let (seconds, nanoseconds) = self.time(log_time);
        // The difference of whole numbers is exact; doubles resolve seconds since 1970 only to 0.2 µs.
        let since = (
            seconds.wrapping_sub(self.origin.0),
            nanoseconds - self.origin.1,
        );
        let t = since.0 as f64 + since.1 as f64 * 1e-9;
        let sample = &self.sample;
        let lists = [
            (&sample.position, true),
            (&sample.velocity, self.has_velocity),
            (&sample.effort, self.has_effort),
        ];
        let there = lists.into_iter().filter(|(_, there)| *there);
        let joints = there.flat_map(|(list, _)| {
            let value = |k: &usize| list.get(*k).copied().unwrap_or(f64::NAN);
            self.places.iter().map(value)
        });
        for (place, value) in values.iter_mut().zip(std::iter::once(t).chain(joints)) {
            *place = value;
        }
    }

    /// Returns the remarks about the first message.
    pub(super) fn remarks(&self, topic: &str) -> Vec<Remark> {
        let mut remarks = Vec::new();
        if topic != "/joint_states" {
            remarks.push(Remark::Topic {
                topic: topic.into(),
            });
        }
        let origin = format!("{}.{:09}", self.origin.0, self.origin.1);
        remarks.push(if self.is_logged_time {
            Remark::LogTime {
                origin,
                stamp: if self.is_zero() { "is zero" } else { UNWANTED },
            }
        } else {
            Remark::Stamp { origin }
        });
        if !self.prefix.is_empty() {
            remarks.push(Remark::Prefix {
                topic: topic.into(),
                prefix: self.prefix.clone(),
            });
        }
        let names: Vec<&[u8]> = self.sample.names().collect();
        let others = (0..names.len()).filter(|k| !self.places.contains(k));
        let others: Vec<&[u8]> = others.map(|k| names[k]).collect();
        if !others.is_empty() {
            remarks.push(Remark::OtherJoints {
                joints: quoted(&others),
            });
        }
        if !self.has_velocity
            && let Some(k) = (self.places.iter())
                .position(|k| self.sample.velocity.get(*k).is_some_and(|v| v.is_nan()))
        {
            remarks.push(Remark::NoVelocity {
                joint: format!("{}{}", self.prefix, self.joints[k]),
            });
        }
        remarks
    }

    /// Finds the robot's joints among the names of the message.
    fn find_joints(&mut self) -> Result<(), Refusal> {
        let names: Vec<&[u8]> = self.sample.names().collect();
        let all = quoted(&names);
        if !self.has_first {
            self.prefix = prefix(&names, &self.joints).map_err(|several| {
                Refusal::Message(format!(
                    "has the robot's joints behind several prefixes ({several}); record those of one robot, or give its joints their full names in the description"
                ))
            })?;
        }
        let place = |joint: &String| {
            let is_it =
                |name: &&[u8]| name.strip_prefix(self.prefix.as_bytes()) == Some(joint.as_bytes());
            let mut there = (0..names.len()).filter(|k| is_it(&names[*k]));
            (there.next(), there.next().is_some())
        };
        let mut places = Vec::with_capacity(self.joints.len());
        let mut missing = Vec::new();
        for joint in &self.joints {
            match place(joint) {
                (None, _) => missing.push(format!("\"{}{joint}\"", self.prefix)),
                (_, true) => {
                    return Err(Refusal::Message(format!(
                        "names joint \"{}{joint}\" twice",
                        self.prefix
                    )));
                }
                (Some(k), false) => places.push(k),
            }
        }
        if places.is_empty() {
            return Err(Refusal::Foreign(all));
        }
        if !missing.is_empty() {
            let advice = if self.has_first {
                "several publishers fill the topic in turn: record the topic of one publisher that has all joints of the robot"
            } else {
                "where such a joint never moves, make it type=\"fixed\" if a URDF describes the robot; where another publisher sends it, record a topic that has all joints"
            };
            return Err(Refusal::Message(format!(
                "has no joint {} of the robot, only {all}; {advice}",
                missing.join(", ")
            )));
        }
        self.places = places;
        self.known = (self.sample.names.clone(), self.sample.ends.clone());
        Ok(())
    }
}

/// Returns the text in front of all joint names of the robot in a message. Empty if a joint appears under its own name,
/// or if no prefix fits.
///
/// # Errors
/// More than one prefix, quoted.
fn prefix(names: &[&[u8]], joints: &[String]) -> Result<String, String> {
    let is_there = |prefix: &str, joint: &String| {
        let full = format!("{prefix}{joint}");
        names.contains(&full.as_bytes())
    };
    if joints.iter().any(|j| is_there("", j)) {
        return Ok(String::new());
    }
    let first = joints.first().map_or("", String::as_str);
    let mut found: Vec<&str> = names
        .iter()
        .filter_map(|name| std::str::from_utf8(name).ok()?.strip_suffix(first))
        .filter(|p| p.ends_with(PARTING) && joints.iter().all(|j| is_there(p, j)))
        .collect();
    found.dedup();
    match found.as_slice() {
        [] => Ok(String::new()),
        [one] => Ok((*one).to_owned()),
        several => Err(several
            .iter()
            .map(|p| format!("\"{}\"", p.escape_debug()))
            .collect::<Vec<_>>()
            .join(", ")),
    }
}

/// Returns at most twelve names in quotation marks.
fn quoted(names: &[&[u8]]) -> String {
    const MOST: usize = 12;
    let list: Vec<String> = names
        .iter()
        .take(MOST)
        .map(|n| format!("\"{}\"", String::from_utf8_lossy(n).escape_debug()))
        .collect();
    let more = if names.len() > MOST { ", …" } else { "" };
    if list.is_empty() {
        "no joint".to_owned()
    } else {
        list.join(", ") + more
    }
}
