//! Filters and decimation between a recording and the rows.

use std::ops::Range;

use rig_shared::lanes::Lanes;

use crate::DiagnoseError;
use crate::rows::lanes::ABREAST;
use rig_data::prepare::{LowPass, PreprocessingPlan, central_difference, second_difference};
use rig_data::runs::Run;

/// Periods of the position filter's cut-off frequency by which the filter may shift a reversal. It rounds the corner
/// where friction changes sign, or stops the joint for a moment.
const SMEAR: f64 = 0.2;

/// Power loss by the position filter at the upper edge of the low-pass above which the filter matters.
const HEARD: f64 = 1e-4;

/// Highest cut-off as a share of half the sample rate, as for the position filter.
const WIDEST: f64 = 0.8;

/// Low-pass and decimation of the torque and of every regressor column.
///
/// The motion has already passed the position filter. The torque has not, and neither has a nonlinear function of the
/// motion, such as the sign of the velocity. These signals pass that filter here. Otherwise both sides of the equation
/// would differ by its loss where its cut-off is near the band of the rows.
///
/// Inertia, gravity and velocity products are not linear in the motion either: M(q)·q̈ of the filtered motion is not
/// the filtered M(q)·q̈. If the filter matters in the band, their columns use a motion behind a [`wide`] filter without
/// loss in the band. Like the torque, they then pass the position filter here.
#[derive(Clone, Debug)]
pub(crate) struct Thinning {
    low_pass: LowPass,
    /// The position filter.
    position: LowPass,
    /// True if the position filter removes anything that the low-pass passes.
    filter_matters: bool,
    /// The filter of the motion for link columns, if the position filter matters.
    wide: Option<(f64, LowPass)>,
    step: usize,
    /// Samples with transients of the position filter at either end. They are cut before the low-pass.
    spoilt: usize,
    smear: f64,
}

impl Thinning {
    /// Creates the filters of a treatment.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if a filter cannot be built.
    pub(crate) fn of(treatment: &PreprocessingPlan) -> Result<Self, DiagnoseError> {
        let low_pass = treatment
            .parallel_low_pass()
            .ok_or_else(|| DiagnoseError::Model("its low-pass cannot be built.".into()))?;
        let position = treatment.position_filter().ok_or_else(|| {
            DiagnoseError::Model("the filter of its position cannot be built.".into())
        })?;
        // Power loss: the filter runs forward and backward.
        let taken = 1.0
            - position
                .gain(treatment.parallel_edge, treatment.sample_rate)
                .powi(2);
        let filter_matters = taken > HEARD;
        Ok(Self {
            low_pass,
            position,
            filter_matters,
            wide: filter_matters.then(|| wide(treatment)).flatten(),
            step: treatment.decimation.max(1),
            spoilt: treatment.trimmed,
            smear: SMEAR / treatment.cutoff,
        })
    }

    /// Returns the time between rows of a run with this sample rate, s.
    pub(crate) fn period(&self, rate: f64) -> f64 {
        self.step as f64 / rate
    }

    /// Returns the cut-off of the position for link columns, Hz, if it differs from that of the position filter.
    pub(crate) fn links_cutoff(&self) -> Option<f64> {
        self.wide.as_ref().map(|(cutoff, _)| *cutoff)
    }

    /// Returns the motion for link columns, if it differs from the filtered motion.
    pub(crate) fn wide_motion(&self, run: &Run) -> Option<[Vec<Vec<f64>>; 3]> {
        let (_, filter) = self.wide.as_ref()?;
        let step = 1.0 / run.rate;
        let mut motion = [(); 3].map(|()| Vec::with_capacity(run.joints.len()));
        for joint in &run.joints {
            let q = filter.zero_phase(&joint.q_raw);
            motion[1].push(central_difference(&q, step));
            motion[2].push(second_difference(&q, step));
            motion[0].push(q);
        }
        Some(motion)
    }

    /// Returns the time by which the position filter may shift a reversal, s.
    pub(crate) fn smear(&self) -> f64 {
        self.smear
    }

