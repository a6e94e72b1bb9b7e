//! Interpolation of rows with uneven time stamps to an even step.

use super::error::PrepareError;
use super::pieces::Recording;
use crate::between_rows::{between, cubic};
use crate::block::{Block, JointColumns};

/// A recording whose stretches between gaps are interpolated at t₀, t₀ + Δ, t₀ + 2Δ, …; its time stamps are trusted.
///
/// The curve between two rows is a cubic with their values. Its slope at each row is that of the parabola through the
/// row and its neighbours (at the ends of a stretch, through the last three rows). It is exact for parabolas. For a
/// sine of n rows a period and a jitter of half a step, the error is about (2π/n)³/60 of the amplitude. Columns that
/// belong to no joint are interpolated linearly; between two whole numbers (a mode or a flag) the nearer row counts.
/// The controller's own torque of the effects is left out.
pub struct Resampled<'a> {
    source: &'a dyn Recording,
    period: f64,
}

impl<'a> Resampled<'a> {
    /// Resamples `source` every `period` seconds.
    pub fn new(source: &'a dyn Recording, period: f64) -> Self {
        Self { source, period }
    }
}

/// Signals of a block in a fixed order: position, torque, then the other recorded columns.
fn signals(joint: &JointColumns) -> impl Iterator<Item = &Vec<f64>> {
    let optional = [
        &joint.qd,
        &joint.qdd,
        &joint.reference,
        &joint.voltage,
        &joint.temperature,
        &joint.link,
    ];
    ([&joint.q, &joint.tau].into_iter()).chain(optional.into_iter().flatten())
}

/// The same signals, mutable.
fn signals_mut(joint: &mut JointColumns) -> impl Iterator<Item = &mut Vec<f64>> {
    let optional = [
        &mut joint.qd,
        &mut joint.qdd,
        &mut joint.reference,
        &mut joint.voltage,
        &mut joint.temperature,
        &mut joint.link,
    ];
    ([&mut joint.q, &mut joint.tau].into_iter()).chain(optional.into_iter().flatten())
}

/// Returns a block of the same columns without rows.
fn empty_as(block: &Block) -> Block {
    let none = |column: &Option<Vec<f64>>| column.as_ref().map(|_| Vec::new());
    let joints = (block.joints.iter())
        .map(|j| JointColumns {
            qd: none(&j.qd),
            qdd: none(&j.qdd),
            reference: none(&j.reference),
            voltage: none(&j.voltage),
            temperature: none(&j.temperature),
            link: none(&j.link),
            ..JointColumns::default()
        })
        .collect();
    let extra = block
        .extra
        .iter()
        .map(|(name, _)| (name.clone(), Vec::new()));
    Block {
        joints,
        extra: extra.collect(),
        ..Block::default()
    }
}

/// One row: time, line, values of all signals.
#[derive(Clone, Debug, Default)]
struct Row {
    t: f64,
    line: u64,
    values: Vec<f64>,
    /// Columns that belong to no joint.
    extra: Vec<f64>,
}

/// Rows waiting for interpolation, and the interpolated rows.
struct Grid {
    period: f64,
    /// At most four rows: the interval lies between the second and the third, or at an end of the stretch.
    rows: Vec<Row>,
    /// First instant of the stretch, and number of the next instant.
    start: f64,
    next: u64,
    out: Block,
}

impl Grid {
    fn value(&self, s: usize, from: usize, t: f64) -> f64 {
        let points: Vec<(f64, f64)> = (self.rows.iter())
            .map(|row| (row.t, row.values[s]))
            .collect();
        cubic(&points, from, t)
    }

    /// Interpolates between the rows `from` and `from + 1`. The later row belongs to the next interval unless it is the
    /// last.
    fn interval(&mut self, from: usize, last: bool) {
        if self.rows.len() < from + 2 {
            return;
        }
        let end = self.rows[from + 1].t;
        loop {
            let t = self.start + self.next as f64 * self.period;
            let inside = if last {
                t <= end + 1e-9 * self.period
            } else {
                t < end
            };
            if !inside {
                return;
            }
            if self.out.t.is_empty() {
                self.out.first_line = self.rows[from].line;
            }
            let mut s = 0;
            for j in 0..self.out.joints.len() {
                let count = signals(&self.out.joints[j]).count();
                let values: Vec<f64> = (s..s + count).map(|s| self.value(s, from, t)).collect();
                s += count;
                let joint = &mut self.out.joints[j];
                for (list, value) in signals_mut(joint).zip(values) {
                    list.push(value);
                }
            }
            let u = (t - self.rows[from].t) / (end - self.rows[from].t);
            let (before, after) = (&self.rows[from].extra, &self.rows[from + 1].extra);
            let ends = before.iter().zip(after);
            for ((_, column), (a, b)) in self.out.extra.iter_mut().zip(ends) {
                column.push(between(*a, *b, u));
            }
            self.out.t.push(t);
            self.next += 1;
        }
    }

