//! The IRp-6 of `rig init irp6` as numbers. Written by the test of this crate (`RIG_WRITE_DOCS=1 cargo test -p
//! rig-dynamics`), which compares it with the description. Do not edit it.
#![allow(clippy::excessive_precision, clippy::approx_constant, clippy::unreadable_literal)]
#![cfg_attr(rustfmt, rustfmt_skip)]

use rig_shared::multibody::{COLUMNS, JointGeometry, JointKind};
use rig_shared::transmission::{DriveMap, MOTOR_COLUMNS, ScrewMap};

/// Number of joints.
pub const JOINTS: usize = 5;

/// Gravity in the base frame, m/s².
pub const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

/// Frames of the joints.
pub const GEOMETRY: [JointGeometry; JOINTS] = [
    JointGeometry { kind: JointKind::Revolute, alpha: 0.0, a: 0.0, theta: 0.0, d: 0.7 },
    JointGeometry { kind: JointKind::Revolute, alpha: -1.5707963267948966, a: 0.0, theta: 0.0, d: 0.0 },
    JointGeometry { kind: JointKind::Revolute, alpha: 0.0, a: 0.455, theta: 1.5707963267948966, d: 0.0 },
    JointGeometry { kind: JointKind::Revolute, alpha: 0.0, a: 0.67, theta: 1.5707963267948966, d: 0.0 },
    JointGeometry { kind: JointKind::Revolute, alpha: 1.5707963267948966, a: 0.0, theta: 0.0, d: 0.19 },
];

/// Parameters of links and joints, in the order of `COLUMN_NAMES`.
pub const PARAMETERS: [[f64; COLUMNS]; JOINTS] = [
    [60.0, 0.0, 0.0, -9.0, 2.55, 0.0, 0.0, 2.55, 0.0, 1.0, 4.9928, 11.4892, 13.48, 0.0],
    [30.0, 6.0, 0.6, 0.0, 0.162, -0.12, 0.0, 1.95, 0.0, 1.962, 1.6384, 8.2768, 6.0, 0.0],
    [25.0, 6.25, 0.0, 0.0, 0.1, 0.0, 0.0, 2.5125, 0.0, 2.5125, 1.6384, 7.2768, 5.0, 0.0],
    [5.0, 0.0, -0.25, 0.0, 0.0325, 0.0, 0.0, 0.015, 0.0, 0.0325, 0.8192, 3.8768000000000002, 1.0, 0.0],
    [2.0, 0.0, 0.0, -0.08, 0.0072, 0.0, 0.0, 0.0072, 0.0, 0.002, 0.0, 0.989824, 0.6, 0.0],
];

/// Parameters of the motors, in the order of `MOTOR_COLUMN_NAMES`.
pub const MOTORS: [[f64; MOTOR_COLUMNS]; JOINTS] = [
    [0.0, 0.0, 0.0],
    [0.0002, 0.0003, 0.08],
    [0.0002, 0.0003, 0.08],
    [0.8192, 1.6384, 3.84],
    [0.294912, 0.589824, 2.304],
];

/// Motors as functions of the joints.
pub const DRIVES: [DriveMap<'static>; JOINTS] = [
    DriveMap { ratios: &[-158.0, 0.0, 0.0, 0.0, 0.0], screw: None, zero: 0.0, joint_inertia: false },
    DriveMap { ratios: &[0.0, 0.0, 0.0, 0.0, 0.0], screw: Some(ScrewMap { lead: 0.005, constant: 0.07789525, cosine: 0.04410000000000001, sine: 0.05124, weights: &[0.0, 1.0, 0.0, 0.0, 0.0], offset: -1.309181438 }), zero: -276.884143, joint_inertia: false },
    DriveMap { ratios: &[0.0, 0.0, 0.0, 0.0, 0.0], screw: Some(ScrewMap { lead: 0.005, constant: 0.07789525, cosine: 0.04410000000000001, sine: 0.05124, weights: &[0.0, 1.0, 1.0, 0.0, 0.0], offset: -1.570796327 }), zero: -231.013623, joint_inertia: false },
    DriveMap { ratios: &[0.0, -128.0, -128.0, -128.0, 0.0], screw: None, zero: -201.06193, joint_inertia: false },
    DriveMap { ratios: &[0.0, -128.0, -128.0, -128.0, -76.8], screw: None, zero: -201.06193, joint_inertia: false },
];

/// Lowest and highest position of each joint, rad.
pub const RANGES: [[f32; 2]; JOINTS] = [
    [-2.967, 2.967],
    [-2.269, -0.873],
    [-1.135, 1.397],
    [-1.134, 0.873],
    [-2.9, 2.9],
];
