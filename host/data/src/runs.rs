//! Recordings as the diagnosis works on them: whole stretches in memory, filtered and differentiated.

use std::borrow::Cow;
use std::ops::Range;

use rig_shared::safety::Mode;

use super::past::Past;
use crate::Block;
use crate::prepare::PrepareError;
use crate::prepare::{LowPass, Recording, central_difference, second_difference};

/// Variance of a torque's reading by its third differences over that by its second ones from which it counts as white: of white noise
/// they are equal, and a filter makes it less. Noise that rises with the frequency, as a controller answers that of a position, counts as
/// white, too, and then what is said to lie in the rows' band is more than does.
const STILL_WHITE: f64 = 0.96;

/// One joint over a stretch, at the recording's own rate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointRun {
    /// Position as recorded, rad or m.
    pub q_raw: Vec<f64>,
    /// Torque, joint-side, N·m or N, less [`Self::taken_off`]; empty where there is none.
    pub tau: Vec<f64>,
    /// What of the recorded torque is that of effects that the recording was freed of, where there are any.
    pub taken_off: Option<Vec<f64>>,
    /// Of a torque that was moved in time, which smooths it: what the recorded one differed by from sample to sample.
    pub differences: Option<Differences>,
    /// Filtered position.
    pub q: Vec<f64>,
    /// Velocity, rad/s or m/s.
    pub qd: Vec<f64>,
    /// Acceleration, rad/s² or m/s².
    pub qdd: Vec<f64>,
    /// Velocity as recorded, where it is; nothing is computed from it.
    pub measured_velocity: Option<Vec<f64>>,
    /// Reference position, where recorded.
    pub reference: Option<Vec<f64>>,
    /// Motor voltage, where recorded, V.
    pub voltage: Option<Vec<f64>>,
    /// Temperature, where recorded, °C.
    pub temperature: Option<Vec<f64>>,
    /// What an encoder on the link's side of the transmission reads, where recorded, rad or m, its zero where the joint's own
    /// has it.
    pub link_raw: Option<Vec<f64>>,
    /// The link's position: the filtered one less what is read across the transmission in its band; with velocity and
    /// acceleration.
    pub link: Option<[Vec<f64>; 3]>,
}

/// Sums of the squares of a signal's second and third differences, over so many places.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Differences {
    /// Second differences, squared.
    pub second: f64,
    /// Third differences, squared.
    pub third: f64,
    /// Places.
    pub count: usize,
}

impl Differences {
    /// Those of a signal.
    pub fn of(signal: &[f64]) -> Self {
        let mut sums = Self::default();
        for w in signal.windows(4) {
            sums.second += (w[0] - 2.0 * w[1] + w[2]).powi(2);
            sums.third += (w[0] - 3.0 * w[1] + 3.0 * w[2] - w[3]).powi(2);
            sums.count += 1;
        }
        sums
    }

    /// [`Self::variance`] of a reading that nothing has filtered; none of another.
    pub fn white(&self) -> Option<f64> {
        let before = self.second / 6.0 / self.count.max(1) as f64;
        (self.variance() > STILL_WHITE * before && self.count > 0).then(|| self.variance())
    }

    /// Variance of what a sample's reading has by itself, of the signal's unit squared: a smooth signal leaves nothing in third
    /// differences, white noise 20 times its variance. 0 of none.
    pub fn variance(&self) -> f64 {
        self.third / 20.0 / self.count.max(1) as f64
    }
}

/// A stretch of a recording without a gap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Name of the recording.
    pub label: String,
    /// Which of the recordings given, from 0.
    pub recording: usize,
    /// Hz
    pub rate: f64,
    /// When the joints began to run, on the clock of `t`, s: the recording's first row, or that of the one it goes on from.
    pub began: f64,
    /// What they did from there on until this stretch.
    pub past: Past,
    /// s
    pub t: Vec<f64>,
    /// Joint by joint.
    pub joints: Vec<JointRun>,
    /// Samples at which the rig says that its drive was off: the motor's voltage is not the inverter's there.
    pub coasting: Vec<Range<usize>>,
    /// Samples that are left out, because something happened in them that is not of the rig.
    pub left_out: Vec<Range<usize>>,
    /// Whether everything that could pull on the joints from outside had been taken off.
    pub unburdened: bool,
}

