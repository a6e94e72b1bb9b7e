//! Readings that are cut within the described range, because an amplifier or the range that is set in the sensor ends there.
//!
//! Readings near an extreme value of a channel are suspected if they are more than those next to them. They are believed to
//! be cut if the load by all other rows would have read beyond them there.

use rig_data::WRENCH_COLUMNS;
use rig_output::format_significant;

use crate::rows::Ends;
use crate::statistics::Recorded;
use crate::system::{Fit, Sensed};

/// Noise of a channel between the mean of readings that were cut and the farthest of them, and again beyond it.
const SPREAD: f64 = 8.0;
/// Excess of what a load would read over the readings, in units of their noise in the band of the fit, from which they are
/// believed to be cut. Readings that are not cut are chosen for being extreme, so that their excess is below zero.
const EXCESS: f64 = 2.0;
/// Least number of rows by which the excess is judged.
const LEAST: usize = 3;

/// Counts of the rows near an extreme value of a channel, and next to these.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pile {
    near: u64,
    next: u64,
}

impl Pile {
    /// Returns the width of the neighbourhood of an extreme value. `share` of the channel's range is the least.
    pub(crate) fn width(range: f64, share: f64, noise: f64) -> f64 {
        (share * range).max(SPREAD * noise)
    }

    /// Adds a row at a distance from the extreme value.
    pub(crate) fn push(&mut self, distance: f64, width: f64) {
        self.near += u64::from(distance <= width);
        self.next += u64::from(distance > width && distance <= 2.0 * width);
    }

    /// Returns true if more rows are near than next to it.
    pub(crate) fn is_heaped(self) -> bool {
        self.near > self.next
    }
}

/// A side of a channel whose readings may be cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Suspect {
    pub channel: usize,
    /// 0: the lowest readings, 1: the highest.
    pub side: usize,
    /// Reading beyond which rows may be cut.
    pub from: f64,
}

impl Suspect {
    /// Narrows the ends of the channels so that the suspected rows are left out.
    pub(crate) fn narrow(&self, ends: &mut Ends) {
        let end = &mut ends[self.channel][self.side];
        *end = match self.side {
            0 => end.max(self.from),
            _ => end.min(self.from),
        };
    }

    fn is_beyond(&self, reading: f64) -> bool {
        match self.side {
            0 => reading < self.from,
            _ => reading > self.from,
        }
    }
}

/// Returns the mean reading of the suspected rows of a recording, if a load would read beyond it by more than the noise.
/// `all` are all rows of the recording, `sensed` and `fit` are without the suspected ones.
pub(crate) fn cut_at(
    suspect: &Suspect,
    (recording, all): (usize, &Recorded),
    sensed: &Sensed,
    fit: &Fit,
) -> Option<f64> {
    let channel = suspect.channel;
    let rows = all.sample.iter();
    let own = rows.filter(|row| suspect.is_beyond(row.readings[channel]));
    let sense = if suspect.side == 0 { -1.0 } else { 1.0 };
    let (mut excess, mut level, mut count) = (0.0, 0.0, 0usize);
    for row in own {
        let would = sensed.predicted(fit, recording, row)[channel];
        excess += sense * (would - row.readings[channel]);
        level += row.readings[channel];
        count += 1;
    }
    let mean = excess / count.max(1) as f64;
    let is_cut = count >= LEAST && mean > EXCESS * fit.noise[channel / 3];
    is_cut.then_some(level / count as f64)
}

/// Says where readings are cut.
pub(crate) fn words(recorded: &Recorded, channel: usize, level: f64, range: Option<f64>) -> String {
    format!(
        "{}: the load by all other rows would read more there. {:.1} % of the rows were left out. {CHECK}",
        begin(recorded, (channel, level), range),
        100.0 * recorded.left_out()
    )
}

/// Says that a channel is cut in most poses.
pub(crate) fn poses_words(
    recorded: &Recorded,
    cut: (usize, f64),
    range: Option<f64>,
    poses: usize,
) -> String {
    format!(
        "{}: the load by the five other channels would read more in {poses} of {} poses. {CHECK}",
        begin(recorded, cut, range),
        recorded.rows()
    )
}

/// What to do about readings that are cut.
const CHECK: &str = "Check the amplifier, and the range that is set in the sensor.";

fn begin(recorded: &Recorded, (channel, level): (usize, f64), range: Option<f64>) -> String {
    let unit = if channel < 3 { "N" } else { "N·m" };
    let described = range.map_or_else(String::new, |range| {
        format!(
            ", below the described range of {} {unit}",
            format_significant(range, 4)
        )
    });
    format!(
        "{}: the readings of {} are cut at about {} {unit}{described}",
        recorded.label,
        WRENCH_COLUMNS[channel],
        format_significant(level, 3),
    )
}
