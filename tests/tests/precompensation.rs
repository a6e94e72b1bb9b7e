//! What was identified on-line, uploaded and used: slow reversals with and without friction precompensation, and the
//! three control laws.
#![allow(clippy::unwrap_used, clippy::panic)]

use rig_shared::control::ControlKind;
use rig_shared::friction::Friction;
use rig_shared::link::LinkParameters;
use rig_shared::trajectory::{SlowReversals, Trajectory};
use rig_shared::wire::message::{Estimate, RequestBody};
use rig_tests::{Line, Recording, bench, driven, excitation, in_parallel, nameplate};

/// Rigs.
const RIGS: u64 = 6;
/// Rest after the reversals, s.
const REST: f64 = 10.0;

/// The model and friction law that an on-line estimate stands for.
fn learnt(estimate: &Estimate) -> Vec<RequestBody> {
    let model = LinkParameters::from_array(estimate.value);
    vec![
        RequestBody::SetModel(model),
        RequestBody::SetFriction(Friction {
            coulomb: model.coulomb,
            viscous: model.viscous,
            ..Friction::default()
        }),
    ]
}

/// A rig, and what it has learnt of itself during two excitations.
fn identified(seed: u64) -> (Line, Estimate) {
    let (mut line, _) = bench(seed);
    driven(&mut line, vec![], excitation(2 * seed, 5, 5), 0.5);
    let second = driven(&mut line, vec![], excitation(2 * seed + 1, 5, 5), 0.5);
    assert!(second.faults.is_empty(), "seed {seed}: {:?}", second.faults);
    let estimate = second.estimate();
    assert_eq!(estimate.trusted, [true; 6], "seed {seed}");
    (line, estimate)
}

fn span(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
}

fn std(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    (values.map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// Tracking error over the motion, and position span and torque deviation over the last five seconds at rest.
fn figures(run: &Recording) -> (f64, f64, f64) {
    assert!(run.faults.is_empty(), "{:?}", run.faults);
    let length = run.rows.last().unwrap().t - run.rows[0].t;
    let start = run.rows[0].t + length - 5.0;
    let last = run.rows.iter().filter(|row| row.t >= start);
    (
        run.tracking_rms(0.0, length - REST),
        span(last.clone().map(|row| row.q1)),
        std(last.map(|row| row.tau_cmd1)),
    )
}

#[test]
fn slow_reversals_with_what_was_learnt_on_line_and_no_limit_cycle_after_them() {
    let reversals =
        Trajectory::SlowReversals(SlowReversals::new(0.05_f32, 0.1, &[0.1, 0.05], 3).unwrap());
    let outcomes = in_parallel(RIGS, |seed| {
        let (mut line, estimate) = identified(seed);
        let plant = line.port().device().plant().config().clone();
        let encoder = plant.sensors.encoder;
        let count = std::f64::consts::TAU / (encoder.counts_per_turn * plant.mechanism.ratio);
        let described = driven(&mut line, vec![], reversals.clone(), REST);
        let model = driven(&mut line, learnt(&estimate), reversals.clone(), REST);
        let mut precompensation = nameplate(&plant).settings.precompensation;
        precompensation.enabled = true;
        let on = vec![RequestBody::SetPrecompensation(precompensation)];
        let with = driven(&mut line, on, reversals.clone(), REST);
        (figures(&described), figures(&model), figures(&with), count)
    });
    let mut text = String::from(
        "rig  RMS described, mrad  model  both  factor  to model  span, counts  then  torque std, N·m  then\n",
    );
    let mut fair = true;
    for (seed, (described, model, with, count)) in outcomes.iter().enumerate() {
        let (factor, to_model) = (described.0 / with.0, model.0 / with.0);
        text += &format!(
            "{seed:>3} {:>20.2} {:>6.2} {:>5.2} {factor:>7.1} {to_model:>9.1} {:>13.1} {:>5.1} {:>16.4} {:>5.4}\n",
            1e3 * described.0,
            1e3 * model.0,
            1e3 * with.0,
            model.1 / count,
            with.1 / count,
            model.2,
            with.2
        );
        // Against the same controller with the same model; against the description alone it gains more.
        fair &= to_model >= 5.0 && with.1 <= 2.0 * model.1 + 3.0 * count && with.2 <= 2.0 * model.2;
    }
    println!("{text}");
    assert!(fair, "\n{text}");
}

#[test]
fn laws_that_know_the_model_track_better_than_bare_feedback() {
    let outcomes = in_parallel(4, |seed| {
        let (mut line, estimate) = identified(seed);
        let limit = f64::from(line.port().device().state().settings().limits.torque);
        let motion = excitation(1000 + seed, 5, 5);
        let nothing = LinkParameters {
            inertia: estimate.value[0],
            ..LinkParameters::default()
        };
        let bare = vec![
            RequestBody::SetModel(nothing),
            RequestBody::SetFriction(Friction::default()),
        ];
        let law = |kind| {
            let mut settings = learnt(&estimate);
            settings.push(RequestBody::SetControl(kind));
            settings
        };
        let runs = [
            driven(&mut line, bare, motion.clone(), 0.5),
            driven(
                &mut line,
                law(ControlKind::ComputedTorque),
                motion.clone(),
                0.5,
            ),
            driven(&mut line, law(ControlKind::Adaptive), motion.clone(), 0.5),
        ];
        for run in &runs {
            assert!(run.faults.is_empty(), "seed {seed}: {:?}", run.faults);
            assert!(
                run.rows
                    .iter()
                    .all(|row| row.tau_cmd1.is_finite() && row.tau_cmd1.abs() <= limit),
                "seed {seed}"
            );
        }
        runs.map(|run| run.tracking_rms(0.0, 29.0))
    });
    let mut text = String::from("rig  bare PD, mrad  computed torque  adaptive\n");
    let mut fair = true;
    for (seed, [bare, computed, adaptive]) in outcomes.iter().enumerate() {
        text += &format!(
            "{seed:>3} {:>14.2} {:>16.2} {:>9.2}\n",
            1e3 * bare,
            1e3 * computed,
            1e3 * adaptive
        );
        fair &= computed < bare && adaptive < bare;
    }
    println!("{text}");
    assert!(fair, "\n{text}");
}
