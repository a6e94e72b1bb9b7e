//! The two-mass model fitted to the spectra.
//!
//! The residual of a band is Σ r*·(v − H(ω)·(τ − fc·sgn v)) over its bins, divided by its standard deviation: an
//! instrumental-variable estimate with the weights of maximum likelihood (Pintelon & Schoukens 2012, ch. 9). H is not
//! averaged over the band, so that a narrow antiresonance is not smoothed. Coulomb friction of motor and link are further
//! inputs; that of the link follows from a first fit, which predicts the motion of the link.
//!
//! What the torque is between two rows is not recorded. The gains of a torque that is held for a row T and of a smooth one differ by
//! (ωT)²/24 at ω, which counts as a relative standard deviation of stiffness and inertias, at the antiresonance.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};
use rig_numerics::optimise::levenberg_marquardt::{LeastSquares, Settings};
use rig_numerics::statistics::sum_of_squares;

use super::bands::{BandBins, bands};
use super::bin::Bin;
use super::spectra::Spectra;
use super::two_mass::{C, Gravity, TwoMass};
use crate::value::Value;

/// Parameters: ln c, ln Jl, ln Jm, ln d, fm, fc, delay in rows, then fc and viscous friction of the link, and the gap.
const COUNT: usize = 10;
/// Index of ln Jl.
const LINK: usize = 1;
/// Index of ln Jm.
const MOTOR: usize = 2;
/// Index of the delay.
const DELAY: usize = 6;
/// Index of the first parameter of the link's friction.
const LINK_FRICTION: usize = 7;
/// Index of the gap.
const GAP: usize = 9;
/// Frequencies of the antiresonance that are tried at first.
const TRIED: usize = 80;
/// Damping ratios that are tried at first.
const DAMPING: [f64; 3] = [0.02, 0.08, 0.3];
/// Rounds of weights.
const ROUNDS: usize = 3;
/// Blocks of neighbouring bands whose residuals count as independent.
const BLOCKS: usize = 16;
/// Settings of the descent.
const SETTINGS: Settings = Settings {
    difference: 1e-5,
    steps: 60,
    first_steps: 10,
    settled: 1e-8,
    stiffest: 1e9,
};

/// Settings of the descent of the whole prediction.
const WHOLE: Settings = Settings {
    difference: 1e-4,
    steps: 8,
    first_steps: 8,
    settled: 1e-5,
    stiffest: 1e5,
};

/// A fitted model.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    pub model: TwoMass,
    /// Covariance of the parameters: ln c, ln Jl, ln Jm, ln d, fm, fc, delay (rows), fc and viscous friction of the link, gap.
    pub covariance: DMatrix<f64>,
    /// Sum of squares per degree of freedom: 1 for a model that explains all but noise.
    pub misfit: f64,
    /// The same for the best rigid joint, with the weights of the two masses.
    pub rigid_misfit: f64,
    /// -2·ln(likelihood), but for a constant: the logarithm of the noise that the model leaves, over the averages of all bands.
    pub deviance: f64,
}

impl Fitted {
    /// Returns a product of powers of c, Jl and Jm with its standard deviation.
    pub(crate) fn scaled(&self, value: f64, powers: [f64; 3]) -> Value {
        Value::new(value, value * self.variance(powers).sqrt())
    }

    /// Variance of a combination of ln c, ln Jl and ln Jm.
    pub(crate) fn variance(&self, weights: [f64; 3]) -> f64 {
        let mut weighted = DVector::zeros(COUNT);
        weighted.rows_mut(0, 3).copy_from_slice(&weights);
        weighted.dot(&(&self.covariance * &weighted)).max(0.0)
    }
}

/// What the fit takes as known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    /// Torque of gravity on the link.
    pub gravity: Gravity,
    /// Inertia of the link, if it is not to be estimated, kg·m².
    pub link_inertia: Option<f64>,
    /// Inertia of the motor, if it is not to be estimated, kg·m².
    pub motor_inertia: Option<f64>,
    /// Rows per second.
    pub rate: f64,
    /// Time for which the recorded torque is held, s; 0 if it is that of the instant, from which a search begins.
    pub hold: f64,
}

