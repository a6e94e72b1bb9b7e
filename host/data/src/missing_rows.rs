//! Rows that are missing one by one in a recording with an even clock: they are interpolated as the file is read, so that
//! every command sees the same even rows.
//!
//! A gap of a few rows moves no joint far. Parting the recording there would cost far more than the row: filters lose
//! the rows on both sides, and a few per cent of lost rows would leave no stretch to fit.

use super::between_rows::{between, cubic};
use super::block::{Block, JointColumns, append, stretch};
use super::place::Place;
use super::sampling::Sampling;

/// Rows on either side of a gap that its interpolation uses.
pub(super) const BESIDE: usize = 2;

/// What was interpolated in a pass over a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct MissingRows {
    /// Number of rows.
    pub rows: u64,
    /// Number of gaps.
    pub places: u64,
    /// Most rows in one gap.
    pub most: usize,
    /// The row after the first gap.
    pub first: Option<Place>,
}

impl MissingRows {
    /// Counts a gap of this many rows; `place` is the row after it.
    pub(super) fn count(&mut self, rows: usize, place: Place) {
        self.rows += rows as u64;
        self.places += 1;
        self.most = self.most.max(rows);
        self.first = self.first.or(Some(place));
    }
}

/// Returns `block` with its missing rows interpolated. `context` has the last rows before it, at most [`BESIDE`], none if
/// it begins a stretch; rows that are missing between the two are put in front. Replaces the context by that of the next
/// block.
pub(super) fn filled(context: &mut Block, block: Block, sampling: &Sampling) -> Block {
    let (known, continues, first_line) = (context.len(), block.continues, block.first_line);
    let mut rows = std::mem::take(context);
    append(&mut rows, block);
    *context = last_rows(&rows);
    let gaps = Gaps::of(&rows.t, known, sampling);
    let joints = rows.joints.iter().map(|joint| gaps.fill_joint(joint));
    let extra = rows.extra.iter().map(|(name, column)| {
        let column = gaps.fill(column, |from, t| {
            let (a, b) = (rows.t[from], rows.t[from + 1]);
            between(column[from], column[from + 1], (t - a) / (b - a))
        });
        (name.clone(), column)
    });
    Block {
        joints: joints.collect(),
        extra: extra.collect(),
        first_line,
        interpolated: gaps.interpolated(),
        continues,
        t: gaps.fill(&rows.t, |_, t| t),
    }
}

/// Returns the last rows of a block as the context of the next one.
pub(super) fn last_rows(block: &Block) -> Block {
    stretch(block, block.len().saturating_sub(BESIDE), block.len())
}

/// The gaps of a block.
struct Gaps<'a> {
    t: &'a [f64],
    /// Number of rows that are context only.
    known: usize,
    /// Number of rows that are missing behind each row.
    missing: Vec<usize>,
}

impl<'a> Gaps<'a> {
    fn of(t: &'a [f64], known: usize, sampling: &Sampling) -> Self {
        // A gap between two rows of the context has been filled with them.
        let behind = |(row, pair): (usize, &[f64])| match row + 1 < known {
            true => 0,
            false => sampling.missing(pair[1] - pair[0]),
        };
        Self {
            t,
            known,
            missing: t.windows(2).enumerate().map(behind).collect(),
        }
    }

    /// Returns a column with the rows that are missing: `at` returns the value behind a row at a time.
    fn fill(&self, column: &[f64], at: impl Fn(usize, f64) -> f64) -> Vec<f64> {
        let added: usize = self.missing.iter().sum();
        let mut all = Vec::with_capacity(column.len() + added);
        for (row, value) in column.iter().enumerate() {
            if row >= self.known {
                all.push(*value);
            }
            let missing = self.missing.get(row).copied().unwrap_or(0);
            for k in 1..=missing {
                let (a, b) = (self.t[row], self.t[row + 1]);
                all.push(at(row, a + (b - a) * k as f64 / (missing + 1) as f64));
            }
        }
        all
    }

