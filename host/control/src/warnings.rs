//! Warnings about a motion that a user would otherwise take for a good one.

use super::closed_loop::Trace;
use super::contact_task::{ContactTask, fastest_rate};
use super::measures::ForceMeasures;
use super::position_limits::PositionLimits;
use super::result::{Adaptation, Robustness};
use super::settings::{LawKind, Settings};
use rig_model::robot::Robot;
use rig_output::{format_significant, listed};

/// Share of the ticks at the torque limit above which the limit governs the loop: in most ticks the law does not act.
const AT_LIMIT: f64 = 0.5;
/// Torque error of the adapted parameters, as a share of the torque limits, below which a growth is no warning. The
/// adaptation of an exact model moves by friction that is not compensated: 0.0007 on the IRp-6 (27 November 2026).
const GROWN: f64 = 0.01;
/// Overshoot of the force during the slide, 1, above which the loop is too slow for the surface: the overshoot that counts
/// as good.
const OVERSHOOT: f64 = 0.1;
/// Peak of the slide that is counted with for another force, over the one that was found, 1. Which joint begins to move first
/// depends on the last digits: on the IRp-6 it was 0.76 N with 5 N, and up to 0.80 N with 8 N (29 November 2026).
const MARGIN: f64 = 1.5;

/// Standard deviations of the force at rest that noise of the sensor reaches during a slide, 1.
const REACHED: f64 = 3.0;
/// Share of a peak from which that noise makes it, 1: more than anything else.
const BY_NOISE: f64 = 0.5;

/// Returns a sentence about each limit that the motion left or stayed at.
pub(crate) fn of_motion(robot: &Robot, trace: &Trace, on_surface: bool) -> Vec<String> {
    let mut warnings = PositionLimits::of(robot).left(&trace.q, trace.period);
    let ticks = trace.q.first().map_or(1, Vec::len).max(1) as f64;
    let remedy = match on_surface {
        true => "a smaller --press, or a shorter --slide",
        false => "a slower motion, or a better model",
    };
    let limited: Vec<String> = (robot.joints.iter().zip(&trace.saturated))
        .map(|(joint, count)| (joint, *count as f64 / ticks))
        .filter(|(_, share)| *share > AT_LIMIT)
        .map(|(joint, share)| format!("joint \"{}\" in {:.0} %", joint.name, 100.0 * share))
        .collect();
    if !limited.is_empty() {
        warnings.push(format!(
            "at the torque limit in more than half of the ticks, so that the law does not control it: {}. Give a lower --bandwidth, {remedy}.",
            listed(&limited)
        ));
    }
    warnings
}

/// Returns a sentence if the adaptation made the parameters worse.
pub(crate) fn of_adaptation(learnt: &Adaptation) -> Option<String> {
    let [start, end] = learnt.torque_error;
    let [own_start, own_end] = learnt.error;
    if end > start && end > GROWN {
        return Some(format!(
            "the error of the adapted parameters grew: their torque error is {:.2} % of the torque limits at the start and {:.2} % at the end. Give a lower --bandwidth, which slows the adaptation too, or start from a better model.",
            100.0 * start,
            100.0 * end
        ));
    }
    (own_end > own_start && start > GROWN).then(|| {
        format!(
            "the adapted parameters predict the torque better, but their error grew from {} to {} parameter sizes in the directions that the motion excites: they trade against each other first and converge slowly. Give a longer --duration to see them converge.",
            format_significant(own_start, 3),
            format_significant(own_end, 3)
        )
    })
}

/// Returns a sentence for each phase in which the force peaks: at the contact, and during the slide, for the hybrid law with
/// the rate at which its loop is fastest.
pub(crate) fn of_force(
    law: LawKind,
    found: &ForceMeasures,
    task: &ContactTask,
    settings: &Settings,
) -> Vec<String> {
    let contact = at_contact(found, task, settings);
    contact
        .into_iter()
        .chain(in_slide(law, found, task, settings))
        .collect()
}

/// Returns a sentence if the force peaks with one of the wrong models.
pub(crate) fn of_wrong_models(
    law: LawKind,
    draws: &Robustness,
    task: &ContactTask,
) -> Option<String> {
    let remedy = match law {
        LawKind::Hybrid => {
            "Identify the parameters better, or give a higher --rate or a softer surface."
        }
        _ => {
            "The impedance does not control the force: identify the parameters better, or press with the hybrid law."
        }
    };
    let force = |overshoot: f64| format_significant((1.0 + overshoot) * task.force, 3);
    (draws.worst > OVERSHOOT).then(|| {
        format!(
            "with parameters wrong by up to {} % the force peaks at {} N of {:.1} N in the worst of {} motions, and at {} N in the median. {remedy}",
            format_significant(100.0 * draws.share, 3),
            force(draws.worst),
            task.force,
            draws.draws - draws.failed,
            force(draws.median),
        )
    })
}

