//! The cut-off of the position filter, chosen by how well the torque is explained with it.
//!
//! The spectrum of a position shows its noise floor only if the noise is white. Jittered time stamps, coarse encoders
//! and positions filtered by the drive give noise that looks like motion. The torque separates the two: motion needs
//! torque, noise needs none. The model is fitted once per cut-off, to the same torque in the same band, and the
//! residuals are compared. A cut-off that is too low distorts the motion; one that is too high lets noise into the
//! regressor. Both raise the residual. The spectrum's cut-off is replaced only if another one explains the torque
//! better by [`BETTER`]. A lower one also needs a spectrum that is flat above it, as noise is and motion is not,
//! because a low cut-off also hides unmodelled friction.
//!
//! A lower one must also explain the torque better by [`BETTER`] on the rows far enough from every reversal. A joint that
//! sticks when it reverses has friction between its two signs; a low cut-off turns that stay into a smooth passage
//! through zero, which comes nearer to the torque of the stay although it bends the motion. Those rows alone would not
//! do: starts and stops, which a low cut-off distorts most, lie near standstill.
//!
//! Limits: one cut-off for all joints, because the regressor couples them. Noise that the controller feeds back into
//! the torque is explained together with the position noise.

use rig_shared::multibody::Chain;
use rig_shared::transmission::Transmission;

use super::clear_rows::{ClearRows, with_margin};
use super::trial_rows::beginnings;
use super::trial_rows::factors_of;
use super::trial_rows::kept;
use crate::error::IdentifyError;
use crate::estimators::linear::by_noise;
use crate::rows::cache::RowCache;
use crate::rows::factor::TriangularFactor;
use crate::rows::plan::Plan;
use crate::warning::{OwnCutoff, Warning};
use rig_data::prepare::Choice;
use rig_data::prepare::CutoffTrial;
use rig_data::prepare::MAX_CUTOFF_SHARE;
use rig_data::prepare::PrepareOptions;
use rig_data::prepare::PreprocessingPlan;
use rig_data::prepare::Recording;
use rig_data::prepare::Survey;
use rig_data::prepare::trimmed_rows;
use rig_model::robot::Robot;
use rig_numerics::statistics::mean_or_zero;

/// Reduction of the mean log residual of the joints from which another cut-off replaces the spectrum's. 0.15: on the
/// rig of `rig demo` (white position noise, presliding friction unmodelled) a cut-off five times too low left 11 %
/// less. Positions with noise that is not white left 20 % to 300 % more.
const BETTER: f64 = 0.15;
/// Difference of the mean log residual of the joints below which two cut-offs count as equal.
const EQUAL: f64 = 0.01;
/// Lowest trial cut-off times the length of the shortest stretch. Each end loses three periods of the cut-off, so at
/// most a fifth of the recording is lost.
const LEAST_PERIODS: f64 = 30.0;
/// Band of the torque comparison, as a multiple of the joints' main motion frequency. Friction at a reversal has
/// harmonics well above the motion, and a cut-off that blurs them must show in the residual.
const HEADROOM: f64 = 10.0;
/// Share of the RMS speed below which rows are excluded from the comparison: the sign of their speed is noise.
const SLOW: f64 = 0.05;
/// Least number of rows of all joints per parameter far from every reversal. With fewer, the fit follows any cut-off's rows.
const ROWS_A_PARAMETER: usize = 2;

/// The model behind the rows of a trial.
#[derive(Clone, Copy)]
pub(crate) struct Equations<'a> {
    /// Geometry.
    pub chain: &'a Chain<f64>,
    /// Drives.
    pub transmission: &'a Transmission<f64>,
    /// Columns of the base parameters in the standard regressor.
    pub columns: &'a [usize],
    /// True if the description has no effects beside the equations. Such effects would count as residual.
    pub complete: bool,
}

