//! Ranges and ticks.

use rig_output::{fixed, power_of_ten};

/// Magnitude above which a value is not a measurement and counts as a gap: spans of such values overflow.
pub(crate) const LARGEST: f64 = 1e150;

/// Returns true if the value can be drawn on the axis.
pub(crate) fn drawable(value: f64, log: bool) -> bool {
    value.is_finite() && value.abs() < LARGEST && (!log || value > 1.0 / LARGEST)
}

/// Returns the smallest range that holds every drawable value, or `None` if there is none.
pub(crate) fn extent(values: impl Iterator<Item = f64>, log: bool) -> Option<(f64, f64)> {
    values
        .filter(|v| drawable(*v, log))
        .fold(None, |range, v| match range {
            None => Some((v, v)),
            Some((low, high)) => Some((low.min(v), high.max(v))),
        })
}

/// Returns the range with a margin on both sides; its length is never zero.
pub(crate) fn padded((low, high): (f64, f64), log: bool, share: f64) -> (f64, f64) {
    if log {
        let (a, b) = (low.log10(), high.log10());
        let (a, b) = if b - a < 1e-9 {
            (a - 0.5, b + 0.5)
        } else {
            let air = (b - a) * share;
            (a - air, b + air)
        };
        return (10f64.powf(a), 10f64.powf(b));
    }
    let magnitude = low.abs().max(high.abs());
    if high - low <= magnitude * 1e-12 || high - low < 1e-290 {
        let half = if magnitude < 1e-280 {
            1.0
        } else {
            magnitude * 0.1
        };
        return (low - half, high + half);
    }
    let air = (high - low) * share;
    (low - air, high + air)
}

/// A tick: its position and its label, which is empty for a minor tick.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tick {
    pub(crate) at: f64,
    pub(crate) label: String,
}

/// Least number of ticks of a linear axis: two do not show that the steps are even.
const LEAST: usize = 3;

/// Returns the number of multiples of a step within a range.
fn within(low: f64, high: f64, step: f64) -> usize {
    ((high / step + 1e-9).floor() - (low / step - 1e-9).ceil() + 1.0).max(0.0) as usize
}

/// Returns about `count` ticks, three or more, at multiples of 1, 2 or 5 times a power of ten within the range.
pub(crate) fn linear_ticks(low: f64, high: f64, count: usize) -> Vec<Tick> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) || count == 0 {
        return Vec::new();
    }
    let raw = span / count as f64;
    let decade = raw.log10().floor() as i32;
    let (mut factor, mut exponent) = match raw / 10f64.powi(decade) {
        r if r <= 1.0 + 1e-9 => (1.0, decade),
        r if r <= 2.0 + 1e-9 => (2.0, decade),
        r if r <= 5.0 + 1e-9 => (5.0, decade),
        _ => (1.0, decade + 1),
    };
    // A step of a third of the span or less fits three times; four finer steps are at most a tenth.
    for _ in 0..4 {
        if within(low, high, factor * 10f64.powi(exponent)) < LEAST {
            (factor, exponent) = match factor {
                5.0 => (2.0, exponent),
                2.0 => (1.0, exponent),
                _ => (5.0, exponent - 1),
            };
        }
    }
    let step = factor * 10f64.powi(exponent);
    let slack = span * 1e-9;
    let first = ((low - slack) / step).ceil();
    let last = ((high + slack) / step).floor();
    let largest = low.abs().max(high.abs()).log10().floor() as i32;
    let mut ticks = Vec::new();
    let mut k = first;
    // If the step is below the resolution of the numbers, k + 1 equals k: the bound ends the loop.
    while k <= last && ticks.len() < 4 * count + 4 {
        let at = k * step;
        let label = if k == 0.0 {
            "0".to_owned()
        } else if !(-3..=5).contains(&largest) {
            let decimals = (largest - exponent).max(0) as usize;
            let mantissa = k * factor * 10f64.powi(exponent - largest);
            format!("{}·{}", fixed(mantissa, decimals), power_of_ten(largest))
        } else {
            fixed(at, (-exponent).max(0) as usize)
        };
        ticks.push(Tick { at, label });
        k += 1.0;
    }
    ticks
}

