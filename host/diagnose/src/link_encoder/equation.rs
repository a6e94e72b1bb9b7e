//! Equation of the deflection between motor and link of one joint.

use rig_shared::effects::Kind;

use crate::acceptance::coordinates::Coordinate;
use crate::rows::regression::{Column, Rows};
use rig_data::prepare::LowPass;
use rig_model::robot::JointKind;

/// Index of the gear torque among the coordinates.
pub(crate) const ACROSS: usize = 0;
/// Index of the motor angle within a turn.
pub(crate) const MOTOR_ANGLE: usize = 3;

/// A change between flanks: width and Coulomb friction of the link, N·m or N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Side {
    pub(crate) width: f64,
    pub(crate) friction: f64,
}

/// A wave over an angle.
pub(crate) struct Wave {
    /// Wave of the motor encoder or of the joint encoder.
    pub(crate) kind: Kind,
    /// Periods per turn.
    pub(crate) order: f64,
    /// Cosine and sine.
    pub(crate) columns: [Column; 2],
}

/// Rows of one joint's q − ql.
pub(crate) struct Equation {
    /// q − ql takes the torque's place, rad or m. Nominal: a constant per recording, position and velocity of the link.
    pub(crate) rows: Rows,
    /// Number of constants among the nominal columns.
    pub(crate) constants: usize,
    /// Gear torque by the model for the link's measured motion, N·m or N.
    pub(crate) load: Column,
    /// Its rate of change.
    pub(crate) change: Column,
    /// Direction of the link's motion.
    pub(crate) direction: Column,
    /// Flank in contact, −½ to ½, for each of `constant_side`.
    pub(crate) levels: Vec<Column>,
    pub(crate) sides: Vec<Side>,
    pub(crate) waves: Vec<Wave>,
    /// Part of the load by each base parameter: parameter and values.
    pub(crate) parts: Vec<(usize, Column)>,
    /// Larger step of both encoders, rad or m.
    pub(crate) resolution: f64,
    /// Inertia that the gear carries, kg·m² or kg.
    pub(crate) mass: f64,
    /// Coulomb friction of the joint, N·m or N.
    pub(crate) friction: f64,
    /// Pairs of these runs that repeat one motion.
    pub(crate) pairs: Vec<(usize, usize)>,
    /// Filter of the positions, and additional filter across the transmission.
    pub(crate) filters: [LowPass; 2],
    /// Rate of each run, Hz.
    pub(crate) rates: Vec<f64>,
    /// Each run at its own rate: index of its constant, q − ql as recorded, position and velocity of the link.
    pub(super) runs: Vec<(usize, [Vec<f64>; 3])>,
    pub(super) coordinates: [Vec<f64>; 4],
    pub(super) kind: JointKind,
}

impl Equation {
    /// Returns q − ql as recorded, run by run at its own rate, minus the nominal columns with these coefficients.
    pub(crate) fn apart_of(&self, nominal: &[f64]) -> Vec<Vec<f64>> {
        let [scale, instant] = [0, 1].map(|k| nominal[self.constants + k]);
        (self.runs.iter())
            .map(|(own, [x, q, v])| {
                (x.iter().zip(q).zip(v))
                    .map(|((x, q), v)| x - nominal[*own] - scale * q - instant * v)
                    .collect()
            })
            .collect()
    }

    /// Returns the coordinates that q − ql may depend on; the gear torque is at [`ACROSS`].
    pub(crate) fn coordinates(&self) -> Vec<Coordinate> {
        let (p, f) = self.kind.units();
        let v = match self.kind {
            JointKind::Revolute => "rad/s",
            JointKind::Prismatic => "m/s",
        };
        let names = [
            ("torque on the gear", f),
            ("velocity of the link", v),
            ("position of the link", p),
            ("motor angle within a turn", "rad"),
        ];
        (names.into_iter().zip(&self.coordinates))
            .map(|((name, unit), values)| Coordinate {
                name: name.to_owned(),
                unit,
                values: values.clone(),
            })
            .collect()
    }

    /// Returns the RMS residual of q − ql on a hold-out; each recording gets its own constant. `terms` are columns with
    /// coefficients, without the constants.
    pub(crate) fn rms(&self, terms: &[(&Column, f64)]) -> f64 {
        let mut left = self.rows.torque[0].clone();
        for (column, factor) in terms {
            for (l, c) in left.iter_mut().zip(column[0].iter().flatten()) {
                *l -= factor * c;
            }
        }
        let mut squares = 0.0;
        for constant in &self.rows.nominal[..self.constants] {
            let of = || left.iter().zip(constant[0].iter().flatten());
            let own = || of().filter(|(_, c)| **c > 0.5).map(|(l, _)| *l);
            let mean = own().sum::<f64>() / own().count().max(1) as f64;
            squares += own().map(|l| (l - mean).powi(2)).sum::<f64>();
        }
        (squares / left.len().max(1) as f64).sqrt()
    }

    /// Returns the noise of q − ql between adjacent rows: the noise floor without repeated runs.
    pub(crate) fn short_time(&self, residual: &[f64]) -> f64 {
        let (mut squares, mut count) = (0.0, 0_u32);
        for pair in self.rows.starts.windows(2) {
            for two in residual[pair[0]..pair[1]].windows(2) {
                squares += 0.5 * (two[1] - two[0]).powi(2);
                count += 1;
            }
        }
        (squares / f64::from(count.max(1))).sqrt()
    }

    /// Returns the neighbours in width at the same friction: the unknown width increases the other uncertainties.
    pub(crate) fn around(&self, k: usize) -> Option<[&Column; 2]> {
        let own = self.sides.get(k)?;
        let of = |wider: bool| {
            (self.sides.iter().enumerate())
                .filter(|(_, s)| s.friction == own.friction)
                .filter(|(_, s)| (s.width > own.width) == wider && s.width != own.width)
                .min_by(|a, b| {
                    let off = |s: &Side| (s.width - own.width).abs();
                    off(a.1).total_cmp(&off(b.1))
                })
                .map(|(i, _)| &self.levels[i])
        };
        Some([of(false)?, of(true)?])
    }
}

impl Side {
    pub(super) fn level(&self, torque: f64) -> f64 {
        0.5 * (torque / self.width).tanh()
    }
}
