#![allow(clippy::unwrap_used)]
use rig_shared::effects::{Effect, Instant, Kind, Memory};
use rig_shared::scalar::Real as _;

use super::*;
use crate::runs::JointRun;

fn run(recording: usize, began: f64, t: &[f64]) -> Run {
    Run {
        recording,
        rate: 1.0,
        began,
        t: t.to_vec(),
        joints: vec![JointRun {
            qd: vec![1.0; t.len()],
            ..JointRun::default()
        }],
        ..Run::default()
    }
}

#[test]
fn what_goes_on_by_one_clock_is_one_session() {
    // A pause of 5 s, a stretch of the same recording after a gap, a clock that restarts, a pause of one hour.
    let mut runs = vec![
        run(0, 100.0, &[100.0, 190.0]),
        run(1, 195.0, &[195.0, 220.0]),
        run(2, 0.0, &[0.0, 30.0]),
        run(1, 195.0, &[230.0, 280.0]),
        run(3, 4000.0, &[4000.0, 4060.0]),
    ];
    join_sessions(&mut runs, &[]);
    let began: Vec<f64> = runs.iter().map(|r| r.began).collect();
    assert_eq!(began, [100.0, 100.0, 0.0, 100.0, 4000.0]);
    let pauses = |run: &Run| {
        run.thermal_history
            .0
            .iter()
            .map(|p| p.1)
            .collect::<Vec<f64>>()
    };
    let thermal_history: Vec<Vec<f64>> = runs.iter().map(pauses).collect();
    assert_eq!(
        thermal_history,
        [vec![], vec![5.0], vec![], vec![5.0, 10.0], vec![]]
    );
    let mut held = vec![run(0, 281.0, &[281.0, 300.0])];
    join_sessions(&mut held, &runs);
    assert_eq!(held[0].began, 100.0);
    assert_eq!(pauses(&held[0]), [5.0, 10.0, 1.0]);
}

/// Two recordings with a gap whose clocks both start at 0: neither continues the other.
#[test]
fn of_equal_clocks_each_stretch_goes_on_from_its_own_recording() {
    let mut runs = Vec::new();
    for recording in 0..2 {
        runs.push(run(recording, 0.0, &[0.0, 50.0]));
        runs.push(run(recording, 0.0, &[60.0, 90.0]));
    }
    runs[0].joints[0].qd.fill(2.0);
    join_sessions(&mut runs, &[]);
    for (first, second) in [(0, 1), (2, 3)] {
        assert_eq!(runs[first].thermal_history, ThermalHistory::default());
        let own = segment_of(&runs[first]);
        assert_eq!(
            runs[second].thermal_history,
            ThermalHistory(vec![(own, 10.0)])
        );
    }
    let mut held = vec![run(0, 0.0, &[0.0, 50.0])];
    join_sessions(&mut held, &runs);
    assert_eq!(held[0].thermal_history, ThermalHistory::default());
}

/// Heat over 40 s of a swinging joint and a pause: sample by sample at 1 kHz, and from the stored means.
#[test]
fn heat_by_means_is_heat_sample_by_sample() {
    let friction = [0.4, 0.7];
    let effect = Effect::new(Kind::ViscousWarmupHeat, &[0.1], &[12.0]);
    let qd: Vec<f64> = (0..40_000)
        .map(|k| 1e-3 * f64::from(k))
        .map(|t| 2.0 * (1.3 * t).sin() + 0.5 * (7.1 * t).cos())
        .collect();
    let mut memory = Memory::default();
    for velocity in &qd {
        let at = Instant {
            velocity: *velocity,
            friction: friction[0] * velocity + friction[1] * velocity.sgn(),
            period: 1e-3,
            ..Instant::default()
        };
        effect.torque(&mut memory, &at);
    }
    let exact = effect.after_pause(memory, 8.0).0[0];
    let mut runs = vec![run(0, 0.0, &[0.0, 39.999]), run(1, 47.999, &[47.999, 60.0])];
    (runs[0].rate, runs[0].joints[0].qd) = (1000.0, qd);
    join_sessions(&mut runs, &[]);
    let kept = runs[1].thermal_history.state_after(&effect, 0, friction).0[0];
    assert!((kept / exact - 1.0).abs() < 0.01, "{kept} {exact}");
    let cold = ThermalHistory::default().state_after(&effect, 0, friction);
    assert_eq!(cold, Memory::default());
}
