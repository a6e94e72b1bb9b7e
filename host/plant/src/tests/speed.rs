//! Time per substep, printed on demand: `cargo test -p rig-plant tests::speed -- --ignored --nocapture`.

use std::time::Instant;

use super::{Plant, PlantConfig, drive, shake};
use crate::effect::transmission::Elasticity;

#[test]
#[ignore = "prints a measurement"]
fn nanoseconds_per_substep() {
    let mut elastic = PlantConfig::default();
    elastic.mechanism.elasticity = Some(Elasticity {
        stiffness: 3000.0,
        hardening: 0.0,
        damping: 2.0,
    });
    for (name, config) in [
        ("rigid", PlantConfig::default()),
        ("elastic", elastic),
        (
            "rigid, 40 substeps",
            PlantConfig {
                substeps: 40,
                ..PlantConfig::default()
            },
        ),
    ] {
        let mut best = f64::INFINITY;
        for _ in 0..5 {
            let mut plant = Plant::new(config.clone(), 1);
            let ticks = 100_000;
            let start = Instant::now();
            for k in 0..ticks {
                plant.advance(drive(shake(f64::from(k) * 1.0e-4)));
            }
            let each = start.elapsed().as_secs_f64() / f64::from(ticks);
            assert!(plant.truth().position.is_finite());
            best = best.min(each * 1.0e9);
        }
        println!(
            "{name}: {:.1} ns per substep, {best:.0} ns per tick",
            best / f64::from(config.substeps)
        );
    }
}
