//! Signals of the recordings, collected as regression rows of one joint's deflection.

use std::f64::consts::TAU;

use rig_shared::effects::Kind;

use crate::DiagnoseError;
use crate::columns::effect_columns::Source;
use crate::link_encoder::equation::{Equation, Side, Wave};
use crate::recordings::context::PreparedData;
use crate::recordings::noise_floor;
use crate::rows::motion::links_of;
use crate::rows::regression::{Column, Rows};
use crate::rows::thinning::Thinning;
use rig_data::prepare::{LowPass, central_difference};
use rig_data::runs::{JointRun, Run, across_band, resolution};
use rig_model::robot::{Joint, JointKind};

/// Widths of the torque's sign change over which contact changes flanks, relative to its RMS: an impact, blurred by
/// filters.
const WIDTHS: [f64; 5] = [0.02, 0.05, 0.1, 0.2, 0.35];
/// Shares of the joint's Coulomb friction that act on the link and load the contact.
const SHARES: [f64; 4] = [0.0, 0.25, 0.5, 1.0];
/// Orders of waves over a turn of the motor and over one of the joint.
const ORDERS: [f64; 2] = [1.0, 2.0];

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
        let here = measured(source, joint, prepared);
        if here.is_empty() {
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
        let filters = Filters {
            thinning,
            position: filter,
            band: &band,
        };
        let mut collected = Collected::new(&robot.joints[joint], recordings, sides);
        let mut mass = 0.0;
        for ((&r, load), smooth) in here.iter().zip(&loads).zip(&smooth) {
            if collected.push(&filters, &prepared.runs[r], joint, [load, smooth]) {
                mass += source.mass(joint, r)? / here.len() as f64;
            }
        }
        let parts = parts_of(source, joint, prepared, &here, &band)?;
        let recorded: Vec<Run> = here
            .iter()
            .map(|&r| apart(&prepared.runs[r], joint))
            .collect();
        let count = collected.x.len();
        Ok(Some(Self {
            rows: Rows {
                thinning: thinning.clone(),
                count,
                starts: collected.starts,
                period: prepared.rows.period,
                torque: vec![collected.x],
                keep: vec![vec![true; count]],
                legible: Vec::new(),
                clear: Vec::new(),
                left_out: Vec::new(),
                nominal: collected.nominal.into_iter().map(one).collect(),
            },
            constants: collected.recordings.len(),
            load: one(collected.load),
            change: one(collected.change),
            direction: one(collected.direction),
            levels: collected.levels.into_iter().map(one).collect(),
            sides: collected.sides,
            waves: (collected.waves.into_iter())
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
            pairs: pairs_of(prepared, &here),
            filters: [filter.clone(), band.clone()],
            rates: collected.rates,
            runs: collected.runs,
            coordinates: collected.coordinates,
            kind: robot.joints[joint].kind,
        }))
    }
}

/// Returns the runs with a link encoder; none if a drive moves several joints.
fn measured(source: &Source, joint: usize, prepared: &PreparedData) -> Vec<usize> {
    let mut drives = source.robot.joints.iter().filter_map(|j| j.drive.as_ref());
    if drives.any(|d| !d.couples.is_empty()) {
        return Vec::new();
    }
    (0..prepared.runs.len())
        .filter(|r| prepared.runs[*r].joints[joint].link.is_some())
        .collect()
}

/// Returns the pairs of the runs `here` that repeat one motion.
fn pairs_of(prepared: &PreparedData, here: &[usize]) -> Vec<(usize, usize)> {
    let places = |r: &usize| here.iter().position(|h| h == r);
    (noise_floor::repeats(&prepared.runs).iter())
        .filter_map(|(a, b)| places(a).zip(places(b)))
        .collect()
}

/// Filters from the signals of a run to rows.
struct Filters<'a> {
    /// Low-pass and thinning of all rows.
    thinning: &'a Thinning,
    /// Filter of the positions.
    position: &'a LowPass,
    /// Additional filter across the transmission.
    band: &'a LowPass,
}

impl Filters<'_> {
    /// Appends the rows of a signal that was computed from unfiltered data.
    fn push(&self, signal: &[f64], out: &mut Vec<f64>) {
        let smooth = self.band.zero_phase(&self.position.zero_phase(signal));
        self.thinning.push(&smooth, &[], out);
    }
}

/// Columns of the equation so far, in the order of the runs; see [`Equation`].
struct Collected {
    /// Recordings of the runs, each once.
    recordings: Vec<usize>,
    sides: Vec<Side>,
    /// Motor turns per joint turn.
    ratio: f64,
    x: Vec<f64>,
    nominal: Vec<Vec<f64>>,
    load: Vec<f64>,
    change: Vec<f64>,
    direction: Vec<f64>,
    levels: Vec<Vec<f64>>,
    waves: Vec<(Kind, f64, [Vec<f64>; 2])>,
    coordinates: [Vec<f64>; 4],
    runs: Vec<(usize, [Vec<f64>; 3])>,
    rates: Vec<f64>,
    starts: Vec<usize>,
}

