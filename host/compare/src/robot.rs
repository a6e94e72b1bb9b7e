//! The pooled values as a description.

use rig_identify::{Combinations, Sizes, as_bodies, redistributed};
use rig_model::robot::{IdentifiedBand, Robot, Uncertainty};

use crate::matrices::inverse;
use crate::result::Comparison;

/// Returns `robot` with the pooled parameters, and remarks. Several links become the physically consistent bodies nearest
/// to them in units of their errors. If there are none, the description changes by the smallest step.
pub fn pooled_robot(robot: &Robot, comparison: &Comparison) -> (Robot, Vec<String>) {
    let pooled = &comparison.pooled;
    let base = Combinations {
        combination: &pooled.combination,
        columns: &pooled.columns,
        values: &pooled.values,
    };
    let mut robot = robot.clone();
    robot.identified = common_band(&pooled.bands);
    robot.uncertainty = Uncertainty::default();
    let mut failed = Vec::new();
    if robot.identified.is_none() {
        failed.push(
            "The sets were identified with different cut-offs or row rates, so pooled.toml has no [identified] table."
                .to_owned(),
        );
    }
    if robot.joints.len() > 1
        && let Some(information) = inverse(&pooled.covariance)
    {
        let sizes = Sizes {
            torque: pooled.sizes[0].clone(),
            speed: pooled.sizes[1].clone(),
            acceleration: pooled.sizes[2].clone(),
        };
        match as_bodies(&robot, &base, information, sizes) {
            Ok(bodies) => {
                failed.extend(bodies.remarks);
                return (bodies.robot, failed);
            }
            Err(error) => failed.push(format!(
                "The links are not physically consistent bodies: {error} The description was changed by the smallest step instead."
            )),
        }
    }
    let (result, remarks) = redistributed(&robot, &base, None);
    failed.extend(remarks);
    (result, failed)
}

/// Returns the band if all sets have the same filters, with the largest speed thresholds; none otherwise.
fn common_band(bands: &[IdentifiedBand]) -> Option<IdentifiedBand> {
    let (first, others) = bands.split_first()?;
    let mut band = first.clone();
    for other in others {
        let same = other.cutoff == band.cutoff
            && other.rate == band.rate
            && other.torque_lead == band.torque_lead;
        if !same {
            return None;
        }
        for (most, own) in band.min_speed.iter_mut().zip(&other.min_speed) {
            *most = most.max(*own);
        }
    }
    Some(band)
}