    /// Returns a signal with the rows that are missing.
    fn fill_signal(&self, column: &[f64]) -> Vec<f64> {
        self.fill(column, |from, t| {
            let (points, own) = self.around(column, from);
            cubic(&points, own, t)
        })
    }

    /// Returns a torque or voltage with the rows that are missing. It stays between the values around the gap: beyond
    /// them, it would be above the limit of a torque that is cut.
    fn fill_limited(&self, column: &[f64]) -> Vec<f64> {
        self.fill(column, |from, t| {
            let (points, own) = self.around(column, from);
            let values = || points.iter().map(|(_, value)| *value);
            let (low, high) = (values().reduce(f64::min), values().reduce(f64::max));
            let value = cubic(&points, own, t);
            value.max(low.unwrap_or(value)).min(high.unwrap_or(value))
        })
    }

    /// Returns the points around the gap behind a row, and which of them is this row.
    fn around(&self, column: &[f64], from: usize) -> (Vec<(f64, f64)>, usize) {
        let first = (from + 1).saturating_sub(BESIDE);
        let last = (from + BESIDE).min(column.len() - 1);
        let points = (first..=last).map(|row| (self.t[row], column[row]));
        (points.collect(), from - first)
    }

    fn fill_joint(&self, joint: &JointColumns) -> JointColumns {
        let signal = |column: &Option<Vec<f64>>| column.as_ref().map(|own| self.fill_signal(own));
        JointColumns {
            q: self.fill_signal(&joint.q),
            tau: match joint.tau.is_empty() {
                true => Vec::new(),
                false => self.fill_limited(&joint.tau),
            },
            qd: signal(&joint.qd),
            qdd: signal(&joint.qdd),
            reference: signal(&joint.reference),
            voltage: (joint.voltage.as_ref()).map(|own| self.fill_limited(own)),
            temperature: signal(&joint.temperature),
            link: signal(&joint.link),
            effects: signal(&joint.effects),
        }
    }

    /// Returns the places of the interpolated rows behind the context.
    fn interpolated(&self) -> Vec<usize> {
        let (mut rows, mut next) = (Vec::new(), 0);
        for row in 0..self.t.len() {
            next += usize::from(row >= self.known);
            let missing = self.missing.get(row).copied().unwrap_or(0);
            rows.extend(next..next + missing);
            next += missing;
        }
        rows
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::fmt::Write as _;

    use rand::{RngExt, SeedableRng};
    use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};

    use crate::{Block, Remark, Source, Warning};

    /// A joint at `rate` Hz whose fastest component has 1.5 Hz, without the rows for which `lost` is true.
    fn recorded(rate: f64, rows: usize, lost: impl Fn(usize) -> bool) -> String {
        let mut text = "t,q1,tau1,mode\n".to_owned();
        for row in (0..rows).filter(|row| !lost(*row)) {
            let t = row as f64 / rate;
            let (q, tau) = (place(t), torque(t));
            writeln!(text, "{t:.6},{q:.9},{tau:.9},{}", row / 1000).unwrap();
        }
        text
    }

    fn place(t: f64) -> f64 {
        0.8 * (2.3 * t).sin() + 0.1 * (9.4 * t).cos()
    }

    fn torque(t: f64) -> f64 {
        (2.0 * place(t) + 0.3 * (5.0 * t).sin()).clamp(-1.2, 1.2)
    }

    fn read(text: &str, rows: Option<usize>) -> (Vec<Block>, Vec<Warning>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        std::fs::write(&path, text).unwrap();
        let robot = Robot::from_toml(ONE_LINK_TEMPLATE, "one.toml".as_ref()).unwrap();
        let source = Source::open(&path, &robot).unwrap();
        let Some(rows) = rows else {
            return source.read_all().unwrap();
        };
        let mut blocks = source.blocks(rows);
        let mut all: Vec<Block> = Vec::new();
        for block in blocks.by_ref() {
            let block = block.unwrap();
            assert!(block.len() <= rows && !block.is_empty());
            match all.last_mut() {
                Some(last) if block.continues => super::append(last, block),
                _ => all.push(block),
            }
        }
        let warnings = blocks.warnings().to_vec();
        (all, warnings)
    }

