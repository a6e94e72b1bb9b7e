//! A pendulum of a few lines, of another making than the emulated rig: what a user's own simulator hands over.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rig_shared::effects::Kind;

use crate::outcome::Verdict;
use crate::{Diagnosis, Options};
use rig_data::prepare::{InMemory, Recording};
use rig_data::{Block, JointColumns};
use rig_model::robot::Robot;

mod beyond;

const MASS: f64 = 1.2;
const LENGTH: f64 = 0.3;
const INERTIA: f64 = 0.138;
const VISCOUS: f64 = 0.15;
const COULOMB: f64 = 0.4;

/// Integration step, s, and steps a sample.
const STEP: f64 = 1e-4;
const SAMPLE: usize = 20;

/// What is recorded of it.
#[derive(Clone, Copy)]
struct Pendulum {
    /// Loss of the torque per square of what is commanded, 1/(N·m)².
    saturation: f64,
    /// Stiffness of a spring that grows with the square of the angle, N·m/rad³.
    stiffening: f64,
    /// Dry friction more than in motion at rest, N·m; a third of it is gone at 0.2 rad/s.
    breakaway: f64,
    /// Dry friction that holds what rests, as much more at rest and gone with this power of this speed, N·m, rad/s and 1; none where
    /// it only turns with the velocity.
    sticking: Option<[f64; 3]>,
    /// A magnetic brake's torque per velocity, and the speed from which on it falls, N·m·s/rad and rad/s.
    brake: [f64; 2],
    /// Share of the inertia that goes and comes twice a turn, as of a crank.
    swinging: f64,
    /// A straight spring about a place, N·m/rad and rad.
    spring: [f64; 2],
    /// Noise of position and torque, rad and N·m.
    noise: [f64; 2],
    /// Angles of the motion are so many times larger.
    reach: f64,
    /// Its fundamental, Hz.
    slowest: f64,
}

/// Nothing is wrong with it.
const PLAIN: Pendulum = Pendulum {
    saturation: 0.0,
    stiffening: 0.0,
    breakaway: 0.0,
    sticking: None,
    brake: [0.0, 1.0],
    swinging: 0.0,
    spring: [0.0; 2],
    noise: [5e-6, 0.03],
    reach: 1.0,
    slowest: 0.2,
};

impl Pendulum {
    /// A motion by the seed `motion`, its noise by `seed`.
    fn recorded(&self, label: &str, motion: u64, seed: u64) -> InMemory {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(motion);
        let harmonics = [1.0, 2.0, 3.0, 5.0, 7.0].map(|k| {
            let amplitude = rng.random_range(0.15..0.5) / (1.0 + 0.15 * k);
            (
                self.reach * amplitude,
                TAU * self.slowest * k,
                rng.random_range(0.0..TAU),
            )
        });
        let reference = |t: f64| -> f64 {
            let sines = harmonics.iter().map(|(a, w, p)| a * (w * t + p).sin());
            t.min(1.0) * sines.sum::<f64>()
        };
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let mut noise = |size: f64| -> f64 {
            let x: f64 = StandardNormal.sample(&mut rng);
            size * x
        };
        let (mut q, mut v, mut torque) = (0.0f64, 0.0f64, 0.0f64);
        let mut block = Block {
            joints: vec![JointColumns {
                reference: Some(Vec::new()),
                ..JointColumns::default()
            }],
            ..Block::default()
        };
        for k in 0..400_000 {
            let t = k as f64 * STEP;
            if k % SAMPLE == 0 {
                let wanted = reference(t);
                let read = q + noise(self.noise[0]);
                let speed = (reference(t + STEP) - wanted) / STEP;
                torque = 60.0 * (wanted - read) + 6.0 * (speed - v);
                let joint = &mut block.joints[0];
                block.t.push(t);
                joint.q.push(read);
                joint.tau.push(torque + noise(self.noise[1]));
                joint.reference.iter_mut().for_each(|r| r.push(wanted));
            }
            let acts = torque * (1.0 - self.saturation * torque * torque);
            let [stiffness, rest] = self.spring;
            let pulls = MASS * 9.81 * LENGTH * q.sin()
                + self.stiffening * q.powi(3)
                + stiffness * (q - rest)
                + self.brake[0] * v / (1.0 + (v / self.brake[1]).powi(2))
                - self.swinging * INERTIA * (2.0 * q).sin() * v * v;
            let inertia = INERTIA * (1.0 + self.swinging * (2.0 * q).cos());
            if let Some([more, speed, power]) = self.sticking {
                let dry = COULOMB + more * (-(v.abs() / speed).powf(power)).exp();
                let free = v + STEP * (acts - pulls - VISCOUS * v) / inertia;
                // No more than brings it to rest (Moreau 1988).
                v = free.signum() * (free.abs() - STEP * dry / inertia).max(0.0);
            } else {
                let weakened = self.breakaway / (1.0 + 12.5 * v * v);
                let friction = (COULOMB + weakened) * (v / 0.004).tanh() + VISCOUS * v;
                v += STEP * (acts - pulls - friction) / inertia;
            }
            q += STEP * v;
        }
        InMemory {
            label: label.to_owned(),
            blocks: vec![block],
        }
    }

