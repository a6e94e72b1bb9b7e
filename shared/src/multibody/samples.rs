//! Seeded chains, bodies and motions for the tests of this folder.
#![allow(clippy::unwrap_used)]

use std::vec::Vec;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{COLUMNS, Chain, JointGeometry, JointKind, column};

/// Returns the ten inertial parameters of one kilogram at a point, m.
pub(crate) fn unit_point([x, y, z]: [f64; 3]) -> [f64; 10] {
    let [xx, yy, zz] = [y * y + z * z, x * x + z * z, x * x + y * y];
    [1.0, x, y, z, xx, -x * y, -x * z, yy, -y * z, zz]
}

/// A chain in a state of motion.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    pub(crate) geometry: Vec<JointGeometry<f64>>,
    pub(crate) gravity: [f64; 3],
    pub(crate) parameters: Vec<[f64; COLUMNS]>,
    pub(crate) q: Vec<f64>,
    pub(crate) qd: Vec<f64>,
    pub(crate) qdd: Vec<f64>,
}

impl Sample {
    /// Returns a random chain of `n` joints. Every link is a set of eight mass points, so it is a real body.
    pub(crate) fn random(n: usize, seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ n as u64);
        let mut uniform = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let geometry = (0..n)
            .map(|_| JointGeometry {
                kind: if uniform(0.0, 1.0) < 0.6 {
                    JointKind::Revolute
                } else {
                    JointKind::Prismatic
                },
                // Every third twist is a quarter turn, as on real robots.
                alpha: match uniform(0.0, 3.0) {
                    x if x < 1.0 => core::f64::consts::FRAC_PI_2 * (4.0 * x - 2.0).round(),
                    x => x - 2.0,
                },
                a: uniform(-0.6, 0.6),
                theta: uniform(-3.0, 3.0),
                d: uniform(-0.5, 0.5),
            })
            .collect();
        let parameters = (0..n)
            .map(|_| {
                let mut row = [0.0; COLUMNS];
                for _ in 0..8 {
                    let m = uniform(0.05, 1.0);
                    let (x, y, z) = (uniform(-0.4, 0.5), uniform(-0.3, 0.3), uniform(-0.2, 0.4));
                    for (entry, value) in row.iter_mut().zip(unit_point([x, y, z])) {
                        *entry += m * value;
                    }
                }
                row[column::DRIVE_INERTIA] = uniform(0.0, 0.5);
                row[column::VISCOUS] = uniform(0.0, 2.0);
                row[column::COULOMB] = uniform(0.0, 2.0);
                row[column::OFFSET] = uniform(-1.0, 1.0);
                row
            })
            .collect();
        let mut signals = |range: f64| (0..n).map(|_| uniform(-range, range)).collect::<Vec<_>>();
        let (q, qd, qdd) = (signals(3.0), signals(3.0), signals(10.0));
        Self {
            geometry,
            gravity: [uniform(-9.0, 9.0), uniform(-9.0, 9.0), uniform(-9.0, 9.0)],
            parameters,
            q,
            qd,
            qdd,
        }
    }

    /// Returns chains of 1 to 8 joints, `each` of every length.
    pub(crate) fn many(each: u64) -> impl Iterator<Item = Self> {
        (1..=8).flat_map(move |n| (0..each).map(move |seed| Self::random(n, seed)))
    }

    pub(crate) fn n(&self) -> usize {
        self.geometry.len()
    }

    pub(crate) fn chain(&self) -> Chain<f64> {
        Chain::new(&self.geometry, self.gravity).unwrap()
    }

    /// Returns the same without drive inertia, friction and offsets.
    pub(crate) fn links_only(&self) -> Self {
        let mut bare = self.clone();
        for row in &mut bare.parameters {
            row[column::DRIVE_INERTIA..].fill(0.0);
        }
        bare
    }
}

/// Returns the largest difference of two vectors over the larger of 1 and the largest entry.
pub(crate) fn relative_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let scale = a.iter().chain(b).fold(1.0, |m: f64, x| m.max(x.abs()));
    // `max` would lose a NaN.
    a.iter().zip(b).fold(0.0, |m: f64, (x, y)| {
        let difference = (x - y).abs() / scale;
        if difference <= m { m } else { difference }
    })
}
