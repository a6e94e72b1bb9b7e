//! Masses and inertias of links.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::finding::Audit;
use crate::robot::bodies::{Shown, implausibility};
use crate::robot::error::{Place, RobotError};
use crate::robot::urdf::reader::{Reader, Xml, child};
use crate::robot::urdf::spatial::SpatialInertia;
use crate::robot::urdf::tree::{Motion, Tree};
use rig_output::format_significant;

/// Heaviest link that no arm has, kg. The links of the largest industrial arms have up to 1000 kg.
const HEAVIEST: f64 = 2000.0;
/// Lightest mass of a link that is not called a placeholder, kg.
const LIGHTEST: f64 = 1e-3;
/// Number of links with the same values from which on they are called copies. Two fingers are alike in most grippers.
const COPIES: usize = 3;

/// The `<inertial>` of a link.
pub(super) struct LinkBody<'a> {
    pub link: &'a str,
    pub place: Place,
    pub mass: f64,
    /// In the frame of the link.
    pub centre: Vector3<f64>,
    /// About the centre, in the directions of the link's frame.
    pub inertia: Matrix3<f64>,
    /// The six values as they stand in the file.
    values: [f64; 6],
}

/// Reads the inertial values of all links, whatever they are.
///
/// # Errors
/// An element is missing or no number.
pub(super) fn bodies<'a>(
    reader: &Reader<'a>,
    tree: &Tree<'a>,
) -> Result<Vec<LinkBody<'a>>, RobotError> {
    let mut bodies = Vec::new();
    for &(link, node) in &tree.links {
        let Some(inertial) = child(node, "inertial") else {
            continue;
        };
        let part = |tag: &str| -> Result<Xml<'a>, RobotError> {
            child(inertial, tag).ok_or_else(|| {
                reader.error(
                    inertial,
                    format!(
                        "<inertial> of link `{link}` has no <{tag}>; it needs <mass> and <inertia>"
                    ),
                )
            })
        };
        let mass = reader.number(part("mass")?, "value")?;
        let moments = part("inertia")?;
        let mut values = [0.0; 6];
        for (value, key) in values
            .iter_mut()
            .zip(["ixx", "ixy", "ixz", "iyy", "iyz", "izz"])
        {
            *value = reader.number(moments, key)?;
        }
        let [xx, xy, xz, yy, yz, zz] = values;
        let pose = reader.origin(inertial)?;
        let turn = pose.rotation.to_rotation_matrix();
        bodies.push(LinkBody {
            link,
            place: reader.place(inertial),
            mass,
            centre: pose.translation.vector,
            inertia: turn * Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * turn.transpose(),
            values,
        });
    }
    Ok(bodies)
}

/// Checks the masses: below zero, zero, far from those of any link.
pub(super) fn masses(audit: &mut Audit, bodies: &[LinkBody<'_>]) {
    audit.checked("mass", "masses of links", bodies.len());
    for body in bodies {
        let (link, m) = (body.link, body.mass);
        let number = |value: f64| format_significant(value, 4);
        let why = if m < 0.0 {
            "no body has a mass below zero".to_owned()
        } else if m == 0.0 && body.inertia != Matrix3::zeros() {
            "a body without a mass has no inertia either".to_owned()
        } else if m > HEAVIEST {
            format!(
                "no link of an arm is that heavy; were this g, it would be {} kg",
                number(m / 1000.0)
            )
        } else if m > 0.0 && m < LIGHTEST {
            "a link below 1 g is a placeholder in most files; remove its <inertial> or give its mass in kg".to_owned()
        } else {
            continue;
        };
        let sentence = format!("the mass of link `{link}` is {} kg, but {why}", number(m));
        audit.find("mass", link, body.place, sentence);
    }
}

/// Checks that the moments of inertia are those of a body: symmetric positive definite, none above the sum of the others.
pub(super) fn moments(audit: &mut Audit, bodies: &[LinkBody<'_>]) {
    let with_mass = || bodies.iter().filter(|body| body.mass > 0.0);
    audit.checked("inertia", "inertias of links", with_mass().count());
    for body in with_mass() {
        let whole = SpatialInertia::from_centre(body.mass, Vector3::zeros(), body.inertia);
        let name = body.link;
        if let Some(why) = implausibility(&whole, &Shown::All) {
            audit.find(
                "inertia",
                name,
                body.place,
                format!("link `{name}` {why}, which no body has"),
            );
        }
    }
}

/// Checks that every link that moves has a mass.
pub(super) fn massless(
    audit: &mut Audit,
    tree: &Tree<'_>,
    bodies: &[LinkBody<'_>],
    reader: &Reader<'_>,
) {
    let moved = (tree.joints.iter()).filter(|joint| joint.motion != Motion::Fixed);
    audit.checked("no-mass", "moved links for a mass", moved.clone().count());
    for joint in moved {
        let mut pending = vec![joint.child];
        let mut heavy = false;
        while let Some(link) = pending.pop() {
            heavy |= bodies
                .iter()
                .any(|body| body.link == link && body.mass > 0.0);
            let fixed = tree.below(link).map(|own| &tree.joints[own]);
            pending.extend(
                fixed
                    .filter(|own| own.motion == Motion::Fixed)
                    .map(|own| own.child),
            );
        }
        if !heavy {
            let sentence = format!(
                "link `{}`, which joint `{}` moves, has no mass, nor has anything fixed to it; MuJoCo and Gazebo refuse it or leave it out",
                joint.child, joint.name
            );
            let place = (tree.by_name.get(joint.child))
                .map_or_else(|| reader.place(joint.node), |node| reader.place(*node));
            audit.find("no-mass", joint.child, place, sentence);
        }
    }
}

/// Checks for links with the same mass and inertia, which are placeholders in most files.
pub(super) fn copies(audit: &mut Audit, bodies: &[LinkBody<'_>]) {
    audit.checked("copy", "inertias for copies", bodies.len());
    let mut alike: BTreeMap<Vec<u64>, Vec<&LinkBody<'_>>> = BTreeMap::new();
    for body in bodies.iter().filter(|body| body.mass != 0.0) {
        let values = std::iter::once(&body.mass).chain(&body.values);
        // Adding zero makes −0 equal to 0.
        let key = values.map(|value| (value + 0.0).to_bits()).collect();
        alike.entry(key).or_default().push(body);
    }
    for group in alike.values() {
        let first = group[0];
        let [xx, xy, xz, yy, yz, zz] = first.values;
        let is_ball = xx == yy && yy == zz && [xy, xz, yz] == [0.0; 3];
        if group.len() < COPIES && !(is_ball && group.len() > 1) {
            continue;
        }
        let names: Vec<String> = group.iter().map(|own| format!("`{}`", own.link)).collect();
        let sentence = format!(
            "links {} have the same mass {} kg and the same inertia (ixx {}); unless they are the same part, these are placeholders",
            rig_output::listed(&names),
            format_significant(first.mass, 4),
            format_significant(xx, 4)
        );
        audit.find("copy", first.link, first.place, sentence);
    }
}