    /// What is found of it by two runs of a motion and one of another.
    fn diagnosed(&self, robot: &Robot) -> (Diagnosis, Robot) {
        self.diagnosed_by(robot, &Options::default())
    }

    fn diagnosed_by(&self, robot: &Robot, options: &Options) -> (Diagnosis, Robot) {
        let [train, again, held] = [("train", 1, 2), ("again", 1, 3), ("held", 4, 5)]
            .map(|(label, motion, seed)| self.recorded(label, motion, seed));
        let training: [&dyn Recording; 2] = [&train, &again];
        let held: [&dyn Recording; 1] = [&held];
        crate::diagnose(robot, &training, &held, options, &mut |_| ()).unwrap()
    }
}

/// Hanging at zero; all true but the dry friction.
fn described(torque: f64) -> Robot {
    let text = format!(
        r#"
name = "pendulum"
gravity = [0.0, 0.0, -9.81]
[[joint]]
name = "shoulder"
kind = "revolute"
alpha = 1.5707963267948966
a = 0.0
theta = -1.5707963267948966
d = 0.0
[joint.inertial]
mass = {MASS}
first_moment = [{}, 0.0, 0.0]
inertia = [0.0, 0.0, 0.0, 0.0, 0.0, {INERTIA}]
[joint.limits]
position = [-3.1, 3.1]
velocity = 20.0
acceleration = 200.0
torque = {torque}
[joint.friction]
coulomb = 0.3
viscous = 0.1
offset = 0.0
"#,
        MASS * LENGTH
    );
    Robot::from_toml(&text, Path::new("pendulum.toml")).unwrap()
}

/// The encoder is so noisy that its filter is near the band of the rows: what it takes from the motion alone would be left of the
/// torque and of dry friction, 22 % above the noise.
#[test]
fn torque_and_friction_pass_the_filter_that_the_motion_has_passed() {
    let plain = Pendulum {
        noise: [2e-5, 0.03],
        slowest: 0.1,
        ..PLAIN
    };
    let (found, _) = plain.diagnosed(&described(50.0));
    let w = &found.waterfall[0];
    println!("{:?} {:?} over {}", found.words, w.holdout, w.floor);
    assert!(found.steps.is_empty(), "{:?}", found.words);
    assert_eq!(
        found.verdict,
        Verdict::ParameterChange,
        "{:?}",
        found.remainder
    );
    assert!(w.holdout[1] < 1.05 * w.floor, "{w:?}");
    let friction = found.absorbed.iter().find(|a| a.parameter == "fc1");
    let now = friction.unwrap().after;
    assert!((now / COULOMB - 1.0).abs() < 0.01, "{now}");
}

/// A twelfth more than the noise, in both runs of a motion alike, is left and said to be, where no effect may be named.
#[test]
fn what_comes_back_in_both_runs_is_left_though_it_is_a_twelfth_of_the_noise() {
    let nothing = Options {
        without: Kind::ALL.to_vec(),
        ..Options::default()
    };
    for (stiffening, is_left) in [(0.0, false), (0.3, true)] {
        let pendulum = Pendulum {
            stiffening,
            noise: [5e-6, 0.1],
            ..PLAIN
        };
        let (found, _) = pendulum.diagnosed_by(&described(50.0), &nothing);
        let w = &found.waterfall[0];
        let ratio = w.train[1] / w.floor;
        println!("{ratio} {:?}", found.remainder);
        assert_eq!(found.remainder.is_some(), is_left, "{ratio}");
        // Less than an eighth, which is what other motions' noise may differ by.
        assert!(ratio < 1.12, "{ratio}");
        assert_eq!(ratio > 1.06, is_left, "{ratio}");
    }
}

