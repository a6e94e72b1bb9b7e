//! The header, compiled by the system's C compiler, against the laws in Rust.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use rand::{RngExt, SeedableRng};
use rig_model::robot::{ONE_LINK_TEMPLATE, Robot, RobotEffect};
use rig_shared::effects::{Effect, Instant, Kind, Memory, Parameter};

use super::{c_header, laws};

/// Instants of one random motion.
fn motion(seed: u64, rows: usize) -> Vec<Instant<f64>> {
    let mut g = rand_pcg::Pcg64::seed_from_u64(seed);
    let period = 0.001;
    let mut draw = |size: f64| size * (2.0 * g.random::<f64>() - 1.0);
    let waves: Vec<[f64; 3]> = (0..4)
        .map(|_| [draw(1.0), 3.0 + draw(2.5), draw(3.0)])
        .collect();
    let at = |k: usize| {
        let t = k as f64 * period;
        let sum = |of: &dyn Fn(&[f64; 3]) -> f64| waves.iter().map(of).sum::<f64>();
        // Rest at the start and in the middle.
        let moves = if k < 50 || (rows / 2..rows / 2 + 50).contains(&k) {
            0.0
        } else {
            1.0
        };
        let velocity = moves * sum(&|[a, w, p]| a * w * (w * t + p).cos());
        Instant {
            position: sum(&|[a, w, p]| a * (w * t + p).sin()),
            velocity,
            acceleration: 0.0,
            direction: if velocity == 0.0 {
                0.0
            } else {
                velocity.signum()
            },
            motor_angle: 7.0 * sum(&|[a, w, p]| a * (w * t + p).sin()),
            drive_torque: 2.0 * sum(&|[a, w, p]| a * (w * t + 1.0 + p).sin()),
            load: 3.0 * sum(&|[a, w, p]| a * (w * t + 2.0 + p).cos()),
            time: t,
            temperature_rise: 5.0 * t,
            other: [
                0.0,
                sum(&|[a, w, p]| a * (2.0 * w * t + p).sin()),
                sum(&|[a, _, p]| a * p),
            ],
            period,
            travel: velocity * period,
            extra_friction_ratio: 0.3 * (5.0 * t).sin(),
            ..Instant::default()
        }
    };
    (0..rows).map(at).collect()
}

/// A robot of one link with one effect of every law that the header has, at the middle of the ranges of its parameters.
fn robot() -> Robot {
    let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap();
    let middle = |own: &Parameter| match own.range {
        [low, high] if low > 0.0 => (low * high).sqrt(),
        [low, high] => 0.5 * (low + high),
    };
    let of = |list: &[Parameter]| list.iter().map(middle).collect::<Vec<f64>>();
    let all = Kind::ALL.iter().filter(|kind| laws::law(**kind).is_some());
    robot.effects = all
        .map(|kind| RobotEffect {
            joint: None,
            other: None,
            effect: Effect::new(*kind, &of(kind.about().gains), &of(kind.about().shapes)),
        })
        .collect();
    robot
}

/// Compiles the header of a robot with a program that prints the torque at each instant, and runs it.
fn by_c(compiler: &str, robot: &Robot, instants: &[Instant<f64>], options: &[&str]) -> Vec<f64> {
    let folder = tempfile::tempdir().unwrap();
    let header = c_header(robot, "a test */ of comments");
    assert!(header.left_out.is_empty());
    std::fs::write(folder.path().join("rig.h"), header.text).unwrap();
    let mut rows = String::new();
    for at in instants {
        writeln!(
            rows,
            "{{{:?},{:?},{:?},{:?},{:?},{:?},0,{:?},{:?},{:?},{:?},{:?},{:?}}},",
            at.position,
            at.velocity,
            at.direction,
            at.motor_angle,
            at.drive_torque,
            at.load,
            at.time,
            at.temperature_rise,
            at.other[1],
            at.other[2],
            at.period,
            at.extra_friction_ratio
        )
        .unwrap();
    }
    let program = format!(
        "#include <stdio.h>\n#include \"rig.h\"\nstatic rig_instant rows[] = {{\n{rows}}};\n\
         int main(void) {{\n rig_joint1_state state = {{0}};\n\
         for (unsigned k = 0; k < sizeof rows / sizeof rows[0]; ++k)\n\
         printf(\"%.17g\\n\", (double)rig_joint1_torque(&state, &rows[k]));\n return 0; }}\n"
    );
    std::fs::write(folder.path().join("main.c"), program).unwrap();
    let mut build = Command::new(compiler);
    build
        .current_dir(folder.path())
        .args(["-std=c99", "-O1", "-Wall", "-Wextra", "-pedantic"]);
    build.args(["-Werror", "-Wno-overflow"]).args(options);
    let output = build
        .args(["main.c", "-o", "main", "-lm"])
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let output = Command::new(folder.path().join("main")).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(|line| line.parse().unwrap()).collect()
}

/// The same by the laws in Rust.
fn by_rust(robot: &Robot, instants: &[Instant<f64>]) -> Vec<f64> {
    let friction = robot.joints[0].friction.clone().unwrap();
    let mut memories = vec![Memory::default(); robot.effects.len()];
    let torque = |at: &Instant<f64>| {
        let own = friction.coulomb * at.direction + friction.viscous * at.velocity;
        let at = Instant {
            friction: own,
            ..*at
        };
        let effects = robot.effects.iter().zip(&mut memories);
        own + friction.offset + effects.map(|(e, m)| e.effect.torque(m, &at)).sum::<f64>()
    };
    instants.iter().map(torque).collect()
}

#[test]
fn every_law_in_c_is_the_law_in_rust() {
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    if Command::new(&compiler).arg("--version").output().is_err() {
        println!("SKIPPED: there is no C compiler `{compiler}`; set CC to one.");
        return;
    }
    let all = robot();
    assert!(all.effects.len() >= 18);
    // Each law alone, so that a small torque is not lost beside a large one, then all of them.
    let mut robots: Vec<Robot> = (all.effects.iter())
        .map(|effect| {
            let mut own = all.clone();
            own.effects = vec![effect.clone()];
            let friction = own.joints[0].friction.as_mut().unwrap();
            (friction.coulomb, friction.offset) = (0.2, 0.01);
            own
        })
        .collect();
    robots.push(all);
    for (k, robot) in robots.iter().enumerate() {
        let name = super::title_of(robot.effects[0].effect.kind);
        let instants = motion(k as u64, 1500);
        let want = by_rust(robot, &instants);
        let size = want.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        // Float: 24 bits, of which sums and the argument of a fast wave lose some.
        for (options, bound) in [(&["-DRIG_DOUBLE"][..], 1e-11), (&[], 1e-4)] {
            let found = by_c(&compiler, robot, &instants, options);
            assert_eq!(found.len(), want.len());
            for (row, (found, want)) in found.iter().zip(&want).enumerate() {
                assert!(
                    (found - want).abs() <= bound * size,
                    "{name}, row {row}: {found} in C, {want} in Rust (size {size})"
                );
            }
        }
    }
}

#[test]
fn effects_that_are_no_torque_are_named() {
    let mut robot = robot();
    robot.effects.truncate(1);
    for kind in [Kind::Backlash, Kind::Payload] {
        robot.effects.push(RobotEffect {
            joint: None,
            other: None,
            effect: Effect::new(kind, &[], &[]),
        });
    }
    let header = c_header(&robot, "model.toml");
    assert_eq!(header.left_out.len(), 2);
    assert!(header.left_out[0].contains("backlash at joint link is not in the header"));
    assert!(!header.text.contains("backlash"));
}
