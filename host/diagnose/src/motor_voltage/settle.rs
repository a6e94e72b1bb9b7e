//! Decision between a constant torque and a sensor offset, by the voltage or by sensor readings with the drive off.

use rig_shared::effects::Kind;

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::kinds::is_constant;
use crate::fit::least_squares::Fit;
use crate::motor_voltage::winding::Winding;
use crate::outcome::Step;
use crate::search::chosen::with;
use crate::search::fitted_candidate::{FittedCandidate, equal};
use crate::search::stepwise::Search;
use rig_numerics::statistics;

/// Constant torques. Only a recording without external loads separates them.
const TORQUES: [Kind; 2] = [Kind::TorqueOffset, Kind::AsymmetricCoulomb];
/// Standard deviations within which the sensor's zero equals the torque's constant, or zero …
const WITHIN: f64 = 3.0;
/// … and additional share of the constant.
const SHARE: f64 = 0.2;

/// Decision on a constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Word {
    /// The sensor reads it without a current.
    Sensor,
    /// The sensor reads zero without a current.
    Torque,
    /// Undecided: neither, or both.
    Open,
}

/// Returns the sensors' readings without a current and their standard deviations, joint by joint, N·m or N. They come
/// from a recording with the drive off (`given`), else from a valid voltage equation.
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

/// Decides on each effect. A constant of the sensor gets that name and one that is not loses it. The same holds for
/// effects that a constant explains as well.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn settled(
    zeros: &[Option<[f64; 2]>],
    search: &Search,
    base: &Fit,
    chosen: &mut [FittedCandidate],
) -> Result<Vec<Word>, DiagnoseError> {
    let mut words = vec![Word::Open; chosen.len()];
    for k in 0..chosen.len() {
        let candidate = chosen[k].candidate;
        let Some(zero) = zeros.get(candidate.joint).copied().flatten() else {
            continue;
        };
        let in_its_place = |kind: Kind, chosen: &[FittedCandidate]| {
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
            let mut best: Option<FittedCandidate> = None;
            for name in names {
                let better = |p: &FittedCandidate| {
                    (best.as_ref()).is_none_or(|b| p.evidence.gain > b.evidence.gain)
                };
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

/// Returns the mean torque of a constant effect and its standard deviation.
fn constant(profile: &FittedCandidate) -> Option<[f64; 2]> {
    let column = profile.columns.first()?[profile.candidate.joint].as_ref()?;
    let mean = statistics::mean_or_zero(column);
    let [gain] = profile.evidence.gains.first_chunk()?;
    let [std] = profile.evidence.stds.first_chunk()?;
    Some([gain * mean, std * mean.abs()])
}

impl Word {
    /// Removes excluded names from a step.
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
