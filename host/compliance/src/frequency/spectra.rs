//! Spectra of torque, velocity and instrument of one joint.
//!
//! A recording that begins and ends at rest is transformed as a whole, without a window: its transform has no leakage,
//! whatever the motion is. Of a periodic reference, the mean over its whole periods is transformed. Other recordings are cut into Hann windows that overlap by half (Welch 1967).

use std::f64::consts::TAU;

use realfft::RealFftPlanner;
use rig_numerics::statistics::{mean, rms};

use super::bin::Bin;
use super::columns::{Columns, columns_of, has_reference, rests};
use super::periodic::{Harmonics, Periodic, Periods, harmonics, periods_of, shown};
use super::two_mass::{C, Gravity, TwoMass};
use crate::error::ComplianceError;
use crate::signals::Signals;

/// Rows per window, at most a quarter of the recording. 8 s at 1 kHz: resolution of 0.12 Hz.
const WINDOW: f64 = 8.0;
/// Fewest rows of a recording.
const FEWEST: usize = 512;

/// All transforms of the recordings of one joint.
#[derive(Clone, Debug, Default)]
pub(crate) struct Spectra {
    /// Sorted by frequency.
    pub bins: Vec<Bin>,
    /// Total length, s.
    pub seconds: f64,
    /// Rows per second.
    pub rate: f64,
    /// Independent averages per bin: 1 for whole recordings; less for windows that overlap.
    pub weight: f64,
    /// True if recordings were transformed as a whole.
    pub whole: bool,
    /// True if the reference is the instrument.
    pub by_reference: bool,
    /// Mean position of every joint.
    pub pose: Vec<f64>,
    /// Rows.
    pub rows: usize,
    /// Time, torque, velocity of the longest stretch, for the figure.
    pub shown: [Vec<f64>; 3],
    columns: Vec<Columns>,
    /// Whole periods of the reference, one entry a stretch; empty if it has none.
    periods: Vec<Periods>,
    /// Harmonics in them.
    harmonics: Vec<Harmonics>,
}

impl Spectra {
    /// Takes the torque that the motion of the other joints puts on the links, one entry a stretch of [`usable`].
    pub(crate) fn couple(&mut self, torques: Vec<Vec<f64>>) {
        for (own, torque) in self.columns.iter_mut().zip(torques) {
            own.couple(torque);
        }
        self.transform();
    }

    /// Predicts friction, backlash and gravity by a model, and transforms them.
    pub(crate) fn predict(&mut self, model: &TwoMass, gravity: &Gravity) {
        let rate = self.rate;
        for own in &mut self.columns {
            own.predict(model, model, gravity, rate);
        }
        self.transform();
    }

    /// Returns the spectra with friction, backlash and gravity by a model. What depends on the model in steps alone (the time over
    /// which the velocity is taken, the length of a step) is that of another one.
    pub(super) fn predicted(&self, model: &TwoMass, steps: &TwoMass, gravity: &Gravity) -> Self {
        let mut own = self.clone();
        let rate = self.rate;
        for columns in &mut own.columns {
            columns.predict(model, steps, gravity, rate);
        }
        own.transform();
        own
    }

    /// Returns what whole periods of the reference show, by a model; `None` if there are none.
    pub(crate) fn periodic(&self, model: &TwoMass) -> Option<Periodic> {
        shown(&self.harmonics, &self.periods, self.rate, model)
    }

    /// Transforms whole periods; false if they hold too few harmonics.
    fn transform_periods(&mut self) -> bool {
        let mut planner = RealFftPlanner::new();
        let dt = 1.0 / self.rate;
        let each = self
            .columns
            .iter()
            .zip(&self.periods)
            .map(|(own, periods)| {
                let transformed: Vec<Vec<Bin>> = (0..periods.count)
                    .map(|k| {
                        let mut bins = Vec::new();
                        let rows = [periods.first + k * periods.length, periods.length];
                        segment(&mut planner, own, rows, dt, true, &mut bins);
                        bins
                    })
                    .collect();
                harmonics(&transformed)
            });
        let Some(found) = each.collect::<Option<Vec<Harmonics>>>() else {
            return false;
        };
        self.bins = found
            .iter()
            .flat_map(|own| own.held.iter().copied())
            .collect();
        self.bins.sort_by(|a, b| a.omega.total_cmp(&b.omega));
        self.harmonics = found;
        true
    }

    /// Returns the RMS torque.
    pub(super) fn torque(&self) -> f64 {
        rms(&self.shown[1])
    }

    /// Transforms all columns.
    fn transform(&mut self) {
        if !self.periods.is_empty() && self.transform_periods() {
            return;
        }
        let mut planner = RealFftPlanner::new();
        let dt = 1.0 / self.rate;
        self.bins.clear();
        for own in &self.columns {
            let n = own.torque.len();
            let (length, hop) = if self.whole {
                (n, n)
            } else {
                let window = ((WINDOW * self.rate) as usize).min(n / 4).max(FEWEST / 4);
                (window, window / 2)
            };
            let mut start = 0;
            while start + length <= n {
                let rows = [start, length];
                segment(&mut planner, own, rows, dt, self.whole, &mut self.bins);
                start += hop;
            }
        }
        self.bins.sort_by(|a, b| a.omega.total_cmp(&b.omega));
    }
}

/// Returns the stretches that are long enough.
pub(super) fn usable(stretches: &[Signals]) -> Vec<&Signals> {
    stretches.iter().filter(|s| s.len() >= FEWEST).collect()
}

