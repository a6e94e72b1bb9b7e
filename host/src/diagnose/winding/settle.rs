//! A constant torque or a constant error of its sensor: the voltage tells, or what the sensor reads with the drive off.

use rig_shared::effects::Kind;

use super::Winding;
use crate::diagnose::DiagnoseError;
use crate::diagnose::columns::Candidate;
use crate::diagnose::fit::Fit;
use crate::diagnose::outcome::Step;
use crate::diagnose::profile::Profile;
use crate::diagnose::search::{Search, with};

/// Effects that are one constant in the torque.
const CONSTANTS: [Kind; 3] = [
    Kind::AsymmetricCoulomb,
    Kind::TorqueOffset,
    Kind::CurrentOffset,
];
/// What the sensor reads without a current counts as the torque's constant, or as nothing, within so many standard deviations …
const WITHIN: f64 = 3.0;
/// … and this share of the constant.
const SHARE: f64 = 0.2;

/// What is said of a constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::diagnose) enum Word {
    /// The sensor reads it without a current.
    Sensor,
    /// The sensor reads nothing without a current.
    Torque,
    /// Neither, or both.
    Open,
}

/// What the sensors read without a current and its standard deviation, joint by joint, N·m or N: as recorded with the drive
/// off (`given`), else as the voltage says.
pub(in crate::diagnose) fn zeros(
    given: &[[f64; 2]],
    windings: &[Winding],
    joints: usize,
) -> Vec<Option<[f64; 2]>> {
    let of = |joint: usize| {
        let winding = windings.iter().find(|w| w.joint == joint);
        given.get(joint).copied().or(winding.map(|w| w.offset))
    };
    (0..joints).map(of).collect()
}

impl Word {
    fn of([offset, own]: [f64; 2], constant: f64, std: f64) -> Self {
        let room = WITHIN * std.hypot(own) + SHARE * constant.abs();
        match ((offset - constant).abs() < room, offset.abs() < room) {
            (true, false) => Self::Sensor,
            (false, true) => Self::Torque,
            _ => Self::Open,
        }
    }
}

/// For each effect what is said of it; a constant that is the sensor's gets that name, and one that is not loses it.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(in crate::diagnose) fn settled(
    zeros: &[Option<[f64; 2]>],
    search: &Search,
    base: &Fit,
    chosen: &mut [Profile],
) -> Result<Vec<Word>, DiagnoseError> {
    let mut words = vec![Word::Open; chosen.len()];
    for k in 0..chosen.len() {
        let candidate = chosen[k].candidate;
        let zero = zeros.get(candidate.joint).copied().flatten();
        let Some(zero) = zero.filter(|_| CONSTANTS.contains(&candidate.kind)) else {
            continue;
        };
        let (Some([gain]), Some([std]), Some(column)) = (
            chosen[k].evidence.gains.first_chunk(),
            chosen[k].evidence.stds.first_chunk(),
            (chosen[k].columns.first()).and_then(|c| c[candidate.joint].as_ref()),
        ) else {
            continue;
        };
        let mean = column.iter().sum::<f64>() / column.len().max(1) as f64;
        words[k] = Word::of(zero, gain * mean, std * mean.abs());
        let sensor = Kind::CurrentOffset;
        let name = match words[k] {
            Word::Sensor => sensor,
            Word::Torque if candidate.kind == sensor => Kind::TorqueOffset,
            _ => continue,
        };
        let own = |c: &Candidate| c.kind == name && c.joint == candidate.joint;
        if let Some(c) = search.library.iter().position(own)
            && let Some(profile) = search.profile(&with(base, chosen, Some(k)), c, None)?
        {
            chosen[k] = profile;
        }
    }
    Ok(words)
}

impl Word {
    /// Takes the names that are excluded out of a step.
    pub(in crate::diagnose) fn applied(self, step: &mut Step) {
        let sensor = Kind::CurrentOffset.about().name;
        match self {
            Self::Sensor => step.set.retain(|name| *name == step.effect),
            Self::Torque => {
                step.set
                    .retain(|name| name != sensor || *name == step.effect);
                if step.runner_up.as_deref() == Some(sensor) {
                    (step.runner_up, step.runner_up_gap_closed) = (None, None);
                }
            }
            Self::Open => {}
        }
    }
}
