//! Checks that a sweep fits the identified gravity and inertia, and that its map can be friction.
//!
//! The map is the sweep's torque minus identified gravity and inertia. It is friction only if torque and position share
//! one clock and both recordings have the same scales. Within a pass friction is constant and gravity changes, which
//! shows the scale. The whole model over all passes and the ramps between them shows the clock.

use super::map::{FrictionFit, FrictionPoint};
use super::rows::{PARTS, Rows, tenths};
use crate::uncertainty::estimate::t_quantile;
use rig_numerics::statistics::mean;
use rig_numerics::vector::dot_in_order;
use rig_output::{format_significant, format_value};

/// Largest searched shift between torque and position, s.
const LONGEST: f64 = 0.2;
/// Share of the highest speed above which a row is used for the clock test. Below it the friction model is wrong.
const IN_MOTION: f64 = 0.05;
/// Number of rows compared at each shift; more rows only take more time.
const MOST: usize = 20_000;
/// Largest ratio of the residual variance with the shift to the one as recorded. The clock test of fitted recordings
/// has the same value.
const LESS: f64 = 0.7;
/// Relative deviation of the sweep's gravity from the identified one above which the scales differ. Sound sweeps of 5
/// emulated rigs deviate by up to 0.009; the smallest mistake of a unit or a ratio is a factor of 1.3.
const OTHER_SCALE: f64 = 0.1;
/// Number of standard deviations by which a value must exceed its limit.
const CLEAR: f64 = 3.0;
/// Share of the torque variance within passes that a scaled gravity must explain to be called scaled.
const FOLLOWS: f64 = 0.5;

/// A torque that was recorded by another clock than the position.
pub(super) struct Late {
    /// Delay of the torque behind the position, s; negative if it is ahead.
    pub by: f64,
    /// Share of the torque variance that the model leaves as recorded.
    pub recorded: f64,
    /// The same with the shifted torque.
    pub moved: f64,
}

impl Rows {
    /// Finds the torque shift with the smallest residual; none if the recorded torque fits about as well.
    pub(super) fn late(&self) -> Option<Late> {
        let t = &self.position.t;
        let fastest = self.speed.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let moving: Vec<usize> = (0..t.len())
            .filter(|k| self.speed[*k].abs() > IN_MOTION * fastest)
            .collect();
        let step = self.step()?;
        let reach = (LONGEST / step).round() as i64;
        let thin = moving.len().div_ceil(MOST).max(1);
        let bounds = self.bounds();
        let left: Vec<f64> = (-reach..=reach)
            .map(|lag| {
                let pairs = moving.iter().step_by(thin).filter_map(|&k| {
                    let [from, to] = bounds[k];
                    let at = k as i64 + lag;
                    (from as i64 <= at && at < to as i64)
                        .then(|| (self.whole[k], self.tau[at as usize]))
                });
                unexplained(pairs)
            })
            .collect();
        let (at, least) = (left.iter().copied().enumerate())
            .filter(|(_, left)| left.is_finite())
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        let recorded = left[reach as usize];
        // A shift at the end of the range is no minimum; a small improvement does not count either.
        if at == 0 || at + 1 == left.len() || !(least < LESS * recorded) {
            return None;
        }
        let (before, after) = (left[at - 1], left[at + 1]);
        let bend = before - 2.0 * least + after;
        let between = if bend > 0.0 {
            0.5 * (before - after) / bend
        } else {
            0.0
        };
        Some(Late {
            by: (at as f64 - reach as f64 + between) * step,
            recorded,
            moved: least,
        })
    }

    /// Returns the mean time between rows within stretches, s.
    fn step(&self) -> Option<f64> {
        let (mut time, mut count) = (0.0, 0usize);
        for [from, to] in self.position.stretches() {
            if to > from + 1 {
                time += self.position.t[to - 1] - self.position.t[from];
                count += to - from - 1;
            }
        }
        (count > 0 && time > 0.0).then(|| time / count as f64)
    }

    /// Returns the first row and one past the last of the stretch of each row.
    fn bounds(&self) -> Vec<[usize; 2]> {
        let mut bounds = Vec::with_capacity(self.tau.len());
        for [from, to] in self.position.stretches() {
            bounds.extend(std::iter::repeat_n([from, to], to - from));
        }
        bounds
    }

