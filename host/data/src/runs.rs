//! Recordings in the form the diagnosis uses: whole stretches in memory, filtered and differentiated.

use std::borrow::Cow;
use std::ops::Range;

use rig_shared::safety::Mode;

use super::block::Block;
use super::prepare::PrepareError;
use super::prepare::{LowPass, Recording, central_difference, second_difference};
use super::thermal_history::ThermalHistory;
use super::unsettled::unsettled;

/// Ratio of the noise variance from third differences to that from second differences above which noise counts as
/// white. White noise has a ratio of 1; a low-pass filter lowers it. Noise that rises with frequency also counts as
/// white, for example a controller's response to position noise. The noise in the band of the rows is then
/// overestimated.
const STILL_WHITE: f64 = 0.96;

/// One joint over a stretch, at the recording's own rate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointRun {
    /// Position as recorded, rad or m.
    pub q_raw: Vec<f64>,
    /// Joint-side torque, N·m or N, without [`Self::taken_off`]; empty if no torque was recorded.
    pub tau: Vec<f64>,
    /// Torque of the effects that were subtracted from the recorded torque, if any.
    pub taken_off: Option<Vec<f64>>,
    /// Differences of the recorded torque, if the torque was shifted in time (the shift smooths it).
    pub differences: Option<Differences>,
    /// Filtered position.
    pub q: Vec<f64>,
    /// Velocity, rad/s or m/s.
    pub qd: Vec<f64>,
    /// Acceleration, rad/s² or m/s².
    pub qdd: Vec<f64>,
    /// Velocity as recorded, if it was; no other column is computed from it.
    pub measured_velocity: Option<Vec<f64>>,
    /// Reference position, where recorded.
    pub reference: Option<Vec<f64>>,
    /// Motor voltage, where recorded, V.
    pub voltage: Option<Vec<f64>>,
    /// Temperature, where recorded, °C.
    pub temperature: Option<Vec<f64>>,
    /// Reading of the encoder on the link side of the transmission, if recorded, rad or m. Its zero is that of the
    /// joint's own encoder.
    pub link_raw: Option<Vec<f64>>,
    /// Link position, velocity and acceleration. The position is `q` minus the filtered difference of the two encoders.
    pub link: Option<[Vec<f64>; 3]>,
}

/// Sums of the squared second and third differences of a signal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Differences {
    /// Sum of the squared second differences.
    pub second: f64,
    /// Sum of the squared third differences.
    pub third: f64,
    /// Number of differences in each sum.
    pub count: usize,
}

impl Differences {
    /// Computes the sums for a signal.
    pub fn of(signal: &[f64]) -> Self {
        let mut sums = Self::default();
        for w in signal.windows(4) {
            sums.second += (w[0] - 2.0 * w[1] + w[2]).powi(2);
            sums.third += (w[0] - 3.0 * w[1] + 3.0 * w[2] - w[3]).powi(2);
            sums.count += 1;
        }
        sums
    }

    /// Returns [`Self::variance`] if the noise is white, that is, if no filter has acted on the reading.
    pub fn white(&self) -> Option<f64> {
        let before = self.second / 6.0 / self.count.max(1) as f64;
        (self.variance() > STILL_WHITE * before && self.count > 0).then(|| self.variance())
    }

    /// Returns the noise variance of a single sample, in the signal's unit squared; 0 without differences. Third
    /// differences of a smooth signal vanish; those of white noise have 20 times its variance.
    pub fn variance(&self) -> f64 {
        self.third / 20.0 / self.count.max(1) as f64
    }
}

/// A stretch of a recording without a gap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Name of the recording.
    pub label: String,
    /// Index of the recording among those given, from 0.
    pub recording: usize,
    /// Hz
    pub rate: f64,
    /// Start of the session on the clock of `t`, s: first row of this recording or of the one that it continues.
    pub began: f64,
    /// Motion of the joints from the start of the session to this stretch.
    pub thermal_history: ThermalHistory,
    /// s
    pub t: Vec<f64>,
    /// One entry per joint.
    pub joints: Vec<JointRun>,
    /// Samples with the drive off: the motor voltage is then not the inverter's.
    pub coasting: Vec<Range<usize>>,
    /// Samples to leave out, because they contain an event that does not come from the rig.
    pub left_out: Vec<Range<usize>>,
    /// True if all external loads on the joints had been removed.
    pub unburdened: bool,
}

impl JointRun {
    /// Returns the torque as recorded, with the effects in [`Self::taken_off`] added again.
    pub fn recorded(&self) -> Cow<'_, [f64]> {
        match &self.taken_off {
            None => Cow::Borrowed(&self.tau),
            Some(held) => Cow::Owned((self.tau.iter().zip(held)).map(|(t, h)| t + h).collect()),
        }
    }

    /// Returns the differences of the torque as recorded.
    pub fn differences(&self) -> Differences {
        (self.differences).unwrap_or_else(|| Differences::of(&self.recorded()))
    }
}

impl Run {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Returns true if there are no samples.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }
}

/// Rows compared at one place, and minimum number of changes between them. Two recordings do not share these by chance.
const SHARED: (usize, usize) = (64, 16);
/// Number of places of a recording that are searched in another, and how many must be found. One match is not enough:
/// two recordings without noise may start with identical rows.
const LOOKED_FOR: (usize, usize) = (8, 3);
/// Allowed relative deviation of the ratio of two sample rates from a whole number. Rates are medians of intervals.
const RATE_OFF: f64 = 0.01;