impl JointRun {
    /// Torque as recorded, whatever it was freed of.
    pub fn recorded(&self) -> Cow<'_, [f64]> {
        match &self.taken_off {
            None => Cow::Borrowed(&self.tau),
            Some(held) => Cow::Owned((self.tau.iter().zip(held)).map(|(t, h)| t + h).collect()),
        }
    }

    /// What the torque as recorded differs by from sample to sample.
    pub fn differences(&self) -> Differences {
        (self.differences).unwrap_or_else(|| Differences::of(&self.recorded()))
    }
}

impl Run {
    /// Samples.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }
}

/// Rows that no two recordings share by chance, of which so many differ from the one before.
const SHARED: (usize, usize) = (64, 16);
/// Places of a recording that are looked for in another, and how many of them are found of a piece that both hold: two may begin
/// alike without any noise.
const LOOKED_FOR: (usize, usize) = (8, 3);
/// Share by which the rates of a recording and of its every so manieth sample may be off a whole ratio: rates are medians of
/// intervals.
const RATE_OFF: f64 = 0.01;

/// Two recordings that hold the same samples of position and effort, or every so manieth of a piece of them, by their places among
/// those given.
pub fn copies(runs: &[&Run]) -> Option<(usize, usize)> {
    (0..runs.len()).find_map(|b| {
        let first = (0..b).find(|&a| holds_of(runs[a], runs[b]) || holds_of(runs[b], runs[a]))?;
        Some((first, b))
    })
}

/// Whether a recording holds a piece of another, sample by sample or of more samples than the other was left with.
fn holds_of(whole: &Run, other: &Run) -> bool {
    let (rows, steps) = SHARED;
    let (places, enough) = LOOKED_FOR;
    let ratio = whole.rate / other.rate;
    let stride = ratio.round();
    if stride < 1.0 || (ratio - stride).abs() > RATE_OFF * stride {
        return false;
    }
    let stride = stride as usize;
    let reach = (rows - 1) * stride + 1;
    let room = other.len().saturating_sub(rows);
    let found = |k: &usize| {
        let from = room * k / (places - 1);
        let piece = |signal: &'_ [f64]| signal.get(from..from + rows).map(<[f64]>::to_vec);
        let pieces: Option<Vec<[Vec<f64>; 2]>> = (other.joints.iter())
            .map(|joint| Some([piece(&joint.tau)?, piece(&joint.q_raw)?]))
            .collect();
        let Some(pieces) = pieces else { return false };
        let alive = |part: &[f64]| part.windows(2).filter(|w| w[0] != w[1]).count() >= steps;
        let moves = pieces.iter().any(|[tau, q]| alive(tau) && alive(q));
        moves
            && (0..=whole.len().saturating_sub(reach)).any(|at| {
                let same = |signal: &[f64], piece: &[f64]| {
                    (signal.get(at..at + reach))
                        .is_some_and(|own| own.iter().step_by(stride).eq(piece))
                };
                (whole.joints.iter().zip(&pieces))
                    .all(|(own, [tau, q])| same(&own.tau, tau) && same(&own.q_raw, q))
            })
    };
    (0..places).filter(found).count() >= enough
}

/// Steps of an encoder's count that a step of its reading may be off a whole number of them, as print rounds it.
const OFF_A_COUNT: f64 = 0.25;
/// Most counts in the least step of a reading: a joint that never turns back goes on by some from sample to sample.
const MOST_COUNTS: u32 = 8;
/// Share of the steps of a reading that are whole counts where it has any: of a reading without counts half of them are, of a motion
/// at a few constant speeds those that are multiples of the slowest.
const COUNTED: f64 = 0.95;

/// The least step between two positions of a joint as recorded, rad or m: of an encoder a count. 0 of a joint that never moves, and of a
/// reading whose steps are no whole number of the least, such as one without counts of a joint that never turns back.
pub fn resolution(runs: &[Run], joint: usize) -> f64 {
    let steps = || {
        let raw = runs
            .iter()
            .flat_map(|run| run.joints[joint].q_raw.windows(2));
        raw.map(|pair| (pair[1] - pair[0]).abs())
            .filter(|step| *step > 0.0)
    };
    let least = steps().fold(f64::INFINITY, f64::min);
    // What print has rounded off the least is not in the mean of those like it.
    let alike = || steps().filter(|step| *step < 1.2 * least);
    let mean = alike().sum::<f64>() / alike().count().max(1) as f64;
    let all = steps().count() as f64;
    let counted = |n: &u32| {
        let count = mean / f64::from(*n);
        let off = |step: &f64| (step / count - (step / count).round()).abs();
        steps().filter(|step| off(step) < OFF_A_COUNT).count() as f64 >= COUNTED * all
    };
    let counts = (1..=MOST_COUNTS).find(counted);
    counts
        .filter(|_| least.is_finite())
        .map_or(0.0, |n| least / f64::from(n))
}

