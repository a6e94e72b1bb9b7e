//! Detects wrong units before they lead to wrong parameters.
//!
//! Each rule keeps a wide margin to correct recordings; unit mistakes have factors of 57 (degrees) and 1000 (milli).
//! Without limits in the robot's description, the columns are only compared with each other.

use super::block::{Block, JointColumns};
use super::frozen::{Frozen, frozen_position, frozen_torque, range};
use super::lost_rows::{Advances, LostRows, advances};
use super::place::{Place, RowAt};
use super::position_jump::largest_position_jump;
use super::rate_match::{RateMismatch, rate_mismatch};
use super::rate_spike::rate_spike;
use super::rate_zeros::{RateZeros, rate_zeros};
use super::sample_hold::repeated_rows;
use super::stale_rows::{StaleRows, stale_rows};
use super::torque_spike::largest_torque_spike;
use super::unsigned::{Unsigned, unsigned};
use rig_model::robot::{Joint, JointKind, Robot, is_placeholder};
use rig_numerics::statistics::median;
use rig_output::{format_short, format_significant, format_time, format_trimmed, listed};

/// Number of rows at the start by which the columns are checked: a wrong unit or direction shows from the start.
pub const JUDGED_ROWS: usize = 100_000;

/// Most stale rows in a row that are a remark.
const FEW_STALE: usize = 4;

