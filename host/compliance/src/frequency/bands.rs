//! The frequency response in bands: averages over neighbouring bins and segments.
//!
//! H = S_rv/S_rτ with an instrument r (the reference, or the torque itself). With feedback the plain estimate S_τv/S_ττ is
//! biased, because noise reaches the torque through the controller; the ratio of both cross spectra with the reference is
//! not (Bendat & Piersol 2010, ch. 9; Söderström & Stoica 1989, instrumental variables).

use std::f64::consts::TAU;

use serde::Serialize;

use super::bin::{Bin, EXCITED};
use super::spectra::Spectra;
use super::two_mass::C;

/// Averages of a band at least.
const AVERAGES: f64 = 8.0;
/// Relative width of a band.
const WIDTH: f64 = 0.025;
/// Probability that the true response lies outside of the circle about a band's.
const OUTSIDE: f64 = 0.05;
/// Probability by which a coherence is beyond that of unrelated noise.
const CERTAIN: f64 = 0.99;

/// The frequency response in one band.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Band {
    /// Centre, Hz.
    pub frequency: f64,
    /// |H|, velocity per torque, rad/s per N·m or m/s per N.
    pub magnitude: f64,
    /// Phase of H, rad.
    pub phase: f64,
    /// Radius of the 95 % circle about H, unit of the magnitude.
    pub radius: f64,
    /// Coherence, 0 to 1: of torque and velocity, or the smaller of both with the reference.
    pub coherence: f64,
    /// Number of independent averages.
    pub averages: f64,
    /// True if the band is excited and its coherence significant: the fit uses it.
    pub used: bool,
}

/// A band with its bins and the noise of the velocity in it.
pub(crate) struct BandBins<'a> {
    pub band: Band,
    pub bins: &'a [Bin],
    /// Density of the velocity's noise.
    pub noise: f64,
}

/// Divides the spectra into bands.
pub(crate) fn bands(spectra: &Spectra) -> Vec<BandBins<'_>> {
    let mut bands = Vec::new();
    let mut rest = spectra.bins.as_slice();
    // A transform over T seconds resolves 1/T; the lowest bins hold what the line through the ends leaves.
    let least = (AVERAGES / spectra.weight).ceil() as usize;
    while let Some(first) = rest.first() {
        let end = first.omega * (1.0 + WIDTH);
        let count = rest.partition_point(|bin| bin.omega <= end).max(least);
        if count > rest.len() {
            break;
        }
        let (own, more) = rest.split_at(count);
        bands.extend(band(own, spectra.weight, spectra.by_reference));
        rest = more;
    }
    let acceleration = |band: &BandBins<'_>| -> f64 {
        let derivatives = if spectra.by_reference { 2 } else { 0 };
        let squares = band.bins.iter().map(|b| {
            let acceleration = b.instrument * b.omega.powi(derivatives);
            acceleration.norm_sqr()
        });
        (squares.sum::<f64>() / band.bins.len() as f64).sqrt()
    };
    let most = bands.iter().map(acceleration).fold(0.0, f64::max);
    for band in &mut bands {
        band.band.used &= acceleration(band) > EXCITED * most;
    }
    bands
}

fn band(bins: &[Bin], weight: f64, by_reference: bool) -> Option<BandBins<'_>> {
    let sum = |of: &dyn Fn(&Bin) -> C| bins.iter().map(of).sum::<C>();
    let power = |of: &dyn Fn(&Bin) -> C| bins.iter().map(|b| of(b).norm_sqr()).sum::<f64>();
    let cross_torque = sum(&|b| b.instrument.conj() * b.torque);
    let cross_velocity = sum(&|b| b.instrument.conj() * b.velocity);
    let [instrument, torque, velocity] = [
        power(&|b| b.instrument),
        power(&|b| b.torque),
        power(&|b| b.velocity),
    ];
    let response = cross_velocity / cross_torque;
    if !response.is_finite() || instrument == 0.0 {
        return None;
    }
    let coherence = |cross: C, own: f64| (cross.norm_sqr() / (instrument * own)).min(1.0);
    let of_velocity = coherence(cross_velocity, velocity);
    let coherence = match by_reference {
        true => of_velocity.min(coherence(cross_torque, torque)),
        false => of_velocity,
    };
    let count = bins.len() as f64;
    let averages = count * weight;
    let noise = power(&|b| b.velocity - response * b.torque) / count * averages / (averages - 1.0);
    // Variance of H by an instrument; with r = τ it is that of Bendat & Piersol.
    let variance = noise * instrument / cross_torque.norm_sqr() * count / averages;
    // The quantile of F with 2 and 2·(n − 1) degrees of freedom in closed form.
    let quantile = (averages - 1.0) * (OUTSIDE.powf(-1.0 / (averages - 1.0)) - 1.0);
    let chance = 1.0 - (1.0 - CERTAIN).powf(1.0 / (averages - 1.0));
    Some(BandBins {
        band: Band {
            frequency: bins.iter().map(|b| b.omega).sum::<f64>() / count / TAU,
            magnitude: response.norm(),
            phase: response.arg(),
            radius: (quantile * variance).sqrt(),
            coherence,
            averages,
            used: coherence > chance,
        },
        bins,
        noise,
    })
}
