//! The numbers of a message as channels, each with a name such as `position/elbow` or `wrench/force/x`.
//!
//! The name is the path of fields. An element of an array is named by the text array beside it that has as many entries
//! (`name` of a joint state), otherwise by its index from 0. The header is no channel; its stamp is kept as time.

use super::ros_layout::{Count, Field, Kind, Part};
use super::ros_message::{Cursor, Encoding};

/// Number of elements above which an array has no channels: it is a picture or a point cloud. The largest robots have
/// fewer joints.
const LONGEST_ARRAY: usize = 128;

/// Number of channels above which a message has none.
const MOST_CHANNELS: usize = 2048;

/// Reader of messages of one type.
#[derive(Clone, Debug)]
pub(super) enum Decoder {
    /// JSON objects.
    Json,
    /// Messages of ROS with these fields.
    Ros(Vec<Field>, Encoding),
}

/// The channels of one message; reused from message to message.
#[derive(Debug, Default)]
pub(super) struct FlatMessage {
    /// Names of the channels.
    pub names: Vec<String>,
    /// The part of each name that may state a unit: an element of an array has that of the array, because its own name
    /// is that of a joint or a number.
    pub stems: Vec<String>,
    /// Their values; NaN if the message has no number there.
    pub values: Vec<f64>,
    /// Header stamp in seconds and nanoseconds; `None` without header.
    pub stamp: Option<(i64, i64)>,
    /// Lengths of arrays and texts that determine the names.
    shape: Vec<u8>,
}

/// A message as a tree.
enum Node {
    Number(f64),
    Text(String),
    Group(Vec<(String, Node)>),
    Array(Vec<Node>),
    /// An array with too many elements.
    Skipped,
}

impl Node {
    fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Returns the first member of a group that has one of these names.
    fn member(&self, names: &[&str]) -> Option<&Self> {
        let Self::Group(members) = self else {
            return None;
        };
        let found = members.iter().find(|(n, _)| names.contains(&n.as_str()));
        found.map(|(_, node)| node)
    }
}

impl FlatMessage {
    /// Reads a message. Returns true if its channels differ from those of the message before.
    ///
    /// # Errors
    /// The reason why it cannot be read, one clause that follows "message 3 on /topic".
    pub(super) fn read(&mut self, message: &[u8], decoder: &Decoder) -> Result<bool, String> {
        match decoder {
            Decoder::Json => self.read_json(message),
            Decoder::Ros(fields, encoding) => self.read_ros(message, fields, *encoding),
        }
    }

    fn read_json(&mut self, message: &[u8]) -> Result<bool, String> {
        let plain = super::json_samples::without_nan(message);
        let value = serde_json::from_slice(plain.as_deref().unwrap_or(message));
        let tree = json_tree(value.map_err(|e| format!("is no JSON ({e})"))?);
        self.stamp = stamp_of(&tree);
        self.flatten(&tree)
    }

    fn read_ros(
        &mut self,
        message: &[u8],
        fields: &[Field],
        encoding: Encoding,
    ) -> Result<bool, String> {
        let short = || "ends in the middle of a field".to_owned();
        let mut quick = Quick::default();
        let mut cursor = Cursor::new(message, encoding)?;
        (quick.walk(&mut cursor, fields, false)).ok_or_else(short)?;
        self.stamp = match quick.stamp {
            (Some(seconds), Some(nanoseconds)) => Some((seconds, nanoseconds)),
            _ => None,
        };
        if !self.names.is_empty()
            && quick.shape == self.shape
            && quick.values.len() == self.values.len()
        {
            self.values = quick.values;
            return Ok(false);
        }
        let mut cursor = Cursor::new(message, encoding)?;
        let tree = ros_tree(&mut cursor, fields).ok_or_else(short)?;
        self.shape = quick.shape;
        self.flatten(&Node::Group(tree))
    }

    /// Takes names and values from a tree.
    fn flatten(&mut self, tree: &Node) -> Result<bool, String> {
        let before = std::mem::take(&mut self.names);
        self.values.clear();
        self.stems.clear();
        self.add(tree, "", "");
        if self.values.len() > MOST_CHANNELS {
            return Err(format!(
                "has {} numbers, but at most {MOST_CHANNELS} are told apart",
                self.values.len()
            ));
        }
        Ok(before != self.names)
    }

    fn add(&mut self, node: &Node, path: &str, stem: &str) {
        match node {
            Node::Number(value) => {
                self.names.push(path.to_owned());
                self.stems.push(stem.to_owned());
                self.values.push(*value);
            }
            Node::Text(_) | Node::Skipped => {}
            Node::Array(elements) => self.add_elements(elements, None, path),
            Node::Group(members) => {
                for (name, member) in members {
                    let path = joined(path, name);
                    match member {
                        Node::Group(_) if path == "header" => {}
                        Node::Array(elements) => {
                            self.add_elements(elements, labels(members, elements.len()), &path);
                        }
                        other => self.add(other, &path, &path),
                    }
                }
            }
        }
    }

    fn add_elements(&mut self, elements: &[Node], labels: Option<Vec<&str>>, path: &str) {
        for (k, element) in elements.iter().enumerate() {
            let label = labels.as_ref().and_then(|l| l.get(k));
            let own = match label {
                Some(label) => joined(path, label),
                None => joined(path, &k.to_string()),
            };
            self.add(element, &own, path);
        }
    }
}

