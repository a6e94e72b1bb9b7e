//! Sound recordings with coarse columns, and faults in them.

use core::f64::consts::TAU as TURN;

use crate::faults::tests::*;

/// A joint that swings by five harmonics.
struct Swing {
    /// Frequency of the first, rad/s.
    base: f64,
    /// Size of each, rad, and its phase.
    waves: [[f64; 2]; 5],
    /// Inertia, weight, viscous and Coulomb friction.
    truth: [f64; 4],
}

impl Swing {
    /// Returns position and torque at time `t`.
    fn at(&self, t: f64) -> [f64; 2] {
        let mut motion = [0.0; 3];
        for (k, [size, phase]) in self.waves.iter().enumerate() {
            let w = self.base * (k + 1) as f64;
            let (sin, cos) = (w * t + phase).sin_cos();
            for (to, own) in motion.iter_mut().zip([sin, w * cos, -w * w * sin]) {
                *to += size * own;
            }
        }
        let [q, qd, qdd] = motion;
        let [inertia, weight, viscous, coulomb] = self.truth;
        [
            q,
            inertia * qdd + weight * q.cos() + viscous * qd + coulomb * qd.signum(),
        ]
    }
}

/// Writes a recording of `seconds` at `rate` and reads it as the commands do.
fn recorded(
    robot: &Robot,
    (seconds, rate): (f64, f64),
    mut row: impl FnMut(f64) -> [f64; 2],
) -> Vec<DataFault> {
    let mut text = String::from("t,q1,tau1\n");
    for k in 0..(seconds * rate) as usize {
        let t = k as f64 / rate;
        let [q, tau] = row(t);
        text += &format!("{t},{q},{tau}\n");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("coarse.csv");
    std::fs::write(&path, text).unwrap();
    let source = Source::open_with(&path, robot, EffortNeed::Optional).unwrap();
    let found = faults_at_start(robot, &source, 100_000).unwrap();
    for fault in &found {
        println!("{} {}: {}", fault.kind, fault.certain, fault.text);
    }
    found
}

fn rounded(value: f64, step: f64) -> f64 {
    (value / step).round() * step
}

/// All rows of one direction are at the highest step of the torque: what the others predict there is not known.
#[test]
fn friction_in_coarse_steps_is_not_cut() {
    let mut robot = text("one-link.toml", template("one-link").unwrap());
    // The axis stands upright.
    robot.joints[0].alpha = 0.0;
    for (phase, rate) in [(0.3, 50.0), (1.1, 200.0), (2.0, 50.0)] {
        let swing = Swing {
            base: 0.02 * TURN,
            waves: [
                [0.2, phase],
                [0.12, 2.0 * phase],
                [0.1, 0.5],
                [0.05, 3.0],
                [0.04, phase],
            ],
            truth: [0.17, 0.0, 0.3, 1.35],
        };
        let coarse = |t: f64| {
            let [q, tau] = swing.at(t);
            [rounded(q, TURN / 4096.0), rounded(tau, 0.1)]
        };
        assert_eq!(recorded(&robot, (60.0, rate), coarse), [], "{phase} {rate}");
        // A limit below the torque that gravity needs is one.
        let heavy = Swing {
            base: 0.1 * TURN,
            waves: swing.waves.map(|[size, phase]| [3.0 * size, phase]),
            truth: [0.17, 2.9, 0.3, 0.4],
        };
        let level = text("one-link.toml", template("one-link").unwrap());
        let cut = |t: f64| {
            let [q, tau] = heavy.at(t);
            [q, rounded(tau, 0.1).clamp(-2.6, 2.6)]
        };
        let found = recorded(&level, (60.0, 200.0), cut);
        let kinds: Vec<&str> = found.iter().map(|fault| fault.kind.as_str()).collect();
        assert_eq!(kinds, ["saturation"]);
    }
}
