//! Which properties of sensor, recorder and base the readings show beside the load.
//!
//! Properties are taken in one by one, the one that explains most first; one that a later one makes needless is dropped.
//! A turned sensor, a base that leans, a delay and a wrong position of the sensor bend the readings in similar ways, so
//! none of them is tested before the others have been compared with it.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Rotation3, Vector3};
use rig_identify::{LeaveOut, Refit, TriangularFactor, f_p_value};

use crate::estimate::solved;
use crate::jump::{DRIFTS, jumps};
use crate::mounting::Mounting;
use crate::settle::{DECISIVE, settled};
use crate::system::{Fit, Nuisance, Sensed};

/// Probability by chance below which a further unknown is taken in.
const TAKEN_IN: f64 = 1e-3;

/// Returns true if the larger fit leaves less than chance would have it.
fn is_better(larger: &Fit, smaller: &Fit) -> bool {
    (larger.chance_over(smaller)).is_some_and(|p| p < TAKEN_IN)
}

/// Returns the values of a nuisance of a fit, rotations counted from the mounting of a fit without it.
fn values(sensed: &Sensed, fit: &Fit, without: &Fit, nuisance: Nuisance) -> Option<DVector<f64>> {
    let place = sensed.place(&fit.unknowns, nuisance)?;
    let mut values = DVector::from_column_slice(fit.values.get(place)?);
    match nuisance {
        Nuisance::Rotation => {
            let turn = fit.mounting.force * without.mounting.force.transpose();
            values += Rotation3::from_matrix(&turn).scaled_axis();
        }
        Nuisance::Lean => {
            let turn = fit.mounting.gravity * without.mounting.gravity.inverse();
            for (value, axis) in values.iter_mut().zip(sensed.level_axes(fit)) {
                *value += axis.dot(&turn.scaled_axis());
            }
        }
        _ => {}
    }
    Some(values)
}

/// Returns the size below which a property is not looked at: what a spirit level, a caliper or a clock do not show either.
fn least(nuisance: Nuisance) -> f64 {
    match nuisance {
        Nuisance::Rotation | Nuisance::Lean => 1e-3,
        Nuisance::Delay => 1e-4,
        Nuisance::Origin => 5e-4,
        Nuisance::Drift | Nuisance::Warming | Nuisance::Scale | Nuisance::Gain(_) => 0.0,
    }
}

/// Returns true if the data show a nuisance of `fit`: it leaves less than `without` has it by chance, also if the noise is
/// correlated in time. For a motion its values are compared with their spread over refits without one segment
/// (Hotelling's T²); poses are independent of each other, so the F test holds for them.
fn shows(sensed: &Sensed, fit: &Fit, without: &Fit, nuisance: Nuisance) -> bool {
    let (Some(values), Some(place)) = (
        values(sensed, fit, without, nuisance),
        sensed.place(&fit.unknowns, nuisance),
    ) else {
        return false;
    };
    if values.norm() < least(nuisance) || !is_better(fit, without) {
        return false;
    }
    if sensed.recordings.iter().all(|r| r.poses) {
        return true;
    }
    let segments = sensed.factors(fit);
    let count = values.len() as f64;
    let freedom = segments.len() as f64 - count;
    if freedom < 1.0 {
        return false;
    }
    let Some(squares) = squares_over(&values, spread(&segments, &place).covariance()) else {
        return false;
    };
    let ratio = squares * freedom / (count * (freedom + count - 1.0));
    f_p_value(ratio, [count, freedom]).is_some_and(|p| p < TAKEN_IN)
}

/// Returns the standard deviation of a nuisance with one unknown: for a motion by refits with one segment left out, for
/// poses by the residuals. Not a number if the fit has no such unknown.
pub(crate) fn deviation(sensed: &Sensed, fit: &Fit, nuisance: Nuisance) -> f64 {
    let Some(place) = sensed.place(&fit.unknowns, nuisance) else {
        return f64::NAN;
    };
    let segments = sensed.factors(fit);
    if sensed.recordings.iter().any(|r| r.poses) {
        return by_residuals(&segments, place.start);
    }
    spread(&segments, &place).covariance()[(0, 0)].sqrt()
}

