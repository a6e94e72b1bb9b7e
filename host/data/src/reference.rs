//! References that cannot belong to their positions. They are detected before a model is blamed for a wrong motion.
//!
//! A joint follows its reference: both have the same unit, direction, zero and clock. A larger deviation than a control
//! loop can cause is a fault of the column.

use core::f64::consts::TAU;

use super::block::{Block, JointColumns};
use super::frozen::range;
use super::plausibility::Implausible;
use rig_model::robot::{Joint, JointKind, Robot};
use rig_numerics::statistics::{correlation, mean, moments_about_means};
use rig_output::format_significant;

/// Travel above which a joint counts as moving, rad or m.
const MOVES: f64 = 0.05;
/// Correlation above which a reference and a position are the same motion. The position may be that of another joint,
/// or the joint's own at another time.
const SAME_MOTION: f64 = 0.95;
/// Constant distance between reference and position above which they have different zeros, rad or m. A zero set by hand
/// is wrong by 0.02 rad; one of another convention by a quarter of a turn or similar.
const OTHER_ZERO: f64 = 0.1;
/// Minimum ratio of this distance to its standard deviation. The droop of a loop under gravity varies by its own size
/// if the joint moves farther than the droop.
const CONSTANT: f64 = 10.0;
/// Largest delay of a position behind its reference, s: that of a 0.3 Hz loop. No identified joint has a slower loop.
const SLOWEST_LOOP: f64 = 0.5;
/// Largest lead of a position before its reference, s: averaging and a period of the loop can cause it.
const AHEAD: f64 = 0.05;
/// Longest time shift of the search, s, and as a share of the recording.
const LONGEST: [f64; 2] = [20.0, 0.25];
/// Maximum number of rows compared at each shift.
const MOST: usize = 4000;
/// Maximum ratio of the unexplained variance with the shift to that as recorded.
const LESS: f64 = 0.35;
/// Factor of the least unexplained variance within which the shortest shift is taken. A periodic motion has several.
const AS_WELL: f64 = 1.3;

/// Share of a variance that rounding leaves.
const ROUNDING: f64 = 1e-9;

/// A reference that cannot belong to its joint's position.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StrangeReference {
    /// Another unit or direction.
    #[error(transparent)]
    Scale(#[from] Implausible),
    /// A constant value.
    #[error(
        "ref{joint} is {} {unit} in every row while q{joint} moves by {} {unit}: the column is not the reference of this motion; record the reference, or leave the column out",
        format_significant(*value, 4), format_significant(*travel, 3)
    )]
    Constant {
        /// Joint, 1-based.
        joint: usize,
        /// Its value.
        value: f64,
        /// Range of the position.
        travel: f64,
        /// rad or m.
        unit: &'static str,
    },
    /// Wraps after a turn.
    #[error(
        "ref{joint} jumps by a turn ({} {unit}) at t = {} s{more} while q{joint} goes on: give the reference counted on beyond a turn, as q{joint} is",
        format_significant(*by, 4), format_significant(*at, 6)
    )]
    Wrapped {
        /// Joint, 1-based.
        joint: usize,
        /// Time of the row before the first jump, s.
        at: f64,
        /// That jump.
        by: f64,
        /// Number of further jumps in words; empty if there is only one.
        more: String,
        /// rad or degrees.
        unit: &'static str,
    },
    /// Counted from another zero.
    #[error(
        "ref{joint} is {} {unit} {side} q{joint} on average{turns}, while q{joint} moves by {} {unit}: give both from one zero",
        format_significant(by.abs(), 4), format_significant(*travel, 3)
    )]
    Offset {
        /// Joint, 1-based.
        joint: usize,
        /// Reference less position, median.
        by: f64,
        /// above or below.
        side: &'static str,
        /// Remark for a whole number of turns, after a comma; otherwise empty.
        turns: String,
        /// Range of the position.
        travel: f64,
        /// rad or m.
        unit: &'static str,
    },
    /// Another clock.
    #[error(
        "ref{joint} is {} s {side} q{joint}: moved by that time both are one motion (correlation {} instead of {}); give both by one clock",
        format_significant(by.abs(), 3), format_significant(*moved, 3), format_significant(*recorded, 3)
    )]
    Clock {
        /// Joint, 1-based.
        joint: usize,
        /// Time by which the reference is later than the position, s.
        by: f64,
        /// behind or ahead of.
        side: &'static str,
        /// Correlation with the shifted reference.
        moved: f64,
        /// Correlation as recorded.
        recorded: f64,
    },
    /// The reference of another joint.
    #[error(
        "ref{joint} goes with q{other} (correlation {}) and not with q{joint} ({}): the columns are in another order than the joints of the description",
        format_significant(*there, 3), format_significant(*here, 3)
    )]
    OtherJoint {
        /// Joint, 1-based.
        joint: usize,
        /// Joint whose position it follows, 1-based.
        other: usize,
        /// Correlation with the other joint's position.
        there: f64,
        /// Correlation with its own position.
        here: f64,
    },
}

