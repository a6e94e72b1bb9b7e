//! Whole periods of a periodic reference.
//!
//! After the first period, in which the joint settles, the periods of a multisine differ by noise alone. Their mean is
//! transformed over exactly one period: no leakage, and signal at the harmonics of the reference only. The scatter of the periods
//! is the noise; what their mean holds at the harmonics that the reference leaves out is distortion by something nonlinear, of
//! odd order at odd harmonics and of even order at even ones (Pintelon & Schoukens 2012, ch. 4).

use serde::Serialize;

use super::bin::{Bin, EXCITED};
use super::two_mass::{C, TwoMass};

/// Rows that must repeat before a period is looked at further.
const TEMPLATE: usize = 128;
/// Difference of repeated references over their range.
const SAME: f64 = 1e-6;
/// Fewest whole periods: one to settle, and two whose difference is noise.
const FEWEST: usize = 3;
/// Fewest harmonics that the reference must hold.
const HARMONICS: usize = 96;
/// Amplitude of a harmonic over that of its neighbours from which on the reference holds it.
const HELD: f64 = 0.1;
/// Neighbours of a harmonic on either side.
const NEIGHBOURS: usize = 4;

/// Whole periods of one stretch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Periods {
    /// First row of the first period that counts.
    pub(super) first: usize,
    /// Rows of a period.
    pub(super) length: usize,
    pub(super) count: usize,
}

/// What whole periods of a reference show beside the response.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Periodic {
    /// Period, s.
    pub period: f64,
    /// Periods that were averaged, over all recordings.
    pub periods: usize,
    /// Harmonics of the reference.
    pub harmonics: usize,
    /// Noise of the mean velocity per harmonic, over the velocity (RMS).
    pub noise: f64,
    /// Distortion of odd order in the mean velocity per harmonic, noise included, over the velocity (RMS).
    pub odd: Option<f64>,
    /// The same of even order.
    pub even: Option<f64>,
}

/// Harmonics of one stretch.
#[derive(Clone, Debug, Default)]
pub(super) struct Harmonics {
    /// Means over the periods, at the harmonics that the reference holds.
    pub(super) held: Vec<Bin>,
    /// The same at other harmonics between them, and whether their order is odd.
    other: Vec<(Bin, bool)>,
    /// Each period less the mean, at the harmonics that the reference holds.
    scatter: Vec<Bin>,
    count: usize,
}

/// Finds the whole periods of a reference; `None` if it does not repeat itself.
pub(super) fn periods_of(reference: &[f64]) -> Option<Periods> {
    let n = reference.len();
    let origin = *reference.first()?;
    let most = (reference.iter()).fold(0.0, |m: f64, v| m.max((v - origin).abs()));
    let same = |a: usize, b: usize| (reference[a] - reference[b]).abs() <= SAME * most;
    // Behind the rise, with most of the recording to come.
    let from = n / 3;
    let room = n.checked_sub(from + TEMPLATE)?;
    if (from..from + TEMPLATE).all(|row| same(row, from)) {
        return None;
    }
    let repeats = |length: usize| (from..from + TEMPLATE).all(|row| same(row, row + length));
    let length = (TEMPLATE..room).find(|length| {
        let whole = (from + length).min(n - length);
        repeats(*length) && (from..whole).all(|row| same(row, row + length))
    })?;
    let mut low = from;
    while low > 0 && same(low - 1, low - 1 + length) {
        low -= 1;
    }
    let mut high = from;
    while high + length < n && same(high, high + length) {
        high += 1;
    }
    let count = (high + length - low) / length;
    (count >= FEWEST).then(|| Periods {
        first: low + length,
        length,
        count: count - 1,
    })
}

/// Divides the transforms of single periods, in the same order of frequency, into the harmonics of the reference and others.
/// `None` if the reference holds too few.
pub(super) fn harmonics(periods: &[Vec<Bin>]) -> Option<Harmonics> {
    let count = periods.len() as f64;
    let bins = periods.first()?.len();
    let mean: Vec<Bin> = (0..bins)
        .map(|k| {
            let each = periods.iter().map(|period| period[k]);
            each.reduce(|a, b| a.zip(&b, |x, y| x + y))
                .unwrap_or_default()
                .map(|x| x / count)
        })
        .collect();
    let size = |k: usize| mean[k].instrument.norm();
    let fast = |k: usize| size(k) * mean[k].omega.powi(2);
    let fastest = (0..bins).map(fast).fold(0.0, f64::max);
    let held = |k: usize| {
        let near = k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(bins);
        size(k) > HELD * near.map(size).fold(0.0, f64::max) && fast(k) > EXCITED * fastest
    };
    let mut all = Harmonics {
        count: periods.len(),
        ..Harmonics::default()
    };
    let lines: Vec<usize> = (0..bins).filter(|k| held(*k)).collect();
    let (first, last) = (*lines.first()?, *lines.last()?);
    for k in first..=last {
        match lines.binary_search(&k) {
            Ok(_) => {
                all.held.push(mean[k]);
                let scatter = periods
                    .iter()
                    .map(|period| period[k].zip(&mean[k], |x, m| x - m));
                all.scatter.extend(scatter);
            }
            // The first bin is the first harmonic.
            Err(_) => all.other.push((mean[k], k % 2 == 0)),
        }
    }
    (all.held.len() >= HARMONICS).then_some(all)
}

/// Returns what the periods show, by a model.
pub(super) fn shown(
    all: &[Harmonics],
    periods: &[Periods],
    rate: f64,
    model: &TwoMass,
) -> Option<Periodic> {
    let first = periods.first()?;
    let held: Vec<&Bin> = all.iter().flat_map(|own| &own.held).collect();
    let power = held.iter().map(|bin| bin.velocity.norm_sqr()).sum::<f64>() / held.len() as f64;
    let left = |bin: &Bin| -> C { bin.velocity - model.recorded(bin.omega) * bin.torque };
    let rms = |squares: Vec<f64>| {
        let count = squares.len() as f64;
        (count > 0.0).then(|| (squares.iter().sum::<f64>() / count / power).sqrt())
    };
    let other = |odd: bool| {
        let bins = all.iter().flat_map(|own| &own.other);
        rms(bins
            .filter(|(_, own)| *own == odd)
            .map(|(bin, _)| left(bin).norm_sqr())
            .collect())
    };
    // Variance of a mean from the scatter about it.
    let noise = all.iter().flat_map(|own| {
        let count = own.count as f64;
        (own.scatter.iter()).map(move |bin| left(bin).norm_sqr() / (count - 1.0))
    });
    Some(Periodic {
        period: first.length as f64 / rate,
        periods: periods.iter().map(|own| own.count).sum(),
        harmonics: all.first()?.held.len(),
        noise: rms(noise.collect())?,
        odd: other(true),
        even: other(false),
    })
}
