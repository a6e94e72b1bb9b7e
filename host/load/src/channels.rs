//! The channels of the wrist sensor by themselves: dead, or cut at the end of their range.

use rig_data::WRENCH_COLUMNS;
use rig_data::prepare::Recording;
use rig_model::robot::{Robot, WristSensor};
use rig_output::{format_short, format_significant};

use crate::clipping::{Pile, Suspect};
use crate::error::LoadError;
use crate::frozen::Frozen;
use crate::pace::{Pace, Steps};
use crate::rows::{Ends, FEWEST_ROWS, LEAST_ROWS, each_readings};

/// Consecutive rows at an extreme value that a cut reading shows at least.
const RUN: usize = 5;
/// Ratio to the described range that no sensor reads.
const BEYOND: f64 = 1.1;
/// Width of the neighbourhood of an extreme value, as a share of the channel's range.
const NEIGHBOURHOOD: f64 = 0.02;

/// Most rows of a channel that are looked at as spikes.
const SPIKES: usize = 8;
/// Multiple of the range of all other rows beyond which a reading is a spike: a load that is hit, or a jump of the bias,
/// stays below ten times the range of a motion.
const SPIKE: f64 = 10.0;

/// The highest values of a channel with the lines of their rows, the highest first.
#[derive(Clone, Debug, Default)]
struct Highest(Vec<(f64, u64)>);

impl Highest {
    fn push(&mut self, value: f64, line: u64) {
        let list = &mut self.0;
        if list.len() <= SPIKES || list.last().is_some_and(|(least, _)| value > *least) {
            let place = list.partition_point(|(own, _)| *own >= value);
            list.insert(place, (value, line));
            list.truncate(SPIKES + 1);
        }
    }

    /// Returns the highest value that is no candidate for a spike.
    fn rest(&self) -> Option<f64> {
        self.0.get(SPIKES).map(|(value, _)| *value)
    }
}

/// Returns the rows, and the range of all others, if single rows of a channel are far outside of it.
fn spikes(highest: &[Highest; 2]) -> Option<(Vec<(f64, u64)>, [f64; 2])> {
    let [high, low] = [highest[0].rest()?, -highest[1].rest()?];
    let reach = SPIKE * (high - low);
    let above = highest[0].0.iter().copied();
    let below = highest[1].0.iter().map(|(value, line)| (-value, *line));
    let far = |(value, _): &(f64, u64)| *value > high + reach || *value < low - reach;
    let found: Vec<(f64, u64)> = above.chain(below).filter(far).collect();
    (!found.is_empty()).then_some((found, [low, high]))
}

/// Says which row of a channel is a spike.
fn spike_words(label: &str, c: usize, rows: &[(f64, u64)], range: [f64; 2]) -> String {
    let column = WRENCH_COLUMNS[c];
    let unit = if c < 3 { "N" } else { "N·m" };
    let (value, line) = rows
        .iter()
        .copied()
        .fold((0.0, 0), |worst: (f64, u64), own| {
            if own.0.abs() > worst.0.abs() {
                own
            } else {
                worst
            }
        });
    let more = match rows.len() {
        1 => String::new(),
        n => format!(" (and {} rows more)", n - 1),
    };
    format!(
        "{label}, line {line}: {column} is {} {unit}{more}, and in all other rows it lies within {} and {} {unit}: such a reading is a fault of the sensor or of its line. Remove the row.",
        format_significant(value, 4),
        format_significant(range[0], 4),
        format_significant(range[1], 4)
    )
}

/// What a channel reads over a recording.
#[derive(Clone, Debug)]
struct Channel {
    low: f64,
    high: f64,
    /// Smallest difference of two rows that is not zero.
    step: f64,
    last: [f64; 2],
    /// Sum of the sizes of second differences, and their number.
    roughness: [f64; 2],
    /// Highest values, and highest negative ones.
    highest: [Highest; 2],
}

impl Channel {
    /// Takes in the steps to the next value.
    fn follow(&mut self, value: f64) {
        let [before, last] = self.last;
        let step = (value - last).abs();
        if step > 0.0 {
            self.step = self.step.min(step);
        }
        let bend = (value - 2.0 * last + before).abs();
        if bend.is_finite() {
            self.roughness[0] += bend;
            self.roughness[1] += 1.0;
        }
        self.last = [last, value];
    }

    /// Returns the standard deviation of white noise whose second differences have this mean size.
    fn noise(&self) -> f64 {
        let mean = self.roughness[0] / self.roughness[1].max(1.0);
        mean / (6.0 * std::f64::consts::FRAC_2_PI).sqrt()
    }

    /// Returns the width of the neighbourhood of an extreme value in which readings that were cut lie.
    fn width(&self) -> f64 {
        Pile::width(self.high - self.low, NEIGHBOURHOOD, self.noise())
    }
}

