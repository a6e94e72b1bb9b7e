//! Streams of messages in a recording.

/// Definition of the messages of a channel.
#[derive(Clone, Debug)]
pub(super) struct Schema {
    /// Type of the messages.
    pub name: String,
    /// Language of the definition.
    pub encoding: String,
    /// The definition.
    pub text: String,
}

impl Schema {
    /// Returns the definition if it is the text of a ROS message, otherwise an empty one. Other languages describe the
    /// same standard messages.
    pub(super) fn ros_text(&self) -> &str {
        match self.encoding.as_str() {
            "ros2msg" | "ros1msg" => &self.text,
            _ => "",
        }
    }
}

impl Channel {
    /// Returns the type of messages in ROS that are read by a standard definition, because the recording has none.
    pub(super) fn undefined(&self) -> Option<&str> {
        let schema = self.schema.as_ref()?;
        let is_ros = matches!(self.encoding.as_str(), "cdr" | "ros1");
        (is_ros && schema.text.is_empty()).then_some(schema.name.as_str())
    }
}

/// A stream of messages of one type.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    pub topic: String,
    /// Encoding of the messages.
    pub encoding: String,
    pub schema: Option<Schema>,
}
