//! Two arms that everybody knows, and motions for them.
#![allow(dead_code)]

use std::f64::consts::FRAC_PI_2;

use rig_shared::multibody::{COLUMNS, Chain, JointGeometry, JointKind};
use rig_shared::scalar::Real;

/// An arm and what is known of it.
pub(crate) struct Arm {
    pub(crate) name: &'static str,
    pub(crate) geometry: Vec<JointGeometry>,
    pub(crate) parameters: Vec<[f64; COLUMNS]>,
}

pub(crate) const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

impl Arm {
    pub(crate) fn chain(&self) -> Chain<f64> {
        Chain::new(&self.geometry, GRAVITY).unwrap()
    }

    pub(crate) fn joints(&self) -> usize {
        self.geometry.len()
    }
}

fn revolute(&(alpha, a, d): &(f64, f64, f64)) -> JointGeometry {
    JointGeometry {
        kind: JointKind::Revolute,
        alpha,
        a,
        theta: 0.0,
        d,
    }
}

/// The parameters of a link from its mass, centre of mass, and inertia xx xy xz yy yz zz about that centre.
fn link(mass: f64, c: [f64; 3], at_centre: [f64; 6]) -> [f64; COLUMNS] {
    let [x, y, z] = c;
    let [xx, xy, xz, yy, yz, zz] = at_centre;
    [
        mass,
        mass * x,
        mass * y,
        mass * z,
        xx + mass * (y * y + z * z),
        xy - mass * x * y,
        xz - mass * x * z,
        yy + mass * (x * x + z * z),
        yz - mass * y * z,
        zz + mass * (x * x + y * y),
        0.0,
        0.0,
        0.0,
        0.0,
    ]
}

/// UR5e: lengths, masses and centres of mass as Universal Robots publishes them ("Parameters for calculations of
/// kinematics and dynamics", article 45257), brought into modified Denavit–Hartenberg frames. The inertias, which the
/// maker does not publish, are representative: solid cylinders of the link's mass.
pub(crate) fn ur5e() -> Arm {
    let geometry = [
        (0.0, 0.0, 0.1625),
        (FRAC_PI_2, 0.0, 0.0),
        (0.0, -0.425, 0.0),
        (0.0, -0.3922, 0.1333),
        (FRAC_PI_2, 0.0, 0.0997),
        (-FRAC_PI_2, 0.0, 0.0996),
    ];
    // Length and axis (0 x, 2 z) of the cylinder, radius 0.06 m.
    let bodies = [
        (3.761, [0.0, -0.00193, -0.02561], 0.12, 2),
        (8.058, [-0.2125, 0.0, 0.11336], 0.425, 0),
        (2.846, [-0.2422, 0.0, 0.0265], 0.3922, 0),
        (1.37, [0.0, -0.01634, -0.0018], 0.12, 2),
        (1.3, [0.0, 0.01634, -0.0018], 0.12, 2),
        (0.365, [0.0, 0.0, -0.001159], 0.05, 2),
    ];
    let parameters = bodies
        .iter()
        .map(
            |&(mass, centre, length, axis): &(f64, [f64; 3], f64, usize)| {
                let radius: f64 = 0.06;
                let along = 0.5 * mass * radius.powi(2);
                let across = mass * (3.0 * radius.powi(2) + length.powi(2)) / 12.0;
                let mut inertia = [across, 0.0, 0.0, across, 0.0, across];
                inertia[[0, 3, 5][axis]] = along;
                link(mass, centre, inertia)
            },
        )
        .collect();
    Arm {
        name: "UR5e",
        geometry: geometry.iter().map(revolute).collect(),
        parameters,
    }
}

/// Franka Emika Panda: lengths from the maker's documentation ("Robot and interface specifications"), inertial
/// parameters identified by Gaz, Cognetti, Oliva, Robuffo Giordano & De Luca (2019), IEEE Robotics and Automation
/// Letters 4(4), 4147–4154, as franka_description lists them.
pub(crate) fn panda() -> Arm {
    let geometry = [
        (0.0, 0.0, 0.333),
        (-FRAC_PI_2, 0.0, 0.0),
        (FRAC_PI_2, 0.0, 0.316),
        (FRAC_PI_2, 0.0825, 0.0),
        (-FRAC_PI_2, -0.0825, 0.384),
        (FRAC_PI_2, 0.0, 0.0),
        (FRAC_PI_2, 0.088, 0.0),
    ];
    let parameters = vec![
        link(
            4.970684,
            [0.003875, 0.002081, -0.04762],
            [0.70337, -0.000139, 0.006772, 0.70661, 0.019169, 0.009117],
        ),
        link(
            0.646926,
            [-0.003141, -0.02872, 0.003495],
            [0.007962, -0.003925, 0.010254, 0.02811, 0.000704, 0.025995],
        ),
        link(
            3.228604,
            [0.027518, 0.039252, -0.066502],
            [0.037242, -0.004761, -0.011396, 0.036155, -0.012805, 0.01083],
        ),
        link(
            3.587895,
            [-0.05317, 0.104419, 0.027454],
            [0.025853, 0.007796, -0.001332, 0.019552, 0.008641, 0.028323],
        ),
        link(
            1.225946,
            [-0.011953, 0.041065, -0.038437],
            [0.035549, -0.002117, -0.004037, 0.029474, 0.000229, 0.008627],
        ),
        link(
            1.666555,
            [0.060149, -0.014117, -0.010517],
            [0.001964, 0.000109, -0.001158, 0.004354, 0.000341, 0.005433],
        ),
        link(
            0.735522,
            [0.010517, -0.004252, 0.061597],
            [
                0.012516, -0.000428, -0.001196, 0.010027, -0.000741, 0.004815,
            ],
        ),
    ];
    Arm {
        name: "Panda",
        geometry: geometry.iter().map(revolute).collect(),
        parameters,
    }
}

/// Positions, velocities and accelerations, one column a joint: three sines each, within ±2 rad.
pub(crate) fn motion(joints: usize, samples: usize) -> [Vec<Vec<f64>>; 3] {
    let mut signals = [(); 3].map(|()| vec![vec![0.0; samples]; joints]);
    for j in 0..joints {
        for k in 0..samples {
            let t = k as f64 * 0.01;
            for (m, amplitude) in [1.2, 0.5, 0.2].iter().enumerate() {
                let w = 0.9 + 0.37 * j as f64 + 2.3 * m as f64;
                let (s, c) = (w * t + (j * m) as f64).sin_cos();
                signals[0][j][k] += amplitude * s;
                signals[1][j][k] += amplitude * w * c;
                signals[2][j][k] -= amplitude * w * w * s;
            }
        }
    }
    signals
}

/// The same motion in another number.
pub(crate) fn rounded<T: Real>(columns: Vec<Vec<f64>>) -> Vec<Vec<T>> {
    (columns.into_iter())
        .map(|column| column.into_iter().map(T::from_f64).collect())
        .collect()
}
