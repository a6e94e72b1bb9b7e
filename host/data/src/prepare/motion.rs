//! Filtered motion, piece by piece.

use super::error::PrepareError;
use super::filter::{LowPass, central_difference, second_difference};
use super::pieces::{Piece, Recording, each_piece};
use super::preprocessing_plan::PreprocessingPlan;
use super::workers::{in_order, threads};
use crate::unsettled::unsettled;

/// Motion of one joint over a piece, at the full rate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointMotion {
    /// Filtered position, rad or m.
    pub q: Vec<f64>,
    /// Velocity, rad/s or m/s.
    pub qd: Vec<f64>,
    /// Acceleration, rad/s² or m/s².
    pub qdd: Vec<f64>,
    /// Recorded torque minus that of the described effects, N·m or N.
    pub tau: Vec<f64>,
    /// True where the speed is below the joint's threshold.
    pub slow: Vec<bool>,
    /// True where the torque is at a limit.
    pub saturated: Vec<bool>,
    /// True where the rig marked the current as read before its amplifier had settled.
    pub unsettled: Vec<bool>,
}

/// A piece of motion with margins; only rows `usable.0 .. usable.1` may be used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// s
    pub t: Vec<f64>,
    /// One entry per joint.
    pub joints: Vec<JointMotion>,
    /// Columns without a meaning for the joints, by name and as recorded (for instance those of a wrist sensor).
    pub extra: Vec<(String, Vec<f64>)>,
    /// First row and one past the last row that belong to this piece; ends of the segment are trimmed.
    pub usable: (usize, usize),
    /// First row and one past the last row that an end of the segment does not affect: windows and filters may use
    /// these.
    pub sound: (usize, usize),
    /// Index of row 0 in its segment.
    pub offset: u64,
    /// Number of the stretch (between gaps in time).
    pub segment: usize,
    /// True where the rows start and end with the segment.
    pub at_ends: [bool; 2],
}

/// Calls `take` with the motion of the whole recording, in order. `reach` is the number of rows that the caller looks
/// ahead of or behind a row (the length of a window).
///
/// # Errors
/// Errors of the reader or of `take`; [`PrepareError::NoDerivative`].
pub fn each_motion(
    recording: &dyn Recording,
    plan: &PreprocessingPlan,
    reach: usize,
    take: &mut dyn FnMut(&Motion) -> Result<(), PrepareError>,
) -> Result<(), PrepareError> {
    worked_motion(recording, plan, reach, &Ok, &mut |motion| take(&motion))
}

/// Calls `take` with the results of `work` on the motion of the whole recording, in order. The work is spread over
/// [`PreprocessingPlan::threads`].
///
/// # Errors
/// Errors of the reader, `work` or `take`; [`PrepareError::NoDerivative`].
pub fn worked_motion<R: Send>(
    recording: &dyn Recording,
    plan: &PreprocessingPlan,
    reach: usize,
    work: &(dyn Fn(Motion) -> Result<R, PrepareError> + Sync),
    take: &mut dyn FnMut(R) -> Result<(), PrepareError>,
) -> Result<(), PrepareError> {
    let impossible = || PrepareError::Cutoff {
        cutoff: plan.cutoff,
        rate: plan.sample_rate,
        nyquist: plan.sample_rate / 2.0,
    };
    let position = plan.position_filter().ok_or_else(impossible)?;
    let parallel = plan.parallel_low_pass().ok_or_else(impossible)?;
    let round = |rows: usize| rows.div_ceil(plan.decimation) * plan.decimation;
    let margin =
        round(position.settle_samples() + parallel.settle_samples() + plan.trimmed + reach + 4);
    let core = round(plan.piece_rows.max(margin));
    let label = recording.label();
    in_order(
        threads(plan.threads),
        |push| each_piece(recording, core, margin, push),
        &|piece| work(motion_of(piece, plan, &position, &label)?),
        take,
    )
}

fn motion_of(
    piece: Piece,
    plan: &PreprocessingPlan,
    position: &LowPass,
    label: &str,
) -> Result<Motion, PrepareError> {
    let rows = piece.rows.len();
    let dt = plan.dt();
    let mut unsettled = unsettled(&piece.rows.extra);
    unsettled.resize(rows, false);
    let joints = piece
        .rows
        .joints
        .into_iter()
        .enumerate()
        .map(|(j, column)| {
            let missing = |name: &str| PrepareError::NoDerivative {
                label: label.to_owned(),
                column: format!("{name}{}", j + 1),
            };
            let q = position.zero_phase(&column.q);
            let (qd, qdd) = if plan.measured_derivatives {
                let qd = position.zero_phase(column.qd.as_ref().ok_or_else(|| missing("qd"))?);
                let qdd = match &column.qdd {
                    Some(qdd) => position.zero_phase(qdd),
                    None => central_difference(&qd, dt),
                };
                (qd, qdd)
            } else {
                (central_difference(&q, dt), second_difference(&q, dt))
            };
            let (q, qd, qdd) = later(q, qd, qdd, plan.torque_lead, dt);
            let threshold = plan.speed_threshold[j];
            let [low, high] = plan.saturation[j];
            Ok(JointMotion {
                slow: qd.iter().map(|v| v.abs() < threshold).collect(),
                saturated: column
                    .tau
                    .iter()
                    .map(|tau| low.is_some_and(|l| *tau <= l) || high.is_some_and(|h| *tau >= h))
                    .collect(),
                tau: without(column.tau, column.effects.as_deref()),
                unsettled: unsettled.clone(),
                q,
                qd,
                qdd,
            })
        })
        .collect::<Result<Vec<_>, PrepareError>>()?;
    let trim = |end: bool| if end { plan.trimmed.min(rows) } else { 0 };
    let (front, back) = (trim(piece.at_ends[0]), trim(piece.at_ends[1]));
    let start = if piece.at_ends[0] {
        piece.core_start.max(front)
    } else {
        piece.core_start
    };
    Ok(Motion {
        t: piece.rows.t,
        joints,
        extra: piece.rows.extra,
        usable: (start, piece.core_end.min(rows - back).max(start)),
        sound: (front, rows - back),
        offset: piece.offset,
        segment: piece.segment,
        at_ends: piece.at_ends,
    })
}