/// Fits the model to the used bands, from a first model if there is one; only then the friction of the link is estimated.
/// The nonlinear torques are those of the bands. `None` if no start has positive inertias.
pub(crate) fn fit(
    bands: &[BandBins<'_>],
    known: &Known,
    first: Option<&TwoMass>,
) -> Option<Fitted> {
    let used: Vec<&BandBins<'_>> = bands.iter().filter(|b| b.band.used).collect();
    let start = match first {
        Some(model) => *model,
        None => start(&used)?,
    };
    let mut unknowns = Unknowns::of(&start, known, first.is_some());
    if first.is_none() {
        unknowns.theta[DELAY] = 0.05;
    }
    let mut noise: Vec<f64> = used.iter().map(|b| b.noise).collect();
    for round in 0..ROUNDS {
        if round > 0 {
            let model = model(&unknowns.theta, known);
            noise = used.iter().map(|b| left(b, &model)).collect();
        }
        unknowns.search(SETTINGS, |theta| {
            residual(&used, &noise, &model(theta, known))
        });
    }
    unknowns.fitted(&used, &noise, known, 1e-4, |theta| {
        residual(&used, &noise, &model(theta, known))
    })
}

/// Fits the model with the nonlinear torques of each trial: the least squares of the whole prediction. With torques that a step
/// takes as given, the fit ends where the residual is orthogonal to other slopes than its own, which is no minimum: what the
/// model leaves reaches the parameters enlarged, and their covariance is that of another estimate.
pub(crate) fn refit(spectra: &Spectra, known: &Known, first: &TwoMass) -> Option<Fitted> {
    let own = bands(spectra);
    let used: Vec<&BandBins<'_>> = own.iter().filter(|b| b.band.used).collect();
    let noise: Vec<f64> = used.iter().map(|b| left(b, first)).collect();
    let whole = |theta: &[f64]| {
        let trial = model(theta, known);
        let predicted = spectra.predicted(&trial, first, &known.gravity);
        let bands = bands(&predicted);
        let used: Vec<&BandBins<'_>> = bands.iter().filter(|b| b.band.used).collect();
        residual(&used, &noise, &trial)
    };
    let mut unknowns = Unknowns::of(first, known, true);
    unknowns.search(WHOLE, whole);
    let found = model(&unknowns.theta, known);
    let predicted = spectra.predicted(&found, first, &known.gravity);
    let bands = bands(&predicted);
    let used: Vec<&BandBins<'_>> = bands.iter().filter(|b| b.band.used).collect();
    unknowns.fitted(&used, &noise, known, 1e-3, whole)
}

/// The parameters of a fit.
struct Unknowns {
    theta: Vec<f64>,
    free: Vec<usize>,
    bounds: Vec<[f64; 2]>,
}

impl Unknowns {
    /// Begins at a model; the friction of the link is estimated only if it is predicted.
    fn of(start: &TwoMass, known: &Known, predicted: bool) -> Self {
        let mut theta = theta_of(start, known.rate);
        for (place, inertia) in [(LINK, known.link_inertia), (MOTOR, known.motor_inertia)] {
            theta[place] = inertia.map_or(theta[place], f64::ln);
        }
        let free: Vec<usize> = (0..COUNT)
            .filter(|p| *p != LINK || known.link_inertia.is_none())
            .filter(|p| *p != MOTOR || known.motor_inertia.is_none())
            .filter(|p| *p < LINK_FRICTION || predicted)
            .filter(|p| *p != GAP || start.gap > 0.0)
            .collect();
        let wide = |at: f64| [at - 12.0, at + 12.0];
        let mut bounds: Vec<[f64; 2]> = theta[..4].iter().map(|at| wide(*at)).collect();
        bounds.push([f64::MIN / 4.0, f64::MAX / 4.0]);
        // Dry friction brakes.
        bounds.push([0.0, f64::MAX]);
        bounds.push([-20.0, 20.0]);
        bounds.extend([[0.0, f64::MAX]; 3]);
        Self {
            theta,
            free,
            bounds,
        }
    }

    fn search(&mut self, settings: Settings, residual: impl Fn(&[f64]) -> Option<Vec<f64>>) {
        let search = LeastSquares {
            residual,
            free: &self.free,
            bounds: &self.bounds,
            settings,
        };
        self.theta = search.fit(&[&self.theta]);
    }

    /// Returns the model of these parameters with its covariance, by differences of the residual over a relative `step`.
    fn fitted(
        &self,
        used: &[&BandBins<'_>],
        noise: &[f64],
        known: &Known,
        step: f64,
        residual_at: impl Fn(&[f64]) -> Option<Vec<f64>>,
    ) -> Option<Fitted> {
        let Self { theta, free, .. } = self;
        let at = residual_at(theta)?;
        let slopes = slopes(theta, free, step, &residual_at)?;
        let inverse = slopes.tr_mul(&slopes).try_inverse()?;
        let misfit = sum_of_squares(&at) / at.len().saturating_sub(free.len()).max(1) as f64;
        let scale = misfit.max(1.0) * correlation(&slopes, &at, &inverse, misfit);
        let mut covariance = DMatrix::zeros(COUNT, COUNT);
        for (a, p) in free.iter().enumerate() {
            for (b, r) in free.iter().enumerate() {
                covariance[(*p, *r)] = inverse[(a, b)] * scale;
            }
        }
        let model = model(theta, known);
        let unrecorded = (model.antiresonance() / known.rate).powi(2) / 24.0;
        // Another gain of the torque changes them alike.
        let scaled: Vec<usize> = free.iter().copied().filter(|p| *p <= MOTOR).collect();
        for p in &scaled {
            for r in &scaled {
                covariance[(*p, *r)] += unrecorded * unrecorded;
            }
        }
        Some(Fitted {
            model,
            covariance,
            misfit,
            rigid_misfit: rigid(used, noise, &model, known)?,
            deviance: deviance(used, &model),
        })
    }
}

/// Returns the misfit of the best rigid joint: total inertia, friction and delay.
fn rigid(bands: &[&BandBins<'_>], noise: &[f64], start: &TwoMass, known: &Known) -> Option<f64> {
    let of = |theta: &[f64]| TwoMass {
        // A spring beyond the band.
        stiffness: f64::INFINITY,
        motor_inertia: theta[0].exp(),
        viscous: theta[1],
        coulomb: theta[2],
        delay: theta[3] / known.rate,
        gravity: known.gravity.slope,
        hold: known.hold,
        ..TwoMass::default()
    };
    let first = [
        (start.motor_inertia + start.link_inertia).ln(),
        start.viscous + start.link_viscous,
        start.coulomb + start.link_coulomb,
        start.delay * known.rate,
    ];
    let wide = [f64::MIN / 4.0, f64::MAX / 4.0];
    let search = LeastSquares {
        residual: |theta: &[f64]| residual(bands, noise, &of(theta)),
        free: &[0, 1, 2, 3],
        bounds: &[wide, wide, [0.0, f64::MAX], [-20.0, 20.0]],
        settings: SETTINGS,
    };
    let found = residual(bands, noise, &of(&search.fit(&[&first])))?;
    Some(sum_of_squares(&found) / found.len().saturating_sub(first.len()).max(1) as f64)
}

/// Returns the factor, at least 1, by which correlated residuals of neighbouring bands raise the variances of c and both
/// inertias: what the model leaves out changes slowly with the frequency (sandwich with blocks, White 1982).
fn correlation(
    slopes: &DMatrix<f64>,
    residual: &[f64],
    inverse: &DMatrix<f64>,
    misfit: f64,
) -> f64 {
    let count = slopes.ncols();
    let mut meat = DMatrix::zeros(count, count);
    let rows = 2 * (residual.len() / 2).div_ceil(BLOCKS);
    let mut first = 0;
    while first < residual.len() {
        let length = rows.min(residual.len() - first);
        let part = DVector::from_column_slice(&residual[first..first + length]);
        let score = slopes.rows(first, length).tr_mul(&part);
        meat += &score * score.transpose();
        first += length;
    }
    let sandwich = inverse * meat * inverse;
    (0..3)
        .map(|k| sandwich[(k, k)] / (inverse[(k, k)] * misfit))
        .fold(1.0, f64::max)
}

/// Returns the parameters of a model; the delay is in rows.
fn theta_of(model: &TwoMass, rate: f64) -> Vec<f64> {
    vec![
        model.stiffness.ln(),
        model.link_inertia.ln(),
        model.motor_inertia.ln(),
        model.damping.ln(),
        model.viscous,
        model.coulomb.max(0.0),
        model.delay * rate,
        model.link_coulomb,
        model.link_viscous,
        model.gap,
    ]
}

fn model(theta: &[f64], known: &Known) -> TwoMass {
    TwoMass {
        stiffness: theta[0].exp(),
        link_inertia: theta[1].exp(),
        motor_inertia: theta[2].exp(),
        damping: theta[3].exp(),
        viscous: theta[4],
        coulomb: theta[5],
        delay: theta[6] / known.rate,
        link_coulomb: theta[7],
        link_viscous: theta[8],
        gap: theta[GAP],
        gravity: known.gravity.slope,
        hold: known.hold,
    }
}

/// Velocity that a model gives for friction, gravity and a gap: they act at every instant.
fn resisted(bin: &Bin, model: &TwoMass) -> C {
    let through = model.through_spring(bin.omega);
    let of_link = through * (bin.link_sign * model.link_coulomb + bin.gravity);
    let of_gap = match model.gap > 0.0 {
        true => (C::new(1.0, 0.0) - through) * bin.gap * (model.stiffness * model.gap),
        false => C::new(0.0, 0.0),
    };
    -model.response(bin.omega) * (bin.sign * model.coulomb + of_link + of_gap)
}

/// Velocity that a model does not explain.
fn error(bin: &Bin, model: &TwoMass) -> C {
    bin.velocity - model.recorded(bin.omega) * bin.torque - resisted(bin, model)
}

/// Returns the response of a band without the Coulomb friction of a model.
pub(crate) fn frictionless(band: &BandBins<'_>, model: &TwoMass) -> C {
    let (mut velocity, mut torque) = (C::new(0.0, 0.0), C::new(0.0, 0.0));
    for bin in band.bins {
        velocity += bin.instrument.conj() * (bin.velocity - resisted(bin, model));
        torque += bin.instrument.conj() * bin.torque;
    }
    velocity / torque
}

/// Density of the velocity's noise that a model leaves in a band.
fn left(band: &BandBins<'_>, model: &TwoMass) -> f64 {
    let squares = (band.bins.iter()).map(|bin| error(bin, model).norm_sqr());
    squares.sum::<f64>() / band.bins.len() as f64
}

/// Returns the velocity that a model does not explain over the velocity, RMS over the used bands.
pub(crate) fn unexplained(bands: &[BandBins<'_>], model: &TwoMass) -> f64 {
    let used = bands.iter().filter(|band| band.band.used);
    let (mut left, mut whole) = (0.0, 0.0);
    for bin in used.flat_map(|band| band.bins) {
        left += error(bin, model).norm_sqr();
        whole += bin.velocity.norm_sqr();
    }
    (left / whole).sqrt()
}

/// Returns -2·ln(likelihood) of a model, but for a constant: each band has an unknown noise.
fn deviance(bands: &[&BandBins<'_>], model: &TwoMass) -> f64 {
    (bands.iter())
        .map(|band| 2.0 * band.band.averages * left(band, model).ln())
        .sum()
}

/// Residuals of all bands over their standard deviations, real parts and imaginary parts.
fn residual(bands: &[&BandBins<'_>], noise: &[f64], model: &TwoMass) -> Option<Vec<f64>> {
    let mut all = Vec::with_capacity(2 * bands.len());
    for (band, noise) in bands.iter().zip(noise) {
        let (mut sum, mut power) = (C::new(0.0, 0.0), 0.0);
        for bin in band.bins {
            sum += bin.instrument.conj() * error(bin, model);
            power += bin.instrument.norm_sqr();
        }
        // Overlapping windows give fewer independent bins than there are.
        let repeated = band.bins.len() as f64 / band.band.averages;
        let deviation = (0.5 * power * noise * repeated).sqrt();
        let scaled = sum / deviation;
        if !scaled.is_finite() {
            return None;
        }
        all.extend([scaled.re, scaled.im]);
    }
    Some(all)
}

/// Slopes by central differences.
fn slopes(
    theta: &[f64],
    free: &[usize],
    relative: f64,
    residual: &dyn Fn(&[f64]) -> Option<Vec<f64>>,
) -> Option<DMatrix<f64>> {
    let rows = residual(theta)?.len();
    let mut slopes = DMatrix::zeros(rows, free.len());
    for (column, p) in free.iter().enumerate() {
        let step = relative * theta[*p].abs().max(1e-3);
        let at = |side: f64| {
            let mut moved = theta.to_vec();
            moved[*p] += side;
            residual(&moved)
        };
        let (up, down) = (at(step)?, at(-step)?);
        for (row, (a, b)) in up.iter().zip(&down).enumerate() {
            slopes[(row, column)] = (a - b) / (2.0 * step);
        }
    }
    Some(slopes)
}

/// Finds a start: for each antiresonance and damping ratio of a grid the impedance is linear in Jm, fm, Jl and the Coulomb
/// friction.
fn start(bands: &[&BandBins<'_>]) -> Option<TwoMass> {
    let (first, last) = (bands.first()?, bands.last()?);
    let ends = [first.band.frequency * TAU, last.band.frequency * TAU];
    let ratio = (ends[1] / ends[0]).powf(1.0 / (TRIED - 1) as f64);
    let mut best: Option<(f64, TwoMass)> = None;
    for k in 0..TRIED {
        let omega = ends[0] * ratio.powi(k as i32);
        for zeta in DAMPING {
            let Some((cost, model)) = linear(bands, omega, zeta) else {
                continue;
            };
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, model));
            }
        }
    }
    best.map(|(_, model)| model)
}

/// Fits Jm, fm, Jl and fc with an antiresonance `omega` (rad/s) of a damping ratio. `None` if an inertia is not positive.
fn linear(bands: &[&BandBins<'_>], omega: f64, zeta: f64) -> Option<(f64, TwoMass)> {
    let (mut normal, mut right, mut square) = (Matrix4::<f64>::zeros(), Vector4::zeros(), 0.0);
    for band in bands {
        let mut columns = [C::new(0.0, 0.0); 4];
        let (mut torque, mut power) = (C::new(0.0, 0.0), 0.0);
        for bin in band.bins {
            let s = C::new(0.0, bin.omega);
            let spring = s * (2.0 * zeta * omega) + omega * omega;
            let link = s * spring / (s * s + spring);
            let r = bin.instrument.conj();
            // The torque on the link acts through the spring.
            torque += r * (bin.torque - bin.gravity * spring / (s * s + spring));
            power += bin.instrument.norm_sqr();
            let own = [
                s * bin.velocity,
                bin.velocity,
                link * bin.velocity,
                bin.sign,
            ];
            for (sum, value) in columns.iter_mut().zip(own) {
                *sum += r * value;
            }
        }
        // The noise of the velocity over |H| is that of the torque.
        let weight = band.band.magnitude.powi(2) / (power * band.noise);
        for a in 0..4 {
            right[a] += weight * (columns[a].conj() * torque).re;
            for b in 0..4 {
                normal[(a, b)] += weight * (columns[a].conj() * columns[b]).re;
            }
        }
        square += weight * torque.norm_sqr();
    }
    let found = normal.lu().solve(&right)?;
    let [motor, viscous, link, coulomb] = found.into();
    (motor > 0.0 && link > 0.0).then(|| {
        (
            square - right.dot(&found),
            TwoMass {
                stiffness: link * omega * omega,
                link_inertia: link,
                motor_inertia: motor,
                damping: 2.0 * zeta * omega * link,
                viscous,
                coulomb,
                ..TwoMass::default()
            },
        )
    })
}
