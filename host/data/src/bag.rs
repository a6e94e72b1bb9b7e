//! Bags of rosbag2: a folder with `metadata.yaml` and the files of the recording.

use std::path::{Path, PathBuf};

use super::error::DataError;

/// File that describes a bag.
const METADATA: &str = "metadata.yaml";

/// Returns the files of a bag in the order of recording.
///
/// # Errors
/// [`DataError::Directory`]: the folder is no bag. [`DataError::Bag`]: its description names no file, or a missing one.
pub(super) fn bag_files(folder: &Path) -> Result<Vec<PathBuf>, DataError> {
    let described = folder.join(METADATA);
    let text = match std::fs::read_to_string(&described) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            return Err(DataError::Directory {
                path: folder.into(),
            });
        }
        Err(source) => {
            return Err(DataError::Read {
                path: described,
                source,
            });
        }
    };
    let wrong = |message: String| DataError::Bag {
        path: folder.into(),
        message,
    };
    let names = listed_files(&text);
    let is_packed = |line: &str| {
        line.trim()
            .eq_ignore_ascii_case("compression_mode: message")
    };
    if text.lines().any(is_packed) {
        return Err(wrong(
            "its messages are compressed one by one, which cannot be read; convert it with `ros2 bag convert` without compression"
                .to_owned(),
        ));
    }
    if names.is_empty() {
        return Err(wrong(format!(
            "{METADATA} lists no file under `relative_file_paths`, so the order of the files is unknown; write it anew with `ros2 bag reindex`"
        )));
    }
    let mut files = Vec::with_capacity(names.len());
    for name in names {
        // Old bags name their files with the folder in front.
        let bare = Path::new(&name).file_name().map(Path::new);
        // rosbag2 with compression_mode file names what it compressed; a file that was decompressed beside it counts.
        let plain = name.strip_suffix(".zstd").map(Path::new);
        let plain_bare = plain.and_then(Path::file_name).map(Path::new);
        let places = [plain, plain_bare, Some(Path::new(&name)), bare];
        let found = (places.into_iter().flatten())
            .map(|own| folder.join(own))
            .find(|own| own.is_file());
        match found {
            Some(found) if is_compressed(&found) => {
                return Err(wrong(format!(
                    "rosbag2 compressed its files as a whole (zstd), which cannot be read; decompress them with `zstd -d {}` and give the folder again",
                    folder.join("*.zstd").display()
                )));
            }
            Some(found) => files.push(found),
            None => {
                return Err(wrong(format!(
                    "{METADATA} lists {name}, but the folder does not hold it; copy the whole folder"
                )));
            }
        }
    }
    Ok(files)
}

/// Returns true for a file that `rosbag2` compressed as a whole.
fn is_compressed(file: &Path) -> bool {
    file.extension().is_some_and(|own| own == "zstd")
}

/// Returns the entries of the list `relative_file_paths`.
fn listed_files(text: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut is_list = false;
    for line in text.lines().map(str::trim) {
        if let Some(behind) = line.strip_prefix("relative_file_paths:") {
            is_list = true;
            // The list may stand in one line.
            let inner = behind.trim().strip_prefix('[');
            let inner = inner.and_then(|i| i.strip_suffix(']'));
            names.extend(inner.into_iter().flat_map(|i| i.split(',')).map(unquoted));
        } else if let (true, Some(entry)) = (is_list, line.strip_prefix("- ")) {
            names.push(unquoted(entry));
        } else if !line.is_empty() && !line.starts_with('#') {
            is_list = false;
        }
    }
    names.retain(|name| !name.is_empty());
    names
}

fn unquoted(entry: &str) -> String {
    entry.trim().trim_matches(['"', '\'']).to_owned()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{bag_files, listed_files};

    #[test]
    fn files_that_are_compressed_as_a_whole_are_told_with_the_command_that_helps() {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        put(
            "metadata.yaml",
            "rosbag2_bagfile_information:\n  compression_format: zstd\n  compression_mode: file\n  relative_file_paths:\n    - run_0.db3.zstd\n",
        );
        put("run_0.db3.zstd", "");
        let message = bag_files(folder.path()).unwrap_err().to_string();
        for words in [
            "compressed its files as a whole",
            "zstd -d",
            "*.zstd",
            "give the folder again",
        ] {
            assert!(message.contains(words), "{message}");
        }
        // Decompressed beside the listed file.
        put("run_0.db3", "");
        let files = bag_files(folder.path()).unwrap();
        assert_eq!(files, [folder.path().join("run_0.db3")]);
    }

    #[test]
    fn files_are_listed_in_order_whatever_the_style() {
        let block = "rosbag2_bagfile_information:\n  version: 9\n  relative_file_paths:\n    - b_0.mcap\n    - \"a 1.mcap\"\n  duration:\n    nanoseconds: 5\n  topics:\n    - topic_metadata:\n";
        assert_eq!(listed_files(block), ["b_0.mcap", "a 1.mcap"]);
        assert_eq!(
            listed_files("relative_file_paths: ['x.mcap', y.mcap]\nother:\n  - z"),
            ["x.mcap", "y.mcap"]
        );
        assert!(listed_files("relative_file_paths: []\n").is_empty());
    }
}