impl StrangeReference {
    /// Number of the joint, from 1.
    pub fn joint(&self) -> usize {
        match self {
            Self::Scale(Implausible::ReferenceScale { joint, .. })
            | Self::Constant { joint, .. }
            | Self::Wrapped { joint, .. }
            | Self::Offset { joint, .. }
            | Self::Clock { joint, .. }
            | Self::OtherJoint { joint, .. } => *joint,
            Self::Scale(_) => 0,
        }
    }

    /// Name of the faulty column, with the factor if there is one.
    pub fn column(&self) -> String {
        match self {
            Self::Scale(found) => found.column(),
            other => format!("ref{}", other.joint()),
        }
    }
}

/// Returns references that cannot belong to their positions, at most one fault per joint: others follow from the first.
/// Methods that use no references are not affected.
pub fn strange_references(block: &Block, robot: &Robot) -> Vec<StrangeReference> {
    (0..block.joints.len().min(robot.joints.len()))
        .filter_map(|j| {
            let own = &block.joints[j];
            let reference = own.reference.as_deref()?;
            let joint = &robot.joints[j];
            let unit = joint.kind.units().0;
            let turning = joint.kind == JointKind::Revolute;
            (turning
                .then(|| wrapped(j, &block.t, &own.q, reference))
                .flatten())
            .or_else(|| constant(j, &own.q, reference, unit))
            .or_else(|| reference_unit(j + 1, own, joint).map(StrangeReference::Scale))
            .or_else(|| offset(j, &own.q, reference, unit, turning))
            .or_else(|| other_joint(j, &block.joints, reference))
            .or_else(|| clock(j, &block.t, &own.q, reference))
        })
        .collect()
}

fn travel(values: &[f64]) -> f64 {
    let (low, high) = range(values);
    (high - low).max(0.0)
}

fn constant(
    j: usize,
    q: &[f64],
    reference: &[f64],
    unit: &'static str,
) -> Option<StrangeReference> {
    let moved = travel(q);
    (moved > MOVES && travel(reference) == 0.0).then(|| StrangeReference::Constant {
        joint: j + 1,
        value: reference[0],
        travel: moved,
        unit,
    })
}

/// Finds jumps by a turn, in rad or degrees, that occur only in the reference.
fn wrapped(j: usize, t: &[f64], q: &[f64], reference: &[f64]) -> Option<StrangeReference> {
    [(TAU, "rad"), (360.0, "degrees")]
        .into_iter()
        .find_map(|(turn, unit)| {
            let mut jumps =
                (reference.windows(2).zip(q.windows(2)))
                    .enumerate()
                    .filter(|(_, (r, q))| {
                        // No joint moves by a tenth of a turn within one row.
                        let [r, q] = [r[1] - r[0], q[1] - q[0]];
                        (r.abs() / turn - 1.0).abs() < 0.1 && q.abs() < 0.1 * TAU
                    });
            let (row, (first, _)) = jumps.next()?;
            let more = match jumps.count() {
                0 => String::new(),
                n => format!(" and at {n} more places"),
            };
            Some(StrangeReference::Wrapped {
                joint: j + 1,
                at: *t.get(row)?,
                by: first[1] - first[0],
                more,
                unit,
            })
        })
}

