//! Measures of a motion.

use super::closed_loop::Trace;
use super::contact_task::ContactTask;
use super::error::ControlError;
use super::result::JointMeasures;
use super::settings::LawKind;
use super::tool::tool_pose;
use rig_model::robot::Robot;
use rig_numerics::statistics::{mean_or_zero, rms};
use rig_shared::multibody::Chain;
use rig_shared::trajectory::Reference;

/// Most samples in a plot.
pub(crate) const PLOTTED: usize = 1500;
/// Band about the wanted force in which it counts as settled.
const SETTLED: f64 = 0.05;
/// Time before the slide over which the steady error is averaged, s.
const STEADY: f64 = 0.5;

/// Returns every so-manieth tick so that at most [`PLOTTED`] are left.
pub(crate) fn ticks(samples: usize) -> impl Iterator<Item = usize> + Clone {
    (0..samples).step_by(samples.div_ceil(PLOTTED).max(1))
}

/// Returns the tracking error of a joint at all ticks: reference minus true position.
pub(crate) fn errors(trace: &Trace, reference: &[Vec<Reference<f64>>], joint: usize) -> Vec<f64> {
    let pairs = reference[joint].iter().zip(&trace.q[joint]);
    pairs.map(|(wanted, q)| wanted.position - q).collect()
}

/// Measures each joint.
pub(crate) fn joints(
    robot: &Robot,
    trace: &Trace,
    reference: &[Vec<Reference<f64>>],
) -> Vec<JointMeasures> {
    let ticks = trace.q.first().map_or(1, Vec::len).max(1) as f64;
    (robot.joints.iter().enumerate())
        .map(|(j, joint)| {
            let errors = errors(trace, reference, j);
            JointMeasures {
                name: joint.name.clone(),
                rms: rms(&errors),
                largest: errors.iter().map(|e| e.abs()).fold(0.0, f64::max),
                torque: rms(&trace.torque[j]),
                saturated: trace.saturated[j] as f64 / ticks,
            }
        })
        .collect()
}

/// Returns RMS and largest distance of the tool from where it should be, m.
pub(crate) fn tool(
    chain: &Chain<f64>,
    point: [f64; 3],
    trace: &Trace,
    reference: &[Vec<Reference<f64>>],
) -> Result<[f64; 2], ControlError> {
    let n = reference.len();
    let mut columns = vec![[0.0; 6]; n];
    let mut distances = Vec::with_capacity(trace.q[0].len());
    let (mut q, mut wanted) = (vec![0.0; n], vec![0.0; n]);
    for k in 0..trace.q[0].len() {
        for j in 0..n {
            q[j] = trace.q[j][k];
            wanted[j] = reference[j][k].position;
        }
        let at = tool_pose(chain, &q, point, &mut columns)?;
        let should = tool_pose(chain, &wanted, point, &mut columns)?;
        let off = (0..3).map(|axis| (at[axis] - should[axis]).powi(2));
        distances.push(off.sum::<f64>().sqrt());
    }
    Ok([
        rms(&distances),
        distances.iter().copied().fold(0.0, f64::max),
    ])
}

/// Measures of a force.
pub(crate) struct ForceMeasures {
    pub touched: f64,
    pub impact_speed: f64,
    pub rise: Option<f64>,
    pub overshoot: f64,
    pub overshoot_before_slide: f64,
    pub settling: Option<f64>,
    pub steady_error: f64,
    /// Standard deviation of the force at rest before the slide, N.
    pub scatter: f64,
    pub slide_force: Option<f64>,
    pub slide_peak: Option<f64>,
    pub slide_error: Option<f64>,
    pub bounces: usize,
}

/// Measures the force of a contact.
///
/// # Errors
/// [`ControlError::Unreachable`] if the tool has not touched the surface before the slide.
pub(crate) fn force(
    law: LawKind,
    task: &ContactTask,
    trace: &Trace,
) -> Result<ForceMeasures, ControlError> {
    let h = trace.period;
    let slide = ((task.slide_start / h) as usize).min(trace.force.len());
    let before = &trace.force[..slide];
    let Some(touch) = before.iter().position(|f| *f > 0.0) else {
        let depth = trace.tool[0].get(..slide).and_then(|list| list.last());
        return Err(ControlError::Unreachable(format!(
            "With {} the tool did not touch the surface within {:.2} s: it moved {:.4} m of {:.4} m. Friction that the law's model lacks can hold it; give a larger --press, a smaller --gap, or another model.",
            law.name(),
            task.slide_start,
            depth.copied().unwrap_or(0.0),
            task.surface.gap
        )));
    };
    let first = |share: f64| before.iter().position(|f| *f >= share * task.force);
    let rise = first(0.1)
        .zip(first(0.9))
        .map(|(low, high)| (high - low) as f64 * h);
    let off = |f: &f64| (f - task.force).abs() > SETTLED * task.force;
    let settling = match before.iter().rposition(off) {
        Some(last) if last + 1 < slide => Some((last + 1).saturating_sub(touch) as f64 * h),
        Some(_) => None,
        None => Some(0.0),
    };
    let steady = &before[slide.saturating_sub((STEADY / h) as usize)..];
    let contacts = trace.force.windows(2);
    let bounces = contacts
        .filter(|pair| pair[0] > 0.0 && pair[1] <= 0.0)
        .count();
    let speed = match touch {
        0 => 0.0,
        k => (trace.tool[0][k] - trace.tool[0][k - 1]) / h,
    };
    let after = &trace.force[slide..];
    let beyond = |forces: &[f64]| {
        let largest = forces.iter().copied().fold(0.0, f64::max);
        (largest / task.force - 1.0).max(0.0)
    };
    let along: Option<Vec<f64>> = (task.slide > 0.0).then(|| {
        let series = trace.tool[1].iter().enumerate().skip(slide);
        series
            .map(|(k, x)| task.reference(law, k as f64 * h)[1].position - x)
            .collect()
    });
    Ok(ForceMeasures {
        touched: touch as f64 * h,
        impact_speed: speed,
        rise,
        overshoot: beyond(&trace.force),
        overshoot_before_slide: beyond(before),
        settling,
        steady_error: mean_or_zero(steady) - task.force,
        scatter: {
            let mean = mean_or_zero(steady);
            let away: Vec<f64> = steady.iter().map(|f| f - mean).collect();
            rms(&away)
        },
        slide_force: (task.slide > 0.0).then(|| {
            let off: Vec<f64> = after.iter().map(|f| f - task.force).collect();
            rms(&off)
        }),
        slide_peak: (task.slide > 0.0).then(|| after.iter().copied().fold(0.0, f64::max)),
        slide_error: along.map(|along| rms(&along)),
        bounces,
    })
}