/// How far a joint goes, in the RMS, within `time` (s) from a reversal on, rad or m.
pub fn blurred(runs: &[Run], joint: usize, time: f64) -> f64 {
    let (mut squares, mut count) = (0.0, 0_u32);
    for own in runs.iter().map(|run| &run.joints[joint]) {
        for (pair, a) in own.qd.windows(2).zip(&own.qdd) {
            if pair[0] * pair[1] < 0.0 {
                squares += a * a;
                count += 1;
            }
        }
    }
    0.5 * (squares / f64::from(count.max(1))).sqrt() * time * time
}

/// Band of what is read across a transmission, Hz: twist and play are slow beside the steps of two encoders, whose second
/// derivative would be most of the torque that is computed from them.
const ACROSS_BAND: f64 = 25.0;

/// What the difference of a joint's two encoders passes beside the filter of the positions.
pub fn across_band(rate: f64) -> Option<LowPass> {
    LowPass::butterworth(4, f64::min(ACROSS_BAND, 0.2 * rate), rate)
}

/// Reads `recording` stretch by stretch; positions are filtered by `position` (zero phase) and differentiated.
///
/// # Errors
/// What reading gives.
pub fn runs_of(
    recording: &dyn Recording,
    number: usize,
    rate: f64,
    position: &LowPass,
) -> Result<Vec<Run>, PrepareError> {
    let mut gathered = Gathered::new(&recording.label(), number, rate);
    gathered.empty.unburdened = recording.unburdened();
    recording.each_block(65_536, &mut |block| {
        gathered.push(block);
        Ok(())
    })?;
    Ok(gathered.differentiated(position))
}

/// Reads a recording in which nothing moves: positions as they are, without velocity and acceleration.
///
/// # Errors
/// What reading gives.
pub fn at_rest(recording: &dyn Recording) -> Result<Vec<Run>, PrepareError> {
    let mut gathered = Gathered::new(&recording.label(), 0, 0.0);
    recording.each_block(65_536, &mut |block| {
        gathered.push(block);
        Ok(())
    })?;
    let mut runs = gathered.runs;
    for run in &mut runs {
        if let (Some(first), Some(last)) = (run.t.first(), run.t.last()) {
            run.rate = (run.t.len() - 1) as f64 / (last - first).max(f64::MIN_POSITIVE);
        }
        for joint in &mut run.joints {
            joint.q.clone_from(&joint.q_raw);
            joint.qd = vec![0.0; joint.q.len()];
            joint.qdd.clone_from(&joint.qd);
        }
    }
    Ok(runs)
}

/// [`runs_of`] over blocks that are there.
///
/// # Errors
/// Those of the blocks.
pub fn runs_of_blocks(
    blocks: impl Iterator<Item = Result<Block, PrepareError>>,
    label: &str,
    number: usize,
    rate: f64,
    position: &LowPass,
) -> Result<Vec<Run>, PrepareError> {
    let mut gathered = Gathered::new(label, number, rate);
    for block in blocks {
        gathered.push(block?);
    }
    Ok(gathered.differentiated(position))
}

/// Stretches as they are read.
struct Gathered {
    empty: Run,
    runs: Vec<Run>,
}

impl Gathered {
    fn new(label: &str, recording: usize, rate: f64) -> Self {
        Self {
            empty: Run {
                label: label.to_owned(),
                recording,
                rate,
                ..Run::default()
            },
            runs: Vec::new(),
        }
    }

    fn push(&mut self, block: Block) {
        if let (true, Some(first)) = (self.runs.is_empty(), block.t.first()) {
            self.empty.began = *first;
        }
        if !block.continues || self.runs.is_empty() {
            self.runs.push(Run {
                joints: vec![JointRun::default(); block.joints.len()],
                ..self.empty.clone()
            });
        }
        if let Some(run) = self.runs.last_mut() {
            append(run, block);
        }
    }

