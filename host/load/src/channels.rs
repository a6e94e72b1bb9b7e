//! The channels of the wrist sensor by themselves: dead, or cut at the end of their range.

use rig_data::WRENCH_COLUMNS;
use rig_data::prepare::Recording;
use rig_model::robot::WristSensor;

use crate::error::LoadError;
use crate::rows::{Ends, each_readings};

/// Consecutive rows at an extreme value that a cut reading shows at least.
const RUN: usize = 5;
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
    longest: usize,
}

impl End {
    /// Returns true if more rows lie exactly at the end than near it, several of them in a row: a limit was reached.
    fn is_cut(&self) -> bool {
        self.longest >= RUN && self.at > self.near
    }

    fn push(&mut self, distance: f64, near: f64) {
        if distance == 0.0 {
            self.at += 1;
            self.run += 1;
            self.longest = self.longest.max(self.run);
        } else {
            self.run = 0;
            self.near += usize::from(distance <= near);
        }
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
pub(crate) fn judge(recording: &dyn Recording, sensor: &WristSensor) -> Result<Judged, LoadError> {
    let (rows, length, channels) = ranges(recording)?;
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
                end[0].push(list[k] - channel.low, near);
                end[1].push(channel.high - list[k], near);
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
            let described = range.is_some_and(|range| seen[side].abs() >= range);
            if found[c][side].is_cut() || described {
                cut.push((WRENCH_COLUMNS[c], seen[side]));
            }
            if found[c][side].is_cut() {
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