/// Rows at and near an end of a channel.
#[derive(Clone, Copy, Debug, Default)]
struct End {
    at: usize,
    near: usize,
    run: usize,
    /// Distance of the row before the run.
    before: f64,
    /// Rows by which a smaller limit is suspected.
    pile: Pile,
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
    /// How the rows follow each other.
    pub pace: Pace,
    /// True if poses at rest are taken of it, and not every row.
    pub poses: bool,
    /// Time from the first to the last row, s.
    pub length: f64,
    /// Readings beyond which rows are left out.
    pub ends: Ends,
    /// Channels that were cut, with the value.
    pub cut: Vec<(&'static str, f64)>,
    /// Sides of channels whose readings may be cut within the described range.
    pub suspects: Vec<Suspect>,
    /// Says which row of a channel is a spike.
    pub spike: Option<String>,
    /// Says which channels are frozen in a motion, and where.
    pub frozen: Option<String>,
}

/// Finds the ends of the channels: the described range of the sensor, and values at which readings were cut.
///
/// # Errors
/// [`LoadError::Dead`], [`LoadError::NoColumn`].
pub(crate) fn judge(
    recording: &dyn Recording,
    robot: &Robot,
    sensor: &WristSensor,
    poses: bool,
) -> Result<Judged, LoadError> {
    let seen = seen(recording, robot)?;
    let (rows, channels, pace) = (seen.rows, seen.channels, seen.pace);
    if rows < LEAST_ROWS as u64 {
        return Err(LoadError::TooFew {
            rows: rows as usize,
            least: LEAST_ROWS,
        });
    }
    // A short recording of a motion is searched for rests as well: the readings of a motion need its acceleration.
    let poses = poses || pace == Pace::Listed || rows < FEWEST_ROWS as u64;
    refuse_dead(recording, &channels)?;
    let (found, frozen) = counted(recording, &channels)?;
    let reach = channels.each_ref().map(|own| [own.low, own.high]);
    let frozen = (!poses).then(|| frozen.words(&recording.label(), &reach));
    let mut ends = [[f64::NEG_INFINITY, f64::INFINITY]; 6];
    let (mut cut, mut suspects, mut spike) = (Vec::new(), Vec::new(), None);
    for (c, end) in ends.iter_mut().enumerate() {
        let range = if c < 3 {
            sensor.force_range
        } else {
            sensor.moment_range
        };
        if let Some(range) = range {
            *end = [-range, range];
        }
        if let Some((rows, others)) = spikes(&channels[c].highest).filter(|_| !poses) {
            spike.get_or_insert_with(|| spike_words(&recording.label(), c, &rows, others));
            let [low, high] = others;
            let beside = f64::EPSILON * (low.abs() + high.abs());
            *end = [end[0].max(low - beside), end[1].min(high + beside)];
            continue;
        }
        let reach = [channels[c].low, channels[c].high];
        if let Some(range) = range {
            refuse_beyond(recording, &channels, c, (range, sensor))?;
        }
        for side in 0..2 {
            let reached = |range: f64| reach[side].abs() >= range;
            // Rows of one pose repeat a reading, and a reading well inside of the range is none of its ends.
            let is_cut = !poses && found[c][side].is_cut() && range.is_none_or(reached);
            if is_cut || range.is_some_and(reached) {
                cut.push((WRENCH_COLUMNS[c], reach[side]));
            } else if found[c][side].pile.is_heaped() {
                let inwards = if side == 0 { 1.0 } else { -1.0 };
                suspects.push(Suspect {
                    channel: c,
                    side,
                    from: reach[side] + inwards * channels[c].width(),
                });
            }
            if is_cut {
                end[side] = if side == 0 {
                    end[0].max(reach[0])
                } else {
                    end[1].min(reach[1])
                };
            }
        }
    }
    Ok(Judged {
        rows,
        pace,
        poses,
        length: seen.length,
        ends,
        cut,
        suspects,
        spike,
        frozen: frozen.flatten(),
    })
}

/// Counts the rows at and near the ends of each channel, and follows how long each stays on one value.
fn counted(
    recording: &dyn Recording,
    channels: &[Channel; 6],
) -> Result<([[End; 2]; 6], Frozen), LoadError> {
    let (mut found, mut frozen) = ([[End::default(); 2]; 6], Frozen::default());
    let widths = channels.each_ref().map(|channel| {
        let near = (NEIGHBOURHOOD * (channel.high - channel.low)).max(1.5 * channel.step);
        (channel, near, channel.width())
    });
    each_readings(recording, &mut |block, readings| {
        frozen.push(block, readings);
        for k in 0..block.len() {
            let all = found.iter_mut().zip(&widths).zip(readings);
            for ((end, (channel, near, width)), list) in all {
                for (end, distance) in
                    (end.iter_mut()).zip([list[k] - channel.low, channel.high - list[k]])
                {
                    end.push(distance, *near, channel.step);
                    end.pile.push(distance, *width);
                }
            }
        }
        Ok(())
    })?;
    Ok((found, frozen))
}

/// Refuses a channel that has one value throughout.
fn refuse_dead(recording: &dyn Recording, channels: &[Channel; 6]) -> Result<(), LoadError> {
    let mut all = channels.iter().zip(WRENCH_COLUMNS);
    match all.find(|(channel, _)| channel.low == channel.high) {
        Some((channel, column)) => Err(LoadError::Dead {
            label: recording.label(),
            column,
            value: channel.low,
        }),
        None => Ok(()),
    }
}

/// Says that the columns of all forces hold the moments.
pub(crate) const KINDS_EXCHANGED: &str = "fx fy fz are exchanged with mx my mz";

/// Units whose numbers are larger than those in N or N·m, with the factor.
const SMALL_UNITS: [&[(&str, f64)]; 2] = [&[("mN", 1e3)], &[("N·mm", 1e3), ("N·cm", 1e2)]];
/// Least share of its range that a sensor is used with: a unit is named only if the load is as large in it.
const LEAST_USED: f64 = 0.01;
/// Ratio to the described range beyond which no load is meant: the electronics of a sensor end before.
const OVERLOADED: f64 = 10.0;
/// Distance of the centre of mass from the sensor that no load has, m.
const FARTHEST: f64 = 3.0;

/// Returns true if forces and moments are within the ranges only if they are exchanged, and the load as recorded would be
/// farther away than any.
fn kinds_exchanged(channels: &[Channel; 6], sensor: &WristSensor) -> bool {
    let [Some(force), Some(moment)] = [sensor.force_range, sensor.moment_range] else {
        return false;
    };
    let of = |kind: usize, size: &dyn Fn(&Channel) -> f64| {
        let own = &channels[3 * kind..3 * kind + 3];
        own.iter().map(size).fold(0.0, f64::max)
    };
    let reach = |channel: &Channel| channel.high.abs().max(channel.low.abs());
    let span = |channel: &Channel| channel.high - channel.low;
    let is_far = of(1, &span) > FARTHEST * of(0, &span);
    is_far && of(0, &reach) <= moment && of(1, &reach) <= force
}

/// Refuses a channel that reads what the sensor does not measure.
///
/// # Errors
/// [`LoadError::Fault`] with what may be meant.
fn refuse_beyond(
    recording: &dyn Recording,
    channels: &[Channel; 6],
    c: usize,
    (range, sensor): (f64, &WristSensor),
) -> Result<(), LoadError> {
    let Channel { low, high, .. } = channels[c];
    let value = if low.abs() > high.abs() { low } else { high };
    if value.abs() <= BEYOND * range {
        return Ok(());
    }
    let unit = if c < 3 { "N" } else { "N·m" };
    let ratio = value.abs() / range;
    let mut causes = Vec::new();
    if kinds_exchanged(channels, sensor) {
        causes.push(format!("{KINDS_EXCHANGED}: exchange these columns"));
    } else {
        if ratio <= OVERLOADED {
            causes.push("the load exceeds the range of the sensor".to_owned());
        }
        let units = SMALL_UNITS[c / 3].iter();
        let units = units.filter(|(_, factor)| (LEAST_USED..1.0).contains(&(ratio / factor)));
        causes.extend(units.map(|(name, _)| format!("the column looks like {name}")));
        causes.push("the range in [wrist_sensor] is wrong".to_owned());
    }
    Err(LoadError::Fault(format!(
        "{} reaches {} in {}, but the range of the sensor is {} {unit}: {}.",
        WRENCH_COLUMNS[c],
        format_significant(value, 4),
        recording.label(),
        format_short(range),
        causes.join(", or ")
    )))
}

/// What one pass over a recording tells.
struct Seen {
    rows: u64,
    /// Time from the first to the last row, s.
    length: f64,
    channels: [Channel; 6],
    pace: Pace,
}

/// Returns rows, length, pace and the range of each channel.
fn seen(recording: &dyn Recording, robot: &Robot) -> Result<Seen, LoadError> {
    let mut channels: [Channel; 6] = std::array::from_fn(|_| Channel {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
        step: f64::INFINITY,
        last: [f64::NAN; 2],
        roughness: [0.0; 2],
        highest: Default::default(),
    });
    let (mut rows, mut times) = (0u64, [f64::INFINITY, f64::NEG_INFINITY]);
    let mut steps = Steps::of(robot);
    each_readings(recording, &mut |block, readings| {
        rows += block.len() as u64;
        for (k, t) in block.t.iter().enumerate() {
            times = [times[0].min(*t), times[1].max(*t)];
            steps.push(*t, block.joints.iter().map(|joint| joint.q[k]).collect());
        }
        for (channel, list) in channels.iter_mut().zip(readings) {
            for (row, value) in list.iter().enumerate() {
                let line = block.line(row);
                channel.highest[0].push(*value, line);
                channel.highest[1].push(-value, line);
                channel.low = channel.low.min(*value);
                channel.high = channel.high.max(*value);
                channel.follow(*value);
            }
        }
        Ok(())
    })?;
    Ok(Seen {
        rows,
        length: times[1] - times[0],
        channels,
        pace: steps.pace(),
    })
}
