//! Text files in the encoding that they declare.

use encoding_rs::{Encoding, UTF_8};

/// Contents of a file.
pub(super) struct Decoded {
    /// Its text; a declaration of another encoding is replaced by UTF-8.
    pub text: String,
    /// Name of the encoding if it was not UTF-8.
    pub from: Option<&'static str>,
}

/// Position of bytes that are not text.
pub(super) struct NoText {
    /// Bytes before them.
    pub offset: usize,
    /// Line, from 1.
    pub line: usize,
}

/// Decodes bytes by their byte order mark, else as UTF-8, else by an XML declaration. UTF-8 comes first because other
/// encodings rarely are valid UTF-8, and UTF-8 files are often declared wrongly.
pub(super) fn decoded(bytes: &[u8]) -> Result<Decoded, NoText> {
    let marked = Encoding::for_bom(bytes).map(|(encoding, _)| encoding);
    if marked.is_none_or(|encoding| encoding == UTF_8) {
        match of_utf_8(bytes) {
            Ok(text) => return Ok(Decoded { text, from: None }),
            Err(wrong) => {
                let label = stated(bytes).map(str::as_bytes);
                let encoding = label.and_then(Encoding::for_label);
                // UTF-16 without a byte order mark has no ASCII letters that could declare it.
                let Some(encoding) = encoding.filter(|own| *own != UTF_8) else {
                    return Err(wrong);
                };
                return of_other(encoding, bytes);
            }
        }
    }
    of_other(marked.unwrap_or(UTF_8), bytes)
}

fn of_utf_8(bytes: &[u8]) -> Result<String, NoText> {
    let at = |offset: usize| NoText {
        offset,
        line: 1 + bytes[..offset].iter().filter(|b| **b == b'\n').count(),
    };
    let text = std::str::from_utf8(bytes).map_err(|error| at(error.valid_up_to()))?;
    match text.bytes().position(unprintable) {
        Some(offset) => Err(at(offset)),
        None => Ok(text.strip_prefix('\u{feff}').unwrap_or(text).to_owned()),
    }
}

fn of_other(encoding: &'static Encoding, bytes: &[u8]) -> Result<Decoded, NoText> {
    let (text, _, wrong) = encoding.decode(bytes);
    if wrong || text.bytes().any(unprintable) {
        // The place, in the text that could be read.
        let is_none = |c: char| c == '\u{fffd}' || u8::try_from(c).is_ok_and(unprintable);
        let end = text.find(is_none).unwrap_or(text.len());
        return Err(NoText {
            offset: end,
            line: 1 + text[..end].matches('\n').count(),
        });
    }
    let mut text = text.into_owned();
    if let Some(label) = stated_in(&text).map(str::to_owned) {
        text = text.replacen(&label, "UTF-8", 1);
    }
    Ok(Decoded {
        text,
        from: Some(encoding.name()),
    })
}

fn unprintable(byte: u8) -> bool {
    byte < 0x20 && !matches!(byte, b'\t' | b'\n' | b'\r')
}

/// Returns the encoding that an XML declaration in ASCII states.
fn stated(bytes: &[u8]) -> Option<&str> {
    let end = bytes.iter().position(|b| *b == b'>')?;
    stated_in(std::str::from_utf8(&bytes[..=end]).ok()?)
}

fn stated_in(text: &str) -> Option<&str> {
    let declaration = text.trim_start().strip_prefix("<?xml")?.split_once("?>")?.0;
    let value = declaration
        .split_once("encoding")?
        .1
        .trim_start()
        .strip_prefix('=')?
        .trim_start();
    let quote = value.chars().next().filter(|c| "\"'".contains(*c))?;
    value[1..].split_once(quote).map(|(label, _)| label)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use encoding_rs::{EUC_KR, GB18030, SHIFT_JIS, WINDOWS_1252};

    use super::*;

    #[test]
    fn declared_encodings_are_read_and_declared_anew() {
        for (encoding, label, name) in [
            (WINDOWS_1252, "ISO-8859-1", "Präzision"),
            (SHIFT_JIS, "Shift_JIS", "ロボット"),
            (GB18030, "GB2312", "机器人"),
            (EUC_KR, "EUC-KR", "로봇"),
        ] {
            let text = format!("<?xml version='1.0' encoding='{label}'?>\n<robot name='{name}'/>");
            let (bytes, _, _) = encoding.encode(&text);
            let read = decoded(&bytes).ok().unwrap();
            assert_eq!(read.text, text.replace(label, "UTF-8"));
            assert!(read.from.is_some());
        }
        let text = "<?xml version='1.0' encoding='UTF-16'?>\n<robot name='ü'/>";
        let little = text.encode_utf16().flat_map(u16::to_le_bytes);
        let bytes: Vec<u8> = [0xff, 0xfe].into_iter().chain(little).collect();
        let read = decoded(&bytes).ok().unwrap();
        assert_eq!(read.text, text.replace("UTF-16", "UTF-8"));
        assert_eq!(read.from, Some("UTF-16LE"));
    }

    /// Editors save files as UTF-8 and keep the old declaration.
    #[test]
    fn utf_8_is_read_as_such_whatever_is_declared() {
        for label in ["UTF-16", "ISO-8859-1", "Shift_JIS", "US-ASCII", "none"] {
            let text = format!("<?xml version='1.0' encoding='{label}'?>\n<robot name='ü'/>");
            let read = decoded(text.as_bytes()).ok().unwrap();
            assert_eq!((read.text, read.from), (text, None));
        }
    }

    #[test]
    fn bytes_of_another_encoding_are_refused_by_line() {
        let wrong = decoded(b"<?xml version='1.0'?>\n<robot\nname='\xfc'/>")
            .err()
            .unwrap();
        assert_eq!(wrong.line, 3);
        let wrong =
            decoded(b"<?xml version='1.0' encoding='Shift_JIS'?>\n\n\n<robot name='\xff'/>");
        assert_eq!(wrong.err().unwrap().line, 4);
        assert!(decoded(b"name = 'r'\x07").is_err());
    }
}
