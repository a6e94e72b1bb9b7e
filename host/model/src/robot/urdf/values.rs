//! Values of links and joints in a URDF file: inertia, limits, friction.

use nalgebra::Matrix3;

use super::reader::{Reader, Xml, child};
use super::spatial::SpatialInertia;
use super::unknown_limit::Unknown;
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
        let position = self.position_limits(node, name, endless)?;
        let velocity = self.optional_number(node, "velocity")?;
        let stated = self.optional_number(node, "effort")?;
        let effort = stated.unwrap_or(0.0);
        let is_open = !endless && position == [0.0; 2];
        let is_zero = velocity == Some(0.0) && effort == 0.0;
        if is_zero && (endless || position[0] == position[1]) {
            // CAD exporters write this if the user entered nothing.
            self.unknown(node, name, Unknown::All);
            return Ok(None);
        }
        if position[0] >= position[1] && !is_open {
            return Err(self.error(node, format!("the lower limit of joint `{name}` is {} and the upper limit {}, but lower must be below upper", position[0], position[1])));
        }
        if let Some(velocity) = velocity.filter(|v| *v < 0.0) {
            return Err(self.error(node, format!("the velocity limit of joint `{name}` is {velocity}, but it must be greater than 0; remove <limit> where the limits are not known")));
        }
        if effort < 0.0 {
            return Err(self.error(node, format!("the effort limit of joint `{name}` is {effort}, but it must be greater than 0, or 0 where it is not known")));
        }
        let acceleration = self.acceleration_limit(node, name)?;
        let soft_position = self.soft_limits(joint, name, position)?;
        if is_open {
            self.unknown(node, name, Unknown::Range);
            return Ok(None);
        }
        let placeholder = is_placeholder(effort, UNKNOWN_EFFORT);
        let known = velocity.filter(|own| *own > 0.0);
        let what = match (known, velocity, stated) {
            (None, ..) if placeholder => Some(Unknown::SpeedAndEffort),
            (None, Some(_), _) => Some(Unknown::Speed),
            (None, None, _) => Some(Unknown::NoSpeed),
            (Some(_), _, None) => Some(Unknown::NoEffort),
            (Some(_), _, Some(_)) => placeholder.then_some(Unknown::Effort(effort)),
        };
        if let Some(what) = what {
            self.unknown(node, name, what);
        }
        Ok(Some(JointLimits {
            position,
            soft_position,
            velocity: known.unwrap_or(f64::INFINITY),
            acceleration,
            torque: (!placeholder).then_some(effort),
        }))
    }

    /// Returns the lower and the upper limit; 0 for one that is missing, with a remark if the other one is there.
    fn position_limits(
        &self,
        node: Xml<'a>,
        name: &str,
        endless: bool,
    ) -> Result<[f64; 2], RobotError> {
        if endless {
            return Ok([f64::NEG_INFINITY, f64::INFINITY]);
        }
        let bound = |key| self.optional_number(node, key);
        let (lower, upper) = (bound("lower")?, bound("upper")?);
        if lower.is_some() != upper.is_some() {
            let missing = if lower.is_none() { "lower" } else { "upper" };
            let place = format!("{}:{}", self.path.display(), self.place(node));
            self.remarks.borrow_mut().push(format!(
                "{place}: <limit> of joint `{name}` has no `{missing}`, which counts as 0."
            ));
        }
        Ok([lower.unwrap_or(0.0), upper.unwrap_or(0.0)])
    }

    /// Notes that a limit of a joint counts as not known; [`Reader::tell_unknown`] adds the remarks.
    fn unknown(&self, node: Xml<'a>, name: &str, what: Unknown) {
        let own = (what, self.place(node), name.to_owned());
        self.unknown.borrow_mut().push(own);
    }

    /// Adds one remark for all joints whose limits count as not known for the same reason.
    pub(super) fn tell_unknown(&self) {
        let mut pending = self.unknown.take();
        while let Some((what, place, _)) = pending.first().cloned() {
            let (same, others): (Vec<_>, Vec<_>) =
                pending.into_iter().partition(|own| own.0 == what);
            pending = others;
            let names: Vec<String> = same.iter().map(|own| format!("`{}`", own.2)).collect();
            let is_one = names.len() == 1;
            let joints = format!(
                "{} {}",
                if is_one { "joint" } else { "joints" },
                rig_output::listed(&names)
            );
            self.remarks.borrow_mut().push(format!(
                "{}:{place}: {}",
                self.path.display(),
                what.sentence(&joints, is_one)
            ));
        }
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

/// Returns true if an effort limit means "none": 0, a million or more, and from `least` (N·m or N) on powers of ten and
/// rows of nines.
pub fn is_placeholder(effort: f64, least: f64) -> bool {
    let power = |x: f64| (x.log10() - x.log10().round()).abs() < 1e-12;
    let round = power(effort) || (effort.fract() == 0.0 && power(effort + 1.0));
    effort == 0.0 || effort >= 1e6 || (effort + 1.0 >= least && round)
}