/// A column that cannot have the required unit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Implausible {
    /// Position of a revolute joint in degrees.
    #[error(
        "q{joint} looks like degrees ({}, while the joint reaches {} rad); give it in rad, or name its unit with --unit q{joint}=deg{or}",
        range_words(*lowest, *highest), format_short(*limit)
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
        /// Another possible cause, after a comma; empty if there is no other.
        or: String,
    },
    /// Position far outside the limits.
    #[error(
        "q{joint} lies far outside the joint's range ({}, while the limits are {lower} to {upper} {unit}); give it in {unit} or correct the limits{or}",
        range_words(*lowest, *highest)
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
        /// Another possible cause, after a comma; empty if there is no other.
        or: String,
    },
    /// Speed above ten times the limit.
    #[error(
        "q{joint} moves at up to {} {unit}/s, more than ten times its limit of {limit} {unit}/s; check the units of q{joint} and t and the limit",
        format_short(*speed)
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
    /// A position with jumps.
    #[error(
        "q{joint} jumps by {} {unit} from one row to the next at t = {} s{more}, while its fastest motion is {} {unit} a row; {mend}",
        format_short(*by), format_time(*at),
        format_significant(*fastest, 3)
    )]
    Jump {
        /// Joint, 1-based.
        joint: usize,
        /// Time of the row before the largest jump, s.
        at: f64,
        /// Largest jump.
        by: f64,
        /// Number of further jumps in words; empty if there is only one.
        more: String,
        /// Largest change from row to row without the jumps.
        fastest: f64,
        /// Advice for a correction.
        mend: &'static str,
        /// rad or m.
        unit: &'static str,
    },
    /// Single rows of a position far away from both rows beside them.
    #[error(
        "q{joint} is {} {unit} at {at}{more}, while the rows beside it have {} {unit}; no joint moves there and back in two rows: look for a lost bit or a damaged message, and take the row out. It is then interpolated",
        format_short(*value), format_short(*beside)
    )]
    Outlier {
        /// Joint, 1-based.
        joint: usize,
        /// The row that is farthest away.
        at: RowAt,
        /// Its value.
        value: f64,
        /// Value of the row before.
        beside: f64,
        /// Number of further rows in words; empty if there is only one.
        more: String,
        /// rad or m.
        unit: &'static str,
    },
    /// A position or torque that keeps one value while the motion goes on.
    #[error(
        "{column}{joint} stays at {} {unit} from {from} {until}, while {going_on}: a sensor or a topic that stopped. {mend}",
        format_short(*value)
    )]
    Frozen {
        /// Name of the column without its number.
        column: &'static str,
        /// Joint, 1-based.
        joint: usize,
        /// Its value.
        value: f64,
        /// N·m, N, rad or m.
        unit: &'static str,
        /// First row with this value.
        from: RowAt,
        /// Where it ends, in words.
        until: String,
        /// What shows that the motion goes on.
        going_on: String,
        /// Advice for a correction.
        mend: &'static str,
    },
    /// Rows whose values stand still while none arrive, and catch up in one row.
    #[error(
        "the positions stand still in {rows} rows at {places} (first at {at}; up to {most} in a row) and catch up in the next one. t is right: these rows are stale values. Take them out; up to four missing rows in a row are then interpolated"
    )]
    StaleRows {
        /// First of them.
        at: RowAt,
        /// Number of rows.
        rows: usize,
        /// Number of places in words.
        places: String,
        /// Most rows at one place.
        most: usize,
    },
    /// Single rows of effort far above all others.
    #[error(
        "tau{joint} is {} {unit} in the row at t = {} s{more}, while it is hardly ever more than {} {unit} elsewhere; a row like that is no torque: look for a loose contact or a lost bit, and take the row out",
        format_short(*value), format_time(*at), format_short(*usual)
    )]
    Spike {
        /// Joint, 1-based.
        joint: usize,
        /// Time of the largest spike, s.
        at: f64,
        /// Value in this row.
        value: f64,
        /// Number of further spikes in words; empty if there is only one.
        more: String,
        /// 99.9th percentile of the magnitude.
        usual: f64,
        /// N·m or N.
        unit: &'static str,
    },
    /// Measured velocity that does not fit the change of position.
    #[error(
        "qd{joint} and q{joint} do not belong together: q changes by {} times the integral of qd; give both in {unit} and {unit}/s and t in s",
        format_short(*ratio)
    )]
    VelocityScale {
        /// Joint, 1-based.
        joint: usize,
        /// Change of position over integral of velocity; 1 is correct.
        ratio: f64,
        /// rad or m.
        unit: &'static str,
    },
    /// Reference that does not fit the position.
    #[error(
        "ref{joint} does not belong to q{joint}: it moves {} times as far{hint}, while both should be in {unit} and counted in the same sense",
        format_short(*ratio)
    )]
    ReferenceScale {
        /// Joint, 1-based.
        joint: usize,
        /// Change of the reference over that of the position; 1 is correct.
        ratio: f64,
        /// Usual cause of such a factor, after a comma; empty if there is none.
        hint: &'static str,
        /// rad or m.
        unit: &'static str,
    },
    /// A position that keeps each value for several rows.
    #[error(
        "{} only in every {}: a topic of {slow} Hz in a recording of {fast} Hz. Velocity and acceleration of such stairs are wrong; record the position at the rate of the rows, or keep only the rows in which it changes", changes("q", joints), nth(*rows)
    )]
    HeldPosition {
        /// Joints, 1-based.
        joints: Vec<usize>,
        /// Number of rows with the same value.
        rows: usize,
        /// Rate of the values, Hz.
        slow: String,
        /// Rate of the rows, Hz.
        fast: String,
    },
    /// Rows that are missing while t goes on evenly.
    #[error(
        "t counts on over missing rows: at {places} (first at t = {} s) the positions advance in one row by what {advance} take{each}, so that velocity and acceleration are wrong there; {}",
        format_time(*at), lost_how(*held)
    )]
    LostRows {
        /// Time of the row before the first place, s.
        at: f64,
        /// Number of places in words.
        places: String,
        /// Number of rows that one row replaces there, in words.
        advance: String,
        /// Number of missing rows in words; empty if there is one place.
        each: String,
        /// True if the positions stand still before most places.
        held: bool,
    },
    /// Rows that repeat the row before while the joints move.
    #[error(
        "t counts repeated rows: {} % of the rows in motion (the first at t = {} s) have the positions and torques of the row before; {}",
        format_significant(*percent, 2), format_time(*at), repeated_how(*percent, *made_up)
    )]
    RepeatedRows {
        /// Time of the first repeated row, s.
        at: f64,
        /// Share of the rows in motion, %.
        percent: f64,
        /// True if the next row makes up for most of them, so that all other rows have their right time.
        made_up: bool,
    },
    /// An effort that keeps each value for several rows.
    #[error(
        "{} only in every {}: values of {slow} Hz in a recording of {fast} Hz. A measured torque is then late by {late} ms on average, and inertia and friction are biased: record it at the rate of the rows. A command that the drive holds for that long is right as it stands", changes("tau", joints), nth(*rows)
    )]
    HeldEffort {
        /// Joints, 1-based.
        joints: Vec<usize>,
        /// Number of rows with the same value.
        rows: usize,
        /// Rate of the values, Hz.
        slow: String,
        /// Rate of the rows, Hz.
        fast: String,
        /// Mean delay, ms.
        late: String,
    },
    /// A column whose negative values were read as large positive ones.
    #[error(
        "{column}{joint} is never negative, but in {share} % of the rows it is far above all others, as a negative number is that was read as an unsigned one ({how}); read the register as a signed number"
    )]
    Unsigned {
        /// Name of the column without its number.
        column: &'static str,
        /// Joint, 1-based.
        joint: usize,
        /// Share of the rows, %.
        share: String,
        /// How the sign was lost.
        how: String,
    },
    /// A measured velocity or acceleration that is zero throughout.
    #[error(
        "{column}{joint} is 0 in every row while the joint moves; check that the column was recorded, or leave it out"
    )]
    NoRate {
        /// Name of the column without its number.
        column: &'static str,
        /// Joint, 1-based.
        joint: usize,
    },
    /// Spikes of a measured velocity that the position does not show.
    #[error(
        "qd{joint} is {value} {unit}/s in the row at t = {} s{more}, where q{joint} changes by {speed} {unit}/s; such rows are no velocity: look for a wrapped counter or a lost sample, or leave qd{joint} out",
        format_time(*at)
    )]
    RateSpike {
        /// Joint, 1-based.
        joint: usize,
        /// Time of the largest spike, s.
        at: f64,
        /// Value in this row.
        value: String,
        /// Velocity of the position in this row.
        speed: String,
        /// Number of further spikes in words; empty if there is only one.
        more: String,
        /// rad or m.
        unit: &'static str,
    },
    /// A measured velocity that is not that of the position.
    #[error("qd{joint} is not the velocity of q{joint}: {how}")]
    RateMismatch {
        /// Joint, 1-based.
        joint: usize,
        /// What is wrong with it, and what mends it.
        how: String,
    },
    /// Effort far above the limit.
    #[error(
        "tau{joint} looks too large by a factor of about 1000, as m{unit} would be (up to {}, while the limit is {} {unit}); give it in {unit}, at the joint",
        format_short(*highest), format_short(*limit)
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
    /// Effort too low to move the joint.
    #[error(
        "tau{joint} looks too small by a factor of about 1000, as k{unit} would be (at most {} while the joint moves; its {of} is {expected} {unit}); give it in {unit}, at the joint, or correct the {of} in the description",
        format_significant(*highest, 4)
    )]
    EffortTooSmall {
        /// Joint, 1-based.
        joint: usize,
        /// Largest magnitude.
        highest: f64,
        /// Name of the value that it is compared with.
        of: &'static str,
        /// This value.
        expected: f64,
        /// N·m or N.
        unit: &'static str,
    },
    /// Effort that is zero throughout.
    #[error(
        "tau{joint} is 0 in every row while the joint moves; check that the column is the torque and was recorded"
    )]
    NoEffort {
        /// Joint, 1-based.
        joint: usize,
    },
    /// Time in milliseconds or in a smaller unit.
    #[error("t looks like {} (its steps are {}); give it in s, or --unit t={}", unit_of_steps(*step), format_short(*step), sign_of_steps(*step))]
    NotSeconds {
        /// Median step.
        step: f64,
    },
}

