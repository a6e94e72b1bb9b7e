//! Pictures of a diagnosis: residuals over the coordinate that shows an effect, and curves over time.

use rig_shared::effects::Kind;

use crate::acceptance::coordinates::{
    ACCELERATION, Coordinate, DRIVE, DRIVE_CHANGE, LOAD, POSITION, SINCE_START, TEMPERATURE,
    VELOCITY, WAY, velocity_of,
};
use crate::acceptance::residual_dependence::locate;
use crate::acceptance::residual_dependence::process::BINS;
use crate::columns::candidate::Candidate;
use crate::fit::least_squares::Fit;
use crate::models::simulated_motion::Positions;
use crate::outcome::{Curves, Map};
use crate::result::found::Found;
use crate::rows::regression::Rows;
use crate::search::chosen::with;
use crate::search::fitted_candidate::FittedCandidate;
use rig_identify::t_quantile;
use rig_model::robot::Joint;
use rig_numerics::statistics::{bins, grouped_mean};

/// Length of the stretch that is drawn over time, s.
const STRETCH: f64 = 4.0;
/// Most points of one curve.
const MOST_POINTS: usize = 2000;

/// Returns residual maps: one per step, and one per joint for the final residual.
pub(crate) fn maps(found: &Found) -> Vec<Map> {
    let rows = found.rows;
    let joints = &found.robot.joints;
    let mut list = Vec::new();
    for (k, profile) in found.found().iter().enumerate() {
        let j = profile.candidate.joint;
        let at = found.described + k;
        let before = with(found.base, &found.chosen[..at], None);
        let after = with(found.base, &found.chosen[..=at], None);
        let coordinate = telling(profile, &found.coordinates[j], joints);
        list.extend(coordinate.map(|c| Map {
            step: Some(k),
            ..map(rows, &c, [&before, &after], j).of(&joints[j])
        }));
    }
    let first = with(found.base, &found.chosen[..found.described], None);
    let last = with(found.base, found.chosen, None);
    for (j, joint) in joints.iter().enumerate() {
        let all = &found.coordinates[j];
        let places = locate(
            rows,
            all,
            &last.residual(j),
            None,
            last.block_of_rows(),
            j,
            &joint.name,
            found.floors[j],
            found.seed,
        );
        // A residual without a dependence is drawn over the first coordinate, the velocity.
        let most = places.first().map(|p| p.coordinate.clone());
        let coordinate = (all.iter())
            .find(|c| Some(&c.name) == most.as_ref())
            .or(all.first());
        list.extend(coordinate.map(|c| Map {
            // Without a step, the law would be the sum of all effects.
            law: Vec::new(),
            ..map(rows, c, [&first, &last], j).of(joint)
        }));
    }
    list
}

impl Map {
    /// Adds the name and torque unit of a joint.
    fn of(self, joint: &Joint) -> Self {
        Self {
            joint: joint.name.clone(),
            residual_unit: joint.kind.units().1.to_owned(),
            ..self
        }
    }
}

/// Returns the coordinate that shows an effect.
fn telling(profile: &FittedCandidate, all: &[Coordinate], joints: &[Joint]) -> Option<Coordinate> {
    let Candidate {
        kind, joint, other, ..
    } = profile.candidate;
    let wave = |order: f64| {
        let ratio = joints[joint].gear_ratio();
        let position = all.iter().find(|c| c.name == POSITION)?;
        let turn = std::f64::consts::TAU;
        Some(Coordinate {
            name: "motor angle within one wave".to_owned(),
            unit: "rad",
            values: (position.values.iter())
                .map(|q| (order * ratio * q).rem_euclid(turn))
                .collect(),
        })
    };
    let name = match kind {
        Kind::Cogging
        | Kind::TorqueRipple
        | Kind::GearEccentricity
        | Kind::EncoderEccentricityMotor => return wave(profile.shapes[0]),
        Kind::PositionFriction => {
            let of = |name: &str| all.iter().find(|c| c.name == name);
            return Some(by_direction(of(POSITION)?, of(VELOCITY)?));
        }
        Kind::Spring | Kind::GravityTilt | Kind::Payload | Kind::EncoderEccentricityJoint => {
            POSITION
        }
        Kind::PreslidingDahl | Kind::PreslidingLugre | Kind::PreslidingMaxwell | Kind::Backlash => {
            WAY
        }
        Kind::JointElasticity => ACCELERATION,
        Kind::ViscousWarmupTime | Kind::ViscousWarmupHeat => SINCE_START,
        Kind::ViscousWarmupTemperature => TEMPERATURE,
        Kind::LoadFriction => LOAD,
        Kind::TorqueSaturation => DRIVE,
        Kind::MeasurementDelay => DRIVE_CHANGE,
        Kind::InertiaCoupling => {
            let name = velocity_of(&joints[other?].name);
            return all.iter().find(|c| c.name == name).cloned();
        }
        Kind::Stribeck
        | Kind::StribeckExponential
        | Kind::AsymmetricCoulomb
        | Kind::QuadraticDrag
        | Kind::CurrentOffset
        | Kind::DriveDeadzone
        | Kind::TorqueOffset => VELOCITY,
    };
    all.iter().find(|c| c.name == name).cloned()
}