    /// Returns the rows with the torque read `by` seconds later, which corrects a torque that is late by that much.
    pub(super) fn earlier(&self, by: f64) -> Option<Self> {
        let rows = by / self.step()?;
        let bounds = self.bounds();
        let tau: Vec<f64> = (bounds.iter().enumerate())
            .map(|(k, [from, to])| {
                let at = (k as f64 + rows).clamp(*from as f64, (*to - 1) as f64);
                let low = at.floor() as usize;
                let share = at - low as f64;
                let high = (low + 1).min(*to - 1);
                (1.0 - share) * self.tau[low] + share * self.tau[high]
            })
            .collect();
        Some(Self {
            tau,
            ..self.clone()
        })
    }

    /// Compares the torque within the passes of `points` with the identified gravity, and returns the residual of the identified
    /// model there. A controller that settles in a pass adds inertia and friction, which the identified model takes away; without
    /// such a motion the model adds its errors. What leaves less counts: another scale of gravity shows in both.
    pub(super) fn gravity_shown(&self, points: &[FrictionPoint]) -> Shown {
        let held: Vec<f64> = (self.tau.iter().zip(&self.whole).zip(&self.weight))
            .map(|((tau, whole), weight)| tau - (whole - weight))
            .collect();
        let [recorded, held] = [&self.tau, &held].map(|torque| self.shown_by(torque, points));
        match held.left < recorded.left {
            true => held,
            false => recorded,
        }
    }

    /// Compares a torque with the identified gravity.
    fn shown_by(&self, torque: &[f64], points: &[FrictionPoint]) -> Shown {
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        let mut passes = Vec::with_capacity(points.len());
        for point in points {
            let rows = point.rows.0..point.rows.1;
            let about = |of: &[f64]| {
                let parts = tenths(of);
                let mean = mean(&parts);
                parts.map(|v| v - mean)
            };
            // Every pass has the same weight, whatever its duration.
            let (x, y) = (about(&self.weight[rows.clone()]), about(&torque[rows]));
            let own = [
                dot_in_order(&x, &x),
                dot_in_order(&x, &y),
                dot_in_order(&y, &y),
            ];
            xx += own[0];
            xy += own[1];
            yy += own[2];
            passes.push(own);
        }
        let factor = xy / xx;
        let apart: f64 = passes
            .iter()
            .map(|[xx, xy, _]| (xy - factor * xx).powi(2))
            .sum();
        let count = passes.len() as f64;
        let left = (xx - 2.0 * xy + yy).max(0.0);
        Shown {
            factor,
            std: (apart * count / (count - 1.0)).sqrt() / xx,
            explained: factor * xy / yy,
            gravity: (xx / (count * PARTS as f64)).sqrt(),
            left: (left / (count * PARTS as f64)).sqrt(),
            share: left / yy,
            never: [
                self.tau.iter().all(|tau| *tau >= 0.0),
                self.tau.iter().all(|tau| *tau <= 0.0),
            ],
        }
    }
}

/// Returns the share of the second value's variance that the first leaves, with free scale and mean.
fn unexplained(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut n, mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (a, b) in pairs {
        n += 1.0;
        x += a;
        y += b;
        xx += a * a;
        xy += a * b;
        yy += b * b;
    }
    let (xx, xy, yy) = (xx - x * x / n, xy - x * y / n, yy - y * y / n);
    1.0 - xy * xy / (xx * yy)
}

/// Identified gravity compared with the sweep's torque, by means over tenths of each pass.
pub(super) struct Shown {
    /// Ratio of the torque within passes to the identified gravity; 1 for equal scales.
    factor: f64,
    /// Its standard deviation over the passes.
    std: f64,
    /// Share of the torque variance within passes that the scaled gravity explains.
    explained: f64,
    /// Change of the identified gravity within passes, N·m or N rms.
    gravity: f64,
    /// Residual of the torque within passes with the identified gravity, N·m or N rms.
    left: f64,
    /// The same as a share of the torque variance within passes.
    share: f64,
    /// True if the torque is never negative, and never positive.
    never: [bool; 2],
}