    /// Returns the samples without transients of the position filter, for a run of `samples`.
    fn sound(&self, samples: usize) -> Range<usize> {
        self.spoilt..samples.saturating_sub(self.spoilt).max(self.spoilt)
    }

    /// Returns the time from the start of a run to its first row, s.
    pub(crate) fn trimmed(&self, run: &Run) -> f64 {
        self.spoilt as f64 / run.rate
    }

    /// Returns the kept samples of a run of `samples`.
    pub(crate) fn kept(&self, samples: usize) -> impl Iterator<Item = usize> {
        self.sound(samples).step_by(self.step)
    }

    /// Appends the rows of a full-rate signal to `out`. The signal must be linear in the filtered motion. Samples where
    /// `left_out` is true count as 0 before every filter; an empty `left_out` leaves none out.
    ///
    /// Such a signal has passed the position filter, so that this filter must pass what is left out as well. There the
    /// filtered motion stands for the motion.
    pub(crate) fn push(&self, signal: &[f64], left_out: &[bool], out: &mut Vec<f64>) {
        if left_out.is_empty() {
            self.push_filtered(signal, out);
        } else if self.filter_matters {
            let gone = self.position.zero_phase_even(&only(signal, left_out, true));
            let rest: Vec<f64> = signal.iter().zip(gone).map(|(x, gone)| x - gone).collect();
            self.push_filtered(&rest, out);
        } else {
            self.push_filtered(&only(signal, left_out, false), out);
        }
    }

    /// The same for a signal that has not passed the position filter.
    pub(crate) fn push_raw(&self, signal: &[f64], left_out: &[bool], out: &mut Vec<f64>) {
        let rest = only(signal, left_out, false);
        match self.filter_matters {
            true => self.push_filtered(&self.position.zero_phase_even(&rest), out),
            false => self.push_filtered(&rest, out),
        }
    }

    fn push_filtered(&self, signal: &[f64], out: &mut Vec<f64>) {
        let sound = signal.get(self.sound(signal.len())).unwrap_or_default();
        let smooth = self.low_pass.zero_phase_even(sound);
        out.extend(smooth.into_iter().step_by(self.step));
    }

    /// Applies the position filter, without decimation.
    pub(crate) fn calm(&self, signal: &[f64]) -> Vec<f64> {
        self.position.zero_phase(signal)
    }

    /// Applies the low-pass, without decimation.
    pub(crate) fn smooth(&self, signal: &[f64]) -> Vec<f64> {
        self.low_pass.zero_phase(signal)
    }

    /// Returns the rows of signals of equal length that are linear in the filtered motion. `left_out` is as in
    /// [`Self::push`], signal by signal.
    pub(crate) fn thinned(&self, signals: &[Vec<f64>], left_out: &[&[bool]]) -> Vec<Vec<f64>> {
        self.thinned_abreast(signals, left_out, &|four| {
            if !self.filter_matters || left_out.iter().all(|own| own.is_empty()) {
                return four.only(false);
            }
            let gone = self.position.zero_phase_even(&four.only(true));
            let mut rest = four.all();
            rest.iter_mut().zip(gone).for_each(|(x, gone)| *x -= gone);
            rest
        })
    }

    /// The same for signals that have not passed the position filter.
    pub(crate) fn thinned_raw(&self, signals: &[Vec<f64>], left_out: &[&[bool]]) -> Vec<Vec<f64>> {
        self.thinned_abreast(signals, left_out, &|four| match self.filter_matters {
            true => self.position.zero_phase_even(&four.only(false)),
            false => four.only(false),
        })
    }

