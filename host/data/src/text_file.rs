//! A text file as UTF-8, whatever encoding its byte order mark or its first character shows.
//!
//! UTF-16 is decoded while it is read, so that memory does not grow with the file. Bytes that are no character become
//! U+FFFD, which no number and no column name holds. Other files are read as they are.

use std::fs::File;
use std::io::{Read, Result, Seek, SeekFrom};
use std::path::Path;

use encoding_rs::{CoderResult, Decoder, Encoding, UTF_8, UTF_16BE, UTF_16LE};

/// Bytes of the file that are decoded at once.
const CHUNK: usize = 1 << 16;
/// Maximum number of UTF-8 bytes that the decoder writes in one step; it needs room for at least one character.
const LEAST_ROOM: usize = 16;

/// A file that is read as UTF-8.
pub(super) struct TextFile {
    file: File,
    decoding: Option<Decoding>,
}

/// The decoder, and bytes that are not decoded yet.
struct Decoding {
    decoder: Decoder,
    raw: Vec<u8>,
    /// First byte that is not decoded.
    from: usize,
    is_last: bool,
    /// Decoded bytes that did not fit into the reader's buffer.
    spare: Vec<u8>,
    done: bool,
}

impl TextFile {
    /// Opens a file and detects its encoding.
    pub(super) fn open(path: &Path) -> Result<Self> {
        let mut file = File::open(path)?;
        let mut mark = [0; 3];
        let mut length = 0;
        while length < mark.len() {
            match file.read(&mut mark[length..])? {
                0 => break,
                read => length += read,
            }
        }
        file.seek(SeekFrom::Start(0))?;
        let marked = Encoding::for_bom(&mark[..length]).map(|(encoding, _)| encoding);
        // Without a mark, one byte of the first character is 0, which UTF-8 text never has.
        let wide = || match mark {
            [low, 0, _] if low != 0 && length > 1 => UTF_16LE,
            [0, low, _] if low != 0 && length > 1 => UTF_16BE,
            _ => UTF_8,
        };
        let encoding = marked.unwrap_or_else(wide);
        let decoding = (encoding != UTF_8).then(|| Decoding {
            decoder: encoding.new_decoder_with_bom_removal(),
            raw: Vec::new(),
            from: 0,
            is_last: false,
            spare: Vec::new(),
            done: false,
        });
        Ok(Self { file, decoding })
    }

    /// Returns the number of bytes that an ASCII character takes in the file.
    pub(super) fn bytes_a_character(&self) -> u64 {
        if self.decoding.is_some() { 2 } else { 1 }
    }
}

impl Read for TextFile {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        match &mut self.decoding {
            None => self.file.read(out),
            Some(decoding) => decoding.read(&mut self.file, out),
        }
    }
}

impl Decoding {
    fn read(&mut self, file: &mut File, out: &mut [u8]) -> Result<usize> {
        if out.is_empty() {
            return Ok(0);
        }
        if self.spare.is_empty() && out.len() < LEAST_ROOM {
            let mut spare = vec![0; LEAST_ROOM];
            let length = self.decoded(file, &mut spare)?;
            spare.truncate(length);
            self.spare = spare;
        }
        if !self.spare.is_empty() || out.len() < LEAST_ROOM {
            let length = self.spare.len().min(out.len());
            out[..length].copy_from_slice(&self.spare[..length]);
            self.spare.drain(..length);
            return Ok(length);
        }
        self.decoded(file, out)
    }

    /// Decodes into `out`; returns 0 at the end of the file only.
    fn decoded(&mut self, file: &mut File, out: &mut [u8]) -> Result<usize> {
        while !self.done {
            if self.from == self.raw.len() && !self.is_last {
                self.raw.resize(CHUNK, 0);
                let read = file.read(&mut self.raw)?;
                self.raw.truncate(read);
                self.from = 0;
                self.is_last = read == 0;
            }
            let input = &self.raw[self.from..];
            let (result, read, written, _) = self.decoder.decode_to_utf8(input, out, self.is_last);
            self.from += read;
            self.done = self.is_last && result == CoderResult::InputEmpty;
            if written > 0 {
                return Ok(written);
            }
        }
        Ok(0)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn wide(text: &str, big: bool) -> Vec<u8> {
        let units = std::iter::once(0xfeff).chain(text.encode_utf16());
        units
            .flat_map(|unit| {
                if big {
                    unit.to_be_bytes()
                } else {
                    unit.to_le_bytes()
                }
            })
            .collect()
    }

    fn read(bytes: &[u8], at_once: usize) -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, bytes).unwrap();
        let mut file = TextFile::open(&path).unwrap();
        let (mut all, mut buffer) = (Vec::new(), vec![0; at_once]);
        loop {
            match file.read(&mut buffer).unwrap() {
                0 => return all,
                length => all.extend_from_slice(&buffer[..length]),
            }
        }
    }

    #[test]
    fn wide_text_is_read_as_utf8_in_pieces_of_any_size() {
        let text = "t\tq1\ti1 €\u{1f916}\r\n0,5\t1\t2\r\n".repeat(3000);
        for big in [false, true] {
            let bytes = wide(&text, big);
            for at_once in [1, 3, 17, 1000, 1 << 17] {
                assert!(read(&bytes, at_once) == text.as_bytes(), "{big} {at_once}");
                let bare = read(&bytes[2..], at_once);
                assert!(bare == text.as_bytes(), "{big} {at_once} without a mark");
            }
            // A byte is missing at the end.
            let cut = read(&bytes[..bytes.len() - 1], 1000);
            assert!(cut.ends_with("\r\u{fffd}".as_bytes()), "{big}");
        }
        for plain in [
            text.as_bytes(),
            b"",
            b"t",
            b"\xef\xbb\xbft,q1\n",
            b"\xff\xff\xff\xff",
        ] {
            assert!(read(plain, 1000) == plain);
        }
    }
}