impl Collected {
    fn new(joint: &Joint, recordings: Vec<usize>, sides: Vec<Side>) -> Self {
        Self {
            ratio: joint.gear_ratio(),
            x: Vec::new(),
            nominal: vec![Vec::new(); recordings.len() + 2],
            load: Vec::new(),
            change: Vec::new(),
            direction: Vec::new(),
            levels: vec![Vec::new(); sides.len()],
            waves: waves_of(joint),
            coordinates: [const { Vec::new() }; 4],
            runs: Vec::new(),
            rates: Vec::new(),
            starts: vec![0],
            recordings,
            sides,
        }
    }

    /// Appends the rows of a run with its gear torque, at the rate of the run and `smooth`. Returns false if the run has
    /// no link encoder.
    fn push(
        &mut self,
        filters: &Filters,
        run: &Run,
        joint: usize,
        [load, smooth]: [&Vec<f64>; 2],
    ) -> bool {
        let own = &run.joints[joint];
        let Some([q, v, _]) = &own.link else {
            return false;
        };
        let thinning = filters.thinning;
        let apart: Vec<f64> = own.q.iter().zip(q).map(|(a, b)| a - b).collect();
        thinning.push(&apart, &[], &mut self.x);
        let before = self.starts.last().copied().unwrap_or(0);
        let rows = self.x.len() - before;
        let constants = self.recordings.len();
        for (column, recording) in self.nominal.iter_mut().zip(&self.recordings) {
            let one = f64::from(u8::from(*recording == run.recording));
            column.extend(std::iter::repeat_n(one, rows));
        }
        thinning.push(q, &[], &mut self.nominal[constants]);
        thinning.push(v, &[], &mut self.nominal[constants + 1]);
        thinning.push(load, &[], &mut self.load);
        thinning.push(
            &central_difference(load, 1.0 / run.rate),
            &[],
            &mut self.change,
        );
        let signs: Vec<f64> = v.iter().map(|v| sign(*v)).collect();
        filters.push(&signs, &mut self.direction);
        for (level, side) in self.levels.iter_mut().zip(&self.sides) {
            let at: Vec<f64> = (smooth.iter().zip(&signs))
                .map(|(load, sign)| side.level(load + side.friction * sign))
                .collect();
            filters.push(&at, level);
        }
        self.push_waves(filters, own);
        let within: Vec<f64> = (q.iter())
            .map(|q| (self.ratio * q).rem_euclid(TAU))
            .collect();
        for (list, signal) in self.coordinates.iter_mut().zip([smooth, v, q, &within]) {
            thinning.pick(signal, list);
        }
        let raw = own.link_raw.iter().flatten();
        let apart = own.q_raw.iter().zip(raw).map(|(a, b)| a - b).collect();
        let recording = self.recordings.iter().position(|k| *k == run.recording);
        let constant = recording.unwrap_or_default();
        self.runs.push((constant, [apart, q.clone(), v.clone()]));
        self.rates.push(run.rate);
        self.starts.push(before + rows);
        true
    }

    /// Appends cosine and sine of each wave.
    fn push_waves(&mut self, filters: &Filters, own: &JointRun) {
        for (kind, order, columns) in &mut self.waves {
            let turn = if *kind == Kind::EncoderEccentricityMotor {
                *order * self.ratio
            } else {
                *order
            };
            let of =
                |f: fn(f64) -> f64| -> Vec<f64> { own.q.iter().map(|q| f(turn * q)).collect() };
            filters.push(&of(f64::cos), &mut columns[0]);
            filters.push(&of(f64::sin), &mut columns[1]);
        }
    }
}

/// Returns the waves of a joint without rows: encoder, order, and columns of cosine and sine.
fn waves_of(joint: &Joint) -> Vec<(Kind, f64, [Vec<f64>; 2])> {
    let mut waves = Vec::new();
    for order in ORDERS {
        let mut add = |kind| waves.push((kind, order, Default::default()));
        if joint.gear_ratio().abs() > 1.0 {
            add(Kind::EncoderEccentricityMotor);
        }
        if joint.kind == JointKind::Revolute {
            add(Kind::EncoderEccentricityJoint);
        }
    }
    waves
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
                (prepared.rows.thinning).push(&band.zero_phase(values), &[], &mut parts[place].1);
            })?;
        before += prepared.rows.starts[r + 1] - prepared.rows.starts[r];
    }
    Ok(parts
        .into_iter()
        .map(|(b, values)| (b, one(values)))
        .collect())
}
