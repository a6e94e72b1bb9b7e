//! Footer of a Parquet file: its columns, and where their parts are.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

use parquet::basic::Compression;
use parquet::file::metadata::{
    ColumnChunkMetaData, ParquetMetaData, ParquetMetaDataReader, RowGroupMetaData,
};

use super::declared::is_tree;

/// First and last bytes of a file.
pub(super) const MAGIC: &[u8] = b"PAR1";

const CUT_OFF: &str = "the Parquet file is cut off: it does not end with PAR1, which its writer writes last; copy it again, or close the writer before the program ends";
pub(super) const DAMAGED: &str = "the Parquet file is damaged; copy it again, or write it anew, for instance with `pandas.DataFrame.to_parquet`";

/// Reads the footer of a file of `length` bytes.
///
/// # Errors
/// What is damaged or not supported, one clause.
pub(super) fn footer(mut file: &File, length: u64) -> Result<ParquetMetaData, String> {
    let unreadable = |error: std::io::Error| format!("the Parquet file cannot be read: {error}");
    let mut end = [0; 8];
    if length < 12 {
        return Err(CUT_OFF.into());
    }
    file.seek(SeekFrom::Start(length - 8)).map_err(unreadable)?;
    file.read_exact(&mut end).map_err(unreadable)?;
    if end.ends_with(b"PARE") {
        return Err("the Parquet file is encrypted; write it without encryption".into());
    }
    if !end.ends_with(MAGIC) {
        return Err(CUT_OFF.into());
    }
    let size = u64::from(u32::from_le_bytes([end[0], end[1], end[2], end[3]]));
    if size > length - 12 {
        return Err(DAMAGED.into());
    }
    file.seek(SeekFrom::Start(length - 8 - size))
        .map_err(unreadable)?;
    let mut bytes = vec![0; size as usize];
    file.read_exact(&mut bytes).map_err(unreadable)?;
    if !is_tree(&bytes) {
        return Err(DAMAGED.into());
    }
    let found = ParquetMetaDataReader::decode_metadata(&bytes).map_err(|_| DAMAGED)?;
    let mut chunks = found
        .row_groups()
        .iter()
        .flat_map(RowGroupMetaData::columns);
    match chunks.all(|chunk| is_inside(chunk, length)) {
        true => Ok(found),
        false => Err(DAMAGED.into()),
    }
}

fn is_inside(chunk: &ColumnChunkMetaData, length: u64) -> bool {
    let from = chunk
        .dictionary_page_offset()
        .unwrap_or_else(|| chunk.data_page_offset());
    let end = from.checked_add(chunk.compressed_size());
    from >= 0
        && chunk.data_page_offset() >= 0
        && chunk.compressed_size() >= 0
        && end.is_some_and(|end| end.cast_unsigned() <= length)
}

/// Returns why a chunk is not read, if it is not.
pub(super) fn refusal(chunk: &ColumnChunkMetaData) -> Option<String> {
    if let Some(file) = chunk.file_path() {
        return Some(format!(
            "is stored in another file ({}); write everything into one file",
            file.escape_debug()
        ));
    }
    let codec = match chunk.compression() {
        Compression::BROTLI(_) => "Brotli",
        Compression::LZO => "LZO",
        _ => return None,
    };
    Some(format!(
        "is compressed by {codec}, which is not read; write it with compression=\"snappy\", \"zstd\", \"gzip\" or None"
    ))
}
