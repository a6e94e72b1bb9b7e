//! Proposes columns from the names of channels, and units from names and values.

use std::collections::{BTreeMap, BTreeSet};

use super::names::{Named, number, quantity, wrench};
use super::proposal::{Proposal, Proposed};
use super::topic::{Channel, TimeSource, Topic};
use crate::block::WRENCH_COLUMNS;
use crate::columns::Signal;
use crate::joint_names::{is_in_joint, joint_in};
use crate::likely_time::likely_time;
use crate::mapping::kind;
use crate::mcap_rows::{TOPIC, is_joint_state};
use crate::time_names::{is_time, words};
use crate::unit::Unit;

/// Largest angle of a joint, rad, above which degrees are more likely: two turns.
const TWO_TURNS: f64 = 4.0 * std::f64::consts::PI;

/// A channel with a quantity.
struct Candidate<'a> {
    channel: &'a Channel,
    named: Named,
    /// Name of the joint, or the number in it.
    joint: Joint,
    is_standard: bool,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Joint {
    Number(usize),
    /// Index and name of a joint of the robot.
    Known(usize, String),
    Name(String),
    None,
}

/// Proposes columns for the channels of all topics; `joints` are the names of the robot's joints, if known.
pub(super) fn propose(topics: &[Topic], joints: &[String]) -> Proposal {
    let mut proposal = Proposal::default();
    let rank = |topic: &&Topic| {
        let found = candidates(topic, joints);
        let positions = found.iter().filter(|c| c.named == Named::Position).count();
        let own = usize::from(is_joint_state(&topic.of)) + 2 * usize::from(topic.name == TOPIC);
        (own, positions, found.len(), topic.rows)
    };
    // `max_by_key` returns the last of equal ones.
    if let Some(topic) = topics.iter().rev().max_by_key(rank) {
        time(topic, &mut proposal);
        joint_columns(topic, joints, &Named::ALL, &mut proposal);
        let is_bag = !topic.name.is_empty();
        // A time since 1970 needs no option.
        let is_si = |p: &Proposed| {
            let is_epoch = p.column == "t" && likely_time(topic.time.first, None).is_some();
            p.unit.is_none() || (is_epoch && Unit::split(&p.channel).is_none())
        };
        proposal.is_plain = match is_bag {
            true => topic.name == TOPIC || is_joint_state(&topic.of),
            false => (proposal.columns.iter()).all(|p| p.column == p.channel && is_si(p)),
        };
        efforts_elsewhere(topic, topics, joints, &mut proposal);
    }
    wrench_columns(topics, &mut proposal);
    missing(topics, joints, &mut proposal);
    refused(topics, &mut proposal);
    if !proposal.is_plain {
        proposal.options = options(&proposal.columns);
    }
    proposal
}

/// Proposes torques or currents from another topic, if the topic of the positions has none.
fn efforts_elsewhere(main: &Topic, topics: &[Topic], joints: &[String], proposal: &mut Proposal) {
    const EFFORTS: [Named; 3] = [Named::Effort, Named::MotorEffort, Named::Current];
    let has = |named: Named, own: &Proposed| {
        let number = own.column.strip_prefix(named.column());
        number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    };
    let columns = &proposal.columns;
    let has_effort = (EFFORTS.iter()).any(|named| columns.iter().any(|own| has(*named, own)));
    let positions = columns.iter().filter(|own| has(Named::Position, own));
    let positions: Vec<&Proposed> = positions.collect();
    if has_effort || positions.is_empty() || main.name.is_empty() {
        return;
    }
    // The other topic may have the joints in another order: their names are those of the positions.
    let label = |own: &&Proposed| Some(own.channel.rsplit_once('/')?.1.to_owned());
    let known: Option<Vec<String>> = positions.iter().map(label).collect();
    let known = match joints {
        [] => known.unwrap_or_default(),
        given => given.to_vec(),
    };
    let count = |topic: &Topic| {
        let found = candidates(topic, &known);
        found.iter().filter(|c| EFFORTS.contains(&c.named)).count()
    };
    let others = topics.iter().filter(|topic| topic.name != main.name);
    let Some(topic) = others.rev().max_by_key(|topic| count(topic)) else {
        return;
    };
    let before = proposal.columns.len();
    joint_columns(topic, &known, &EFFORTS, proposal);
    // Only options join two topics.
    proposal.is_plain &= proposal.columns.len() == before;
}