/// Returns the ticks of a logarithmic axis: labelled decades, labelled 2 and 5 if there are few decades, and minor
/// ticks between them. Returns linear ticks if the range is within one decade.
pub(crate) fn log_ticks(low: f64, high: f64, count: usize) -> Vec<Tick> {
    if !(low > 0.0 && high > low) || count == 0 {
        return Vec::new();
    }
    let (a, b) = (low.log10(), high.log10());
    if b - a < 1.0 {
        return linear_ticks(low, high, count);
    }
    let stride = (((b - a) / count as f64).ceil() as i32).max(1);
    let mut ticks = Vec::new();
    for decade in a.floor() as i32..=b.ceil() as i32 {
        let whole = decade.rem_euclid(stride) == 0;
        for digit in 1..10 {
            let at = f64::from(digit) * 10f64.powi(decade);
            if at < low * (1.0 - 1e-9) || at > high * (1.0 + 1e-9) {
                continue;
            }
            let labelled = whole && (digit == 1 || (b - a < 2.2 && (digit == 2 || digit == 5)));
            if stride > 1 && digit > 1 {
                continue;
            }
            let label = if !labelled {
                String::new()
            } else if (-3..=4).contains(&decade) {
                fixed(at, (-decade).max(0) as usize)
            } else if digit == 1 {
                power_of_ten(decade)
            } else {
                format!("{digit}·{}", power_of_ten(decade))
            };
            ticks.push(Tick { at, label });
        }
    }
    ticks
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().map(|t| t.label.as_str()).collect()
    }

    #[test]
    fn linear_labels_have_the_decimals_of_the_step() {
        let ticks = linear_ticks(-0.31, 0.62, 5);
        assert_eq!(labels(&ticks), ["−0.2", "0", "0.2", "0.4", "0.6"]);
        let ticks = linear_ticks(0.0, 2.0e-5, 4);
        assert_eq!(
            labels(&ticks),
            ["0", "0.5·10⁻⁵", "1.0·10⁻⁵", "1.5·10⁻⁵", "2.0·10⁻⁵"]
        );
    }

    #[test]
    fn ticks_are_within_the_range_evenly_spaced_and_not_too_many() {
        for scale in [1e-140, 1e-9, 0.37, 1.0, 42.0, 1e7, 1e140] {
            for (low, high) in [
                (-1.0, 1.0),
                (0.93, 1.0),
                (0.0, 7.7),
                (-3.3, -1.1),
                (-0.75, 0.28),
            ] {
                for count in [2, 3, 5, 9] {
                    let (low, high) = (low * scale, high * scale);
                    let ticks = linear_ticks(low, high, count);
                    assert!(ticks.len() >= 3 && ticks.len() <= count.max(5) + 1);
                    let slack = (high - low) * 1e-6;
                    for tick in &ticks {
                        assert!(tick.at >= low - slack && tick.at <= high + slack);
                    }
                    for triple in ticks.windows(3) {
                        let (a, b) = (triple[1].at - triple[0].at, triple[2].at - triple[1].at);
                        assert!((a - b).abs() < slack);
                    }
                    let mut seen = labels(&ticks);
                    seen.dedup();
                    assert_eq!(seen.len(), ticks.len(), "two ticks read alike");
                }
            }
        }
    }

    #[test]
    fn ticks_end_even_where_numbers_have_no_resolution_left() {
        assert!(linear_ticks(1e15, 1e15 + 0.25, 5).len() < 30);
        assert!(linear_ticks(f64::NAN, 1.0, 5).is_empty());
        assert!(log_ticks(0.0, 1.0, 5).is_empty());
    }

    #[test]
    fn log_ticks_label_decades() {
        let ticks = log_ticks(0.5, 2000.0, 6);
        let named: Vec<&str> = labels(&ticks)
            .into_iter()
            .filter(|l| !l.is_empty())
            .collect();
        assert_eq!(named, ["1", "10", "100", "1000"]);
        let ticks = log_ticks(1e-12, 1e12, 6);
        let named: Vec<&str> = labels(&ticks)
            .into_iter()
            .filter(|l| !l.is_empty())
            .collect();
        assert!(named.len() <= 7 && named.contains(&"10⁻⁸"));
        assert!(log_ticks(2.0, 7.0, 5).len() >= 4);
    }

    #[test]
    fn ranges_ignore_what_cannot_be_drawn_and_never_collapse() {
        let values = [f64::NAN, 3.0, f64::INFINITY, -2.0, 1e300];
        assert_eq!(extent(values.into_iter(), false), Some((-2.0, 3.0)));
        assert_eq!(extent(values.into_iter(), true), Some((3.0, 3.0)));
        assert_eq!(extent([f64::NAN].into_iter(), false), None);
        for (value, log) in [(0.0, false), (5.0, false), (-1e-300, false), (5.0, true)] {
            let (low, high) = padded((value, value), log, 0.05);
            assert!(low < value && value < high, "{value}");
        }
    }
}
