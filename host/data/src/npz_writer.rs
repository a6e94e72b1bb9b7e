//! Writes NumPy archives (`.npz`), as `numpy.savez` does: a zip archive of arrays without compression.
//!
//! Formats as in the reader ("NEP 1"; ".ZIP File Format Specification" 6.3). Left out: archives of 4 GiB or more, which need
//! zip64.

use std::io::Write;
use std::path::Path;

use super::columns::Signal;
use super::error::DataError;
use rig_output::{persist, temporary};

/// Largest archive, bytes: offsets have 32 bits.
const LARGEST: usize = u32::MAX as usize;

/// Writes columns of equal length. The columns of all joints become one array (`q` with a column a joint for `q1`, `q2` …);
/// every other column is an array of its own.
///
/// # Errors
/// [`DataError::Write`]: a file that cannot be written, or that would be larger than 4 GiB.
pub fn write_npz(path: &Path, names: &[String], values: &[Vec<f64>]) -> Result<(), DataError> {
    let failed = |source| DataError::Write {
        path: path.into(),
        source,
    };
    let mut archive = Archive::default();
    for (name, columns) in arrays(names) {
        let columns: Vec<&[f64]> = columns.iter().map(|k| values[*k].as_slice()).collect();
        let is_of_joints = !names.contains(&name);
        archive.add(&name, &columns, is_of_joints).map_err(failed)?;
    }
    let bytes = archive.finish().map_err(failed)?;
    let written = temporary(path).and_then(|mut file| {
        file.write_all(&bytes)?;
        persist(file, path)
    });
    written.map_err(failed)
}

/// Returns the arrays in order: name and places of its columns. An array of several columns holds those of all joints.
fn arrays(names: &[String]) -> Vec<(String, Vec<usize>)> {
    let mut found: Vec<(String, Vec<usize>)> = Vec::new();
    for (k, name) in names.iter().enumerate() {
        if found.iter().any(|(_, columns)| columns.contains(&k)) {
            continue;
        }
        let prefix = Signal::split(name).map(|(signal, _)| signal.prefix());
        let prefix = prefix.filter(|prefix| names.iter().all(|other| other != prefix));
        let columns: Vec<usize> = prefix.map_or_else(Vec::new, |prefix| {
            let at = |joint| names.iter().position(|n| *n == format!("{prefix}{joint}"));
            (1..).map_while(at).collect()
        });
        match (prefix, columns.contains(&k)) {
            (Some(prefix), true) => found.push((prefix.to_owned(), columns)),
            _ => found.push((name.clone(), vec![k])),
        }
    }
    found
}

/// An archive that grows.
#[derive(Default)]
struct Archive {
    bytes: Vec<u8>,
    /// The directory, which follows the files.
    directory: Vec<u8>,
    count: u16,
}

impl Archive {
    /// Adds an array of doubles: rows × joints, or of one index.
    fn add(&mut self, name: &str, columns: &[&[f64]], is_of_joints: bool) -> std::io::Result<()> {
        let rows = columns.first().map_or(0, |column| column.len());
        let shape = match is_of_joints {
            true => format!("({rows}, {})", columns.len()),
            false => format!("({rows},)"),
        };
        let data = header(&shape);
        let size = data.len() + 8 * rows * columns.len();
        if self.bytes.len() + self.directory.len() + size + 1024 > LARGEST || self.count == u16::MAX
        {
            return Err(std::io::Error::other(
                "a NumPy archive of 4 GiB or more cannot be written; take fewer rows or columns, or write .csv",
            ));
        }
        let mut sum = crc32fast::Hasher::new();
        sum.update(&data);
        let body = values(columns, rows);
        sum.update(&body);
        let entry = format!("{name}.npy");
        // Version 2.0, no flags but UTF-8 names, stored, 1980-01-01: equal columns give equal bytes.
        let mut about = Vec::new();
        about.extend([20, 0, 0, 8, 0, 0, 0, 0, 0x21, 0]);
        about.extend(sum.finalize().to_le_bytes());
        about.extend((size as u32).to_le_bytes());
        about.extend((size as u32).to_le_bytes());
        about.extend((entry.len() as u16).to_le_bytes());
        about.extend([0, 0]);
        let offset = self.bytes.len() as u32;
        self.bytes.extend(b"PK\x03\x04");
        self.bytes.extend(&about);
        self.bytes.extend(entry.as_bytes());
        self.bytes.extend(data);
        self.bytes.extend(body);
        self.directory.extend(b"PK\x01\x02\x14\x00");
        self.directory.extend(&about);
        self.directory.extend([0; 10]);
        self.directory.extend(offset.to_le_bytes());
        self.directory.extend(entry.as_bytes());
        self.count += 1;
        Ok(())
    }

    /// Appends the directory and the end record.
    fn finish(mut self) -> std::io::Result<Vec<u8>> {
        let offset = self.bytes.len() as u32;
        self.bytes.extend(&self.directory);
        self.bytes.extend(b"PK\x05\x06\0\0\0\0");
        self.bytes.extend(self.count.to_le_bytes());
        self.bytes.extend(self.count.to_le_bytes());
        self.bytes
            .extend((self.directory.len() as u32).to_le_bytes());
        self.bytes.extend(offset.to_le_bytes());
        self.bytes.extend([0, 0]);
        Ok(self.bytes)
    }
}

/// Returns the header of an array of doubles, filled up to a multiple of 64 bytes.
fn header(shape: &str) -> Vec<u8> {
    let about = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (10 + about.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(about.as_bytes());
    bytes.resize(10 + length - 1, b' ');
    bytes.push(b'\n');
    bytes
}

/// Returns the numbers row by row.
fn values(columns: &[&[f64]], rows: usize) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(8 * rows * columns.len());
    for row in 0..rows {
        for column in columns {
            bytes.extend(column[row].to_le_bytes());
        }
    }
    bytes
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::npz;

    #[test]
    fn the_reader_reads_what_is_written() {
        let names = ["t", "q1", "tau1", "q2", "tau2", "fx", "ref2", "q_other"];
        let names: Vec<String> = names.map(str::to_owned).to_vec();
        let value = |k: usize, row: usize| 0.1 * row as f64 - 1.0 / (k + 1) as f64;
        let values: Vec<Vec<f64>> = (0..names.len())
            .map(|k| (0..300).map(|row| value(k, row)).collect())
            .collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.npz");
        write_npz(&path, &names, &values).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let (arrays, others) = npz::arrays(&bytes).unwrap();
        assert!(others.is_empty());
        let shapes: Vec<(&str, &[usize])> = (arrays.iter())
            .map(|own| (own.name.as_str(), own.shape.as_slice()))
            .collect();
        let want: [(&str, &[usize]); 6] = [
            ("t", &[300]),
            ("q", &[300, 2]),
            ("tau", &[300, 2]),
            ("fx", &[300]),
            ("ref2", &[300]),
            ("q_other", &[300]),
        ];
        assert_eq!(shapes, want);
        // The first index of the reader's arrays runs fastest.
        assert_eq!(arrays[1].values[300..], values[3][..]);
        // Equal columns give equal bytes.
        write_npz(&path, &names, &values).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
    }
}
