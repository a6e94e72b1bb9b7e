//! Regression rows for the deflection between motor and link of one joint.

use std::f64::consts::TAU;

use rig_shared::effects::Kind;

use crate::DiagnoseError;
use crate::acceptance::coordinates::Coordinate;
use crate::columns::effect_columns::Source;
use crate::recordings::context::PreparedData;
use crate::recordings::noise_floor;
use crate::rows::motion::links_of;
use crate::rows::regression::{Column, Rows};
use rig_data::prepare::{LowPass, central_difference};
use rig_data::runs::{JointRun, Run, across_band, resolution};
use rig_model::robot::JointKind;

/// Index of the gear torque among the coordinates.
pub(crate) const ACROSS: usize = 0;
/// Widths of the torque's sign change over which contact changes flanks, relative to its RMS: an impact, blurred by
/// filters.
const WIDTHS: [f64; 5] = [0.02, 0.05, 0.1, 0.2, 0.35];
/// Shares of the joint's Coulomb friction that act on the link and load the contact.
const SHARES: [f64; 4] = [0.0, 0.25, 0.5, 1.0];
/// Orders of waves over a turn of the motor and over one of the joint.
const ORDERS: [f64; 2] = [1.0, 2.0];

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
    runs: Vec<(usize, [Vec<f64>; 3])>,
    coordinates: [Vec<f64>; 4],
    kind: JointKind,
}

impl Equation {
    /// Builds the rows of a joint; `None` without a link encoder. `filter` is that of the positions; signals from
    /// unfiltered data pass it too. `constant_side` are those of the training data.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn of(
        source: &Source,
        joint: usize,
        prepared: &PreparedData,
        filter: &LowPass,
        sides: Option<&[Side]>,
    ) -> Result<Option<Self>, DiagnoseError> {
        let robot = source.robot;
        let own = &robot.joints[joint];
        let alone =
            (robot.joints.iter().filter_map(|j| j.drive.as_ref())).all(|d| d.couples.is_empty());
        let here: Vec<usize> = (0..prepared.runs.len())
            .filter(|r| prepared.runs[*r].joints[joint].link.is_some())
            .collect();
        if here.is_empty() || !alone {
            return Ok(None);
        }
        let thinning = &prepared.rows.thinning;
        let Some(band) = across_band(prepared.runs[here[0]].rate) else {
            return Ok(None);
        };
        let loads = (here.iter())
            .map(|&r| Ok(band.zero_phase(&source.load_of_link(joint, r)?)))
            .collect::<Result<Vec<Vec<f64>>, DiagnoseError>>()?;
        let smooth: Vec<Vec<f64>> = loads.iter().map(|l| thinning.smooth(l)).collect();
        let friction = source.coulomb(joint);
        let sides = sides.map_or_else(|| sides_of(&smooth, friction), <[Side]>::to_vec);
        let mut recordings: Vec<usize> = here.iter().map(|&r| prepared.runs[r].recording).collect();
        recordings.dedup();
        let constants = recordings.len();
        let mut x = Vec::new();
        let mut nominal = vec![Vec::new(); constants + 2];
        let [mut load, mut change, mut direction] = [const { Vec::new() }; 3];
        let mut levels = vec![Vec::new(); sides.len()];
        let ratio = own.gear_ratio();
        let mut waves: Vec<(Kind, f64, [Vec<f64>; 2])> = Vec::new();
        for order in ORDERS {
            let mut add = |kind| waves.push((kind, order, Default::default()));
            if ratio.abs() > 1.0 {
                add(Kind::EncoderEccentricityMotor);
            }
            if own.kind == JointKind::Revolute {
                add(Kind::EncoderEccentricityJoint);
            }
        }
        let mut coordinates = [const { Vec::new() }; 4];
        let (mut at_full_rate, mut rates) = (Vec::new(), Vec::new());
        let mut starts = vec![0];
        let mut mass = 0.0;
        for ((&r, load_here), smooth) in here.iter().zip(&loads).zip(&smooth) {
            let run = &prepared.runs[r];
            let joint_run = &run.joints[joint];
            let Some([q, v, _]) = &joint_run.link else {
                continue;
            };
            let apart: Vec<f64> = joint_run.q.iter().zip(q).map(|(a, b)| a - b).collect();
            let push = |signal: &[f64], out: &mut Vec<f64>| {
                thinning.push(&band.zero_phase(&filter.zero_phase(signal)), out);
            };
            thinning.push(&apart, &mut x);
            let before = starts.last().copied().unwrap_or(0);
            let rows = x.len() - before;
            for (column, recording) in nominal.iter_mut().zip(&recordings) {
                let one = f64::from(u8::from(*recording == run.recording));
                column.extend(std::iter::repeat_n(one, rows));
            }
            thinning.push(q, &mut nominal[constants]);
            thinning.push(v, &mut nominal[constants + 1]);
            thinning.push(load_here, &mut load);
            thinning.push(&central_difference(load_here, 1.0 / run.rate), &mut change);
            let signs: Vec<f64> = v.iter().map(|v| sign(*v)).collect();
            push(&signs, &mut direction);
            for (level, side) in levels.iter_mut().zip(&sides) {
                let at: Vec<f64> = (smooth.iter().zip(&signs))
                    .map(|(load, sign)| side.level(load + side.friction * sign))
                    .collect();
                push(&at, level);
            }
            for (kind, order, columns) in &mut waves {
                let turn = if *kind == Kind::EncoderEccentricityMotor {
                    *order * ratio
                } else {
                    *order
                };
                let of = |f: fn(f64) -> f64| -> Vec<f64> {
                    joint_run.q.iter().map(|q| f(turn * q)).collect()
                };
                push(&of(f64::cos), &mut columns[0]);
                push(&of(f64::sin), &mut columns[1]);
            }
            let within: Vec<f64> = (q.iter()).map(|q| (ratio * q).rem_euclid(TAU)).collect();
            for (list, signal) in coordinates.iter_mut().zip([smooth, v, q, &within]) {
                thinning.pick(signal, list);
            }
            let raw = joint_run.link_raw.iter().flatten();
            let own = recordings.iter().position(|k| *k == run.recording);
            at_full_rate.push((
                own.unwrap_or_default(),
                [
                    joint_run
                        .q_raw
                        .iter()
                        .zip(raw)
                        .map(|(a, b)| a - b)
                        .collect(),
                    q.clone(),
                    v.clone(),
                ],
            ));
            rates.push(run.rate);
            mass += source.mass(joint, r)? / here.len() as f64;
            starts.push(before + rows);
        }
        let parts = parts_of(source, joint, prepared, &here, &band)?;
        let count = x.len();
        let places = |r: &usize| here.iter().position(|h| h == r);
        let pairs = (noise_floor::repeats(&prepared.runs).iter())
            .filter_map(|(a, b)| places(a).zip(places(b)))
            .collect();
        let recorded: Vec<Run> = here
            .iter()
            .map(|&r| apart(&prepared.runs[r], joint))
            .collect();
        Ok(Some(Self {
            rows: Rows {
                thinning: thinning.clone(),
                count,
                starts,
                period: prepared.rows.period,
                torque: vec![x],
                keep: vec![vec![true; count]],
                legible: Vec::new(),
                clear: Vec::new(),
                nominal: nominal.into_iter().map(one).collect(),
            },
            constants,
            load: one(load),
            change: one(change),
            direction: one(direction),
            levels: levels.into_iter().map(one).collect(),
            sides,
            waves: (waves.into_iter())
                .map(|(kind, order, columns)| Wave {
                    kind,
                    order,
                    columns: columns.map(one),
                })
                .collect(),
            parts,
            resolution: resolution(&recorded, 0).max(resolution(&recorded, 1)),
            mass,
            friction,
            pairs,
            filters: [filter.clone(), band.clone()],
            rates,
            runs: at_full_rate,
            coordinates,
            kind: own.kind,
        }))
    }

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
    fn level(&self, torque: f64) -> f64 {
        0.5 * (torque / self.width).tanh()
    }
}