    #[test]
    fn single_missing_rows_are_interpolated_whatever_their_share() {
        for (rate, bound) in [(1000.0, 2e-6), (250.0, 3e-5), (100.0, 1e-3)] {
            for share in [0.002, 0.01, 0.02, 0.04, 0.08, 0.2] {
                let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(7);
                let mut kept: Vec<bool> = (0..8000).map(|_| rng.random::<f64>() > share).collect();
                // No gap of more than four rows, and sound ends.
                (0..8000)
                    .step_by(5)
                    .chain(7998..8000)
                    .for_each(|row| kept[row] = true);
                let (blocks, warnings) = read(&recorded(rate, 8000, |row| !kept[row]), None);
                assert_eq!(blocks.len(), 1, "{rate} {share}");
                let block = &blocks[0];
                let lost = kept.iter().filter(|kept| !**kept).count();
                assert_eq!((block.len(), block.interpolated.len()), (8000, lost));
                for (row, t) in block.t.iter().enumerate() {
                    assert!((t - row as f64 / rate).abs() < 1e-6);
                    assert_eq!(block.interpolated.contains(&row), !kept[row]);
                    let off = (block.joints[0].q[row] - place(*t)).abs();
                    assert!(off < bound, "{rate} {share} {row}: {off}");
                    assert!(block.joints[0].tau[row].abs() <= 1.2);
                }
                let told: Vec<String> = warnings.iter().map(ToString::to_string).collect();
                let sentence = format!("{lost} missing rows");
                assert!(told.len() == 1 && told[0].contains(&sentence), "{told:?}");
            }
        }
    }

    #[test]
    fn blocks_of_any_size_hold_the_same_interpolated_rows() {
        let lost = |row: usize| row % 7 == 3 || row % 31 == 4 || (1500..1503).contains(&row);
        let text = recorded(500.0, 3000, |row| lost(row) || (2000..2020).contains(&row));
        let (whole, told) = read(&text, None);
        assert_eq!(whole.len(), 2);
        for size in [1, 2, 3, 7, 100, 1999] {
            let (blocks, warnings) = read(&text, Some(size));
            assert!(blocks == whole, "blocks of {size}");
            assert_eq!(warnings, told);
        }
    }

    /// The lines of the rows stay those of the file.
    #[test]
    fn lines_are_those_of_the_file() {
        let (blocks, warnings) = read(&recorded(1000.0, 3000, |row| row % 100 == 50), None);
        let block = &blocks[0];
        assert_eq!(block.line(49), 51);
        assert_eq!((block.line(50), block.line(51)), (52, 52));
        assert_eq!(block.line(2999), 2999 + 2 - 30);
        let first = warnings.iter().find_map(|own| match own {
            Warning::Reading {
                remark: Remark::MissingRows { first, most, .. },
            } => Some((first.to_string(), *most)),
            _ => None,
        });
        assert_eq!(first, Some(("line 52".to_owned(), 1)));
    }

    #[test]
    fn sound_rows_and_long_gaps_are_left_alone() {
        let (blocks, warnings) = read(&recorded(1000.0, 3000, |_| false), None);
        assert_eq!((blocks.len(), blocks[0].interpolated.len()), (1, 0));
        assert_eq!(warnings, []);
        let (blocks, warnings) = read(&recorded(1000.0, 3000, |k| (1500..1510).contains(&k)), None);
        assert_eq!(blocks.len(), 2);
        assert!(matches!(warnings[..], [Warning::Gap { .. }]));
    }
}