/// The description has the link level at zero, or its axis upright, where it hangs: no effect explains that.
#[test]
fn a_zero_that_is_a_quarter_turn_off_is_said_and_a_smaller_one_is_the_tilt_it_is() {
    let turned = |turn: fn(&mut Robot)| {
        let mut robot = described(50.0);
        turn(&mut robot);
        PLAIN.diagnosed(&robot)
    };
    let (level, _) = turned(|robot| robot.joints[0].theta = 0.0);
    let (upright, _) = turned(|robot| robot.joints[0].alpha = 0.0);
    for (found, words) in [
        (&level, ["turned by about -8", "theta near −1.5"]),
        (&upright, ["stands upright", "`alpha`"]),
    ] {
        assert_eq!(found.verdict, Verdict::DataFault, "{:?}", found.words);
        for fault in &found.data_faults {
            println!("{}", fault.text);
            assert_eq!(fault.kind.as_str(), "gravity");
            assert!(
                words.iter().all(|word| fault.text.contains(word)),
                "{}",
                fault.text
            );
        }
    }
    // Its tangent would be 0.423.
    let (tilted, model) = turned(|robot| robot.joints[0].theta += 0.4);
    assert_eq!(tilted.steps[0].effect, "gravity_tilt", "{:?}", tilted.words);
    let angle = &tilted.steps[0].parameters["angle"];
    println!("{angle:?} {:?}", model.gravity);
    assert!((angle.value.abs() - 0.4).abs() < 0.01, "{angle:?}");
    let [x, y, _] = model.gravity;
    assert!(
        (x.hypot(y) / 9.81 - 0.4f64.sin()).abs() < 0.01,
        "{:?}",
        model.gravity
    );
}

/// The law of friction that weakens with speed is not the library's, so that dry and viscous friction move beside it; the mass that
/// hangs on the link is one all the same. Of the slow motion a drag explains what that law leaves, which the faster
/// hold-out contradicts; with a second motion to learn from it has no name.
#[test]
fn a_payload_is_one_beside_friction_that_bends_its_parameters() {
    let prepared = Pendulum {
        breakaway: 0.35,
        ..PLAIN
    };
    let mut robot = described(50.0);
    let link = robot.joints[0].inertial.as_mut().unwrap();
    link.first_moment[0] *= 0.75;
    link.inertia[5] *= 0.85;
    let friction = robot.joints[0].friction.as_mut().unwrap();
    (friction.coulomb, friction.viscous) = (COULOMB, VISCOUS);
    let [moment, inertia] = [0.25 * MASS * LENGTH, 0.15 * INERTIA];
    let assert_payload = |found: &Diagnosis| {
        let last = found.steps.last().unwrap();
        assert_eq!(last.effect, "payload");
        let mass = last.parameters["mass"].value;
        let expected = moment * moment / inertia;
        assert!((mass / expected - 1.0).abs() < 0.1, "{mass}");
    };
    let (found, _) = prepared.diagnosed(&robot);
    let names = |found: &Diagnosis| -> Vec<String> {
        let names = found.steps.iter().map(|s| s.effect.clone());
        names.collect()
    };
    println!("{:?} {:?}", names(&found), found.words);
    assert_eq!(names(&found)[0], "stribeck");
    assert_payload(&found);
    for step in &found.steps[1..found.steps.len() - 1] {
        assert!(
            step.is_contradicted() && !found.is_certain(step),
            "{step:?}"
        );
        let said = format!("contradicts {}", step.effect);
        assert!(
            found.words.iter().any(|w| w.contains(&said)),
            "{:?}",
            found.words
        );
    }
    let recorded = [
        ("train", 1, 2),
        ("again", 1, 3),
        ("further", 6, 7),
        ("held", 4, 5),
    ]
    .map(|(label, motion, seed)| prepared.recorded(label, motion, seed));
    let [train, again, further, held] = recorded.each_ref().map(|r| r as &dyn Recording);
    let training = [train, again, further];
    let options = Options::default();
    let (found, _) = crate::diagnose(&robot, &training, &[held], &options, &mut |_| ()).unwrap();
    println!("{:?} {:?}", names(&found), found.words);
    assert_eq!(names(&found), ["stribeck", "payload"]);
    assert_payload(&found);
}

/// A third of the torque is lost at the peaks: the law has to be met with the torque that flowed.
#[test]
fn a_saturation_that_takes_a_third_of_the_peaks_is_found_with_its_size() {
    let lost = Pendulum {
        saturation: 0.003,
        reach: 1.25,
        slowest: 0.25,
        ..PLAIN
    };
    let (found, model) = lost.diagnosed(&described(50.0));
    let w = &found.waterfall[0];
    println!("{:?} {:?} over {}", found.words, w.holdout, w.floor);
    let names: Vec<&str> = found.steps.iter().map(|s| s.effect.as_str()).collect();
    assert_eq!(names, ["torque_saturation"], "{:?}", found.words);
    let coefficient = &found.steps[0].parameters["coefficient"];
    println!("{coefficient:?}");
    assert!(
        (coefficient.value / lost.saturation - 1.0).abs() < 0.05,
        "{coefficient:?}"
    );
    // The floor holds nothing of the saturation.
    assert!(found.gap_closed.unwrap() > 0.9, "{:?}", found.gap_closed);
    assert_eq!(model.effects.len(), 1);
}