/// Returns a sentence if motions with wrong models failed.
pub(crate) fn of_failures(draws: &Robustness) -> Option<String> {
    let reason = draws.reason.as_ref()?;
    Some(format!(
        "{} of {} motions with parameters wrong by up to {} % failed. The first: {reason}",
        draws.failed,
        draws.draws,
        format_significant(100.0 * draws.share, 3),
    ))
}

/// Returns a sentence on a peak of the slide that is within the limit by chance.
fn near_limit(
    during: f64,
    found: &ForceMeasures,
    task: &ContactTask,
    settings: &Settings,
) -> String {
    let why = match by_noise(during * task.force, found, task, settings) {
        Some(_) => "the noise of the sensor makes it",
        None => "which joint begins to move first depends on the last digits of the model",
    };
    format!(
        "the force peaks {:.1} % above {:.1} N during the slide, near the limit of {:.0} %: {why}, and the next motion may peak higher. Give --wrong 0.01 to see how much the peak varies.",
        100.0 * during,
        task.force,
        100.0 * OVERSHOOT,
    )
}

/// Returns a sentence if the noise of the sensor makes a peak of `peak` (N) above the wanted force.
fn by_noise(
    peak: f64,
    found: &ForceMeasures,
    task: &ContactTask,
    settings: &Settings,
) -> Option<String> {
    let reached = REACHED * found.scatter;
    (settings.force_noise > 0.0 && reached > BY_NOISE * peak).then(|| {
        format!(
            "the force peaks at {:.1} N of {:.1} N: the noise of the sensor ({} N) makes it. The law follows the noise: the force has a standard deviation of {} N already at rest, before the slide. Give {}a sensor with less noise.",
            task.force + peak,
            task.force,
            format_significant(settings.force_noise, 3),
            format_significant(found.scatter, 2),
            match (MARGIN * peak / OVERSHOOT).ceil() {
                more if more < task.largest_force => format!("--press {more:.0}, or "),
                _ => String::new(),
            },
        )
    })
}

fn at_contact(found: &ForceMeasures, task: &ContactTask, settings: &Settings) -> Option<String> {
    let before = found.overshoot_before_slide;
    if before <= OVERSHOOT {
        return None;
    }
    by_noise(before * task.force, found, task, settings).or_else(|| {
        Some(
        format!(
            "the force peaks at {:.1} N of {:.1} N after the contact at {:.4} m/s. Give a better model, a larger --press, or a softer or less damped surface.",
            (1.0 + before) * task.force,
            task.force,
            found.impact_speed
        ))
    })
}

fn in_slide(
    law: LawKind,
    found: &ForceMeasures,
    task: &ContactTask,
    settings: &Settings,
) -> Option<String> {
    let during = found.slide_peak? / task.force - 1.0;
    if during <= OVERSHOOT {
        return (law == LawKind::Hybrid && MARGIN * during > OVERSHOOT)
            .then(|| near_limit(during, found, task, settings));
    }
    if law != LawKind::Hybrid {
        return Some(format!(
            "the force peaks at {:.1} N of {:.1} N during the slide: the impedance does not control the force, and errors of the model and of the path press on the surface. Give a better model, a smaller --impedance, or a softer surface.",
            (1.0 + during) * task.force,
            task.force
        ));
    }
    let faster = match fastest_rate(settings) {
        Some(rate) => format!("--rate {rate:.0}"),
        None => "a better model, a higher --bandwidth and --rate".to_owned(),
    };
    // Friction of the joints makes the peak, so it hardly grows with the force, but for the smallest forces. On a surface with
    // damping this was not measured.
    let peak = during * task.force;
    if let Some(noise) = by_noise(peak, found, task, settings) {
        return Some(noise);
    }
    let more = (MARGIN * peak / OVERSHOOT).ceil();
    let larger = match (task.surface.damping > 0.0, more < task.largest_force) {
        (true, _) => String::new(),
        (false, true) => format!(
            " If the peak of {} N does not grow with the force, it is less than {:.0} % from --press {more:.0} on.",
            format_significant(peak, 2),
            100.0 * OVERSHOOT,
        ),
        (false, false) => format!(
            " The peak of {} N is less than {:.0} % only of a force of {more:.0} N, which is more than the torque limits allow.",
            format_significant(peak, 2),
            100.0 * OVERSHOOT,
        ),
    };
    let inertia = |k: usize| format_significant(task.inertia[k], 3);
    let pose = match task.inertia.len() {
        0 | 1 => String::new(),
        _ => format!(
            " The tool's inertia is {} kg along the normal and {} kg along the slide: if the second is far larger, give another --pose.",
            inertia(0),
            inertia(1)
        ),
    };
    Some(format!(
        "the force peaks at {:.1} N of {:.1} N during the slide: joint friction changes its direction, and the force loop of {:.1} Hz needs time to press against it.{larger} Give {faster}, or a softer surface.{pose}",
        (1.0 + during) * task.force,
        task.force,
        task.force_bandwidth,
    ))
}
