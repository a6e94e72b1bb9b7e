//! Recordings of a clamped joint. A motor at rest has no back-EMF and no friction losses, so its voltage depends on its
//! current alone.
//!
//! Leaves out: motion of the joint within its clamp.

use crate::DiagnoseError;
use crate::error::NotClamped;
use rig_data::prepare::Recording;
use rig_data::runs::{Run, at_rest};

/// Largest motion of a joint within its clamp, rad or m. A motor behind a gear of 100 turns 0.5 rad then, at a speed
/// with negligible back-EMF.
const GIVES: f64 = 5e-3;

/// Returns the recording stretch by stretch.
///
/// # Errors
/// [`DiagnoseError::Clamped`] if a joint moves or no voltage was recorded; errors of reading.
pub fn clamped(recording: &dyn Recording) -> Result<Vec<Run>, DiagnoseError> {
    let wrong = |what: NotClamped| DiagnoseError::Clamped {
        label: recording.label(),
        what: what.to_string(),
    };
    let runs = at_rest(recording)?;
    for run in &runs {
        for (j, joint) in run.joints.iter().enumerate() {
            let (low, high) = (joint.q_raw.iter())
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| {
                    (low.min(*q), high.max(*q))
                });
            if high - low > GIVES {
                return Err(wrong(NotClamped::Moves {
                    joint: j + 1,
                    low,
                    high,
                }));
            }
        }
    }
    if !(runs.iter().flat_map(|run| &run.joints)).any(|joint| joint.voltage.is_some()) {
        return Err(wrong(NotClamped::NoVoltage));
    }
    Ok(runs)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rig_data::prepare::InMemory;
    use rig_data::{Block, JointColumns};

    fn recorded(q: impl Fn(f64) -> f64, voltage: bool) -> InMemory {
        let t: Vec<f64> = (0..500).map(|k| k as f64 * 2e-3).collect();
        InMemory {
            label: "held.csv".into(),
            blocks: vec![Block {
                joints: vec![JointColumns {
                    q: t.iter().map(|t| q(*t)).collect(),
                    tau: t.iter().map(|t| t.sin()).collect(),
                    voltage: voltage.then(|| t.iter().map(|t| 2.0 * t.sin()).collect()),
                    ..JointColumns::default()
                }],
                t,
                ..Block::default()
            }],
        }
    }

    #[test]
    fn a_moving_joint_and_a_missing_voltage_are_refused_by_name() {
        let runs = clamped(&recorded(|t| 1.0 + 1e-3 * t, true)).unwrap();
        assert!((runs[0].rate - 500.0).abs() < 1e-6);
        assert!(runs[0].joints[0].qd.iter().all(|v| *v == 0.0));
        let said = |recording| clamped(&recording).unwrap_err().to_string();
        let text = said(recorded(|t| 0.1 * t, true));
        assert!(
            text.contains("held.csv") && text.contains("joint 1 goes from 0.0000 to 0.0998"),
            "{text}"
        );
        let text = said(recorded(|_| 0.0, false));
        assert!(text.contains("no motor voltage"), "{text}");
    }
}
