//! Parquet files whose footers and page headers lie.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use super::tests::all;

const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

/// Writer of Thrift structures by the compact protocol (Apache Thrift, "Thrift Compact protocol encoding").
#[derive(Default)]
struct Writer {
    bytes: Vec<u8>,
    /// Number of the last field in each structure that is open.
    fields: Vec<i16>,
}

impl Writer {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.bytes.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.bytes.push(value as u8);
    }

    /// Begins a structure: the outermost one, or an element of a list.
    fn begin(&mut self) {
        self.fields.push(0);
    }

    /// Ends a structure.
    fn end(&mut self) {
        self.fields.pop();
        self.bytes.push(0);
    }

    /// Writes the head of a field; its number is 1 to 15 above that of the last one.
    fn field(&mut self, number: i16, kind: u8) {
        let last = self
            .fields
            .last_mut()
            .map(|own| std::mem::replace(own, number));
        let step = (number - last.unwrap_or(0)) as u8;
        self.bytes.push(step << 4 | kind);
    }

    /// Writes a whole number of type `kind`.
    fn number(&mut self, field: i16, kind: u8, value: i64) {
        self.field(field, kind);
        self.varint((value << 1 ^ value >> 63).cast_unsigned());
    }

    /// Writes text.
    fn text(&mut self, field: i16, text: &str) {
        self.field(field, BINARY);
        self.plain_text(text);
    }

    fn plain_text(&mut self, text: &str) {
        self.varint(text.len() as u64);
        self.bytes.extend(text.as_bytes());
    }

    /// Begins a structure in a field.
    fn structure(&mut self, field: i16) {
        self.field(field, STRUCT);
        self.begin();
    }

    /// Writes the head of a list of `count` elements.
    fn list(&mut self, field: i16, of: u8, count: usize) {
        self.field(field, LIST);
        if count < 15 {
            self.bytes.push((count as u8) << 4 | of);
        } else {
            self.bytes.push(0xf0 | of);
            self.varint(count as u64);
        }
    }

    /// Writes a list of one number.
    fn one_number(&mut self, field: i16, value: i64) {
        self.list(field, I32, 1);
        self.varint((value << 1).cast_unsigned());
    }

    /// Writes a list of one text.
    fn one_text(&mut self, field: i16, text: &str) {
        self.list(field, BINARY, 1);
        self.plain_text(text);
    }
}

/// A file whose footer is `footer`.
fn with_footer(path: &Path, body: &[u8], footer: &[u8]) {
    let length = (footer.len() as u32).to_le_bytes();
    std::fs::write(path, [b"PAR1", body, footer, &length, b"PAR1"].concat()).unwrap();
}

/// An element of a schema: a group of `children`, or a required column of doubles.
fn element(w: &mut Writer, name: &str, children: i64) {
    w.begin();
    if children == 0 {
        w.number(1, I32, 5);
    }
    w.number(3, I32, 0);
    w.text(4, name);
    if children > 0 {
        w.number(5, I32, children);
    }
    w.end();
}

/// A file of one column `t` with this page, `rows` rows by its footer.
fn one_page(codec: i64, page: &[u8], rows: i64) -> Vec<u8> {
    let mut w = Writer::default();
    w.begin();
    w.number(1, I32, 1);
    w.list(2, STRUCT, 2);
    element(&mut w, "root", 1);
    element(&mut w, "t", 0);
    w.number(3, I64, rows);
    w.list(4, STRUCT, 1);
    w.begin();
    w.list(1, STRUCT, 1);
    w.begin();
    w.number(2, I64, 4);
    w.structure(3);
    w.number(1, I32, 5);
    w.one_number(2, 0);
    w.one_text(3, "t");
    w.number(4, I32, codec);
    w.number(5, I64, rows);
    w.number(6, I64, page.len() as i64);
    w.number(7, I64, page.len() as i64);
    w.number(9, I64, 4);
    w.end();
    w.end();
    w.number(2, I64, page.len() as i64);
    w.number(3, I64, rows);
    w.end();
    w.end();
    w.bytes
}

/// The header of a page of version 1 with `count` values in `encoding`, and its bytes.
fn page(size: i64, packed: i64, count: i64, encoding: i64, bytes: &[u8]) -> Vec<u8> {
    let mut w = Writer::default();
    w.begin();
    w.number(1, I32, 0);
    w.number(2, I32, size);
    w.number(3, I32, packed);
    w.structure(5);
    w.number(1, I32, count);
    w.number(2, I32, encoding);
    w.number(3, I32, 3);
    w.number(4, I32, 3);
    w.end();
    w.end();
    [w.bytes, bytes.to_vec()].concat()
}

/// Sizes that no memory holds, and a depth that no stack holds.
#[test]
fn declared_sizes_are_not_believed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.parquet");
    let refused = || all(&path).unwrap_err().to_string();
    for (children, last) in [(1, 0), (1, 1), (i64::from(i32::MAX), 1)] {
        let mut w = Writer::default();
        w.begin();
        w.number(1, I32, 1);
        w.list(2, STRUCT, 400_000);
        for k in 1..=400_000 {
            element(&mut w, "", if k == 400_000 { last } else { children });
        }
        w.number(3, I64, 0);
        w.list(4, STRUCT, 0);
        w.end();
        with_footer(&path, b"", &w.bytes);
        assert!(refused().contains("damaged"));
    }
    // Values of other fields, nested 400 000 deep, and lists longer than the footer.
    for deep in [
        vec![0x1c; 400_000],
        vec![0x19, 0xfc, 0xff, 0xff, 0xff, 0xff, 0x7f],
    ] {
        with_footer(&path, b"", &deep);
        assert!(refused().contains("damaged"));
    }
    let eight = 1.5_f64.to_le_bytes();
    for (codec, own, rows) in [
        // The page is longer than the chunk, larger than any page, and of fewer values than it says.
        (0, page(8, 1 << 40, 1, 0, &eight), 1),
        (6, page(i64::from(i32::MAX), 8, 1, 0, &eight), 1),
        (0, page(8, 8, 9, 0, &eight), 9),
        // Snappy, gzip, zstd and lz4 that are none, of 200 MB; a dictionary that is missing; an encoding of text.
        (
            1,
            page(200 << 20, 8, 1, 0, &[0x80, 0x80, 0x80, 0x64, 0, 1, 2, 3]),
            1,
        ),
        (2, page(200 << 20, 8, 1, 0, &eight), 1),
        (6, page(200 << 20, 8, 1, 0, &eight), 1),
        (7, page(200 << 20, 8, 1, 0, &eight), 1),
        (0, page(8, 8, 1, 8, &[1, 2, 0, 0, 0, 0, 0, 0]), 1),
        (0, page(8, 8, 1, 6, &eight), 1),
        // More rows than there are.
        (0, page(8, 8, 1, 0, &eight), i64::MAX),
    ] {
        with_footer(&path, &own, &one_page(codec, &own, rows));
        let error = refused();
        assert!(error.contains("damaged"), "{error}");
    }
    let own = page(8, 8, 1, 0, &eight);
    with_footer(&path, &own, &one_page(4, &own, 1));
    assert!(refused().contains("Brotli") && refused().contains("column `t`"));
    with_footer(&path, &own, &one_page(0, &own, 1));
    assert_eq!(all(&path).unwrap().1, [[1.5]]);
}
