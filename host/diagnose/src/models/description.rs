//! Description with the found effects.
//!
//! Leaves out: second-order terms in the angle of a tilted base for more than one joint.

use nalgebra::{DVector, Rotation3, Vector3};
use rig_shared::effects::{Effect, Kind, SHAPES};
use rig_shared::multibody::{COLUMNS, column};

use crate::columns::candidate::Candidate;
use crate::columns::kinds::is_gear;
use crate::models::remark::ModelRemark;
use crate::models::tilt::turn;
use crate::rows::nominal::Nominal;
use crate::search::fitted_candidate::FittedCandidate;
use rig_identify::{Combinations, described as standard, redistributed};
use rig_model::robot::{Origin, Robot, RobotEffect, Uncertainty, plausible_range};

/// Least weight of a standard parameter, as a share of the largest value of its kind.
const LEAST_WEIGHT: f64 = 0.1;
/// Deviation of a transmission's torque factor from 1 above which it is reported.
const UNEVEN: f64 = 0.1;

/// An effect with its fitted gains (one per column) and shapes.
pub(crate) struct Fitted<'a> {
    /// Effect and joint.
    pub(crate) candidate: Candidate,
    /// In the order of its columns.
    pub(crate) gains: &'a [f64],
    /// In the order of the registry.
    pub(crate) shapes: [f64; SHAPES],
}

/// Returns `robot` with these base parameters, and remarks on it.
pub(crate) fn redistributed_over(
    robot: &Robot,
    nominal: &Nominal,
    values: &[f64],
) -> (Robot, Vec<ModelRemark>) {
    let base = Combinations {
        combination: &nominal.base.combination,
        columns: &nominal.base.columns,
        values,
    };
    let weights = weights(robot, base.combination.ncols());
    let (model, said) = redistributed(robot, &base, Some(&weights));
    (model, of_identification(said))
}

/// Returns sentences of an identification as remarks.
pub(crate) fn of_identification(said: Vec<String>) -> Vec<ModelRemark> {
    said.into_iter()
        .map(ModelRemark::OfIdentification)
        .collect()
}

/// Returns gravity turned by a tilt among the effects, and adapts `values` to it.
pub(crate) fn gravity_with(
    robot: &Robot,
    nominal: &Nominal,
    formed_at: &[f64],
    effects: &[Fitted],
    values: &mut [f64],
) -> [f64; 3] {
    (effects.iter())
        .find(|e| e.candidate.kind == Kind::GravityTilt)
        .map_or(robot.gravity, |tilt| {
            turned(nominal, robot.gravity, tilt.gains, formed_at, values)
        })
}

/// Adds gravity and effects to a description with new base parameters and its remarks. `robot` is the one given.
pub(crate) fn completed(
    (mut model, mut remarks): (Robot, Vec<ModelRemark>),
    robot: &Robot,
    gravity: [f64; 3],
    effects: &[Fitted],
) -> (Robot, Vec<ModelRemark>) {
    model.gravity = gravity;
    // The identification record describes the old values.
    model.identified = None;
    model.uncertainty = Uncertainty::default();
    model.origin = Origin::Own;
    for fitted in effects {
        let kind = fitted.candidate.kind;
        if kind == Kind::GravityTilt {
            continue;
        }
        let transmission = is_gear(kind);
        if let ([share], true) = (fitted.gains, transmission)
            && (share - 1.0).abs() > UNEVEN
        {
            remarks.push(ModelRemark::UnevenGear {
                kind,
                joint: fitted.candidate.joint,
                times: *share,
            });
        }
        let gains = if transmission { &[][..] } else { fitted.gains };
        model
            .effects
            .push(within(robot, fitted, gains, &mut remarks));
    }
    (model, remarks)
}

