//! The desired motion of the joints, tick by tick.

use super::error::ControlError;
use rig_excite::SampledReference;
use rig_model::robot::Robot;
use rig_shared::trajectory::Reference;

/// Share of half a joint's range that the default motion uses.
const RANGE_SHARE: f64 = 0.4;
/// Share of the speed limits that the default motion uses.
const SPEED_SHARE: f64 = 0.5;
/// Frequencies of the default motion of the first joint, Hz, and how much faster each further joint is.
const FREQUENCIES: [f64; 2] = [0.15, 0.4];
const STEP: f64 = 0.07;
/// Time in which the default motion fades in and out, s.
const EASE: f64 = 1.0;

/// Returns a motion of two sines a joint about the middle of its range, with different frequencies in each joint, from rest
/// to rest. It keeps to half of the speed limits and stays within the ranges of coupled drives.
pub fn default_reference(robot: &Robot, rate: f64, seconds: f64) -> SampledReference {
    let sizes = sizes(robot);
    SampledReference::about_middle(robot, 1.0 / rate, seconds, |j, t| {
        let ends = (t / EASE).min((seconds - t) / EASE).clamp(0.0, 1.0);
        let share = ends.powi(3) * (10.0 - 15.0 * ends + 6.0 * ends * ends);
        let sines = FREQUENCIES
            .iter()
            .map(|f| (core::f64::consts::TAU * (f + STEP * j as f64) * t).sin());
        share * 0.5 * sizes[j] * sines.sum::<f64>()
    })
}

fn sizes(robot: &Robot) -> Vec<f64> {
    let middle = robot.middle_position();
    let mut sizes: Vec<f64> = (robot.joints.iter().zip(&middle).enumerate())
        .map(|(j, (joint, middle))| {
            let Some(limits) = &joint.limits else {
                return 0.5;
            };
            let [low, high] = limits.for_motions();
            let half = (high - middle).min(middle - low);
            let fastest = core::f64::consts::TAU * (FREQUENCIES[1] + STEP * j as f64);
            (RANGE_SHARE * half).min(SPEED_SHARE * limits.velocity / fastest)
        })
        .collect();
    for (weights, [low, high]) in robot.combined_limits() {
        let at: f64 = weights.iter().zip(&middle).map(|(w, q)| w * q).sum();
        let room = RANGE_SHARE * (high - at).min(at - low);
        let reach: f64 = weights.iter().zip(&sizes).map(|(w, s)| (w * s).abs()).sum();
        if reach > room {
            for (size, weight) in sizes.iter_mut().zip(&weights) {
                *size *= if *weight == 0.0 { 1.0 } else { room / reach };
            }
        }
    }
    sizes
}

/// Returns position, velocity and acceleration of each joint. Where the samples have positions alone, the derivatives are
/// central differences.
///
/// # Errors
/// [`ControlError::Setting`] on fewer than three samples or values that are not finite.
pub fn references(sampled: &SampledReference) -> Result<Vec<Vec<Reference<f64>>>, ControlError> {
    let rows = sampled.position.iter().map(Vec::len).min().unwrap_or(0);
    if rows < 3 || sampled.position.iter().flatten().any(|q| !q.is_finite()) {
        return Err(ControlError::Setting {
            name: "trajectory of",
            value: format!("{rows} samples"),
            right: "it needs at least three, all finite",
        });
    }
    let h = sampled.period;
    let joint = |(j, q): (usize, &Vec<f64>)| {
        (0..rows)
            .map(|k| {
                let (before, after) = (q[k.saturating_sub(1)], q[(k + 1).min(rows - 1)]);
                let given = |list: &[Vec<f64>]| list.get(j).and_then(|v| v.get(k)).copied();
                Reference {
                    position: q[k],
                    velocity: given(&sampled.velocity).unwrap_or((after - before) / (2.0 * h)),
                    acceleration: given(&sampled.acceleration)
                        .unwrap_or((after - 2.0 * q[k] + before) / (h * h)),
                }
            })
            .collect()
    };
    Ok(sampled.position.iter().enumerate().map(joint).collect())
}
