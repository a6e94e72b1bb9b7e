//! Torques recorded as magnitudes.
//!
//! Such a torque is never negative although the joint turns both ways. A joint with weight on one side has such a
//! torque by itself. So the sense of every row is guessed and the joint fitted until both agree. The trial then decides
//! whether the magnitude of the model's torque predicts the recording better.
//!
//! Leaves out: a sign that is lost only above a level.

use crate::faults::described::Described;
use crate::faults::finding::Fault;
use crate::faults::fit::Fit;
use crate::faults::judge::Judge;
use crate::faults::misfit::Misfit;
use crate::faults::suspicion::Suspicion;
use crate::faults::undo::Undo;

/// Least share of the moving rows in each direction.
const BOTH_WAYS: f64 = 0.1;
/// Share of the highest speed above which a joint turns.
const TURNS: f64 = 0.05;
/// Share of the largest torque by which noise may reach the other sign.
const NOISE: f64 = 0.02;
/// Ratio of squared residuals below which a signed torque is suspected.
const LESS: f64 = 0.5;
/// Rounds of guess and fit.
const ROUNDS: usize = 20;

impl Judge<'_> {
    /// Suspects that joint `j`'s torque lost its sign.
    pub(crate) fn magnitude(&self, j: usize, described: Option<&Described>) -> Option<Suspicion> {
        let (tau, qd) = (&self.rows.tau[j], &self.rows.qd[j]);
        let most = tau.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let least = tau.iter().copied().fold(f64::INFINITY, f64::min);
        let fastest = qd.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let turning = |sense: f64| {
            let way = qd.iter().filter(|v| sense * **v > TURNS * fastest);
            way.count() as f64
        };
        let (forth, back) = (turning(1.0), turning(-1.0));
        let both = forth.min(back) > BOTH_WAYS * (forth + back);
        if most == 0.0 || least < -NOISE * most || !both {
            return None;
        }
        // Starts from the sense of friction, and of described weight and inertia: which dominates is unknown.
        let begins = [Some(qd), described.map(|own| &own.all[j])];
        let (senses, left) = (begins.into_iter().flatten())
            .filter_map(|begin| self.senses_of(j, begin))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        let turned = senses.iter().filter(|s| **s < 0.0).count();
        let recorded = self.fits[j].as_ref()?.residual.norm_squared();
        if turned == 0 || left > LESS * recorded {
            return None;
        }
        let percent = 100.0 * turned as f64 / senses.len() as f64;
        let fault = Fault::of_joint(j, Misfit::Magnitude { percent });
        Some(Suspicion::new(fault, Undo::Magnitude(j, senses)))
    }

    /// Returns the sense of joint `j`'s torque in each row if only its size is known, and the squared residual. It
    /// starts from `begin` and repeats the fit with the fitted senses.
    fn senses_of(&self, j: usize, begin: &[f64]) -> Option<(Vec<f64>, f64)> {
        let tau = &self.rows.tau[j];
        let mut senses: Vec<f64> = begin.iter().map(|v| sense(*v)).collect();
        let mut left = f64::INFINITY;
        for _ in 0..ROUNDS {
            let signed: Vec<f64> = tau.iter().zip(&senses).map(|(t, s)| t * s).collect();
            let fit = Fit::of(&self.matrices[j], &signed, &self.order)?;
            left = fit.residual.norm_squared();
            let next: Vec<f64> = (fit.predict(&self.matrices[j]).iter())
                .map(|p| sense(*p))
                .collect();
            if next == senses {
                break;
            }
            senses = next;
        }
        Some((senses, left))
    }
}

fn sense(x: f64) -> f64 {
    if x < 0.0 { -1.0 } else { 1.0 }
}
