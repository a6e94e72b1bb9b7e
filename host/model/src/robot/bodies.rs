//! Bodies: whether one can have a link's inertial values, and values that simulators accept.
//!
//! Only values that the link's motion shows are judged: the mass of a link that only slides, the moment of inertia about
//! the axis of a link that turns about one direction, and the whole inertia of all others.

use nalgebra::{Matrix3, Vector3};

use super::frame::step;
use super::joint::JointKind;
use super::serial_robot::Robot;
use super::urdf::SpatialInertia;
use rig_output::format_significant;

/// Axes closer to parallel than this turn a link about one direction. Sine of the angle between them.
const PARALLEL: f64 = 1e-6;
/// Share by which principal moments may break the triangle inequality: the effect of rounding to two or three digits.
const ROUNDED: f64 = 0.02;

/// The part of a link's inertia that its motion shows.
pub(super) enum Shown {
    Mass,
    About(Vector3<f64>),
    All,
}

impl Robot {
    /// Returns the directions about which link `link` turns, in its frame at zero position. Neighbouring axes keep their
    /// angle at every position. So axes that are parallel here stay parallel, or an axis between them is not parallel.
    ///
    /// A follower counts as a joint of its own, so that no part of an inertia is taken as free that a motion shows.
    pub(super) fn shown(&self, link: usize) -> Shown {
        let mut direction: Option<Vector3<f64>> = None;
        let order = self.links_outwards();
        let before = order.iter().take_while(|own| **own != link).count();
        for joint in order[..=before.min(order.len() - 1)]
            .iter()
            .filter_map(|own| self.link_as_joint(*own))
        {
            let turn = step(joint.alpha, joint.a, joint.theta, joint.d).rotation;
            direction = direction.map(|own| turn.inverse() * own);
            if joint.kind == JointKind::Revolute {
                match direction {
                    Some(own) if own.cross(&Vector3::z()).norm() > PARALLEL => return Shown::All,
                    _ => direction = Some(Vector3::z()),
                }
            }
        }
        direction.map_or(Shown::Mass, Shown::About)
    }
}

/// Returns the fault of a body as the rest of a sentence about its link; `None` if it has no fault.
pub(super) fn implausibility(body: &SpatialInertia, shown: &Shown) -> Option<String> {
    let about_origin_is_zero = body.inertia == Matrix3::zeros();
    if body.mass <= 0.0 {
        return Some(
            if about_origin_is_zero && body.first_moment == Vector3::zeros() {
                "has neither mass nor inertia".into()
            } else {
                "has mass 0, but a first moment or an inertia".into()
            },
        );
    }
    let (_, inertia) = body.about_centre()?;
    let unit = |value: f64| format!("{} kg·m²", format_significant(value, 4));
    // Rounding of the difference between both inertias.
    let rounding = 1e-13 * body.inertia.amax();
    match shown {
        Shown::Mass => None,
        Shown::About(direction) => {
            let own = direction.dot(&(inertia * direction));
            (own < -rounding).then(|| {
                format!(
                    "has a moment of inertia of {} about its centre of mass along the axis that it turns about: the inertia about the joint is smaller than its mass and centre of mass demand",
                    unit(own)
                )
            })
        }
        Shown::All if inertia.amax() <= rounding => {
            Some("has no inertia about its centre of mass, as a point would".into())
        }
        Shown::All => {
            let mut principal: Vec<f64> = inertia.symmetric_eigenvalues().iter().copied().collect();
            principal.sort_by(f64::total_cmp);
            let [small, middle, large] = principal[..] else {
                return None;
            };
            if small < -ROUNDED * large.abs().max(-small) {
                return Some(format!(
                    "has a principal moment of inertia below zero about its centre of mass, {}",
                    unit(small)
                ));
            }
            (large > (1.0 + ROUNDED) * (small + middle)).then(|| {
                format!(
                    "has principal moments of inertia {}, {} and {} about its centre of mass, of which the largest is above the sum of the others",
                    format_significant(small, 4),
                    format_significant(middle, 4),
                    unit(large)
                )
            })
        }
    }
}