impl Implausible {
    /// Name of the faulty column, with the factor if there is one.
    pub fn column(&self) -> String {
        match self {
            Self::Degrees { joint, .. }
            | Self::Position { joint, .. }
            | Self::Jump { joint, .. }
            | Self::Outlier { joint, .. }
            | Self::Velocity { joint, .. } => format!("q{joint}"),
            Self::Frozen { column, joint, .. } => format!("{column}{joint}"),
            Self::VelocityScale { joint, .. }
            | Self::RateSpike { joint, .. }
            | Self::RateMismatch { joint, .. } => format!("qd{joint}"),
            Self::Unsigned { column, joint, .. } | Self::NoRate { column, joint } => {
                format!("{column}{joint}")
            }
            Self::ReferenceScale { joint, ratio, .. } => {
                format!("ref{joint} ({})", format_short(*ratio))
            }
            Self::EffortTooLarge { joint, .. }
            | Self::EffortTooSmall { joint, .. }
            | Self::NoEffort { joint }
            | Self::Spike { joint, .. } => format!("tau{joint}"),
            Self::HeldPosition { joints, .. } => columns_of("q", joints),
            Self::HeldEffort { joints, .. } => columns_of("tau", joints),
            Self::NotSeconds { .. }
            | Self::LostRows { .. }
            | Self::StaleRows { .. }
            | Self::RepeatedRows { .. } => "t".into(),
        }
    }
}

