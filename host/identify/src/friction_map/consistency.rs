//! Whether a sweep belongs to the recordings from which gravity and inertia are known, and whether its map can be friction.
//!
//! The map takes what identified gravity and inertia leave of the sweep's torque. That is friction only if the torque is given by
//! the sweep's own clock, and if both recordings have one scale of torque and position. Within a pass friction is constant and
//! gravity is not: its share shows the scale. Over all passes and the ramps between them the whole model shows the clock.

use super::super::covariance::t_quantile;
use super::{FrictionFit, FrictionPoint, PARTS, Rows, tenths};
use rig_output::{format_significant, format_value};

/// Longest shift between torque and position that is looked for, s.
const LONGEST: f64 = 0.2;
/// Share of the fastest speed from which a row says something of the clock: below it friction is not what the model says.
const IN_MOTION: f64 = 0.05;
/// Rows that are compared at each shift; more of them change nothing but the time it takes.
const MOST: usize = 20_000;
/// The shift must leave at most this share of the variance that is left as recorded. The same as of the clock test of
/// recordings that are fitted.
const LESS: f64 = 0.7;
/// Departure of the gravity in the sweep from the identified one above which both are of different scales. Sound sweeps of
/// 5 emulated rigs depart by up to 0.009; the smallest mistake of a unit or a ratio is a factor of 1.3.
const OTHER_SCALE: f64 = 0.1;
/// Standard deviations by which something must be beyond what is allowed.
const CLEAR: f64 = 3.0;
/// Share of the torque's variance within passes that a scaled gravity must explain to be called scaled.
const FOLLOWS: f64 = 0.5;

/// A torque that was recorded by another clock than the position.
pub(super) struct Late {
    /// By how much the torque is behind the position, s; below zero where it is ahead.
    pub by: f64,
    /// Share of the torque's variance that the model leaves as recorded.
    pub recorded: f64,
    /// The same with the torque moved.
    pub moved: f64,
}

impl Rows {
    /// Finds the shift of the torque that fits the whole model best; none where the torque as recorded fits about as well.
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
        // Its end is no least, and neither is what is hardly better.
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

    /// Mean time from row to row within stretches, s.
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

    /// First row and one past the last of the stretch of each row.
    fn bounds(&self) -> Vec<[usize; 2]> {
        let mut bounds = Vec::with_capacity(self.tau.len());
        for [from, to] in self.position.stretches() {
            bounds.extend(std::iter::repeat_n([from, to], to - from));
        }
        bounds
    }

    /// The same rows with the torque taken `by` seconds later: what a torque that is late by that much should have been.
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

    /// How much of the identified gravity the torque shows within the passes of `points`, and what the identified model leaves
    /// there.
    pub(super) fn gravity_shown(&self, points: &[FrictionPoint]) -> Shown {
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        let mut passes = Vec::with_capacity(points.len());
        for point in points {
            let rows = point.rows.0..point.rows.1;
            let about = |of: &[f64]| {
                let parts = tenths(of);
                let mean = parts.iter().sum::<f64>() / parts.len() as f64;
                parts.map(|v| v - mean)
            };
            // A pass is one witness, however long it takes.
            let (x, y) = (about(&self.weight[rows.clone()]), about(&self.tau[rows]));
            let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let own = [sum(&x, &x), sum(&x, &y), sum(&y, &y)];
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

/// Share of the variance of the second that the first leaves, scale and mean free.
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

/// The identified gravity as it shows in a sweep, by means over tenths of each pass.
pub(super) struct Shown {
    /// Torque within passes over identified gravity; 1 would be right.
    factor: f64,
    /// Its standard deviation over the passes.
    std: f64,
    /// Share of the torque's variance within passes that the gravity explains, scaled by the factor.
    explained: f64,
    /// How much the identified gravity changes within passes, N·m or N rms.
    gravity: f64,
    /// What the gravity as identified leaves of the torque within passes, N·m or N rms.
    left: f64,
    /// The same as a share of the torque's variance within passes.
    share: f64,
    /// Whether the torque is never negative, and never positive.
    never: [bool; 2],
}

impl Shown {
    /// A sentence about a torque or position of another scale than that of the identification; none where it is the same.
    /// `noise` is what the model leaves of the torque in its own recordings, N·m or N rms.
    pub(super) fn doubt(&self, noise: f64, sweep: &str, joint: &str, n: usize) -> Option<String> {
        // A joint about a vertical axis has no gravity to compare.
        let scaled =
            self.gravity > noise && (self.factor - 1.0).abs() - OTHER_SCALE > CLEAR * self.std;
        // A position of hardly any travel shows none either, and leaves a torque that changes all the same.
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

/// Half of the 95 % interval as a standard deviation.
fn std_of(half: f64, fit: &FrictionFit, points: usize) -> f64 {
    let parameters = fit.half_interval.len() + 1 + usize::from(fit.stribeck_velocity.is_some());
    half / t_quantile(points.saturating_sub(parameters).max(1))
}

/// A sentence about friction below zero, which drives instead of braking; none where all can be friction.
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

/// A sentence about a torque that is late; none where both laws agree within their intervals.
pub(super) fn late_doubt(
    late: &Late,
    [recorded, moved]: [&FrictionFit; 2],
    sweep: &str,
    n: usize,
    viscous: &str,
) -> Option<String> {
    let changes = |a: f64, b: f64, k: usize| {
        let half = recorded.half_interval.get(k).copied().unwrap_or(0.0);
        (a - b).abs() > half
    };
    if !changes(recorded.coulomb, moved.coulomb, 0) && !changes(recorded.viscous, moved.viscous, 1)
    {
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