/// Proposes the column of time of a text file.
fn time(topic: &Topic, proposal: &mut Proposal) {
    if !topic.name.is_empty() {
        return;
    }
    let TimeSource::Column(name) = &topic.time.source else {
        let rising: Vec<&str> = (topic.channels.iter())
            .filter(|c| c.is_rising() && c.missing == 0)
            .map(|c| c.name.as_str())
            .collect();
        let hint = match rising.as_slice() {
            [] => String::new(),
            some => format!(
                " These columns grow from row to row and may be the time: {}.",
                some.join(", ")
            ),
        };
        proposal.missing.push(format!(
            "No column is named as a time (`t`, `time`, `timestamp`).{hint}"
        ));
        return;
    };
    let stated = Unit::split(name).map(|(_, unit)| unit.name);
    let stated = stated.or(topic.time.unit);
    let guessed = likely_time(topic.time.first, topic.time.period);
    let (stated, guessed) = match topic.time.is_clock {
        true => (None, None),
        false => (stated, guessed),
    };
    let unit = stated.or(guessed.map(|(unit, _)| unit));
    let why = match (stated, guessed) {
        (Some(_), _) if topic.time.unit.is_some() => {
            "its name states time, and the row of units its unit".to_owned()
        }
        (Some(_), _) => "its name states time and unit".to_owned(),
        (None, Some((_, why))) => format!("its name states time; {why}"),
        _ => "its name states time".to_owned(),
    };
    let others = topic.channels.iter().map(|channel| channel.name.as_str());
    let others: Vec<&str> = others.filter(|other| is_time(other)).collect();
    if !others.is_empty() && name != "t" {
        proposal.doubts.push(format!(
            "{} is named as a time, too: look which of them is that of the samples.",
            others.join(" and ")
        ));
    }
    proposal.columns.push(Proposed {
        column: "t".into(),
        topic: String::new(),
        channel: name.to_owned(),
        unit: unit.filter(|u| *u != "s"),
        why,
    });
}

fn candidates<'a>(topic: &'a Topic, joints: &[String]) -> Vec<Candidate<'a>> {
    let is_bag = !topic.name.is_empty();
    let of = |channel: &'_ Channel| {
        // The name of a joint is no unit.
        let is_joint = channel.is_element || is_in_joint(&channel.name, joints);
        let bare = Unit::split(&channel.name).filter(|_| !is_joint);
        let bare = bare.map_or(channel.name.as_str(), |(name, _)| name);
        if let Some((signal, k)) = Signal::split(bare) {
            return Some((named(signal)?, Joint::Number(k), bare == channel.name));
        }
        if let Some(own) = joint_in(bare, joints)
            && let Some(named) = quantity(&own.others)
        {
            let name = joints.get(own.joint).cloned().unwrap_or_default();
            return Some((named, Joint::Known(own.joint, name), false));
        }
        let (kind, label) = match bare.rsplit_once('/') {
            Some((kind, label)) if is_bag => (kind, Some(label)),
            _ => (bare, None),
        };
        let kind_words = words(kind);
        // `Float64MultiArray` calls its array `data`; the topic says of what.
        let of_topic = || quantity(&words(&topic.name)).filter(|_| kind == "data");
        let named = quantity(&kind_words).or_else(|| quantity(&words(bare)).or_else(of_topic))?;
        let joint = match label {
            Some(label) => match label.parse() {
                Ok(k) => Joint::Number(k),
                Err(_) => Joint::Name(label.to_owned()),
            },
            None => number(&kind_words).map_or(Joint::None, Joint::Number),
        };
        Some((named, joint, false))
    };
    let found = topic.channels.iter().filter_map(|channel| {
        let (named, joint, is_standard) = of(channel)?;
        Some(Candidate {
            channel,
            named,
            joint,
            is_standard,
        })
    });
    found.collect()
}

fn named(signal: Signal) -> Option<Named> {
    Some(match signal {
        Signal::Position => Named::Position,
        Signal::MotorPosition => Named::MotorPosition,
        Signal::LinkPosition => Named::LinkPosition,
        Signal::Velocity => Named::Velocity,
        Signal::Acceleration => Named::Acceleration,
        Signal::Torque => Named::Effort,
        Signal::MotorTorque => Named::MotorEffort,
        Signal::Current => Named::Current,
        Signal::Voltage => Named::Voltage,
        Signal::Temperature => Named::Temperature,
        Signal::Reference => Named::Reference,
        Signal::Duty => return None,
    })
}