/// Decides the treatment of `recordings` as [`PreprocessingPlan::decide`] does, with the cut-off that explains the
/// torque best. Returns updated surveys: the signal of each joint ends at the cut-off if the torque shows no motion
/// above it.
///
/// # Errors
/// [`IdentifyError`]: as [`PreprocessingPlan::decide`]; recordings that cannot be read.
pub(crate) fn decided(
    equations: Equations,
    recordings: &[&dyn Recording],
    surveys: Vec<Survey>,
    options: &PrepareOptions,
    limits: &[Option<f64>],
) -> Result<(Vec<Survey>, PreprocessingPlan), IdentifyError> {
    let first = PreprocessingPlan::decide(&surveys, options, limits)?;
    if options.cutoff != Choice::Auto || !equations.complete {
        return Ok((surveys, first));
    }
    let comparison = Comparison {
        equations,
        recordings,
        surveys: &surveys,
        options,
        limits,
        first: &first,
    };
    let Some(raster) = comparison.raster() else {
        return Ok((surveys, first));
    };
    let trials = comparison.trials(&raster, None)?;
    let score = |t: &CutoffTrial| mean_logarithm(&t.relative_error, &trials);
    let by_spectrum = trials
        .iter()
        .find(|t| t.cutoff == first.cutoff)
        .map_or(f64::INFINITY, score);
    let least = trials.iter().map(score).fold(f64::INFINITY, f64::min);
    if by_spectrum <= least + BETTER {
        return Ok((surveys, PreprocessingPlan { trials, ..first }));
    }
    // Of equal cut-offs the lowest one has the least noise in the speed.
    let equal = trials.iter().find(|t| score(t) <= least + EQUAL);
    let cutoff = equal.map_or(first.cutoff, |t| t.cutoff);
    let noisy = |j: usize| {
        let error = |cutoff: f64| trials.iter().find(|t| t.cutoff == cutoff);
        let gain = error(first.cutoff)
            .zip(error(cutoff))
            .map(|(a, b)| (a.relative_error[j] / b.relative_error[j]).ln());
        gain.is_some_and(|g| g > BETTER) && first.spectra[j].flattens(cutoff, first.cutoff)
    };
    if cutoff < first.cutoff {
        if !(0..first.spectra.len()).any(noisy) {
            return Ok((surveys, PreprocessingPlan { trials, ..first }));
        }
        let Some(clear) = comparison.clear(&raster)? else {
            return Ok((surveys, PreprocessingPlan { trials, ..first }));
        };
        if !comparison.is_better(cutoff, &raster, &clear)? {
            // The figure and the warnings show what holds.
            let trials = comparison.trials(&raster, Some(&clear))?;
            return Ok((surveys, PreprocessingPlan { trials, ..first }));
        }
    }
    let ends: Vec<f64> = (0..first.spectra.len())
        .map(|j| own_cutoff(&trials, j).max(cutoff))
        .collect();
    let surveys: Vec<Survey> = surveys.iter().map(|s| s.ending_at(&ends)).collect();
    let fixed = PrepareOptions {
        cutoff: Choice::Fixed(cutoff),
        ..options.clone()
    };
    let mut treatment = PreprocessingPlan::decide(&surveys, &fixed, limits)?;
    treatment.cutoff_reason = format!(
        "{cutoff:.3} Hz: of {} cut-offs it explains the torque best. The spectrum of the position alone gives {:.3} Hz, which leaves {:.0} % more of the torque.",
        trials.len(),
        first.cutoff,
        100.0 * (by_spectrum - least).exp_m1(),
    );
    treatment.spectral_cutoff = Some(first.cutoff);
    treatment.trials = trials;
    Ok((surveys, treatment))
}

/// Returns warnings about the cut-off: the torque gave another one than the spectrum, or some joints are explained
/// clearly better with a cut-off of their own.
pub(crate) fn doubts(treatment: &PreprocessingPlan, robot: &Robot) -> Vec<Warning> {
    let mut doubts = Vec::new();
    let (cutoff, trials) = (treatment.cutoff, &treatment.trials);
    let error = |cutoff: f64, j: usize| {
        let trial = trials.iter().find(|t| t.cutoff == cutoff);
        trial.map_or(f64::NAN, |t| t.relative_error[j])
    };
    if let Some(by_spectrum) = treatment.spectral_cutoff {
        doubts.push(Warning::CutoffByTorque {
            cutoff,
            by_spectrum,
        });
    }
    let mut alone = Vec::new();
    for (j, joint) in robot.joints.iter().enumerate() {
        let own = own_cutoff(trials, j);
        let more = error(cutoff, j) / error(own, j);
        if more.ln() > BETTER {
            alone.push(OwnCutoff {
                joint: joint.name.clone(),
                cutoff: own,
                less: 1.0 - 1.0 / more,
            });
        }
    }
    if robot.joints.len() > 1 && !alone.is_empty() {
        doubts.push(Warning::OwnCutoffs(alone));
    }
    doubts
}