/// Returns the position above the lowest one, with the sign of the velocity: the mean of friction over both directions is
/// zero at every position.
fn by_direction(position: &Coordinate, velocity: &Coordinate) -> Coordinate {
    let lowest = position
        .values
        .iter()
        .copied()
        .fold(f64::INFINITY, f64::min);
    let pairs = position.values.iter().zip(&velocity.values);
    Coordinate {
        name: "position above the lowest, by direction".to_owned(),
        unit: position.unit,
        values: pairs.map(|(q, v)| v.signum() * (q - lowest)).collect(),
    }
}

/// Computes mean residuals of a joint over a coordinate; the joint's name and unit stay empty. Their difference is the
/// law, except for the part that other parameters compensate.
pub(crate) fn map(rows: &Rows, over: &Coordinate, fits: [&Fit; 2], joint: usize) -> Map {
    let (place, edges) = bins(&over.values, &rows.keep[joint], BINS);
    let group = told_apart(&edges);
    let place: Vec<Option<usize>> = place.iter().map(|b| b.map(|b| group[b])).collect();
    let [before, after] = fits.map(|fit| {
        let residual = fit.residual(joint);
        means(&place, &residual, fit.block_of_rows())
    });
    let mut map = Map {
        coordinate: over.name.clone(),
        unit: over.unit.to_owned(),
        ..Map::default()
    };
    for g in 0..BINS {
        let (Some(before), Some(after)) = (before[g], after[g]) else {
            continue;
        };
        let ends = [
            edges[group.partition_point(|b| *b < g)],
            edges[group.partition_point(|b| *b <= g)],
        ];
        map.at.push(0.5 * (ends[0] + ends[1]));
        map.before.push(before);
        map.after.push(after);
        map.law.push(before[0] - after[0]);
    }
    map
}

/// Narrowest bin that is drawn by itself, as a share of the mean width and of its distance from zero. At a constant
/// commanded speed, noise changes the speed and, through the controller, the torque. Narrower bins would show that
/// correlation, which is no law of the joint.
const NARROWEST: [f64; 2] = [0.2, 0.1];

/// Returns the numbers of bins; neighbours that are too narrow share one.
fn told_apart(edges: &[f64]) -> Vec<usize> {
    let mean = (edges[edges.len() - 1] - edges[0]) / (edges.len() - 1) as f64;
    let wide = |low: f64, high: f64| {
        let least = (NARROWEST[0] * mean).min(NARROWEST[1] * 0.5 * (low + high).abs());
        high - low >= least
    };
    let mut from = edges[0];
    let mut number = 0;
    let mut list = Vec::with_capacity(edges.len() - 1);
    for ends in edges.windows(2) {
        if !list.is_empty() && (wide(from, ends[0]) || wide(ends[0], ends[1])) {
            number += 1;
            from = ends[0];
        }
        list.push(number);
    }
    list
}

/// Returns the mean of each bin and half the width of its 95 % interval from the spread between blocks. `None` if fewer
/// than two blocks have rows in it.
fn means(place: &[Option<usize>], residual: &[f64], block: &[usize]) -> Vec<Option<[f64; 2]>> {
    let blocks = block.iter().max().map_or(0, |b| b + 1);
    let mut sums = vec![vec![[0.0; 2]; BINS]; blocks];
    for ((bin, r), b) in place.iter().zip(residual).zip(block) {
        if let Some(bin) = bin {
            let entry = &mut sums[*b][*bin];
            entry[0] += r;
            entry[1] += 1.0;
        }
    }
    (0..BINS)
        .map(|bin| {
            let list: Vec<[f64; 2]> = (sums.iter().map(|s| s[bin]))
                .filter(|s| s[1] > 0.0)
                .collect();
            let [mean, std] = grouped_mean(&list);
            (list.len() > 1).then(|| [mean, t_quantile((list.len() - 1) as f64) * std])
        })
        .collect()
}

