//! Layout of a ROS message, from the definition stored by the recorder.

use super::binary_number::BinaryNumber;
use std::collections::BTreeMap;

/// Maximum nesting of definitions: deeper ones do not belong to a message.
const DEEPEST: usize = 16;

/// Standard messages and their parts, for recorders that do not store their definitions.
const KNOWN: [(&str, &str); 6] = [
    (
        "sensor_msgs/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort",
    ),
    (
        "std_msgs/Header",
        "builtin_interfaces/Time stamp\nstring frame_id",
    ),
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec"),
    (
        "geometry_msgs/WrenchStamped",
        "std_msgs/Header header\nWrench wrench",
    ),
    ("geometry_msgs/Wrench", "Vector3 force\nVector3 torque"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z"),
];

/// `std_msgs/Header` of ROS 1.
const ROS1_HEADER: &str = "uint32 seq\ntime stamp\nstring frame_id";

/// Type of a field.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Kind {
    Number(BinaryNumber),
    Text,
    Nested(Vec<Field>),
}

/// Number of elements of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Count {
    One,
    Fixed(usize),
    /// The message contains the number.
    Counted,
}

/// Meaning of a field in a joint state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    None,
    /// The header of the message.
    Header,
    Seconds,
    Nanoseconds,
    Name,
    Position,
    Velocity,
    Effort,
}

/// One field of a message.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    pub name: String,
    pub kind: Kind,
    pub count: Count,
    pub part: Part,
}

/// Returns the fields of a joint state from its definition: a ROS `.msg` text followed by the definitions it uses.
///
/// # Errors
/// The part that cannot be read, one clause.
pub(super) fn joint_state(definition: &str, is_ros1: bool) -> Result<Vec<Field>, String> {
    let fields = message_fields("sensor_msgs/JointState", definition, is_ros1)?;
    for (part, name) in [(Part::Name, "name"), (Part::Position, "position")] {
        if !fields.iter().any(|f| f.part == part) {
            return Err(format!(
                "the definition of its messages has no field `{name}`"
            ));
        }
    }
    Ok(fields)
}

/// Returns the fields of a message of type `root` (`geometry_msgs/msg/Wrench`, or without `msg`) from its definition.
/// An empty definition is enough for the standard messages that are known here.
///
/// # Errors
/// The part that cannot be read, one clause.
pub(super) fn message_fields(
    root: &str,
    definition: &str,
    is_ros1: bool,
) -> Result<Vec<Field>, String> {
    let root = root.replace("/msg/", "/");
    let mut definitions: BTreeMap<String, String> = KNOWN
        .iter()
        .map(|(name, text)| ((*name).to_owned(), (*text).to_owned()))
        .collect();
    if is_ros1 {
        definitions.insert("std_msgs/Header".into(), ROS1_HEADER.into());
    }
    let mut name = root.clone();
    let mut text = String::new();
    for line in definition.lines() {
        if line.starts_with("=====") {
            store(&mut definitions, &name, &mut text);
        } else if let Some(other) = line.strip_prefix("MSG:") {
            name = other.trim().replace("/msg/", "/");
        } else {
            text.push_str(line);
            text.push('\n');
        }
    }
    store(&mut definitions, &name, &mut text);
    fields(&definitions, &root, "", 0)
}

/// Stores a definition that is not empty.
fn store(definitions: &mut BTreeMap<String, String>, name: &str, text: &mut String) {
    if !text.trim().is_empty() {
        definitions.insert(name.to_owned(), std::mem::take(text));
    }
    text.clear();
}

fn fields(
    definitions: &BTreeMap<String, String>,
    name: &str,
    path: &str,
    depth: usize,
) -> Result<Vec<Field>, String> {
    if depth > DEEPEST {
        return Err(format!("the definition of `{name}` contains itself"));
    }
    let Some(text) = definitions.get(name) else {
        return Err(format!(
            "the file does not define `{name}`, which its messages contain"
        ));
    };
    let mut fields = Vec::new();
    for line in text.lines() {
        let Some((ty, field)) = declaration(line) else {
            continue;
        };
        let (base, count) = array(ty).ok_or_else(|| format!("`{ty}` is no type of a field"))?;
        let path = format!("{path}.{field}");
        let kind = match primitive(base) {
            Some(kind) => kind,
            None if base == "wstring" => {
                return Err("its messages contain a `wstring`, which cannot be read".into());
            }
            None => {
                let inner = qualified(definitions, base, name);
                Kind::Nested(self::fields(definitions, &inner, &path, depth + 1)?)
            }
        };
        let kind = if base == "time" && path == ".header.stamp" {
            seconds(Part::Seconds, Part::Nanoseconds)
        } else {
            kind
        };
        let part = part(&path, &kind, count);
        fields.push(Field {
            name: field.to_owned(),
            kind,
            count,
            part,
        });
    }
    Ok(fields)
}

