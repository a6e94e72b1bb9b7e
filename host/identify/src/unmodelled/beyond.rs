//! Effects that an identification adds to the description: springs, ripple and a tilted base.

use nalgebra::DMatrix;

use super::position::{PositionTorque, effect};
use super::terms::Term;
use super::tilt::{Axes, BaseTilt};
use crate::error::IdentifyError;
use crate::estimators::problem::Problem;
use rig_model::robot::Robot;

/// Identified springs, ripple and base tilt.
#[derive(Clone, Debug, Default)]
pub(crate) struct Beyond {
    /// Torques that depend on a joint's position.
    pub torques: Vec<PositionTorque>,
    /// Tilt of the base.
    pub tilt: Option<BaseTilt>,
}

impl Beyond {
    pub(crate) fn is_empty(&self) -> bool {
        self.torques.is_empty() && self.tilt.is_none()
    }

    /// Returns the terms with their gains in evidence, and their values in the same order.
    pub(crate) fn terms(&self, robot: &Robot) -> (Vec<(Term, f64)>, Vec<f64>) {
        let mut values = Vec::new();
        let mut terms = Vec::new();
        for torque in &self.torques {
            let Some(joint) = robot.joints.iter().position(|j| j.name == torque.joint) else {
                continue;
            };
            let term = Term::Position {
                joint,
                periods: torque.periods,
            };
            terms.push((term, torque.log_evidence));
            values.extend(&torque.values);
        }
        if let Some(tilt) = &self.tilt {
            terms.push((Term::Tilt, tilt.log_evidence));
            values.extend(tilt.angles);
        }
        (terms, values)
    }

    /// Returns one sentence per term.
    pub(crate) fn said(&self) -> impl Iterator<Item = String> + '_ {
        let tilt = self.tilt.iter().map(BaseTilt::said);
        tilt.chain(self.torques.iter().map(PositionTorque::said))
    }
}

/// Returns `robot` with these torques and this tilt.
pub(crate) fn with_beyond(
    robot: &Robot,
    torques: &[PositionTorque],
    tilt: Option<&BaseTilt>,
) -> Robot {
    let mut robot = robot.clone();
    robot
        .effects
        .extend(torques.iter().map(|f| f.effect.clone()));
    if let Some(tilt) = tilt {
        robot.gravity = tilt.gravity;
    }
    robot
}

/// Converts terms, each with its gain in evidence, to effects of a description. `values` and their covariance are in
/// the order of the terms; gravity is the described one.
pub(crate) fn with_values(
    problem: &Problem,
    terms: &[(Term, f64)],
    values: &[f64],
    covariance: &DMatrix<f64>,
    gravity: [f64; 3],
) -> Result<Beyond, IdentifyError> {
    let zeros = vec![0.0; problem.robot.joints.len()];
    let mut zero = zeros.clone();
    let failed =
        |e: rig_shared::transmission::TransmissionError| IdentifyError::Model(e.to_string());
    let drives = problem.plan.transmission;
    drives.motor_position(&zeros, &mut zero).map_err(failed)?;
    let mut ratios = zeros.clone();
    let ones = vec![1.0; zeros.len()];
    drives
        .motor_velocity(&zeros, &ones, &mut ratios)
        .map_err(failed)?;
    let mut at = 0;
    let mut result = Beyond::default();
    for &(term, log_evidence) in terms {
        let own = at..at + term.columns().len();
        at = own.end;
        let (joint, periods) = match (term, Axes::of(gravity)) {
            (Term::Position { joint, periods }, _) => (joint, periods),
            (Term::Tilt, Some(axes)) => {
                let angles = [values[own.start], values[own.start + 1]];
                let spread = covariance
                    .fixed_view::<2, 2>(own.start, own.start)
                    .into_owned();
                result.tilt = Some(BaseTilt::of(&axes, angles, &spread, log_evidence));
                continue;
            }
            (Term::Tilt, None) => continue,
        };
        let values = values[own.clone()].to_vec();
        // A later term may have removed the need for the spring.
        if periods.is_none() && values[0] <= 0.0 {
            continue;
        }
        let motor = [ratios[joint], zero[joint]];
        result.torques.push(PositionTorque {
            joint: problem.robot.joints[joint].name.clone(),
            periods,
            std: own.map(|c| covariance[(c, c)].max(0.0).sqrt()).collect(),
            log_evidence,
            effect: effect(problem.robot, joint, periods, &values, motor),
            values,
        });
    }
    Ok(result)
}
