//! Tries whether the other commands read a file with the columns that are proposed.

use std::path::Path;

use super::proposal::{Proposal, Proposed};
use super::topic::{Contents, Topic};
use crate::block::WRENCH_COLUMNS;
use crate::columns::{EffortNeed, Signal};
use crate::mapping::Mapping;
use crate::source::Source;
use crate::unit::Unit;
use rig_model::robot::{Drive, JointKind, ONE_LINK_TEMPLATE, Robot};

/// Rows that are read at once.
const ROWS: usize = 1 << 14;

/// Reads the whole file as `rig identify` does, for `robot`, or for joints as the columns state them. Returns the error that
/// stops it; `None` if every row is read.
pub(super) fn refusal(
    path: &Path,
    proposal: &Proposal,
    topics: &[Topic],
    robot: Option<&Robot>,
    advance: &mut dyn FnMut(u64),
) -> Option<String> {
    let mapping = match mapping(proposal) {
        Ok(mapping) => mapping,
        Err(why) => return Some(why),
    };
    let stand_in;
    let robot = match robot {
        Some(robot) => robot,
        None => {
            stand_in = joints_of(proposal, topics)?;
            &stand_in
        }
    };
    let has = |prefixes: &[Signal]| {
        let signal = |own: &Proposed| Signal::split(&own.column).map(|(signal, _)| signal);
        let mut signals = proposal.columns.iter().filter_map(signal);
        signals.any(|signal| prefixes.contains(&signal))
    };
    let has_effort = has(&[Signal::Torque, Signal::MotorTorque, Signal::Current]);
    // `rig load` needs no torque of the joints.
    let need = match is_of_sensor(proposal) && !has_effort {
        true => EffortNeed::Optional,
        false => EffortNeed::Required,
    };
    let mut read = || {
        let source = Source::open_mapped(path, robot, need, &mapping)?;
        let mut blocks = source.blocks(ROWS);
        while let Some(block) = blocks.next() {
            block?;
            advance(blocks.bytes_read());
        }
        Ok::<(), crate::error::DataError>(())
    };
    read().err().map(|error| error.to_string())
}

/// Returns a robot with the joints that the probable columns of a file state, for reading the file without a description. Its
/// drives turn nothing: gear ratio and torque constant are 1. `None` if the template of a joint cannot be read.
pub fn stand_in(found: &Contents) -> Option<Robot> {
    joints_of(&found.proposal, &found.topics)
}

/// Returns true if columns of a wrist sensor are proposed.
fn is_of_sensor(proposal: &Proposal) -> bool {
    let is_axis = |own: &Proposed| WRENCH_COLUMNS.contains(&own.column.as_str());
    proposal.columns.iter().any(is_axis)
}

/// Returns the mapping that the proposed options give.
fn mapping(proposal: &Proposal) -> Result<Mapping, String> {
    let mut mapping = Mapping::default();
    if proposal.is_plain {
        return Ok(match is_of_sensor(proposal) {
            true => mapping.with_wrench(),
            false => mapping,
        });
    }
    for own in &proposal.columns {
        let full = own.full_name();
        if full != own.column {
            mapping.add_column(&format!("{}={full}", own.column))?;
        }
        if let Some(unit) = own.unit {
            mapping.add_unit(&format!("{}={unit}", own.column))?;
        }
    }
    Ok(mapping)
}

/// Returns a robot with the joints that the columns state, in place of the robot that is not known: each with a gear of
/// ratio 1, prismatic if its columns are in units of straight motion.
fn joints_of(proposal: &Proposal, topics: &[Topic]) -> Option<Robot> {
    let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("joints")).ok()?;
    let mut template = robot.joints.pop()?;
    (template.limits, template.friction, template.inertial) = (None, None, None);
    (template.controller, template.voltage_controller) = (None, None);
    template.drive = Some(Drive {
        gear_ratio: 1.0,
        torque_constant: 1.0,
        ..Drive::default()
    });
    for (k, own) in positions(proposal, topics).into_iter().enumerate() {
        let mut joint = template.clone();
        let label = own.and_then(|own| own.channel.rsplit_once('/'));
        joint.name = match label {
            Some((_, label)) => label.to_owned(),
            None => format!("joint {}", k + 1),
        };
        let number = own.and_then(|own| Signal::split(&own.column));
        let number = number.map_or(k + 1, |(_, number)| number);
        joint.kind = match is_linear(&proposal.columns, number) {
            true => JointKind::Prismatic,
            false => JointKind::Revolute,
        };
        robot.joints.push(joint);
    }
    Some(robot)
}

/// Returns true if the first unit of a joint's columns that tells is one of straight motion.
fn is_linear(columns: &[Proposed], number: usize) -> bool {
    let is_own = |own: &&Proposed| match Signal::split(&own.column) {
        Some((Signal::MotorPosition | Signal::MotorTorque, _)) | None => false,
        Some((_, k)) => k == number,
    };
    let unit = |own: &Proposed| {
        let stated = Unit::stated(&own.channel).map(|(_, unit)| unit);
        own.unit.and_then(Unit::named).or(stated)
    };
    let mut units = columns.iter().filter(is_own).filter_map(unit);
    units.find_map(Unit::is_linear) == Some(true)
}

/// Returns the column of each joint's position, in order. Of joint states, those that are in the most messages count: other
/// messages on the topic may hold other joints, such as those of a gripper.
fn positions<'a>(proposal: &'a Proposal, topics: &[Topic]) -> Vec<Option<&'a Proposed>> {
    let columns = &proposal.columns;
    let number = |own: &Proposed| match Signal::split(&own.column)? {
        (Signal::Position | Signal::MotorPosition, k) => Some(k),
        _ => None,
    };
    let values = |own: &Proposed| {
        let topic = topics.iter().find(|topic| topic.name == own.topic)?;
        let channel = topic.channels.iter().find(|c| c.name == own.channel)?;
        Some(channel.values)
    };
    let is_named = |own: &&Proposed| own.channel.contains('/') && number(own).is_some();
    let named = columns.iter().filter(is_named);
    let most = named.clone().filter_map(values).max();
    if proposal.is_plain && most.is_some() {
        return named.filter(|own| values(own) == most).map(Some).collect();
    }
    let count = columns.iter().filter_map(number).max().unwrap_or(1);
    let of = |k: usize| columns.iter().find(|own| own.column == format!("q{k}"));
    (1..=count).map(of).collect()
}
