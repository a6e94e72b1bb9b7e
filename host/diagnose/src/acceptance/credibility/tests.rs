//! False gears.

#![allow(clippy::unwrap_used)]

use crate::tests::made::Diagnosed as _;

use crate::Options;
use crate::acceptance::credibility::*;
use crate::columns::candidate::Candidate;
use crate::description::described_effects::DescribedEffects;
use crate::models::observer_models::ObserverModels;
use crate::outcome::{Tried, Verdict};
use crate::recordings::context::{DiagnosisContext, PreparedData, library};
use crate::recordings::position_reading::PositionReading;
use rig_data::prepare::Recording;
use rig_scenario::{Arm, ArmScenario, Effect, Scenario};
use rig_shared::effects::{Kind, SHAPES};

const SPRING: Effect = Effect::JointElasticity {
    stiffness: 700.0,
    damping: 0.3,
};
const GEAR: Candidate = Candidate::on(Kind::JointElasticity, 0);

/// Returns the result of `ask` for the library on a rig with this hidden effect.
fn on<T>(
    effect: Option<Effect>,
    seed: u64,
    ask: impl FnOnce(&DiagnosisContext, &PreparedData, &Refit, &Search) -> T,
) -> T {
    let made = Scenario::short(effect, seed).make().unwrap();
    let stated = DescribedEffects::of(&made.robot);
    let training: [&dyn Recording; 1] = [&made.train];
    let context = DiagnosisContext::of(&stated, &training).unwrap();
    let prepared = context.load(&training).unwrap();
    let refit = Refit::of(&context, &prepared.rows).unwrap();
    let values = context.anchor.values(&refit.before.values);
    let search = Search::new(
        context.source(&prepared, &values).unwrap(),
        library(&made.robot, &prepared.runs, &[]),
        Vec::new(),
        2,
    );
    ask(&context, &prepared, &refit, &search)
}

/// Stiffness, damping and friction share as shapes.
fn shapes(of: [f64; 3]) -> [f64; SHAPES] {
    let mut shapes = [0.0; SHAPES];
    shapes[..3].copy_from_slice(&of);
    shapes
}

/// Returns the reason against an elastic gear (rig: 700 N·m/rad) of this stiffness; its torque is scaled by `times`.
fn said(stiffness: f64, times: f64) -> Option<Refusal> {
    on(Some(SPRING), 5, |context, prepared, refit, search| {
        let shapes = shapes([stiffness, 0.3, 0.25]);
        let follower = ObserverModels::new(context, prepared, refit, search);
        let judge = Judge {
            robot: context.robot,
            search,
            follower: &follower,
            rows: &prepared.rows,
            coordinates: &[Vec::new()],
            pairs: Vec::new(),
            position_reading: PositionReading::of_noise(vec![0.0]),
            base: &refit.base,
            seed: 1,
        };
        let mut columns = search.source.columns(&GEAR, &shapes).unwrap();
        for value in columns.iter_mut().flatten().flatten().flatten() {
            *value *= times;
        }
        let gear = FittedCandidate::unjudged(GEAR, shapes, columns);
        let fallen = unbelieved(refit, search, &judge, &[gear]).unwrap();
        fallen.map(|(_, why)| why)
    })
}

#[test]
fn a_gear_stands_that_is_as_stiff_as_the_rig_and_not_one_that_is_too_stiff_or_moves_too_much() {
    assert_eq!(said(700.0, 1.0), None);
    // A quarter of its torque needs a factor of four.
    assert_eq!(said(700.0, 0.25), Some(Refusal::MoreThanTheLink));
    // 0.15 kg·m² at 1e5 N·m/rad resonate at 130 Hz, above rows of less than 100 Hz.
    assert_eq!(said(1e5, 1.0), Some(Refusal::BeyondBand));
}

/// With creep, the friction of the rig lags a little. A link with all friction behind a spring of five times critical
/// damping would remove a tenth of that residual (6 % without rows near standstill).
#[test]
fn a_gear_that_does_not_swing_is_none() {
    let made = Scenario::short([], 900).make().unwrap();
    let (diagnosis, _) = made.diagnosed(&made.robot, &Options::default());
    assert_eq!(
        diagnosis.verdict,
        Verdict::NothingMissing,
        "{:?}",
        diagnosis.words
    );
    let gear = |t: &&Tried| t.effect.contains("elasticity");
    let why = ["swing", "less than 10 %"];
    for tried in diagnosis.tried.iter().filter(gear) {
        assert!(
            why.iter().any(|why| tried.refused.contains(why)),
            "{tried:?}"
        );
    }
}