/// Radius of gyration of a body whose inertia its motion does not show, m.
const RADIUS: f64 = 0.05;
/// Moments across the axis as a share of the moment about it, if the motion shows only that one. Above one half, so
/// that the largest moment is below the sum of the others.
const ACROSS: f64 = 0.6;
/// Least ratio of smallest to largest principal moment that simulators accept. MuJoCo demands positive moments.
const POSITIVE: f64 = 1e-9;

impl Robot {
    /// Returns the description with bodies that MuJoCo and Gazebo accept, without changing any motion, and the changes.
    ///
    /// Both demand mass, and positive principal moments about the centre with the largest below the sum of the others.
    /// An identified description need not satisfy this. For a link that turns about one direction only that moment
    /// matters, and for a sliding link only the mass: the other values are chosen here. If all values matter nothing is
    /// changed, and the sentence names the link that will be refused.
    pub(super) fn with_bodies(&self) -> (Self, Vec<String>) {
        let mut robot = self.clone();
        let mut remarks = Vec::new();
        let first = self.links_outwards().first().copied();
        for k in 0..self.link_count() {
            let Some(inertial) = self.link_inertial(k) else {
                continue;
            };
            let body = SpatialInertia::of(inertial);
            if is_taken(&body) {
                continue;
            }
            let name = self.link_name(k);
            let shown = self.shown(k);
            match body_like(&body, &shown, first == Some(k)) {
                Some(new) => {
                    if let Some(place) = robot.link_inertial_mut(k) {
                        *place = Some(new.inertial());
                    }
                    remarks.push(format!(
                        "The link of joint {name}: inertia that no motion of this robot shows was chosen so that the link is a body, as MuJoCo and Gazebo demand. Its motion is the same."
                    ));
                }
                None => {
                    let why = implausibility(&body, &Shown::All)
                        .or_else(|| implausibility(&body, &shown))
                        .unwrap_or_else(|| "has moments of inertia that no body has".to_owned());
                    remarks.push(format!(
                        "MuJoCo and Gazebo will refuse the link of joint {name}: it {why}. Values of combinations (base parameters) are no bodies; give each link its own, or take identified.urdf of `rig identify` with --estimator consistent."
                    ));
                }
            }
        }
        (robot, remarks)
    }
}

/// Returns true if simulators accept the body: it has mass, and moments that a body of some extent has.
fn is_taken(body: &SpatialInertia) -> bool {
    let Some((_, inertia)) = body.about_centre().filter(|_| body.mass > 0.0) else {
        return false;
    };
    let mut principal: Vec<f64> = inertia.symmetric_eigenvalues().iter().copied().collect();
    principal.sort_by(f64::total_cmp);
    match principal[..] {
        [small, middle, large] => {
            small > POSITIVE * large.abs() && large <= (1.0 + POSITIVE) * (small + middle)
        }
        _ => false,
    }
}

/// Returns a body of the same motion that simulators accept, if one exists. `first`: the joint is on the base.
fn body_like(body: &SpatialInertia, shown: &Shown, first: bool) -> Option<SpatialInertia> {
    let direction = match shown {
        Shown::All => return None,
        Shown::Mass => None,
        Shown::About(direction) => Some(*direction),
    };
    let mut mass = body.mass;
    if let (true, Some(axis)) = (first, direction) {
        // About a fixed axis the mass is free if first moment and moment of inertia are kept. The centre of mass moves
        // towards the axis until half of the moment belongs to the body itself.
        let across = body.first_moment - axis * axis.dot(&body.first_moment);
        let moment = axis.dot(&(body.inertia * axis));
        let own = moment - across.norm_squared() / mass.max(f64::MIN_POSITIVE);
        if moment > 0.0 && (mass <= 0.0 || own <= POSITIVE * moment) {
            mass = (2.0 * across.norm_squared() / moment).max(moment / RADIUS.powi(2));
        }
    }
    let (centre, about) = SpatialInertia { mass, ..*body }
        .about_centre()
        .filter(|_| mass > 0.0)?;
    let own = match direction {
        None => Matrix3::identity() * (mass * RADIUS.powi(2)),
        Some(axis) => {
            let moment = axis.dot(&(about * axis));
            if moment <= 0.0 {
                return None;
            }
            let along = axis * axis.transpose();
            (along + (Matrix3::identity() - along) * ACROSS) * moment
        }
    };
    Some(SpatialInertia::from_centre(mass, centre, own))
}

#[cfg(test)]
#[path = "bodies_test.rs"]
mod tests;
