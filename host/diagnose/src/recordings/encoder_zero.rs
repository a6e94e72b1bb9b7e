//! Recordings with different position zeros: gravity and other position-dependent effects act at another place in one
//! of them. An incremental encoder gets a new zero each time, often by eye.
//!
//! Leaves out: robots of several joints, whose encoders are absolute; joints without a position-dependent torque; zeros
//! that drift.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use crate::DiagnoseError;
use crate::columns::effect_columns::Source;
use crate::fit::least_squares::Fit;
use crate::levels::SIGNIFICANT;
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::rows::nominal_torque::predict;
use rig_data::runs::Run;
use rig_model::robot::JointKind;
use rig_numerics::statistics;

/// Least RMS reduction by another zero for a report …
const LEAST: f64 = 0.2;
/// … and least share of the effects' RMS reduction.
const IN_THEIR_PLACE: f64 = 0.8;
/// Least reported shift, rad or m: a spirit level leaves less.
const SHIFT: f64 = 0.01;
/// Least shift in standard deviations.
const SURE: f64 = 6.0;

/// Zeros over a whole turn that are tried for a large shift …
const TURNS: u32 = 24;
/// … and least RMS reduction by one of them.
const MOST_OF_IT: f64 = 0.5;

/// Recordings with which a zero is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Against {
    /// The other training recordings.
    OtherRecordings,
    /// All training recordings.
    Training,
}

/// Estimated zero shift of a recording.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shift {
    /// The recording.
    pub(crate) label: String,
    /// Recordings with another zero.
    pub(crate) against: Against,
    /// Shift and its standard deviation, rad or m.
    pub(crate) by: [f64; 2],
    /// Share of the RMS that the shift removes.
    pub(crate) gain: f64,
}

impl Shift {
    fn of(run: Option<&Run>, against: Against, by: [f64; 2], gain: f64) -> Self {
        Self {
            label: run.map_or_else(String::new, |run| run.label.clone()),
            against,
            by,
            gain,
        }
    }

    /// Returns the shift with the larger RMS reduction.
    fn or(self, other: Option<Self>) -> Self {
        match other {
            Some(other) if other.gain >= self.gain => other,
            _ => self,
        }
    }
}

/// Returns the shift if another zero of one recording would do most of what the found effects do. `base` is the
/// refitted model; the effects reduce its RMS by the share `taken`.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn another_zero(
    source: &Source,
    base: &Fit,
    taken: f64,
) -> Result<Option<Shift>, DiagnoseError> {
    if source.robot.joints.len() != 1 {
        return Ok(None);
    }
    let recordings: BTreeSet<usize> = source.runs.iter().map(|run| run.recording).collect();
    let mut most: Option<Shift> = None;
    for &recording in recordings.iter().filter(|_| recordings.len() > 1) {
        let column = vec![Some(shifted(source, Some(recording))?)];
        let open = [[f64::NEG_INFINITY, f64::INFINITY]];
        let evidence = (base.distinct(&[column])).and_then(|own| base.evidence(&own, &open));
        let Some(e) = evidence else { continue };
        let by = [e.gains[0], e.stds[0]];
        let sure =
            by[0].abs() > SHIFT.max(SURE * by[1]) && e.corrected(recordings.len()) < SIGNIFICANT;
        if sure && e.gain > LEAST.max(IN_THEIR_PLACE * taken) {
            let run = source.runs.iter().find(|run| run.recording == recording);
            most = Some(Shift::of(run, Against::OtherRecordings, by, e.gain).or(most));
        }
    }
    Ok(most)
}

/// The same for a hold-out with the model's `residual`.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn another_zero_held(
    context: &DiagnosisContext,
    held_out: &PreparedData,
    values: &[f64],
    residual: &[Vec<f64>],
) -> Result<Option<Shift>, DiagnoseError> {
    let [joint] = &context.robot.joints[..] else {
        return Ok(None);
    };
    let (residual, keep) = (&residual[0], &held_out.rows.keep[0]);
    let own = shifted(&context.source(held_out, values)?, None)?;
    let used = || (own.iter().zip(residual).zip(keep)).filter(|(_, keep)| **keep);
    let (xx, xy) = used().fold((0.0, 0.0), |(xx, xy), ((x, r), _)| (xx + x * x, xy + x * r));
    let mut most = None;
    if xx > 0.0 {
        let by = xy / xx;
        let left: Vec<f64> = own.iter().zip(residual).map(|(x, r)| r - by * x).collect();
        let [before, after] = [residual, &left].map(|r| statistics::rms_of_kept(r, keep));
        // Counts one row in ten as independent.
        let std = after * (10.0 / xx).sqrt();
        let gain = 1.0 - after / before;
        if by.abs() > SHIFT.max(SURE * std) && gain > LEAST {
            most = Some(Shift::of(
                held_out.runs.first(),
                Against::Training,
                [by, std],
                gain,
            ));
        }
    }
    if most.is_none() && joint.kind == JointKind::Revolute {
        most = turned(context, held_out, values, residual)?;
    }
    Ok(most)
}

/// The same for a large shift of a single revolute joint.
fn turned(
    context: &DiagnosisContext,
    held_out: &PreparedData,
    values: &[f64],
    residual: &[f64],
) -> Result<Option<Shift>, DiagnoseError> {
    let (rows, nominal) = (&held_out.rows, &context.nominal);
    let torque = |by: f64| -> Result<Vec<f64>, DiagnoseError> {
        let mut thin = Vec::new();
        for (run, left_out) in held_out.runs.iter().zip(&rows.left_out) {
            let mut elsewhere = run.clone();
            for q in elsewhere.joints.iter_mut().flat_map(|joint| &mut joint.q) {
                *q -= by;
            }
            let told = predict(nominal, context.robot, values, &elsewhere)?;
            rows.thinning
                .push_raw(&told.torque[0], &left_out[0], &mut thin);
        }
        Ok(thin)
    };
    let here = torque(0.0)?;
    let before = statistics::rms_of_kept(residual, &rows.keep[0]);
    let mut most: Option<Shift> = None;
    for k in 1..TURNS {
        let by = f64::from(k) * TAU / f64::from(TURNS);
        let there = torque(by)?;
        let left: Vec<f64> = (residual.iter().zip(here.iter().zip(&there)))
            .map(|(r, (here, there))| r + here - there)
            .collect();
        let gain = 1.0 - statistics::rms_of_kept(&left, &rows.keep[0]) / before;
        if gain > MOST_OF_IT {
            let by = if by > PI { by - TAU } else { by };
            let std = PI / f64::from(TURNS);
            most =
                Some(Shift::of(held_out.runs.first(), Against::Training, [by, std], gain).or(most));
        }
    }
    Ok(most)
}

/// Returns the torque per rad or m of zero shift in one recording, or in all of them.
fn shifted(source: &Source, recording: Option<usize>) -> Result<Vec<f64>, DiagnoseError> {
    let mut column = Vec::new();
    for (r, run) in source.runs.iter().enumerate() {
        let there = recording.is_none_or(|own| own == run.recording);
        let one = vec![f64::from(u8::from(there)); run.len()];
        let torque = source.slopes(0, r)?.misread(&one, 1.0 / run.rate);
        for from in torque.iter().flatten() {
            source
                .thinning
                .push(from, &source.left_out[r][0], &mut column);
        }
    }
    Ok(column)
}
