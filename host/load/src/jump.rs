//! Jumps of the sensor's bias.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::settle::settled;
use crate::system::{Fit, Jump, Sensed};

/// Probability by chance, of all channels and places together, below which the bias is said to jump.
const JUMPS: f64 = 1e-4;
/// Least number of segments on either side of a jump.
const LEAST_SIDE: usize = 3;

/// Finds the clearest jump of the bias between two jumps that are known, or the clearest pair: of two opposite jumps neither
/// is seen alone. The means of the residuals over the segments beside them differ by more than they differ among themselves
/// (F test, corrected for all places and channels). Empty if there is none.
pub(crate) fn jumps(sensed: &Sensed, fit: &Fit) -> Vec<Jump> {
    let (mut least, mut clearest) = (JUMPS, Vec::new());
    for (recording, means) in sensed.mean_residuals(fit) {
        if sensed.recordings[recording].poses {
            let between = means.iter().map(|(segment, _)| *segment);
            if let Some((p, jump)) = between_poses(sensed, fit, recording, between.collect())
                && p < least
            {
                (least, clearest) = (p, vec![jump]);
            }
            continue;
        }
        let places = places(means.len());
        for channel in 0..6 {
            let list: Vec<f64> = means.iter().map(|(_, own)| own[channel]).collect();
            for own in &places {
                let as_many = places.iter().filter(|other| other.len() == own.len());
                let p = 6.0 * as_many.count() as f64 * chance_of(&list, own);
                if p < least {
                    least = p;
                    let jump = |place: &usize| Jump {
                        recording,
                        segment: means[*place].0,
                    };
                    clearest = own.iter().map(jump).collect();
                }
            }
        }
    }
    clearest
}

/// Returns the jump between two poses with which the fit leaves least, and the probability that any such jump leaves as little
/// by chance (F test). The load takes up much of a jump between few poses, so each is fitted.
fn between_poses(
    sensed: &Sensed,
    fit: &Fit,
    recording: usize,
    segments: Vec<usize>,
) -> Option<(f64, Jump)> {
    let places = LEAST_SIDE..(segments.len() + 1).saturating_sub(LEAST_SIDE);
    let count = places.len() as f64;
    let fits = places.map(|place| {
        let segment = segments[place];
        let jump = Jump { recording, segment };
        let mut unknowns = fit.unknowns.clone();
        unknowns.jumps.push(jump);
        (settled(sensed, &fit.mounting, &unknowns), jump)
    });
    let (larger, jump) = fits.min_by(|a, b| a.0.misfit().total_cmp(&b.0.misfit()))?;
    Some((count * larger.chance_over(fit)?, jump))
}

/// Returns the places of one jump and of two in a stretch of segments.
fn places(count: usize) -> Vec<Vec<usize>> {
    let one = |from: usize| from + LEAST_SIDE..(count + 1).saturating_sub(LEAST_SIDE);
    // The segments beside a jump are left out.
    let is_long = |jumps: usize| count >= (jumps + 1) * LEAST_SIDE + 2 * jumps;
    let mut all = Vec::new();
    if is_long(1) {
        all.extend(one(0).map(|place| vec![place]));
    }
    if is_long(2) {
        all.extend(one(0).flat_map(|first| one(first).map(move |second| vec![first, second])));
    }
    all
}

/// Returns the probability that groups of values with one mean differ by chance as much (one-way analysis of variance). A
/// group begins at each place.
fn chance_of(list: &[f64], places: &[usize]) -> f64 {
    let squares = rig_numerics::statistics::squares_about_mean;
    let ends = places.iter().copied().chain([list.len()]);
    let begins = [0].into_iter().chain(places.iter().copied());
    let within: f64 = begins.zip(ends).map(|(a, b)| squares(&list[a..b])).sum();
    let further = places.len() as f64;
    let freedom = list.len() as f64 - further - 1.0;
    let between = (squares(list) - within).max(0.0);
    let ratio = between / further / (within / freedom).max(f64::MIN_POSITIVE);
    FisherSnedecor::new(further, freedom).map_or(1.0, |d| d.sf(ratio))
}
