//! Bags in SQLite files: recorders that still write or were not closed, and damaged files.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use rusqlite::Connection;

use super::bag_table::BagTable;
use super::error::DataError;

/// Makes a bag as rosbag2 does, in the given mode of its journal. Its recorder stays open.
fn recorder(path: &Path, journal: &str) -> Connection {
    let recorder = Connection::open(path).unwrap();
    let tables = "PRAGMA page_size = 512;
        CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
        CREATE INDEX timestamp_idx ON messages (timestamp ASC);
        INSERT INTO topics VALUES (1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr');";
    recorder.execute_batch(tables).unwrap();
    let mode = format!("PRAGMA journal_mode = {journal}; PRAGMA wal_autocheckpoint = 0;");
    recorder.execute_batch(&mode).unwrap();
    recorder
}

/// Stores messages. Each is filled with its number; some are longer than a page.
fn store(recorder: &Connection, numbers: std::ops::Range<i64>) {
    let text = "INSERT INTO messages (topic_id, timestamp, data) VALUES (1, ?1, ?2)";
    recorder.execute_batch("BEGIN").unwrap();
    for number in numbers {
        let data = vec![number as u8; 100 + 1000 * (number % 7) as usize];
        recorder.execute(text, (number, data)).unwrap();
    }
    recorder.execute_batch("COMMIT").unwrap();
}

/// Reads a bag; returns the times of its messages.
fn times(path: &Path) -> Result<Vec<u64>, DataError> {
    let mut table = BagTable::open(path)?;
    let mut times = Vec::new();
    while let Some(message) = table.next_message()? {
        times.push(message.time);
        let is_own = message.data.iter().all(|byte| *byte == message.time as u8);
        assert!(is_own, "message {} has data of another", message.time);
    }
    Ok(times)
}

/// Returns the names and bytes of the files of a folder.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let paths = fs::read_dir(folder).unwrap().map(|own| own.unwrap().path());
    paths.map(|p| (p.clone(), fs::read(p).unwrap())).collect()
}

/// Copies the files of a bag whose names end so.
fn copy(from: &Path, to: &Path, ends: &[&str]) {
    for end in ends {
        let own = format!("bag.db3{end}");
        fs::copy(from.join(&own), to.join(&own)).unwrap();
    }
}

/// The bag of a recorder that lost power is read with its log, and nothing is changed beside it.
#[test]
fn messages_in_the_log_of_a_recorder_that_was_not_closed_are_read() {
    let [open, left, alone] = [0; 3].map(|_| tempfile::tempdir().unwrap());
    let recorder = recorder(&open.path().join("bag.db3"), "WAL");
    store(&recorder, 0..100);
    (recorder.execute_batch("PRAGMA wal_checkpoint(TRUNCATE)")).unwrap();
    store(&recorder, 100..300);
    copy(open.path(), left.path(), &["", "-wal", "-shm"]);
    copy(open.path(), alone.path(), &["", "-wal"]);
    let before = [files(left.path()), files(alone.path())];

    let read = times(&left.path().join("bag.db3")).unwrap();
    assert_eq!(read, (0..300).collect::<Vec<_>>());
    // Without its index, SQLite would have to write beside the file.
    let error = times(&alone.path().join("bag.db3")).unwrap_err();
    for word in ["bag.db3-wal", "was not closed", "wal_checkpoint(TRUNCATE)"] {
        assert!(error.to_string().contains(word), "{error}");
    }
    assert_eq!(before, [files(left.path()), files(alone.path())]);
}

/// What a recorder stores after the bag was opened is not read, so that two passes over the open bag agree.
#[test]
fn a_bag_is_read_as_it_was_when_it_was_opened() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.db3");
    let recorder = recorder(&path, "WAL");
    store(&recorder, 0..2000);
    let mut table = BagTable::open(&path).unwrap();
    assert_eq!(table.next_message().unwrap().unwrap().time, 0);
    store(&recorder, 2000..2100);
    let mut count = 1;
    while table.next_message().unwrap().is_some() {
        count += 1;
    }
    assert_eq!(count, 2000);
    assert_eq!(times(&path).unwrap().len(), 2100);
}

/// Whatever the journal was and whatever the folder is called, nothing appears beside a closed bag.
#[test]
fn nothing_is_written_beside_a_closed_bag() {
    for journal in ["WAL", "DELETE", "PERSIST", "OFF"] {
        let folder = tempfile::tempdir().unwrap();
        let own = folder.path().join("50%25 of a?mode=rwc&b #1 ż");
        fs::create_dir(&own).unwrap();
        let path = own.join("bag.db3");
        let recorder = recorder(&path, journal);
        store(&recorder, 0..500);
        recorder.close().unwrap();
        let before = files(&own);
        assert_eq!(times(&path).unwrap().len(), 500, "{journal}");
        assert_eq!(before, files(&own), "{journal}");
    }
}

/// A transaction that was not finished is not read as if it were whole.
#[test]
fn a_transaction_that_broke_off_is_told() {
    let [open, left] = [0; 2].map(|_| tempfile::tempdir().unwrap());
    let recorder = recorder(&open.path().join("bag.db3"), "DELETE");
    store(&recorder, 0..100);
    // So small a cache is written to the file before the end of the transaction.
    recorder
        .execute_batch("PRAGMA cache_size = 2; BEGIN; UPDATE messages SET topic_id = 2;")
        .unwrap();
    copy(open.path(), left.path(), &["", "-journal"]);
    let before = files(left.path());
    let error = times(&left.path().join("bag.db3")).unwrap_err().to_string();
    assert!(error.contains("without writing"), "{error}");
    assert_eq!(before, files(left.path()));
}

/// A recorder that holds the file is named, rather than damage.
#[test]
fn a_bag_that_is_being_written_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.db3");
    let recorder = recorder(&path, "MEMORY");
    store(&recorder, 0..10);
    recorder.execute_batch("BEGIN EXCLUSIVE").unwrap();
    let error = times(&path).unwrap_err().to_string();
    assert!(error.contains("another program writes it"), "{error}");
    recorder.execute_batch("COMMIT").unwrap();
    assert_eq!(times(&path).unwrap().len(), 10);
}

/// A cut file is refused. Noise in any page gives a sentence or other messages, but neither a panic nor an endless pass.
#[test]
fn damaged_bags_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.db3");
    let recorder = recorder(&path, "DELETE");
    store(&recorder, 0..60);
    recorder.close().unwrap();
    let whole = fs::read(&path).unwrap();
    let told = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        let mut table = BagTable::open(&path).map_err(|e| e.to_string())?;
        let mut count = 0;
        while table.next_message().map_err(|e| e.to_string())?.is_some() {
            count += 1;
        }
        assert!(count <= 60 * 512, "{count} messages");
        Ok::<_, String>(count)
    };
    assert_eq!(told(&whole), Ok(60));
    for length in [17, 100, 511, 512, whole.len() / 2, whole.len() - 512] {
        let error = told(&whole[..length]).unwrap_err();
        let is_named = error.contains("is damaged") || error.contains("is an SQLite database");
        assert!(is_named && error.contains("bag.db3"), "{length}: {error}");
    }
    let mut errors = 0;
    for page in 0..whole.len() / 512 {
        let mut bytes = whole.clone();
        for (k, byte) in bytes[512 * page..][..512].iter_mut().enumerate().skip(16) {
            *byte = (page * 31 + k * k * 7) as u8;
        }
        errors += usize::from(told(&bytes).is_err());
    }
    assert!(errors > 10, "{errors}");
}
