//! Rows of a recording: regressor of the wrench and readings of the sensor, in one band.

use nalgebra::{Matrix3, Vector3};
use rig_data::prepare::{LowPass, Motion, PrepareError, PreprocessingPlan, Recording, each_motion};
use rig_data::{Block, WRENCH_COLUMNS, WRENCH_MESSAGE, WRENCH_TEMPERATURE};
use rig_shared::multibody::{Chain, MultibodyError, Pose as Frame, frame_pose, wrench_regressor};

use crate::axes::SensorAxes;
use crate::error::LoadError;
use crate::noise_floor::NoiseFloor;
use crate::pose_noise::Scatter;
use crate::wrench_row::{ENTRIES, WrenchRow, about, weight};

/// Least number of poses or rows: with two the mass and a part of the centre are known.
pub(crate) const LEAST_ROWS: usize = 2;
/// Fewest rows of a motion: no derivative can be formed of fewer.
pub const FEWEST_ROWS: usize = 256;

/// Readings beyond which a channel counts as saturated, lowest and highest, by column.
pub(crate) type Ends = [[f64; 2]; 6];

/// What the rows of a recording tell beside the fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Passed {
    /// Rows left out beside a saturated reading.
    pub saturated: u64,
    /// Noise of forces (N) and moments (N·m) in the band of the fit, if that of the messages is white; `None` if the band
    /// leaves nothing above it.
    pub noise: Option<[f64; 2]>,
    /// How the rows of the poses differ.
    pub scatter: Scatter,
    /// True if it has a column with the sensor's temperature.
    pub has_temperature: bool,
}

/// Streams the rows of a recording of motion. Position, regressor and readings pass the same low-pass, so that they
/// are compared in the same band, that of the plan `band`; the motion is prepared by `plan`. Readings are those `delay`
/// seconds later. Rows beside a reading outside of `ends` are left out.
///
/// # Errors
/// [`LoadError`]: a recording that cannot be read or has no sensor.
pub(crate) fn each_row(
    chain: &Chain<f64>,
    axes: &SensorAxes,
    recording: &dyn Recording,
    [plan, band]: [&PreprocessingPlan; 2],
    (ends, delay): (&Ends, f64),
    take: &mut dyn FnMut(&WrenchRow),
) -> Result<Passed, LoadError> {
    let low_pass = parallel_low_pass(band)?;
    let label = recording.label();
    let mut passed = Passed::default();
    let mut floor = NoiseFloor::new(&low_pass, band);
    let mut start = None;
    let mut missing = None;
    each_motion(recording, plan, 0, &mut |motion| {
        passed.has_temperature |= temperature(&motion.extra).is_some();
        let begin = *start.get_or_insert(motion.t.first().copied().unwrap_or(0.0));
        let readings = match readings(&motion.extra) {
            Ok(readings) => readings,
            Err(column) => {
                missing = Some(column);
                return Err(PrepareError::Stopped("no sensor".to_owned()));
            }
        };
        let piece = Piece {
            chain,
            axes,
            plan,
            low_pass: &low_pass,
            motion,
            readings,
            begin,
            ends,
            delay,
        };
        passed.saturated += piece
            .rows(take, &mut floor)
            .map_err(|e| PrepareError::Read(e.to_string()))?;
        Ok(())
    })
    .map_err(|error| match missing {
        Some(column) => LoadError::NoColumn {
            label: label.clone(),
            column,
        },
        None => error.into(),
    })?;
    passed.noise = floor.noise();
    Ok(passed)
}

/// Returns the low-pass of the readings.
///
/// # Errors
/// [`PrepareError::Cutoff`].
pub(crate) fn parallel_low_pass(band: &PreprocessingPlan) -> Result<LowPass, PrepareError> {
    band.parallel_low_pass()
        .ok_or_else(|| PrepareError::Cutoff {
            cutoff: band.cutoff,
            rate: band.sample_rate,
            nyquist: band.sample_rate / 2.0,
        })
}

