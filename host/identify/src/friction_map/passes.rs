//! Passes of a sweep: stretches of constant speed in the reference, or in the position if there is no reference.

use std::ops::Range;

use super::map::FrictionMapOptions;
use rig_numerics::statistics::mean;

/// Half lengths of the windows for the speed, s, longest first.
///
/// Noise of a speed falls with the window length. The longest window finds the slowest passes, which last for seconds;
/// the shortest finds short fast ones.
const WINDOWS: [f64; 3] = [0.4, 0.1, 0.025];
/// Minimum length of a pass in half windows, so that most of its windows lie within it. It excludes the peak of a
/// quintic move of 1 s, which is straight for 0.1 s.
const HALVES_PER_PASS: f64 = 6.0;
/// Largest relative deviation of a reference's speed from its mean. References are computed, so this covers rounding
/// and the jitter of time stamps. The peak of a quintic move of 1 s is this constant for 0.1 s, shorter than any pass.
const REFERENCE_TOLERANCE: f64 = 0.01;

/// A signal over time, in stretches without gaps.
#[derive(Clone, Debug, Default)]
pub(super) struct Signal {
    /// Times, s.
    pub t: Vec<f64>,
    /// Values, rad or m.
    pub x: Vec<f64>,
    /// First row of each stretch.
    pub starts: Vec<usize>,
}

/// A stretch of constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    /// First instant, s.
    pub from: f64,
    /// Last instant, s.
    pub to: f64,
    /// Mean speed, rad/s or m/s.
    pub speed: f64,
}

impl Signal {
    /// Appends a row; `follows` is false after a gap in time.
    pub(super) fn push(&mut self, t: f64, x: f64, follows: bool) {
        if self.t.is_empty() || !follows {
            self.starts.push(self.t.len());
        }
        self.t.push(t);
        self.x.push(x);
    }

    /// Returns the first row and one past the last of each stretch without a gap.
    pub(super) fn stretches(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let ends = self.starts.iter().skip(1).copied().chain([self.t.len()]);
        self.starts
            .iter()
            .copied()
            .zip(ends)
            .map(|(from, to)| [from, to])
    }

    /// Returns the stretches of constant speed of a computed reference, in order of time.
    pub(super) fn passes_of_reference(&self, options: &FrictionMapOptions) -> Vec<Stretch> {
        self.passes(REFERENCE_TOLERANCE, options.shortest)
    }

    /// Returns the stretches of constant speed of a measured position, in order of time.
    pub(super) fn passes_of_position(&self, options: &FrictionMapOptions) -> Vec<Stretch> {
        self.passes(options.tolerance, options.shortest + options.settle)
    }

    fn passes(&self, tolerance: f64, shortest: f64) -> Vec<Stretch> {
        let mut all = Vec::new();
        for [start, end] in self.stretches() {
            let mut taken = vec![false; end - start];
            let mut found: Vec<(Range<usize>, f64)> = Vec::new();
            for half in WINDOWS {
                let least = shortest.max(HALVES_PER_PASS * half);
                for run in self.runs(start..end, half, tolerance, &taken) {
                    if self.t[run.end - 1] - self.t[run.start] < least {
                        continue;
                    }
                    let Some(line) = self.straight(run.clone(), tolerance) else {
                        continue;
                    };
                    let run = self.extended(run, &line, start..end, &taken);
                    taken[run.start - start..run.end - start].fill(true);
                    found.push((run, line.speed));
                }
            }
            found.sort_by_key(|(run, _)| run.start);
            all.extend(
                self.joined(found, tolerance)
                    .into_iter()
                    .map(|(run, speed)| Stretch {
                        from: self.t[run.start],
                        to: self.t[run.end - 1],
                        speed,
                    }),
            );
        }
        all
    }

    /// Joins neighbours that form one pass: a creeping joint leaves its mean speed briefly but stays on one line.
    fn joined(&self, found: Vec<(Range<usize>, f64)>, tolerance: f64) -> Vec<(Range<usize>, f64)> {
        let mut joined: Vec<(Range<usize>, f64)> = Vec::new();
        for (run, speed) in found {
            if let Some((last, own)) = joined.last_mut()
                && (speed - *own).abs() <= 2.0 * tolerance * own.abs()
                && let Some(line) = self.straight(last.start..run.end, tolerance)
            {
                *last = last.start..run.end;
                *own = line.speed;
            } else {
                joined.push((run, speed));
            }
        }
        joined
    }

    /// Returns runs of rows whose speed over windows stays within a share of its mean over the run.
    fn runs(
        &self,
        rows: Range<usize>,
        half: f64,
        tolerance: f64,
        taken: &[bool],
    ) -> Vec<Range<usize>> {
        let count = rows.len();
        if count < 3 {
            return Vec::new();
        }
        let step = (self.t[rows.end - 1] - self.t[rows.start]) / (count - 1) as f64;
        let reach = ((half / step).round() as usize).max(1);
        let mut runs = Vec::new();
        let (mut start, mut sum) = (rows.start, 0.0);
        for k in rows.clone() {
            let inside = k >= rows.start + reach && k + reach < rows.end;
            let free = !taken[k - rows.start];
            let speed = if inside && free {
                let (a, b) = (k - reach, k + reach);
                (self.x[b] - self.x[a]) / (self.t[b] - self.t[a])
            } else {
                0.0
            };
            let mean = sum / (k - start).max(1) as f64;
            let fits = k > start && (speed - mean).abs() <= tolerance * mean.abs();
            if k > start && !(fits && speed != 0.0) {
                runs.push(start..k);
                (start, sum) = (k, 0.0);
            }
            if speed == 0.0 || !speed.is_finite() {
                (start, sum) = (k + 1, 0.0);
            } else {
                sum += speed;
            }
        }
        if start < rows.end && sum != 0.0 {
            runs.push(start..rows.end);
        }
        runs.retain(|run| run.len() >= 2);
        runs
    }

