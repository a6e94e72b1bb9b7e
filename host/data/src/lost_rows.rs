//! Rows that were lost or written twice while the time column was counted on.
//!
//! Where t is a count of the rows, a lost row leaves no gap in time. The motion shows it: all positions advance in one
//! row by what several rows take. A row that was written twice does not advance at all.
//!
//! The advance of a row is measured in usual rows: the change of all positions over the change at the velocity of the
//! rows around it, by weighted least squares over the joints. A sound row has 1. Only rows in which the joints move far
//! above their noise are judged.
//!
//! Where many rows are lost, the velocity before the place differs from that behind it. No single velocity belongs to
//! such a row, but a sound start or stop is not faster than all rows around it. A row that is, by far more than the
//! recording's accelerations explain, is measured against the fastest of them. The number of lost rows is then a lower
//! bound.
//!
//! Not detected: losses at rest, single lost rows fewer than [`FEWEST`], rows that are late by a part of a row, and
//! losses after which the joints are back where they were.

use std::ops::Range;

use super::block::Block;
use rig_numerics::statistics::{median, median_of_finite};

/// Number of rows on each side whose median velocities give the velocity of a row.
const AROUND: usize = 4;
/// Share of a joint's highest speed above which its rows show its noise.
const IN_MOTION: f64 = 0.1;
/// Standard deviation of a normal distribution over its median magnitude.
const NORMAL: f64 = 1.4826;
/// Rounding of a position to a count, as standard deviation of its change, in counts.
const COUNT: f64 = 0.5;
/// Largest standard deviation of an advance that is judged, in rows.
const PRECISE: f64 = 0.1;
/// Least deviation of an advance from one row, in rows …
const APART: f64 = 0.75;
/// … and in standard deviations of all advances, which jitter of the rows makes large: jitter of a uniform distribution
/// deviates by up to 2.3 of them.
const BEYOND_JITTER: f64 = 5.0;
/// Largest difference between the velocities before and after a row, as a share of the velocity: not a start or a stop.
const STEADY: f64 = 0.5;
/// Least advance of a row between different velocities beyond the fastest row around it, as a multiple of the 99th
/// percentile of all changes by acceleration and noise. The same margin as that against jitter.
const BEYOND_ACCELERATION: f64 = 5.0;
/// Least opposite deviation of a neighbour, as a share, for a row that was recorded early or late and not lost.
const MADE_UP: f64 = 0.4;
/// Fewest lost or repeated rows that are told.
const FEWEST: usize = 3;
/// Lost rows at one place that are told even if it is the only one.
const MANY: f64 = 1.7;

/// Rows that do not advance like the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LostRows {
    /// Row before the first place.
    pub row: usize,
    /// Number of places.
    pub places: usize,
    /// Sum of lost or repeated rows.
    pub rows: f64,
    /// Number of rows that are judged.
    pub judged: usize,
    /// True if most places follow a row that repeats all positions: the last values were written while none arrived.
    pub held: bool,
}

/// Places at which rows are lost, and rows that repeat the row before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Advances {
    pub lost: Option<LostRows>,
    pub repeated: Option<LostRows>,
    /// True if the next row makes up for most repeated rows: the logger kept a value, and time is right.
    pub made_up: bool,
}

/// Finds rows that were lost or written twice.
pub(super) fn advances(block: &Block) -> Advances {
    let excess = excess(block);
    let at = |k: usize| excess.get(k).copied().flatten();
    let beside = |k: usize| [k.checked_sub(1).and_then(at), at(k + 1)].map(|x| x.unwrap_or(0.0));
    let sizes = excess.iter().flatten().map(|own| own.abs()).collect();
    let spread = NORMAL * median(sizes).unwrap_or(0.0);
    let apart = f64::max(APART, BEYOND_JITTER * spread);
    let (mut lost, mut repeated, mut made_up) = (Vec::new(), Vec::new(), 0);
    for (k, own) in excess.iter().enumerate() {
        let Some(own) = own.filter(|own| own.abs() > apart) else {
            continue;
        };
        let [before, after] = beside(k);
        if own > 0.0 && before.min(after) > -MADE_UP * own {
            lost.push((k, own));
        } else if own < 0.0 && is_repeated(block, k) {
            repeated.push((k, -own));
            made_up += usize::from(after > MADE_UP);
        }
    }
    let judged = excess.iter().flatten().count();
    let told = |found: &[(usize, f64)]| {
        let many = found.iter().any(|(_, rows)| *rows > MANY);
        let (row, _) = *found.first()?;
        (found.len() >= FEWEST || many).then(|| LostRows {
            row,
            places: found.len(),
            rows: found.iter().map(|(_, rows)| rows).sum(),
            judged,
            held: 2 * found.iter().filter(|(k, _)| stands(block, *k)).count() > found.len(),
        })
    };
    let (mut lost, mut repeated) = (told(&lost), told(&repeated));
    // Where most rows of one kind are, the velocity around a row is wrong for the other kind.
    let places = |own: &Option<LostRows>| own.map_or(0, |own| own.places);
    match places(&lost) > places(&repeated) {
        true => repeated = None,
        false => lost = lost.filter(|_| repeated.is_none()),
    }
    Advances {
        lost,
        repeated,
        made_up: 2 * made_up > places(&repeated),
    }
}

