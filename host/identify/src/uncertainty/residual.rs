//! Residual statistics of a joint: size, correlation time, distribution, dependence on the motion.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

use super::groups::FINEST_GROUPS;
use super::groups::group_of;
use rig_numerics::autocorrelation::Autocorrelation;
use rig_numerics::statistics::grouped_mean;

/// Number of bins of a dependence plot.
const BINS: usize = 20;
/// Number of lags of the whiteness test.
const TEST_LAGS: usize = 20;
/// Largest number of points of a time series for plots.
pub(crate) const SERIES_POINTS: usize = 4000;

/// Least relative error of a torque that counts. The residual of a recording without noise shows neither the errors of
/// filters and derivatives nor those of sensors: it is rounding, and a standard deviation from it tends to zero.
pub const LEAST_ERROR: f64 = 1e-3;

/// Mean residual as a function of one coordinate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Dependence {
    /// `position`, `velocity`, `load` (the measured torque) or `direction`.
    pub coordinate: String,
    /// Middle of each bin.
    pub middle: Vec<f64>,
    /// Mean residual in each bin.
    pub mean: Vec<f64>,
    /// Standard deviation of that mean, with time segments as the independent units.
    pub std: Vec<f64>,
    /// Smallest p-value over the bins (t-test against zero), multiplied by the number of bins (Bonferroni).
    pub p_value: f64,
    /// One sentence.
    pub text: String,
}

/// Residual over all rows of a joint, including the slow and torque-limited rows that its report excludes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct AllRows {
    /// Number of rows.
    pub rows: u64,
    /// RMS of the residual, N·m or N; not a number without rows.
    pub rms: f64,
    /// `rms` over the RMS of the torque.
    pub relative_error: f64,
}

/// Results for one joint over one set of recordings.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ResidualReport {
    /// RMS of the residual, N·m or N.
    pub rms: f64,
    /// RMS of the torque over the same rows.
    pub torque_rms: f64,
    /// `rms / torque_rms`.
    pub relative_error: f64,
    /// Number of rows.
    pub rows: u64,
    /// The same over all rows.
    pub all: AllRows,
    /// Autocorrelation from lag 0 on.
    pub autocorrelation: Vec<f64>,
    /// p-value of Ljung & Box's test (1978) over 20 lags.
    pub whiteness_p: f64,
    /// One sentence.
    pub whiteness: String,
    /// Skewness.
    pub skewness: f64,
    /// Excess kurtosis.
    pub kurtosis: f64,
    /// p-value of Jarque & Bera's test (1987), with the effective number of rows.
    pub normality_p: f64,
    /// One sentence.
    pub normality: String,
    /// Dependence on position, velocity, load and direction.
    pub dependence: Vec<Dependence>,
    /// Decimated time, measured torque and predicted torque.
    pub series: Series,
}

/// Curves for a plot, at most `SERIES_POINTS` points.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Series {
    /// Time, s.
    pub t: Vec<f64>,
    /// Measured torque, N·m or N.
    pub measured: Vec<f64>,
    /// Predicted torque, N·m or N.
    pub predicted: Vec<f64>,
    /// True where the row counts; false where it is masked.
    pub used: Vec<bool>,
}

struct Binned {
    name: &'static str,
    range: [f64; 2],
    bins: usize,
    sums: Vec<f64>,
    counts: Vec<f64>,
}

impl Binned {
    fn new(name: &'static str, range: [f64; 2], bins: usize) -> Self {
        Self {
            name,
            range,
            bins,
            sums: vec![0.0; bins * FINEST_GROUPS],
            counts: vec![0.0; bins * FINEST_GROUPS],
        }
    }

    fn push(&mut self, group: usize, at: f64, e: f64) {
        let [low, high] = self.range;
        let place = (at - low) / (high - low).max(f64::MIN_POSITIVE) * self.bins as f64;
        let bin = (place.max(0.0) as usize).min(self.bins - 1);
        self.sums[group * self.bins + bin] += e;
        self.counts[group * self.bins + bin] += 1.0;
    }

