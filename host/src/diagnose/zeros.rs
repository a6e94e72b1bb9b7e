//! Recordings whose positions have different zeros: gravity, and whatever else stands at a position, acts at another place in one
//! of them. An incremental encoder is told its zero anew each time, often by eye.
//!
//! Leaves out: robots of several joints, whose encoders know where they are; joints across which nothing pulls that depends on
//! the position; zeros that drift.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use super::DiagnoseError;
use super::bench::{Bench, Loaded};
use super::columns::Source;
use super::fit::Fit;
use super::floor;
use super::predicted::predict;
use super::profile::SIGNIFICANT;
use super::rows::Column;
use crate::report::format_value;
use crate::robot::{JointKind, Robot};

/// Least share of the RMS that another zero takes off for it to be said.
const LEAST: f64 = 0.2;
/// … and of what the effects take off.
const IN_THEIR_PLACE: f64 = 0.8;
/// Least shift that is said, rad or m: less is what a spirit level leaves.
const SHIFT: f64 = 0.01;
/// Shifts in standard deviations.
const SURE: f64 = 6.0;

/// Zeros of a whole turn that are tried where a shift is no small one …
const TURNS: u32 = 24;
/// … and share of the RMS that one has to take off.
const MOST_OF_IT: f64 = 0.5;

/// What one recording's zero says of a joint.
struct Shift {
    joint: usize,
    label: String,
    by: [f64; 2],
    gain: f64,
}

/// That another zero of one of the recordings would do most of what the effects found do, a sentence; `base` is the refitted model
/// on them, of whose RMS the effects take the share `taken` off.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(super) fn another_zero(
    robot: &Robot,
    source: &Source,
    base: &Fit,
    taken: f64,
) -> Result<Option<String>, DiagnoseError> {
    if robot.joints.len() > 1 {
        return Ok(None);
    }
    let recordings: BTreeSet<usize> = source.runs.iter().map(|run| run.recording).collect();
    let mut most: Option<Shift> = None;
    for joint in 0..robot.joints.len() {
        for recording in recordings.iter().filter(|_| recordings.len() > 1) {
            let column = shifted(source, joint, Some(*recording))?;
            let open = [[f64::NEG_INFINITY, f64::INFINITY]];
            let evidence = (base.distinct(&[column])).and_then(|own| base.evidence(&own, &open));
            let Some(e) = evidence else { continue };
            let tried = recordings.len() * robot.joints.len();
            let by = [e.gains[0], e.stds[0]];
            let sure = by[0].abs() > SHIFT.max(SURE * by[1]) && e.corrected(tried) < SIGNIFICANT;
            if sure
                && e.gain > LEAST.max(IN_THEIR_PLACE * taken)
                && most.as_ref().is_none_or(|m| e.gain > m.gain)
            {
                let own = source.runs.iter().find(|run| run.recording == *recording);
                most = Some(Shift {
                    joint,
                    label: own.map_or_else(String::new, |run| run.label.clone()),
                    by,
                    gain: e.gain,
                });
            }
        }
    }
    Ok(most.map(|shift| told(robot, &shift, "the other recordings")))
}

