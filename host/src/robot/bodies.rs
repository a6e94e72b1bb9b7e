//! Inertial values that no body has, said before they are used.
//!
//! They are not refused: identified values are often fixed up to combinations only, and what a link cannot show in its
//! motion is often left at zero. Judged is what the link's motion shows: of links that only slide the mass, of links that
//! turn about one direction the moment of inertia about it, of all others the whole inertia.

use nalgebra::{Matrix3, Vector3};

use super::dh::step;
use super::urdf::SpatialInertia;
use super::{JointKind, Original, Robot};
use crate::report::format_significant;

/// Axes closer to parallel than this turn a link about one direction, as the sine of the angle between them.
const PARALLEL: f64 = 1e-6;
/// Principal moments may break the triangle inequality by this share: what rounding to two or three digits does.
const ROUNDED: f64 = 0.02;

/// What of a link's inertia its motion shows.
enum Shown {
    Mass,
    About(Vector3<f64>),
    All,
}

impl Robot {
    /// One sentence for each link whose inertial values no body has, by joint and, where it was read from a URDF file, by link.
    pub fn implausible_bodies(&self, urdf: Option<&Original>) -> Vec<String> {
        (0..self.joints.len())
            .filter_map(|k| {
                let inertial = self.joints[k].inertial.as_ref()?;
                let why = strange(&SpatialInertia::of(inertial), &self.shown(k))?;
                let joint = &self.joints[k].name;
                let link = match urdf.and_then(|original| original.link(k)) {
                    Some(link) => format!("Link `{link}`, moved by joint `{joint}`,"),
                    None => format!("The link of joint `{joint}`"),
                };
                Some(format!(
                    "{link} {why}. No body is like that: `rig identify` takes a uniform block for what is known of it, a simulation takes it as it stands."
                ))
            })
            .collect()
    }

    /// Directions about which link `k` turns, all in frame k at zero position. Neighbouring axes keep their angle at
    /// every position, so that axes that are parallel here are so everywhere or have one between them that is not.
    fn shown(&self, k: usize) -> Shown {
        let mut direction: Option<Vector3<f64>> = None;
        for joint in &self.joints[..=k] {
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

/// What is strange about a body, as the rest of a sentence about its link; none where nothing is.
fn strange(body: &SpatialInertia, shown: &Shown) -> Option<String> {
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
    // Against what rounding leaves of the difference between both inertias.
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

#[cfg(test)]
#[path = "bodies_test.rs"]
mod tests;