/// Returns type and name declared by a line; `None` for a comment, a constant or an empty line.
fn declaration(line: &str) -> Option<(&str, &str)> {
    let line = line.split('#').next()?.trim();
    let (ty, rest) = line.split_once(char::is_whitespace)?;
    let rest = rest.trim_start();
    let end = rest.find(|c: char| c.is_whitespace() || c == '=');
    let (name, behind) = rest.split_at(end.unwrap_or(rest.len()));
    (!behind.trim_start().starts_with('=')).then_some((ty, name))
}

/// Splits `float64[<=3]` into `float64` and the number of elements.
fn array(ty: &str) -> Option<(&str, Count)> {
    let (base, count) = match ty.split_once('[') {
        None => (ty, Count::One),
        Some((base, rest)) => match rest.strip_suffix(']')? {
            "" => (base, Count::Counted),
            bound if bound.starts_with("<=") => (base, Count::Counted),
            count => (base, Count::Fixed(count.parse().ok()?)),
        },
    };
    // A text of bounded length is stored like any other.
    Some((base.split("<=").next()?, count))
}

fn primitive(base: &str) -> Option<Kind> {
    let number = match base {
        "bool" | "byte" | "char" | "uint8" => BinaryNumber::Unsigned(1),
        "int8" => BinaryNumber::Signed(1),
        "uint16" => BinaryNumber::Unsigned(2),
        "int16" => BinaryNumber::Signed(2),
        "uint32" => BinaryNumber::Unsigned(4),
        "int32" => BinaryNumber::Signed(4),
        "uint64" => BinaryNumber::Unsigned(8),
        "int64" => BinaryNumber::Signed(8),
        "float32" => BinaryNumber::Float(4),
        "float64" => BinaryNumber::Float(8),
        "string" => return Some(Kind::Text),
        // Of ROS 1.
        "time" | "duration" => return Some(seconds(Part::None, Part::None)),
        _ => return None,
    };
    Some(Kind::Number(number))
}

/// A ROS 1 time: two whole numbers with these meanings.
fn seconds(whole: Part, nanoseconds: Part) -> Kind {
    let field = |name: &str, part| Field {
        name: name.to_owned(),
        kind: Kind::Number(BinaryNumber::Unsigned(4)),
        count: Count::One,
        part,
    };
    Kind::Nested(vec![field("sec", whole), field("nanosec", nanoseconds)])
}

/// Returns the name under which a nested type, used inside `within`, is defined.
fn qualified(definitions: &BTreeMap<String, String>, base: &str, within: &str) -> String {
    let base = base.replace("/msg/", "/");
    if base.contains('/') {
        return base;
    }
    let package = within.split('/').next().unwrap_or_default();
    let own = format!("{package}/{base}");
    if base == "Header" && !definitions.contains_key(&own) {
        "std_msgs/Header".into()
    } else {
        own
    }
}

fn part(path: &str, kind: &Kind, count: Count) -> Part {
    let numbers = matches!(kind, Kind::Number(BinaryNumber::Float(_))) && count != Count::One;
    match (path, kind) {
        (".header", Kind::Nested(_)) if count == Count::One => Part::Header,
        (".header.stamp.sec" | ".header.stamp.secs", Kind::Number(_)) => Part::Seconds,
        (".header.stamp.nanosec" | ".header.stamp.nsecs", Kind::Number(_)) => Part::Nanoseconds,
        (".name", Kind::Text) if count != Count::One => Part::Name,
        (".position", _) if numbers => Part::Position,
        (".velocity", _) if numbers => Part::Velocity,
        (".effort", _) if numbers => Part::Effort,
        _ => Part::None,
    }
}