/// Finds two recordings that share samples of position and torque, or where one holds every n-th sample of the
/// other. Returns their indices in `runs`.
pub fn copies(runs: &[&Run]) -> Option<(usize, usize)> {
    (0..runs.len()).find_map(|b| {
        let first = (0..b).find(|&a| holds_of(runs[a], runs[b]) || holds_of(runs[b], runs[a]))?;
        Some((first, b))
    })
}

/// Returns true if `whole` contains pieces of `other`, sample by sample or at a rate n times as high.
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

/// Allowed deviation of a position step from a whole number of counts, in counts; allows for rounding in text files.
const OFF_A_COUNT: f64 = 0.25;
/// Largest number of counts assumed in the smallest step: a joint that never reverses may move several counts per
/// sample.
const MOST_COUNTS: u32 = 8;
/// Share of the steps that must be whole counts. Without an encoder count, half of the steps pass by chance. For a
/// motion at a few constant speeds, the multiples of the slowest pass.
const COUNTED: f64 = 0.95;

/// Returns the resolution of a joint's recorded position, rad or m: one encoder count. Returns 0 for a joint that never
/// moves, and if the steps are not multiples of one count (a continuous reading of a joint that never reverses).
pub fn resolution(runs: &[Run], joint: usize) -> f64 {
    let steps = || {
        let raw = runs
            .iter()
            .flat_map(|run| run.joints[joint].q_raw.windows(2));
        raw.map(|pair| (pair[1] - pair[0]).abs())
            .filter(|step| *step > 0.0)
    };
    let least = steps().fold(f64::INFINITY, f64::min);
    // The mean of all steps close to the smallest one averages out the rounding in a text file.
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

/// Returns the distance that a joint moves in the first `time` (s) after a reversal, rad or m: the RMS over the reversals
/// of the recording where it is least. What happens within this distance is seen there, although livelier recordings
/// beside it do not show it.
pub fn blurred(runs: &[Run], joint: usize, time: f64) -> f64 {
    let of_run = |run: &Run| {
        let own = &run.joints[joint];
        let (mut squares, mut count) = (0.0, 0_u32);
        for (pair, a) in own.qd.windows(2).zip(&own.qdd) {
            if pair[0] * pair[1] < 0.0 {
                squares += a * a;
                count += 1;
            }
        }
        (count > 0).then(|| 0.5 * (squares / f64::from(count)).sqrt() * time * time)
    };
    runs.iter()
        .filter_map(of_run)
        .reduce(f64::min)
        .unwrap_or(0.0)
}

/// Returns the travel of a joint since the sample before, rad or m, from its positions and velocities at samples `period` s
/// apart; at the first sample that of its velocity.
pub fn travel([q, qd]: [&[f64]; 2], sample: usize, period: f64) -> f64 {
    let before = sample.checked_sub(1).map(|before| q[before]);
    before.map_or(qd[sample] * period, |before| q[sample] - before)
}

/// Band of the difference between motor-side and link-side encoder, Hz. Twist and backlash are slow compared with the
/// encoder counts. At a higher cut-off, the second derivative of the counts would dominate the computed torque.
const ACROSS_BAND: f64 = 25.0;

/// Returns the filter of the difference between a joint's two encoders, applied in addition to the position filter.
pub fn across_band(rate: f64) -> Option<LowPass> {
    LowPass::butterworth(4, f64::min(ACROSS_BAND, 0.2 * rate), rate)
}

/// Reads `recording` stretch by stretch, filters the positions with `position` (zero phase) and differentiates them.
///
/// # Errors
/// Errors of the reader.
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

/// Reads a recording without motion: positions are not filtered; velocity and acceleration are zero.
///
/// # Errors
/// Errors of the reader.
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

/// Does the same as [`runs_of`] for blocks in memory.
///
/// # Errors
/// Errors of the blocks.
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

/// Stretches collected during reading.
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

/// Shifts the zero of the link encoders to that of the joint encoders, on average over the recording. The gravity model
/// needs the position of the link.
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
    if let Some((_, modes)) = modes {
        let is_off = |mode: &f64| *mode == f64::from(Mode::Disarmed as u8);
        extend_ranges(&mut run.coasting, before, modes.iter().map(is_off));
    }
    extend_ranges(
        &mut run.left_out,
        before,
        unsettled(&block.extra).into_iter(),
    );
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

/// Extends ranges of samples by those that are `true` among the samples from `first` on.
fn extend_ranges(ranges: &mut Vec<Range<usize>>, first: usize, flags: impl Iterator<Item = bool>) {
    for (k, flag) in flags.enumerate() {
        let sample = first + k;
        match ranges.last_mut() {
            _ if !flag => {}
            Some(last) if last.end == sample => last.end += 1,
            _ => ranges.push(sample..sample + 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint accelerates from 1 to 3 rad/s without a reversal, at 500 Hz. One reading is continuous, the other comes
    /// from an encoder of 8192 counts in a file with six decimals.
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

    #[test]
    fn slow_reversals_show_what_lively_ones_beside_them_hide() {
        // Reversals at 40 and at 0.4 rad/s^2, in two recordings.
        let turning = |qdd: f64| Run {
            joints: vec![JointRun {
                qd: (0..9).map(|k| qdd * (f64::from(k) - 4.5)).collect(),
                qdd: vec![qdd; 9],
                ..JointRun::default()
            }],
            ..Run::default()
        };
        let at_rest = Run {
            joints: vec![JointRun {
                qd: vec![0.0; 9],
                qdd: vec![0.0; 9],
                ..JointRun::default()
            }],
            ..Run::default()
        };
        let both = [turning(40.0), turning(0.4), at_rest];
        assert!((blurred(&both[..1], 0, 0.02) - 8e-3).abs() < 1e-12);
        assert!((blurred(&both, 0, 0.02) - 8e-5).abs() < 1e-12);
    }
}