/// Transforms all stretches for joint `k`.
///
/// # Errors
/// [`ComplianceError::Recording`]: no torque, unequal rates, a joint that does not move, or too few rows.
pub(crate) fn spectra(
    stretches: &[Signals],
    k: usize,
    name: &str,
    by_reference: Option<bool>,
) -> Result<Spectra, ComplianceError> {
    let mut all = Spectra {
        weight: 1.0,
        ..Spectra::default()
    };
    let usable = usable(stretches);
    let Some(first) = usable.first() else {
        return Err(ComplianceError::Recording(format!(
            "The recordings of joint \"{name}\" have no stretch of {FEWEST} rows without a gap in time; a frequency response needs a longer one."
        )));
    };
    all.rate = first.rate();
    let referenced = usable.iter().all(|s| has_reference(s, k));
    all.by_reference = by_reference.unwrap_or(referenced);
    if all.by_reference && !referenced {
        return Err(ComplianceError::Recording(format!(
            "{} has no reference that moves joint \"{name}\" (column ref{}); record it, or give --instrument torque.",
            first.label,
            k + 1
        )));
    }
    for stretch in &usable {
        if (stretch.rate() / all.rate - 1.0).abs() > 1e-3 {
            return Err(ComplianceError::Recording(format!(
                "{} has {:.2} rows per second and {} has {:.2}; give recordings of one rate.",
                stretch.label,
                stretch.rate(),
                first.label,
                all.rate
            )));
        }
    }
    all.periods = periods_in(&usable, k)
        .filter(|_| all.by_reference)
        .unwrap_or_default();
    all.columns = columns_in(&usable, k, name, &all)?;
    if !all.periods.is_empty() && !all.transform_periods() {
        all.periods.clear();
        all.columns = columns_in(&usable, k, name, &all)?;
    }
    let columns = &all.columns;
    let dt = 1.0 / all.rate;
    all.whole = columns.iter().all(|c| rests(&c.velocity));
    all.rows = columns.iter().map(|c| c.torque.len()).sum();
    all.seconds = all.rows as f64 * dt;
    let joints = first.joints.len();
    all.pose = (0..joints).map(|j| mean(&first.joints[j].q)).collect();
    // A mean over periods is one average, and so is a whole recording.
    if !all.whole && all.periods.is_empty() {
        all.weight = 0.5;
    }
    if let Some((longest, stretch)) =
        (columns.iter().zip(&usable)).max_by_key(|(c, _)| c.torque.len())
    {
        all.shown = [
            stretch.t[..longest.torque.len()].to_vec(),
            longest.torque.clone(),
            longest.velocity.clone(),
        ];
    }
    all.transform();
    Ok(all)
}

/// Returns the whole periods of the references; `None` if one of them is not periodic.
fn periods_in(stretches: &[&Signals], k: usize) -> Option<Vec<Periods>> {
    let each = stretches.iter().map(|stretch| {
        let reference = stretch.joints[k].reference.as_ref()?;
        periods_of(&reference[..stretch.len() - 1])
    });
    each.collect()
}

/// Returns the columns of all stretches.
fn columns_in(
    stretches: &[&Signals],
    k: usize,
    name: &str,
    all: &Spectra,
) -> Result<Vec<Columns>, ComplianceError> {
    let periodic = !all.periods.is_empty();
    let each = stretches.iter();
    each.map(|stretch| columns_of(stretch, k, name, all.by_reference, periodic))
        .collect()
}

/// Transforms rows `start` to `start + length`. Densities: the squared magnitude of a bin is power per Hz, one-sided
/// factor left out.
fn segment(
    planner: &mut RealFftPlanner<f64>,
    columns: &Columns,
    [start, length]: [usize; 2],
    dt: f64,
    whole: bool,
    bins: &mut Vec<Bin>,
) {
    let window: Vec<f64> = (0..length)
        .map(|k| match whole {
            true => 1.0,
            false => 0.5 - 0.5 * (TAU * k as f64 / length as f64).cos(),
        })
        .collect();
    let energy: f64 = window.iter().map(|w| w * w).sum();
    let scale = (dt / energy).sqrt();
    let plan = planner.plan_fft_forward(length);
    let transform = |values: &[f64]| -> Vec<C> {
        let part = &values[start..start + length];
        // A window passes a constant into the lowest bins.
        let middle = if whole { 0.0 } else { mean(part) };
        let mut input: Vec<f64> = (part.iter().zip(&window))
            .map(|(v, w)| (v - middle) * w)
            .collect();
        let mut output = plan.make_output_vec();
        // The lengths are those of the plan: it cannot fail.
        let _ = plan.process(&mut input, &mut output);
        output.iter().map(|v| v * scale).collect()
    };
    let [
        instrument,
        torque,
        moved,
        sign,
        link_sign,
        gap,
        gravity,
        coupling,
    ] = [
        &columns.instrument,
        &columns.torque,
        &columns.moved,
        &columns.sign,
        &columns.link_sign,
        &columns.gap,
        &columns.gravity,
        &columns.coupling,
    ]
    .map(|list| transform(list));
    // Above 0.4 of the rate the difference has little signal.
    for k in 1..length * 2 / 5 {
        let omega = TAU * k as f64 / (length as f64 * dt);
        // The difference over one row is exactly e^{jωdt} − 1 times the position.
        let derivative = C::new(0.0, omega) / (C::from_polar(1.0, omega * dt) - 1.0);
        // Friction is the mean over the time of a row.
        let meaned = (0.5 * omega * dt).sin() / (0.5 * omega * dt);
        bins.push(Bin {
            omega,
            instrument: instrument[k],
            torque: torque[k],
            velocity: moved[k] * derivative,
            sign: sign[k] / meaned,
            link_sign: link_sign[k] / meaned,
            gap: gap[k],
            // A second difference of positions is the acceleration times this squared.
            gravity: gravity[k] + coupling[k] / (meaned * meaned),
        });
    }
}
