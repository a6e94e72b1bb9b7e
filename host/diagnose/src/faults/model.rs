//! Faults of clocks, torque cuts and position scales, by a refitted simple model.

use crate::DiagnoseError;
use crate::faults::finding::Fault;
use crate::faults::fit::{Fit, Measured};
use crate::faults::judge::Judge;
use crate::faults::levels::{EXACT, GOOD, MUCH_BETTER, POOR, POOR_ALONE, TRIAL};
use crate::faults::misfit::Misfit;
use crate::faults::names;
use crate::faults::rows::Rows;
use crate::faults::suspicion::Suspicion;
use crate::faults::undo::Undo;
use rig_model::robot::JointKind;
use rig_numerics::statistics;

/// Ratio of residuals below which a trial is believed, if its own is below [`GOOD`] too.
const BETTER: f64 = 0.35;
/// Ratio of residuals below which a shift is suspected; the trial decides.
const LESS: f64 = 0.7;
/// Ratio to the least residual up to which a shift explains as much.
const NEAREST: f64 = 1.3;
/// The same as [`MUCH_BETTER`] for a small misfit.
const FAR_BETTER: f64 = 0.1;
/// Largest shift from filters and buses instead of clocks, s: half a row. The second is for several joints, whose many
/// parameters may prefer a small shift by chance.
const SHIFT: [f64; 2] = [0.01, 0.03];
/// Largest shift that counts as small, s.
const SMALL: f64 = 0.1;
/// Largest shift that is tried, s; at most a quarter of the recording.
const FARTHEST: f64 = 5.0;
/// Time in motion that shows a shift, as a multiple of it. A shift can explain any single short motion (the last second
/// of the Stäubli TX40's fifth joint).
const SHOWN_BY: f64 = 5.0;
/// Share of a joint's highest speed above which it moves.
const IN_MOTION: f64 = 0.05;
/// Least misfit of cut rows, in noises of the others, if all rows are fitted: the rows of a plateau in steps have one.
const MISFIT: f64 = 2.0;
/// Ratio of the levels of both sides up to which they are one limit.
const SAME_LIMIT: f64 = 1.02;
/// Position range above which a joint moves, rad or m.
const STIRS: f64 = 0.01;
/// Share of a joint's range by which a position may lie outside it: limits are described with some care.
const OUTSIDE: f64 = 0.2;

