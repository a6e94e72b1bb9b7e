//! Sound recordings that are short, or of drives that move several joints: none has a certain fault.

use crate::faults::tests::*;
use rig_excite::SampledReference;

/// Returns sound recordings of whole arms: one simulated, and a real one if available.
pub(crate) fn sound_arms(folder: &Path) -> Vec<(Robot, Vec<Run>)> {
    let mut arms = vec![simulated_wrist(folder, 20.0, 1)];
    if let Some((robot, mut runs)) = one("kuka") {
        runs.retain(|run| run.recording == 0);
        arms.push((robot, runs));
    }
    arms
}

/// The TX40 with friction in every motor, the coupled sixth included, on a motion of `seconds`.
fn simulated_wrist(folder: &Path, seconds: f64, seed: u64) -> (Robot, Vec<Run>) {
    changed_wrist(folder, seconds, seed, |_| ())
}

/// The same for another arm than the described one.
pub(crate) fn changed_wrist(
    folder: &Path,
    seconds: f64,
    seed: u64,
    change: impl FnOnce(&mut Robot),
) -> (Robot, Vec<Run>) {
    let mut described = text("tx40.toml", TX40);
    // A description from a URDF states neither friction nor rotors.
    for joint in &mut described.joints {
        joint.friction = None;
        let drive = joint.drive.as_mut().unwrap();
        (drive.rotor_inertia, drive.coulomb, drive.viscous) = (0.0, 0.0, 0.0);
    }
    let mut robot = described.clone();
    for (k, joint) in robot.joints.iter_mut().enumerate() {
        let size = [12.0, 12.0, 8.0, 4.0, 3.0, 2.0][k];
        joint.friction = Some(rig_model::robot::JointFriction {
            coulomb: 0.6 * size,
            viscous: 0.6 * size,
            offset: 0.05 * size,
        });
        let drive = joint.drive.as_mut().unwrap();
        drive.rotor_inertia = 0.3 / drive.gear_ratio.powi(2);
        if !drive.couples.is_empty() {
            drive.coulomb = 4.0 / drive.gear_ratio;
            drive.viscous = 2.0 / drive.gear_ratio.powi(2);
        }
    }
    change(&mut robot);
    let phase = |j: usize, h: u32| {
        let turns = (seed + 3) as f64 * (7 * j + 3 * h as usize) as f64 * 0.137;
        core::f64::consts::TAU * turns.fract()
    };
    let sines = (4, 0.3, 8.4);
    let reference = SampledReference::eased_sines(&robot, [2e-3, seconds], sines, phase);
    let noise = rig_excite::Noise {
        position: 1e-5,
        velocity: 0.0,
        torque: 0.1,
    };
    let made = rig_excite::replay(&robot, &reference, noise, seed, |_, _| ()).unwrap();
    let path = folder.join("wrist.csv");
    made.save(&path, &described).unwrap();
    let runs = read(&described, &path, 0);
    (described, runs)
}

#[test]
fn a_coupled_wrist_with_friction_of_its_own_raises_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for (seed, seconds) in [(0, 8.0), (1, 20.0), (2, 60.0), (3, 60.0)] {
        let (robot, runs) = simulated_wrist(folder.path(), seconds, seed);
        assert_eq!(faults(&robot, &runs).unwrap(), [], "{seconds} s");
        if seconds < 20.0 {
            continue;
        }
        // Wrong columns are still found.
        for j in [4, 5] {
            for wrong in [tau(&runs, j, -1.0), q(&runs, j, -1.0)] {
                let found = faults(&robot, &wrong).unwrap();
                println!("{seconds} {j} {found:?}");
                assert!(!found.is_empty(), "{seconds} s, joint {}", j + 1);
            }
        }
    }
}

/// Returns a stretch of a run.
fn part(run: &Run, start: f64, seconds: f64) -> Run {
    let mut run = run.clone();
    let from = ((start * run.rate) as usize).min(run.len());
    let to = (((start + seconds) * run.rate) as usize).min(run.len());
    run.t = run.t[from..to].to_vec();
    for joint in &mut run.joints {
        joint.q_raw = joint.q_raw[from..to].to_vec();
        joint.tau = joint.tau[from..to].to_vec();
        if let Some(velocity) = &mut joint.measured_velocity {
            *velocity = velocity[from..to].to_vec();
        }
    }
    injured(&[run], |_| ()).swap_remove(0)
}

/// A few seconds of motion leave much undecided; no sound recording gets a certain fault for that.
#[test]
fn no_window_of_a_real_recording_is_accused() {
    let mut accused = Vec::new();
    let mut count = 0;
    for set in measured() {
        for run in &all(&set) {
            let length = run.len() as f64 / run.rate;
            for seconds in [5.0, 10.0] {
                let last = length - seconds;
                let step = f64::max(1.0, last / 20.0);
                for k in 0..=(last.max(-1.0) / step).floor() as i32 {
                    let start = f64::from(k) * step;
                    let window = part(run, start, seconds);
                    count += 1;
                    for fault in faults(&set.robot, &[window]).unwrap() {
                        // A window without motion holds no information.
                        if fault.certain && fault.kind.as_str() != "not-moving" {
                            accused.push(format!(
                                "{} {start} {seconds}: {} {}",
                                run.label, fault.kind, fault.text
                            ));
                        }
                    }
                }
            }
        }
    }
    println!("{count} windows");
    assert_eq!(accused, [""; 0]);
}
