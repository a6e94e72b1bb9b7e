//! Bodies whose inertia a textbook gives in closed form: a slender bar and a hollow cylinder.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::made::{Moving, Points, Sensor, recorded};
use super::sensor::{NO_FLAW, tx40};
use crate::{LoadOptions, identify_load};

/// A body by its mass, kg, centre of mass, m, principal moments about it, kg·m², and their axes.
struct Solid {
    mass: f64,
    centre: Vector3<f64>,
    moments: [f64; 3],
    axes: Rotation3<f64>,
    points: Points,
}

impl Solid {
    /// Places mass points of the body's own frame.
    fn new(
        mass: f64,
        moments: [f64; 3],
        own: &[[f64; 3]],
        centre: [f64; 3],
        angles: [f64; 3],
    ) -> Self {
        let axes = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
        let centre = Vector3::from(centre);
        let each = mass / own.len() as f64;
        let place = |p: &[f64; 3]| (each, (axes * Vector3::from(*p) + centre).into());
        Self {
            mass,
            centre,
            moments,
            axes,
            points: own.iter().map(place).collect(),
        }
    }

    /// A bar of this length along its z: m·l²/12 across. Two points at Gauss's abscissae have its moments up to the third.
    fn bar(mass: f64, length: f64, centre: [f64; 3], angles: [f64; 3]) -> Self {
        let across = mass * length * length / 12.0;
        let away = 0.5 * length / 3f64.sqrt();
        let own = [[0.0, 0.0, -away], [0.0, 0.0, away]];
        Self::new(mass, [across, across, 0.0], &own, centre, angles)
    }

    /// A hollow cylinder with these radii and height along its z: m·(r² + R²)/2 about z, m·(3·(r² + R²) + h²)/12 across.
    fn cylinder(
        mass: f64,
        radii: [f64; 2],
        height: f64,
        centre: [f64; 3],
        angles: [f64; 3],
    ) -> Self {
        let squares = radii[0] * radii[0] + radii[1] * radii[1];
        let across = mass * (3.0 * squares + height * height) / 12.0;
        let (radius, away) = ((0.5 * squares).sqrt(), 0.5 * height / 3f64.sqrt());
        let own: Vec<[f64; 3]> = (0..10)
            .map(|k| {
                let (sin, cos) = (TAU * f64::from(k / 2) / 5.0).sin_cos();
                let z = if k % 2 == 0 { away } else { -away };
                [radius * cos, radius * sin, z]
            })
            .collect();
        Self::new(
            mass,
            [across, across, 0.5 * mass * squares],
            &own,
            centre,
            angles,
        )
    }

    fn inertia(&self) -> Matrix3<f64> {
        let moments = Matrix3::from_diagonal(&Vector3::from(self.moments));
        self.axes * moments * self.axes.inverse()
    }
}

#[test]
fn a_bar_and_a_hollow_cylinder_have_the_inertia_of_the_textbook() {
    let solids = [
        Solid::bar(1.6, 0.4, [0.03, -0.02, 0.12], [0.4, -0.3, 0.9]),
        Solid::cylinder(
            2.4,
            [0.03, 0.06],
            0.15,
            [-0.02, 0.04, 0.1],
            [-0.5, 0.7, 0.2],
        ),
        Solid::cylinder(0.9, [0.0, 0.05], 0.3, [0.0, 0.0, 0.2], [1.2, 0.1, -0.4]),
    ];
    for (k, solid) in (0..).zip(&solids) {
        let moving = Moving::new(tx40(), 0.7, 20 + k);
        let sensor = Sensor {
            noise: [0.1, 0.01],
            ..Sensor::default()
        };
        let motion = recorded(&moving, &solid.points, &sensor, [40.0, 200.0], k, NO_FLAW);
        let load = identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default()).unwrap();
        assert!((load.mass.value - solid.mass).abs() < 4.0 * load.mass.std);
        for (found, truth) in load.centre.iter().zip(solid.centre.iter()) {
            assert!(
                (found.value - truth).abs() < 4.0 * found.std,
                "{k}: {found:?}, truth {truth}"
            );
        }
        let truth = solid.inertia();
        let found = &load.inertia;
        let elements = [
            truth.m11, truth.m12, truth.m13, truth.m22, truth.m23, truth.m33,
        ];
        for (found, truth) in found.iter().zip(elements) {
            assert!(
                (found.value - truth).abs() < 4.0 * found.std,
                "{k}: {found:?}, truth {truth}"
            );
        }
        // The deviations are small against the body, so that the test could fail.
        assert!(
            found.iter().all(|own| own.std < 0.05 * truth.norm()),
            "{k}: {found:?}"
        );
    }
}
