//! Values of links and joints in a URDF file: inertia, limits, friction.

use nalgebra::Matrix3;

use super::reader::{Reader, Xml, child};
use super::spatial::SpatialInertia;
use crate::robot::error::RobotError;
use crate::robot::joint::{JointFriction, JointLimits};
use crate::robot::link_size::too_wide;
use rig_output::format_significant;

/// Round effort limits from this value on count as placeholders, N·m or N.
const UNKNOWN_EFFORT: f64 = 1e4;

impl<'a> Reader<'a> {
    pub(super) fn inertial(&self, link: Xml<'a>) -> Result<Option<SpatialInertia>, RobotError> {
        let Some(node) = child(link, "inertial") else {
            return Ok(None);
        };
        let name = link.attribute("name").unwrap_or_default();
        let part = |tag: &str| {
            child(node, tag).ok_or_else(|| {
                self.error(
                    node,
                    format!(
                        "<inertial> of link `{name}` has no <{tag}>; it needs <mass> and <inertia>"
                    ),
                )
            })
        };
        let mass_node = part("mass")?;
        let mass = self.number(mass_node, "value")?;
        if mass < 0.0 {
            return Err(self.error(
                mass_node,
                format!("the mass of link `{name}` is {mass}, but it must be 0 or greater, in kg"),
            ));
        }
        let i = part("inertia")?;
        let [ixx, ixy, ixz, iyy, iyz, izz] = {
            let mut values = [0.0; 6];
            for (value, key) in values
                .iter_mut()
                .zip(["ixx", "ixy", "ixz", "iyy", "iyz", "izz"])
            {
                *value = self.number(i, key)?;
            }
            values
        };
        let inertia = Matrix3::new(ixx, ixy, ixz, ixy, iyy, iyz, ixz, iyz, izz);
        if let Some(why) = too_wide(inertia.amax(), mass) {
            return Err(self.error(
                i,
                format!(
                    "the inertia of link `{name}` is up to {} kg·m², but {why}",
                    format_significant(inertia.amax(), 4)
                ),
            ));
        }
        let pose = self.origin(node)?;
        let r = pose.rotation.to_rotation_matrix();
        let about_centre = r * inertia * r.transpose();
        Ok(Some(SpatialInertia::from_centre(
            mass,
            pose.translation.vector,
            about_centre,
        )))
    }

    pub(super) fn limits(
        &self,
        joint: Xml<'a>,
        name: &str,
        endless: bool,
    ) -> Result<Option<JointLimits>, RobotError> {
        let Some(node) = child(joint, "limit") else {
            return Ok(None);
        };
        let position = if endless {
            [f64::NEG_INFINITY, f64::INFINITY]
        } else {
            let bound = |key| self.optional_number(node, key);
            let (lower, upper) = (bound("lower")?, bound("upper")?);
            if lower.is_some() != upper.is_some() {
                let missing = if lower.is_none() { "lower" } else { "upper" };
                let place = format!("{}:{}", self.path.display(), self.place(node));
                self.remarks.borrow_mut().push(format!(
                    "{place}: <limit> of joint `{name}` has no `{missing}`, which counts as 0."
                ));
            }
            [lower.unwrap_or(0.0), upper.unwrap_or(0.0)]
        };
        let remark = |text: String| {
            let place = format!("{}:{}", self.path.display(), self.place(node));
            self.remarks.borrow_mut().push(format!("{place}: {text}"));
        };
        if node.attribute("velocity").is_none() {
            let unit = joint_unit(joint);
            return Err(self.error(node, format!("<limit> has no `velocity`; add velocity=\"…\", the highest speed of joint `{name}` in {unit}, or remove <limit> where the limits are not known")));
        }
        let velocity = self.number(node, "velocity")?;
        let stated = self.optional_number(node, "effort")?;
        if stated.is_none() {
            remark(format!(
                "<limit> of joint `{name}` has no `effort`; its torque limit counts as not known."
            ));
        }
        let effort = stated.unwrap_or(0.0);
        if velocity == 0.0 && effort == 0.0 && (endless || position[0] == position[1]) {
            // CAD exporters write this if the user entered nothing.
            remark(format!(
                "<limit> of joint `{name}` is zero throughout, a placeholder; its limits count as not known."
            ));
            return Ok(None);
        }
        if position[0] >= position[1] {
            return Err(self.error(node, format!("the lower limit of joint `{name}` is {} and the upper limit {}, but lower must be below upper", position[0], position[1])));
        }
        if velocity <= 0.0 {
            return Err(self.error(node, format!("the velocity limit of joint `{name}` is {velocity}, but it must be greater than 0; remove <limit> where the limits are not known")));
        }
        if effort < 0.0 {
            return Err(self.error(node, format!("the effort limit of joint `{name}` is {effort}, but it must be greater than 0, or 0 where it is not known")));
        }
        let placeholder = is_placeholder(effort, UNKNOWN_EFFORT);
        if placeholder && stated.is_some() {
            remark(format!(
                "the effort limit {effort} of joint `{name}` looks like a placeholder; its torque limit counts as not known."
            ));
        }
        Ok(Some(JointLimits {
            position,
            soft_position: self.soft_limits(joint, name, position)?,
            velocity,
            acceleration: self.acceleration_limit(node, name)?,
            torque: (!placeholder).then_some(effort),
        }))
    }

