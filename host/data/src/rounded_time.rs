//! Time stamps that were rounded to a resolution that is coarse beside the step of the rows, for example a loop of 2 ms
//! with stamps in whole milliseconds.
//!
//! Steps of such stamps are one, two or three times the resolution though no row is missing. A stamp is believed within
//! half of the resolution. Each row gets the time of a straight line through the stamps around it, that is, of a clock
//! with an even step. The line spans the most rows whose stamps all agree with it, and the time stays within half of
//! the resolution of its stamp.
//!
//! Recognised are decimal resolutions (1 s, 0.1 s, 0.01 s, …) that show in the rows by which the recording is probed.
//! Steps of less than two resolutions are not corrected: there a lost row looks like a rounded one.

use std::collections::VecDeque;

/// Rows on each side of a row that the widest line spans.
const WIDEST: usize = 32;
/// Rows on each side that the narrowest line spans: fewer stamps agree with a line whatever the jitter is.
const NARROWEST: usize = 4;
/// Largest distance of a stamp from the line, in resolutions: half of one for the rounding, and half as much again for
/// the line's own error.
const AGREES: f64 = 0.75;
/// Least resolution whose rounding matters, in steps: rounding moves a step by up to one resolution, and a step this far
/// from the others parts a recording.
const COARSE: f64 = 0.2;
/// Fewest resolutions in a step.
const FEWEST: f64 = 1.5;
/// Smallest power of ten that is tried, s.
const FINEST: i32 = -6;
/// Distance from a multiple of the resolution that counts as none, in resolutions: stamps that count from 1970 are
/// known to 0.2 µs.
const EXACT: f64 = 1e-3;

/// Returns the resolution of stamps (s) whose steps show its rounding; `None` if they are finer, or evenly spaced.
pub(super) fn resolution(times: &[f64]) -> Option<f64> {
    let first = *times.first()?;
    let of = |unit: f64| {
        let off = |t: &f64| {
            let units = (t - first) / unit;
            (units - units.round()).abs()
        };
        times.iter().all(|t| off(t) < EXACT)
    };
    let unit = (FINEST..=0)
        .rev()
        .map(|power| 10f64.powi(power))
        .find(|unit| of(*unit))?;
    let mut steps: Vec<f64> = times.windows(2).map(|t| t[1] - t[0]).collect();
    steps.sort_by(f64::total_cmp);
    let usual = *steps.get(steps.len() / 2)?;
    let rounded = |step: &f64| (0.5..1.5).contains(&((step - usual).abs() / unit));
    let matters = unit > COARSE * usual * (1.0 - EXACT) && usual > FEWEST * unit;
    (matters && steps.iter().any(rounded)).then_some(unit)
}

/// A row that waits for those after it.
struct Waiting {
    line: u64,
    stamp: f64,
    values: Vec<f64>,
}

/// Rows on their way to corrected times.
pub(super) struct RoundedTime {
    resolution: f64,
    /// Longest step that is no gap, s.
    longest: f64,
    /// Stamps of the rows before.
    before: VecDeque<f64>,
    ahead: VecDeque<Waiting>,
    /// Time of the row before, s.
    last: f64,
}

impl RoundedTime {
    /// For stamps with this resolution; no line spans a step above `longest`, s.
    pub(super) fn new(resolution: f64, longest: f64) -> Self {
        Self {
            resolution,
            longest,
            before: VecDeque::new(),
            ahead: VecDeque::new(),
            last: f64::NEG_INFINITY,
        }
    }

    /// Returns the corrected times of all `stamps`.
    pub(super) fn of_all(mut self, stamps: &[f64]) -> Vec<f64> {
        let mut times = Vec::with_capacity(stamps.len());
        for stamp in stamps {
            self.push(0, *stamp, Vec::new());
            if self.is_full() {
                times.extend(self.pop().map(|(_, time, _)| time));
            }
        }
        times.extend(std::iter::from_fn(|| self.pop().map(|(_, time, _)| time)));
        times
    }

    /// Returns true if the next row has all rows after it that its time may need.
    pub(super) fn is_full(&self) -> bool {
        self.ahead.len() > WIDEST
    }

    /// Returns the stamp of the last row taken.
    pub(super) fn last_stamp(&self) -> Option<f64> {
        (self.ahead.back().map(|row| row.stamp)).or_else(|| self.before.back().copied())
    }

    /// Takes a row.
    pub(super) fn push(&mut self, line: u64, stamp: f64, values: Vec<f64>) {
        let row = Waiting {
            line,
            stamp,
            values,
        };
        self.ahead.push_back(row);
    }

    /// Returns the next row: its line, its time, its values.
    pub(super) fn pop(&mut self) -> Option<(u64, f64, Vec<f64>)> {
        let row = self.ahead.front()?;
        let half = 0.5 * self.resolution;
        let on_line = self.on_line().unwrap_or(row.stamp);
        // Times grow as the stamps do.
        let time = on_line
            .clamp(row.stamp - half, row.stamp + half)
            .max(self.last + EXACT * self.resolution);
        let row = self.ahead.pop_front()?;
        self.last = time;
        self.before.push_back(row.stamp);
        if self.before.len() > WIDEST {
            self.before.pop_front();
        }
        Some((row.line, time, row.values))
    }

