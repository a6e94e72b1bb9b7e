//! What the program makes itself: descriptions whose own simulation, with ordinary noise, must show nothing that they lack.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use super::outcome::Verdict;
use super::{Diagnosis, Options, diagnose};
use crate::data::{Block, JointColumns};
use crate::excite::{self, Noise, design, replay};
use crate::prepare::{InMemory, Recording};
use crate::robot::{EDDA_TEMPLATE, IRP6_TEMPLATE, Robot, TX40};

/// A six-joint arm of a metre's reach (docs/excitation.md).
const UR10E: &str = include_str!("../../../docs/excitation/ur10e.toml");

/// A motion, how often it is sampled, and what noise is in it.
struct Recorded {
    /// Hz
    rate: f64,
    /// Period of the slowest harmonic, s.
    period: f64,
    /// rad or m, and N·m or N.
    noise: [f64; 2],
}

impl Recorded {
    /// One recording for each of the seeds of motion and noise.
    fn of(&self, robot: &Robot, seeds: [u64; 2]) -> InMemory {
        let options = excite::Options {
            period: Some(self.period),
            periods: (18.0 / self.period).ceil() as u16,
            ramp: Some(0.5 * self.period),
            starts: 2,
            seed: seeds[0],
            ..excite::Options::default()
        };
        let motion = design(robot, &options, |_, _| ()).unwrap();
        let reference = motion.file.sampled(self.rate).unwrap();
        let [position, torque] = self.noise;
        let noise = Noise {
            position,
            velocity: 0.0,
            torque,
        };
        let made = replay(robot, &reference, noise, seeds[1], |_, _| ()).unwrap();
        let joints = (made.motion.q.into_iter().zip(made.motion.tau))
            .map(|(q, tau)| JointColumns {
                q,
                tau,
                ..JointColumns::default()
            })
            .collect::<Vec<_>>();
        InMemory {
            label: format!("motion {}", seeds[0]),
            blocks: vec![Block {
                t: (0..joints[0].q.len())
                    .map(|k| k as f64 / self.rate)
                    .collect(),
                joints,
                first_line: 2,
                ..Block::default()
            }],
        }
    }

    fn diagnosed(&self, robot: &Robot) -> Diagnosis {
        let [training, holdout] = [[1, 1], [2, 2]].map(|seeds| self.of(robot, seeds));
        diagnose(
            robot,
            &[&training as &dyn Recording],
            &[&holdout as &dyn Recording],
            &Options::default(),
            &mut |_| (),
        )
        .unwrap()
        .0
    }
}

fn read(text: &str) -> Robot {
    Robot::from_toml(text, Path::new("arm.toml")).unwrap()
}

/// Checks that nothing is missing and no torque is said to be recorded at another time than it acts.
fn lacks_nothing(name: &str, robot: &Robot, recorded: &Recorded) -> Diagnosis {
    let found = recorded.diagnosed(robot);
    println!("{name}: {:?}, leads {:?}", found.verdict, found.torque_lead);
    for w in &found.waterfall {
        println!(
            "  {}: {:?} hold-out {:?}, floor {}",
            w.joint, w.train, w.holdout, w.holdout_floor
        );
    }
    assert_eq!(
        found.verdict,
        Verdict::NothingMissing,
        "{name}: {:#?}",
        found.words
    );
    found
}

/// rad or m, and N·m or N.
const ORDINARY: [f64; 2] = [1e-5, 0.1];

#[test]
fn a_description_lacks_nothing_of_its_own_simulation() {
    for (name, text, period) in [
        ("edda", EDDA_TEMPLATE, 3.0),
        ("ur10e", UR10E, 6.0),
        ("irp6", IRP6_TEMPLATE, 8.0),
        ("tx40", TX40, 6.0),
    ] {
        let recorded = Recorded {
            rate: 500.0,
            period,
            noise: ORDINARY,
        };
        lacks_nothing(name, &read(text), &recorded);
    }
}

/// The filtered M(q)·q̈ is not M(q)·q̈ of the filtered position: harmonics of it lie about the cut-off that this noise asks for.
#[test]
fn a_fast_arm_is_left_no_more_than_noise_by_its_exact_description() {
    let mut robot = read(UR10E);
    for limits in robot.joints.iter_mut().filter_map(|j| j.limits.as_mut()) {
        limits.position = [-6.28, 6.28];
        limits.velocity = 3.15;
        limits.acceleration = None;
    }
    let recorded = Recorded {
        rate: 1000.0,
        period: 3.0,
        noise: ORDINARY,
    };
    let found = lacks_nothing("ur10e, fast", &robot, &recorded);
    let treatment = found.treatment.unwrap();
    assert!(treatment.links_cutoff.is_some(), "{treatment:?}");
    // White noise of the torque in the band; that of the acceleration comes to as much at the shoulder.
    let noise = ORDINARY[1] * (2.0 * treatment.band / treatment.sample_rate).sqrt();
    for w in &found.waterfall {
        assert!(w.holdout[0] < 2.5 * noise, "{w:?}, noise {noise}");
    }
}

/// A motor that turns back while its joints move has friction of no known sign, which looked like a lead and like a touch.
#[test]
fn coupled_drives_without_noise_show_no_fault() {
    let recorded = Recorded {
        rate: 500.0,
        period: 8.0,
        noise: [0.0; 2],
    };
    let found = lacks_nothing("irp6 without noise", &read(IRP6_TEMPLATE), &recorded);
    // The simulation records a torque where it acts.
    for lead in &found.torque_lead {
        assert!(lead * recorded.rate < 0.2, "{:?}", found.torque_lead);
    }
}