impl Judge<'_> {
    /// Returns a fault if a torque was cut where the motion needs more: it piles up at its extreme value, a fit to the
    /// other rows exceeds that there, and no parameters fit all rows as well. The last tells a cut from plateaus of
    /// friction in coarse steps: without those the other rows determine friction hardly, and predict anything there
    /// (Chow 1960, "Tests of equality between sets of coefficients in two linear regressions").
    pub(crate) fn clipped(&self, j: usize) -> Option<Fault> {
        let cut = &self.rows.cut[j];
        let (at, others): (Vec<usize>, Vec<usize>) = (0..cut.len()).partition(|k| cut[*k] > 0.5);
        if at.len() < 10 || 50 * at.len() < cut.len() {
            return None;
        }
        let tau = &self.rows.tau[j];
        // Rows with part of a cut belong to neither.
        let free: Vec<usize> = others.into_iter().filter(|k| cut[*k] == 0.0).collect();
        let rest: Vec<f64> = free.iter().map(|k| tau[*k]).collect();
        let fit = Fit::of(&self.matrices[j].select_rows(&free), &rest, &self.order)?;
        let noise = (fit.residual.norm_squared() / rest.len() as f64).sqrt();
        let whole = &self.fits[j].as_ref()?.residual;
        let squares = |rows: &[usize]| rows.iter().map(|k| whole[*k].powi(2)).sum::<f64>();
        let more = squares(&at) + squares(&free) - fit.residual.norm_squared();
        if more < (MISFIT * noise).powi(2) * at.len() as f64 {
            return None;
        }
        let beyond = fit.predict(&self.matrices[j].select_rows(&at));
        let middle = 0.5 * (extreme(tau, f64::max) + extreme(tau, f64::min));
        let excess = at
            .iter()
            .zip(&beyond)
            .map(|(k, predicted)| (predicted - tau[*k]) * (tau[*k] - middle).signum())
            .sum::<f64>()
            / at.len() as f64;
        let level = level(at.iter().map(|k| tau[*k]).collect(), middle);
        let found = Misfit::Clipped {
            level,
            excess,
            percent: 100.0 * at.len() as f64 / cut.len() as f64,
        };
        (excess > 3.0 * noise / (at.len() as f64).sqrt() && excess > noise.max(0.05 * level.abs()))
            .then(|| Fault::of_joint(j, found))
    }

    /// Suspects a torque that is shifted in time against the motion. The shift must explain the rows in motion too:
    /// friction at standstill lies anywhere between its two limits, and a shift explains some of it by chance.
    pub(crate) fn shifted(&self, j: usize) -> Option<Suspicion> {
        let fit = self.fits[j].as_ref()?;
        if fit.unexplained() < POOR_ALONE {
            return None;
        }
        let time = self.rows.len() as f64 * self.rows.period;
        let reach = (FARTHEST.min(0.25 * time) / self.rows.period) as usize;
        let tau = &self.rows.tau[j];
        let left = fit.unexplained_moved(tau, reach, &vec![true; tau.len()])?;
        let least = left.iter().copied().fold(f64::INFINITY, f64::min);
        if left[reach] < POOR_ALONE || least > LESS * left[reach] {
            return None;
        }
        // For a periodic motion, the nearest period.
        let at = (0..left.len())
            .filter(|k| left[*k] <= NEAREST * least)
            .min_by_key(|k| k.abs_diff(reach))?;
        let shift = (at as f64 - reach as f64) * self.rows.period;
        if shift.abs() <= SMALL && least > BETTER * left[reach] {
            return None;
        }
        let speed = &self.rows.qd[j];
        let fastest = speed.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let moving: Vec<bool> = (speed.iter())
            .map(|v| v.abs() > IN_MOTION * fastest)
            .collect();
        let in_motion = fit.unexplained_moved(tau, reach, &moving)?;
        let time = moving.iter().filter(|moves| **moves).count() as f64 * self.rows.period;
        // A delay is the same at all speeds, to the row.
        let best = in_motion.iter().copied().fold(f64::INFINITY, f64::min);
        let there = in_motion[at.saturating_sub(1)..(at + 2).min(in_motion.len())].iter();
        let there = there.copied().fold(f64::INFINITY, f64::min);
        let agree = there < LESS * in_motion[reach] && there <= NEAREST * best;
        let shown = agree && time > SHOWN_BY * shift.abs();
        (shift.abs() > SHIFT[usize::from(self.robot.joints.len() > 1)] && shown).then(|| {
            let left = [left[reach], least];
            let fault = Fault::of_joint(j, Misfit::Shifted { shift, left });
            Suspicion::new(fault, Undo::Earlier(j, at as i64 - reach as i64))
        })
    }

    /// Suspects positions that gravity and coupling show as multiples of the joint's.
    pub(crate) fn positions(&self) -> Result<Vec<Suspicion>, DiagnoseError> {
        let n = self.robot.joints.len();
        let left: Vec<f64> = self
            .fits
            .iter()
            .map(|f| f.as_ref().map_or(0.0, Fit::unexplained))
            .collect();
        let mean = statistics::mean_or_zero;
        // For a single joint, whose gravity has a period, any residual may show a factor.
        let poor = if n == 1 { EXACT } else { POOR };
        if left.iter().all(|u| *u < poor) {
            return Ok(Vec::new());
        }
        let rows = self.rows.thinned(TRIAL);
        let try_out = |joint: Option<usize>, factor: f64| -> Result<Vec<f64>, DiagnoseError> {
            let moved = rows.rescaled(joint, factor);
            let matrices = moved.regressors(&self.form)?;
            let fits = matrices.iter().zip(&moved.tau);
            Ok(fits
                .map(|(x, y)| Fit::of(x, y, &self.order).map_or(1.0, |f| f.unexplained()))
                .collect())
        };
        if n > 1 && mean(&left) > POOR {
            let factor = 1.0 / 57.296;
            let all = mean(&try_out(None, factor)?);
            if all < BETTER * mean(&left) && all < GOOD {
                return Ok((0..n)
                    .map(|j| self.scaled(j, &[factor], [mean(&left), all]))
                    .collect());
            }
        }
        let mut found = Vec::new();
        for j in (0..n).filter(|j| left[*j] > poor) {
            if self.robot.joints[j].kind == JointKind::Prismatic && n == 1 {
                continue;
            }
            let mut tried: Vec<(f64, f64)> = Vec::new();
            for factor in self.factors(j).into_iter().filter(|f| self.reaches(j, *f)) {
                let all = try_out(Some(j), factor)?;
                let own = all[j];
                // A factor of up to 1.4 is left to effects.
                let far = factor < 0.0 || f64::ln(factor).abs() > f64::ln(1.4);
                let unit = !(0.4..2.5).contains(&factor) && factor > 0.0;
                let least = match unit {
                    true => BETTER,
                    false if left[j] < POOR => FAR_BETTER,
                    false => MUCH_BETTER,
                };
                if far && own < GOOD && own < least * left[j] && mean(&all) < mean(&left) {
                    tried.push((factor, own));
                }
            }
            let least = tried
                .iter()
                .map(|(_, own)| *own)
                .fold(f64::INFINITY, f64::min);
            // Over a small range gravity is a parabola for every smaller factor too. A described inertia decides.
            tried.retain(|(_, own)| *own <= 1.5 * least + 0.002);
            let mut misses = Vec::new();
            for (factor, own) in tried {
                misses.push((
                    self.misses(&rows.rescaled(Some(j), factor), j)?,
                    factor,
                    own,
                ));
            }
            let nearest = misses
                .iter()
                .map(|(m, ..)| *m)
                .fold(f64::INFINITY, f64::min);
            misses.retain(|(m, ..)| *m <= nearest + f64::ln(3.0));
            misses.sort_by(|a, b| a.2.total_cmp(&b.2));
            if let Some((.., own)) = misses.first() {
                let factors: Vec<f64> = misses.iter().map(|(_, factor, _)| *factor).collect();
                found.push(self.scaled(j, &factors, [left[j], *own]));
            }
        }
        Ok(found)
    }

    /// Returns the distance of these rows' gravity and inertia from the described, as the sum of their logarithms; 0 if
    /// none is described.
    fn misses(&self, rows: &Rows, j: usize) -> Result<f64, DiagnoseError> {
        let (gravity, inertia) = self.scales(rows, j, self.stated(rows, j)?.as_ref());
        let miss = |m: Option<Measured>| m.map_or(0.0, |m| m.value.abs().max(1e-9).ln().abs());
        Ok(miss(gravity) + miss(inertia))
    }

    /// Returns true if a joint moves enough to show the sense of friction and inertia; a held joint gives way a little.
    pub(crate) fn stirs(&self, j: usize) -> bool {
        let q = &self.rows.q[j];
        extreme(q, f64::max) - extreme(q, f64::min) > STIRS
    }

    /// Returns true if the joint's limits allow its recorded position times `factor`. Otherwise the torque depends on
    /// such a multiple for another reason, as with an eccentric gear once a motor turn.
    pub(crate) fn reaches(&self, j: usize, factor: f64) -> bool {
        let limits = self.robot.joints[j].limits.as_ref();
        limits.map(|l| l.position).is_none_or(|[low, high]| {
            let more = OUTSIDE * (high - low);
            let mut places = self.rows.q[j].iter().map(|q| factor * q);
            places.all(|q| (low - more..=high + more).contains(&q))
        })
    }

    /// Returns the factors that are tried for a joint's position.
    fn factors(&self, j: usize) -> Vec<f64> {
        if self.robot.joints.len() == 1 {
            // In steps of 3 %: finer than gravity's period over a turn needs.
            return (-160..=160).map(|k| 1.03f64.powi(k)).collect();
        }
        let mut list = names::factors_of_position(&self.robot.joints[j]);
        list.push(-1.0);
        list
    }

    /// Suspects a scaled position and names it by the best factor with a name. `left` are residual variance shares as
    /// recorded and without the fault.
    pub(crate) fn scaled(&self, j: usize, factors: &[f64], left: [f64; 2]) -> Suspicion {
        let named = factors
            .iter()
            .find_map(|f| Some((*f, names::of_position(&self.robot.joints[j], *f)?)));
        let best = factors.first().copied().unwrap_or(1.0);
        let reversed = best < 0.0;
        let (factor, name) = match named {
            Some((factor, name)) if !reversed => (factor, Some(name)),
            other => (best, other.map(|(_, name)| name)),
        };
        let found = Misfit::Scaled {
            factor,
            reversed,
            name,
            left,
        };
        let fault = Fault::of_joint(j, found);
        Suspicion::new(fault, Undo::Position(Some(j), factor))
    }
}

fn extreme(values: &[f64], of: fn(f64, f64) -> f64) -> f64 {
    values.iter().copied().reduce(of).unwrap_or(0.0)
}

/// Returns the torque at which these rows stand: that of the side with more rows, or the size if both sides have one.
fn level(torques: Vec<f64>, middle: f64) -> f64 {
    let sizes: Vec<f64> = torques.iter().map(|v| v.abs()).collect();
    let (above, below): (Vec<f64>, Vec<f64>) = torques.into_iter().partition(|v| *v > middle);
    if above.is_empty() || below.is_empty() {
        return statistics::mean(if above.is_empty() { &below } else { &above });
    }
    let (high, low) = (statistics::mean(&above), statistics::mean(&below));
    match (-high / low).ln().abs() < SAME_LIMIT.ln() {
        true => statistics::mean(&sizes),
        false if above.len() >= below.len() => high,
        false => low,
    }
}