#[test]
fn a_limit_that_the_recorded_torque_goes_beyond_is_left_out_and_said() {
    let (whole, _) = PLAIN.diagnosed(&described(50.0));
    let (found, model) = PLAIN.diagnosed(&described(2.5));
    let said = |found: &Diagnosis| -> Vec<String> {
        let about = |w: &&String| w.contains("beyond the 2.5");
        found.words.iter().filter(about).cloned().collect()
    };
    assert_eq!(said(&whole), [""; 0]);
    assert_eq!(said(&found).len(), 1, "{:?}", found.words);
    assert_eq!(model.joints[0].limits.as_ref().unwrap().torque, None);
    assert_eq!(found.waterfall, whole.waterfall);
}

/// The cube of an angle is nearly a line less a sine.
#[test]
fn a_spring_that_takes_the_weight_of_the_link_is_not_to_be_believed() {
    let stiff = Pendulum {
        stiffening: 0.5,
        reach: 1.25,
        ..PLAIN
    };
    let (found, _) = stiff.diagnosed(&described(50.0));
    println!("{:?}", found.words);
    let said = |w: &&String| w.contains("before you believe either");
    let named = found.steps.iter().any(|s| s.effect == "spring");
    assert!(named, "{:?}", found.words);
    assert_eq!(found.words.iter().filter(said).count(), 1);
}

/// At each reversal it rests for a while, and its friction is anything between both directions'.
#[test]
fn a_pendulum_that_sticks_leaves_nothing() {
    let sticking = Pendulum {
        sticking: Some([0.0, 0.08, 2.0]),
        noise: [2e-5, 0.02],
        reach: 0.7,
        slowest: 0.1,
        ..PLAIN
    };
    let (found, _) = sticking.diagnosed(&described(50.0));
    println!("{:?} {:#?}", found.words, found.remainder);
    assert!(found.steps.is_empty(), "{:?}", found.words);
    assert_eq!(found.verdict, Verdict::ParameterChange);
}

/// Filters blur what the torque says of the instants at which it breaks away; a simulated pendulum breaks away when it does.
#[test]
fn how_it_breaks_away_is_known_by_the_motion() {
    let sticking = Pendulum {
        sticking: Some([0.3, 0.08, 2.0]),
        noise: [2e-5, 0.02],
        slowest: 0.1,
        ..PLAIN
    };
    let (found, _) = sticking.diagnosed(&described(50.0));
    println!("{:?} {:#?}", found.words, found.by_motion);
    assert_eq!(found.steps[0].effect, "stribeck", "{:?}", found.words);
    assert!(found.by_motion.as_ref().unwrap().adopted);
    for (name, truth) in [("breakaway", 0.3), ("velocity", 0.08)] {
        let value = found.steps[0].parameters[name].value;
        assert!((value / truth - 1.0).abs() < 0.05, "{name}: {value}");
    }
}

/// The zero of its coordinate is a quarter turn from where it hangs: most of what a spring pulls there is a constant.
#[test]
fn a_spring_is_told_wherever_the_zero_of_the_joint_is() {
    let sprung = Pendulum {
        spring: [0.8, -0.7],
        ..PLAIN
    };
    let mut robot = described(50.0);
    robot.joints[0].theta = 0.0;
    let turned = |label, motion, seed| {
        let mut recording = sprung.recorded(label, motion, seed);
        let joint = &mut recording.blocks[0].joints[0];
        let places = joint
            .q
            .iter_mut()
            .chain(joint.reference.iter_mut().flatten());
        places.for_each(|q| *q -= TAU / 4.0);
        recording
    };
    let [train, again, held] =
        [("train", 1, 2), ("again", 1, 3), ("held", 4, 5)].map(|(l, m, s)| turned(l, m, s));
    let training: [&dyn Recording; 2] = [&train, &again];
    let held: [&dyn Recording; 1] = [&held];
    let (found, _) =
        crate::diagnose(&robot, &training, &held, &Options::default(), &mut |_| ()).unwrap();
    println!("{:?} {:#?}", found.words, found.steps);
    assert_eq!(found.steps[0].effect, "spring", "{:?}", found.words);
    let stiffness = &found.steps[0].parameters["stiffness"];
    let std = stiffness.std;
    assert!((stiffness.value - 0.8).abs() < 3.0 * std, "{stiffness:?}");
    assert!(std < 0.05, "{stiffness:?}");
    assert!(found.remainder.is_none(), "{:?}", found.remainder);
}
