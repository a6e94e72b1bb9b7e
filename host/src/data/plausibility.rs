//! Wrong units, noticed before they become wrong parameters.
//!
//! Every rule leaves at least a factor of ten between what honest recordings do and what raises it;
//! factors of unit mistakes are 57 (degrees) and 1000 (milli). Without limits in the robot's description
//! only what the columns say about each other is checked.

use super::jump::jump;
use super::spike::spike;
use super::{Block, JointColumns};
use crate::robot::{Joint, JointKind, Robot, is_placeholder};

/// A column that cannot be in the unit of the contract.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Implausible {
    /// Position of a revolute joint in degrees.
    #[error(
        "q{joint} looks like degrees (range {lowest:.4} to {highest:.4}, while the joint reaches {limit:.4} rad); give it in rad"
    )]
    Degrees {
        /// Joint, 1-based.
        joint: usize,
        /// Lowest value.
        lowest: f64,
        /// Highest value.
        highest: f64,
        /// Farthest position limit, rad.
        limit: f64,
    },
    /// Position far outside the limits.
    #[error(
        "q{joint} lies far outside the joint's range ({lowest:.4} to {highest:.4}, while the limits are {lower} to {upper} {unit}); give it in {unit} or correct the limits"
    )]
    Position {
        /// Joint, 1-based.
        joint: usize,
        /// Lowest value.
        lowest: f64,
        /// Highest value.
        highest: f64,
        /// Lower limit.
        lower: f64,
        /// Upper limit.
        upper: f64,
        /// rad or m.
        unit: &'static str,
    },
    /// Faster than ten times the limit.
    #[error(
        "q{joint} moves at up to {speed:.4} {unit}/s, more than ten times its limit of {limit} {unit}/s; check the units of q{joint} and t and the limit"
    )]
    Velocity {
        /// Joint, 1-based.
        joint: usize,
        /// Highest speed, over ten samples.
        speed: f64,
        /// Limit.
        limit: f64,
        /// rad or m.
        unit: &'static str,
    },
    /// A position that jumps.
    #[error(
        "q{joint} jumps by {by:.4} {unit} from one row to the next at t = {at} s{more}, while its fastest motion is {fastest:.2e} {unit} a row; {mend}"
    )]
    Jump {
        /// Joint, 1-based.
        joint: usize,
        /// Time of the row before the largest jump, s.
        at: f64,
        /// Largest jump.
        by: f64,
        /// How many more there are, with words; empty where there is one.
        more: String,
        /// Largest change from row to row apart from jumps.
        fastest: f64,
        /// What would be right.
        mend: &'static str,
        /// rad or m.
        unit: &'static str,
    },
    /// Single rows of effort that no other comes near.
    #[error(
        "tau{joint} is {value:.4} {unit} in the row at t = {at} s{more}, while it is hardly ever more than {usual:.4} {unit} elsewhere; a row like that is no torque: look for a loose contact or a lost bit, and take the row out"
    )]
    Spike {
        /// Joint, 1-based.
        joint: usize,
        /// Time of the largest, s.
        at: f64,
        /// What stands there.
        value: f64,
        /// How many more there are, with words; empty where there is one.
        more: String,
        /// Largest magnitude elsewhere, but for one row in a thousand.
        usual: f64,
        /// N·m or N.
        unit: &'static str,
    },
    /// Measured velocity and change of position do not belong together.
    #[error(
        "qd{joint} and q{joint} do not belong together: q changes by {ratio:.4} times the integral of qd; give both in {unit} and {unit}/s and t in s"
    )]
    VelocityScale {
        /// Joint, 1-based.
        joint: usize,
        /// Change of position over integral of velocity; 1 would be right.
        ratio: f64,
        /// rad or m.
        unit: &'static str,
    },
    /// Reference and position do not belong together.
    #[error(
        "ref{joint} does not belong to q{joint}: it moves {ratio:.4} times as far{hint}, while both should be in {unit} and counted in the same sense"
    )]
    ReferenceScale {
        /// Joint, 1-based.
        joint: usize,
        /// Change of the reference over that of the position; 1 would be right.
        ratio: f64,
        /// What a factor like that is called, with a comma before it; empty where it has no name.
        hint: &'static str,
        /// rad or m.
        unit: &'static str,
    },
    /// Effort far above the limit.
    #[error(
        "tau{joint} looks too large by a factor of about 1000, as m{unit} would be (up to {highest:.4}, while the limit is {limit} {unit}); give it in {unit}, at the joint"
    )]
    EffortTooLarge {
        /// Joint, 1-based.
        joint: usize,
        /// Largest magnitude.
        highest: f64,
        /// Limit.
        limit: f64,
        /// N·m or N.
        unit: &'static str,
    },
    /// Effort far below what moves the joint.
    #[error(
        "tau{joint} looks too small by a factor of about 1000, as k{unit} would be (at most {highest:.3e} while the joint moves; its {of} is {expected} {unit}); give it in {unit}, at the joint, or correct the {of} in the description"
    )]
    EffortTooSmall {
        /// Joint, 1-based.
        joint: usize,
        /// Largest magnitude.
        highest: f64,
        /// What it is compared with.
        of: &'static str,
        /// That value.
        expected: f64,
        /// N·m or N.
        unit: &'static str,
    },
    /// No effort at all.
    #[error(
        "tau{joint} is 0 in every row while the joint moves; check that the column is the torque and was recorded"
    )]
    NoEffort {
        /// Joint, 1-based.
        joint: usize,
    },
    /// Time in milliseconds or in a smaller unit.
    #[error("t looks like {} (its steps are {step:.4}); give it in s", unit_of_steps(*step))]
    NotSeconds {
        /// Median step.
        step: f64,
    },
}