impl Implausible {
    /// Returns true if the column may still be correct, or is wrong by a share that the sentence gives, so that it is
    /// reported but not refused.
    pub fn is_doubt(&self) -> bool {
        match self {
            Self::HeldEffort { .. } | Self::RepeatedRows { .. } => true,
            // As many are interpolated where they are missing.
            Self::StaleRows { most, .. } => *most <= FEW_STALE,
            _ => false,
        }
    }

    /// Returns true if motion or torque cannot be analysed before a correction.
    pub fn spoils(&self) -> bool {
        matches!(
            self,
            Self::Jump { .. }
                | Self::Outlier { .. }
                | Self::Frozen { .. }
                | Self::StaleRows { .. }
                | Self::Spike { .. }
                | Self::HeldPosition { .. }
                | Self::LostRows { .. }
                | Self::Unsigned { .. }
        )
    }
}

impl Implausible {
    /// Returns true if both are the same fault of the same column.
    pub fn is_like(&self, other: &Self) -> bool {
        core::mem::discriminant(self) == core::mem::discriminant(other)
            && self.column() == other.column()
    }

    /// Returns the sentence with the places of rows that `place` gives for their numbers: those of a text file are lines.
    pub fn placed(self, place: &dyn Fn(u64) -> Place) -> Self {
        let mut own = self;
        match &mut own {
            Self::Outlier { at, .. } | Self::StaleRows { at, .. } => *at = at.placed(place),
            Self::Frozen { from, .. } => *from = from.placed(place),
            _ => {}
        }
        own
    }
}

/// Lists the columns of these joints: `q1, q2 and q3`.
fn columns_of(column: &str, joints: &[usize]) -> String {
    let all: Vec<String> = joints.iter().map(|k| format!("{column}{k}")).collect();
    listed(&all)
}

/// Lists the columns with their verb.
fn changes(column: &str, joints: &[usize]) -> String {
    let verb = if joints.len() == 1 {
        "changes"
    } else {
        "change"
    };
    format!("{} {verb}", columns_of(column, joints))
}

/// Says between which values a position lies.
fn range_words(lowest: f64, highest: f64) -> String {
    match lowest == highest {
        true => format!("it is {}", format_short(lowest)),
        false => format!(
            "range {} to {}",
            format_short(lowest),
            format_short(highest)
        ),
    }
}

/// "second row", "third row", "10th row".
fn nth(rows: usize) -> String {
    match rows {
        2 => "second row".to_owned(),
        3 => "third row".to_owned(),
        n => format!("{n}th row"),
    }
}

/// Returns the median step of times if it is so long that their unit may be less than a second. Motion sampled at 5 Hz or less
/// cannot be identified, and 0.2 is also a step of 0.2 ms in milliseconds.
pub fn long_step(times: &[f64]) -> Option<f64> {
    let steps = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    median(steps).filter(|step| *step >= 0.2)
}

/// Returns all columns in `block` that cannot be in SI units for `robot`; empty if there are none.
pub fn plausibility(block: &Block, robot: &Robot) -> Vec<Implausible> {
    let mut found = Vec::new();
    if let Some(step) = long_step(&block.t) {
        found.push(Implausible::NotSeconds { step });
    }
    let stale = stale_rows(block);
    for (k, joint) in (1..).zip(robot.joints.iter().take(block.joints.len())) {
        match frozen(k, block, joint) {
            Some(wrong) => found.push(wrong),
            None => check_joint(k, block, joint, stale.is_some(), &mut found),
        }
    }
    let held = repeated(block);
    let is_no_motion = |own: &Implausible| {
        matches!(
            own,
            Implausible::Jump { .. }
                | Implausible::Outlier { .. }
                | Implausible::Frozen { column: "q", .. }
        )
    };
    // A column that is no motion says nothing about rows.
    if held.is_empty() && !found.iter().any(is_no_motion) {
        let stale = stale.map(|stale| told_stale(block, stale));
        found.extend(stale.or_else(|| miscounted(block)));
    }
    found.extend(held);
    found
}

fn told_stale(block: &Block, stale: StaleRows) -> Implausible {
    Implausible::StaleRows {
        at: RowAt::of(block, stale.row),
        rows: stale.rows,
        places: match stale.places {
            1 => "one place".to_owned(),
            n => format!("{n} places"),
        },
        most: stale.most,
    }
}

