//! A recording that is read from its file only once.

use std::fs::File;
use std::io::Seek;
use std::sync::{Mutex, PoisonError};

use super::error::PrepareError;
use super::pieces::Recording;
use super::record::{self, Record, begin, put_count, put_numbers, unusable};
use crate::block::stretch;
use crate::block::{Block, JointColumns};
use crate::unsettled::{MARKED_BY, with_marks};

/// A recording that is written to a temporary file while it is first read, and read from there afterwards. Text is thus
/// parsed once and memory stays constant. Keeps time, position, torque, measured derivatives, temperature and the
/// marks of the rig; drops other columns.
pub struct Spooled<'a> {
    source: &'a dyn Recording,
    kept: Mutex<Option<(File, u64)>>,
}

impl<'a> Spooled<'a> {
    /// Prepares the recording without reading it.
    pub fn new(source: &'a dyn Recording) -> Self {
        Self {
            source,
            kept: Mutex::new(None),
        }
    }

    /// Prepares each of several recordings.
    pub fn all(sources: &[&'a dyn Recording]) -> Vec<Self> {
        sources.iter().map(|source| Self::new(*source)).collect()
    }
}

impl Recording for Spooled<'_> {
    fn source(&self) -> Option<&dyn Recording> {
        Some(self.source)
    }

    /// The source hears only of the readings of its own spool.
    fn passed(&self, _: f64) {}

    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let mut record = Vec::new();
        if let Some((file, all)) = kept.as_mut() {
            file.rewind().map_err(unusable)?;
            while let Some(block) = read(file, &mut record).map_err(unusable)? {
                self.source
                    .passed(block.len() as f64 / (*all).max(1) as f64);
                if block.len() <= rows {
                    take(block)?;
                    continue;
                }
                for start in (0..block.len()).step_by(rows.max(1)) {
                    let end = start.saturating_add(rows.max(1)).min(block.len());
                    take(stretch(&block, start, end))?;
                }
            }
            return Ok(());
        }
        let mut file = tempfile::tempfile().map_err(unusable)?;
        let mut all = 0;
        self.source.each_block(rows, &mut |block| {
            let block = bare(block);
            all += block.len() as u64;
            write(&mut file, &mut record, &block).map_err(unusable)?;
            take(block)
        })?;
        *kept = Some((file, all));
        Ok(())
    }
}

/// Removes the columns that are not kept.
fn bare(block: Block) -> Block {
    Block {
        joints: block
            .joints
            .into_iter()
            .map(|j| JointColumns {
                reference: None,
                voltage: None,
                link: None,
                ..j
            })
            .collect(),
        extra: with_marks(&block.extra),
        ..block
    }
}

fn write(to: &mut File, record: &mut Vec<u8>, block: &Block) -> std::io::Result<()> {
    begin(record);
    put_count(record, block.first_line as usize);
    put_count(record, usize::from(block.continues));
    put_count(record, block.interpolated.len());
    block
        .interpolated
        .iter()
        .for_each(|row| put_count(record, *row));
    put_numbers(record, block.t.iter());
    put_count(record, block.joints.len());
    for joint in &block.joints {
        put_numbers(record, joint.q.iter());
        put_numbers(record, joint.tau.iter());
        for measured in [&joint.qd, &joint.qdd, &joint.temperature, &joint.effects] {
            put_count(record, usize::from(measured.is_some()));
            if let Some(list) = measured {
                put_numbers(record, list.iter());
            }
        }
    }
    put_count(record, block.extra.len());
    for (_, list) in &block.extra {
        put_numbers(record, list.iter());
    }
    record::write(to, record)
}

fn read(from: &mut File, record: &mut Vec<u8>) -> std::io::Result<Option<Block>> {
    if !record::read(from, record)? {
        return Ok(None);
    }
    let mut record = Record(record);
    let first_line = record.count()? as u64;
    let continues = record.count()? == 1;
    let interpolated = (0..record.count()?)
        .map(|_| record.count())
        .collect::<std::io::Result<Vec<_>>>()?;
    let t = record.list()?;
    let joints = (0..record.count()?)
        .map(|_| {
            let (q, tau) = (record.list()?, record.list()?);
            let mut measured = || match record.count()? {
                1 => record.list().map(Some),
                _ => Ok(None),
            };
            let (qd, qdd) = (measured()?, measured()?);
            let (temperature, effects) = (measured()?, measured()?);
            Ok(JointColumns {
                q,
                tau,
                qd,
                qdd,
                temperature,
                effects,
                ..Default::default()
            })
        })
        .collect::<std::io::Result<Vec<_>>>()?;
    let extra = (MARKED_BY.iter().take(record.count()?))
        .map(|name| Ok(((*name).to_owned(), record.list()?)))
        .collect::<std::io::Result<Vec<_>>>()?;
    Ok(Some(Block {
        t,
        joints,
        extra,
        first_line,
        interpolated,
        continues,
    }))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::prepare::InMemory;

    /// Counts how often it is read.
    struct Counted(InMemory, Cell<usize>);

    impl Recording for Counted {
        fn label(&self) -> String {
            self.0.label()
        }
        fn each_block(
            &self,
            rows: usize,
            take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
        ) -> Result<(), PrepareError> {
            self.1.set(self.1.get() + 1);
            self.0.each_block(rows, take)
        }
    }

    #[test]
    fn the_source_is_read_once_and_comes_back_as_it_was() {
        let list = |from: usize, scale: f64| (from..from + 100).map(|k| scale * k as f64).collect();
        let block = |from: usize, continues: bool, measured: bool| Block {
            t: list(from, 1e-3),
            joints: (1..3)
                .map(|j| JointColumns {
                    q: list(from, 0.1 * j as f64),
                    tau: list(from, -0.7 * j as f64),
                    qd: (measured && j == 1).then(|| list(from, 3.0)),
                    ..Default::default()
                })
                .collect(),
            extra: MARKED_BY
                .iter()
                .filter(|_| measured)
                .map(|name| ((*name).to_owned(), list(from, 1.0)))
                .collect(),
            first_line: from as u64 + 2,
            interpolated: vec![1],
            continues,
        };
        let source = Counted(
            InMemory {
                label: "made".into(),
                blocks: vec![
                    block(0, false, true),
                    block(100, true, true),
                    block(300, false, false),
                ],
            },
            Cell::new(0),
        );
        let spooled = Spooled::new(&source);
        let collect = |of: &dyn Recording, rows: usize| {
            let mut all = Vec::new();
            of.each_block(rows, &mut |b| {
                all.push(b);
                Ok(())
            })
            .unwrap();
            all
        };
        let expected = collect(&source.0, 64);
        for _ in 0..3 {
            assert_eq!(collect(&spooled, 64), expected);
        }
        // Smaller blocks than those stored.
        assert_eq!(collect(&spooled, 32).len(), 12);
        assert_eq!(source.1.get(), 1);
    }

    #[test]
    fn what_was_broken_off_is_read_again() {
        let source = InMemory {
            label: "made".into(),
            blocks: vec![
                Block {
                    t: vec![1.0, 2.0],
                    ..Default::default()
                };
                2
            ],
        };
        let spooled = Spooled::new(&source);
        let stop = |_| Err(PrepareError::Stopped("enough".into()));
        assert!(spooled.each_block(10, &mut { stop }).is_err());
        let mut rows = 0;
        spooled
            .each_block(10, &mut |b| {
                rows += b.len();
                Ok(())
            })
            .unwrap();
        assert_eq!(rows, 4);
    }
}
