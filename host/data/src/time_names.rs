//! Names that people give the column of time.

use super::unit::Unit;

/// Words for time.
const TIMES: [&str; 12] = [
    "t",
    "time",
    "times",
    "timestamp",
    "timestamps",
    "stamp",
    "datetime",
    "zeit",
    "czas",
    "seconds",
    "secs",
    "elapsed",
];

/// Words that may stand beside one of them.
const BESIDE: [&str; 8] = [
    "s", "ros", "log", "robot", "since", "sample", "unix", "epoch",
];

/// Splits a name into lower-case words: at every other sign, before a capital, and between letters and digits.
pub(super) fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut before = ' ';
    for c in name.chars() {
        let is_new = !before.is_alphanumeric()
            || (c.is_uppercase() && before.is_lowercase())
            || (c.is_ascii_digit() != before.is_ascii_digit());
        if c.is_alphanumeric() {
            match words.last_mut() {
                Some(word) if !is_new => word.extend(c.to_lowercase()),
                _ => words.push(c.to_lowercase().collect()),
            }
        }
        before = c;
    }
    words
}

/// Returns true if a name is one that people give the column of time: `Time`, `time [ms]`, `timestamp_ns`, `TimeStamp`.
pub(super) fn is_time(name: &str) -> bool {
    let bare = Unit::split(name).map_or(name, |(bare, _)| bare);
    let words = words(bare);
    let is_sure = |word: &String| TIMES.contains(&word.as_str());
    match words.as_slice() {
        [one] => is_sure(one),
        [a, b] => {
            let fits = |word: &String| is_sure(word) || BESIDE.contains(&word.as_str());
            (is_sure(a) || is_sure(b)) && fits(a) && fits(b)
        }
        _ => false,
    }
}

/// Returns true for the header stamp of ROS messages as `rostopic echo -p` and other converters name it
/// (`field.header.stamp`). It is the time only of a file without another one.
pub(super) fn is_header_stamp(name: &str) -> bool {
    let words = words(name);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    matches!(words.as_slice(), [.., "header", "stamp"])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_of_time_is_told_by_its_name() {
        for name in [
            "t",
            "Time",
            "time_ms",
            "timestamp [ns]",
            "time (s)",
            "TimeStamp",
            "ros_time",
        ] {
            assert!(is_time(name), "{name}");
        }
        for name in [
            "temp1",
            "target",
            "torque",
            "time_of_flight_2",
            "stamp count",
        ] {
            assert!(!is_time(name), "{name}");
        }
    }
}