    fn thinned_abreast(
        &self,
        signals: &[Vec<f64>],
        left_out: &[&[bool]],
        filtered: &dyn Fn(&Abreast) -> Vec<Lanes<ABREAST>>,
    ) -> Vec<Vec<f64>> {
        let mut thin = Vec::with_capacity(signals.len());
        for (signals, left_out) in signals.chunks(ABREAST).zip(left_out.chunks(ABREAST)) {
            let mut sound = filtered(&Abreast { signals, left_out });
            let range = self.sound(sound.len());
            sound.truncate(range.end);
            sound.drain(..range.start.min(sound.len()));
            let smooth = self.low_pass.zero_phase_even(&sound);
            thin.extend((0..signals.len()).map(|s| {
                let kept = smooth.iter().step_by(self.step);
                kept.map(|row| row.0[s]).collect::<Vec<f64>>()
            }));
        }
        thin
    }

    /// Returns the row of its run that is nearest to a sample; None before the first one.
    pub(crate) fn row_near(&self, sample: usize) -> Option<usize> {
        let past = (sample + self.step / 2).checked_sub(self.spoilt);
        past.map(|past| past / self.step)
    }

    /// Appends the kept samples without the low-pass.
    pub(crate) fn pick(&self, signal: &[f64], out: &mut Vec<f64>) {
        out.extend(self.kept(signal.len()).map(|k| signal[k]));
    }
}

/// Returns the signal with zeros except where `left_out` is `which`. An empty `left_out` is false throughout.
fn only(signal: &[f64], left_out: &[bool], which: bool) -> Vec<f64> {
    let one = |(k, x): (usize, &f64)| match is_out(left_out, k) == which {
        true => *x,
        false => 0.0,
    };
    signal.iter().enumerate().map(one).collect()
}

fn is_out(left_out: &[bool], sample: usize) -> bool {
    left_out.get(sample).copied().unwrap_or(false)
}

/// Up to [`ABREAST`] signals of equal length side by side.
struct Abreast<'s> {
    signals: &'s [Vec<f64>],
    left_out: &'s [&'s [bool]],
}

impl Abreast<'_> {
    fn lanes(&self, value: impl Fn(usize, usize) -> f64) -> Vec<Lanes<ABREAST>> {
        let lane = |s: usize, k: usize| {
            if s < self.signals.len() {
                value(s, k)
            } else {
                0.0
            }
        };
        (0..self.signals[0].len())
            .map(|k| Lanes(std::array::from_fn(|s| lane(s, k))))
            .collect()
    }

    fn all(&self) -> Vec<Lanes<ABREAST>> {
        self.lanes(|s, k| self.signals[s][k])
    }

    /// The same as [`only`].
    fn only(&self, which: bool) -> Vec<Lanes<ABREAST>> {
        self.lanes(|s, k| {
            if is_out(self.left_out[s], k) == which {
                self.signals[s][k]
            } else {
                0.0
            }
        })
    }
}

/// Returns a position filter with a power loss of at most [`HEARD`] at the upper band edge, as far as the sampling
/// allows. A Butterworth filter of order n, forward and backward, loses the power share 2·(f/cut-off)²ⁿ.
fn wide(treatment: &PreprocessingPlan) -> Option<(f64, LowPass)> {
    let rate = treatment.sample_rate;
    let order = treatment.order;
    let share = (0.5 * HEARD).powf(0.5 / order as f64);
    let cutoff = (treatment.parallel_edge / share).min(WIDEST * 0.5 * rate);
    (cutoff > treatment.cutoff)
        .then(|| LowPass::butterworth(order, cutoff, rate))
        .flatten()
        .map(|filter| (cutoff, filter))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
impl Thinning {
    /// Creates filters for rows that are samples.
    pub(crate) fn of_rows() -> Self {
        let low_pass = || LowPass::butterworth(2, 0.1, 1.0).unwrap();
        Self::of_filters(low_pass(), low_pass(), false, 1)
    }

    /// Creates rows `step` samples apart behind these filters.
    pub(crate) fn of_filters(
        low_pass: LowPass,
        position: LowPass,
        filter_matters: bool,
        step: usize,
    ) -> Self {
        Self {
            low_pass,
            position,
            filter_matters,
            wide: None,
            step,
            spoilt: 0,
            smear: 0.0,
        }
    }
}