/// Proposes the columns of the joints, of these quantities.
fn joint_columns(topic: &Topic, joints: &[String], wanted: &[Named], proposal: &mut Proposal) {
    let mut groups: BTreeMap<Named, Vec<Candidate>> = BTreeMap::new();
    let all = candidates(topic, joints);
    for candidate in all.into_iter().filter(|c| wanted.contains(&c.named)) {
        groups.entry(candidate.named).or_default().push(candidate);
    }
    let mut taken: BTreeSet<String> = BTreeSet::new();
    for (named, mut group) in groups {
        // Counted from 0, `q1` is the second joint.
        if group
            .iter()
            .any(|c| c.is_standard && c.joint == Joint::Number(0))
        {
            group.iter_mut().for_each(|c| c.is_standard = false);
        }
        // Columns that have the name already come first.
        group.sort_by_key(|c| !c.is_standard);
        let least = (group.iter())
            .filter_map(|c| match c.joint {
                Joint::Number(k) if !c.is_standard => Some(k),
                _ => None,
            })
            .min();
        let mut order = 0;
        for candidate in &group {
            let k = match &candidate.joint {
                Joint::Number(k) if candidate.is_standard => *k,
                // Counted from 0 or 1.
                Joint::Number(k) => match least {
                    Some(least @ 0..=1) => k - least + 1,
                    _ => *k,
                },
                Joint::Known(k, _) => k + 1,
                Joint::Name(_) if joints.is_empty() => {
                    order += 1;
                    order
                }
                Joint::Name(name) => match joints.iter().position(|j| name.ends_with(j.as_str())) {
                    Some(k) => k + 1,
                    None => continue,
                },
                Joint::None if group.len() == 1 => 1,
                Joint::None => continue,
            };
            let column = format!("{}{k}", named.column());
            if taken.insert(column.clone()) {
                proposal
                    .columns
                    .push(proposed(column, topic, candidate, proposal_why(candidate)));
            }
        }
        let largest = group
            .iter()
            .map(|c| c.channel.largest())
            .fold(0.0, f64::max);
        let is_stated = group.iter().all(|c| c.channel.unit.is_some());
        if named == Named::Position && largest > TWO_TURNS && !is_stated {
            proposal.doubts.push(format!(
                "Positions reach {}, which is more than two turns in rad: they may be degrees (`--unit q=deg`) or angles of the motors (`qm`).",
                rig_output::format_short(largest)
            ));
        }
    }
}

fn proposal_why(candidate: &Candidate) -> String {
    if candidate.is_standard {
        return "it has the name of the column".into();
    }
    let joint = match &candidate.joint {
        Joint::Name(name) | Joint::Known(_, name) => format!(", of joint \"{name}\""),
        Joint::Number(k) => format!(", with number {k}"),
        Joint::None => String::new(),
    };
    format!(
        "its name states {}{joint}",
        quantity_in_words(candidate.named)
    )
}

fn quantity_in_words(named: Named) -> &'static str {
    match named {
        Named::Position => "a position",
        Named::MotorPosition => "a position of a motor",
        Named::LinkPosition => "a position of a link",
        Named::Velocity => "a velocity",
        Named::Acceleration => "an acceleration",
        Named::Effort => "a torque or force",
        Named::MotorEffort => "a torque of a motor",
        Named::Current => "a current",
        Named::Voltage => "a voltage",
        Named::Temperature => "a temperature",
        Named::Reference => "a reference position",
    }
}

fn proposed(column: String, topic: &Topic, candidate: &Candidate, why: String) -> Proposed {
    let of = kind(&column).unwrap_or_default();
    let unit = candidate.channel.unit.and_then(Unit::named);
    let unit = unit.filter(|unit| of.contains(&unit.of));
    Proposed {
        column,
        topic: topic.name.clone(),
        channel: candidate.channel.name.clone(),
        unit: unit.filter(|u| !u.is_si()).map(|u| u.name),
        why,
    }
}