fn one(values: Vec<f64>) -> Column {
    vec![Some(values)]
}

fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// Returns the tried changes between flanks, for these loads.
fn sides_of(loads: &[Vec<f64>], friction: f64) -> Vec<Side> {
    let (squares, count) =
        (loads.iter().flatten()).fold((0.0, 0_usize), |(s, n), l| (s + l * l, n + 1));
    let size = (squares / count.max(1) as f64).sqrt();
    let shares = if friction > 0.0 {
        &SHARES[..]
    } else {
        &SHARES[..1]
    };
    (WIDTHS.iter())
        .flat_map(|width| {
            shares.iter().map(move |share| Side {
                width: width * size,
                friction: share * friction,
            })
        })
        .filter(|side| side.width > 0.0)
        .collect()
}

/// Returns the two encoders of a joint as two joints, to find their steps.
fn apart(run: &Run, joint: usize) -> Run {
    let own = &run.joints[joint];
    let of = |raw: &[f64]| JointRun {
        q_raw: raw.to_vec(),
        ..JointRun::default()
    };
    Run {
        joints: vec![
            of(&own.q_raw),
            of(own.link_raw.as_deref().unwrap_or_default()),
        ],
        ..Run::default()
    }
}

/// Returns the part of a joint's load by each base parameter, over the rows.
fn parts_of(
    source: &Source,
    joint: usize,
    prepared: &PreparedData,
    here: &[usize],
    band: &LowPass,
) -> Result<Vec<(usize, Column)>, DiagnoseError> {
    let mut parts: Vec<(usize, Vec<f64>)> = Vec::new();
    let mut before = 0;
    for &r in here {
        let run = &prepared.runs[r];
        let motion = links_of(run);
        source
            .nominal
            .columns([&motion[0], &motion[1], &motion[2]], &mut |k, j, values| {
                if j != joint || source.nominal.is_drive(k) {
                    return;
                }
                let known = parts.iter().position(|(b, _)| *b == k);
                let place = known.unwrap_or_else(|| {
                    parts.push((k, vec![0.0; before]));
                    parts.len() - 1
                });
                (prepared.rows.thinning).push(&band.zero_phase(values), &mut parts[place].1);
            })?;
        before += prepared.rows.starts[r + 1] - prepared.rows.starts[r];
    }
    Ok(parts
        .into_iter()
        .map(|(b, values)| (b, one(values)))
        .collect())
}