/// The same of recordings held back, of which the model leaves `residual`.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(super) fn another_zero_held(
    bench: &Bench,
    sealed: &Loaded,
    values: &[f64],
    residual: &[Vec<f64>],
) -> Result<Option<String>, DiagnoseError> {
    if bench.robot.joints.len() > 1 {
        return Ok(None);
    }
    let source = bench.source(sealed, values)?;
    let (robot, rows) = (bench.robot, &sealed.rows);
    let mut most: Option<Shift> = None;
    for joint in 0..robot.joints.len() {
        let column = shifted(&source, joint, None)?;
        let (Some(own), keep) = (&column[joint], &rows.keep[joint]) else {
            continue;
        };
        let used = || (own.iter().zip(&residual[joint]).zip(keep)).filter(|(_, keep)| **keep);
        let (xx, xy) = used().fold((0.0, 0.0), |(xx, xy), ((x, r), _)| (xx + x * x, xy + x * r));
        if xx == 0.0 {
            continue;
        }
        let by = xy / xx;
        let left: Vec<f64> = (own.iter().zip(&residual[joint]))
            .map(|(x, r)| r - by * x)
            .collect();
        let [before, after] = [&residual[joint], &left].map(|r| floor::rms(r, keep));
        // Noise of a row counts as independent once in ten rows at least.
        let std = after * (10.0 / xx).sqrt();
        let gain = 1.0 - after / before;
        if by.abs() > SHIFT.max(SURE * std)
            && gain > LEAST
            && most.as_ref().is_none_or(|m| gain > m.gain)
        {
            most = Some(Shift {
                joint,
                label: sealed
                    .runs
                    .first()
                    .map_or_else(String::new, |run| run.label.clone()),
                by: [by, std],
                gain,
            });
        }
    }
    if most.is_none() && robot.joints[0].kind == JointKind::Revolute {
        most = turned(bench, sealed, values, residual)?;
    }
    Ok(most.map(|shift| told(robot, &shift, "those to learn from")))
}

/// The same for a single joint that turns, where the zero is far off.
fn turned(
    bench: &Bench,
    sealed: &Loaded,
    values: &[f64],
    residual: &[Vec<f64>],
) -> Result<Option<Shift>, DiagnoseError> {
    let (rows, nominal) = (&sealed.rows, &bench.nominal);
    let torque = |by: f64| -> Result<Vec<f64>, DiagnoseError> {
        let mut thin = Vec::new();
        for run in &sealed.runs {
            let mut elsewhere = run.clone();
            for q in elsewhere.joints.iter_mut().flat_map(|joint| &mut joint.q) {
                *q -= by;
            }
            let told = predict(nominal, bench.robot, values, &elsewhere)?;
            rows.thinning.push(&told.torque[0], &mut thin);
        }
        Ok(thin)
    };
    let here = torque(0.0)?;
    let before = floor::rms(&residual[0], &rows.keep[0]);
    let mut most: Option<Shift> = None;
    for k in 1..TURNS {
        let by = f64::from(k) * TAU / f64::from(TURNS);
        let there = torque(by)?;
        let left: Vec<f64> = (residual[0].iter().zip(here.iter().zip(&there)))
            .map(|(r, (here, there))| r + here - there)
            .collect();
        let gain = 1.0 - floor::rms(&left, &rows.keep[0]) / before;
        if gain > MOST_OF_IT && most.as_ref().is_none_or(|m| gain > m.gain) {
            let by = if by > PI { by - TAU } else { by };
            most = Some(Shift {
                joint: 0,
                label: sealed
                    .runs
                    .first()
                    .map_or_else(String::new, |run| run.label.clone()),
                by: [by, PI / f64::from(TURNS)],
                gain,
            });
        }
    }
    Ok(most)
}

/// Torque per rad or m by which a joint's zero is off in one recording, or all of them.
fn shifted(
    source: &Source,
    joint: usize,
    recording: Option<usize>,
) -> Result<Column, DiagnoseError> {
    let joints = source.robot.joints.len();
    let mut column: Column = vec![Some(Vec::new()); joints];
    for (r, run) in source.runs.iter().enumerate() {
        let there = recording.is_none_or(|own| own == run.recording);
        let one = vec![f64::from(u8::from(there)); run.len()];
        let torque = source.slopes(joint, r)?.misread(&one, 1.0 / run.rate);
        for (to, from) in column.iter_mut().flatten().zip(torque.iter().flatten()) {
            source.thinning.push(from, to);
        }
    }
    Ok(column)
}

fn told(robot: &Robot, shift: &Shift, others: &str) -> String {
    let own = &robot.joints[shift.joint];
    format!(
        "In {} joint {} seems to stand {} {} off against {others}: with a zero of its own {:.0} % less is left. Give all recordings one zero (--home), or look whether something else has changed.",
        shift.label,
        own.name,
        format_value(-shift.by[0], shift.by[1]),
        own.kind.units().0,
        100.0 * shift.gain
    )
}