fn joined(path: &str, name: &str) -> String {
    match path {
        "" => name.to_owned(),
        _ => format!("{path}/{name}"),
    }
}

/// Returns the first text array with `count` different entries.
fn labels(members: &[(String, Node)], count: usize) -> Option<Vec<&str>> {
    members.iter().find_map(|(_, member)| {
        let Node::Array(elements) = member else {
            return None;
        };
        let texts: Vec<&str> = elements.iter().map(Node::text).collect::<Option<_>>()?;
        let mut sorted = texts.clone();
        sorted.sort_unstable();
        sorted.dedup();
        (count > 0 && texts.len() == count && sorted.len() == count).then_some(texts)
    })
}

fn json_tree(value: serde_json::Value) -> Node {
    use serde_json::Value;
    match value {
        Value::Null => Node::Number(f64::NAN),
        Value::Bool(on) => Node::Number(f64::from(u8::from(on))),
        Value::Number(number) => Node::Number(number.as_f64().unwrap_or(f64::NAN)),
        Value::String(text) => Node::Text(text),
        Value::Array(list) if list.len() > LONGEST_ARRAY => Node::Skipped,
        Value::Array(list) => Node::Array(list.into_iter().map(json_tree).collect()),
        Value::Object(map) => Node::Group(
            map.into_iter()
                .map(|(name, value)| (name, json_tree(value)))
                .collect(),
        ),
    }
}

/// Returns the header stamp of a JSON message that has one as ROS names it.
fn stamp_of(tree: &Node) -> Option<(i64, i64)> {
    let stamp = tree.member(&["header"])?.member(&["stamp"])?;
    let whole = |names: &[&str]| match stamp.member(names) {
        Some(Node::Number(value)) => Some(*value as i64),
        _ => None,
    };
    Some((whole(&["sec", "secs"])?, whole(&["nanosec", "nsecs"])?))
}

fn ros_tree(cursor: &mut Cursor, fields: &[Field]) -> Option<Vec<(String, Node)>> {
    let mut members = Vec::with_capacity(fields.len());
    for field in fields {
        let count = elements(cursor, field.count)?;
        let node = match &field.kind {
            Kind::Number(number) if count > LONGEST_ARRAY => {
                cursor.pass(*number, count)?;
                Node::Skipped
            }
            kind => {
                let mut nodes = Vec::with_capacity(count.min(LONGEST_ARRAY));
                for _ in 0..count {
                    nodes.push(match kind {
                        Kind::Number(number) => Node::Number(cursor.number(*number)?),
                        Kind::Text => {
                            Node::Text(String::from_utf8_lossy(cursor.text()?).into_owned())
                        }
                        Kind::Nested(inner) => Node::Group(ros_tree(cursor, inner)?),
                    });
                }
                match field.count {
                    Count::One => nodes.pop()?,
                    _ if count > LONGEST_ARRAY => Node::Skipped,
                    _ => Node::Array(nodes),
                }
            }
        };
        members.push((field.name.clone(), node));
    }
    Some(members)
}

/// Returns the number of elements of a field. Every element takes at least one byte, so that a damaged count cannot
/// loop forever.
fn elements(cursor: &mut Cursor, count: Count) -> Option<usize> {
    let count = match count {
        Count::One => 1,
        Count::Fixed(count) => count,
        Count::Counted => cursor.count()?,
    };
    (count <= cursor.left()).then_some(count)
}

/// Values of a message without their names.
#[derive(Default)]
struct Quick {
    values: Vec<f64>,
    shape: Vec<u8>,
    stamp: (Option<i64>, Option<i64>),
}

impl Quick {
    /// Reads the fields; keeps no value if `is_quiet`. Returns `None` if the message is too short.
    fn walk(&mut self, cursor: &mut Cursor, fields: &[Field], is_quiet: bool) -> Option<()> {
        for field in fields {
            let count = elements(cursor, field.count)?;
            if field.count == Count::Counted {
                self.shape.extend_from_slice(&count.to_le_bytes());
            }
            let is_long = count > LONGEST_ARRAY;
            match &field.kind {
                Kind::Number(number) if is_long => cursor.pass(*number, count)?,
                Kind::Number(number) => {
                    for _ in 0..count {
                        let value = cursor.number(*number)?;
                        match field.part {
                            Part::Seconds => self.stamp.0 = Some(value as i64),
                            Part::Nanoseconds => self.stamp.1 = Some(value as i64),
                            _ if is_quiet => {}
                            _ => self.values.push(value),
                        }
                    }
                }
                Kind::Text => {
                    for _ in 0..count {
                        let text = cursor.text()?;
                        // The text of a single field names no channel.
                        if field.count != Count::One {
                            self.shape.extend_from_slice(text);
                            self.shape.push(0);
                        }
                    }
                }
                Kind::Nested(inner) => {
                    let is_quiet = is_quiet || is_long || field.part == Part::Header;
                    for _ in 0..count {
                        self.walk(cursor, inner, is_quiet)?;
                    }
                }
            }
        }
        Some(())
    }
}