/// Returns the effects with their gains.
pub(crate) fn with_gains<'g>(chosen: &[FittedCandidate], mut gains: &'g [f64]) -> Vec<Fitted<'g>> {
    let mut effects = Vec::new();
    for profile in chosen {
        let (own, rest) = gains.split_at(profile.columns.len());
        gains = rest;
        effects.push(Fitted {
            candidate: profile.candidate,
            gains: own,
            shapes: profile.shapes,
        });
    }
    effects
}

/// Turns gravity by the fitted angles and scales the first moments among `values`. A fit adds the tilt as gravity
/// across the axis, so its moments are too small by the cosine. The gravity torque stays that of the fit: its angle
/// multiplies the moments that formed its column.
fn turned(
    nominal: &Nominal,
    gravity: [f64; 3],
    angles: &[f64],
    formed_at: &[f64],
    values: &mut [f64],
) -> [f64; 3] {
    let axes = nominal.tilt_axes();
    let moments: Vec<usize> = (nominal.base.columns.iter().enumerate())
        .filter(|(_, c)| (column::FIRST_MOMENT..column::INERTIA).contains(&(*c % COLUMNS)))
        .map(|(k, _)| k)
        .collect();
    let length = |values: &[f64]| {
        moments
            .iter()
            .map(|k| values[*k].powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let (before, now) = (length(formed_at), length(values));
    let mut sum = Vector3::zeros();
    for (axis, angle) in axes.iter().zip(angles) {
        let slope = if now > 0.0 {
            angle * before / now
        } else {
            *angle
        };
        sum += Vector3::from(*axis) * slope;
    }
    for k in moments {
        values[k] *= sum.norm().hypot(1.0);
    }
    let turned = Rotation3::from_scaled_axis(sum * turn(sum.as_slice()));
    (turned.inverse() * Vector3::from(gravity)).into()
}

/// Returns the effect as a table of the description, with values limited to its permitted range.
fn within(
    robot: &Robot,
    fitted: &Fitted,
    gains: &[f64],
    remarks: &mut Vec<ModelRemark>,
) -> RobotEffect {
    let Candidate {
        kind, joint, other, ..
    } = fitted.candidate;
    let mut effect = Effect::new(kind, gains, &fitted.shapes);
    let name = |j: usize| robot.joints[j].name.clone();
    let about = kind.about();
    let places = about.gains.iter().zip(&mut effect.gains);
    for (p, value) in places.chain(about.shapes.iter().zip(&mut effect.shapes)) {
        let [low, high] = plausible_range(p);
        let kept = value.clamp(low, high);
        if kept != *value {
            remarks.push(ModelRemark::OutOfRange {
                parameter: p.name,
                effect: about.name,
                joint,
                value: *value,
                kept,
                unit: p.unit,
            });
            *value = kept;
        }
    }
    RobotEffect {
        joint: Some(name(joint)),
        other: other.map(name),
        effect,
    }
}

/// Returns the weight of each standard parameter: its size, at least a share of the largest of its kind.
pub(crate) fn weights(robot: &Robot, columns: usize) -> DVector<f64> {
    let prior = standard(robot, columns);
    let links = robot.joints.len() * COLUMNS;
    let kind = |c: usize| match c.checked_sub(links) {
        None if (column::FIRST_MOMENT..column::INERTIA).contains(&(c % COLUMNS)) => {
            column::FIRST_MOMENT
        }
        None if (column::INERTIA..=column::DRIVE_INERTIA).contains(&(c % COLUMNS)) => {
            column::INERTIA
        }
        None => c % COLUMNS,
        Some(motor) => COLUMNS + motor % rig_shared::transmission::MOTOR_COLUMNS,
    };
    DVector::from_fn(columns, |c, _| {
        let largest = (0..prior.len())
            .filter(|o| kind(*o) == kind(c))
            .fold(0.0, |m: f64, o| m.max(prior[o].abs()));
        let own = prior.get(c).map_or(0.0, |p| p.abs());
        // No parameter of this kind is described: all get the same weight.
        if largest > 0.0 {
            own.max(LEAST_WEIGHT * largest)
        } else {
            1.0
        }
    })
}

#[cfg(test)]
mod tests;
