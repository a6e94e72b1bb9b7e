//! The list of functions, as `firmware/build.rs` reads it too.

use std::fmt;

/// Where a listed function is meant to run from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Speed {
    /// From the CCM SRAM.
    Fast,
    /// From flash.
    Slow,
}

/// A line of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Line of the file, from 1.
    pub line: usize,
    /// Where it is meant to run from.
    pub speed: Speed,
    /// Path of a Rust function, or a symbol.
    pub path: String,
    /// A library's function, which a compiler may inline everywhere: the image need not have it.
    pub if_called: bool,
}

/// A line that is no entry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ListError {
    /// Line of the file, from 1.
    pub line: usize,
    /// What stands there.
    pub text: String,
}

impl fmt::Display for ListError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "firmware/fast_code.list:{}: \"{}\" is neither `fast PATH` nor `slow PATH`, with or without `if-called` behind it, which is for functions that are not of this project.",
            self.line, self.text
        )
    }
}

impl std::error::Error for ListError {}

/// Reads a list.
///
/// # Errors
/// The first line that is neither empty, nor a comment, nor an entry.
pub fn entries(list: &str) -> Result<Vec<Entry>, ListError> {
    let mut entries = Vec::new();
    for (text, line) in list.lines().zip(1..) {
        let code = text.split('#').next().unwrap_or_default();
        let words: Vec<&str> = code.split_whitespace().collect();
        let error = || ListError {
            line,
            text: text.to_owned(),
        };
        let (speed, path, marks) = match words[..] {
            [] => continue,
            ["fast", path, ref marks @ ..] => (Speed::Fast, path, marks),
            ["slow", path, ref marks @ ..] => (Speed::Slow, path, marks),
            _ => return Err(error()),
        };
        let if_called = match marks {
            [] => false,
            // Functions of this project are kept from being inlined instead.
            ["if-called"] if !path.starts_with("rig_") => true,
            _ => return Err(error()),
        };
        entries.push(Entry {
            line,
            speed,
            path: path.to_owned(),
            if_called,
        });
    }
    Ok(entries)
}

impl Entry {
    /// Returns true if the entry stands for the function with this symbol: the same rule as the linker pattern that
    /// `firmware/build.rs` makes of it.
    pub fn fits(&self, symbol: &str) -> bool {
        if !self.path.contains("::") {
            return symbol == self.path;
        }
        let Some(mut rest) = symbol.strip_prefix("_R").or(symbol.strip_prefix("_ZN")) else {
            return false;
        };
        self.path.split("::").all(|part| {
            let spelled = format!("{}{part}", part.len());
            match rest.find(&spelled) {
                Some(at) => {
                    rest = &rest[at + spelled.len()..];
                    true
                }
                None => false,
            }
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn entry(path: &str) -> Entry {
        entries(&format!("fast {path}")).unwrap().remove(0)
    }

    /// Symbols as rustc 1.95 gave them.
    #[test]
    fn a_path_stands_for_its_function_and_for_no_other() {
        let drop_fast = "_RNvMs0_NtNtCsfwSsCoKAxMF_10rig_shared12compensation4waveINtB5_5WavesfE9drop_fastCs17FlJqSrwyb_12rig_firmware";
        let calibrate = "_RNvNtCs17FlJqSrwyb_12rig_firmware11calibration9calibrate";
        let waves = entry("rig_shared::compensation::wave::Waves::drop_fast");
        assert!(waves.fits(drop_fast) && !waves.fits(calibrate));
        assert!(entry("rig_firmware::calibration::calibrate").fits(calibrate));
        assert!(!entry("rig_shared::compensation::wave::Waves::turn").fits(drop_fast));
        // The crate that instantiates a generic function ends its symbol.
        assert!(!entry("rig_firmware::compensation").fits(drop_fast));
        // A linker's jump to a function is not the function.
        assert!(!waves.fits(&format!("__Thumbv7ABSLongThunk_{drop_fast}")));
        assert!(entry("fmaxf").fits("fmaxf") && !entry("fmaxf").fits("fmaxff"));
    }

    #[test]
    fn what_is_no_entry_is_told_with_its_line() {
        assert_eq!(entries("# nothing\n\n").unwrap(), []);
        let marked = entries("fast fmaxf if-called").unwrap();
        assert!(marked[0].if_called && !entry("fmaxf").if_called);
        assert!(entries("fast rig_shared::a if-called").is_err());
        assert!(entries("fast fmaxf sometimes").is_err() && entries("fast").is_err());
        let error = entries("fast a # every tick\nquick b\n").unwrap_err();
        assert_eq!((error.line, error.text.as_str()), (2, "quick b"));
    }
}
