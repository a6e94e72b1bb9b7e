//! A position or torque that keeps one value while the motion goes on: a sensor or a topic that stopped.
//!
//! A value that repeats is no evidence by itself: a joint rests, a torque stays at a limit or on a converter count.
//! Evidence is one run of equal values that is far longer than any other, and
//!
//! * for a torque, that the joint travels far meanwhile; at its extreme value, that it turns back twice (a torque limit
//!   changes its sign with the acceleration);
//! * for a position, that the joint stops from one row to the next. A reference that goes on is no evidence: a joint may
//!   be held.
//!
//! Not detected: a position that stops where the joint hardly moves, and a torque that stops at zero, as where the drive
//! is off.

use super::block::JointColumns;
use rig_numerics::statistics::median;

/// Fewest equal rows.
const FEWEST: usize = 100;
/// The same as a share of the recording.
const SHARE: f64 = 0.02;
/// Least ratio to the next longest run of equal values.
const FAR_LONGER: usize = 10;
/// Least travel of the joint while its torque keeps one value, as a share of its range.
const TRAVEL: f64 = 0.2;
/// Least travel of a joint that moves, rad or m.
const MOVES: f64 = 0.05;
/// Turns of the joint while a torque keeps its extreme value.
const TURNS: usize = 2;
/// Rows before a stop that give the velocity of the joint.
const BEFORE: usize = 4;
/// Least change of the last row before a stop, as a share of that of the rows before: a joint that brakes is slower.
const ABRUPT: f64 = 0.5;
/// Least velocity before a stop, as a share of the 99th percentile: the highest may be a jump behind the stop.
const FAST: f64 = 0.05;
/// The same in the smallest changes of the position.
const CLEAR: f64 = 3.0;

/// A column that keeps one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frozen {
    /// First row with this value.
    pub from: usize,
    /// Last row with this value.
    pub to: usize,
    /// The value.
    pub value: f64,
    /// Travel of the joint meanwhile for a torque; for a position, change in the row before it stops.
    pub by: f64,
}

/// Returns the stretch in which the torque of a joint is frozen, if any.
pub(super) fn frozen_torque(joint: &JointColumns) -> Option<Frozen> {
    let (tau, q) = (&joint.tau, &joint.q);
    if tau.len() != q.len() {
        return None;
    }
    let run = longest_run(tau)?;
    let value = tau[run.from];
    let (low, high) = range(q);
    let own = range(&q[run.from..=run.to]);
    let travel = own.1 - own.0;
    if value == 0.0 || travel < MOVES || travel < TRAVEL * (high - low) {
        return None;
    }
    let whole = run.to + 1 - run.from == tau.len();
    let (least, most) = range(tau);
    let is_extreme = value == least || value == most;
    let goes_on = whole || !is_extreme || turns(&q[run.from..=run.to], 0.25 * travel) >= TURNS;
    goes_on.then_some(Frozen {
        value,
        by: travel,
        ..run
    })
}

/// Returns the stretch in which the position of a joint is frozen, if any.
pub(super) fn frozen_position(joint: &JointColumns) -> Option<Frozen> {
    let q = &joint.q;
    let run = longest_run(q)?;
    stops(q, run.from).then(|| Frozen {
        value: q[run.from],
        by: q[run.from] - q[run.from - 1],
        ..run
    })
}

/// Returns true if a joint stops at a row from one row to the next.
fn stops(q: &[f64], row: usize) -> bool {
    let Some(first) = row.checked_sub(BEFORE + 1) else {
        return false;
    };
    let sizes = |part: &[f64]| {
        part.windows(2)
            .map(|pair| (pair[1] - pair[0]).abs())
            .collect()
    };
    let changes: Vec<f64> = sizes(q);
    let mut moving: Vec<f64> = changes.iter().copied().filter(|by| *by > 0.0).collect();
    moving.sort_by(f64::total_cmp);
    let (Some(least), Some(fastest)) = (moving.first(), moving.get(moving.len() * 99 / 100)) else {
        return false;
    };
    let Some(speed) = median(sizes(&q[first..row])) else {
        return false;
    };
    let along = (q[row] - q[row - 1]) * (q[row - 1] - q[first]);
    along > 0.0
        && changes[row - 1] > ABRUPT * speed
        && speed > FAST * fastest
        && speed > CLEAR * least
}

/// Returns how often a position turns back by more than `by`.
fn turns(q: &[f64], by: f64) -> usize {
    let (mut count, mut sense) = (0, 0.0);
    let mut farthest = q.first().copied().unwrap_or(0.0);
    for now in q {
        let beyond = now - farthest;
        if sense == 0.0 {
            if beyond.abs() > by {
                (sense, farthest) = (beyond.signum(), *now);
            }
        } else if beyond * sense > 0.0 {
            farthest = *now;
        } else if beyond.abs() > by {
            count += 1;
            (sense, farthest) = (-sense, *now);
        }
    }
    count
}