/// Returns the elastic gear from a search that starts at these shapes.
fn profiled(effect: Option<Effect>, seed: u64, begun: [f64; 3]) -> FittedCandidate {
    on(effect, seed, |_, _, refit, search| {
        let place = search.library.iter().position(|c| *c == GEAR).unwrap();
        let profile = search.profile(&refit.base, place, Some(shapes(begun)));
        profile.unwrap().unwrap()
    })
}

/// On the creeping rig the best gear above critical damping stays there; a true one swings.
#[test]
fn a_gear_beyond_critical_damping_is_refused_for_that_alone() {
    let lag = profiled(None, 900, [3000.0, 190.0, 0.25]);
    assert_eq!(lag.refused(300), Some(Refusal::AtBound("swing")), "{lag:?}");
    let gear = profiled(Some(SPRING), 5, [700.0, 0.3, 0.25]);
    assert_eq!(gear.refused(300), None);
}

/// Returns the reason against an effect with `count` columns on joint 2 of an upright two-link arm without effects.
fn said_on_arm(kind: Kind, shapes: [f64; SHAPES], columns: usize) -> Option<Refusal> {
    let made = ArmScenario {
        seconds: [20.0, 15.0],
        ..ArmScenario::new(Arm::Upright, None, 11)
    }
    .make()
    .unwrap();
    let stated = DescribedEffects::of(&made.robot);
    let training: [&dyn Recording; 1] = [&made.train[0]];
    let context = DiagnosisContext::of(&stated, &training).unwrap();
    let prepared = context.load(&training).unwrap();
    let refit = Refit::of(&context, &prepared.rows).unwrap();
    let values = context.anchor.values(&refit.before.values);
    let search = Search::new(
        context.source(&prepared, &values).unwrap(),
        library(&made.robot, &prepared.runs, &[]),
        Vec::new(),
        2,
    );
    let candidate = Candidate::on(kind, 1);
    let follower = ObserverModels::new(&context, &prepared, &refit, &search);
    let judge = Judge {
        robot: context.robot,
        search: &search,
        follower: &follower,
        rows: &prepared.rows,
        coordinates: &[Vec::new(), Vec::new()],
        pairs: Vec::new(),
        position_reading: PositionReading::of_noise(vec![0.0; 2]),
        base: &refit.base,
        seed: 1,
    };
    let mut own = search.source.columns(&candidate, &shapes).unwrap();
    own.truncate(columns);
    let profile = FittedCandidate::unjudged(candidate, shapes, own);
    // A gear too soft to simulate has no column.
    let fallen = unbelieved(&refit, &search, &judge, &[profile]).ok()?;
    fallen.map(|(_, why)| why)
}

/// The second link of the arm loads its joint with some N·m.
#[test]
fn an_arm_does_not_stand_on_a_soft_joint() {
    let of = |stiffness: f64| said_on_arm(Kind::JointElasticity, shapes([stiffness, 1.0, 0.25]), 1);
    let soft = [30.0, 50.0, 80.0, 120.0].map(of);
    assert!(soft.contains(&Some(Refusal::Sags)), "{soft:?}");
    let stiff = of(2e4);
    assert_ne!(stiff, Some(Refusal::Sags));
}

#[test]
fn one_joint_of_a_recorder_has_no_clock_of_its_own() {
    let said = said_on_arm(Kind::MeasurementDelay, [0.0; SHAPES], 1);
    assert_eq!(said, Some(Refusal::AnotherClock));
}

/// Backlash of a thousandth of a degree on a rig without any.
#[test]
fn a_gap_that_may_be_none_is_none() {
    on(None, 6, |context, prepared, refit, search| {
        let candidate = Candidate {
            kind: Kind::Backlash,
            ..GEAR
        };
        let shapes = [2e-5, 1500.0, 15.0, 0.25];
        let follower = ObserverModels::new(context, prepared, refit, search);
        let judge = Judge {
            robot: context.robot,
            search,
            follower: &follower,
            rows: &prepared.rows,
            coordinates: &[Vec::new()],
            pairs: Vec::new(),
            position_reading: PositionReading::of_noise(vec![0.0]),
            base: &refit.base,
            seed: 1,
        };
        let play = FittedCandidate::unjudged(
            candidate,
            shapes,
            search.source.columns(&candidate, &shapes).unwrap(),
        );
        let fallen = unbelieved(refit, search, &judge, &[play]).unwrap();
        let why = fallen.map(|(_, why)| why);
        assert_eq!(why, Some(Refusal::NoGap));
    });
}
