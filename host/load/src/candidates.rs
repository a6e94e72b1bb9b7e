//! Which exchanges of channels, rotations and scales the readings suggest. Forces and moments are asked one by one, because
//! a fault of one kind would bend what the other kind says.

use nalgebra::{DMatrix, Matrix3};
use rig_numerics::svd::Svd;

use crate::mounting::{Channels, Mounting, signed_permutations};
use crate::statistics::column;
use crate::system::{Nuisance, Sensed, Unknowns};

/// Orders of the channels of a kind that are kept; the opposite ones count as one.
const KEPT: usize = 3;
/// Exchanges of channels that are kept.
const CHANNELS: usize = 3;
/// Ratio of the second singular value to the first below which the weight has one direction only.
const ONE_DIRECTION: f64 = 1e-3;
/// Scales of the moments that are tried as a start: powers of ten, and three values between them.
const STARTS_PER_DECADE: i32 = 4;
/// Largest power of ten.
const DECADES: i32 = 4;

/// Returns the mountings of a turned sensor: for the stated sign of its readings, and for the opposite one, the rotation
/// that turns the forces to the weight best (Kabsch 1976; Arun, Huang & Blostein 1987). No rotation needs to be known
/// before. `None` if the weight has one direction only.
pub(crate) fn turned(sensed: &Sensed, mounting: &Mounting) -> Vec<Mounting> {
    let covariance = weights_by_forces(sensed);
    let sign = mounting.force.determinant().signum();
    let svd = Svd::of(DMatrix::from_column_slice(3, 3, covariance.as_slice()));
    let sizes = &svd.singular_values;
    if !(sizes[1] > ONE_DIRECTION * sizes[0]) {
        return Vec::new();
    }
    let [mut u, v] = [&svd.u, &svd.v_t].map(|m| Matrix3::from_iterator(m.iter().copied()));
    // Weights in a plane leave the third direction to the first two.
    u.set_column(2, &u.column(0).cross(&u.column(1)));
    let least = 2;
    [sign, -sign]
        .map(|sense| {
            let mut signs = Matrix3::identity() * sense;
            let is_mirrored = (u * signs * v).determinant() < 0.0;
            if is_mirrored {
                signs[(least, least)] *= -1.0;
            }
            let rotation = u * signs * v;
            Mounting {
                force: rotation * sign,
                moment: rotation * sign,
                ..mounting.clone()
            }
        })
        .to_vec()
}

/// Returns the covariance of the acceleration of the sensor against gravity (rows) with the forces as read (columns).
fn weights_by_forces(sensed: &Sensed) -> Matrix3<f64> {
    let mut sum = Matrix3::zeros();
    for recorded in sensed.recordings.iter().filter(|r| r.loaded) {
        for axis in 0..3 {
            let mut products = DMatrix::<f64>::zeros(1, 3);
            let (mut of_weight, mut of_forces) = (0.0, DMatrix::<f64>::zeros(1, 3));
            let mut rows = 0.0;
            for segment in &recorded.segments {
                let triangle = &segment.channels[axis];
                let weight = triangle.column(0);
                let one = triangle.column(column::ONE);
                let forces = triangle.columns(column::READINGS, 3);
                products += weight.transpose() * forces;
                of_forces += one.transpose() * forces;
                of_weight += weight.dot(&one);
                rows += segment.rows as f64;
            }
            for k in 0..3 {
                sum[(axis, k)] += products[(0, k)] - of_weight * of_forces[(0, k)] / rows;
            }
        }
    }
    sum
}