/// Returns the axes of the base in the axes of the last link.
pub(crate) fn base_axes(
    chain: &Chain<f64>,
    q: &[f64],
) -> Result<[Vector3<f64>; 3], MultibodyError> {
    let own = Frame {
        position: [0.0; 3],
        rotation: Matrix3::identity().into(),
    };
    let mut unused = vec![[0.0; 6]; q.len()];
    let pose = frame_pose(chain, q, chain.last_link(), &own, &mut unused)?;
    Ok(pose.rotation.map(Vector3::from))
}

/// Calls `take` with each block of a recording and its readings.
///
/// # Errors
/// As [`each_row`].
pub(crate) fn each_readings(
    recording: &dyn Recording,
    take: &mut dyn FnMut(&Block, [&[f64]; 6]) -> Result<(), PrepareError>,
) -> Result<(), LoadError> {
    let mut wrong = None;
    let read = recording.each_block(1 << 14, &mut |block| {
        let label = || recording.label();
        let found = match (readings(&block.extra), no_number(&block)) {
            (Ok(readings), None) => return take(&block, readings),
            (Err(column), _) => LoadError::NoColumn {
                label: label(),
                column,
            },
            (_, Some(line)) => LoadError::NoTemperature {
                label: label(),
                line,
            },
        };
        wrong = Some(found);
        Err(PrepareError::Stopped("no sensor".to_owned()))
    });
    match (read, wrong) {
        (_, Some(error)) => Err(error),
        (read, None) => Ok(read?),
    }
}

/// Returns the line of the first row whose temperature is no number.
fn no_number(block: &Block) -> Option<u64> {
    let list = temperature(&block.extra)?;
    let at = list.iter().position(|value| !value.is_finite())?;
    Some(block.line(at))
}

/// Returns the six columns of the sensor; the name of the first that is missing otherwise.
pub(crate) fn readings(extra: &[(String, Vec<f64>)]) -> Result<[&[f64]; 6], &'static str> {
    let mut found: [&[f64]; 6] = [&[]; 6];
    for (to, name) in found.iter_mut().zip(WRENCH_COLUMNS) {
        *to = extra
            .iter()
            .find_map(|(own, list)| (own == name).then_some(list.as_slice()))
            .ok_or(name)?;
    }
    Ok(found)
}

/// Returns the column of the sensor's temperature.
pub(crate) fn temperature(columns: &[(String, Vec<f64>)]) -> Option<&[f64]> {
    extra(columns, WRENCH_TEMPERATURE)
}

/// Returns the column with this name.
fn extra<'a>(columns: &'a [(String, Vec<f64>)], name: &str) -> Option<&'a [f64]> {
    let column = columns.iter().find(|(own, _)| own == name);
    column.map(|(_, list)| list.as_slice())
}

/// Returns true if a reading lies outside of the range that its channel measures.
pub(crate) fn beyond(readings: &[f64; 6], ends: &Ends) -> bool {
    (readings.iter().zip(ends)).any(|(value, [low, high])| value <= low || value >= high)
}

/// A piece of a recording of motion.
struct Piece<'a> {
    chain: &'a Chain<f64>,
    axes: &'a SensorAxes,
    plan: &'a PreprocessingPlan,
    low_pass: &'a LowPass,
    motion: &'a Motion,
    readings: [&'a [f64]; 6],
    begin: f64,
    ends: &'a Ends,
    /// s
    delay: f64,
}