/// Returns the standard deviation of an unknown in equations whose noise is one: the length of what is left of its column
/// beside the others, inverted.
fn by_residuals(segments: &[TriangularFactor], place: usize) -> f64 {
    let (r, _) = LeaveOut::of(segments).whole.system();
    let others = r.clone().remove_column(place);
    let own = r.column(place).into_owned();
    let along = &others * solved(&others, &own);
    1.0 / (own - along).norm()
}

/// Refits the unknowns at a place, with all segments and with one left out.
fn spread(segments: &[TriangularFactor], place: &Range<usize>) -> Refit {
    let left_out = LeaveOut::of(segments);
    let of = |factor: &TriangularFactor| {
        let (r, z) = factor.system();
        solved(&r, &z).as_slice()[place.clone()].to_vec()
    };
    Refit {
        whole: of(&left_out.whole),
        without: left_out.without.iter().map(of).collect(),
    }
}

/// Returns vᵀ·C⁻¹·v; `None` if C is singular.
fn squares_over(values: &DVector<f64>, mut covariance: DMatrix<f64>) -> Option<f64> {
    let sizes = covariance.diagonal().map(|v| v.max(0.0).sqrt());
    let scaled = values.component_div(&sizes);
    for r in 0..sizes.len() {
        for c in 0..sizes.len() {
            covariance[(r, c)] /= sizes[r] * sizes[c];
        }
    }
    let solved = covariance.cholesky()?.solve(&scaled);
    Some(scaled.dot(&solved))
}

/// Returns the misfit by equation, each unknown counted as the information criterion of Schwarz (1978) does. A jump leaves
/// out segments, so fits of unlike many equations are compared.
fn score(fit: &Fit) -> f64 {
    let penalty = fit.values.len() as f64 * (fit.equations as f64).ln();
    fit.misfit_per_equation() + penalty / fit.equations as f64
}

/// What the readings show beside the load.
pub(crate) struct Selected {
    /// The fit.
    pub fit: Fit,
    /// Pairs of a property that was taken in, and another that explains the readings as well.
    pub alternatives: Vec<[Nuisance; 2]>,
    /// Scale of the moments that explains the readings as well as their position does, and its standard deviation.
    pub scale: Option<[f64; 2]>,
}

impl Selected {
    /// Adds the scale of the moments of another fit as an alternative to the position of the sensor.
    pub(crate) fn add_scale(&mut self, sensed: &Sensed, fit: &Fit) {
        self.alternatives.push([Nuisance::Origin, Nuisance::Scale]);
        let scale = fit.mounting.scale;
        self.scale = Some([scale, scale * deviation(sensed, fit, Nuisance::Scale)]);
    }
}

/// Takes in the properties and jumps that the data show. `start` is the mounting as described.
pub(crate) fn selected(sensed: &Sensed, fit: Fit, start: &Mounting) -> Selected {
    let mut taken: Vec<Nuisance> = fit.unknowns.nuisances.clone();
    let mut fit = without_needless(sensed, fit, start, None);
    let mut alternatives = Vec::new();
    loop {
        let mut larger: Vec<(Option<Nuisance>, Fit)> = Vec::new();
        for nuisance in Nuisance::ALL {
            // A sensor is turned by what all of its channels read.
            let is_apart = nuisance == Nuisance::Rotation && is_apart(&fit);
            if taken.contains(&nuisance) || is_apart || !can_show(sensed, nuisance) {
                continue;
            }
            let own = settled(sensed, &fit.mounting, &fit.unknowns.with(nuisance));
            if shows(sensed, &own, &fit, nuisance) {
                larger.push((Some(nuisance), own));
            }
        }
        larger.extend(jumped(sensed, &fit).map(|own| (None, own)));
        larger.extend(zeroed(sensed, &fit).map(|(drift, own)| (Some(drift), own)));
        larger.sort_by(|a, b| score(&a.1).total_cmp(&score(&b.1)));
        let mut larger = larger.into_iter();
        let Some((nuisance, best)) = larger.next() else {
            return Selected {
                fit,
                alternatives,
                scale: None,
            };
        };
        if let Some(nuisance) = nuisance {
            taken.push(nuisance);
            // With and without jumps beside it, a drift is the same property.
            let as_good = larger
                .filter(|(_, own)| own.misfit() < best.misfit() + DECISIVE)
                .filter_map(|(other, _)| Some([nuisance, other?]))
                .filter(|[own, other]| own != other);
            alternatives.extend(as_good);
        }
        fit = without_needless(sensed, best, start, nuisance);
    }
}

