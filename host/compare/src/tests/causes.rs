//! Causes that are named, each over several draws.

use super::made::{Made, Truth, compared};
use crate::{Comparison, Grade};

const DRAWS: u64 = 20;

/// Four sets, the third of another truth.
fn with_third(draw: u64, third: &Truth) -> Comparison {
    let list: Vec<_> = (0..4)
        .map(|s| {
            let truth = if s == 2 {
                third.clone()
            } else {
                Truth::default()
            };
            (Made::new(20_000 + 10 * draw + s), truth)
        })
        .collect();
    compared(&list)
}

/// Returns how often the cause is named, and the number of draws that were called different.
fn named(third: &Truth, name: &str) -> [u64; 2] {
    let mut counts = [0; 2];
    for draw in 0..DRAWS {
        let found = with_third(draw, third);
        let causes = found.causes.unwrap();
        counts[0] += u64::from(causes.named.as_deref() == Some(name));
        counts[1] += u64::from(matches!(
            found.grade,
            Grade::DifferAndMatter | Grade::DifferWithoutEffect
        ));
        if causes.named.as_deref() != Some(name) {
            println!("draw {draw}: {:?} {}", causes.named, causes.sentence);
        }
    }
    println!(
        "{name}: named in {} of {DRAWS}, different in {}",
        counts[0], counts[1]
    );
    counts
}

#[test]
fn a_torque_constant_that_changed_by_three_per_cent_is_named_scale() {
    let third = Truth {
        scale: 1.03,
        ..Truth::default()
    };
    let [scale, different] = named(&third, "scale");
    assert!(scale >= 18 && different == DRAWS, "{scale} {different}");
    let causes = with_third(0, &third).causes.unwrap();
    let found = causes
        .hypotheses
        .iter()
        .find(|h| h.name == "scale")
        .unwrap();
    let [value, std] = found.scales[2];
    assert!(
        (value - 1.03).abs() < 4.0 * std && std < 0.005,
        "{value} {std}"
    );
}

/// A factor at one joint makes the set's own equations contradict each other, and its errors large: that is no agreement, and
/// no other cause is named.
#[test]
fn a_torque_constant_of_one_joint_is_told_with_its_set() {
    for draw in 0..DRAWS {
        let mut list: Vec<_> = (0..3)
            .map(|s| (Made::new(30_000 + 10 * draw + s), Truth::default()))
            .collect();
        let told = |list: &[(Made, Truth)]| {
            let found = compared(list);
            let all = found.warnings.into_iter();
            all.filter(|own| own.contains("contradict each other"))
                .collect::<Vec<_>>()
        };
        assert_eq!(told(&list), Vec::<String>::new(), "draw {draw}");
        list[2].0.reads[1] = 1.10;
        let found = compared(&list);
        assert_ne!(found.grade, Grade::Agree, "{:?}", found.reasons);
        let named = found.causes.and_then(|own| own.named);
        assert_eq!(named, None, "draw {draw}");
        let said = told(&list);
        let [said] = &said[..] else {
            panic!("draw {draw}: {said:?}");
        };
        assert!(said.starts_with("Set set 2: "), "{said}");
        let (_, size) = said.split_once("that of second ").unwrap();
        let numbers: Vec<f64> = (size.split(' ').take(3))
            .filter_map(|word| word.parse().ok())
            .collect();
        let [factor, std] = numbers[..] else {
            panic!("{said}");
        };
        assert!((factor - 1.10).abs() < 4.0 * std && std < 0.01, "{said}");
    }
}

#[test]
fn friction_that_rose_by_a_fifth_is_named_friction() {
    let mut third = Truth::default();
    for f in &mut third.friction {
        f[0] *= 1.2;
        f[1] *= 1.2;
    }
    let [friction, different] = named(&third, "friction");
    assert!(
        friction >= 18 && different == DRAWS,
        "{friction} {different}"
    );
}