/// Returns the fault of a torque or position that keeps one value while the motion goes on.
fn frozen(k: usize, block: &Block, joint: &Joint) -> Option<Implausible> {
    let columns = block.joints.get(k - 1)?;
    let (unit, effort_unit) = units(joint);
    let until = |own: &Frozen| match own.to + 1 == block.len() {
        true => "to the end".to_owned(),
        false => format!("to {}", RowAt::of(block, own.to)),
    };
    let whole = |own: &Frozen| own.to + 1 - own.from == block.len();
    if let Some(own) = frozen_torque(columns) {
        return Some(Implausible::Frozen {
            column: "tau",
            joint: k,
            value: own.value,
            unit: effort_unit,
            from: RowAt::of(block, own.from),
            until: until(&own),
            going_on: format!("q{k} moves over {} {unit}", format_significant(own.by, 3)),
            mend: match whole(&own) {
                true => "Check that the column is the torque and was recorded",
                false => "Use the rows without this stretch, or record again",
            },
        });
    }
    let own = frozen_position(columns)?;
    let change = format_significant(own.by, 3);
    let going_on =
        format!("it changes by {change} {unit} in the row before, and no joint stops like that");
    Some(Implausible::Frozen {
        column: "q",
        joint: k,
        value: own.value,
        unit,
        from: RowAt::of(block, own.from),
        until: until(&own),
        going_on,
        mend: "Use the rows without this stretch, or record again",
    })
}

/// Finds rows that were lost or written twice while the time was counted on.
fn miscounted(block: &Block) -> Option<Implausible> {
    let Advances {
        lost,
        repeated,
        made_up,
    } = advances(block);
    if let Some(LostRows {
        row,
        places,
        rows,
        held,
        ..
    }) = lost
    {
        let whole = rows.round().max(1.0);
        let one = places == 1;
        return Some(Implausible::LostRows {
            at: block.t[row],
            places: match one {
                true => "one place".to_owned(),
                false => format!("{places} places"),
            },
            advance: match one {
                true => format!("{} rows", whole + 1.0),
                false => "two or more rows".to_owned(),
            },
            each: match one {
                true => String::new(),
                false => format!(" ({whole} rows in all)"),
            },
            held,
        });
    }
    repeated.map(|found| Implausible::RepeatedRows {
        at: block.t[found.row + 1],
        percent: 100.0 * found.places as f64 / found.judged.max(1) as f64,
        made_up,
    })
}

/// Says what to do about rows that are missing while the time was counted on.
fn lost_how(held: bool) -> &'static str {
    match held {
        true => {
            "the positions stand still before, as where the last values are written while none arrive: take out the rows that repeat the row before"
        }
        false => "record the time of each row, or give the parts between these places one by one",
    }
}

/// Says why rows repeat the row before, what follows, and what would be right.
fn repeated_how(percent: f64, made_up: bool) -> String {
    match made_up {
        true => "t is right: these rows are stale values, as the logger kept the last value where none had arrived. The other rows are right and outweigh them; take the stale ones out, and up to four missing rows in a row are interpolated".to_owned(),
        false => format!(
            "they were written twice, so that velocities come out {} % and accelerations {} % too small on average: take them out, and count t without them",
            format_significant(percent, 2),
            format_significant(2.0 * percent, 2)
        ),
    }
}

/// Returns the positions in `block` that are far outside of what the joints reach. Rows of single poses are judged by this
/// alone, because they follow no motion.
pub fn implausible_positions(block: &Block, robot: &Robot) -> Vec<Implausible> {
    let joints = block.joints.iter().zip(&robot.joints);
    (1..)
        .zip(joints)
        .filter(|(_, (columns, _))| !columns.q.is_empty())
        .filter_map(|(k, (columns, joint))| range_fault(k, &columns.q, joint, joint.kind.units().0))
        .collect()
}

