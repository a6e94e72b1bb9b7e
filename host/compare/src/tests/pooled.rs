//! Pooled values and grades over many draws.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::made::{Made, Truth, compared, robot};
use crate::{CompareOptions, Comparison, Grade, RecordingSet, compare, pooled_robot};
use rig_data::prepare::InMemory;
use rig_identify::t_quantile;

/// Draws of four sets.
const DRAWS: u64 = 100;

fn covered(found: &Comparison, truth: &Truth, of: &dyn Fn(&str) -> bool) -> [f64; 2] {
    let mut counts = [0.0; 2];
    for p in found.parameters.iter().filter(|p| of(&p.expression)) {
        let off = (p.value - truth.value(&p.expression)).abs();
        counts[0] += f64::from(u8::from(off <= p.half_interval));
        counts[1] += 1.0;
    }
    counts
}

/// Sets of one truth are called equal in 97 of 100 draws at least, and the pooled intervals cover the truth. They are
/// the wider of two 95 % intervals, so that they cover more often than 95 %.
#[test]
fn sets_of_one_truth_agree_and_their_pooled_intervals_cover_it() {
    let truth = Truth::default();
    let (mut agree, mut counts) = (0, [0.0; 2]);
    for draw in 0..DRAWS {
        let made = |s: u64| (Made::new(10_000 + 10 * draw + s), truth.clone());
        let found = compared(&[made(0), made(1), made(2), made(3)]);
        agree += u32::from(found.grade == Grade::Agree);
        let own = covered(&found, &truth, &|_| true);
        counts = [counts[0] + own[0], counts[1] + own[1]];
    }
    let share = counts[0] / counts[1];
    println!(
        "agree in {agree} of {DRAWS}, intervals cover in {share:.4} of {} cases",
        counts[1]
    );
    assert!(agree >= 97, "{agree}");
    assert!(share >= 0.94, "{share}");
}

/// Viscous friction that varies by 15 % between sets: the interval of its mean covers at 95 %, which the errors within
/// the sets alone would miss by far.
#[test]
fn spread_between_sets_is_in_the_interval() {
    let truth = Truth::default();
    let mut random = Pcg64::seed_from_u64(5);
    let mut counts = [0.0; 2];
    let mut within_alone = 0.0;
    for draw in 0..DRAWS {
        let list: Vec<_> = (0..4)
            .map(|s| {
                let mut own = truth.clone();
                for f in &mut own.friction {
                    let more: f64 = StandardNormal.sample(&mut random);
                    f[0] *= 1.0 + 0.15 * more;
                }
                (Made::new(50_000 + 10 * draw + s), own)
            })
            .collect();
        let found = compared(&list);
        let own = covered(&found, &truth, &|name| name.starts_with("fv"));
        counts = [counts[0] + own[0], counts[1] + own[1]];
        for p in found
            .parameters
            .iter()
            .filter(|p| p.expression.starts_with("fv"))
        {
            let off = (p.value - truth.value(&p.expression)).abs();
            within_alone += f64::from(u8::from(off <= p.within));
        }
    }
    let share = counts[0] / counts[1];
    println!(
        "intervals cover in {share:.4}, within alone in {:.4}",
        within_alone / counts[1]
    );
    assert!((0.90..=0.99).contains(&share), "{share}");
    assert!(within_alone / counts[1] < 0.5);
}