    fn differentiated(self, position: &LowPass) -> Vec<Run> {
        let mut runs = self.runs;
        zero(&mut runs);
        for run in &mut runs {
            let band = across_band(run.rate);
            for joint in &mut run.joints {
                joint.q = position.zero_phase(&joint.q_raw);
                joint.qd = central_difference(&joint.q, 1.0 / run.rate);
                joint.qdd = second_difference(&joint.q, 1.0 / run.rate);
                joint.link = joint
                    .link_raw
                    .as_ref()
                    .zip(band.as_ref())
                    .map(|(raw, band)| {
                        let apart: Vec<f64> =
                            joint.q_raw.iter().zip(raw).map(|(a, b)| a - b).collect();
                        let apart = band.zero_phase(&position.zero_phase(&apart));
                        let q: Vec<f64> = joint.q.iter().zip(&apart).map(|(q, x)| q - x).collect();
                        let qd = central_difference(&q, 1.0 / run.rate);
                        let qdd = second_difference(&q, 1.0 / run.rate);
                        [q, qd, qdd]
                    });
            }
        }
        runs
    }
}

/// Moves the zero of the encoders on the links to that of the joints' own, on average over the recording: the model's gravity
/// is to be taken where the link is.
fn zero(runs: &mut [Run]) {
    let joints = runs.first().map_or(0, |run| run.joints.len());
    for j in 0..joints {
        let both = |joint: &JointRun| -> Option<(f64, usize)> {
            let link = joint.link_raw.as_ref()?;
            let apart = joint.q_raw.iter().zip(link).map(|(q, l)| q - l);
            Some((apart.sum(), link.len()))
        };
        let (sum, count) = (runs.iter())
            .filter_map(|run| both(&run.joints[j]))
            .fold((0.0, 0), |(s, n), (sum, count)| (s + sum, n + count));
        let offset = sum / count.max(1) as f64;
        for run in runs.iter_mut() {
            let readings = run.joints[j].link_raw.iter_mut().flatten();
            readings.for_each(|l| *l += offset);
        }
    }
}

fn append(run: &mut Run, block: Block) {
    fn join(to: &mut Option<Vec<f64>>, from: Option<Vec<f64>>, before: usize) {
        match (to.as_mut(), from) {
            (Some(to), Some(from)) => to.extend(from),
            (None, Some(from)) if before == 0 => *to = Some(from),
            _ => *to = None,
        }
    }
    let before = run.t.len();
    let modes = block.extra.iter().find(|(name, _)| name == "mode");
    for (k, mode) in modes
        .iter()
        .flat_map(|(_, values)| values.iter().enumerate())
    {
        if *mode != f64::from(Mode::Disarmed as u8) {
            continue;
        }
        let sample = before + k;
        match run.coasting.last_mut() {
            Some(last) if last.end == sample => last.end += 1,
            _ => run.coasting.push(sample..sample + 1),
        }
    }
    run.t.extend(block.t);
    for (to, from) in run.joints.iter_mut().zip(block.joints) {
        to.q_raw.extend(from.q);
        match &from.effects {
            Some(known) => {
                (to.tau).extend(from.tau.iter().zip(known).map(|(all, held)| all - held))
            }
            None => to.tau.extend(from.tau),
        }
        join(&mut to.taken_off, from.effects, before);
        join(&mut to.measured_velocity, from.qd, before);
        join(&mut to.reference, from.reference, before);
        join(&mut to.voltage, from.voltage, before);
        join(&mut to.temperature, from.temperature, before);
        join(&mut to.link_raw, from.link, before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint that speeds up without ever turning back, 1 to 3 rad/s at 500 Hz, and the same as an encoder of 8192 counts reads it
    /// and a file of six decimals holds it.
    #[test]
    fn a_joint_that_never_turns_back_has_counts_only_where_it_is_read_in_counts() {
        let read = |of: &dyn Fn(f64) -> f64| {
            let places = (0..5000).map(|k| {
                let t = f64::from(k) / 500.0;
                of(t + 0.1 * t * t)
            });
            let joint = JointRun {
                q_raw: places.collect(),
                ..JointRun::default()
            };
            let run = Run {
                joints: vec![joint],
                ..Run::default()
            };
            resolution(&[run], 0)
        };
        let count = std::f64::consts::TAU / 8192.0;
        let counted = read(&|q| (1e6 * count * (q / count).floor()).round() * 1e-6);
        assert!((counted / count - 1.0).abs() < 2e-3, "{counted} {count}");
        assert_eq!(read(&|q| q), 0.0);
    }
}
