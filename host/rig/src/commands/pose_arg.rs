//! Joint positions on the command line: `--pose 0.3,-0.5` or `--pose 0.3 -0.5`.

use std::ffi::OsString;

use super::error::CommandError;

/// Name of the option.
const POSE: &str = "--pose";

/// Returns the words of a command line with the words after each `--pose` as one value, `--pose=0.3,-0.5`. For clap a list
/// that begins with a minus sign is an option, and several values after one option are one list with those of the next.
pub(crate) fn with_poses_joined<T: Into<OsString>>(
    words: impl IntoIterator<Item = T>,
) -> Vec<OsString> {
    let mut words = words.into_iter().map(Into::into).peekable();
    let mut out: Vec<OsString> = Vec::new();
    while let Some(word) = words.next() {
        let mut values: Vec<String> = Vec::new();
        while word == POSE
            && let Some(value) = words.next_if(|next| next.to_str().is_some_and(is_position))
        {
            let value = value.to_string_lossy();
            values.push(value.strip_suffix(',').unwrap_or(&value).to_owned());
        }
        out.push(match values.is_empty() {
            true => word,
            false => format!("{POSE}={}", values.join(",")).into(),
        });
    }
    out.into_iter().map(with_whole_part).collect()
}

/// Writes `-.5` as `-0.5`: for clap a number has a digit before its point.
fn with_whole_part(word: OsString) -> OsString {
    let digits = word.to_str().and_then(|text| text.strip_prefix("-."));
    match digits.filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit())) {
        Some(digits) => format!("-0.{digits}").into(),
        None => word,
    }
}

/// Returns true unless a word is an option.
fn is_position(word: &str) -> bool {
    let rest = word.strip_prefix('-');
    rest.is_none_or(|rest| rest.starts_with(|c: char| c.is_ascii_digit() || c == '.'))
}

/// Returns the positions that a value of `--pose` gives, rad or m.
///
/// # Errors
/// A sentence with the part that is no number.
pub(crate) fn positions(text: &str) -> Result<Vec<f64>, CommandError> {
    (text.split(','))
        .map(|part| {
            part.trim().parse::<f64>().map_err(|_| {
                CommandError::Sentence(format!(
                    "--pose {text}: `{}` is not a number; give one position for each joint, separated by commas or spaces.",
                    part.trim()
                ))
            })
        })
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn commas_and_spaces_give_the_same_pose() {
        for line in [
            "--pose -1.5,0.25,-2 --out x",
            "--pose -1.5 0.25 -2 --out x",
            "--pose -1.5, 0.25, -2 --out x",
        ] {
            let joined = with_poses_joined(line.split(' '));
            assert_eq!(joined, ["--pose=-1.5,0.25,-2", "--out", "x"], "{line}");
        }
        let kept = "--pose=-1,2 --pose --out --stiffness -1 2";
        assert_eq!(with_poses_joined(kept.split(' ')).join(" ".as_ref()), *kept);
        let two = with_poses_joined("--pose 1 2 --pose .5 nan".split(' '));
        assert_eq!(two, ["--pose=1,2", "--pose=.5,nan"]);
        let bias = with_poses_joined("--sensor-bias 3 -.1 -.25 .2 -1 -.x".split(' '));
        assert_eq!(
            bias,
            ["--sensor-bias", "3", "-0.1", "-0.25", ".2", "-1", "-.x"]
        );
        assert_eq!(positions("-1.5, 0.25").unwrap(), [-1.5, 0.25]);
        assert!(positions("1,,2").is_err());
    }
}