impl Implausible {
    /// The column at fault, with its factor where it has one.
    pub fn column(&self) -> String {
        match self {
            Self::Degrees { joint, .. }
            | Self::Position { joint, .. }
            | Self::Jump { joint, .. }
            | Self::Velocity { joint, .. } => format!("q{joint}"),
            Self::VelocityScale { joint, .. } => format!("qd{joint}"),
            Self::ReferenceScale { joint, ratio, .. } => format!("ref{joint} ({ratio:.4})"),
            Self::EffortTooLarge { joint, .. }
            | Self::EffortTooSmall { joint, .. }
            | Self::NoEffort { joint }
            | Self::Spike { joint, .. } => format!("tau{joint}"),
            Self::NotSeconds { .. } => "t".into(),
        }
    }
}

/// Everything in `block` that cannot be in SI units for `robot`; empty where all is well.
pub fn plausibility(block: &Block, robot: &Robot) -> Vec<Implausible> {
    let mut found = Vec::new();
    let mut steps: Vec<f64> = block
        .t
        .iter()
        .zip(block.t.iter().skip(1))
        .map(|(a, b)| b - a)
        .collect();
    steps.sort_by(f64::total_cmp);
    // Motion sampled at 5 Hz or less cannot be identified anyway; 0.2 ms as milliseconds is this much.
    if let Some(&step) = steps.get(steps.len() / 2)
        && step >= 0.2
    {
        found.push(Implausible::NotSeconds { step });
    }
    for (k, (columns, joint)) in (1..).zip(block.joints.iter().zip(&robot.joints)) {
        check_joint(k, &block.t, columns, joint, &mut found);
    }
    found
}

/// The unit of time that steps of this size look like, where they are too long for seconds: rows come at between 5 and
/// 5000 Hz.
pub(crate) fn unit_of_steps(step: f64) -> &'static str {
    match step {
        ..200.0 => "milliseconds",
        ..2e5 => "microseconds",
        _ => "nanoseconds",
    }
}

/// That a fault is there more than once, in words.
fn more(count: usize) -> String {
    match count {
        1 => String::new(),
        n => format!(" and at {} more places", n - 1),
    }
}

fn range(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(*v), h.max(*v))
        })
}

fn check_joint(
    k: usize,
    t: &[f64],
    columns: &JointColumns,
    joint: &Joint,
    found: &mut Vec<Implausible>,
) {
    let (unit, effort_unit) = match joint.kind {
        JointKind::Revolute => ("rad", "N·m"),
        JointKind::Prismatic => ("m", "N"),
    };
    let (lowest, highest) = range(&columns.q);
    if columns.q.is_empty() {
        return;
    }
    if let Some(jump) = jump(t, &columns.q) {
        found.push(Implausible::Jump {
            joint: k,
            at: t[jump.row],
            by: jump.by,
            more: more(jump.count),
            fastest: jump.fastest,
            mend: if unit == "rad" && (jump.by.abs() / core::f64::consts::TAU - 1.0).abs() < 0.02 {
                "that is a turn: give the angle counted on beyond it"
            } else {
                "give recordings that were put together one by one, and check the encoder for lost counts"
            },
            unit,
        });
    } else if let Some(limits) = &joint.limits {
        let [lower, upper] = limits.position;
        let reach = lower.abs().max(upper.abs());
        let farthest = lowest.abs().max(highest.abs());
        let degrees = farthest.to_radians() <= 1.2 * reach;
        if reach.is_finite() && farthest > 5.0 * reach {
            found.push(if joint.kind == JointKind::Revolute && degrees {
                Implausible::Degrees {
                    joint: k,
                    lowest,
                    highest,
                    limit: reach,
                }
            } else {
                Implausible::Position {
                    joint: k,
                    lowest,
                    highest,
                    lower,
                    upper,
                    unit,
                }
            });
        } else if let Some(speed) = highest_speed(t, &columns.q)
            && speed > 10.0 * limits.velocity
        {
            found.push(Implausible::Velocity {
                joint: k,
                speed,
                limit: limits.velocity,
                unit,
            });
        }
    }
    if let Some(ratio) = columns
        .qd
        .as_ref()
        .and_then(|qd| velocity_scale(t, &columns.q, qd))
    {
        // Degrees or rpm against rad are at least 6 apart, milli 1000.
        if !(0.2..5.0).contains(&ratio.abs()) {
            found.push(Implausible::VelocityScale {
                joint: k,
                ratio,
                unit,
            });
        }
    }
    check_effort(k, t, columns, joint, effort_unit, highest - lowest, found);
}