    /// Returns the line of a run if its rows lie on it to within a share of the travel. A window as long as the period
    /// of an oscillation shows no change of speed; the line does.
    fn straight(&self, run: Range<usize>, tolerance: f64) -> Option<Line> {
        let speed = slope(&self.t[run.clone()], &self.x[run.clone()])?;
        let mut line = Line {
            speed,
            t: mean(&self.t[run.clone()]),
            x: mean(&self.x[run.clone()]),
            off: 0.0,
        };
        let way = (self.x[run.end - 1] - self.x[run.start]).abs();
        line.off = run
            .map(|k| line.distance(self.t[k], self.x[k]))
            .fold(0.0, f64::max);
        // Deviation of the position that the speed tolerance allows in the shortest window.
        let shortest = WINDOWS.iter().copied().fold(f64::INFINITY, f64::min);
        let fits = line.off <= tolerance.max(0.02) * way;
        line.off = line.off.max(tolerance * speed.abs() * shortest);
        fits.then_some(line)
    }

    /// Extends the run by adjacent rows that also lie on its line: a long window detects the end of a pass from half
    /// its length away.
    fn extended(
        &self,
        run: Range<usize>,
        line: &Line,
        rows: Range<usize>,
        taken: &[bool],
    ) -> Range<usize> {
        let on =
            |k: usize| !taken[k - rows.start] && line.distance(self.t[k], self.x[k]) <= line.off;
        let (mut first, mut end) = (run.start, run.end);
        while first > rows.start && on(first - 1) {
            first -= 1;
        }
        while end < rows.end && on(end) {
            end += 1;
        }
        first..end
    }
}

/// A line through a run of rows.
struct Line {
    speed: f64,
    t: f64,
    x: f64,
    /// Largest distance of its own rows from it, rad or m.
    off: f64,
}

impl Line {
    fn distance(&self, t: f64, x: f64) -> f64 {
        (x - self.x - self.speed * (t - self.t)).abs()
    }
}

/// Returns the slope of the least-squares line through points; none for fewer than two instants.
pub(super) fn slope(t: &[f64], x: &[f64]) -> Option<f64> {
    let n = t.len().min(x.len()) as f64;
    let (mt, mx) = (t.iter().sum::<f64>() / n, x.iter().sum::<f64>() / n);
    let (mut along, mut square) = (0.0, 0.0);
    for (t, x) in t.iter().zip(x) {
        along += (t - mt) * (x - mx);
        square += (t - mt).powi(2);
    }
    let slope = along / square;
    slope.is_finite().then_some(slope)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Position with dwells, a pass each way per speed and quintic moves; rounded to `resolution`.
    fn made(speeds: &[f64], travel: f64, rate: f64, resolution: f64) -> Signal {
        let mut signal = Signal::default();
        let (mut t, mut x) = (0.0, 0.0);
        let mut put = |steps: usize, at: &dyn Fn(f64) -> f64, x: &mut f64| {
            let from = *x;
            for k in 1..=steps {
                *x = from + at(k as f64 / steps as f64);
                let rounded = if resolution > 0.0 {
                    (*x / resolution).round() * resolution
                } else {
                    *x
                };
                signal.push(t, rounded, true);
                t += 1.0 / rate;
            }
        };
        for v in speeds {
            for v in [*v, -*v] {
                let steps = (travel / v.abs() * rate).round() as usize;
                put(steps, &|s| s * v * steps as f64 / rate, &mut x);
                put((0.3 * rate) as usize, &|_| 0.0, &mut x);
            }
        }
        let quintic = |s: f64| 0.4 * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
        put(rate as usize, &quintic, &mut x);
        signal
    }

    #[test]
    fn every_pass_of_a_reference_is_found_whatever_its_speed_rate_and_rounding() {
        let speeds = [0.01, 0.03, 0.1, 0.3, 1.0, 2.0];
        for (rate, resolution) in [(1000.0, 0.0), (250.0, 1e-6), (1000.0, 1e-5), (100.0, 0.0)] {
            let signal = made(&speeds, 0.4, rate, resolution);
            let found = signal.passes_of_reference(&FrictionMapOptions::default());
            let told: Vec<f64> = found.iter().map(|s| s.speed).collect();
            assert_eq!(
                found.len(),
                2 * speeds.len(),
                "{rate} {resolution} {told:?}"
            );
            for (stretch, v) in found.iter().zip(speeds.iter().flat_map(|v| [*v, -*v])) {
                assert!((stretch.speed / v - 1.0).abs() < 0.01, "{stretch:?} {v}");
                assert!(stretch.to - stretch.from > 0.5 * 0.4 / v.abs());
            }
        }
    }

    #[test]
    fn an_oscillation_is_no_pass() {
        let mut signal = Signal::default();
        for k in 0..20_000 {
            let t = f64::from(k) * 1e-3;
            // A drift plus an oscillation whose period equals one of the windows.
            signal.push(
                t,
                0.05 * t + 0.1 * (t * std::f64::consts::TAU / 0.8).sin(),
                true,
            );
        }
        let found = signal.passes_of_position(&FrictionMapOptions::default());
        assert!(found.is_empty(), "{found:?}");
    }
}