/// Returns the longest run of equal values, if it is far longer than any other.
fn longest_run(values: &[f64]) -> Option<Frozen> {
    let (mut longest, mut next, mut from) = ((0, 0), 0, 0);
    for run in values.chunk_by(|a, b| a == b) {
        if run.len() > longest.1 {
            next = longest.1;
            longest = (from, run.len());
        } else {
            next = next.max(run.len());
        }
        from += run.len();
    }
    let (from, rows) = longest;
    let is_long = rows >= FEWEST && rows as f64 >= SHARE * values.len() as f64;
    (is_long && rows >= FAR_LONGER * next).then(|| Frozen {
        from,
        to: from + rows - 1,
        value: values[from],
        by: 0.0,
    })
}

/// Returns the lowest and highest value.
pub(super) fn range(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(*v), h.max(*v))
        })
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// A joint with noise below `count`, its torque; `rest` makes it dwell now and then.
    fn joint(rate: f64, count: f64, seed: u64, rest: bool) -> JointColumns {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let mut own = JointColumns::default();
        for k in 0..(20.0 * rate) as usize {
            let mut t = k as f64 / rate + seed as f64;
            if rest {
                // Three of four seconds in motion, with a smooth stop.
                let whole = (t / 4.0).floor();
                let within = (t - 4.0 * whole).min(3.0);
                let turn = core::f64::consts::TAU * within / 3.0;
                t = 3.0 * whole + within - 3.0 / core::f64::consts::TAU * turn.sin();
            }
            let place = 0.8 * (2.3 * t).sin() + 0.2 * (5.1 * t).cos();
            let noise = count * (rng.random::<f64>() - 0.5);
            own.q
                .push(((place + noise) / count.max(1e-12)).round() * count.max(1e-12));
            own.tau
                .push(2.0 * place - 3.0 * (2.3 * t).cos() + 30.0 * noise);
        }
        own
    }

    const KINDS: [(f64, f64); 4] = [(500.0, 1e-5), (1000.0, 1e-12), (250.0, 2e-4), (100.0, 1e-3)];

    #[test]
    fn a_torque_that_stops_is_found_with_its_first_row() {
        for (rate, count) in KINDS {
            for (seed, share) in [(1, 0.0), (2, 0.33), (3, 0.5), (4, 0.8)] {
                let mut own = joint(rate, count, seed, false);
                let rows = own.tau.len();
                let from = (share * rows as f64) as usize;
                let value = own.tau[from];
                own.tau[from..].fill(value);
                let found = frozen_torque(&own);
                assert_eq!(
                    found.map(|own| (own.from, own.to, own.value)),
                    Some((from, rows - 1, value)),
                    "{rate} {count} {share}"
                );
                assert_eq!(frozen_position(&own), None);
            }
        }
    }

    #[test]
    fn a_position_that_stops_is_found_with_its_first_row() {
        for (rate, count) in KINDS {
            for (seed, share) in [(1, 0.31), (2, 0.33), (3, 0.52), (4, 0.8)] {
                let mut own = joint(rate, count, seed, false);
                let from = (share * own.q.len() as f64) as usize;
                // It comes back before the end.
                let to = own.q.len() - own.q.len() / 10;
                let value = own.q[from];
                own.q[from..to].fill(value);
                let found = frozen_position(&own).map(|own| (own.from, own.to));
                assert_eq!(found, Some((from, to - 1)), "{rate} {count} {share}");
            }
        }
    }

    #[test]
    fn rests_limits_and_converter_steps_are_not_frozen() {
        for (rate, count) in KINDS {
            for seed in 0..5 {
                for rest in [false, true] {
                    let mut own = joint(rate, count, seed, rest);
                    assert_eq!(frozen_torque(&own), None, "{rate} {count} {rest}");
                    assert_eq!(frozen_position(&own), None, "{rate} {count} {rest}");
                    let cut = own.tau.clone();
                    own.tau.iter_mut().for_each(|v| *v = v.clamp(-2.0, 2.0));
                    assert_eq!(frozen_torque(&own), None, "{rate} {count} {rest}");
                    own.tau = cut.iter().map(|v| (v / 0.5).round() * 0.5).collect();
                    assert_eq!(frozen_torque(&own), None, "{rate} {count} {rest}");
                }
                // A rest at the end without noise, as simulated.
                let mut own = joint(rate, 1e-12, seed, false);
                let rows = own.q.len();
                for k in rows / 2..rows {
                    let slower = 1.0 - (k - rows / 2) as f64 / (0.1 * rate);
                    own.q[k] = own.q[k - 1]
                        + slower.max(0.0) * (own.q[rows / 2 - 1] - own.q[rows / 2 - 2]);
                    own.tau[k] = 1.0 + (k as f64).sin();
                }
                assert_eq!(frozen_position(&own), None, "{rate} {seed}");
            }
        }
    }
}
