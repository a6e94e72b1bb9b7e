//! Times as ISO 8601 writes them: `2026-03-01T12:00:00.25Z`, and the time of day alone.

/// Returns seconds and nanoseconds since 1970 (UTC if no offset is given), or since midnight for a time of day.
pub(super) fn iso_time(text: &str) -> Option<(i64, i64)> {
    let text = text.trim().trim_matches('"');
    let (day, clock) = match text.split_once(['T', ' ']) {
        Some((date, clock)) => (days(date)?, clock.trim()),
        None => (0, text),
    };
    let (clock, offset) = offset(clock)?;
    let mut parts = clock.splitn(3, ':');
    let hours = digits(parts.next()?, 2)?;
    let minutes = digits(parts.next()?, 2)?;
    let seconds = parts.next().unwrap_or("00");
    let (whole, behind) = match seconds.split_once(['.', ',']) {
        Some((whole, behind)) => (whole, behind),
        None => (seconds, ""),
    };
    let whole = digits(whole, 2)?;
    if hours > 24 || minutes > 59 || whole > 60 {
        return None;
    }
    let mut nanoseconds = 0;
    for k in 0..9 {
        let digit = behind.as_bytes().get(k).copied().unwrap_or(b'0');
        nanoseconds = 10 * nanoseconds + i64::from(digit.is_ascii_digit().then(|| digit - b'0')?);
    }
    (behind.bytes().all(|b| b.is_ascii_digit())).then_some((
        day * 86_400 + hours * 3600 + minutes * 60 + whole - offset,
        nanoseconds,
    ))
}

/// Reads exactly `count` digits.
fn digits(text: &str, count: usize) -> Option<i64> {
    (text.len() == count && text.bytes().all(|b| b.is_ascii_digit()))
        .then(|| text.parse().ok())
        .flatten()
}

/// Splits off the offset from UTC, s.
fn offset(clock: &str) -> Option<(&str, i64)> {
    if let Some(clock) = clock.strip_suffix(['Z', 'z']) {
        return Some((clock, 0));
    }
    let Some(at) = clock.rfind(['+', '-']) else {
        return Some((clock, 0));
    };
    let (clock, offset) = clock.split_at(at);
    let sign = if offset.starts_with('-') { -1 } else { 1 };
    let offset = offset[1..].replace(':', "");
    let (hours, minutes) = match offset.len() {
        2 => (digits(&offset, 2)?, 0),
        4 => (digits(&offset[..2], 2)?, digits(&offset[2..], 2)?),
        _ => return None,
    };
    Some((clock, sign * (hours * 3600 + minutes * 60)))
}

/// Returns the days from 1970-01-01 to `2026-03-01` in the Gregorian calendar (Hinnant 2021, `days_from_civil`).
fn days(date: &str) -> Option<i64> {
    let mut parts = date.split(['-', '/']);
    let (year, month, day) = (
        digits(parts.next()?, 4)?,
        digits(parts.next()?, 2)?,
        digits(parts.next()?, 2)?,
    );
    if parts.next().is_some() || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let of_era = year.rem_euclid(400);
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let of_days = of_era * 365 + of_era / 4 - of_era / 100 + of_year;
    Some(era * 146_097 + of_days - 719_468)
}

#[cfg(test)]
mod tests {
    use super::iso_time;

    /// The seconds are those of `date -u -d … +%s`.
    #[test]
    fn times_of_day_dates_and_offsets_are_read() {
        for (text, seconds, nanoseconds) in [
            ("1970-01-01T00:00:00Z", 0, 0),
            ("2026-03-01T12:00:00.25Z", 1_772_366_400, 250_000_000),
            ("2024-02-29 23:59:59,000001", 1_709_251_199, 1000),
            ("2026-03-01T12:00:00+02:00", 1_772_359_200, 0),
            ("2026-03-01T12:00:00.5-0130", 1_772_371_800, 500_000_000),
            ("12:30:01.125", 45_001, 125_000_000),
            ("12:30", 45_000, 0),
        ] {
            assert_eq!(iso_time(text), Some((seconds, nanoseconds)), "{text}");
        }
        for text in [
            "",
            "1.5",
            "2026-13-01T00:00:00",
            "2026-03-01",
            "12:61:00",
            "12:30:01.1x",
        ] {
            assert_eq!(iso_time(text), None, "{text}");
        }
    }
}
