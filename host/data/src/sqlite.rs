//! An SQLite file that is only read: nothing is written to it or beside it.

use std::fs::File;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension};

use super::error::DataError;
use super::foreign::ForeignFormat;

/// First bytes of every SQLite file.
pub(super) const MAGIC: &[u8; 16] = b"SQLite format 3\0";

/// Longest row, bytes: a damaged length must not request all memory.
const LONGEST_ROW: i32 = 256 << 20;

/// An open file.
pub(super) struct Database {
    path: PathBuf,
    connection: Connection,
}

impl Database {
    /// Opens a file that begins with [`MAGIC`], as it stands at this time: what is written later is not seen.
    ///
    /// # Errors
    /// [`DataError::Read`], [`DataError::Foreign`] for a header that is not SQLite's, and [`DataError::Bag`].
    pub(super) fn open(path: &Path) -> Result<Self, DataError> {
        let read = |source| DataError::Read {
            path: path.into(),
            source,
        };
        let mut head = Vec::new();
        let file = File::open(path).map_err(read)?;
        file.take(20).read_to_end(&mut head).map_err(read)?;
        // "Database File Format", section 1.3: 2 here is the mode with a write-ahead log. SQLite would make that log if there
        // is none, unless it is told that nobody writes.
        let has_log_mode = head.get(18..20).is_some_and(|own| own.contains(&2));
        let is_final = has_log_mode && waiting_log(path).is_none();
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY
            | OpenFlags::SQLITE_OPEN_URI
            | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let told = |error| told(path, &error);
        let connection = Connection::open_with_flags(address(path, is_final), flags);
        let connection = connection.map_err(told)?;
        // The measures of "Defense Against The Dark Arts" (sqlite.org/security.html) that concern a file of somebody else.
        (connection.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false))
            .map_err(told)?;
        (connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, LONGEST_ROW)).map_err(told)?;
        // One transaction over all reading: another program's rows do not come in between.
        (connection.execute_batch("PRAGMA cell_size_check = ON; BEGIN")).map_err(told)?;
        Ok(Self {
            path: path.into(),
            connection,
        })
    }

    /// Returns the names of the columns of a table; `None` without this table.
    pub(super) fn columns(&self, table: &str) -> Result<Option<Vec<String>>, DataError> {
        let told = |error| told(&self.path, &error);
        let sought = "SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ?1";
        let found = self.connection.query_row(sought, [table], |_| Ok(()));
        if found.optional().map_err(told)?.is_none() {
            return Ok(None);
        }
        let all = self.connection.prepare(&format!("SELECT * FROM {table}"));
        let all = all.map_err(told)?;
        Ok(Some(all.column_names().map(str::to_owned).collect()))
    }

    /// Calls `each` with the identifier and three columns of every row behind the identifier `last`, in the order of
    /// identifiers, until it says to break.
    pub(super) fn rows_behind(
        &self,
        last: i64,
        table: &str,
        columns: [&str; 3],
        mut each: impl FnMut(i64, [ValueRef<'_>; 3]) -> ControlFlow<()>,
    ) -> Result<(), DataError> {
        let told = |error| told(&self.path, &error);
        let columns = columns.join(", ");
        let text = format!("SELECT rowid, {columns} FROM {table} WHERE rowid > ?1 ORDER BY rowid");
        let mut query = self.connection.prepare(&text).map_err(told)?;
        let mut rows = query.query([last]).map_err(told)?;
        let mut last = last;
        while let Some(row) = rows.next().map_err(told)? {
            let id = row.get(0).map_err(told)?;
            if id <= last {
                return Err(damaged(&self.path, "rows are not in order"));
            }
            last = id;
            let value = |k| row.get_ref(k).map_err(told);
            if each(id, [value(1)?, value(2)?, value(3)?]).is_break() {
                break;
            }
        }
        Ok(())
    }
}

/// Returns the write-ahead log beside a file if it holds anything.
fn waiting_log(path: &Path) -> Option<PathBuf> {
    let mut log = path.as_os_str().to_owned();
    log.push("-wal");
    let is_filled = std::fs::metadata(&log).is_ok_and(|log| log.len() > 0);
    is_filled.then(|| log.into())
}

/// Returns the URI of a file to be read only: "Uniform Resource Identifiers", sqlite.org/uri.html. Without `readonly_shm`,
/// SQLite would make an index of the log beside the file.
fn address(path: &Path, is_final: bool) -> String {
    let mut address = String::from("file:");
    let bytes = path.as_os_str().as_encoded_bytes();
    if bytes.starts_with(b"/") {
        address.push_str("//");
    } else if cfg!(windows) && path.is_absolute() {
        address.push_str("///");
    }
    for byte in bytes {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'-' | b'_' => {
                address.push(char::from(*byte));
            }
            b'\\' if cfg!(windows) => address.push('/'),
            b':' if cfg!(windows) => address.push(':'),
            _ => address.push_str(&format!("%{byte:02X}")),
        }
    }
    address.push_str("?mode=ro&readonly_shm=1");
    if is_final {
        address.push_str("&immutable=1");
    }
    address
}

/// Turns what SQLite says into a sentence.
fn told(path: &Path, error: &rusqlite::Error) -> DataError {
    let message = match error.sqlite_error_code() {
        Some(ErrorCode::NotADatabase) => {
            return DataError::Foreign {
                path: path.into(),
                format: ForeignFormat::Sqlite,
            };
        }
        Some(ErrorCode::DatabaseCorrupt | ErrorCode::TooBig) => {
            return damaged(path, &error.to_string());
        }
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
            "another program writes it; stop the recorder first".to_owned()
        }
        Some(ErrorCode::CannotOpen | ErrorCode::ReadOnly) => match waiting_log(path) {
            Some(log) => format!(
                "its last messages are in {}, because the recorder was not closed; close it with `sqlite3 {} 'PRAGMA wal_checkpoint(TRUNCATE);'`",
                log.display(),
                path.display()
            ),
            None => format!(
                "SQLite cannot read it without writing ({error}); open it once with the recorder, or with `sqlite3 {} .tables`",
                path.display()
            ),
        },
        _ => format!(
            "SQLite cannot read it ({error}); copy it again, or let `ros2 bag convert` write it anew with storage_id mcap"
        ),
    };
    DataError::Bag {
        path: path.into(),
        message,
    }
}

fn damaged(path: &Path, what: &str) -> DataError {
    DataError::Bag {
        path: path.into(),
        message: format!(
            "the SQLite file is damaged ({what}); copy it from the recorder again, or let `sqlite3 in.db3 .recover | sqlite3 out.db3` keep what is whole"
        ),
    }
}
