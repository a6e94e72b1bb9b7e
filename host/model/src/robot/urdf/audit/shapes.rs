//! Masses and inertias against the extent of the drawn shapes.
//!
//! Only boxes, cylinders and spheres have an extent in the file. A link with a mesh among its collision shapes is judged by
//! its visual shapes, and not at all if there is a mesh among them too.

use nalgebra::{Isometry3, Vector3};

use super::finding::Audit;
use super::links::LinkBody;
use crate::robot::error::RobotError;
use crate::robot::urdf::reader::{Reader, Xml, child};
use crate::robot::urdf::tree::Tree;
use rig_output::format_significant;

/// Density above that of any solid, kg/m³. Osmium, the densest element, has 22 600.
const DENSEST: f64 = 23e3;
/// Density below that of any part, kg/m³: a hollow part of its extent weighs more than the air in it, 1.2 kg/m³.
const LIGHTEST: f64 = 1.2;
/// Share of the extent by which values may exceed it: shapes are simplified.
const ROOM: f64 = 0.1;
/// Radius of gyration as a share of the extent's diagonal below which an inertia is far too small. A solid cube has 0.24,
/// a slender part about its long axis less, but not about the others.
const SLENDER: f64 = 0.02;

/// The extent of a link's shapes.
struct Extent {
    low: Vector3<f64>,
    high: Vector3<f64>,
    /// Sum of the volumes, m³. Overlaps count twice.
    volume: f64,
}

/// Half extents of a shape along its own axes, and its volume.
fn shape<'a>(
    reader: &Reader<'a>,
    geometry: Xml<'a>,
) -> Result<Option<(Vector3<f64>, f64)>, RobotError> {
    use std::f64::consts::PI;
    if let Some(node) = child(geometry, "box") {
        let size = reader
            .vector(node, "size")?
            .unwrap_or_else(Vector3::zeros)
            .abs();
        return Ok(Some((size / 2.0, size.product())));
    }
    if let Some(node) = child(geometry, "cylinder") {
        let (r, l) = (
            reader.number(node, "radius")?.abs(),
            reader.number(node, "length")?.abs(),
        );
        return Ok(Some((Vector3::new(r, r, l / 2.0), PI * r * r * l)));
    }
    if let Some(node) = child(geometry, "sphere") {
        let r = reader.number(node, "radius")?.abs();
        return Ok(Some((Vector3::repeat(r), 4.0 / 3.0 * PI * r.powi(3))));
    }
    Ok(None)
}

/// Returns the extent of the shapes in elements `tag` of a link; `None` without one, or with a mesh among them.
fn extent<'a>(reader: &Reader<'a>, link: Xml<'a>, tag: &str) -> Result<Option<Extent>, RobotError> {
    let mut all: Option<Extent> = None;
    for node in link.children().filter(|own| own.has_tag_name(tag)) {
        let Some(geometry) = child(node, "geometry") else {
            continue;
        };
        let Some((half, volume)) = shape(reader, geometry)? else {
            return Ok(None);
        };
        let pose: Isometry3<f64> = reader.origin(node)?;
        let half = pose.rotation.to_rotation_matrix().matrix().abs() * half;
        let centre = pose.translation.vector;
        let (low, high) = (centre - half, centre + half);
        all = Some(match all {
            None => Extent { low, high, volume },
            Some(own) => Extent {
                low: own.low.inf(&low),
                high: own.high.sup(&high),
                volume: own.volume + volume,
            },
        });
    }
    Ok(all.filter(|own| own.volume > 0.0))
}

/// Checks density, centre of mass and radius of gyration of every link that is drawn by boxes, cylinders or spheres.
///
/// # Errors
/// A shape has no numbers.
pub(super) fn shapes<'a>(
    audit: &mut Audit,
    reader: &Reader<'a>,
    tree: &Tree<'a>,
    bodies: &[LinkBody<'a>],
) -> Result<(), RobotError> {
    let mut count = 0;
    for body in bodies.iter().filter(|body| body.mass > 0.0) {
        let Some(&node) = tree.by_name.get(body.link) else {
            continue;
        };
        let drawn = match extent(reader, node, "collision")? {
            Some(drawn) => Some(drawn),
            None => extent(reader, node, "visual")?,
        };
        if let Some(drawn) = drawn {
            count += 1;
            density(audit, body, &drawn);
            centre(audit, body, &drawn);
            gyration(audit, body, &drawn);
        }
    }
    audit.checked(
        "shape",
        "links against their boxes, cylinders and spheres",
        count,
    );
    if count < bodies.len() {
        audit.unchecked.push(format!(
            "{} of {} links with an <inertial> have meshes or no shapes, so their density and extent were not checked.",
            bodies.len() - count,
            bodies.len()
        ));
    }
    Ok(())
}

fn density(audit: &mut Audit, body: &LinkBody<'_>, drawn: &Extent) {
    let number = |value: f64| format_significant(value, 3);
    let (name, dense) = (body.link, body.mass / drawn.volume);
    let thin = body.mass / (drawn.high - drawn.low).product();
    let (value, why) = if dense > DENSEST {
        let grams = format!("were the mass in g, it would be {}", number(dense / 1e3));
        (
            dense,
            format!("no solid is denser than {DENSEST:.0} kg/m³; {grams}"),
        )
    } else if thin < LIGHTEST {
        let millimetres = format!("were the shapes in mm, it would be {}", number(thin * 1e9));
        (thin, format!("that is less than air; {millimetres}"))
    } else {
        return;
    };
    let sentence = format!(
        "link `{name}` has {} kg within its shapes, a density of {} kg/m³, but {why}",
        format_significant(body.mass, 4),
        number(value)
    );
    audit.find("density", name, body.place, sentence);
}

fn centre(audit: &mut Audit, body: &LinkBody<'_>, drawn: &Extent) {
    let room = (drawn.high - drawn.low).norm() * ROOM;
    let beyond =
        (0..3).map(|k| (drawn.low[k] - body.centre[k]).max(body.centre[k] - drawn.high[k]));
    let most = beyond.fold(0.0f64, f64::max);
    if most > room {
        let sentence = format!(
            "the centre of mass of link `{}` lies {} m outside of its shapes, which are {} m long",
            body.link,
            format_significant(most, 3),
            format_significant((drawn.high - drawn.low).norm(), 3)
        );
        audit.find("centre", body.link, body.place, sentence);
    }
}

fn gyration(audit: &mut Audit, body: &LinkBody<'_>, drawn: &Extent) {
    let diagonal = (drawn.high - drawn.low).norm();
    let largest = body.inertia.symmetric_eigenvalues().max();
    let radius = (largest.max(0.0) / body.mass).sqrt();
    let number = |value: f64| format_significant(value, 3);
    // No part of the body is farther from its centre than half the diagonal, if the centre is that of the extent.
    let why = if radius > diagonal * (0.5 + ROOM) {
        "it is larger than for any body inside of that extent"
    } else if radius < diagonal * SLENDER {
        "it is that of a far smaller body; is the inertia in another unit, or a placeholder?"
    } else {
        return;
    };
    let sentence = format!(
        "the radius of gyration of link `{}` is {} m and its shapes are {} m long, but {why}",
        body.link,
        number(radius),
        number(diagonal)
    );
    audit.find("gyration", body.link, body.place, sentence);
}