    fn report(&self, rms: f64) -> Dependence {
        let [low, high] = self.range;
        let step = (high - low) / self.bins as f64;
        let (mut middle, mut mean, mut std) = (Vec::new(), Vec::new(), Vec::new());
        let mut best = (1.0f64, 0.0, 0.0);
        for b in 0..self.bins {
            let groups: Vec<[f64; 2]> = (0..FINEST_GROUPS)
                .map(|g| g * self.bins + b)
                .map(|k| [self.sums[k], self.counts[k]])
                .filter(|[_, rows]| *rows > 0.0)
                .collect();
            if groups.len() < 4 {
                continue;
            }
            let [m, s] = grouped_mean(&groups);
            let g = groups.len() as f64;
            let at = low + (b as f64 + 0.5) * step;
            middle.push(at);
            mean.push(m);
            std.push(s);
            let p = StudentsT::new(0.0, 1.0, g - 1.0)
                .map_or(1.0, |t| 2.0 * t.sf((m / s.max(f64::MIN_POSITIVE)).abs()));
            if p < best.0 {
                best = (p, at, m);
            }
        }
        let p_value = (best.0 * middle.len().max(1) as f64).min(1.0);
        let text = if middle.len() < 2 {
            format!(
                "Too little of the range of {} was visited to judge.",
                self.name
            )
        } else if p_value < 0.01 {
            format!(
                "The mean residual depends on {}: near {:.4} it is {:.4}, {:.0} % of the residual's RMS (p = {}).",
                self.name,
                best.1,
                best.2,
                100.0 * best.2.abs() / rms.max(f64::MIN_POSITIVE),
                rig_output::format_p_value(p_value)
            )
        } else {
            format!(
                "No dependence of the mean residual on {} is seen (p = {p_value:.2}).",
                self.name
            )
        };
        Dependence {
            coordinate: self.name.to_owned(),
            middle,
            mean,
            std,
            p_value,
            text,
        }
    }
}

/// Writes a small p-value in words; values below the smallest number are not shown as zero.
fn p_text(p: f64) -> String {
    match rig_output::format_p_value(p) {
        below if below.starts_with('<') => format!("p {below}"),
        value => format!("p = {value}"),
    }
}

/// Ranges of the bins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ranges {
    /// Lowest and highest position.
    pub position: [f64; 2],
    /// Highest speed.
    pub speed: f64,
    /// Lowest and highest torque.
    pub torque: [f64; 2],
}

/// Collector of the residuals of one joint.
pub(crate) struct ResidualStream {
    total: u64,
    every: u64,
    moments: [f64; 5],
    torque_squares: f64,
    memory: Autocorrelation,
    /// Over all rows: their number, squares of the residual and of the torque.
    all: (u64, f64, f64),
    binned: Vec<Binned>,
    series: Series,
}

impl ResidualStream {
    /// Creates a collector for `total` instants.
    pub(crate) fn new(total: u64, ranges: Ranges) -> Self {
        Self {
            total: total.max(1),
            every: total.div_ceil(SERIES_POINTS as u64).max(1),
            moments: [0.0; 5],
            torque_squares: 0.0,
            memory: Autocorrelation::default(),
            all: (0, 0.0, 0.0),
            binned: vec![
                Binned::new("position", ranges.position, BINS),
                Binned::new("velocity", [-ranges.speed, ranges.speed], BINS),
                Binned::new("load", ranges.torque, BINS),
                Binned::new("direction", [-1.0, 1.0], 2),
            ],
            series: Series::default(),
        }
    }