    fn push(&mut self, row: Row) {
        if self.rows.is_empty() {
            (self.start, self.next) = (row.t, 0);
        }
        self.rows.push(row);
        match self.rows.len() {
            3 => self.interval(0, false),
            4.. => {
                self.interval(1, false);
                self.rows.remove(0);
            }
            _ => {}
        }
    }

    /// Ends the stretch.
    fn end(&mut self) {
        if let Some(from) = self.rows.len().checked_sub(2) {
            self.interval(from, true);
        }
        self.rows.clear();
    }

    /// Returns the finished rows as a block.
    fn take(&mut self) -> Block {
        let empty = Block {
            continues: true,
            ..empty_as(&self.out)
        };
        std::mem::replace(&mut self.out, empty)
    }
}

impl Recording for Resampled<'_> {
    fn source(&self) -> Option<&dyn Recording> {
        Some(self.source)
    }

    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        let mut grid = Grid {
            period: self.period,
            rows: Vec::new(),
            start: 0.0,
            next: 0,
            out: Block::default(),
        };
        let mut give = |grid: &mut Grid| {
            let block = grid.take();
            if block.is_empty() {
                Ok(())
            } else {
                take(block)
            }
        };
        // A stretch ends only when the next one begins.
        let mut started = false;
        self.source.each_block(rows, &mut |block| {
            if !block.continues || !started {
                grid.end();
                give(&mut grid)?;
                grid.out = empty_as(&block);
                started = true;
            }
            for (k, t) in block.t.iter().enumerate() {
                grid.push(Row {
                    t: *t,
                    line: block.line(k),
                    values: block
                        .joints
                        .iter()
                        .flat_map(signals)
                        .map(|list| list[k])
                        .collect(),
                    extra: block.extra.iter().map(|(_, list)| list[k]).collect(),
                });
                if grid.out.len() >= rows {
                    give(&mut grid)?;
                }
            }
            Ok(())
        })?;
        grid.end();
        give(&mut grid)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::prepare::InMemory;

    fn collect(source: &InMemory, period: f64, rows: usize) -> Vec<Block> {
        let mut all = Vec::new();
        Resampled::new(source, period)
            .each_block(rows, &mut |block| {
                all.push(block);
                Ok(())
            })
            .unwrap();
        all
    }

    #[test]
    fn jittered_rows_come_back_even_and_on_the_curve() {
        let mut g = rand_pcg::Pcg64::seed_from_u64(4);
        let step = 1e-2;
        let mut made = |from: usize, to: usize, continues: bool| {
            let t: Vec<f64> = (from..to)
                .map(|k| step * (k as f64 + 0.5 * (g.random::<f64>() - 0.5)))
                .collect();
            Block {
                joints: vec![JointColumns {
                    q: t.iter().map(|t| (3.0 * t).sin()).collect(),
                    tau: t.iter().map(|t| 1.0 - 2.0 * t + 0.5 * t * t).collect(),
                    qd: Some(t.iter().map(|t| 3.0 * (3.0 * t).cos()).collect()),
                    ..Default::default()
                }],
                extra: vec![
                    ("added1".into(), t.iter().map(|t| 0.1 + 2.0 * t).collect()),
                    (
                        "mode".into(),
                        (from..to).map(|k| (k / 7 % 3) as f64).collect(),
                    ),
                ],
                first_line: from as u64 + 2,
                interpolated: Vec::new(),
                continues,
                t,
            }
        };
        let source = InMemory {
            label: "made".into(),
            blocks: vec![
                made(0, 100, false),
                made(100, 250, true),
                made(300, 500, false),
            ],
        };
        for rows in [10_000, 64] {
            let blocks = collect(&source, step, rows);
            let starts: Vec<usize> = (0..blocks.len())
                .filter(|b| !blocks[*b].continues)
                .collect();
            assert_eq!(starts.len(), 2);
            let all: usize = blocks.iter().map(Block::len).sum();
            assert!((447..=451).contains(&all), "{all}");
            let mut before: Option<f64> = None;
            for block in &blocks {
                let joint = &block.joints[0];
                for (k, t) in block.t.iter().enumerate() {
                    if let Some(before) = before.filter(|_| k > 0 || block.continues) {
                        assert!((t - before - step).abs() < 1e-12);
                    }
                    before = Some(*t);
                    // 200 rows per period of the sine.
                    assert!((joint.q[k] - (3.0 * t).sin()).abs() < 3e-5, "{t}");
                    // A parabola is reproduced exactly.
                    assert!((joint.tau[k] - (1.0 - 2.0 * t + 0.5 * t * t)).abs() < 1e-12);
                    assert!((joint.qd.as_ref().unwrap()[k] - 3.0 * (3.0 * t).cos()).abs() < 1e-3);
                    // A line is exact; modes have no intermediate values.
                    assert!((block.extra[0].1[k] - (0.1 + 2.0 * t)).abs() < 1e-12);
                    assert!([0.0, 1.0, 2.0].contains(&block.extra[1].1[k]));
                }
            }
        }
    }
}
