//! What the readings of a recording hold, reduced to one triangle a channel and segment: the memory does not grow with
//! the recording, and any mounting of the sensor can be tried without reading it again.
//!
//! The readings enter as columns, so a rotation of the sensor or another order of its axes is a combination of columns.

use nalgebra::DMatrix;
use rig_identify::TriangularFactor;
use rig_shared::multibody::INERTIAL_PARAMETERS;

use crate::rows::Passed;
use crate::wrench_row::{WEIGHED, WrenchRow};

/// Number of segments of a recording.
pub(crate) const SEGMENTS: usize = 20;

/// Number of rows that are kept for figures.
const SAMPLED: u64 = 600;

/// Columns of a channel's triangle: ten parameters, then these. The first columns have zeros below as many rows, so what
/// is seldom needed comes last.
pub(crate) mod column {
    /// One.
    pub(crate) const ONE: usize = 10;
    /// Time, −½ to ½ over the recording.
    pub(crate) const TIME: usize = 11;
    /// Temperature, in the unit of its column.
    pub(crate) const TEMPERATURE: usize = 12;
    /// The first of the three readings of the channel's kind.
    pub(crate) const READINGS: usize = 13;
    /// For a moment: regressor of the forces along the next axis and the one after it, mass and first moments of each;
    /// zero for a force.
    pub(crate) const FORCES: usize = 16;
    /// Regressor of the weight for a unit of gravity along each axis of the base: three times four parameters.
    pub(crate) const WEIGHTS: usize = 24;
    /// Derivative of the regressor by time.
    pub(crate) const RATE: usize = 36;
    /// Number of columns.
    pub(crate) const COUNT: usize = 46;
}

/// A segment of a recording.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    /// One triangle a channel, rows × [`column::COUNT`].
    pub channels: [DMatrix<f64>; 6],
    /// Rows in it.
    pub rows: u64,
    /// Time of the first of them, s.
    pub begin: f64,
}

impl Segment {
    /// Returns segments in one.
    fn merged(segments: &[Self]) -> Self {
        let merged = |channel: usize| {
            let mut factor = TriangularFactor::new(column::COUNT - 1);
            for row in segments.iter().flat_map(|s| s.channels[channel].row_iter()) {
                let x: Vec<f64> = row.iter().copied().collect();
                factor.push(&x[..column::COUNT - 1], x[column::COUNT - 1], 1.0);
            }
            DMatrix::from_vec(column::COUNT, column::COUNT, factor.triangle())
        };
        Self {
            channels: std::array::from_fn(merged),
            rows: segments.iter().map(|s| s.rows).sum(),
            begin: segments.first().map_or(0.0, |s| s.begin),
        }
    }
}

/// A recording of the sensor.
#[derive(Clone, Debug)]
pub(crate) struct Recorded {
    /// Name for messages.
    pub label: String,
    /// True if the load was mounted.
    pub loaded: bool,
    /// True if each row is a pose at rest.
    pub poses: bool,
    /// Segments in the order of time.
    pub segments: Vec<Segment>,
    /// All of them in one.
    pub whole: Segment,
    /// Length, s.
    pub length: f64,
    /// True if the sensor's temperature was recorded and changes.
    pub warms: bool,
    /// What its rows tell beside the fit.
    pub passed: Passed,
    /// Temperature of the first row, in the unit of its column.
    pub reference: f64,
    /// Rows spread evenly over the recording, at most about [`SAMPLED`].
    pub sample: Vec<WrenchRow>,
}

impl Recorded {
    /// Returns the number of rows.
    pub(crate) fn rows(&self) -> u64 {
        self.segments.iter().map(|s| s.rows).sum()
    }

    /// Returns the share of its rows that were left out beside saturated readings.
    pub(crate) fn left_out(&self) -> f64 {
        let saturated = self.passed.saturated;
        saturated as f64 / (saturated + self.rows()).max(1) as f64
    }

    /// Returns true if every row is among the sampled ones.
    pub(crate) fn is_sampled(&self) -> bool {
        self.sample.len() as u64 == self.rows()
    }

    /// Returns a recording of which every row is sampled without some of its poses.
    pub(crate) fn without_poses(&self, poses: &[usize]) -> Self {
        let rows = self.sample.iter().enumerate();
        let kept: Vec<&WrenchRow> = rows
            .filter(|(k, _)| !poses.contains(k))
            .map(|(_, row)| row)
            .collect();
        let mut collector = Collector::new(kept.len() as u64, self.length);
        kept.into_iter().for_each(|row| collector.push(row));
        let passed = Passed {
            saturated: self.passed.saturated + poses.len() as u64,
            ..self.passed
        };
        collector.finish(self.label.clone(), self.loaded, self.poses, passed)
    }
}