impl Shown {
    /// Returns a sentence if torque or position has another scale than in the identification. `noise` is the model's
    /// residual in its own recordings, N·m or N rms.
    pub(super) fn doubt(&self, noise: f64, sweep: &str, joint: &str, n: usize) -> Option<String> {
        // A joint with a vertical axis has no gravity to compare.
        let scaled =
            self.gravity > noise && (self.factor - 1.0).abs() - OTHER_SCALE > CLEAR * self.std;
        // Very little travel also gives no gravity, although the torque still changes.
        let strange = self.share > FOLLOWS && self.left > CLEAR * noise;
        if !scaled && !strange {
            return None;
        }
        let what = if scaled {
            format!(
                "{sweep}: within its passes tau{n} changes with q{n} {} times as much as the gravity of joint {joint} that --data gives; 1 is right.",
                format_significant(self.factor, 3)
            )
        } else {
            format!(
                "{sweep}: within its passes the gravity of joint {joint} that --data gives leaves {} % of the variance of tau{n}.",
                format_significant(100.0 * self.share, 3)
            )
        };
        let sign = match self.never {
            [true, _] => Some("negative"),
            [_, true] => Some("positive"),
            _ => None,
        };
        let mend = match sign {
            Some(sign) => format!(
                "tau{n} is never {sign}, although the joint turns both ways: check whether the sign of the torque or current was lost."
            ),
            None if !(self.explained >= FOLLOWS) => format!(
                "The torque does not follow that gravity: check the unit, the scale and the zero of q{n}, and that both recordings are of the same joint and robot."
            ),
            None if self.factor < 0.0 => format!(
                "Torque and position are counted in opposite senses in one of both recordings: check the signs of tau{n} and q{n}."
            ),
            None => format!(
                "One of both recordings has another unit or scale of tau{n} or q{n}, or the robot carried another load: check units, gear ratio and torque constant."
            ),
        };
        Some(format!("{what} {mend}"))
    }
}

/// Converts half a 95 % interval to a standard deviation.
fn std_of(half: f64, fit: &FrictionFit, points: usize) -> f64 {
    let parameters = fit.half_interval.len() + 1 + usize::from(fit.stribeck_velocity.is_some());
    half / t_quantile(points.saturating_sub(parameters) as f64)
}

/// Returns a sentence if friction is negative, that is, if it drives instead of braking.
pub(super) fn impossible(
    fit: &FrictionFit,
    points: usize,
    joint: &str,
    n: usize,
    [torque, viscous]: [&str; 2],
) -> Option<String> {
    let below: Vec<String> = [
        ("Coulomb", fit.coulomb, torque),
        ("viscous", fit.viscous, viscous),
    ]
    .into_iter()
    .zip(&fit.half_interval)
    .filter(|((_, value, _), half)| *value < -CLEAR * std_of(**half, fit, points))
    .map(|((name, value, unit), half)| {
        format!("{name} friction {} {unit}", format_value(value, *half))
    })
    .collect();
    (!below.is_empty()).then(|| {
        format!(
            "The map of joint {joint} has {}: friction below zero would drive the joint. Check the signs, the units and the clock of tau{n} and q{n} in both recordings.",
            below.join(" and ")
        )
    })
}

/// Returns a sentence about a late torque; none if both laws agree within their intervals and gravity is not `strange`.
pub(super) fn late_doubt(
    late: &Late,
    [recorded, moved]: [&FrictionFit; 2],
    strange: bool,
    sweep: &str,
    n: usize,
    viscous: &str,
) -> Option<String> {
    let changes = |a: f64, b: f64, k: usize| {
        let half = recorded.half_interval.get(k).copied().unwrap_or(0.0);
        (a - b).abs() > half
    };
    let other_law =
        changes(recorded.coulomb, moved.coulomb, 0) || changes(recorded.viscous, moved.viscous, 1);
    if !other_law && !strange {
        return None;
    }
    let (word, mend) = if late.by > 0.0 {
        ("behind", "earlier")
    } else {
        ("ahead of", "later")
    };
    let number = |value: f64| format_significant(value, 3);
    Some(format!(
        "{sweep}: tau{n} is {} s {word} q{n}. Moved that much {mend}, the model of --data leaves {} % of its variance, as recorded {} %, and viscous friction is {} instead of {} {viscous}. Give both by one clock.",
        format_significant(late.by.abs(), 2),
        number(100.0 * late.moved),
        number(100.0 * late.recorded),
        number(moved.viscous),
        number(recorded.viscous)
    ))
}
