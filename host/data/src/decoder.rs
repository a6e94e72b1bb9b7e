//! Which decoder the messages of a channel need.

use super::channel::Channel;
use super::flat_message::Decoder;
use super::ros_layout::message_fields;
use super::ros_message::{Encoding, ros_encoding};

/// Returns the decoder for the numbers in the messages of a channel.
///
/// # Errors
/// Why they cannot be decoded, one clause.
pub(super) fn decoder(channel: &Channel) -> Result<Decoder, String> {
    if channel.encoding == "json" {
        return Ok(Decoder::Json);
    }
    let Some(encoding) = ros_encoding(&channel.encoding) else {
        return Err(format!(
            "the messages are encoded as \"{}\", and json, cdr and ros1 can be read",
            channel.encoding.escape_debug()
        ));
    };
    let Some(schema) = &channel.schema else {
        return Err("the file holds no definition of the messages".to_owned());
    };
    let fields = message_fields(&schema.name, schema.ros_text(), encoding == Encoding::Ros1)?;
    Ok(Decoder::Ros(fields, encoding))
}