/// Returns true if every position of a row is that of the row before.
fn stands(block: &Block, row: usize) -> bool {
    let same = |q: &[f64]| row > 0 && q.get(row - 1) == q.get(row);
    block.joints.iter().all(|joint| same(&joint.q))
}

/// Returns true if the next row repeats every position and effort.
fn is_repeated(block: &Block, row: usize) -> bool {
    let same = |column: &[f64]| column.get(row) == column.get(row + 1);
    (block.joints.iter()).all(|joint| same(&joint.q) && same(&joint.tau))
}

/// Returns by how many usual rows each row advances too far; `None` if the motion does not show it.
fn excess(block: &Block) -> Vec<Option<f64>> {
    let steps: Vec<f64> = block.t.windows(2).map(|t| t[1] - t[0]).collect();
    let Some(usual) = median(steps.clone()).filter(|usual| *usual > 0.0) else {
        return Vec::new();
    };
    let (mut along, mut weight) = (vec![0.0; steps.len()], vec![0.0; steps.len()]);
    for joint in &block.joints {
        let Some((beyond, speed, noise)) = changes(&joint.q, &steps) else {
            continue;
        };
        for k in 0..steps.len() {
            let a_row = speed[k] * usual / noise;
            along[k] += beyond[k] / noise * a_row;
            weight[k] += a_row * a_row;
        }
    }
    let shown = |weight: f64| PRECISE * weight.sqrt() > 1.0;
    (along.iter().zip(&weight))
        .map(|(along, weight)| shown(*weight).then_some(along / weight))
        .collect()
}

/// Returns the change of a position in each row beyond that at the velocity around it, this velocity, and the standard
/// deviation of the former in sound rows. `None` if the joint hardly moves.
fn changes(q: &[f64], steps: &[f64]) -> Option<(Vec<f64>, Vec<f64>, f64)> {
    if steps.is_empty() || q.len() != steps.len() + 1 {
        return None;
    }
    let change: Vec<f64> = q.windows(2).map(|q| q[1] - q[0]).collect();
    let speeds: Vec<f64> = change.iter().zip(steps).map(|(q, t)| q / t).collect();
    let of_rows = |rows: Range<usize>| median_of_finite(speeds[rows].to_vec()).unwrap_or(0.0);
    let around = |k: usize| {
        let before = of_rows(k.saturating_sub(AROUND)..k);
        let after = of_rows(k + 1..(k + AROUND + 1).min(speeds.len()));
        let middle = 0.5 * (before + after);
        let steady = (after - before).abs() < STEADY * middle.abs();
        (middle, steady)
    };
    let around: Vec<(f64, bool)> = (0..speeds.len()).map(around).collect();
    let mut accelerations: Vec<f64> = (change.iter().zip(steps).zip(&around))
        .map(|((change, step), (middle, _))| (change - middle * step).abs())
        .collect();
    accelerations.sort_by(f64::total_cmp);
    let usual = accelerations[accelerations.len() - 1 - accelerations.len() / 100];
    let speed: Vec<f64> = (around.iter().enumerate())
        .map(|(k, (middle, steady))| match steady {
            true => *middle,
            false => (fastest_around(&speeds, k))
                .filter(|v| (change[k] - v * steps[k]).abs() > BEYOND_ACCELERATION * usual)
                .unwrap_or(0.0),
        })
        .collect();
    let beyond: Vec<f64> = (change.iter().zip(&speed).zip(steps))
        .map(|((change, speed), step)| change - speed * step)
        .collect();
    let fastest = speed.iter().fold(0.0f64, |most, v| most.max(v.abs()));
    let moving = (beyond.iter().zip(&speed)).filter(|(_, v)| v.abs() > IN_MOTION * fastest);
    let spread = median(moving.map(|(beyond, _)| beyond.abs()).collect())?;
    let changed = change.iter().map(|q| q.abs()).filter(|q| *q > 0.0);
    let count = changed.fold(f64::INFINITY, f64::min);
    let noise = (NORMAL * spread).max(COUNT * count);
    (noise.is_finite() && noise > 0.0).then_some((beyond, speed, noise))
}