/// Highest mean speed over ten samples: a single step of a coarse encoder is no speed.
fn highest_speed(t: &[f64], q: &[f64]) -> Option<f64> {
    const SPAN: usize = 10;
    let rows = t.iter().zip(q);
    let later = rows.clone().skip(SPAN);
    rows.zip(later)
        .map(|((t0, q0), (t1, q1))| ((q1 - q0) / (t1 - t0)).abs())
        .reduce(f64::max)
}

/// Least-squares factor between changes of q and the integral of qd over windows of twenty samples, if
/// both go together.
pub(crate) fn velocity_scale(t: &[f64], q: &[f64], qd: &[f64]) -> Option<f64> {
    const SPAN: usize = 20;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for start in (SPAN..q.len()).step_by(SPAN) {
        let rows = start - SPAN..start;
        let x: f64 = rows
            .clone()
            .map(|i| 0.5 * (qd[i] + qd[i + 1]) * (t[i + 1] - t[i]))
            .sum();
        let y = q[start] - q[start - SPAN];
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    // Only where the two are clearly the same motion: correlation above 0.8.
    (xx > 0.0 && yy > 0.0 && xy.abs() > 0.8 * (xx * yy).sqrt()).then(|| xy / xx)
}

/// References that are not in the unit or sense of their positions; what uses no references is right without them.
pub fn strange_references(block: &Block, robot: &Robot) -> Vec<Implausible> {
    let joints = (1..).zip(block.joints.iter().zip(&robot.joints));
    joints
        .filter_map(|(k, (columns, joint))| {
            let ratio = reference_scale(&columns.q, columns.reference.as_ref()?)?;
            let (unit, _) = joint.kind.units();
            // What does not follow its reference by a tenth is a fault of the loop; units are 57 and 1000.
            let hint = match (ratio, unit) {
                (0.1..10.0, _) => return None,
                (50.0..65.0, "rad") => ", as degrees would",
                (0.0154..0.02, "rad") => ", as if turned from degrees to rad twice",
                (900.0..1100.0, "m") => ", as millimetres would",
                (r, _) if r < 0.0 => ", the other way",
                _ => "",
            };
            Some(Implausible::ReferenceScale {
                joint: k,
                ratio,
                hint,
                unit,
            })
        })
        .collect()
}

/// Spread of the reference over that of the position, below zero where they run against each other; none where they are
/// not the same motion.
pub(crate) fn reference_scale(q: &[f64], reference: &[f64]) -> Option<f64> {
    let count = q.len().max(1) as f64;
    let (mean_q, mean_ref) = (
        q.iter().sum::<f64>() / count,
        reference.iter().sum::<f64>() / count,
    );
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in q.iter().zip(reference) {
        let (x, y) = (x - mean_q, y - mean_ref);
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    let alike = xy / (xx * yy).sqrt();
    // A position that lags far behind its reference is still like it (KUKA LWR4+: 0.77); one that runs against it has to be
    // its very mirror image.
    (alike.is_finite() && !(-0.9..=0.6).contains(&alike)).then(|| (yy / xx).sqrt() * alike.signum())
}

fn check_effort(
    k: usize,
    t: &[f64],
    columns: &JointColumns,
    joint: &Joint,
    unit: &'static str,
    travel: f64,
    found: &mut Vec<Implausible>,
) {
    if let Some(spike) = spike(&columns.tau) {
        found.push(Implausible::Spike {
            joint: k,
            at: t[spike.row],
            value: spike.value,
            more: more(spike.count),
            usual: spike.usual,
            unit,
        });
        return;
    }
    let highest = columns.tau.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let limit = joint.limits.as_ref().and_then(|l| l.torque);
    if let Some(limit) = limit
        && highest > 20.0 * limit
    {
        found.push(Implausible::EffortTooLarge {
            joint: k,
            highest,
            limit,
            unit,
        });
        return;
    }
    // 0.05 rad or 5 cm of travel: a joint that hardly moves may well need next to nothing.
    if columns.tau.is_empty() || travel < 0.05 {
        return;
    }
    if highest == 0.0 {
        found.push(Implausible::NoEffort { joint: k });
        return;
    }
    // A joint cannot move against its friction with a hundredth of it, whatever else acts.
    let coulomb = joint
        .friction
        .as_ref()
        .map(|f| f.coulomb)
        .filter(|c| *c > 0.0);
    let too_small = match (coulomb, limit) {
        (Some(c), _) if highest < 0.01 * c => Some(("Coulomb friction", c)),
        // A limit that stands for "none" says nothing of what moves the joint, and where the link is described, that says more than
        // any limit: a wrist in a table of equal limits may well need a thousandth of its own.
        (None, Some(l))
            if joint.inertial.is_none() && highest < 5e-4 * l && !is_placeholder(l, 1e3) =>
        {
            Some(("limit", l))
        }
        _ => None,
    };
    if let Some((of, expected)) = too_small {
        found.push(Implausible::EffortTooSmall {
            joint: k,
            highest,
            of,
            expected,
            unit,
        });
    }
}