impl Piece<'_> {
    /// Streams the rows of the piece; returns the number of saturated ones. Adds the readings to `floor`.
    fn rows(
        &self,
        take: &mut dyn FnMut(&WrenchRow),
        floor: &mut NoiseFloor<'_>,
    ) -> Result<u64, MultibodyError> {
        let motion = self.motion;
        let (low, high) = motion.sound;
        let [columns, axes] = self.regressors(low, high)?;
        let axes: Vec<Vec<f64>> = axes.iter().map(|c| self.low_pass.zero_phase(c)).collect();
        let filtered: Vec<Vec<f64>> = (columns.iter())
            .map(|column| {
                // Forces do not depend on the inertias; such columns are zero.
                if column.iter().all(|v| *v == 0.0) {
                    column.clone()
                } else {
                    self.low_pass.zero_phase(column)
                }
            })
            .collect();
        let readings: Vec<Vec<f64>> = (self.readings.iter())
            .map(|column| self.low_pass.zero_phase(&column[low..high]))
            .collect();
        let all = self.readings.map(|column| &column[low..high]);
        let messages = extra(&motion.extra, WRENCH_MESSAGE).map(|list| &list[low..high]);
        floor.add(all, &readings, messages);
        let temperature = temperature(&motion.extra);
        let step = self.plan.decimation;
        // Rows by which the readings are late: whole ones, and the share of the next.
        let late = self.delay * self.plan.sample_rate;
        let (whole, share) = (late.floor(), late - late.floor());
        let mut left_out = 0;
        for k in motion.usable.0.max(low)..motion.usable.1.min(high) {
            if !(motion.offset + k as u64).is_multiple_of(step as u64) {
                continue;
            }
            let read = (k - low) as f64 + whole;
            if !(read >= 0.0 && read + 1.0 < (high - low) as f64) {
                continue;
            }
            let read = read as usize;
            let middle = low + read;
            let around = middle.saturating_sub(step).max(low)..(middle + step + 1).min(high);
            let saturated = around.into_iter().any(|row| {
                let now: [f64; 6] = std::array::from_fn(|c| self.readings[c][row]);
                beyond(&now, self.ends)
            });
            if saturated {
                left_out += 1;
                continue;
            }
            let at = k - low;
            let mut regressor: [f64; ENTRIES] = std::array::from_fn(|c| filtered[c][at]);
            let [before, after] = [at.saturating_sub(1), (at + 1).min(high - low - 1)];
            let span = (after - before) as f64 / self.plan.sample_rate;
            let mut rate: [f64; ENTRIES] =
                std::array::from_fn(|c| (filtered[c][after] - filtered[c][before]) / span);
            let origin = &self.axes.origin;
            about(origin, &mut regressor);
            about(origin, &mut rate);
            take(&WrenchRow {
                time: motion.t[k] - self.begin,
                temperature: temperature.map_or(0.0, |list| list[k]),
                regressor,
                rate,
                weights: std::array::from_fn(|axis| {
                    let direction = Vector3::from_fn(|c, _| axes[3 * axis + c][at]);
                    weight(&direction, origin)
                }),
                readings: std::array::from_fn(|c| {
                    let [now, next] = [readings[c][read], readings[c][read + 1]];
                    now + share * (next - now)
                }),
            });
        }
        Ok(left_out)
    }

    /// Returns the entries of the regressor over the rows `low .. high`, and the axes of the base in the described axes
    /// of the sensor, one column each.
    fn regressors(&self, low: usize, high: usize) -> Result<[Vec<Vec<f64>>; 2], MultibodyError> {
        let joints = &self.motion.joints;
        let empty = |count: usize| vec![Vec::with_capacity(high - low); count];
        let [mut columns, mut axes] = [empty(ENTRIES), empty(9)];
        let [mut q, mut qd, mut qdd] = [(); 3].map(|()| vec![0.0; joints.len()]);
        let mut entries = [0.0; ENTRIES];
        for k in low..high {
            for (j, joint) in joints.iter().enumerate() {
                (q[j], qd[j], qdd[j]) = (joint.q[k], joint.qd[k], joint.qdd[k]);
            }
            wrench_regressor(self.chain, &q, &qd, &qdd, &mut entries)?;
            self.axes.turn(&mut entries);
            for (column, entry) in columns.iter_mut().zip(entries) {
                column.push(entry);
            }
            let now = base_axes(self.chain, &q)?.map(|axis| self.axes.seen(&axis));
            let entries = now.iter().flat_map(|axis| axis.iter());
            for (column, entry) in axes.iter_mut().zip(entries) {
                column.push(*entry);
            }
        }
        Ok([columns, axes])
    }
}