/// A fourth set that hardly moves: its own values are far off, the pooled ones are not.
#[test]
fn a_set_with_poor_excitation_does_not_spoil_the_pooled_values() {
    let truth = Truth::default();
    let (mut wider, mut count) = (0.0, 0.0);
    for draw in 0..10 {
        let good = |s: u64| (Made::new(70_000 + 10 * draw + s), truth.clone());
        let poor = Made {
            seconds: 8.0,
            size: [0.04, 0.04],
            ..Made::new(80_000 + draw)
        };
        let three = compared(&[good(0), good(1), good(2)]);
        let four = compared(&[good(0), good(1), good(2), (poor, truth.clone())]);
        for (before, after) in three.parameters.iter().zip(&four.parameters) {
            assert_eq!(before.expression, after.expression);
            let moved = (after.value - before.value).abs();
            assert!(
                moved <= 0.5 * before.half_interval,
                "{}: {} ± {} became {}",
                before.expression,
                before.value,
                before.half_interval,
                after.value
            );
            wider += (after.half_interval / before.half_interval).ln();
            count += 1.0;
        }
        let worst = (four.parameters.iter()).filter_map(|p| {
            let own = p.sets.iter().find(|v| v.set == 3)?;
            Some(own.std / p.sets[0].std)
        });
        assert!(worst.fold(0.0, f64::max) > 20.0);
    }
    let wider = f64::exp(wider / count);
    println!("intervals are {wider:.3} as wide with the poor set");
    assert!(wider < 1.2, "{wider}");
}

/// A joint that stands still in one set: that set shows nothing of its friction, and all sets are compared in the rest.
#[test]
fn what_a_set_does_not_show_is_said_and_the_rest_is_compared() {
    let truth = Truth::default();
    let made = |s: u64| (Made::new(90_000 + s), truth.clone());
    let still = Made {
        size: [1.0, 0.0],
        ..Made::new(90_009)
    };
    let found = compared(&[made(0), made(1), (still, truth.clone())]);
    let missing = &found.sets[2].not_shown;
    for name in ["fv2", "fc2", "Ia2"] {
        assert!(missing.iter().any(|m| m == name), "{name}: {missing:?}");
    }
    assert!(!missing.iter().any(|m| m == "fv1"), "{missing:?}");
    assert!(found.sets[0].not_shown.is_empty());
    let of = |name: &str| {
        found
            .parameters
            .iter()
            .find(|p| p.expression == name)
            .unwrap()
    };
    assert_eq!(of("fv1").sets.len(), 3);
    assert_eq!(of("fv2").sets.len(), 2);
    let [within, all] = covered(&found, &truth, &|_| true);
    assert!(within >= all - 1.0, "{within} of {all}");
}

/// A single sine hardly tells viscous from Coulomb friction: the values of the sets trade, their torque does not.
#[test]
fn friction_of_a_single_sine_is_named_as_a_trade() {
    let truth = Truth::default();
    let mut named = 0;
    for draw in 0..5 {
        let pure = |s: u64| Made {
            pure: true,
            ..Made::new(95_000 + 10 * draw + s)
        };
        let list: Vec<_> = (0..4).map(|s| (pure(s), truth.clone())).collect();
        let found = compared(&list);
        for trade in &found.trades {
            assert!(trade.correlation.abs() >= crate::CORRELATED);
            assert!(trade.torque[2] <= crate::TOGETHER * trade.torque[0].min(trade.torque[1]));
        }
        let friction = |t: &&crate::Trade| t.pair[0][..2] == *"fv" && t.pair[1][..2] == *"fc";
        if let Some(trade) = found.trades.iter().find(friction) {
            named += 1;
            // More viscous friction, less Coulomb friction.
            assert!(trade.correlation < 0.0 && trade.differences[0] * trade.differences[1] < 0.0);
        }
    }
    assert!(named >= 4, "{named}");
}

#[test]
fn the_pooled_robot_has_the_pooled_torques() {
    let truth = Truth::default();
    let list: Vec<_> = (0..3)
        .map(|s| (Made::new(97_000 + s), truth.clone()))
        .collect();
    let found = compared(&list);
    let (robot, remarks) = pooled_robot(&super::made::robot(), &found);
    let all = rig_identify::described(&robot, found.pooled.combination.ncols());
    let base = &found.pooled.combination * all;
    for (p, value) in found.parameters.iter().zip(base.iter()) {
        let off = (value - p.value).abs();
        assert!(
            off <= p.half_interval,
            "{}: {value}, {} {remarks:?}",
            p.expression,
            p.value
        );
    }
}

