#![allow(clippy::unwrap_used, clippy::panic)]

mod angles;
mod arms;
mod bias;
mod chains;
mod emps;
mod exact;
mod flawed;
mod judged;
mod late;
mod lwr4;
mod made;
mod position;
mod rate;
mod sticking;
mod still;
mod torque_scale;
mod tx40;

use super::*;
use rand::{RngExt, SeedableRng};
use rig_data::prepare::{Choice, InMemory, PrepareOptions};
use rig_data::{Block, JointColumns};
use rig_model::robot::{Joint, JointKind, Robot};

fn joint(kind: JointKind, alpha: f64) -> Joint {
    Joint::new("axis", kind, [alpha, 0.0, 0.0, 0.0])
}

/// A slide along the horizontal.
fn slide() -> Robot {
    Robot::new(
        "slide",
        vec![joint(JointKind::Prismatic, std::f64::consts::FRAC_PI_2)],
    )
}

/// A pendulum: axis horizontal, angle zero along the horizontal.
fn pendulum() -> Robot {
    Robot::new(
        "pendulum",
        vec![joint(JointKind::Revolute, std::f64::consts::FRAC_PI_2)],
    )
}

fn show(title: &str, found: &Identification) {
    let d = &found.details;
    println!(
        "== {title}: cut-off {:.2} Hz, decimation {}, rows {}, memory {:.1}, dof {}, cond {:.1} scaled {:.2}, motion {:.2} Hz, threshold {:?}, window {:?}",
        d.treatment.cutoff,
        d.treatment.decimation,
        d.estimate.rows,
        d.estimate.memory_rows,
        d.estimate.degrees_of_freedom,
        d.estimate.condition,
        d.estimate.scaled_condition,
        d.treatment.motion_frequency,
        d.treatment.speed_threshold,
        d.window.as_ref().map(|w| w.0)
    );
    println!("   {} | {:?}", d.treatment.cutoff_reason, d.masked);
    for b in &found.base_parameters {
        println!(
            "   {:10} {:10.4} ± {:.3} % (classical {:.3} %) [{:.4}, {:.4}] {}",
            b.expression,
            b.value,
            b.relative_std_percent,
            b.classical_relative_std_percent,
            b.interval[0],
            b.interval[1],
            b.unit
        );
    }
    for j in &found.joints {
        println!(
            "   train {:.4} ({:.3} %) hold-out {:?} ({:?})",
            j.train_residual_rms,
            100.0 * j.train_relative_error,
            j.holdout_residual_rms,
            j.holdout_relative_error
        );
    }
}
