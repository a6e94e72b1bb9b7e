//! The weight of an identified load against the described torques of the joints.

use nalgebra::Vector3;
use rig_data::prepare::{PrepareError, Recording};
use rig_model::robot::Robot;
use rig_output::{format_significant, format_unit};
use rig_shared::multibody::{Chain, point_position};

use crate::error::LoadError;

/// Multiple of the described torque of a joint beyond which it does not carry a load: descriptions state continuous or peak
/// torques, which differ by less than this.
const BEYOND: f64 = 2.0;
/// Rows between two that are looked at.
const STRIDE: usize = 50;

/// Says that a joint of the description cannot carry the load in the recorded poses. `centre` is in the flange frame.
///
/// # Errors
/// A recording that cannot be read, a robot without a model.
pub(crate) fn too_heavy(
    robot: &Robot,
    chain: &Chain<f64>,
    recordings: &[&dyn Recording],
    mass: f64,
    centre: [f64; 3],
) -> Result<Option<String>, LoadError> {
    let point = robot.flange_pose() * nalgebra::Point3::from(centre);
    let gravity = Vector3::from(robot.gravity);
    let count = robot.joints.len();
    let mut highest = vec![0.0f64; count];
    let mut slopes = vec![[0.0; 3]; count];
    for recording in recordings {
        recording.each_block(1 << 14, &mut |block| {
            for k in (0..block.len()).step_by(STRIDE) {
                let q: Vec<f64> = block.joints.iter().map(|joint| joint.q[k]).collect();
                point_position(
                    chain,
                    &q,
                    chain.last_link(),
                    point.coords.into(),
                    &mut slopes,
                )
                .map_err(|e| PrepareError::Read(e.to_string()))?;
                for (most, slope) in highest.iter_mut().zip(&slopes) {
                    *most = most.max((mass * gravity.dot(&Vector3::from(*slope))).abs());
                }
            }
            Ok(())
        })?;
    }
    let over = robot
        .joints
        .iter()
        .zip(&highest)
        .filter_map(|(joint, torque)| {
            let limit = joint.limits.as_ref()?.torque?;
            (limit > 0.0 && *torque > BEYOND * limit).then_some((joint, *torque, limit))
        });
    let worst = over.max_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2)));
    Ok(worst.map(|(joint, torque, limit)| {
        let unit = format_unit(joint.kind.units().1);
        format!(
            "The weight of {} kg asks {} {unit} of joint {}, whose described limit is {} {unit}. If the readings are in mN and mN·m, give --unit fx=mN --unit fy=mN --unit fz=mN --unit mx=mNm --unit my=mNm --unit mz=mNm; otherwise check their unit, or the limit in the description.",
            format_significant(mass, 4),
            format_significant(torque, 3),
            joint.name,
            format_significant(limit, 4)
        )
    }))
}
