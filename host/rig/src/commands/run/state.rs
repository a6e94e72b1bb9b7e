//! What a run did, kept beside the project file, so that the next run can skip what is unchanged.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};

use super::project::Step;
use crate::commands::error::CommandError;
use rig_output::write_whole;

/// Schema of the file.
const SCHEMA: &str = "rig-run/1";

/// What the steps of a project did.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(super) struct State {
    schema: String,
    /// The steps, in the order of the project file.
    pub(super) steps: Vec<Done>,
}

/// What a step did.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub(super) struct Done {
    /// Name of the step.
    pub(super) name: String,
    /// The command line.
    pub(super) command: String,
    /// Version of the program; none for a recording, which does not depend on it.
    pub(super) version: Option<String>,
    /// Files and folders that it read, with a fingerprint of their content.
    pub(super) inputs: BTreeMap<String, String>,
    /// Files that it wrote, with a fingerprint of their content.
    pub(super) outputs: BTreeMap<String, String>,
    /// The short answer.
    pub(super) answer: Vec<String>,
    /// The exit status.
    pub(super) status: u8,
}

impl State {
    /// Reads the state of earlier runs; an empty one if there was none.
    ///
    /// # Errors
    /// A file that cannot be read or is no such state.
    pub(super) fn load(path: &Path) -> Result<Self, CommandError> {
        let text = match fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Ok(Self {
                    schema: SCHEMA.to_owned(),
                    steps: Vec::new(),
                });
            }
            Err(error) => {
                return Err(CommandError::Sentence(format!(
                    "{} cannot be read: {error}.",
                    path.display()
                )));
            }
        };
        let state: Option<Self> = serde_json::from_str(&text).ok();
        state.filter(|own| own.schema == SCHEMA).ok_or_else(|| {
            CommandError::Sentence(format!(
                "{} is not what an earlier `rig run` wrote ({SCHEMA}); remove it, and all steps are run again.",
                path.display()
            ))
        })
    }

    /// Writes the state.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(super) fn save(&self, path: &Path) -> Result<(), CommandError> {
        let json = serde_json::to_string_pretty(self).map_err(|error| {
            CommandError::Sentence(format!("The state cannot be written as JSON: {error}."))
        })?;
        Ok(write_whole(path, (json + "\n").as_bytes())?)
    }

    /// Returns what a step did.
    pub(super) fn of(&self, name: &str) -> Option<&Done> {
        self.steps.iter().find(|done| done.name == name)
    }

    /// Replaces what a step did.
    pub(super) fn put(&mut self, done: Done) {
        match self.steps.iter_mut().find(|own| own.name == done.name) {
            Some(own) => *own = done,
            None => self.steps.push(done),
        }
    }

    /// Keeps the steps of the project file alone, in its order.
    pub(super) fn arrange(&mut self, steps: &[Step]) {
        let own = |step: &Step| self.of(&step.name).cloned();
        self.steps = steps.iter().filter_map(own).collect();
    }
}

impl Done {
    /// Returns why a step is not what it was when this was done; none if it is unchanged.
    pub(super) fn change(
        &self,
        command: &str,
        version: Option<&str>,
        inputs: &BTreeMap<String, String>,
    ) -> Option<String> {
        if self.command != command {
            return Some("its options changed".to_owned());
        }
        if self.version.as_deref() != version {
            return Some("it was made by another version of rig".to_owned());
        }
        if let Some((path, _)) =
            (inputs.iter()).find(|(path, of)| self.inputs.get(*path) != Some(of))
        {
            return Some(format!("{path} changed"));
        }
        if self.inputs.len() != inputs.len() {
            return Some("it reads fewer files".to_owned());
        }
        let gone = (self.outputs.keys()).find(|path| !Path::new(path).exists());
        gone.map(|path| format!("{path} is missing"))
    }

    /// Returns true if the step wrote something to this place, which it may replace.
    pub(super) fn owns(&self, out: &str) -> bool {
        (self.outputs.keys()).any(|path| Path::new(path).starts_with(out))
    }

    /// Returns the first file that the step wrote to this place and somebody changed since.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub(super) fn edited(&self, out: &str) -> Result<Option<&str>, CommandError> {
        for (path, before) in &self.outputs {
            let path = path.as_str();
            if Path::new(path).starts_with(out)
                && Path::new(path).exists()
                && &fingerprint(Path::new(path))? != before
            {
                return Ok(Some(path));
            }
        }
        Ok(None)
    }
}

/// Returns the files and folders that the options of a step name, with fingerprints. A word such as
/// `cold=a.csv,b.csv` names two files.
///
/// # Errors
/// A file that cannot be read.
pub(super) fn inputs(step: &Step) -> Result<BTreeMap<String, String>, CommandError> {
    let mut found = BTreeMap::new();
    for option in step.options.iter().filter(|option| option.name != "out") {
        for value in &option.values {
            for text in std::iter::once(value.as_str()).chain(value.split(['=', ','])) {
                let path = Path::new(text);
                // A serial port is neither.
                if !text.is_empty() && (path.is_file() || path.is_dir()) {
                    found.insert(text.to_owned(), fingerprint(path)?);
                }
            }
        }
    }
    Ok(found)
}

/// Returns the files of an output, each with the time of its last change and its length.
pub(super) fn snapshot(out: &str) -> BTreeMap<PathBuf, (Option<SystemTime>, u64)> {
    (files(Path::new(out)).into_iter())
        .filter_map(|path| {
            let about = fs::metadata(&path).ok()?;
            Some((path, (about.modified().ok(), about.len())))
        })
        .collect()
}

/// Returns the files that are not in an earlier snapshot as they are now, with fingerprints.
///
/// # Errors
/// A file that cannot be read.
pub(super) fn written(
    out: &str,
    before: &BTreeMap<PathBuf, (Option<SystemTime>, u64)>,
) -> Result<BTreeMap<String, String>, CommandError> {
    (snapshot(out).into_iter())
        .filter(|(path, about)| before.get(path) != Some(about))
        .map(|(path, _)| Ok((path.display().to_string(), fingerprint(&path)?)))
        .collect()
}

/// Returns a file, or all files in a folder and its folders, sorted.
fn files(path: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(path) else {
        return path
            .is_file()
            .then(|| path.to_owned())
            .into_iter()
            .collect();
    };
    let mut all: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    all.sort();
    // A link to a folder may lead back here.
    all.retain(|path| !(path.is_symlink() && path.is_dir()));
    all.iter().flat_map(|path| files(path)).collect()
}

/// Returns 64 bits of the names and contents of a file, or of the files in a folder (FNV-1a; Fowler, Noll & Vo 1991).
/// They tell a change, not a forgery.
///
/// # Errors
/// A file that cannot be read.
pub(super) fn fingerprint(path: &Path) -> Result<String, CommandError> {
    use std::io::Read;
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut take = |bytes: &[u8]| {
        for byte in bytes {
            hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    let is_folder = path.is_dir();
    let mut buffer = vec![0; 1 << 16];
    for file in files(path) {
        let unreadable = |error: std::io::Error| {
            CommandError::Sentence(format!("{} cannot be read: {error}.", file.display()))
        };
        if is_folder {
            take(file.to_string_lossy().as_bytes());
            take(&[0]);
        }
        let mut reader = fs::File::open(&file).map_err(unreadable)?;
        let mut length = 0;
        loop {
            match reader.read(&mut buffer).map_err(unreadable)? {
                0 => break,
                n => {
                    take(&buffer[..n]);
                    length += n as u64;
                }
            }
        }
        take(&length.to_le_bytes());
    }
    Ok(format!("{hash:016x}"))
}
