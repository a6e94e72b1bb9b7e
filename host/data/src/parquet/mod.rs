//! Parquet files by the crate `parquet`: flat columns of numbers and lists of equal length.
//!
//! Left out, with a remark or an error that says what to do: text, decimals, dates, half precision, nested columns, encryption,
//! and the codecs Brotli and LZO.

mod column;
mod declared;
mod footer;
mod number;
mod rows;
mod schema;
mod writer;

pub(crate) use rows::ParquetRows;
pub use writer::ParquetWriter;

/// First bytes of a file.
pub(crate) const MAGIC: &[u8] = footer::MAGIC;

#[cfg(test)]
mod hostile_test;
#[cfg(test)]
mod tests;