/// Returns the right-handed orders of the channels of a kind that fit best if the kind is fitted alone, with the squares that
/// they leave, the best first. An order and its opposite leave the same, with the opposite load.
fn orders(
    sensed: &Sensed,
    mounting: &Mounting,
    unknowns: &Unknowns,
    kind: usize,
) -> Vec<(f64, Matrix3<f64>)> {
    let right_handed = signed_permutations().into_iter();
    let mut found: Vec<(f64, Matrix3<f64>)> = right_handed
        .filter(|matrix| matrix.determinant() > 0.0)
        .map(|matrix| {
            let own = mounting.after(&Channels {
                force: matrix,
                moment: matrix,
            });
            (sensed.squares_alone(&own, unknowns, kind), matrix)
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.truncate(KEPT);
    found
}

/// Returns exchanges of channels beside another scale of the moments, with the scale that fits each best as a start.
/// Forces and moments are put in order one by one, because a scale does not change what either leaves alone. With
/// `sign_stated` the mass must be positive.
pub(crate) fn exchanged_and_scaled(
    sensed: &Sensed,
    mounting: &Mounting,
    unknowns: &Unknowns,
    sign_stated: bool,
) -> Vec<(Channels, Mounting)> {
    let [forces, moments] = [0, 1].map(|kind| orders(sensed, mounting, unknowns, kind));
    let mut pairs: Vec<(f64, Channels)> = Vec::new();
    for (of_forces, force) in &forces {
        for (of_moments, moment) in &moments {
            let score = of_forces.ln() + of_moments.ln();
            pairs.extend([1.0, -1.0].map(|sign| {
                let channels = Channels {
                    force: *force,
                    moment: *moment * sign,
                };
                (score, channels)
            }));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let signed = |(_, channels): (f64, Channels)| {
        let start = scaled(sensed, &mounting.after(&channels), unknowns);
        let mass = sensed.fit(&start, unknowns).values.first().copied();
        let opposite = Channels {
            force: -channels.force,
            moment: -channels.moment,
        };
        let is_opposite = match sign_stated {
            true => mass.is_some_and(|mass| mass < 0.0),
            false => opposite.changes() < channels.changes(),
        };
        match is_opposite {
            true => (opposite, start.opposite()),
            false => (channels, start),
        }
    };
    let kept = pairs.into_iter().take(2 * CHANNELS).map(signed);
    // A turned sensor in another unit is a cause of its own.
    let is_other = |(own, _): &(Channels, Mounting)| {
        !own.is_rotation() && (sign_stated || !own.is_opposite_rotation())
    };
    kept.filter(is_other).collect()
}

/// Returns the exchanges of channels that fit best, the best first. Rotations of both kinds alike are left out. With
/// `sign_stated` the mass must be positive.
pub(crate) fn exchanged(
    sensed: &Sensed,
    mounting: &Mounting,
    unknowns: &Unknowns,
    sign_stated: bool,
) -> Vec<Channels> {
    let both = |kind: usize| -> Vec<Matrix3<f64>> {
        let own = orders(sensed, mounting, unknowns, kind).into_iter();
        own.flat_map(|(_, matrix)| [matrix, -matrix]).collect()
    };
    let (forces, moments) = (both(0), both(1));
    let mut found: Vec<(f64, Channels)> = Vec::new();
    for force in &forces {
        for moment in &moments {
            let channels = Channels {
                force: *force,
                moment: *moment,
            };
            let is_turned =
                channels.is_rotation() || !sign_stated && channels.is_opposite_rotation();
            if is_turned || *force == -Matrix3::identity() && force == moment {
                continue;
            }
            let fit = sensed.fit(&mounting.after(&channels), unknowns);
            let positive = fit.values.first().is_some_and(|mass| *mass > 0.0);
            if positive || !sign_stated {
                found.push((fit.misfit(), channels));
            }
        }
    }
    // Equally good ones, as the two opposite readings of all channels: the one nearest to the file first.
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut kept: Vec<(f64, Channels)> = Vec::new();
    for (misfit, channels) in found {
        match kept.iter_mut().find(|own| (own.0 - misfit).abs() < 1e-3) {
            Some(own) if own.1.changes() > channels.changes() => own.1 = channels,
            Some(_) => {}
            None => kept.push((misfit, channels)),
        }
    }
    let kept = kept.into_iter().take(CHANNELS);
    kept.map(|(_, channels)| channels).collect()
}

/// Returns the mounting with the scale of the moments that fits best, as a start.
pub(crate) fn scaled(sensed: &Sensed, mounting: &Mounting, unknowns: &Unknowns) -> Mounting {
    let last = STARTS_PER_DECADE * DECADES;
    let starts = (-last..=last).map(|k| 10f64.powf(f64::from(k) / f64::from(STARTS_PER_DECADE)));
    let fits = starts.map(|factor| sensed.fit(&mounting.scaled(factor), unknowns));
    let best = fits.min_by(|a, b| a.misfit().total_cmp(&b.misfit()));
    let start = best.map_or_else(|| mounting.clone(), |fit| fit.mounting);
    crate::settle::settled(sensed, &start, &unknowns.with(Nuisance::Scale)).mounting
}