/// Returns the next axis and the one after it.
pub(crate) fn others(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// Returns the noise of forces (N) and moments (N·m) in the band of the fit: that of the recordings, by their rows; `None`
/// if one of them does not tell it.
pub(crate) fn noise_floor(recordings: &[Recorded]) -> Option<[f64; 2]> {
    let (mut sums, mut rows) = ([0.0; 2], 0.0);
    for recorded in recordings {
        let own = recorded.passed.noise?;
        let count = recorded.rows() as f64;
        for (sum, noise) in sums.iter_mut().zip(own) {
            *sum += count * noise * noise;
        }
        rows += count;
    }
    (rows > 0.0).then(|| sums.map(|sum| (sum / rows).sqrt()))
}

/// Collects rows into segments.
pub(crate) struct Collector {
    factors: Vec<[TriangularFactor; 6]>,
    counts: Vec<u64>,
    begins: Vec<f64>,
    expected: u64,
    seen: u64,
    length: f64,
    reference: Option<f64>,
    warms: bool,
    sample: Vec<WrenchRow>,
}

impl Collector {
    /// Creates a collector for about `expected` rows over `length` seconds.
    pub(crate) fn new(expected: u64, length: f64) -> Self {
        let empty = || std::array::from_fn(|_| TriangularFactor::new(column::COUNT - 1));
        Self {
            factors: (0..SEGMENTS).map(|_| empty()).collect(),
            counts: vec![0; SEGMENTS],
            begins: vec![0.0; SEGMENTS],
            expected: expected.max(1),
            seen: 0,
            length: length.max(f64::MIN_POSITIVE),
            reference: None,
            warms: false,
            sample: Vec::new(),
        }
    }

    /// Returns the number of rows so far.
    pub(crate) fn rows(&self) -> u64 {
        self.seen
    }

    /// Adds a row.
    pub(crate) fn push(&mut self, row: &WrenchRow) {
        let place = (u128::from(self.seen) * SEGMENTS as u128 / u128::from(self.expected)) as usize;
        let segment = place.min(SEGMENTS - 1);
        if self.seen.is_multiple_of(self.expected.div_ceil(SAMPLED)) {
            self.sample.push(row.clone());
        }
        self.seen += 1;
        if self.counts[segment] == 0 {
            self.begins[segment] = row.time;
        }
        self.counts[segment] += 1;
        let reference = *self.reference.get_or_insert(row.temperature);
        let warmer = row.temperature - reference;
        self.warms |= warmer != 0.0;
        for (channel, factor) in self.factors[segment].iter_mut().enumerate() {
            let first = channel / 3 * 3;
            let mut x = [0.0; column::COUNT - 1];
            let own = channel * INERTIAL_PARAMETERS;
            x[..INERTIAL_PARAMETERS]
                .copy_from_slice(&row.regressor[own..own + INERTIAL_PARAMETERS]);
            x[column::ONE] = 1.0;
            x[column::TIME] = row.time / self.length - 0.5;
            x[column::TEMPERATURE] = warmer;
            x[column::READINGS..column::FORCES].copy_from_slice(&row.readings[first..first + 3]);
            if first > 0 {
                for (to, axis) in x[column::FORCES..column::WEIGHTS]
                    .chunks_exact_mut(WEIGHED)
                    .zip(others(channel % 3))
                {
                    let own = axis * INERTIAL_PARAMETERS;
                    to.copy_from_slice(&row.regressor[own..own + WEIGHED]);
                }
            }
            for (weight, entries) in x[column::WEIGHTS..column::RATE]
                .chunks_exact_mut(WEIGHED)
                .zip(&row.weights)
            {
                weight.copy_from_slice(&entries[channel * WEIGHED..(channel + 1) * WEIGHED]);
            }
            let rate = &row.rate[own..own + INERTIAL_PARAMETERS];
            x[column::RATE..].copy_from_slice(&rate[..INERTIAL_PARAMETERS - 1]);
            factor.push(&x, rate[INERTIAL_PARAMETERS - 1], 1.0);
        }
    }

    /// Returns the recording; segments without rows are left out.
    pub(crate) fn finish(
        self,
        label: String,
        loaded: bool,
        poses: bool,
        passed: Passed,
    ) -> Recorded {
        let segments = self.factors.iter().zip(&self.counts).zip(&self.begins);
        let segments: Vec<Segment> = segments
            .filter(|((_, rows), _)| **rows > 0)
            .map(|((factors, rows), begin)| Segment {
                channels: std::array::from_fn(|c| {
                    let width = column::COUNT;
                    DMatrix::from_vec(width, width, factors[c].triangle())
                }),
                rows: *rows,
                begin: *begin,
            })
            .collect();
        Recorded {
            label,
            loaded,
            poses,
            whole: Segment::merged(&segments),
            segments,
            length: self.length,
            warms: self.warms,
            passed,
            reference: self.reference.unwrap_or(0.0),
            sample: self.sample,
        }
    }
}