/// Finds positions and efforts that keep each value for several rows; joints with the same rate are grouped.
fn repeated(block: &Block) -> Vec<Implausible> {
    let together = |of: fn(&JointColumns) -> &[f64]| {
        let mut found: Vec<(usize, Vec<usize>)> = Vec::new();
        for (k, columns) in (1..).zip(&block.joints) {
            let Some(rows) = repeated_rows(of(columns)) else {
                continue;
            };
            match found.iter_mut().find(|(own, _)| *own == rows) {
                Some((_, joints)) => joints.push(k),
                None => found.push((rows, vec![k])),
            }
        }
        found
    };
    let rate = rate(&block.t);
    let slow = |rows: usize| format_trimmed(rate / rows as f64, 4);
    let fast = format_trimmed(rate, 4);
    let positions = together(|columns| &columns.q)
        .into_iter()
        .map(|(rows, joints)| Implausible::HeldPosition {
            joints,
            rows,
            slow: slow(rows),
            fast: fast.clone(),
        });
    let efforts = together(|columns| &columns.tau)
        .into_iter()
        .map(|(rows, joints)| Implausible::HeldEffort {
            joints,
            rows,
            slow: slow(rows),
            fast: fast.clone(),
            late: format_trimmed(500.0 * (rows as f64 - 1.0) / rate, 2),
        });
    positions.chain(efforts).collect()
}

/// Returns the sign of [`unit_of_steps`], as `--unit` takes it.
pub fn sign_of_steps(step: f64) -> &'static str {
    match unit_of_steps(step) {
        "milliseconds" => "ms",
        "microseconds" => "us",
        _ => "ns",
    }
}

/// Returns the likely time unit for steps too long for seconds, if rows come at between 5 and 5000 Hz.
pub fn unit_of_steps(step: f64) -> &'static str {
    match step {
        ..200.0 => "milliseconds",
        ..2e5 => "microseconds",
        _ => "nanoseconds",
    }
}

/// Returns the number of further places in words.
fn more(count: usize) -> String {
    match count {
        1 => String::new(),
        2 => " and at one more place".to_owned(),
        n => format!(" and at {} more places", n - 1),
    }
}

/// Returns the units of a joint's position and effort, as sentences have them.
fn units(joint: &Joint) -> (&'static str, &'static str) {
    match joint.kind {
        JointKind::Revolute => ("rad", "N·m"),
        JointKind::Prismatic => ("m", "N"),
    }
}

