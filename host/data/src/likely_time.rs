//! Unit of a time column, from its values.

/// Returns the probable unit of times that begin at `first` and are `period` apart, and why; `None` if they are probably
/// seconds.
///
/// Numbers of this size are times since 1970 in a unit below the second: in seconds, the year 2100 is 4.1·10⁹. Otherwise a
/// period of half a unit or more is taken as milliseconds or less, because robots are sampled more often than twice a
/// second; between the units, periods of 0.5 to 500 are milliseconds, longer ones microseconds, then nanoseconds.
pub(super) fn likely_time(
    first: Option<f64>,
    period: Option<f64>,
) -> Option<(&'static str, &'static str)> {
    let first = first.unwrap_or(0.0).abs();
    for (least, unit, why) in [
        (1e17, "ns", "its values are nanoseconds since 1970"),
        (1e14, "us", "its values are microseconds since 1970"),
        (1e11, "ms", "its values are milliseconds since 1970"),
    ] {
        if first >= least {
            return Some((unit, why));
        }
    }
    match period? {
        step if step >= 5e5 => Some(("ns", "its steps are too long for microseconds")),
        step if step >= 500.0 => Some(("us", "its steps are too long for milliseconds")),
        step if step >= 0.5 => Some(("ms", "its steps are too long for seconds")),
        _ => None,
    }
}
