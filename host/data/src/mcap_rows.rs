//! MCAP reader: one JSON message per sample on `/joint/state`, or joint states of ROS, in CDR, as in ROS 1, or as JSON.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::channel;
use super::clock::Clock;
use super::columns::{FileColumn, Layout};
use super::error::DataError;
use super::header::Header;
use super::joint_states::{JointStates, Refusal};
use super::json_samples::{JsonSamples, written};
use super::mcap_messages::{Event, Messages, cut_off};
use super::place::Place;
use super::remark::Remark;
use super::ros_layout::{Field, joint_state};
use super::ros_message::{Encoding, ros_encoding};
use rig_output::format_short;

/// Topic of the joint samples.
pub(super) const TOPIC: &str = "/joint/state";

/// Names of the ROS joint state in both versions.
const JOINT_STATE: [&str; 2] = ["sensor_msgs/msg/JointState", "sensor_msgs/JointState"];

/// Returns true if a type of messages is the joint state of ROS.
pub(super) fn is_joint_state(of: &str) -> bool {
    JOINT_STATE.contains(&of)
}

/// Content of a channel's messages.
enum Content {
    /// One JSON object per sample.
    Json,
    /// Joint states of ROS.
    JointStates(Vec<Field>, Encoding),
    /// Joint samples that cannot be read: the reason, one clause.
    Unreadable(String),
    /// Other content.
    Other,
}

struct Channel {
    topic: usize,
    content: Content,
}

struct Topic {
    name: String,
    /// True if a standard definition is used for its messages.
    is_undefined: bool,
    /// Name of the schema.
    of: String,
    /// Number of messages so far.
    messages: u64,
}

/// Reader of the samples.
enum Samples {
    Json(JsonSamples),
    JointStates(Box<JointStates>),
}

/// Rows of an MCAP file in the order of the file.
pub(super) struct McapRows {
    path: PathBuf,
    messages: Messages,
    channels: BTreeMap<usize, Channel>,
    topics: Vec<Topic>,
    /// Names of the robot's joints.
    joints: Vec<String>,
    clock: Clock,
    /// Topic of the recording and its reader, after its first message.
    chosen: Option<(usize, Samples)>,
    message: Vec<u8>,
    /// Number of the message on its topic.
    number: u64,
    log_time: u64,
    /// True if a message was logged before its predecessor in the file.
    is_unsorted: bool,
    /// Number of rows returned, and time of the last one, s.
    given: (u64, f64),
    remarks: Vec<Remark>,
    /// True if the first message was read but not returned yet.
    waiting: bool,
}

impl McapRows {
    /// Opens the files of a recording and determines the columns from the first message. `path` is the name of the
    /// recording in messages.
    pub(super) fn open(
        path: &Path,
        files: &[PathBuf],
        joints: &[String],
        clock: Clock,
    ) -> Result<(Self, Header), DataError> {
        let mut rows = Self {
            path: path.into(),
            messages: Messages::open(files)?,
            channels: BTreeMap::new(),
            topics: Vec::new(),
            joints: joints.to_vec(),
            clock,
            chosen: None,
            message: Vec::new(),
            number: 0,
            log_time: 0,
            is_unsorted: false,
            given: (0, 0.0),
            remarks: Vec::new(),
            waiting: false,
        };
        if !rows.next_message()? {
            return Err(rows.nothing_there());
        }
        rows.waiting = true;
        let header = match &rows.chosen {
            Some((_, Samples::Json(samples))) => Header::of(samples.names().to_vec()),
            Some((topic, Samples::JointStates(states))) => {
                let Topic {
                    name: topic,
                    is_undefined,
                    of,
                    ..
                } = &rows.topics[*topic];
                rows.remarks.extend(states.remarks(topic));
                let assumed = is_undefined.then(|| Remark::StandardDefinition { of: of.clone() });
                rows.remarks.extend(assumed);
                let (names, labels) = states.columns();
                Header {
                    names,
                    labels,
                    line: None,
                    without_effort: (!states.has_effort()).then(|| {
                        format!(
                            "message 1 on {topic} has an empty `effort` array, so there is no torque; let the robot's driver publish the efforts and record again"
                        )
                    }),
                    ..Header::default()
                }
            }
            None => Header::of(Vec::new()),
        };
        Ok((rows, header))
    }

    pub(super) fn bytes_read(&self) -> u64 {
        self.messages.bytes_read()
    }

    /// Returns the time of the last row, ns, and whether it is a header stamp.
    pub(super) fn time(&self) -> (i128, bool) {
        match &self.chosen {
            Some((_, Samples::JointStates(states))) => states.absolute_time(self.log_time),
            _ => (i128::from(self.log_time), false),
        }
    }