/// Finds a reference with another zero: whole turns, a distance larger than any motion, or a constant distance.
fn offset(
    j: usize,
    q: &[f64],
    reference: &[f64],
    unit: &'static str,
    turning: bool,
) -> Option<StrangeReference> {
    let mut apart: Vec<f64> = reference.iter().zip(q).map(|(r, q)| r - q).collect();
    apart.sort_by(f64::total_cmp);
    let by = *apart.get(apart.len() / 2)?;
    let moved = travel(q);
    let turns = (by / TAU).round();
    // The loop error is far below a tenth of a turn, so whole turns are recognised.
    let whole = turning && turns != 0.0 && (by / TAU - turns).abs() < 0.1;
    let never_there = moved > MOVES && by.abs() > moved.max(travel(reference));
    let varies = apart.iter().map(|a| (a - by).powi(2)).sum::<f64>() / apart.len() as f64;
    let fixed = moved > by.abs() && by.abs() > OTHER_ZERO.max(CONSTANT * varies.sqrt());
    (whole || ((never_there || fixed) && same(q, reference))).then(|| StrangeReference::Offset {
        joint: j + 1,
        by,
        side: if by > 0.0 { "above" } else { "below" },
        turns: match (whole, turns.abs()) {
            (false, _) => String::new(),
            (true, 1.0) => ", a whole turn".to_owned(),
            (true, n) => format!(", {n} whole turns"),
        },
        travel: moved,
        unit,
    })
}

/// Returns true if a reference and a position are the same motion at the same time.
fn same(q: &[f64], reference: &[f64]) -> bool {
    reference_scale(q, reference).is_some_and(|scale| scale > 0.0)
}

fn other_joint(j: usize, joints: &[JointColumns], reference: &[f64]) -> Option<StrangeReference> {
    let own = &joints[j].q;
    if same(own, reference) || travel(reference) < MOVES {
        return None;
    }
    let here = correlation(own, reference);
    (0..joints.len())
        .filter(|k| *k != j && travel(&joints[*k].q) > MOVES)
        .map(|k| (k, correlation(&joints[k].q, reference)))
        .filter(|(_, there)| *there > SAME_MOTION)
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(k, there)| StrangeReference::OtherJoint {
            joint: j + 1,
            other: k + 1,
            there,
            here: if here.is_finite() { here } else { 0.0 },
        })
}

/// Finds a reference that has another unit or direction than its position.
fn reference_unit(k: usize, columns: &JointColumns, joint: &Joint) -> Option<Implausible> {
    let ratio = reference_scale(&columns.q, columns.reference.as_ref()?)?;
    let (unit, _) = joint.kind.units();
    // A factor between 0.1 and 10 is a loop error; unit mistakes have 57 and 1000.
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
}

/// Returns the spread of the reference over that of the position, negative for opposite directions. Returns `None` if
/// they are not the same motion.
pub fn reference_scale(q: &[f64], reference: &[f64]) -> Option<f64> {
    // The variance of a constant column is rounding error.
    let is_constant = |column: &[f64]| column.windows(2).all(|pair| pair[0] == pair[1]);
    if is_constant(q) || is_constant(reference) {
        return None;
    }
    let [xx, xy, yy] = moments_about_means(q, reference);
    let alike = xy / (xx * yy).sqrt();
    // A position far behind its reference is still correlated (KUKA LWR4+: 0.77). Opposite directions need a
    // correlation below −0.9.
    (alike.is_finite() && !(-0.9..=0.6).contains(&alike)).then(|| (yy / xx).sqrt() * alike.signum())
}

