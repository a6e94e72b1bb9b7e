//! Which channel is which, and which way it counts: all exchanges and reversals of channels are compared.

use nalgebra::Matrix3;

use crate::mounting::{Channels, Mounting, signed_permutations};
use crate::statistics::Recorded;
use crate::system::{Fit, Nuisance, Sensed, Unknowns};

/// Gain of −2·ln of the likelihood from which one explanation is believed before another: odds of 3 million to one.
pub(crate) const DECISIVE: f64 = 30.0;
/// Share of the segments in which the better channels must leave less.
const NEARLY_ALL: f64 = 0.9;
/// Orders of the force channels that are kept for the comparison with the moments.
const KEPT: usize = 4;
/// Number of equally good orders that are tried with the sensor turned.
const TRIED: usize = 3;
/// Rotation at which the steps end, rad.
const SETTLED: f64 = 1e-9;
/// Largest number of steps of the rotation.
const MOST_TURNS: usize = 40;

/// Turns sensor and gravity, as far as they are among the unknowns, until the equations fit best (Gauss–Newton).
pub(crate) fn settled(sensed: &Sensed, start: &Mounting, unknowns: &Unknowns) -> Fit {
    let mut fit = sensed.fit(start, unknowns);
    for _ in 0..MOST_TURNS {
        let turns = sensed.rotations(&fit);
        let size = turns[0].norm().max(turns[1].norm());
        if size == 0.0 {
            break;
        }
        // A linear step of more than a third of a turn points nowhere.
        let [sensor, gravity] = turns.map(|by| by * (1.0 / size).min(1.0));
        let next = sensed.fit(&fit.mounting.turned(&sensor, &gravity), unknowns);
        // Likelihoods are sums over many rows: less than one is rounding and the curvature of the rotation.
        if !next.misfit().is_finite() || next.misfit() > fit.misfit() + 1.0 {
            break;
        }
        fit = next;
        if size < SETTLED {
            break;
        }
    }
    fit
}

/// Channels that explain the readings decisively better than those of the file, if there are any; and the fit with the
/// channels of the file, its rotation estimated.
pub(crate) struct Compared {
    /// Fit with the channels as recorded and the stated mounting, turned to its best.
    pub stated: Fit,
    /// Better channels with their fit.
    pub better: Option<(Channels, Fit)>,
}

/// Compares all signed permutations of the forces and of the moments. With `sign_stated` the load's mass must be positive
/// for other channels to be believed.
pub(crate) fn compare(
    sensed: &Sensed,
    mounting: &Mounting,
    unknowns: &Unknowns,
    sign_stated: bool,
) -> Compared {
    let turning = unknowns.with(Nuisance::Rotation);
    let stated = settled(sensed, mounting, &turning);
    let recordings: Vec<Recorded> = sensed.recordings.iter().map(Recorded::in_one).collect();
    let whole = Sensed {
        recordings: &recordings,
        to_joint: sensed.to_joint,
        gravity: sensed.gravity,
    };
    let found = nearest_of_the_best(&whole, mounting, unknowns, sign_stated);
    if found.iter().any(|channels| channels.changes() == 0) {
        return Compared {
            stated,
            better: None,
        };
    }
    let better = found.into_iter().take(TRIED).find_map(|channels| {
        let fit = settled(sensed, &mounting.after(&channels), &turning);
        let gain = stated.misfit() - fit.misfit();
        (gain > DECISIVE && leaves_less(sensed, &fit, &stated)).then_some((channels, fit))
    });
    Compared { stated, better }
}

/// Returns the channels that explain the readings best, those nearest to the file first.
fn nearest_of_the_best(
    sensed: &Sensed,
    mounting: &Mounting,
    unknowns: &Unknowns,
    sign_stated: bool,
) -> Vec<Channels> {
    let all = signed_permutations();
    let one = Matrix3::identity();
    let fit = |channels: &Channels| sensed.fit(&mounting.after(channels), unknowns);
    // Forces alone decide their own order; both signs leave the same, with the opposite load.
    let mut forces: Vec<(f64, Matrix3<f64>)> = (all.iter())
        .map(|force| {
            let channels = Channels {
                force: *force,
                moment: one,
            };
            (fit(&channels).squares[0], *force)
        })
        .collect();
    forces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found: Vec<(f64, Channels)> = Vec::new();
    for (_, force) in forces.into_iter().take(2 * KEPT) {
        for moment in &all {
            let channels = Channels {
                force,
                moment: *moment,
            };
            let own = fit(&channels);
            let positive = own.values.first().is_some_and(|mass| *mass > 0.0);
            if positive || !sign_stated || channels.changes() == 0 {
                found.push((own.misfit(), channels));
            }
        }
    }
    let least = found.iter().map(|(m, _)| *m).fold(f64::INFINITY, f64::min);
    found.retain(|(m, _)| *m <= least + DECISIVE);
    let order = |c: &Channels| (c.changes(), !c.is_rotation());
    found.sort_by(|a, b| order(&a.1).cmp(&order(&b.1)).then(a.0.total_cmp(&b.0)));
    found.into_iter().map(|(_, channels)| channels).collect()
}

/// A unit of the moments against that of the forces.
struct Unit {
    /// Readings in this unit per reading in SI units.
    factor: f64,
    /// Names it in a sentence.
    words: &'static str,
}

/// Units that sensors and their drivers use.
const UNITS: [Unit; 4] = [
    Unit {
        factor: 1e3,
        words: "the moments look like N·mm",
    },
    Unit {
        factor: 1e2,
        words: "the moments look like N·cm",
    },
    Unit {
        factor: 9.806_65,
        words: "the forces look like kgf",
    },
    Unit {
        factor: 1.0 / 9.806_65,
        words: "the moments look like kgf·m",
    },
];

/// Returns the unit in which moments and forces fit each other decisively better than in N·m and N, in words. Only motion
/// tells: poses at rest fit every unit, with another centre of mass.
pub(crate) fn other_unit(sensed: &Sensed, fit: &Fit) -> Option<&'static str> {
    if sensed.recordings.iter().all(|r| r.poses) || sensed.is_exact(fit) {
        return None;
    }
    let each = 0.5 * fit.equations as f64;
    let misfit = |unit: &Unit| {
        let mounting = Mounting {
            moment: fit.mounting.moment / unit.factor,
            ..fit.mounting.clone()
        };
        // The residual of the moments in the unit of the file.
        settled(sensed, &mounting, &fit.unknowns).misfit() + 2.0 * each * unit.factor.ln()
    };
    let found = UNITS.iter().map(|unit| (misfit(unit), unit.words));
    let (least, words) = found.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (fit.misfit() - least > DECISIVE).then_some(words)
}

/// Returns true if a fit leaves less than another in nearly all segments, in units of its noise.
fn leaves_less(sensed: &Sensed, fit: &Fit, other: &Fit) -> bool {
    let own = sensed.squares_by_segment(fit);
    let others = sensed.squares_by_segment(other);
    let over = |s: &[f64; 2]| s[0] / fit.noise[0].powi(2) + s[1] / fit.noise[1].powi(2);
    let less = own
        .iter()
        .zip(&others)
        .filter(|(a, b)| over(a) < over(b))
        .count();
    less as f64 >= NEARLY_ALL * own.len() as f64
}