/// Returns the velocity of the fastest row around a row, in its direction; `None` if the row is slower than that.
fn fastest_around(speeds: &[f64], row: usize) -> Option<f64> {
    let own = speeds[row];
    let before = &speeds[row.saturating_sub(AROUND)..row];
    let after = &speeds[row + 1..(row + AROUND + 1).min(speeds.len())];
    let along = before.iter().chain(after).map(|v| v * own.signum());
    let fastest = along.fold(0.0, f64::max);
    (own.abs() > fastest).then_some(fastest * own.signum())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::block::JointColumns;

    /// Two joints at `rate`, positions in counts with noise; `rows` says which true row each row holds.
    fn recorded(rate: f64, count: f64, rows: impl Iterator<Item = usize>, seed: u64) -> Block {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let mut noise = || 0.3 * count * (rng.random::<f64>() - 0.5);
        let place = |row: usize, j: usize| {
            let t = row as f64 / rate;
            0.8 * ((2.3 + j as f64) * t).sin() + 0.1 * ((11.0 - j as f64) * t).sin()
        };
        let rows: Vec<usize> = rows.collect();
        let last = rows.iter().copied().max().unwrap();
        let all: Vec<[[f64; 2]; 2]> = (0..=last)
            .map(|row| {
                [0, 1].map(|j| {
                    let q = ((place(row, j) + noise()) / count).round() * count;
                    [q, 3.0 * q.cos() + noise()]
                })
            })
            .collect();
        let column = |j: usize, c: usize| rows.iter().map(|row| all[*row][j][c]).collect();
        Block {
            t: (0..rows.len()).map(|k| k as f64 / rate).collect(),
            joints: (0..2)
                .map(|j| JointColumns {
                    q: column(j, 0),
                    tau: column(j, 1),
                    ..JointColumns::default()
                })
                .collect(),
            ..Block::default()
        }
    }

    const KINDS: [(f64, f64); 4] = [
        (1000.0, 1e-5),
        (1000.0, 1e-12),
        (250.0, 2e-4),
        (100.0, 1e-3),
    ];

    #[test]
    fn sound_rows_are_not_lost() {
        for (rate, count) in KINDS {
            for seed in 0..5 {
                let block = recorded(rate, count, 0..10_000, seed);
                assert_eq!(advances(&block), Advances::default(), "{rate} {count}");
            }
        }
        // Rows that were taken up to 0.3 of a row early or late.
        for rate in [1000.0, 250.0] {
            for seed in 0..5 {
                let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed + 20);
                let rows =
                    (0..10_000).map(|k| 10 * k + 3 + (4.0 * rng.random::<f64>()).round() as usize);
                let mut block = recorded(10.0 * rate, 1e-7, rows, seed);
                block.t = (0..10_000).map(|k| f64::from(k) / rate).collect();
                assert_eq!(advances(&block), Advances::default(), "{rate} {seed}");
            }
        }
        // Starts and stops of all joints.
        let stops = (0..10_000).map(|k| 700 * (k / 1000) + (k % 1000).min(700));
        let block = recorded(1000.0, 1e-7, stops, 7);
        assert_eq!(advances(&block), Advances::default());
        // A gap that the time column has is none of these.
        let mut block = recorded(1000.0, 1e-5, (0..4000).chain(4020..9000), 1);
        block.t[4000..].iter_mut().for_each(|t| *t += 0.02);
        assert_eq!(advances(&block), Advances::default());
    }

    #[test]
    fn lost_rows_are_counted_though_time_goes_on() {
        for (rate, count) in KINDS {
            for share in [0.002, 0.03, 0.2] {
                let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(8);
                let kept = (0..10_000).filter(|_| rng.random::<f64>() > share);
                let found = advances(&recorded(rate, count, kept, 2));
                let lost = found.lost.unwrap();
                let part = lost.rows / lost.judged as f64 / (share / (1.0 - share));
                assert!(
                    (0.5..1.5).contains(&part),
                    "{rate} {count} {share}: {lost:?}"
                );
                assert_eq!(found.repeated, None);
            }
            // One place, with the rows of 30 ms.
            let many = (0.03 * rate).round() as usize;
            let kept = (0..4000).chain(4000 + many..9000);
            let lost = advances(&recorded(rate, count, kept, 3)).lost.unwrap();
            let part = lost.rows / many as f64;
            let only = lost.places == 1 && lost.row == 3999;
            assert!(
                only && (0.8..1.2).contains(&part),
                "{rate} {count}: {lost:?}"
            );
        }
    }

    /// The last values are written over 30 rows, five times.
    #[test]
    fn values_that_were_held_are_told_from_lost_rows() {
        for (rate, count) in &KINDS[..2] {
            for seed in 0..5 {
                let held = |row: usize| match row % 1700 {
                    within @ 1100..1130 => row - (within - 1099),
                    _ => row,
                };
                let lost = advances(&recorded(*rate, *count, (0..9000).map(held), seed)).lost;
                assert!(lost.is_some_and(|lost| lost.held), "{rate} {count}");
                let kept = (0..9000).filter(|row| row % 1700 < 1100 || row % 1700 >= 1130);
                let lost = advances(&recorded(*rate, *count, kept, seed)).lost;
                assert!(lost.is_some_and(|lost| !lost.held), "{rate} {count}");
            }
        }
    }

    /// The velocity before the place differs from that behind it, or is of the other sense.
    #[test]
    fn rows_lost_while_the_velocity_changes_are_told() {
        for (rate, count) in KINDS {
            let (mut shown, mut told) = (0, 0);
            for (place, lost) in (1000..8000).step_by(97).zip([20, 50, 100].iter().cycle()) {
                let kept = (0..place + 1).chain(place + 1 + lost..9000);
                let mut block = recorded(rate, count, kept, place as u64);
                block.joints.truncate(1);
                let q = &block.joints[0].q;
                let change = |k: usize| (q[k + 1] - q[k]).abs();
                let rows = (place - AROUND..place).chain(place + 1..place + 1 + AROUND);
                let fastest = rows.map(change).fold(0.0, f64::max);
                let jump = change(place);
                if jump < 4.0 * fastest || fastest < 20.0 * count {
                    continue;
                }
                shown += 1;
                let own = advances(&block).lost.map(|lost| (lost.row, lost.places));
                told += usize::from(own == Some((place, 1)));
            }
            assert!(shown >= 10, "{rate} {count}");
            // A coarse encoder at a low rate hides the smallest.
            assert!(
                told == shown || rate < 500.0 && 10 * told >= 9 * shown,
                "{rate} {count}: {told} of {shown}"
            );
        }
    }

    #[test]
    fn repeated_rows_are_told_from_kept_ones() {
        for (rate, count) in KINDS {
            for share in [0.005, 0.1] {
                let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(9);
                let twice = (0..9000).flat_map(|row| {
                    std::iter::repeat_n(row, 1 + usize::from(rng.random::<f64>() < share))
                });
                let found = advances(&recorded(
                    rate,
                    count,
                    twice.collect::<Vec<_>>().into_iter(),
                    4,
                ));
                assert!(
                    found.repeated.is_some() && !found.made_up,
                    "{rate} {count} {share}: {found:?}"
                );
                let mut last = 0;
                let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(10);
                let kept: Vec<usize> = (0..9000)
                    .map(|row| {
                        if rng.random::<f64>() > share {
                            last = row;
                        }
                        last
                    })
                    .collect();
                let found = advances(&recorded(rate, count, kept.into_iter(), 5));
                assert!(
                    found.repeated.is_some() && found.made_up && found.lost.is_none(),
                    "{rate} {count} {share}: {found:?}"
                );
            }
        }
    }
}