/// Returns the mean logarithm of the relative errors, over the joints with a valid error in every trial.
fn mean_logarithm(errors: &[f64], trials: &[CutoffTrial]) -> f64 {
    let judged = |j: usize| trials.iter().all(|t| t.relative_error[j] > 0.0);
    let logarithms: Vec<f64> = (errors.iter().enumerate())
        .filter(|(j, _)| judged(*j))
        .map(|(_, error)| error.ln())
        .collect();
    mean_or_zero(&logarithms)
}

/// Returns the cut-off that explains the torque of joint `j` best.
fn own_cutoff(trials: &[CutoffTrial], j: usize) -> f64 {
    let judged = trials.iter().filter(|t| t.relative_error[j] > 0.0);
    judged
        .min_by(|a, b| a.relative_error[j].total_cmp(&b.relative_error[j]))
        .map_or(0.0, |t| t.cutoff)
}

struct Comparison<'a> {
    equations: Equations<'a>,
    recordings: &'a [&'a dyn Recording],
    surveys: &'a [Survey],
    options: &'a PrepareOptions,
    limits: &'a [Option<f64>],
    first: &'a PreprocessingPlan,
}

impl<'a> Comparison<'a> {
    /// Returns the raster of the trials; none if the recordings are too short.
    fn raster(&self) -> Option<Raster<'a>> {
        let rate = self.first.sample_rate;
        let shortest = self.surveys.iter().map(|s| s.longest).min().unwrap_or(0);
        let most = MAX_CUTOFF_SHARE * rate / 2.0;
        let swing = (self.first.spectra.iter())
            .map(|s| s.swing())
            .fold(0.0, f64::max);
        // Below the main motion frequency a cut-off distorts the motion itself, whatever the recording's length.
        let least = (LEAST_PERIODS * rate / shortest.max(1) as f64).max(swing);
        // Without decimation the torque would pass the position filter, which differs between trials.
        let decimation = ((0.4 * rate / (HEADROOM * swing)).floor() as usize).max(2);
        let trimmed = trimmed_rows(least.min(self.first.cutoff), decimation, rate);
        let band = 0.4 * rate / decimation as f64;
        let enough = least < most && shortest >= (50 * decimation + 2 * trimmed) as u64;
        enough.then(|| Raster {
            cutoffs: [least, most],
            decimation,
            trimmed,
            band,
            recordings: self.fastest(band),
        })
    }

    /// Runs trials with the spectrum's cut-off, with others an octave apart, and with half-octave neighbours of the
    /// best; on all rows or on `clear` ones.
    fn trials(
        &self,
        raster: &Raster,
        clear: Option<&[ClearRows]>,
    ) -> Result<Vec<CutoffTrial>, IdentifyError> {
        let [least, most] = raster.cutoffs;
        let trial = |cutoff: f64| self.trial(cutoff, raster, clear);
        let mut trials = vec![trial(self.first.cutoff)?];
        let mut cutoff = least;
        while cutoff < most {
            trials.push(trial(cutoff)?);
            cutoff *= 2.0;
        }
        trials.push(trial(most)?);
        let best = trials
            .iter()
            .min_by(|a, b| {
                let score = |t: &CutoffTrial| mean_logarithm(&t.relative_error, &trials);
                score(a).total_cmp(&score(b))
            })
            .map_or(most, |t| t.cutoff);
        for near in [std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::SQRT_2] {
            if (least..most).contains(&(best * near)) {
                trials.push(trial(best * near)?);
            }
        }
        trials.sort_by(|a, b| a.cutoff.total_cmp(&b.cutoff));
        Ok(trials)
    }

    /// Returns true if a cut-off explains the torque better than that of the spectrum on `clear` rows.
    fn is_better(
        &self,
        cutoff: f64,
        raster: &Raster,
        clear: &[ClearRows],
    ) -> Result<bool, IdentifyError> {
        let both = [
            self.trial(self.first.cutoff, raster, Some(clear))?,
            self.trial(cutoff, raster, Some(clear))?,
        ];
        let [before, after] = [0, 1].map(|k| mean_logarithm(&both[k].relative_error, &both));
        Ok(before > after + BETTER)
    }

    /// Returns the rows of each recording far enough from every reversal; none if they are too few.
    fn clear(&self, raster: &Raster) -> Result<Option<Vec<ClearRows>>, IdentifyError> {
        // The highest cut-off shows the reversals best.
        let treatment = self.treated(raster.band.min(raster.cutoffs[1]), raster)?;
        let treatment = with_margin(treatment);
        let plan = self.plan(&treatment);
        let clear = (beginnings(&raster.recordings, &treatment).iter())
            .map(|beginning| ClearRows::of(beginning, &plan))
            .collect::<Result<Vec<ClearRows>, IdentifyError>>()?;
        let rows: usize = clear.iter().map(ClearRows::count).sum();
        let enough = rows >= ROWS_A_PARAMETER * self.equations.columns.len();
        Ok(enough.then_some(clear))
    }

    /// Returns, for each joint, the recording in which its speed below `band` Hz is highest. Slow reversals are
    /// unsuitable: unmodelled friction near standstill dominates their residual, and a low cut-off hides it.
    fn fastest(&self, band: f64) -> Vec<&'a dyn Recording> {
        let speed = |s: &Survey, j: usize| s.joints[j].spectrum.velocity_rms_below(band);
        let of = |j: usize| {
            let numbered = self.surveys.iter().enumerate();
            let fastest = numbered.max_by(|a, b| speed(a.1, j).total_cmp(&speed(b.1, j)));
            fastest.map_or(0, |(k, _)| k)
        };
        let mut chosen: Vec<usize> = (0..self.first.spectra.len()).map(of).collect();
        chosen.sort_unstable();
        chosen.dedup();
        chosen.iter().map(|&k| self.recordings[k]).collect()
    }

    /// Returns the treatment of a trial.
    fn treated(&self, cutoff: f64, raster: &Raster) -> Result<PreprocessingPlan, IdentifyError> {
        let options = PrepareOptions {
            cutoff: Choice::Fixed(cutoff),
            decimation: Choice::Fixed(raster.decimation),
            ..self.options.clone()
        };
        let mut treatment = PreprocessingPlan::decide(self.surveys, &options, self.limits)?;
        treatment.trimmed = raster.trimmed;
        let band = treatment.parallel_edge;
        for (slow, spectrum) in (treatment.speed_threshold.iter_mut()).zip(&self.first.spectra) {
            *slow = slow.min(SLOW * spectrum.velocity_rms_below(band));
        }
        Ok(treatment)
    }

    /// Returns the plan of the rows of a treatment.
    fn plan<'p>(&'p self, treatment: &'p PreprocessingPlan) -> Plan<'p> {
        Plan {
            chain: self.equations.chain,
            transmission: self.equations.transmission,
            columns: self.equations.columns,
            treatment,
            window: 1,
            stride: 1,
            loudness: vec![1.0; treatment.spectra.len()],
            one_way: Vec::new(),
            cache: RowCache::default(),
        }
    }

    /// Fits the model with a cut-off, on all rows or on `clear` ones.
    fn trial(
        &self,
        cutoff: f64,
        raster: &Raster,
        clear: Option<&[ClearRows]>,
    ) -> Result<CutoffTrial, IdentifyError> {
        let treatment = self.treated(cutoff, raster)?;
        let plan = self.plan(&treatment);
        let mut factors = vec![TriangularFactor::new(plan.columns.len()); plan.loudness.len()];
        let beginnings = beginnings(&raster.recordings, &treatment);
        for (k, beginning) in beginnings.iter().enumerate() {
            let own = factors_of(&[beginning], &plan, &|rows, j, i| match clear {
                Some(clear) => clear[k].has(rows, j, i),
                None => kept(rows, j, i),
            })?;
            for (factor, own) in factors.iter_mut().zip(&own) {
                factor.merge(own, 1.0);
            }
        }
        Ok(CutoffTrial {
            cutoff,
            relative_error: relative_errors(&factors),
        })
    }
}

/// Common settings of the trials.
struct Raster<'a> {
    /// The recordings.
    recordings: Vec<&'a dyn Recording>,
    /// Lowest and highest cut-off, Hz.
    cutoffs: [f64; 2],
    decimation: usize,
    trimmed: usize,
    /// Band of the decimated rows, Hz.
    band: f64,
}

/// Returns the RMS residual of each joint over its RMS torque. The least-squares fit covers all joints and weights them
/// by their residuals. Not a number for a joint without rows or torque.
fn relative_errors(factors: &[TriangularFactor]) -> Vec<f64> {
    let rms = |squares: f64, factor: &TriangularFactor| (squares / factor.rows() as f64).sqrt();
    let Some(beta) = by_noise(factors) else {
        return vec![f64::NAN; factors.len()];
    };
    (factors.iter())
        .map(|f| rms(f.residual_squares(&beta), f) / rms(f.right_side_squares(), f))
        .collect()
}