/// Returns the fit with the clearest jump of the bias, or pair of jumps, if the data show one.
fn jumped(sensed: &Sensed, fit: &Fit) -> Option<Fit> {
    let found = jumps(sensed, fit);
    if found.is_empty() {
        return None;
    }
    let mut unknowns = fit.unknowns.clone();
    unknowns.jumps.extend(found);
    let own = settled(sensed, &fit.mounting, &unknowns);
    is_better(&own, fit).then_some(own)
}

/// Returns the fits with a drift of the bias and jumps beside it, if the data show both. A sensor that drifts and is zeroed
/// shows neither alone: a line through its saw tooth is flat, and a step leaves the slopes.
fn zeroed<'a>(sensed: &'a Sensed, fit: &'a Fit) -> impl Iterator<Item = (Nuisance, Fit)> + 'a {
    let possible = |drift: &Nuisance| !fit.unknowns.has(*drift) && can_show(sensed, *drift);
    DRIFTS.into_iter().filter(possible).filter_map(|drift| {
        let drifts = settled(sensed, &fit.mounting, &fit.unknowns.with(drift));
        let both = jumped(sensed, &drifts)?;
        let jumps = settled(sensed, &both.mounting, &both.unknowns.without(drift));
        shows(sensed, &both, &jumps, drift).then_some((drift, both))
    })
}

/// Drops the nuisances beside `newest` that the data do not show any more.
fn without_needless(sensed: &Sensed, fit: Fit, start: &Mounting, newest: Option<Nuisance>) -> Fit {
    let mut fit = fit;
    for nuisance in fit.unknowns.nuisances.clone() {
        let is_fault = matches!(nuisance, Nuisance::Scale | Nuisance::Gain(_));
        if Some(nuisance) == newest || is_fault {
            continue;
        }
        let mut mounting = fit.mounting.clone();
        match nuisance {
            Nuisance::Rotation => {
                (mounting.force, mounting.moment) = (start.force, start.moment);
            }
            Nuisance::Lean => mounting.gravity = start.gravity,
            _ => {}
        }
        let fewer = settled(sensed, &mounting, &fit.unknowns.without(nuisance));
        if !shows(sensed, &fit, &fewer, nuisance) {
            fit = fewer;
        }
    }
    fit
}

/// Returns true if a channel has a gain of its own.
fn is_apart(fit: &Fit) -> bool {
    let is_gain = |own: &Nuisance| matches!(own, Nuisance::Gain(_));
    fit.mounting.has_gain() || fit.unknowns.nuisances.iter().any(is_gain)
}

/// Returns true if such recordings can show a nuisance at all.
fn can_show(sensed: &Sensed, nuisance: Nuisance) -> bool {
    match nuisance {
        Nuisance::Warming => sensed.recordings.iter().any(|r| r.warms),
        Nuisance::Delay | Nuisance::Origin | Nuisance::Scale | Nuisance::Gain(_) => {
            sensed.recordings.iter().any(|r| !r.poses)
        }
        Nuisance::Lean => sensed.gravity != Vector3::zeros(),
        Nuisance::Rotation | Nuisance::Drift => true,
    }
}
