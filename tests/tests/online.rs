//! On-line identification on the emulated rig: intervals that hold what they claim, and estimates that stay put.
#![allow(clippy::unwrap_used, clippy::panic)]

use rig_shared::link::PARAMETER_NAMES;
use rig_tests::{bench, deviations, driven, excitation, in_parallel};

/// Rigs of the coverage study.
const RIGS: u64 = 200;

#[test]
fn intervals_cover_the_truth_as_often_as_they_claim() {
    let outcomes = in_parallel(RIGS, |seed| {
        let (mut line, plant) = bench(seed);
        let first = driven(&mut line, vec![], excitation(2 * seed, 5, 5), 0.5);
        let second = driven(&mut line, vec![], excitation(2 * seed + 1, 5, 5), 0.5);
        assert_eq!(
            (&first.faults[..], &second.faults[..]),
            (&[][..], &[][..]),
            "seed {seed}"
        );
        let estimate = second.estimate();
        (deviations(&estimate, &plant), estimate)
    });
    let mut text = String::from("parameter   trusted  covered  mean z  rms z   mean std\n");
    let mut fair = true;
    for k in 0..6 {
        let trusted: Vec<_> = outcomes.iter().filter(|(_, e)| e.trusted[k]).collect();
        let n = trusted.len() as f64;
        let covered = trusted.iter().filter(|(z, _)| z[k].abs() <= 1.96).count() as f64 / n;
        let mean = trusted.iter().map(|(z, _)| z[k]).sum::<f64>() / n;
        let rms = (trusted.iter().map(|(z, _)| z[k] * z[k]).sum::<f64>() / n).sqrt();
        let std = trusted
            .iter()
            .map(|(_, e)| f64::from(e.std[k]))
            .sum::<f64>()
            / n;
        text += &format!(
            "{:<10} {:>7.1} % {:>6.1} % {mean:>7.2} {rms:>6.2} {std:>10.6}\n",
            PARAMETER_NAMES[k],
            100.0 * n / RIGS as f64,
            100.0 * covered
        );
        fair &= n >= 0.95 * RIGS as f64 && (0.90..=0.985).contains(&covered);
    }
    println!("{text}");
    assert!(fair, "\n{text}");
}
