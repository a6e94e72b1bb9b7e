//! Effect of one joint's position error on the torque of all joints.
//!
//! A position error e(t) is also a velocity error ė and an acceleration error ë. To first order the torque changes by
//! its slopes along the three. They depend on the motion only, and serve every wave of an error.

use crate::DiagnoseError;
use crate::rows::motion::motion_of;
use crate::rows::nominal::Nominal;
use crate::rows::regression::Column;
use rig_data::prepare::{central_difference, second_difference};
use rig_data::runs::Run;

/// Step of the difference quotients, rad (rad/s, rad/s²), m on a prismatic joint. Small against every wave of the
/// motion; rounding stays below 10⁻¹⁰ of the torque's range.
const NUDGE: f64 = 1e-5;

/// Slopes of the torque of all joints along one joint's position, velocity and acceleration over a run.
#[derive(Clone, Debug)]
pub(crate) struct Slopes {
    /// By derivative, joint and sample.
    along: [Vec<Vec<f64>>; 3],
}

impl Slopes {
    /// Computes the slopes along joint `joint` over `run`, from base parameters.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn of(
        nominal: &Nominal,
        values: &[f64],
        joint: usize,
        run: &Run,
    ) -> Result<Self, DiagnoseError> {
        let mut motion = motion_of(run);
        let still = smooth_torque(nominal, values, &motion)?;
        let mut along = [(); 3].map(|()| Vec::new());
        for (derivative, along) in along.iter_mut().enumerate() {
            let measured = motion[derivative][joint].clone();
            for x in &mut motion[derivative][joint] {
                *x += NUDGE;
            }
            let mut moved = smooth_torque(nominal, values, &motion)?;
            motion[derivative][joint] = measured;
            for (moved, still) in moved.iter_mut().zip(&still) {
                for (m, s) in moved.iter_mut().zip(still) {
                    *m = (*m - s) / NUDGE;
                }
            }
            *along = moved;
        }
        Ok(Self { along })
    }

    /// Returns the torque change for a reading with `error`, sampled every `period` s: the true position is smaller.
    pub(crate) fn misread(&self, error: &[f64], period: f64) -> Column {
        let changes = [
            error.to_vec(),
            central_difference(error, period),
            second_difference(error, period),
        ];
        (0..self.along[0].len())
            .map(|j| {
                let mut torque = vec![0.0; error.len()];
                for (along, change) in self.along.iter().zip(&changes) {
                    for ((to, slope), e) in torque.iter_mut().zip(&along[j]).zip(change) {
                        *to -= slope * e;
                    }
                }
                Some(torque)
            })
            .collect()
    }
}

/// Returns the torque of the nominal model for a motion without Coulomb friction: a small position error does not
/// change its direction.
fn smooth_torque(
    nominal: &Nominal,
    values: &[f64],
    motion: &[Vec<Vec<f64>>; 3],
) -> Result<Vec<Vec<f64>>, DiagnoseError> {
    let samples = motion[0].first().map_or(0, Vec::len);
    let mut torque = vec![vec![0.0; samples]; nominal.joints()];
    let motion = [&motion[0][..], &motion[1][..], &motion[2][..]];
    nominal.columns(motion, &mut |k, j, column| {
        if nominal.is_coulomb(k) {
            return;
        }
        for (to, y) in torque[j].iter_mut().zip(column) {
            *to += values[k] * y;
        }
    })?;
    Ok(torque)
}