#[test]
fn a_payload_on_the_last_link_is_named_payload() {
    let third = Truth::default().with_payload(0.3, [0.3, 0.05]);
    let [payload, different] = named(&third, "payload");
    assert!(payload >= 18 && different == DRAWS, "{payload} {different}");
    let found = with_third(1, &third);
    assert_eq!(found.grade, Grade::DifferAndMatter);
    // The set that stands apart is told.
    assert!(
        found
            .reasons
            .iter()
            .any(|r| r.starts_with("Without set 2 the other sets do not differ"))
    );
}

#[test]
fn an_offset_of_one_joint_is_named_offset() {
    let mut third = Truth::default();
    third.friction[0][2] += 0.4;
    let [offset, different] = named(&third, "offset");
    assert!(offset >= 18 && different == DRAWS, "{offset} {different}");
}

/// A zero that is wrong by 0.02 rad in one set: that of the first joint turns the arm against gravity, that of the second one
/// bends it, which no parameters of the last link can stand for.
#[test]
fn a_zero_that_moved_is_named_with_its_joint_and_size() {
    for joint in 0..2 {
        let mut counts = [0, 0];
        for draw in 0..DRAWS {
            let sets = (0..4).map(|s| {
                let mut made = Made::new(40_000 + 10 * draw + s);
                made.zero[joint] = if s == 2 { 0.02 } else { 0.0 };
                (made, Truth::default())
            });
            let causes = compared(&sets.collect::<Vec<_>>()).causes.unwrap();
            let found = &causes.hypotheses[0];
            let is_named = causes.named.as_deref() == Some("zero") && found.joint == Some(joint);
            counts[0] += usize::from(is_named);
            if !is_named {
                println!("joint {joint}, draw {draw}: {}", causes.sentence);
                continue;
            }
            let [shift, std] = found.shifts[2];
            assert!(
                std < 2e-3 && (shift - 0.02).abs() < 5.0 * std,
                "{shift} {std}"
            );
            counts[1] += usize::from((shift - 0.02).abs() < 2.0 * std);
        }
        println!(
            "zero of joint {joint}: named in {} of {DRAWS}, within two standard deviations in {}",
            counts[0], counts[1]
        );
        assert!(counts[0] >= 18, "{counts:?}");
    }
}

/// Friction, scale and payload at once are none of the tested causes.
#[test]
fn several_changes_at_once_are_not_given_one_name() {
    let mut third = Truth {
        scale: 1.05,
        ..Truth::default()
    }
    .with_payload(0.3, [0.3, 0.05]);
    for f in &mut third.friction {
        f[0] *= 0.7;
    }
    for draw in 0..5 {
        let found = with_third(draw, &third);
        assert_eq!(found.causes.unwrap().named, None);
        assert_eq!(found.grade, Grade::DifferAndMatter);
    }
}

/// Friction that falls while a joint warms up is told, with its joint; friction that stays is not.
#[test]
fn friction_that_warms_up_within_a_recording_is_told() {
    let said = |draw: u64, third: &Truth| {
        let found = with_third(draw, third);
        let drifts = |reason: &&String| reason.contains("during the recordings of");
        let reasons: Vec<String> = found.reasons.iter().filter(drifts).cloned().collect();
        reasons
    };
    let cold = Truth {
        cold: [0.3, 8.0],
        ..Truth::default()
    };
    let (mut told, mut alarms) = (0, 0);
    for draw in 0..DRAWS {
        let found = said(draw, &cold);
        let of_third = |reason: &String| {
            reason.contains("falls") && reason.contains("of set 2,") && reason.contains("warms up")
        };
        told += u32::from(found.iter().any(of_third));
        alarms += found.iter().filter(|reason| !of_third(reason)).count();
        alarms += said(draw, &Truth::default()).len();
    }
    println!("told in {told} of {DRAWS}, {alarms} alarms");
    assert!(told >= 19, "{told}");
    assert!(alarms <= 1, "{alarms}");
}