/// Proposes the columns of a wrist sensor, from the topic that has most of its axes.
fn wrench_columns(topics: &[Topic], proposal: &mut Proposal) {
    let of = |topic: &Topic| -> Vec<(&'static str, String)> {
        let mut found: Vec<(&'static str, String)> = Vec::new();
        for channel in &topic.channels {
            let bare = Unit::split(&channel.name).map_or(channel.name.as_str(), |(name, _)| name);
            let axis = wrench(&words(bare)).filter(|_| !is_time(bare));
            if let Some(axis) = axis.filter(|axis| found.iter().all(|(other, _)| other != axis)) {
                found.push((axis, channel.name.clone()));
            }
        }
        found
    };
    let best = topics.iter().rev().max_by_key(|topic| of(topic).len());
    let Some((topic, axes)) = best
        .map(|topic| (topic, of(topic)))
        .filter(|(_, axes)| axes.len() >= 3)
    else {
        return;
    };
    for column in WRENCH_COLUMNS {
        if let Some((_, channel)) = axes.iter().find(|(axis, _)| *axis == column) {
            proposal.is_plain &= !topic.name.is_empty() || channel == column;
            proposal.columns.push(Proposed {
                column: column.into(),
                topic: topic.name.clone(),
                channel: channel.clone(),
                unit: None,
                why: "its name states an axis of a wrist sensor".into(),
            });
        }
    }
}

/// Names what a recording needs and the file has not.
fn missing(topics: &[Topic], joints: &[String], proposal: &mut Proposal) {
    let has = |prefixes: &[&str]| {
        proposal.columns.iter().any(|p| {
            let digits = prefixes
                .iter()
                .find_map(|prefix| p.column.strip_prefix(prefix));
            digits.is_some_and(|d| d.bytes().all(|b| b.is_ascii_digit()) && !d.is_empty())
        })
    };
    let mut sentences = Vec::new();
    let has_position = has(&["q", "qm"]);
    if !has_position {
        sentences.push("No channel is named as a position of a joint (`q1`).");
    }
    if !has(&["tau", "taum", "i"]) {
        sentences.push(match has(&["u"]) {
            true => "No channel is named as a torque or current of a joint (`tau1`, `i1`); `rig diagnose` takes a motor voltage in its place.",
            false => "No channel is named as a torque or current of a joint (`tau1`, `i1`).",
        });
    }
    let is_there = |column: String| proposal.columns.iter().any(|own| own.column == column);
    let others = (joints.iter().enumerate())
        .filter(|(k, _)| !is_there(format!("q{}", k + 1)) && !is_there(format!("qm{}", k + 1)))
        .map(|(k, joint)| {
            format!(
                "No channel is named as the position of joint \"{joint}\" (`q{}`).",
                k + 1
            )
        });
    let others: Vec<String> = others.filter(|_| has_position).collect();
    let sentences = sentences.into_iter().map(str::to_owned);
    proposal.missing.extend(sentences.chain(others));
    if topics.iter().all(|topic| topic.rows == 0) {
        proposal.missing.push("The file has no rows.".into());
    }
}

/// Names what makes the other commands refuse rows of the proposed columns.
fn refused(topics: &[Topic], proposal: &mut Proposal) {
    for topic in topics {
        let own = proposal.columns.iter().filter(|p| p.topic == topic.name);
        let named: Vec<&str> = own.map(|p| p.channel.as_str()).collect();
        if named.is_empty() {
            continue;
        }
        let name = match topic.name.as_str() {
            "" => "the table",
            name => name,
        };
        let time = &topic.time;
        if let Some(step) = time.first_not_growing {
            proposal.doubts.push(format!(
                "The time of {name} stands still {} times and jumps back {} times, first in row {}; the other commands refuse that.",
                time.repeated - time.copies, time.backwards, step.row
            ));
        }
        for channel in &topic.channels {
            if let Some(first) = channel
                .first_missing
                .filter(|_| named.contains(&channel.name.as_str()))
            {
                proposal.doubts.push(format!(
                    "`{}` of {name} has no number in {} rows, the first is row {first}; the other commands refuse that.",
                    channel.name, channel.missing
                ));
            }
        }
    }
}

fn options(columns: &[Proposed]) -> Vec<String> {
    let mut options = Vec::new();
    for own in columns {
        let full = own.full_name();
        if full != own.column {
            options.push(format!(
                "--map {}",
                quoted(&format!("{}={full}", own.column))
            ));
        }
        if let Some(unit) = own.unit {
            options.push(format!(
                "--unit {}",
                quoted(&format!("{}={unit}", own.column))
            ));
        }
    }
    options
}

/// Puts an argument in quotation marks if a shell would change it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,".contains(c);
    if word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}
