//! A torque of which only the magnitude was recorded.
//!
//! Such a torque is never negative though the joint turns both ways. A joint on which weight always pulls one way has such a torque
//! by itself; so the sense of every row is guessed and the joint fitted until both agree, and the trial decides whether the size of
//! what a robot needs predicts the recording better than what it needs.
//!
//! Leaves out: a sign that is lost above a level only.

use super::super::outcome::About;
use super::fit::Fit;
use super::model::Judge;
use super::senses::Described;
use super::trial::Suspicion;
use super::undo::Undo;

/// Share of the rows in motion that each way of turning has at least.
const BOTH_WAYS: f64 = 0.1;
/// Share of the fastest speed from which on a joint turns.
const TURNS: f64 = 0.05;
/// Share of the largest torque that noise may carry to the other side.
const NOISE: f64 = 0.02;
/// Share of the squares left as recorded that the signed torque has to leave at most to be suspected.
const LESS: f64 = 0.5;
/// Rounds of guessing and fitting.
const ROUNDS: usize = 20;

impl Judge<'_> {
    /// Joint `j`'s torque as one that has lost its sign, where it looks like that.
    pub(super) fn magnitude(&self, j: usize, described: Option<&Described>) -> Option<Suspicion> {
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
        // Friction's sense, and that of weight and inertia where they are described: which of them rules is not known.
        let begins = [Some(qd), described.map(|own| &own.all[j])];
        let (senses, left) = (begins.into_iter().flatten())
            .filter_map(|begin| self.senses_of(j, begin))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        let turned = senses.iter().filter(|s| **s < 0.0).count();
        let recorded = self.fits[j].as_ref()?.residual.norm_squared();
        if turned == 0 || left > LESS * recorded {
            return None;
        }
        let n = j + 1;
        let share = 100.0 * turned as f64 / senses.len() as f64;
        let fault = self.say(
            "magnitude",
            About::Torque,
            j,
            format!(
                "tau{n} is never negative though the joint turns both ways: it is a magnitude whose sign was lost (by the motion it should be negative for about {share:.0} % of the time). Record the signed torque or current; a register of load or current that is read as unsigned has the sign in its highest bit or in the two's complement.",
            ),
        );
        Some(Suspicion::new(fault, Undo::Magnitude(j, senses)))
    }

    /// The sense that the torque of joint `j` has in each row, where all that is known is its size: that of what is fitted to the
    /// torque with these senses, from that of `begin` on; and the squares that are left.
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
