//! The channels of the wrist sensor by themselves: dead, or cut at the end of their range.

use rig_data::WRENCH_COLUMNS;
use rig_data::prepare::Recording;
use rig_model::robot::WristSensor;
use rig_output::{format_short, format_significant};

use crate::error::LoadError;
use crate::rows::{Ends, FEWEST_ROWS, LEAST_ROWS, each_readings};

/// Consecutive rows at an extreme value that a cut reading shows at least.
const RUN: usize = 5;
/// Ratio to the described range that no sensor reads.
const BEYOND: f64 = 1.1;
/// Width of the neighbourhood of an extreme value, as a share of the channel's range.
const NEIGHBOURHOOD: f64 = 0.02;

/// What a channel reads over a recording.
#[derive(Clone, Copy, Debug)]
struct Channel {
    low: f64,
    high: f64,
    /// Smallest difference of two rows that is not zero.
    step: f64,
    last: f64,
}

/// Rows at and near an end of a channel.
#[derive(Clone, Copy, Debug, Default)]
struct End {
    at: usize,
    near: usize,
    run: usize,
    /// Distance of the row before the run.
    before: f64,
    /// Runs of [`RUN`] rows or more, and those of them that are entered or left by more than a step of the sensor.
    runs: [usize; 2],
}

impl End {
    /// Returns true if more rows lie exactly at the end than near it, and most runs of such rows begin or end abruptly: a
    /// limit was reached. A coarse reading that turns at its highest value comes and goes by single steps.
    fn is_cut(&self) -> bool {
        let [runs, abrupt] = self.runs;
        runs > 0 && 2 * abrupt > runs && self.at > self.near
    }

    fn push(&mut self, distance: f64, near: f64, step: f64) {
        if distance == 0.0 {
            self.at += 1;
            self.run += 1;
            return;
        }
        if self.run >= RUN {
            let is_abrupt = self.before.max(distance) > 1.5 * step;
            self.runs[0] += 1;
            self.runs[1] += usize::from(is_abrupt);
        }
        self.run = 0;
        self.before = distance;
        self.near += usize::from(distance <= near);
    }
}

/// The ends of the channels of a recording, and those that it reaches.
pub(crate) struct Judged {
    /// Number of rows.
    pub rows: u64,
    /// Time from the first to the last row, s.
    pub length: f64,
    /// Readings beyond which rows are left out.
    pub ends: Ends,
    /// Channels that were cut, with the value.
    pub cut: Vec<(&'static str, f64)>,
}

/// Finds the ends of the channels: the described range of the sensor, and values at which readings were cut.
///
/// # Errors
/// [`LoadError::Dead`], [`LoadError::NoColumn`].
pub(crate) fn judge(
    recording: &dyn Recording,
    sensor: &WristSensor,
    poses: bool,
) -> Result<Judged, LoadError> {
    let (rows, length, channels) = ranges(recording)?;
    if rows < LEAST_ROWS as u64 {
        return Err(LoadError::TooFew {
            rows: rows as usize,
            least: LEAST_ROWS,
        });
    }
    let poses = poses || rows < FEWEST_ROWS as u64;
    for (channel, column) in channels.iter().zip(WRENCH_COLUMNS) {
        if channel.low == channel.high {
            return Err(LoadError::Dead {
                label: recording.label(),
                column,
                value: channel.low,
            });
        }
    }
    let mut found = [[End::default(); 2]; 6];
    each_readings(recording, &mut |block, readings| {
        for k in 0..block.len() {
            for ((end, channel), list) in found.iter_mut().zip(&channels).zip(readings) {
                let near = (NEIGHBOURHOOD * (channel.high - channel.low)).max(1.5 * channel.step);
                end[0].push(list[k] - channel.low, near, channel.step);
                end[1].push(channel.high - list[k], near, channel.step);
            }
        }
        Ok(())
    })?;
    let mut ends = [[f64::NEG_INFINITY, f64::INFINITY]; 6];
    let mut cut = Vec::new();
    for (c, end) in ends.iter_mut().enumerate() {
        let range = if c < 3 {
            sensor.force_range
        } else {
            sensor.moment_range
        };
        if let Some(range) = range {
            *end = [-range, range];
        }
        let seen = [channels[c].low, channels[c].high];
        for side in 0..2 {
            let reached = |range: f64| seen[side].abs() >= range;
            if let Some(range) = range.filter(|range| seen[side].abs() > BEYOND * range) {
                return Err(beyond(recording, c, seen[side], range));
            }
            // Rows of one pose repeat a reading, and a reading well inside of the range is none of its ends.
            let is_cut = !poses && found[c][side].is_cut() && range.is_none_or(reached);
            if is_cut || range.is_some_and(reached) {
                cut.push((WRENCH_COLUMNS[c], seen[side]));
            }
            if is_cut {
                end[side] = if side == 0 {
                    end[0].max(seen[0])
                } else {
                    end[1].min(seen[1])
                };
            }
        }
    }
    Ok(Judged {
        rows,
        length,
        ends,
        cut,
    })
}

/// Says that a reading is outside of what the sensor measures.
fn beyond(recording: &dyn Recording, c: usize, value: f64, range: f64) -> LoadError {
    let (unit, other) = if c < 3 {
        ("N", "kgf or mN")
    } else {
        ("N·m", "N·mm or N·cm")
    };
    LoadError::Fault(format!(
        "{} reaches {} in {}, but the range of the sensor is {} {unit}: the column looks like {other}, or the range in [wrist_sensor] is wrong.",
        WRENCH_COLUMNS[c],
        format_significant(value, 4),
        recording.label(),
        format_short(range)
    ))
}

/// Returns the number of rows, the length in s and the range of each channel.
fn ranges(recording: &dyn Recording) -> Result<(u64, f64, [Channel; 6]), LoadError> {
    let mut channels = [Channel {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
        step: f64::INFINITY,
        last: f64::NAN,
    }; 6];
    let (mut rows, mut times) = (0u64, [f64::INFINITY, f64::NEG_INFINITY]);
    each_readings(recording, &mut |block, readings| {
        rows += block.len() as u64;
        for t in &block.t {
            times = [times[0].min(*t), times[1].max(*t)];
        }
        for (channel, list) in channels.iter_mut().zip(readings) {
            for value in list {
                channel.low = channel.low.min(*value);
                channel.high = channel.high.max(*value);
                let step = (value - channel.last).abs();
                if step > 0.0 {
                    channel.step = channel.step.min(step);
                }
                channel.last = *value;
            }
        }
        Ok(())
    })?;
    Ok((rows, times[1] - times[0], channels))
}