/// Returns, for each joint with an effect, the stretch of a recording where effects change the prediction most. Without
/// effects it uses the joint with the largest residual over its floor.
pub(crate) fn curves(found: &Found) -> Vec<Curves> {
    let mut joints: Vec<usize> = found.found().iter().map(|p| p.candidate.joint).collect();
    joints.sort_unstable();
    joints.dedup();
    if joints.is_empty() {
        let over = |j: &usize| found.base.rms(*j) / found.floors[*j].max(f64::MIN_POSITIVE);
        joints.extend((0..found.robot.joints.len()).max_by(|a, b| over(a).total_cmp(&over(b))));
    }
    joints
        .into_iter()
        .filter_map(|j| stretch(found, j))
        .collect()
}

/// A stretch of a recording.
struct Stretch {
    /// Index of the run.
    run: usize,
    /// First row.
    from: usize,
    /// One past the last row.
    to: usize,
}

/// Returns the stretch where effects change the prediction of a joint most; `None` without rows.
fn busiest(found: &Found, joint: usize) -> Option<Stretch> {
    let rows = found.drawn.rows;
    let [without, with] = [0, 1].map(|k| &found.drawn.left[k][joint]);
    let length = ((STRETCH / rows.period).ceil() as usize).max(2);
    let keep = &rows.keep[joint];
    // Without effects both are the same: the largest residual counts.
    let weight = |k: usize| {
        if !keep[k] {
            0.0
        } else if found.found().is_empty() {
            without[k].powi(2)
        } else {
            (without[k] - with[k]).powi(2)
        }
    };
    let mut best: Option<(f64, Stretch)> = None;
    for (run, pair) in rows.starts.windows(2).enumerate() {
        let end = |from: usize| (from + length).min(pair[1]);
        if end(pair[0]) <= pair[0] {
            continue;
        }
        let mut sum: f64 = (pair[0]..end(pair[0])).map(weight).sum();
        let mut from = pair[0];
        loop {
            if best.as_ref().is_none_or(|(most, _)| sum > *most) {
                let to = end(from);
                best = Some((sum, Stretch { run, from, to }));
            }
            if from + length >= pair[1] {
                break;
            }
            sum += weight(from + length) - weight(from);
            from += 1;
        }
    }
    best.map(|(_, stretch)| stretch)
}

/// Returns the curves of a joint over its busiest stretch.
fn stretch(found: &Found, joint: usize) -> Option<Curves> {
    let drawn = &found.drawn;
    let rows = drawn.rows;
    let [without, with] = [0, 1].map(|k| &drawn.left[k][joint]);
    let keep = &rows.keep[joint];
    let Stretch { run: r, from, to } = busiest(found, joint)?;
    let run = &drawn.runs[r];
    let (mut torque, mut time) = (Vec::new(), Vec::new());
    rows.thinning
        .push_raw(&run.joints[joint].tau, &[], &mut torque);
    rows.thinning.pick(&run.t, &mut time);
    let step = (to - from).div_ceil(MOST_POINTS);
    let picked: Vec<usize> = (from..to).step_by(step).collect();
    let start = rows.starts[r];
    let measured: Vec<f64> = picked.iter().map(|k| torque[k - start]).collect();
    // Unused rows, at standstill or at a limit, stay empty.
    let predicted = |left: &[f64]| -> Vec<f64> {
        let pairs = picked.iter().zip(&measured);
        pairs
            .map(|(k, tau)| if keep[*k] { tau - left[*k] } else { f64::NAN })
            .collect()
    };
    let [first, last] = &drawn.motion;
    let shown = |q: &[f64]| -> Vec<f64> {
        let mut thinned = Vec::new();
        rows.thinning.push(q, &[], &mut thinned);
        picked.iter().map(|k| thinned[k - start]).collect()
    };
    let simulated = |all: &[Positions]| all.get(r).map_or(Vec::new(), |run| shown(&run[joint]));
    let motion = if first.is_empty() {
        Default::default()
    } else {
        [
            shown(&run.joints[joint].q),
            simulated(first),
            simulated(last),
        ]
    };
    Some(Curves {
        joint: found.robot.joints[joint].name.clone(),
        recording: run.label.clone(),
        t: picked.iter().map(|k| time[k - start]).collect(),
        torque: [
            measured.clone(),
            predicted(without),
            if found.found().is_empty() {
                Vec::new()
            } else {
                predicted(with)
            },
        ],
        motion,
    })
}

#[cfg(test)]
mod tests;
