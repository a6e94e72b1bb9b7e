//! Rows whose values stand still while none arrive, and catch up in one row: the time is right, the values are stale.
//!
//! All positions repeat over one or more rows, and the next row advances by what these rows would have taken at the velocity
//! around them. Rows that were written twice do not catch up; rows that are missing do not stand still before.

use super::block::Block;
use rig_numerics::statistics::median;

/// Rows on each side whose median change is the velocity.
const AROUND: usize = 4;
/// Standard deviation of a normal distribution over its median magnitude.
const NORMAL: f64 = 1.4826;
/// Least change of the row that catches up, in standard deviations of the position's noise …
const BEYOND_NOISE: f64 = 8.0;
/// … and in the smallest changes of the position: a coarse encoder repeats its count, too.
const BEYOND_COUNTS: f64 = 5.0;
/// One change in this number may be smaller than the encoder's count: means over several of its readings are, at times.
const RARE: usize = 100;
/// Bounds of the change of the row that catches up, as a share of that at the velocity around it.
const CAUGHT_UP: [f64; 2] = [0.6, 1.6];
/// Fewest stale rows in a row at one place: single ones are found as repeated rows.
const FEWEST_ROWS: usize = 2;
/// Fewest places …
const FEWEST_PLACES: usize = 3;
/// … or most rows at one place that need no others.
const MANY: usize = 5;

/// Rows with stale values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StaleRows {
    /// First of them.
    pub row: usize,
    /// Number of places.
    pub places: usize,
    /// Number of rows.
    pub rows: usize,
    /// Most rows at one place.
    pub most: usize,
}

/// Change from row to row of a position, its noise and its smallest step that is not rare.
struct Change {
    by: Vec<f64>,
    noise: f64,
    count: f64,
}

impl Change {
    fn of(q: &[f64]) -> Option<Self> {
        let by: Vec<f64> = q.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let bends = by.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let noise = NORMAL * median(bends.collect())? / 2.0_f64.sqrt();
        let mut sizes: Vec<f64> = (by.iter().map(|by| by.abs()))
            .filter(|by| *by > 0.0)
            .collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let count = *sizes.get(sizes.len() / RARE)?;
        Some(Self { by, noise, count })
    }

    /// Returns the changes of the row that catches up and of a row around it, if they show more than noise.
    fn caught_up(&self, from: usize, to: usize) -> Option<[f64; 2]> {
        let own = *self.by.get(to)?;
        let rows = |part: &[f64]| median(part.to_vec());
        let before = rows(&self.by[from.saturating_sub(AROUND)..from]);
        let after = rows(&self.by[to + 1..(to + 1 + AROUND).min(self.by.len())]);
        let speed = match (before, after) {
            (Some(a), Some(b)) if a * b > 0.0 => 0.5 * (a + b),
            _ => return None,
        };
        let shows = own.abs() > (BEYOND_NOISE * self.noise).max(BEYOND_COUNTS * self.count);
        shows.then_some([own, speed])
    }
}

/// Finds rows with stale values.
pub(super) fn stale_rows(block: &Block) -> Option<StaleRows> {
    let changes: Vec<Change> = (block.joints.iter())
        .filter_map(|joint| Change::of(&joint.q))
        .collect();
    let steps = changes.iter().map(|own| own.by.len()).min()?;
    let stands = |k: &usize| changes.iter().all(|own| own.by[*k] == 0.0);
    let (mut places, mut repeated, mut k) = (Vec::new(), 0, 0);
    while k < steps {
        let rows = (k..steps).take_while(stands).count();
        if rows > 0 {
            repeated += 1;
            let shown = changes.iter().filter_map(|own| own.caught_up(k, k + rows));
            let (along, all) = shown.fold((0.0, 0.0), |(along, all), [own, speed]| {
                (along + own * speed, all + speed * speed)
            });
            let share = along / all / (rows + 1) as f64;
            if (CAUGHT_UP[0]..CAUGHT_UP[1]).contains(&share) {
                places.push((k + 1, rows));
            }
        }
        k += rows + 1;
    }
    let most = places.iter().map(|(_, rows)| *rows).max()?;
    let enough = most >= MANY || most >= FEWEST_ROWS && places.len() >= FEWEST_PLACES;
    // Values that repeat mostly without catching up are counts of an encoder in slow motion.
    let told = enough && 2 * places.len() > repeated;
    told.then(|| StaleRows {
        row: places[0].0,
        places: places.len(),
        rows: places.iter().map(|(_, rows)| rows).sum(),
        most,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::block::JointColumns;

    /// Two joints in counts with noise; `rows` says which true row each row holds.
    fn recorded(rate: f64, count: f64, rows: impl Iterator<Item = usize>, seed: u64) -> Block {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let mut values = Vec::new();
        for row in 0..10_000 {
            let t = row as f64 / rate;
            values.push([0.0, 1.0].map(|j| {
                let place = 0.8 * ((2.3 + j) * t).sin() + 0.1 * ((11.0 - j) * t).sin();
                let noise = 0.3 * count * (rng.random::<f64>() - 0.5);
                ((place + noise) / count).round() * count
            }));
        }
        let rows: Vec<usize> = rows.collect();
        let joint = |j: usize| JointColumns {
            q: rows.iter().map(|row| values[*row][j]).collect(),
            ..JointColumns::default()
        };
        Block {
            t: (0..rows.len()).map(|k| k as f64 / rate).collect(),
            joints: vec![joint(0), joint(1)],
            ..Block::default()
        }
    }

    const KINDS: [(f64, f64); 3] = [(1000.0, 1e-5), (500.0, 1e-12), (250.0, 2e-4)];

    #[test]
    fn values_that_stand_still_and_catch_up_are_stale() {
        for (rate, count) in KINDS {
            for rows in [3, 6, 12, 25] {
                for seed in 0..3 {
                    let held = |k: usize| match k % 900 {
                        within @ 700.. if within <= 700 + rows => k - (within - 700),
                        _ => k,
                    };
                    let found = stale_rows(&recorded(rate, count, (0..9_500).map(held), seed));
                    let found = found.unwrap();
                    assert_eq!(found.most, rows, "{rate} {count} {rows}");
                    assert!(found.row % 900 == 701 && found.places >= 3, "{found:?}");
                }
            }
        }
    }

    #[test]
    fn sound_missing_and_doubled_rows_are_not_stale() {
        for (rate, count) in KINDS {
            for seed in 0..3 {
                let found =
                    |rows: Vec<usize>| stale_rows(&recorded(rate, count, rows.into_iter(), seed));
                assert_eq!(found((0..9_000).collect()), None, "{rate} {count}");
                let missing = (0..9_000).filter(|k| k % 900 < 700 || k % 900 > 706);
                assert_eq!(found(missing.collect()), None, "{rate} {count}");
                let doubled = (0..9_000).flat_map(|k| vec![k; if k % 300 == 7 { 4 } else { 1 }]);
                assert_eq!(found(doubled.collect()), None, "{rate} {count}");
                // Starts and stops.
                let stops = (0..9_000).map(|k| 700 * (k / 1000) + (k % 1000).min(700));
                assert_eq!(found(stops.collect()), None, "{rate} {count}");
            }
        }
        // A coarse encoder.
        for (rate, count) in [(1000.0, 1e-3), (1000.0, 5e-3), (250.0, 5e-3)] {
            assert_eq!(
                stale_rows(&recorded(rate, count, 0..9_000, 1)),
                None,
                "{rate} {count}"
            );
        }
    }
}
