//! A torque that is late or early against the motion.
//!
//! The torque is moved row by row against the regressor. Presliding friction looks like a delay, as it builds up over
//! the travel after a reversal, which takes time in a slow motion. Only a delay is the same time at every reversal, for
//! gravity and inertia too. Both are therefore compared: elements that yield like springs and then slide (Al-Bender,
//! Lampaert & Swevers 2005, "The generalized Maxwell-slip model") are fitted to the torque at its own time and to the
//! moved one, and the moved one must still be much better.
//!
//! Leaves out: delays of less than a row; a delay of dry friction alone, which travel explains as well.

use crate::faults::finding::Fault;
use crate::faults::fit::Fit;
use crate::faults::judge::Judge;
use crate::faults::levels::BETTER;
use crate::faults::misfit::Misfit;
use crate::faults::suspicion::Suspicion;
use crate::faults::undo::Undo;

/// Residual share of the torque's variance above which a delay is searched; many parameters of a slow arm compensate
/// most of one.
const POOR: f64 = 0.01;
/// Ratio of residuals below which a shift is suspected; the trial decides.
const LESS: f64 = 0.7;
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
/// Travel after which an element of presliding friction slides, rad or m: short strokes of gears by factors of four.
const STROKES: [f64; 4] = [5e-4, 2e-3, 8e-3, 3.2e-2];

impl Judge<'_> {
    /// Suspects a torque that is shifted in time against the motion.
    pub(crate) fn shifted(&self, j: usize) -> Option<Suspicion> {
        let fit = self.fits[j].as_ref()?;
        if fit.unexplained() < POOR {
            return None;
        }
        let time = self.rows.len() as f64 * self.rows.period;
        let reach = (FARTHEST.min(0.25 * time) / self.rows.period) as usize;
        let left = fit.unexplained_moved(&self.rows.tau[j], reach)?;
        let least = left.iter().copied().fold(f64::INFINITY, f64::min);
        if left[reach] < POOR || least > LESS * left[reach] {
            return None;
        }
        // For a periodic motion, the nearest period.
        let at = (0..left.len())
            .filter(|k| left[*k] <= 1.3 * least)
            .min_by_key(|k| k.abs_diff(reach))?;
        let shift = (at as f64 - reach as f64) * self.rows.period;
        let much = if shift.abs() <= SMALL { BETTER } else { LESS };
        if least > much * left[reach] {
            return None;
        }
        let several = usize::from(self.robot.joints.len() > 1);
        if shift.abs() <= SHIFT[several] || !self.shows(j, shift) || self.is_travel(j, reach, much)
        {
            return None;
        }
        let left = [left[reach], least];
        let fault = Fault::of_joint(j, Misfit::Shifted { shift, left });
        let by = at as i64 - reach as i64;
        Some(Suspicion::new(fault, Undo::Earlier(j, by)))
    }

    /// Returns true if joint `j` moves long enough to show a shift, s.
    fn shows(&self, j: usize, shift: f64) -> bool {
        let speed = &self.rows.qd[j];
        let fastest = speed.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let moving = speed.iter().filter(|v| v.abs() > IN_MOTION * fastest);
        moving.count() as f64 * self.rows.period > SHOWN_BY * shift.abs()
    }

    /// Returns true if presliding friction explains the torque of joint `j` so well at its own time that no shift of up
    /// to `reach` rows reduces its residual to the share `much`.
    fn is_travel(&self, j: usize, reach: usize, much: f64) -> bool {
        let tau = &self.rows.tau[j];
        let links = &self.matrices[j];
        let width = links.ncols();
        let mut matrix = links
            .clone()
            .resize_horizontally(width + STROKES.len(), 0.0);
        for (k, stroke) in STROKES.into_iter().enumerate() {
            let friction = presliding(&self.rows.q[j], stroke);
            matrix.column_mut(width + k).copy_from_slice(&friction);
        }
        let mut order = self.order.clone();
        order.extend(width..width + STROKES.len());
        let left = Fit::of(&matrix, tau, &order).and_then(|fit| fit.unexplained_moved(tau, reach));
        left.is_some_and(|left| {
            let least = left.iter().copied().fold(f64::INFINITY, f64::min);
            left[reach] < POOR || least > much * left[reach]
        })
    }
}

/// Returns the friction of an element that slides after `stroke`, −1 to 1. It begins as if it had always moved on.
fn presliding(q: &[f64], stroke: f64) -> Vec<f64> {
    let moved = |pair: &[f64]| pair[1] - pair[0];
    let mut steps = q.windows(2).map(moved);
    let mut state = steps.find(|step| *step != 0.0).map_or(0.0, f64::signum);
    let mut before = q.first().copied().unwrap_or(0.0);
    (q.iter())
        .map(|now| {
            state = (state + (now - before) / stroke).clamp(-1.0, 1.0);
            before = *now;
            state
        })
        .collect()
}
