//! MATLAB files of version 7.3 (`save` with `-v7.3`), which are HDF5.
//!
//! Format: how MATLAB and `hdf5storage` store variables in HDF5. An array is a data set whose dimensions are in the opposite
//! order, so that its numbers lie as in memory. The attribute `MATLAB_class` tells what it is. Fields of a structure of one
//! element are read as arrays of their own. Left out, as in older files: cells, text, sparse and imaginary numbers, and
//! structures in structures, which are passed over.

use hdf5_reader::error::Error;
use hdf5_reader::group::Group;
use hdf5_reader::{Attribute, ByteOrder, Dataset, Datatype, Hdf5File, OpenOptions};

use super::array::Array;
use super::binary_number::BinaryNumber;
use super::library_panic::caught;

/// First bytes of the file. HDF5 begins at byte 512.
pub(super) const MAGIC: &[u8] = b"MATLAB 7.3 MAT-file";

/// Longest variable and longest part that is compressed at once, bytes after decompression.
const LONGEST: usize = 2 << 30;

/// Arrays, and the names of variables that hold no numbers.
type Found = (Vec<Array>, Vec<String>);

/// Reads the arrays of a file; variables that hold no numbers are named in the second list.
///
/// # Errors
/// What is damaged, one clause.
pub(super) fn arrays(file: Vec<u8>) -> Result<Found, String> {
    let read = caught(|| read(file));
    read.and_then(Result::ok)
        .ok_or_else(|| "the MATLAB file is cut off or damaged; copy it again".to_owned())
}

fn read(file: Vec<u8>) -> Result<Found, Error> {
    let options = OpenOptions::default()
        .with_max_chunk_bytes(LONGEST)
        .with_max_read_bytes(LONGEST);
    let file = Hdf5File::from_vec_with_options(file, options)?;
    let (groups, sets) = file.root_group()?.members()?;
    let mut found = Found::default();
    for set in &sets {
        variable(set, &mut found)?;
    }
    // What MATLAB keeps for itself, such as the elements of cells, is in groups like `#refs#`.
    for group in groups.iter().filter(|own| !own.name().starts_with('#')) {
        structure(group, &mut found)?;
    }
    Ok(found)
}

/// Reads the fields of a structure.
fn structure(group: &Group, found: &mut Found) -> Result<(), Error> {
    // A sparse matrix is a group with the class of its numbers.
    if class_of(&group.attributes()?) != "struct" {
        found.1.push(group.name().to_owned());
        return Ok(());
    }
    let (inner, sets) = group.members()?;
    for set in &sets {
        variable(set, found)?;
    }
    found
        .1
        .extend(inner.iter().map(|own| own.name().to_owned()));
    Ok(())
}

/// Reads a variable, or a field of a structure.
fn variable(set: &Dataset, found: &mut Found) -> Result<(), Error> {
    let attributes = set.attributes();
    // An empty array is stored as its shape.
    let is_empty = attributes.iter().any(|own| own.name == "MATLAB_empty");
    let is_text = ["char", "cell"].contains(&class_of(&attributes).as_str());
    let Some((kind, is_big_endian)) = number_type(set.dtype()).filter(|_| !is_empty && !is_text)
    else {
        found.1.push(set.name().to_owned());
        return Ok(());
    };
    let shape = set.shape().iter().rev().map(|n| *n as usize).collect();
    let bytes = set.read_raw_bytes()?;
    found.0.push(Array {
        name: set.name().to_owned(),
        shape,
        values: kind.values(&bytes, is_big_endian),
    });
    Ok(())
}

/// Returns MATLAB's name of the class; empty if it is not there.
fn class_of(attributes: &[Attribute]) -> String {
    let own = attributes.iter().find(|own| own.name == "MATLAB_class");
    own.and_then(|own| own.read_string().ok())
        .unwrap_or_default()
}

/// Returns the type of real numbers, and whether their first byte is the highest.
fn number_type(kind: &Datatype) -> Option<(BinaryNumber, bool)> {
    let (kind, order) = match kind {
        Datatype::FixedPoint {
            size: size @ (1 | 2 | 4 | 8),
            signed,
            byte_order,
        } => match signed {
            true => (BinaryNumber::Signed(*size), byte_order),
            false => (BinaryNumber::Unsigned(*size), byte_order),
        },
        Datatype::FloatingPoint {
            size: size @ (4 | 8),
            byte_order,
        } => (BinaryNumber::Float(*size), byte_order),
        _ => return None,
    };
    Some((kind, *order == ByteOrder::BigEndian))
}
