//! A channel that is cut within the described range in some poses at rest: its readings follow the load up to a limit.
//!
//! The five other channels give the load in every pose, and so what the channel would read. The readings are compared with
//! these values between two limits, so a channel may be cut in more than half of the poses.

use crate::causes::{Compared, score};
use crate::mounting::Mounting;
use crate::settle::{DECISIVE, settled};
use crate::statistics::Recorded;
use crate::system::{Fit, Nuisance, Sensed, Unknowns};

/// Least number of poses at a limit: one reading shows none.
const LEAST: usize = 2;

/// A channel that is cut in some poses of one recording.
#[derive(Clone, Debug)]
pub(crate) struct CutChannel {
    /// Index of the recording.
    pub recording: usize,
    /// The channel.
    pub channel: usize,
    /// Its mean reading where it is cut, at the limit with more poses.
    pub level: f64,
    /// Numbers of the cut poses among those of the recording.
    pub poses: Vec<usize>,
    /// Score of the readings with these limits.
    pub score: f64,
}

/// Finds the channel whose limits explain the readings decisively better than the description and every cause do.
pub(crate) fn cut_channel(sensed: &Sensed, compared: &Compared) -> Option<CutChannel> {
    let described = &compared.described;
    let fit = &described.selected.fit;
    let is_listed = |recorded: &Recorded| recorded.poses && recorded.is_sampled();
    if sensed.is_exact(fit) || !sensed.recordings.iter().all(is_listed) {
        return None;
    }
    let plain = fit.unknowns.plain();
    // A gain is that of a channel in the sensor's own axes, so none is estimated beside a turned sensor.
    let beside = fit.unknowns.without(Nuisance::Rotation);
    let mut tried: Vec<(&Mounting, &Unknowns)> = vec![(&described.start, &plain)];
    if beside != plain {
        tried.push((&fit.mounting, &beside));
    }
    let mut best = (compared.least() - DECISIVE, None);
    for (mounting, unknowns) in tried {
        for channel in 0..6 {
            let without = settled(sensed, &mounting.with_gain(channel, 0.0), unknowns);
            for recording in 0..sensed.recordings.len() {
                let own = limited(sensed, &without, recording, channel);
                let Some(own) = own.filter(|own| own.score < best.0) else {
                    continue;
                };
                best = (own.score, Some(own));
            }
        }
    }
    best.1
}

/// Returns the best limits of a channel in one recording; `fit` is that of the five other channels.
fn limited(sensed: &Sensed, fit: &Fit, recording: usize, channel: usize) -> Option<CutChannel> {
    let full = Fit {
        mounting: fit.mounting.with_gain(channel, 1.0),
        ..fit.clone()
    };
    let readings = |r: usize| {
        let rows = sensed.recordings[r].sample.iter();
        rows.map(move |row| (row, row.readings[channel]))
    };
    let mut limited = fit.clone();
    let mut squares = 0.0;
    let mut found = None;
    for r in 0..sensed.recordings.len() {
        let mut pairs: Vec<(f64, f64, usize)> = readings(r)
            .enumerate()
            .map(|(k, (row, read))| (sensed.predicted(&full, r, row)[channel], read, k))
            .collect();
        // What the fit without the channel leaves of it.
        squares -= readings(r)
            .map(|(row, read)| (read - sensed.predicted(fit, r, row)[channel]).powi(2))
            .sum::<f64>();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let limits = match r == recording {
            true => {
                let limits = Limits::of(&pairs)?;
                found = Some(limits.cut(&pairs, recording, channel));
                limits
            }
            false => Limits::none(&pairs),
        };
        squares += limits.squares;
        limited.values.extend(vec![0.0; limits.sides()]);
    }
    let kind = channel / 3;
    limited.squares[kind] += squares;
    if limited.squares[kind] <= 0.0 {
        return None;
    }
    Some(CutChannel {
        score: score(sensed, &limited),
        ..found?
    })
}

/// Limits of a channel: readings of the first and of the last poses, ordered by what the load would read, are constant.
struct Limits {
    /// Poses at the lower limit, and all before those at the upper one.
    ends: [usize; 2],
    count: usize,
    squares: f64,
}

impl Limits {
    /// Returns the limits that leave least; `None` if no limits leave what is cut beyond them.
    fn of(pairs: &[(f64, f64, usize)]) -> Option<Self> {
        let count = pairs.len();
        let sums = |value: &dyn Fn(&(f64, f64, usize)) -> f64| {
            let mut all = vec![[0.0; 2]];
            for pair in pairs {
                let ([sum, squares], own) = (all[all.len() - 1], value(pair));
                all.push([sum + own, squares + own * own]);
            }
            all
        };
        let [read, differ] = [sums(&|pair| pair.1), sums(&|pair| pair.1 - pair.0)];
        let would = sums(&|pair| pair.0);
        // Mean and squares about it, from one place to another.
        let about = |sums: &[[f64; 2]], from: usize, to: usize| {
            let [sum, squares] = [0, 1].map(|k| sums[to][k] - sums[from][k]);
            let mean = sum / (to - from).max(1) as f64;
            (mean, (squares - sum * mean).max(0.0))
        };
        let mut least: Option<Self> = None;
        for low in (0..count).filter(|low| *low == 0 || *low >= LEAST) {
            for high in (low + 1..=count).filter(|high| count - high == 0 || count - high >= LEAST)
            {
                if low == 0 && high == count {
                    continue;
                }
                let (bias, middle) = about(&differ, low, high);
                let ends = [(0, low, -1.0), (high, count, 1.0)];
                let mut squares = middle;
                let mut is_beyond = true;
                for (from, to, outwards) in ends.into_iter().filter(|(from, to, _)| to > from) {
                    let (level, own) = about(&read, from, to);
                    let (mean, _) = about(&would, from, to);
                    squares += own;
                    is_beyond &= outwards * (mean + bias - level) > 0.0;
                }
                if is_beyond && least.as_ref().is_none_or(|own| squares < own.squares) {
                    least = Some(Self {
                        ends: [low, high],
                        count,
                        squares,
                    });
                }
            }
        }
        least
    }

    /// Returns what is left without limits.
    fn none(pairs: &[(f64, f64, usize)]) -> Self {
        let differ: Vec<f64> = pairs.iter().map(|pair| pair.1 - pair.0).collect();
        Self {
            ends: [0, pairs.len()],
            count: pairs.len(),
            squares: rig_numerics::statistics::squares_about_mean(&differ),
        }
    }

    /// Returns the number of limits.
    fn sides(&self) -> usize {
        usize::from(self.ends[0] > 0) + usize::from(self.ends[1] < self.count)
    }

    fn cut(&self, pairs: &[(f64, f64, usize)], recording: usize, channel: usize) -> CutChannel {
        let [low, high] = [&pairs[..self.ends[0]], &pairs[self.ends[1]..]];
        let larger = if low.len() > high.len() { low } else { high };
        let sum: f64 = larger.iter().map(|pair| pair.1).sum();
        let mut poses: Vec<usize> = low.iter().chain(high).map(|pair| pair.2).collect();
        poses.sort_unstable();
        CutChannel {
            recording,
            channel,
            level: sum / larger.len() as f64,
            poses,
            score: f64::INFINITY,
        }
    }
}