    /// Returns the time of the next row on the longest line that its neighbours' stamps agree with; `None` if there is
    /// none.
    fn on_line(&self) -> Option<f64> {
        let here = self.ahead.front()?.stamp;
        let together = |a: f64, b: f64| (b - a).abs() <= self.longest;
        let reach = |stamps: &mut dyn Iterator<Item = f64>| {
            let mut last = here;
            let mut list = Vec::with_capacity(WIDEST);
            for stamp in stamps.take(WIDEST) {
                if !together(last, stamp) {
                    break;
                }
                list.push(stamp - here);
                last = stamp;
            }
            list
        };
        let back = reach(&mut self.before.iter().rev().copied());
        let on = reach(&mut self.ahead.iter().skip(1).map(|row| row.stamp));
        let mut half = WIDEST;
        while half >= NARROWEST {
            let (back, on) = (&back[..half.min(back.len())], &on[..half.min(on.len())]);
            if back.len() + on.len() >= 2 * NARROWEST
                && let Some(at) = self.line(back, on)
            {
                return Some(here + at);
            }
            half /= 2;
        }
        None
    }

    /// Fits a line to the stamps before and after a row, relative to its own. Returns its time at this row if all
    /// stamps agree with it.
    fn line(&self, back: &[f64], on: &[f64]) -> Option<f64> {
        let points = || {
            let before = (1..).zip(back).map(|(k, t)| (-f64::from(k), *t));
            let after = (1..).zip(on).map(|(k, t)| (f64::from(k), *t));
            before.chain([(0.0, 0.0)]).chain(after)
        };
        let count = (back.len() + on.len() + 1) as f64;
        let (sum_k, sum_t) = points().fold((0.0, 0.0), |(k, t), p| (k + p.0, t + p.1));
        let (mean_k, mean_t) = (sum_k / count, sum_t / count);
        let (kk, kt) = points().fold((0.0, 0.0), |(kk, kt), (k, t)| {
            let k = k - mean_k;
            (kk + k * k, kt + k * (t - mean_t))
        });
        let slope = kt / kk;
        let at = |k: f64| mean_t + slope * (k - mean_k);
        let agrees = |(k, t): (f64, f64)| (t - at(k)).abs() <= AGREES * self.resolution;
        points().all(agrees).then(|| at(0.0))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// True times of a loop with this step and jitter (standard deviation, s).
    fn clock(step: f64, jitter: f64, seed: u64) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let mut now = 0.0;
        (0..4000)
            .map(|_| {
                // Sum of twelve uniform deviates: nearly normal.
                let twelve: f64 = (0..12).map(|_| rng.random::<f64>()).sum();
                now += step + jitter * (twelve - 6.0);
                now
            })
            .collect()
    }

    fn in_ms(times: &[f64]) -> Vec<f64> {
        times.iter().map(|t| (1e3 * t).round() / 1e3).collect()
    }

    #[test]
    fn an_even_clock_is_found_behind_its_rounded_stamps() {
        for step in [2.02e-3, 2.5e-3, 10e-3 / 3.0, 4.1e-3] {
            let times = clock(step, 0.0, 1);
            let stamps = in_ms(&times);
            let unit = resolution(&stamps[..1001]).unwrap();
            assert!((unit - 1e-3).abs() < 1e-12);
            let found = RoundedTime::new(unit, 5.0 * step).of_all(&stamps);
            // A constant is no error of a step: all odd stamps of steps of 2.5 ms may be rounded up.
            let steps = found.windows(2).map(|t| t[1] - t[0] - step);
            let rms = (steps.map(|off| off * off).sum::<f64>() / times.len() as f64).sqrt();
            println!("{step}: {rms}");
            // Rounding alone leaves 0.4 ms in a step.
            assert!(rms < 0.08e-3, "{step}: {rms}");
        }
    }

    #[test]
    fn jitter_remains_and_no_time_leaves_its_stamp() {
        for jitter in [0.05e-3, 0.1e-3, 0.2e-3, 0.4e-3] {
            let times = clock(2e-3, jitter, 2);
            let stamps = in_ms(&times);
            let found = RoundedTime::new(1e-3, 10e-3).of_all(&stamps);
            assert!(found.windows(2).all(|t| t[1] > t[0]));
            let off = |of: &[f64]| {
                let square: f64 = (of.iter().zip(&times)).map(|(a, b)| (a - b).powi(2)).sum();
                (square / times.len() as f64).sqrt()
            };
            println!("{jitter}: {} of {}", off(&found), off(&stamps));
            // Jitter above the rounding, 0.29 ms, hides the clock.
            let better = if jitter < 0.29e-3 { 1.0 } else { 1.1 };
            assert!(off(&found) < better * off(&stamps), "{jitter}");
            let farthest = (found.iter().zip(&stamps)).map(|(a, b)| (a - b).abs());
            assert!(farthest.fold(0.0, f64::max) < 0.51e-3);
        }
    }

    #[test]
    fn fine_stamps_even_stamps_and_lost_rows_are_not_rounded() {
        let even: Vec<f64> = (0..1001).map(|k| 2e-3 * f64::from(k)).collect();
        assert_eq!(resolution(&even), None);
        assert_eq!(resolution(&clock(2e-3, 0.1e-3, 3)), None);
        // At 1 kHz a step of 2 ms is a lost row.
        let lost: Vec<f64> = (0..1200)
            .filter(|k| k % 50 != 7)
            .map(|k| 1e-3 * f64::from(k))
            .collect();
        assert_eq!(resolution(&lost), None);
    }
}
