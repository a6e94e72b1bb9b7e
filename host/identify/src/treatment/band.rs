//! The frequency up to which the model explains the torque.

use crate::error::IdentifyError;
use crate::estimators::linear::weighted_minimum_norm;
use crate::options::ModelKind;
use crate::rows::factor::TriangularFactor;
use crate::rows::plan::Plan;
use crate::rows::stream::each_rows;
use rig_data::prepare::{Recording, Welch};
use rig_numerics::vector::dot_in_order;

/// Share of the torque's power that may stay unexplained: one half, at equal power of signal and residual.
const UNEXPLAINED: f64 = 0.5;

/// Returns the frequency up to which the model explains at least half of the torque's power on some joint, Hz. None if
/// the rows are too few for a spectrum or the whole band is explained. Above it the torque is noise, vibration and the
/// controller's response to its sensors, and rows with it only weaken the fit.
pub(crate) fn explained_band(
    training: &[&dyn Recording],
    plan: &Plan,
) -> Result<Option<f64>, IdentifyError> {
    let joints = plan.chain.joint_count();
    let p = plan.columns.len();
    let mut factors = vec![TriangularFactor::new(p); joints];
    let mut instants = 0usize;
    for recording in training {
        each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
            instants += rows.t.len();
            for (factor, equation) in factors.iter_mut().zip(&rows.equations) {
                for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                    factor.push(&equation.x[i * p..(i + 1) * p], equation.y[i], 1.0);
                }
            }
            Ok(())
        })?;
    }
    let weights: Vec<f64> = (factors.iter())
        .map(|f| (f.rows().max(1) as f64 / f.right_side_squares()).sqrt())
        .map(|weight| if weight.is_finite() { weight } else { 0.0 })
        .collect();
    let Some(beta) = weighted_minimum_norm(&factors, &weights) else {
        return Ok(None);
    };
    let segment = (1usize << (instants / 4).max(16).ilog2()).min(1024);
    let mut spectra: Vec<[Welch; 2]> = (0..joints)
        .map(|_| [Welch::new(segment), Welch::new(segment)])
        .collect();
    for recording in training {
        for [torque, rest] in &mut spectra {
            torque.interrupt();
            rest.interrupt();
        }
        each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
            for (equation, [torque, rest]) in rows.equations.iter().zip(&mut spectra) {
                for (i, y) in equation.y.iter().enumerate() {
                    let e = y - dot_in_order(&equation.x[i * p..(i + 1) * p], beta.as_slice());
                    torque.push(*y);
                    rest.push(e);
                }
            }
            Ok(())
        })?;
    }
    let rate = plan.treatment.kept_rate();
    let band = spectra
        .iter()
        .filter_map(|[torque, rest]| {
            let ((f, whole), (_, left)) = (torque.density(rate)?, rest.density(rate)?);
            Some(explained(&f, &whole, &left))
        })
        .reduce(f64::max);
    Ok(band.filter(|f| *f < plan.treatment.parallel_edge))
}

/// Returns the first frequency above which, over half an octave, more than [`UNEXPLAINED`] of the power is residual.
fn explained(frequency: &[f64], whole: &[f64], left: &[f64]) -> f64 {
    (0..frequency.len())
        .find(|&k| {
            let end = (((k as f64 + 1.0) * 1.4) as usize).clamp(k + 1, frequency.len());
            left[k..end].iter().sum::<f64>() > UNEXPLAINED * whole[k..end].iter().sum::<f64>()
        })
        .map_or(f64::INFINITY, |k| frequency[k])
}