fn check_joint(
    k: usize,
    block: &Block,
    joint: &Joint,
    has_stale_rows: bool,
    found: &mut Vec<Implausible>,
) {
    let (unit, effort_unit) = units(joint);
    let (t, Some(columns)) = (&block.t, block.joints.get(k - 1)) else {
        return;
    };
    let (lowest, highest) = range(&columns.q);
    if columns.q.is_empty() {
        return;
    }
    found.extend(position_fault(k, block, &columns.q, joint, has_stale_rows));
    if let Some(ratio) = columns
        .qd
        .as_ref()
        .and_then(|qd| velocity_scale(t, &columns.q, qd))
    {
        // Factors of degrees or rpm to rad are at least 6, of milli 1000.
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

/// Returns the first fault of a position. Behind stale rows it jumps to its right value.
fn position_fault(
    k: usize,
    block: &Block,
    q: &[f64],
    joint: &Joint,
    has_stale_rows: bool,
) -> Option<Implausible> {
    let (t, unit) = (&block.t, joint.kind.units().0);
    if let Some(lost) = unsigned(q) {
        return Some(lost_sign("q", k, lost));
    }
    let jump = largest_position_jump(t, q).filter(|_| !has_stale_rows);
    if let Some((row, count)) = jump.and_then(|jump| jump.outlier) {
        return Some(Implausible::Outlier {
            joint: k,
            at: RowAt::of(block, row),
            value: q[row],
            beside: q[row - 1],
            more: match count {
                1 => String::new(),
                2 => ", and another value in one more row".to_owned(),
                n => format!(", and other values in {} more rows", n - 1),
            },
            unit,
        });
    }
    if let Some(jump) = jump {
        let turns = jump.change.abs() / core::f64::consts::TAU;
        return Some(Implausible::Jump {
            joint: k,
            at: t[jump.row],
            by: jump.change,
            more: more(jump.count),
            fastest: jump.largest_motion_step,
            mend: if joint.kind == JointKind::Revolute && (turns - 1.0).abs() < 0.02 {
                "that is a turn: give the angle counted on beyond it"
            } else {
                "rows are missing there, or recordings were put together: give the parts one by one; or the encoder lost counts"
            },
            unit,
        });
    }
    if let Some(wrong) = range_fault(k, q, joint, unit) {
        return Some(wrong);
    }
    let limits = joint.limits.as_ref()?;
    let speed = highest_speed(t, q)?;
    (speed > 10.0 * limits.velocity).then_some(Implausible::Velocity {
        joint: k,
        speed,
        limit: limits.velocity,
        unit,
    })
}

/// Returns the fault of positions that are far outside of what the joint reaches.
fn range_fault(k: usize, q: &[f64], joint: &Joint, unit: &'static str) -> Option<Implausible> {
    let limits = joint.limits.as_ref()?;
    let [lower, upper] = limits.position;
    let (lowest, highest) = range(q);
    let reach = lower.abs().max(upper.abs());
    let farthest = lowest.abs().max(highest.abs());
    if reach.is_finite() && farthest > 5.0 * reach {
        let or = motor_angle(joint, farthest / reach);
        let degrees = farthest.to_radians() <= 1.2 * reach;
        return Some(if joint.kind == JointKind::Revolute && degrees {
            Implausible::Degrees {
                joint: k,
                lowest,
                highest,
                limit: reach,
                or,
            }
        } else {
            Implausible::Position {
                joint: k,
                lowest,
                highest,
                lower,
                upper,
                unit,
                or,
            }
        });
    }
    None
}

/// Returns the number of rows per second.
fn rate(t: &[f64]) -> f64 {
    let (Some(first), Some(last)) = (t.first(), t.last()) else {
        return 0.0;
    };
    (t.len() - 1) as f64 / (last - first).max(f64::MIN_POSITIVE)
}

fn lost_sign(column: &'static str, joint: usize, lost: Unsigned) -> Implausible {
    let offset = format_significant(lost.offset, 4);
    Implausible::Unsigned {
        column,
        joint,
        share: format_significant(100.0 * lost.share, 2),
        how: match lost.sign_bit {
            true => format!("−x reads as {offset} + x: its highest bit is the sign"),
            false => format!("−x reads as {offset} − x: two's complement"),
        },
    }
}

/// Returns a remark, after a comma, that a position beyond its limits by this factor may be a motor position; empty for a
/// screw, which has no gear ratio.
fn motor_angle(joint: &Joint, beyond: f64) -> String {
    let ratio = joint.drive.as_ref().map_or(0.0, |d| d.gear_ratio.abs());
    if ratio == 0.0 {
        return String::new();
    }
    let number = |x: f64| format_trimmed(x, 4);
    if ratio > 1.0 && beyond / ratio <= 1.2 {
        let ratio = number(ratio);
        format!(
            ", or the angle of the motor: divided by the gear ratio {ratio} it would fit as well; name it qm"
        )
    } else if ratio < 1.0 && beyond * ratio * ratio <= 1.2 {
        format!(
            ", or the gear ratio stands upside down: gear_ratio is {}, and motor turns per joint turn are wanted ({} would fit)",
            number(ratio),
            number(1.0 / ratio)
        )
    } else {
        String::new()
    }
}

/// Returns the faults of measured velocities and accelerations; they concern only users of these columns.
pub fn strange_rates(block: &Block, robot: &Robot) -> Vec<Implausible> {
    let mut found = Vec::new();
    for (k, (columns, joint)) in (1..).zip(block.joints.iter().zip(&robot.joints)) {
        let (lowest, highest) = range(&columns.q);
        // Below 0.05 rad or 5 cm the motion may be the noise of a joint at rest.
        if highest - lowest < 0.05 || columns.q.is_empty() {
            continue;
        }
        for (column, rates) in [("qd", &columns.qd), ("qdd", &columns.qdd)] {
            if rates
                .as_ref()
                .is_some_and(|own| own.iter().all(|v| *v == 0.0))
            {
                found.push(Implausible::NoRate { column, joint: k });
            }
        }
        let zeros = (columns.qd.as_ref()).and_then(|qd| rate_zeros(&block.t, &columns.q, qd));
        if let Some(zeros) = zeros {
            found.push(Implausible::RateMismatch {
                joint: k,
                how: zero_words(k, block, joint, zeros),
            });
            continue;
        }
        let spike = (columns.qd.as_ref()).and_then(|qd| rate_spike(&block.t, &columns.q, qd));
        if let Some(spike) = spike {
            let number = |x: f64| format_significant(x, 4);
            found.push(Implausible::RateSpike {
                joint: k,
                at: block.t[spike.row],
                value: number(spike.value),
                speed: number(spike.speed),
                more: more(spike.count),
                unit: joint.kind.units().0,
            });
            continue;
        }
        let moving = columns
            .qd
            .as_ref()
            .filter(|qd| qd.iter().any(|v| *v != 0.0));
        let mismatch = moving.and_then(|qd| rate_mismatch(&block.t, &columns.q, qd));
        found.extend(mismatch.map(|wrong| Implausible::RateMismatch {
            joint: k,
            how: mismatch_words(k, wrong),
        }));
    }
    found
}

/// Says why the measured velocity of joint `k` is zero in motion, and what mends it.
fn zero_words(k: usize, block: &Block, joint: &Joint, zeros: RateZeros) -> String {
    match zeros {
        RateZeros::Dropouts { row, share } => format!(
            "it is 0 in {} % of the rows in fast motion (the first at t = {} s), between readings that are right: they dropped out. Take these rows out, or leave out --measured-derivatives",
            format_significant(100.0 * share, 2),
            format_time(block.t[row])
        ),
        RateZeros::DeadBand { end } => format!(
            "it is 0 wherever q{k} moves more slowly than its least value, {} {}/s: a dead band. Turn it off in the drive, or leave out --measured-derivatives",
            format_significant(end, 2),
            joint.kind.units().0
        ),
    }
}

/// Says what is wrong with the measured velocity of joint `k`, and what mends it.
fn mismatch_words(k: usize, wrong: RateMismatch) -> String {
    match wrong {
        RateMismatch::Factor(factor) => format!(
            "it is {} times as fast as q{k} changes. Correct its scale, or leave out --measured-derivatives",
            format_significant(factor, 4)
        ),
        RateMismatch::Late(time) => format!(
            "it comes {} ms {} than q{k} changes. Correct its clock or its filter, or leave out --measured-derivatives",
            format_significant(1000.0 * time.abs(), 2),
            if time > 0.0 { "later" } else { "earlier" }
        ),
        RateMismatch::Reversed => {
            format!("it runs against q{k}. Reverse it, or leave out --measured-derivatives")
        }
        RateMismatch::Other(left) => format!(
            "whatever its scale and delay, {} % of the changes of q{k} (RMS) are not in it. Check the order of the columns and the signs, or leave out --measured-derivatives",
            format_significant(100.0 * left.sqrt(), 2)
        ),
    }
}

/// Returns the highest mean speed over ten samples, so that a single step of a coarse encoder is not a speed.
fn highest_speed(t: &[f64], q: &[f64]) -> Option<f64> {
    const SPAN: usize = 10;
    let rows = t.iter().zip(q);
    let later = rows.clone().skip(SPAN);
    rows.zip(later)
        .map(|((t0, q0), (t1, q1))| ((q1 - q0) / (t1 - t0)).abs())
        .reduce(f64::max)
}

/// Returns the least-squares factor between changes of q and the integral of qd over windows of twenty samples, if the
/// two are correlated.
pub fn velocity_scale(t: &[f64], q: &[f64], qd: &[f64]) -> Option<f64> {
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
    // Only for a correlation above 0.8.
    (xx > 0.0 && yy > 0.0 && xy.abs() > 0.8 * (xx * yy).sqrt()).then(|| xy / xx)
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
    if let Some(lost) = unsigned(&columns.tau) {
        found.push(lost_sign("tau", k, lost));
        return;
    }
    if let Some(spike) = largest_torque_spike(&columns.tau) {
        found.push(Implausible::Spike {
            joint: k,
            at: t[spike.row],
            value: spike.value,
            more: more(spike.count),
            usual: spike.usual_torque,
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
    // Below 0.05 rad or 5 cm of travel a joint may need almost no torque.
    if columns.tau.is_empty() || travel < 0.05 {
        return;
    }
    if highest == 0.0 {
        found.push(Implausible::NoEffort { joint: k });
        return;
    }
    // A joint cannot move with less than a hundredth of its Coulomb friction.
    let coulomb = joint
        .friction
        .as_ref()
        .map(|f| f.coulomb)
        .filter(|c| *c > 0.0);
    let too_small = match (coulomb, limit) {
        (Some(c), _) if highest < 0.01 * c => Some(("Coulomb friction", c)),
        // A placeholder limit says nothing about the torque. If the link is described, its mass says more than any
        // limit: a wrist may need only a thousandth of a limit that is equal for all joints.
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