    /// Returns the assumptions and omissions so far; complete after the last row.
    pub(super) fn remarks(&self) -> Vec<Remark> {
        let mut remarks = self.remarks.clone();
        remarks.extend(cut_off(&self.path, self.messages.broken(), self.given));
        remarks
    }

    /// Returns the likely cause of time that does not grow, after a semicolon; empty if none is known.
    pub(super) fn order_hint(&self) -> &'static str {
        if self.is_unsorted {
            "; the messages of the file are not in the order of their log time (`mcap sort in.mcap -o out.mcap` sorts them)"
        } else if matches!(self.chosen, Some((_, Samples::JointStates(_)))) {
            "; several publishers on one topic interleave like this: record that of one"
        } else {
            ""
        }
    }

    fn error(&self, message: String) -> DataError {
        DataError::Mcap {
            path: self.path.clone(),
            message,
        }
    }

    /// Returns the error for a file without a sample.
    fn nothing_there(&self) -> DataError {
        let passed_over = self.remarks.iter().find_map(|remark| match remark {
            Remark::OtherMessages {
                topic,
                number,
                joints,
            } => Some((topic, number, joints)),
            _ => None,
        });
        if let Some((topic, number, joints)) = passed_over {
            let wanted: Vec<String> = self.joints.iter().map(|j| format!("\"{j}\"")).collect();
            return self.error(format!(
                "no message has the joints of the robot ({}); message {number} on {topic} has {joints}; give the joints in the description the names that the messages have",
                wanted.join(", ")
            ));
        }
        let broken = self.messages.broken().first().map(|(_, broken)| broken.at);
        let of_other = |channel: &Channel| matches!(channel.content, Content::Other);
        let has_other = !self.channels.is_empty() && self.channels.values().all(of_other);
        if let (Some(at), false) = (broken, has_other) {
            return self.error(format!(
                "the file breaks off at byte {at} before the first sample; record it again"
            ));
        }
        let topics: Vec<String> = self
            .topics
            .iter()
            .map(|t| format!("{} ({})", t.name, t.of))
            .collect();
        let there = if topics.is_empty() {
            "it has no channel".to_owned()
        } else {
            format!("its topics are {}", topics.join(", "))
        };
        let cut = broken.map_or_else(String::new, |at| {
            format!("; it breaks off at byte {at}, which loses what came later")
        });
        self.error(format!(
            "there is no message on topic {TOPIC} and no joint state of ROS ({}) that can be read; {there}{cut}. If other topics hold the samples, `rig inspect` lists their columns and the --map options that read them",
            JOINT_STATE[0]
        ))
    }

    /// Reads the next message of the recording's topic into `self.message` and parses its joints; returns false at the
    /// end.
    fn next_message(&mut self) -> Result<bool, DataError> {
        loop {
            let (channel, log_time) = match self.messages.next_event()? {
                None => return Ok(false),
                Some(Event::Channel(number, channel)) => {
                    let of = channel.schema.as_ref();
                    let of = of.map_or("no schema", |s| s.name.as_str()).to_owned();
                    let content = content(channel);
                    let known = self.topics.iter().position(|t| t.name == channel.topic);
                    let topic = known.unwrap_or(self.topics.len());
                    if known.is_none() {
                        self.topics.push(Topic {
                            name: channel.topic.clone(),
                            is_undefined: channel.undefined().is_some(),
                            of,
                            messages: 0,
                        });
                    }
                    self.channels.insert(number, Channel { topic, content });
                    continue;
                }
                Some(Event::Message {
                    channel,
                    log_time,
                    data,
                }) => {
                    let content = self.channels.get(&channel).map(|c| &c.content);
                    if matches!(content, None | Some(Content::Other)) {
                        continue;
                    }
                    self.message.clear();
                    self.message.extend_from_slice(data);
                    (channel, log_time)
                }
            };
            if self.accept(channel, log_time)? {
                return Ok(true);
            }
        }
    }

    /// Checks the message in `self.message`; returns false if it is skipped.
    fn accept(&mut self, channel: usize, log_time: u64) -> Result<bool, DataError> {
        let Some(Channel { topic, content }) = self.channels.get(&channel) else {
            return Ok(false);
        };
        let topic = *topic;
        self.topics[topic].messages += 1;
        let number = self.topics[topic].messages;
        let name = &self.topics[topic].name;
        let refuse = |what: String| DataError::Mcap {
            path: self.path.clone(),
            message: format!("message {number} on {name} {what}"),
        };
        let another = match &self.chosen {
            Some((chosen, _)) if *chosen != topic => Some(&self.topics[*chosen].name),
            _ => None,
        };
        match content {
            Content::Other => return Ok(false),
            Content::Unreadable(why) => {
                return Err(self.error(format!("the messages on {name} {why}")));
            }
            Content::Json => match &self.chosen {
                None => {
                    let samples = JsonSamples::new(&self.message).map_err(|what| {
                        refuse(format!(
                            "{what}; a sample looks like {{\"t\":0.0,\"q1\":0.1,\"tau1\":2.5}}"
                        ))
                    })?;
                    self.chosen = Some((topic, Samples::Json(samples)));
                }
                Some(_) if another.is_some() => return Err(self.two_topics(topic)),
                Some(_) => {}
            },
            Content::JointStates(fields, encoding) => {
                // If the file has samples in the project's own format, topics of ROS are not the recording.
                if let Some((_, Samples::Json(_))) = &self.chosen {
                    return Ok(false);
                }
                let mut fresh = JointStates::new(&self.joints, self.clock);
                let states = match &mut self.chosen {
                    Some((_, Samples::JointStates(states))) if another.is_none() => states,
                    _ => &mut fresh,
                };
                match states.read(&self.message, fields, *encoding, log_time) {
                    Ok(()) => {}
                    Err(Refusal::Foreign(joints)) => {
                        let (topic, joints) = (name.clone(), joints);
                        self.pass_over(topic, number, joints);
                        return Ok(false);
                    }
                    Err(Refusal::Message(what)) => return Err(refuse(what)),
                }
                if another.is_some() {
                    return Err(self.two_topics(topic));
                }
                if self.chosen.is_none() {
                    self.chosen = Some((topic, Samples::JointStates(Box::new(fresh))));
                }
            }
        }
        self.is_unsorted |= log_time < self.log_time;
        (self.number, self.log_time) = (number, log_time);
        Ok(true)
    }

    fn pass_over(&mut self, topic: String, number: u64, joints: String) {
        let is_known =
            |r: &Remark| matches!(r, Remark::OtherMessages { topic: t, .. } if *t == topic);
        if !self.remarks.iter().any(is_known) {
            self.remarks.push(Remark::OtherMessages {
                topic,
                number,
                joints,
            });
        }
    }

    /// Returns the error for two topics that may both be the recording.
    fn two_topics(&self, other: usize) -> DataError {
        let chosen = self.chosen.as_ref().map_or(other, |(topic, _)| *topic);
        let (a, b) = (&self.topics[chosen].name, &self.topics[other].name);
        self.error(format!(
            "topics {a} and {b} both hold states of the robot's joints; keep one of them (`mcap filter in.mcap -o out.mcap --include-topic-regex '^{a}$'`)"
        ))
    }

    /// Reads the next message into `values`, one per column; returns its number, or `None` at the end.
    pub(super) fn next_row(
        &mut self,
        layout: &Layout,
        values: &mut [f64],
    ) -> Result<Option<u64>, DataError> {
        if !std::mem::take(&mut self.waiting) && !self.next_message()? {
            return Ok(None);
        }
        match &self.chosen {
            Some((topic, Samples::Json(samples))) => {
                samples.read(&self.message, values).map_err(|what| {
                    let name = &self.topics[*topic].name;
                    self.error(format!("message {} on {name} {what}", self.number))
                })?;
            }
            Some((_, Samples::JointStates(states))) => states.row(self.log_time, values),
            None => return Ok(None),
        }
        if let Some((_, column, value)) = layout.refused(values) {
            return Err(self.bad_value(column, value));
        }
        let time = values.get(layout.time).copied().unwrap_or(f64::NAN);
        self.given = (self.given.0 + 1, time);
        Ok(Some(self.number))
    }

    fn bad_value(&self, column: &FileColumn, value: f64) -> DataError {
        let place = Place::Message(self.number);
        if value.is_finite() {
            return column.out_of_range(&self.path, place, value);
        }
        DataError::NotANumber {
            path: self.path.clone(),
            place,
            column: column.label.clone(),
            found: match &self.chosen {
                Some((_, Samples::Json(_))) => written(&self.message, &column.name),
                _ => format_short(value),
            },
        }
    }
}

/// Determines the content of a channel's messages.
fn content(channel: &channel::Channel) -> Content {
    let (topic, encoding) = (channel.topic.as_str(), channel.encoding.as_str());
    let schema = channel.schema.as_ref();
    let has_joints = schema.is_some_and(|s| is_joint_state(&s.name));
    match (schema, ros_encoding(encoding)) {
        _ if topic == TOPIC && encoding == "json" => Content::Json,
        _ if encoding == "json" && has_joints => Content::JointStates(Vec::new(), Encoding::Json),
        (Some(schema), Some(ros)) if has_joints => {
            match joint_state(schema.ros_text(), ros == Encoding::Ros1) {
                Ok(fields) => Content::JointStates(fields, ros),
                Err(why) => Content::Unreadable(format!("cannot be read: {why}")),
            }
        }
        _ if topic == TOPIC => Content::Unreadable(format!(
            "are encoded as \"{}\", but only \"json\" can be read on this topic; export the recording as JSON or CSV",
            encoding.escape_debug()
        )),
        _ => Content::Other,
    }
}
