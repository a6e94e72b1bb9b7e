//! What the recordings hold.

use super::*;

#[test]
#[ignore = "prints a measurement"]
fn sizes_of_the_effects() {
    let start = std::time::Instant::now();
    Scenario::of(&[], 1).unwrap().make().unwrap();
    println!("240 s recorded in {:.2} s", start.elapsed().as_secs_f64());
    for name in Effect::names() {
        for seed in 1..=3 {
            let scenario = Scenario::of(&[name], seed).unwrap();
            let size = scenario.size().unwrap();
            println!(
                "{name:22} {:.4} {:.4} floor {:.4} {} {:?}",
                size.excess_rms,
                size.frozen_rms,
                size.floor_rms,
                size.above_floor(),
                scenario.hidden[0].effect
            );
        }
    }
}