    /// Adds instant `index`: time, position, velocity, measured and predicted torque. `used` is false for masked rows,
    /// which are only plotted.
    pub(crate) fn push(
        &mut self,
        index: u64,
        t: f64,
        q: f64,
        qd: f64,
        measured: f64,
        predicted: f64,
        used: bool,
    ) {
        if index.is_multiple_of(self.every) && self.series.t.len() < SERIES_POINTS {
            self.series.t.push(t);
            self.series.measured.push(measured);
            self.series.predicted.push(predicted);
            self.series.used.push(used);
        }
        let e = measured - predicted;
        self.all.0 += 1;
        self.all.1 += e * e;
        self.all.2 += measured * measured;
        if !used {
            return;
        }
        let mut power = 1.0;
        for m in &mut self.moments {
            *m += power;
            power *= e;
        }
        self.torque_squares += measured * measured;
        self.memory.push(e);
        let group = group_of(index, self.total);
        for (binned, at) in self
            .binned
            .iter_mut()
            .zip([q, qd, measured, 0.5 * qd.signum()])
        {
            binned.push(group, at, e);
        }
    }

    /// Computes the report.
    pub(crate) fn report(self) -> ResidualReport {
        let n = self.moments[0].max(1.0);
        let rms = (self.moments[2] / n).sqrt();
        let torque_rms = (self.torque_squares / n).sqrt();
        let mean = self.moments[1] / n;
        let [m2, m3, m4] = [
            self.moments[2] / n - mean.powi(2),
            self.moments[3] / n - 3.0 * mean * self.moments[2] / n + 2.0 * mean.powi(3),
            self.moments[4] / n - 4.0 * mean * self.moments[3] / n
                + 6.0 * mean.powi(2) * self.moments[2] / n
                - 3.0 * mean.powi(4),
        ];
        let m2 = m2.max(f64::MIN_POSITIVE);
        let (skewness, kurtosis) = (m3 / m2.powf(1.5), m4 / (m2 * m2) - 3.0);
        let correlation = self.memory.correlation();
        let chi = |statistic: f64, freedom: f64| {
            ChiSquared::new(freedom).map_or(1.0, |c| c.sf(statistic))
        };
        let ljung: f64 = n
            * (n + 2.0)
            * (1..=TEST_LAGS)
                .map(|k| correlation[k].powi(2) / (n - k as f64).max(1.0))
                .sum::<f64>();
        let whiteness_p = chi(ljung, TEST_LAGS as f64);
        let length = self.memory.correlation_time();
        let effective = n / length;
        let normality_p = chi(
            effective / 6.0 * (skewness.powi(2) + kurtosis.powi(2) / 4.0),
            2.0,
        );
        ResidualReport {
            whiteness: if whiteness_p < 0.01 {
                format!(
                    "The residual is correlated in time (memory {length:.1} rows, {}): standard deviations that take it as white are too small.",
                    p_text(whiteness_p)
                )
            } else {
                format!("The residual cannot be told from white noise (p = {whiteness_p:.2}).")
            },
            normality: if normality_p < 0.01 {
                format!(
                    "The residual is not normally distributed (skewness {skewness:.2}, excess kurtosis {kurtosis:.2}, {}).",
                    p_text(normality_p)
                )
            } else {
                format!(
                    "The residual cannot be told from a normal distribution (p = {normality_p:.2})."
                )
            },
            dependence: self.binned.iter().map(|b| b.report(rms)).collect(),
            // Without rows the error is unknown.
            relative_error: if self.moments[0] > 0.0 {
                rms / torque_rms.max(f64::MIN_POSITIVE)
            } else {
                f64::NAN
            },
            rows: self.moments[0] as u64,
            all: AllRows {
                rows: self.all.0,
                rms: (self.all.1 / self.all.0 as f64).sqrt(),
                relative_error: (self.all.1 / self.all.2.max(f64::MIN_POSITIVE)).sqrt(),
            },
            autocorrelation: correlation,
            series: self.series,
            rms: if self.moments[0] > 0.0 { rms } else { f64::NAN },
            torque_rms,
            whiteness_p,
            skewness,
            kurtosis,
            normality_p,
        }
    }
}
