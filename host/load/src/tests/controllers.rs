//! The numbers for robot controllers, taken apart as their manuals define them.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::made::{Moving, Sensor, recorded, tool};
use super::sensor::{NO_FLAW, tx40};
use crate::{LoadIdentification, LoadOptions, controller_numbers, identify_load};

/// Returns all numbers of a text; letters end one.
fn numbers(text: &str) -> Vec<f64> {
    text.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'))
        .filter_map(|word| word.parse().ok())
        .collect()
}

fn near(a: Matrix3<f64>, b: Matrix3<f64>) -> bool {
    (a - b).norm() < 1e-4 * b.norm()
}

/// The tool's principal axes are none of the flange's, so that an exchanged element, angle or sign shows.
#[test]
fn each_maker_s_numbers_are_the_identified_body() {
    let moving = Moving::new(tx40(), 0.7, 5);
    let motion = recorded(
        &moving,
        &tool(),
        &Sensor::default(),
        [40.0, 200.0],
        1,
        NO_FLAW,
    );
    let load: LoadIdentification =
        identify_load(&moving.robot, &[&motion], &[], &LoadOptions::default()).unwrap();
    let (centre, inertia) = load.body.about_centre().unwrap();
    let given = controller_numbers(&load).unwrap();
    let is_centre = |list: &[f64], unit: f64| {
        (Vector3::from_column_slice(list) * unit - centre).norm() < 1e-5 * centre.norm()
    };

    let (_, list) = given.universal_robots.split_once('(').unwrap();
    let [mass, x, y, z, xx, yy, zz, xy, xz, yz] = numbers(list)[..] else {
        panic!("{list}")
    };
    assert!((mass - load.body.mass).abs() < 1e-5 && is_centre(&[x, y, z], 1.0));
    assert!(near(
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
        inertia
    ));

    let [mass, x, y, z, a, b, c, jx, jy, jz] = numbers(&given.kuka)[..] else {
        panic!("{}", given.kuka)
    };
    assert!((mass - load.body.mass).abs() < 1e-5 && is_centre(&[x, y, z], 1e-3));
    // A turns about z, B about the new y, C about the new x.
    let [a, b, c] = [a, b, c].map(f64::to_radians);
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), a)
        * Rotation3::from_axis_angle(&Vector3::y_axis(), b)
        * Rotation3::from_axis_angle(&Vector3::x_axis(), c);
    let moments = Matrix3::from_diagonal(&Vector3::new(jx, jy, jz));
    assert!(
        near(turn * moments * turn.inverse(), inertia),
        "{}",
        given.kuka
    );

    let (mass, rest) = given.franka.split_once(',').unwrap();
    let (place, moments) = rest.split_once("load_inertia").unwrap();
    assert!((numbers(mass)[0] - load.body.mass).abs() < 1e-5);
    let place = place.split_once('[').unwrap().1;
    assert!(is_centre(&numbers(place), 1.0), "{place}");
    assert!(near(Matrix3::from_column_slice(&numbers(moments)), inertia));
}
