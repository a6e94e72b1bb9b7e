//! Torque residuals of given parameters, from a pass over recordings.

use super::residual::{Ranges, ResidualReport, ResidualStream};
use crate::error::IdentifyError;
use crate::rows::planned::Planned;
use rig_data::prepare::Survey;
use rig_numerics::vector::dot_in_order;

/// Returns the torque residuals per joint, in the differential form for every model, so that models can be compared.
/// `by_position` is the torque (of a joint at a position) that was subtracted before the fit and is not in the
/// description; measured and predicted torque include it. `measured` are the original recordings if effects were
/// subtracted: errors are relative to the whole torque.
pub fn torque_residuals(
    recordings: &[Planned],
    surveys: &[Survey],
    full: &[f64],
    by_position: &dyn Fn(usize, f64) -> f64,
    measured: Option<&[Planned]>,
) -> Result<Vec<ResidualReport>, IdentifyError> {
    let total: u64 = surveys
        .iter()
        .zip(recordings)
        .map(|(s, r)| s.rows / r.plan.treatment.decimation as u64)
        .sum();
    let joints = surveys.first().map_or(0, |s| s.joints.len());
    let extremes = |j: usize, of: &dyn Fn(&rig_data::prepare::JointSurvey) -> [f64; 2]| {
        surveys
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], s| {
                let [low, high] = of(&s.joints[j]);
                [l.min(low), h.max(high)]
            })
    };
    let p = full.len();
    // The survey's peak speed comes from raw differences with noise; the filtered peak needs a pass.
    let mut speed = vec![0.0f64; joints];
    for recording in recordings {
        recording.each_rows(&mut |rows| {
            for (s, qd) in speed.iter_mut().zip(&rows.qd) {
                *s = qd.iter().fold(*s, |m, v| m.max(v.abs()));
            }
            Ok(())
        })?;
    }
    let mut streams: Vec<ResidualStream> = (0..joints)
        .map(|j| {
            ResidualStream::new(
                total,
                Ranges {
                    position: extremes(j, &|s| s.position),
                    speed: speed[j],
                    torque: extremes(j, &|s| s.torque),
                },
            )
        })
        .collect();
    let mut index = 0u64;
    for recording in recordings {
        recording.each_rows(&mut |rows| {
            for i in 0..rows.t.len() {
                for (j, (stream, equation)) in streams.iter_mut().zip(&rows.equations).enumerate() {
                    let known = by_position(j, rows.q[j][i]);
                    let predicted = dot_in_order(&equation.x[i * p..(i + 1) * p], full);
                    stream.push(
                        index,
                        rows.t[i],
                        rows.q[j][i],
                        rows.qd[j][i],
                        equation.y[i] + known,
                        predicted + known,
                        equation.keep[i],
                    );
                }
                index += 1;
            }
            Ok(())
        })?;
    }
    let mut reports: Vec<ResidualReport> =
        streams.into_iter().map(ResidualStream::report).collect();
    if let Some(measured) = measured {
        for (report, [rms, all]) in reports.iter_mut().zip(torque_rms(measured, joints)?) {
            report.torque_rms = rms;
            report.relative_error = report.rms / rms.max(f64::MIN_POSITIVE);
            report.all.relative_error = report.all.rms / all.max(f64::MIN_POSITIVE);
        }
    }
    Ok(reports)
}

/// Returns, per joint, the RMS torque over the used rows and over all rows.
fn torque_rms(recordings: &[Planned], joints: usize) -> Result<Vec<[f64; 2]>, IdentifyError> {
    let mut sums = vec![[(0u64, 0.0); 2]; joints];
    for recording in recordings {
        recording.each_rows(&mut |rows| {
            for ([used, all], equation) in sums.iter_mut().zip(&rows.equations) {
                for (y, keep) in equation.y.iter().zip(&equation.keep) {
                    let counting = [Some(&mut *all), keep.then_some(&mut *used)];
                    for sum in counting.into_iter().flatten() {
                        sum.0 += 1;
                        sum.1 += y * y;
                    }
                }
            }
            Ok(())
        })?;
    }
    let rms = |(count, squares): (u64, f64)| (squares / count.max(1) as f64).sqrt();
    Ok(sums.into_iter().map(|both| both.map(rms)).collect())
}
