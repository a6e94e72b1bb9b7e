//! A constant torque or a constant error of its sensor: the voltage tells, or what the sensor reads with the drive off.

use rig_shared::effects::Kind;

use super::Winding;
use crate::DiagnoseError;
use crate::columns::Candidate;
use crate::fit::Fit;
use crate::judge::equal;
use crate::outcome::Step;
use crate::profile::Profile;
use crate::search::{Search, is_constant, with};

/// Constants that are a torque. They are one function, too, unless a recording is without all that pulls on the joint.
const TORQUES: [Kind; 2] = [Kind::TorqueOffset, Kind::AsymmetricCoulomb];
/// What the sensor reads without a current counts as the torque's constant, or as nothing, within so many standard deviations …
const WITHIN: f64 = 3.0;
/// … and this share of the constant.
const SHARE: f64 = 0.2;

/// What is said of a constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Word {
    /// The sensor reads it without a current.
    Sensor,
    /// The sensor reads nothing without a current.
    Torque,
    /// Neither, or both.
    Open,
}

/// What the sensors read without a current and its standard deviation, joint by joint, N·m or N: as recorded with the drive
/// off (`given`), else as the voltage says where its equation holds.
pub(crate) fn zeros(
    given: &[[f64; 2]],
    windings: &[Winding],
    joints: usize,
) -> Vec<Option<[f64; 2]>> {
    let of = |joint: usize| {
        let winding = (windings.iter()).find(|w| w.joint == joint && w.left.is_none());
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

/// For each effect what is said of it; a constant that is the sensor's gets that name, and one that is not loses it. So does
/// what a constant would explain as well.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn settled(
    zeros: &[Option<[f64; 2]>],
    search: &Search,
    base: &Fit,
    chosen: &mut [Profile],
) -> Result<Vec<Word>, DiagnoseError> {
    let mut words = vec![Word::Open; chosen.len()];
    for k in 0..chosen.len() {
        let candidate = chosen[k].candidate;
        let Some(zero) = zeros.get(candidate.joint).copied().flatten() else {
            continue;
        };
        let in_its_place = |kind: Kind, chosen: &[Profile]| {
            let own = |c: &Candidate| c.kind == kind && c.joint == candidate.joint;
            match search.library.iter().position(own) {
                Some(c) => search.profile(&with(base, chosen, Some(k)), c, None),
                None => Ok(None),
            }
        };
        let sensor = Kind::CurrentOffset;
        if is_constant(candidate.kind) {
            let Some([constant, std]) = constant(&chosen[k]) else {
                continue;
            };
            words[k] = Word::of(zero, constant, std);
            let names = match words[k] {
                Word::Sensor => &[sensor][..],
                Word::Torque if candidate.kind == sensor => &TORQUES[..],
                _ => continue,
            };
            let mut best: Option<Profile> = None;
            for name in names {
                let better =
                    |p: &Profile| (best.as_ref()).is_none_or(|b| p.evidence.gain > b.evidence.gain);
                if let Some(profile) = in_its_place(*name, chosen)?.filter(better) {
                    best = Some(profile);
                }
            }
            if let Some(profile) = best {
                chosen[k] = profile;
            }
        } else if !search.is_described(&candidate)
            && let Some(rival) = in_its_place(sensor, chosen)?
            && equal(&chosen[k], &rival)
            && let Some([constant, std]) = constant(&rival)
        {
            words[k] = Word::of(zero, constant, std);
            if words[k] == Word::Sensor {
                chosen[k] = rival;
            }
        }
    }
    Ok(words)
}

/// The constant torque of an effect that is one, on average, and its standard deviation.
fn constant(profile: &Profile) -> Option<[f64; 2]> {
    let column = profile.columns.first()?[profile.candidate.joint].as_ref()?;
    let mean = column.iter().sum::<f64>() / column.len().max(1) as f64;
    let [gain] = profile.evidence.gains.first_chunk()?;
    let [std] = profile.evidence.stds.first_chunk()?;
    Some([gain * mean, std * mean.abs()])
}

impl Word {
    /// Takes the names that are excluded out of a step.
    pub(crate) fn applied(self, step: &mut Step) {
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