/// Finds a reference that is shifted in time by more than a loop can cause.
fn clock(j: usize, t: &[f64], q: &[f64], reference: &[f64]) -> Option<StrangeReference> {
    if travel(q) < MOVES || travel(reference) < MOVES {
        return None;
    }
    let rows = t.len().min(q.len()).min(reference.len());
    let thin = rows.div_ceil(MOST).max(1);
    let means =
        |column: &[f64]| -> Vec<f64> { (column[..rows].chunks_exact(thin)).map(mean).collect() };
    let (q, reference) = (means(q), means(reference));
    let time = t.get(rows.checked_sub(1)?)? - t.first()?;
    let step = time / rows as f64 * thin as f64;
    let reach = (LONGEST[0].min(LONGEST[1] * time) / step) as usize;
    if reach == 0 || reach >= q.len() {
        return None;
    }
    // Correlation with the reference later than the position by each lag.
    let at = |lag: i64| {
        let shift = lag.unsigned_abs() as usize;
        let kept = q.len().saturating_sub(shift);
        match lag >= 0 {
            true => correlation(&q[..kept], &reference[shift..]),
            false => correlation(&q[shift..], &reference[..kept]),
        }
    };
    let reach = reach as i64;
    let left: Vec<(i64, f64)> = (-reach..=reach)
        .map(|lag| (lag, at(lag)))
        .filter(|(_, r)| *r > 0.0)
        .map(|(lag, r)| (lag, (1.0 - r * r).max(ROUNDING)))
        .collect();
    let least = left.iter().map(|l| l.1).fold(f64::INFINITY, f64::min);
    let (lag, _) = left
        .iter()
        .filter(|(_, own)| *own <= AS_WELL * least)
        .min_by_key(|(lag, _)| lag.abs())?;
    let (by, moved, recorded) = (*lag as f64 * step, at(*lag), at(0));
    let late = !(-SLOWEST_LOOP..=AHEAD).contains(&by);
    let before = if recorded > 0.0 {
        1.0 - recorded * recorded
    } else {
        1.0
    };
    (late && moved > SAME_MOTION && least < LESS * before).then(|| StrangeReference::Clock {
        joint: j + 1,
        by,
        side: if by > 0.0 { "behind" } else { "ahead of" },
        moved,
        recorded,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::path::Path;

    use super::*;
    use rig_model::robot::ONE_LINK_TEMPLATE;

    fn robot(joints: usize) -> Robot {
        let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("r.toml")).unwrap();
        for k in 1..joints {
            let mut joint = robot.joints[0].clone();
            joint.name = format!("joint {k}");
            robot.joints.push(joint);
        }
        robot
    }

    /// Excitation of each joint, behind its reference by `lag` s; the motion starts and ends at rest.
    fn made(joints: usize, lag: f64) -> Block {
        let t: Vec<f64> = (0..20_000).map(|k| f64::from(k) * 1e-3).collect();
        let motion = |j: usize, t: f64| {
            let w = 1.7 + 0.9 * j as f64;
            let rise = (t / 3.0).clamp(0.0, 1.0) * ((20.0 - t) / 3.0).clamp(0.0, 1.0);
            rise * (0.9 * (w * t).sin() + 0.4 * (2.3 * w * t).cos())
        };
        let joints = (0..joints)
            .map(|j| JointColumns {
                q: t.iter().map(|t| motion(j, t - lag)).collect(),
                reference: Some(t.iter().map(|t| motion(j, *t)).collect()),
                ..JointColumns::default()
            })
            .collect();
        Block {
            t,
            joints,
            first_line: 2,
            ..Block::default()
        }
    }

    fn doubts(block: &Block) -> Vec<String> {
        let found = strange_references(block, &robot(block.joints.len()));
        found.iter().map(ToString::to_string).collect()
    }

    fn changed(change: impl Fn(f64) -> f64) -> String {
        let mut block = made(1, 0.02);
        for value in block.joints[0].reference.as_mut().unwrap() {
            *value = change(*value);
        }
        let doubts = doubts(&block);
        assert_eq!(doubts.len(), 1, "{doubts:?}");
        doubts[0].clone()
    }

    #[test]
    fn references_of_sound_loops_are_not_strange() {
        for joints in [1, 3] {
            for lag in [0.0, 0.02, 0.1, 0.3] {
                assert_eq!(doubts(&made(joints, lag)), [""; 0], "{lag}");
            }
        }
        // A loop with droop, noise, a joint that sags while holding, a small swing at a constant reference.
        let mut block = made(2, 0.1);
        for (k, q) in block.joints[0].q.iter_mut().enumerate() {
            *q = 0.8 * *q - 0.2 + 0.01 * (k as f64).sin();
        }
        block.joints[1].q = vec![0.31; block.t.len()];
        block.joints[1].reference = Some(vec![0.4; block.t.len()]);
        assert_eq!(doubts(&block), [""; 0]);
    }

    #[test]
    fn wrapped_references_are_told_by_their_turn() {
        let mut block = made(1, 0.02);
        block.joints[0].q.iter_mut().for_each(|q| *q += 3.0);
        for wrap in [
            |r: f64| (r + 3.0).rem_euclid(TAU),
            |r: f64| (r + 3.0 + 3.0).rem_euclid(TAU) - 3.0,
            |r: f64| (r + 3.0 + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0,
        ] {
            let mut block = block.clone();
            for value in block.joints[0].reference.as_mut().unwrap() {
                *value = wrap(2.5 * *value);
            }
            block.joints[0]
                .q
                .iter_mut()
                .for_each(|q| *q = 2.5 * (*q - 3.0) + 3.0);
            let doubts = doubts(&block);
            assert!(
                doubts[0].contains("ref1 jumps by a turn (") && doubts[0].contains("more places"),
                "{doubts:?}"
            );
        }
        let mut degrees = block;
        for value in degrees.joints[0].reference.as_mut().unwrap() {
            *value = (2.5 * *value + 3.0).to_degrees().rem_euclid(360.0);
        }
        degrees.joints[0]
            .q
            .iter_mut()
            .for_each(|q| *q = 2.5 * (*q - 3.0) + 3.0);
        assert!(doubts(&degrees)[0].contains("degrees) at t ="));
    }

    #[test]
    fn other_zeros_units_and_senses_are_told() {
        assert!(changed(|r| r + TAU).contains("above q1 on average, a whole turn"));
        assert!(changed(|r| r - 2.0 * TAU).contains("below q1 on average, 2 whole turns"));
        assert!(changed(|r| r + 3.1).contains("ref1 is 3.1"));
        assert!(changed(|r| r - 0.25 * TAU).contains("rad below q1 on average, while q1 moves"));
        assert!(changed(|r| r + 0.125 * TAU).contains("rad above q1 on average, while q1 moves"));
        assert!(changed(f64::to_degrees).contains("as degrees would"));
        assert!(changed(|r| -r).contains("the other way"));
        assert!(changed(|_| 0.0).contains("ref1 is 0 rad in every row while q1 moves by"));
        assert!(changed(|_| -1.57).contains("in every row"));
    }

    #[test]
    fn other_times_and_joints_are_told() {
        for by in [-4.0, -1.5, 0.8, 3.0] {
            let mut block = made(1, 0.02);
            let other = made(1, by);
            block.joints[0].reference = Some(other.joints[0].q.clone());
            let doubts = doubts(&block);
            let word = if by > 0.0 { "behind" } else { "ahead of" };
            assert!(
                doubts.len() == 1 && doubts[0].contains(&format!("s {word} q1: moved")),
                "{by}: {doubts:?}"
            );
        }
        let mut block = made(3, 0.02);
        let (first, third) = (
            block.joints[0].reference.take(),
            block.joints[2].reference.take(),
        );
        (block.joints[0].reference, block.joints[2].reference) = (third, first);
        let doubts = doubts(&block);
        assert!(
            doubts.len() == 2 && doubts[0].contains("ref1 goes with q3"),
            "{doubts:?}"
        );
        assert!(doubts[1].contains("ref3 goes with q1"), "{doubts:?}");
    }
}