    /// Returns `drake:acceleration` of a `<limit>`, rad/s² or m/s² (Drake, "Supported formats", multibody parsing); its default
    /// is infinite.
    fn acceleration_limit(&self, limit: Xml<'a>, name: &str) -> Result<Option<f64>, RobotError> {
        let mut own = limit.attributes();
        let Some(own) = own.find(|a| a.name() == "acceleration" && a.namespace().is_some()) else {
            return Ok(None);
        };
        if own.value().trim().parse() == Ok(f64::INFINITY) {
            return Ok(None);
        }
        let value = self.parse_number(limit, "`drake:acceleration` of <limit>", own.value())?;
        if value < 0.0 {
            return Err(self.error(limit, format!("the acceleration limit of joint `{name}` is {value}, but it must be greater than 0")));
        }
        Ok((value > 0.0).then_some(value))
    }

    /// Returns the range in which the robot's own controller keeps the joint: `<safety_controller soft_lower_limit
    /// soft_upper_limit>`. A side that is absent, or beyond the limit, becomes the limit.
    fn soft_limits(
        &self,
        joint: Xml<'a>,
        name: &str,
        [low, high]: [f64; 2],
    ) -> Result<Option<[f64; 2]>, RobotError> {
        let Some(node) = child(joint, "safety_controller") else {
            return Ok(None);
        };
        let lower = self.optional_number(node, "soft_lower_limit")?;
        let upper = self.optional_number(node, "soft_upper_limit")?;
        let reach = low.abs().max(high.abs());
        let farthest = (lower.into_iter().chain(upper)).fold(0.0, |m: f64, v| m.max(v.abs()));
        let turns = joint.attribute("type") != Some("prismatic");
        // The rule of positions that look like degrees.
        if turns && farthest > 5.0 * reach && farthest.to_radians() <= 1.2 * reach {
            return Err(self.error(node, format!("the soft limits of joint `{name}` reach {farthest}, but its limits are {low} to {high} rad; they look like degrees, give them in rad")));
        }
        let soft = [
            lower.map_or(low, |v| v.max(low)),
            upper.map_or(high, |v| v.min(high)),
        ];
        if soft == [low, high] || !soft.iter().all(|v| v.is_finite()) {
            return Ok(None);
        }
        if soft[0] >= soft[1] {
            // Covers the element's defaults, both 0, which mean nothing.
            let place = format!("{}:{}", self.path.display(), self.place(node));
            self.remarks.borrow_mut().push(format!(
                "{place}: <safety_controller> of joint `{name}` leaves no range within {low} to {high}; its soft limits are not used."
            ));
            return Ok(None);
        }
        Ok(Some(soft))
    }

    pub(super) fn friction(&self, joint: Xml<'a>) -> Result<Option<JointFriction>, RobotError> {
        let Some(node) = child(joint, "dynamics") else {
            return Ok(None);
        };
        let value = |key: &str| -> Result<f64, RobotError> {
            let value = self.optional_number(node, key)?.unwrap_or(0.0);
            if value >= 0.0 {
                return Ok(value);
            }
            let name = joint.attribute("name").unwrap_or_default();
            Err(self.error(node, format!("the {key} of joint `{name}` is {value}, but friction below zero would drive the joint; it must be 0 or greater")))
        };
        Ok(Some(JointFriction {
            coulomb: value("friction")?,
            viscous: value("damping")?,
            offset: 0.0,
        }))
    }
}

/// Returns the unit of a joint's speed.
fn joint_unit(joint: Xml<'_>) -> &'static str {
    match joint.attribute("type") {
        Some("prismatic") => "m/s",
        _ => "rad/s",
    }
}

/// Returns true if an effort limit means "none": 0, a million or more, and from `least` (N·m or N) on powers of ten and
/// rows of nines.
pub fn is_placeholder(effort: f64, least: f64) -> bool {
    let power = |x: f64| (x.log10() - x.log10().round()).abs() < 1e-12;
    let round = power(effort) || (effort.fract() == 0.0 && power(effort + 1.0));
    effort == 0.0 || effort >= 1e6 || (effort + 1.0 >= least && round)
}