fn without(mut torque: Vec<f64>, effects: Option<&[f64]>) -> Vec<f64> {
    for (torque, effect) in torque.iter_mut().zip(effects.unwrap_or_default()) {
        *torque -= effect;
    }
    torque
}

/// Shifts the motion by `lead` seconds with a Taylor series: the filtered position is smooth over a few samples.
pub fn later(
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
    lead: f64,
    dt: f64,
) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    if lead == 0.0 {
        return (q, qd, qdd);
    }
    let jerk = central_difference(&qdd, dt);
    let moved = |x: &[f64], v: &[f64], a: &[f64]| -> Vec<f64> {
        x.iter()
            .zip(v)
            .zip(a)
            .map(|((x, v), a)| x + lead * (v + 0.5 * lead * a))
            .collect()
    };
    let flat = vec![0.0; q.len()];
    (
        moved(&q, &qd, &qdd),
        moved(&qd, &qdd, &jerk),
        moved(&qdd, &jerk, &flat),
    )
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic)]
mod tests {
    use super::*;
    use crate::prepare::{Choice, InMemory, PrepareOptions, Survey};
    use crate::{Block, JointColumns};

    fn recording(rows: usize, cut: usize) -> InMemory {
        let mut blocks = Vec::new();
        for start in (0..rows).step_by(cut) {
            let t: Vec<f64> = (start..(start + cut).min(rows))
                .map(|k| k as f64 * 1e-3)
                .collect();
            // Not smooth on purpose: the margins must handle the noise.
            let q = t
                .iter()
                .map(|t| 0.3 + (3.0 * t).sin() + 1e-4 * (1e5 * t * t).sin())
                .collect();
            let tau = t
                .iter()
                .map(|t| 2.0 * (3.0 * t).cos() + 0.1 * (7e4 * t * t).cos())
                .collect();
            blocks.push(Block {
                joints: vec![JointColumns {
                    q,
                    tau,
                    ..Default::default()
                }],
                first_line: start as u64 + 2,
                continues: start > 0,
                t,
                ..Default::default()
            });
        }
        InMemory {
            label: "made".into(),
            blocks,
        }
    }

    fn collect(recording: &InMemory, plan: &PreprocessingPlan) -> (Vec<f64>, Vec<f64>, usize) {
        let (mut qdd, mut t, mut pieces) = (Vec::new(), Vec::new(), 0);
        each_motion(recording, plan, 10, &mut |m| {
            qdd.extend_from_slice(&m.joints[0].qdd[m.usable.0..m.usable.1]);
            t.extend_from_slice(&m.t[m.usable.0..m.usable.1]);
            pieces += 1;
            Ok(())
        })
        .unwrap();
        (t, qdd, pieces)
    }

    #[test]
    fn pieces_give_what_the_whole_recording_gives() {
        let whole = recording(60_000, 60_000);
        let cut = recording(60_000, 777);
        let survey = Survey::take(&whole, 1).unwrap();
        let options = PrepareOptions {
            cutoff: Choice::Fixed(20.0),
            decimation: Choice::Fixed(4),
            ..Default::default()
        };
        let mut plan = PreprocessingPlan::decide(&[survey], &options, &[None]).unwrap();
        let (t_whole, expected, one) = collect(&whole, &plan);
        assert_eq!(one, 1);
        plan.piece_rows = 4000;
        let (t_cut, found, pieces) = collect(&cut, &plan);
        assert!(pieces > 8, "{pieces}");
        assert_eq!(t_whole, t_cut);
        let scale = expected.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let worst = expected
            .iter()
            .zip(&found)
            .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(worst < 1e-9 * scale, "{worst} of {scale}");
    }

    #[test]
    fn irregular_and_still_recordings_are_refused_by_line_and_joint() {
        let mut bad = recording(2000, 2000);
        for t in &mut bad.blocks[0].t[1000..] {
            *t += 5e-4;
        }
        let message = Survey::take(&bad, 1).unwrap_err().to_string();
        assert!(message.contains("line 1002"), "{message}");
        let mut still = recording(2000, 2000);
        still.blocks[0].joints[0].q.fill(0.25);
        let message = Survey::take(&still, 1).unwrap_err().to_string();
        assert!(message.contains("Joint 1 does not move"), "{message}");
    }
}
