//! Recordings held in memory, one stretch without a gap at a time.
//!
//! Spectra and windows need whole stretches: memory grows with the recording.

use rig_data::Block;
use rig_data::prepare::Recording;
use rig_model::robot::{JointKind, Robot};
use rig_output::format_significant;

use crate::error::ComplianceError;

/// Rows of one read.
const ROWS: usize = 8192;

/// Columns of one joint.
#[derive(Clone, Debug, Default)]
pub(crate) struct JointSignals {
    pub q: Vec<f64>,
    /// Empty if not recorded.
    pub tau: Vec<f64>,
    pub reference: Option<Vec<f64>>,
    pub link: Option<Vec<f64>>,
}

/// One stretch of a recording.
#[derive(Clone, Debug, Default)]
pub(crate) struct Signals {
    pub label: String,
    pub t: Vec<f64>,
    pub joints: Vec<JointSignals>,
    extra: Vec<(String, Vec<f64>)>,
}

impl Signals {
    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.t.len()
    }

    /// Rows per second; not a number for fewer than two rows.
    pub(crate) fn rate(&self) -> f64 {
        match (self.t.first(), self.t.last()) {
            (Some(first), Some(last)) if last > first => (self.t.len() - 1) as f64 / (last - first),
            _ => f64::NAN,
        }
    }

    /// Returns a column that has no meaning for the model.
    pub(crate) fn column(&self, name: &str) -> Option<&[f64]> {
        let mut columns = self.extra.iter();
        columns
            .find(|(own, _)| own == name)
            .map(|(_, values)| values.as_slice())
    }

    /// Lists the columns that belong to no joint, with the options that name them.
    pub(crate) fn other_columns(&self) -> String {
        let names: Vec<String> = (self.extra.iter())
            .map(|(name, _)| format!("`{name}`"))
            .collect();
        match names.is_empty() {
            true => "It has no column beside those of the joints.".to_owned(),
            false => format!(
                "Its columns beside those of the joints are {}; for other names give --map fx=NAME or --mapping FILE (`rig inspect` lists the columns).",
                names.join(", ")
            ),
        }
    }

    /// Returns the same signals with the values of the columns `from` in the columns `to`; `None` if one is missing.
    pub(crate) fn exchanged(&self, to: [&str; 3], from: [&str; 3]) -> Option<Self> {
        let mut own = self.clone();
        for (to, from) in to.into_iter().zip(from) {
            let values = self.column(from)?.to_vec();
            own.extra.iter_mut().find(|(name, _)| name == to)?.1 = values;
        }
        Some(own)
    }

    /// Returns the same signals with the opposite sign of one column; `None` if it is missing.
    pub(crate) fn reversed(&self, name: &str) -> Option<Self> {
        let mut own = self.clone();
        let (_, values) = own.extra.iter_mut().find(|(own, _)| own == name)?;
        values.iter_mut().for_each(|value| *value = -*value);
        Some(own)
    }

    /// Returns the same signals without some columns.
    pub(crate) fn without_columns(&self, names: &[&str]) -> Self {
        let mut own = self.clone();
        own.extra
            .retain(|(name, _)| !names.contains(&name.as_str()));
        own
    }

    /// Returns the same signals with the positions of the marked joints taken as degrees.
    pub(crate) fn in_radians(&self, revolute: &[bool]) -> Self {
        let mut own = self.clone();
        for (joint, _) in own.joints.iter_mut().zip(revolute).filter(|(_, r)| **r) {
            let lists = [Some(&mut joint.q), joint.link.as_mut()];
            for list in lists.into_iter().flatten() {
                list.iter_mut().for_each(|q| *q = q.to_radians());
            }
        }
        own
    }

    fn append(&mut self, block: Block) {
        if self.joints.is_empty() {
            self.joints = vec![JointSignals::default(); block.joints.len()];
            self.extra = (block.extra.iter())
                .map(|(name, _)| (name.clone(), Vec::new()))
                .collect();
        }
        self.t.extend(block.t);
        for (own, new) in self.joints.iter_mut().zip(block.joints) {
            own.q.extend(new.q);
            own.tau.extend(new.tau);
            for (list, more) in [
                (&mut own.reference, new.reference),
                (&mut own.link, new.link),
            ] {
                if let Some(more) = more {
                    list.get_or_insert_default().extend(more);
                }
            }
        }
        for ((_, own), (_, new)) in self.extra.iter_mut().zip(block.extra) {
            own.extend(new);
        }
    }
}

/// Movement over the range of the limits beyond which positions are not in radians. By judgement: limits may be described
/// narrower than they are.
const BEYOND: f64 = 1.5;
/// Movement beyond which positions of a joint without limits are not in radians.
const TURNS: f64 = 8.0 * std::f64::consts::PI;

/// Refuses positions of revolute joints that cannot be in radians, by the range of their movement. Drives and links are judged alike.
///
/// # Errors
/// [`ComplianceError::Recording`].
pub(crate) fn refuse_degrees(robot: &Robot, stretches: &[Signals]) -> Result<(), ComplianceError> {
    for signals in stretches {
        for (k, (joint, own)) in robot.joints.iter().zip(&signals.joints).enumerate() {
            if joint.kind != JointKind::Revolute {
                continue;
            }
            let limits = joint.limits.as_ref().map(|l| l.position[1] - l.position[0]);
            let most = limits
                .filter(|r| r.is_finite())
                .map_or(TURNS, |r| BEYOND * r);
            let link = own.link.as_deref().unwrap_or_default();
            for (column, values) in [("q", own.q.as_slice()), ("ql", link)] {
                let low = values.iter().copied().fold(f64::INFINITY, f64::min);
                let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                if high - low > most {
                    return Err(ComplianceError::Recording(format!(
                        "{}: {column}{} (joint \"{}\") moves by {} rad, more than the joint can; record it in radians (1° is 0.01745 rad), or correct its limits.",
                        signals.label,
                        k + 1,
                        joint.name,
                        format_significant(high - low, 3)
                    )));
                }
            }
        }
    }
    Ok(())
}

/// Reads all recordings, one entry per stretch without a gap in time.
///
/// # Errors
/// [`ComplianceError::Prepare`].
pub(crate) fn read(recordings: &[&dyn Recording]) -> Result<Vec<Signals>, ComplianceError> {
    let mut all: Vec<Signals> = Vec::new();
    for recording in recordings {
        let first = all.len();
        recording.each_block(ROWS, &mut |block| {
            if block.is_empty() {
                return Ok(());
            }
            if all.len() == first || !block.continues {
                all.push(Signals {
                    label: recording.label(),
                    ..Signals::default()
                });
            }
            if let Some(last) = all.last_mut() {
                last.append(block);
            }
            Ok(())
        })?;
    }
    Ok(all)
}