/// A copy of a recording, a part of one, and a shifted one are refused; two recordings of one motion with other noise
/// are not.
#[test]
fn recordings_with_the_same_rows_are_refused() {
    let truth = Truth::default();
    let whole = Made::new(90_001).recording(&truth);
    let every = |step: usize, from: usize, to: usize, label: &str| {
        let mut part = whole.clone();
        part.label = label.to_owned();
        for block in &mut part.blocks {
            block.t = block.t[from..to].iter().copied().step_by(step).collect();
            for joint in &mut block.joints {
                for list in [&mut joint.q, &mut joint.tau] {
                    // As written with nine digits.
                    let nine = |x: &f64| format!("{x:.8e}").parse().unwrap();
                    *list = list[from..to].iter().step_by(step).map(nine).collect();
                }
            }
        }
        part
    };
    let cut = |from, to, label: &str| every(1, from, to, label);
    let other = Made::new(90_002).recording(&truth);
    let said = |first: &InMemory, second: &InMemory| {
        let set = |name: &str, recording| RecordingSet {
            name: name.to_owned(),
            recordings: vec![recording],
        };
        let sets = [set("a", first), set("b", second)];
        compare(&robot(), &sets, &CompareOptions::default()).map_err(|e| e.to_string())
    };
    let copy = said(&whole, &cut(0, 4000, "copy")).unwrap_err();
    assert!(copy.contains("made 90001 and copy"), "{copy}");
    let parts = said(&cut(0, 2400, "morning"), &cut(1600, 4000, "evening")).unwrap_err();
    assert!(parts.contains("morning and evening"), "{parts}");
    for step in [2, 3] {
        let thin = said(&every(step, 0, 4000, "thin"), &whole).unwrap_err();
        assert!(thin.contains("thin and made 90001"), "{thin}");
    }
    assert!(said(&whole, &other).is_ok());
}

/// A recording whose residual remembers as long as it lasts has no known errors: beside a long one of the same arm it is
/// never said to differ, and what two long ones differ by stays told beside it.
#[test]
fn a_recording_that_is_too_short_decides_nothing() {
    let truth = Truth::default();
    let short = |seed| Made {
        seconds: 1.4,
        ..Made::new(seed)
    };
    for draw in 0..8 {
        let found = compared(&[
            (Made::new(96_000 + draw), truth.clone()),
            (short(96_100 + draw), truth.clone()),
        ]);
        assert!(
            !matches!(
                found.grade,
                Grade::DifferAndMatter | Grade::DifferWithoutEffect
            ),
            "{:?}",
            found.reasons
        );
    }
    let heavy = truth.clone().with_payload(0.3, [0.3, 0.0]);
    let found = compared(&[
        (Made::new(96_201), truth.clone()),
        (Made::new(96_202), heavy),
        (short(96_203), truth),
    ]);
    assert_eq!(found.grade, Grade::DifferAndMatter, "{:?}", found.reasons);
}

/// Two sets that agree by chance: the standard error is not smaller than the errors within the sets allow, and Student's
/// t times it is half the interval.
#[test]
fn two_sets_that_agree_by_chance_have_no_smaller_standard_error() {
    let truth = Truth::default();
    let made = |s: u64| (Made::new(95_000 + s), truth.clone());
    for draw in 0..5 {
        let found = compared(&[made(2 * draw), made(2 * draw + 1)]);
        for p in &found.parameters {
            // The mean of two values with the smaller of their errors.
            let least = p.sets.iter().map(|v| v.std).fold(f64::INFINITY, f64::min) / 2f64.sqrt();
            assert!(p.std > 0.5 * least, "{}: {} {least}", p.expression, p.std);
            let half = p.std * t_quantile(p.degrees_of_freedom);
            assert!(
                (half / p.half_interval - 1.0).abs() < 1e-3,
                "{}",
                p.expression
            );
        }
    }
}
