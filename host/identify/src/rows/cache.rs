//! Rows for several passes, kept in a temporary file: computed once, read any number of times, memory constant.

use std::collections::HashMap;
use std::fs::File;
use std::io::Seek;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::equation::{Equation, Rows};
use super::tally::Tally;
use crate::error::IdentifyError;
use crate::options::ModelKind;
use rig_data::prepare::record::{Record, begin, put_count, put_numbers, unusable};
use rig_data::prepare::{PrepareError, Recording, record};

/// Recording (by address and name, both fixed while it is borrowed) and model.
type Key = (usize, String, bool);

/// Cached rows of every recording of a plan.
#[derive(Debug, Default)]
pub struct RowCache {
    /// Rows that differ from the wanted ones only in the `keep` flags.
    earlier: Option<Box<RowCache>>,
    kept: Mutex<HashMap<Key, (File, Tally)>>,
}

fn key(recording: &dyn Recording, model: ModelKind) -> Key {
    let address = std::ptr::from_ref(recording).cast::<()>().addr();
    (address, recording.label(), model == ModelKind::Integral)
}

impl RowCache {
    /// Creates a cache for a plan that differs from that of `earlier` only in the used rows: rows of the differential
    /// model are then taken from there.
    pub(crate) fn after(earlier: Self) -> Self {
        Self {
            earlier: Some(Box::new(earlier)),
            ..Self::default()
        }
    }

    /// Returns the rows of the earlier plan, record by record, if there are any.
    pub(crate) fn earlier(
        &self,
        recording: &dyn Recording,
        model: ModelKind,
    ) -> Result<Option<Records>, PrepareError> {
        match &self.earlier {
            Some(earlier) => Ok(earlier
                .records(recording, model)?
                .map(|(records, _)| records)),
            None => Ok(None),
        }
    }

    fn records(
        &self,
        recording: &dyn Recording,
        model: ModelKind,
    ) -> Result<Option<(Records, Tally)>, PrepareError> {
        let key = key(recording, model);
        let (mut file, tally) = match self.files().get(&key) {
            Some((file, tally)) => (file.try_clone().map_err(unusable)?, tally.clone()),
            None => return Ok(None),
        };
        file.rewind().map_err(unusable)?;
        let record = Vec::new();
        Ok(Some((Records { file, record }, tally)))
    }

    fn files(&self) -> MutexGuard<'_, HashMap<Key, (File, Tally)>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Passes cached rows to `take`; returns `None` if they must be computed.
    pub(crate) fn replay(
        &self,
        recording: &dyn Recording,
        model: ModelKind,
        take: &mut dyn FnMut(&Rows) -> Result<(), PrepareError>,
    ) -> Result<Option<Tally>, IdentifyError> {
        let Some((mut records, tally)) = self.records(recording, model)? else {
            return Ok(None);
        };
        while let Some(rows) = records.next()? {
            take(&rows)?;
        }
        Ok(Some(tally))
    }

    /// Computes the rows with `make`, passes them to `take` and caches them.
    pub(crate) fn keep(
        &self,
        recording: &dyn Recording,
        model: ModelKind,
        make: impl FnOnce(
            &mut dyn FnMut(&Rows) -> Result<(), PrepareError>,
        ) -> Result<Tally, IdentifyError>,
        take: &mut dyn FnMut(&Rows) -> Result<(), PrepareError>,
    ) -> Result<Tally, IdentifyError> {
        let mut file = tempfile::tempfile().map_err(unusable)?;
        let mut record = Vec::new();
        let tally = make(&mut |rows| {
            write(&mut file, &mut record, rows).map_err(unusable)?;
            take(rows)
        })?;
        self.files()
            .insert(key(recording, model), (file, tally.clone()));
        Ok(tally)
    }
}

/// Reader of cached rows.
pub(crate) struct Records {
    file: File,
    record: Vec<u8>,
}

impl Records {
    /// Returns the rows of the next piece.
    pub(crate) fn next(&mut self) -> Result<Option<Rows>, PrepareError> {
        read(&mut self.file, &mut self.record).map_err(unusable)
    }
}

/// Returns the number of leading regressor columns that are zero in all rows: those of the links below the joint.
fn leading_zeros(equation: &Equation) -> usize {
    let width = equation.x.len() / equation.y.len().max(1);
    let mut rows = equation.x.chunks_exact(width.max(1));
    rows.try_fold(width, |least, row| {
        let zeros = row[..least].iter().take_while(|x| **x == 0.0).count();
        // The number cannot fall further.
        if zeros == 0 { Err(()) } else { Ok(zeros) }
    })
    .unwrap_or(0)
}

/// Writes one record: its length in bytes, then the rows.
fn write(to: &mut File, record: &mut Vec<u8>, rows: &Rows) -> std::io::Result<()> {
    begin(record);
    put_count(record, rows.equations.len());
    put_count(record, rows.q.len());
    put_numbers(record, rows.t.iter());
    for list in rows.q.iter().chain(&rows.qd) {
        put_numbers(record, list.iter());
    }
    for equation in &rows.equations {
        let width = equation.x.len() / equation.y.len().max(1);
        let zeros = leading_zeros(equation);
        put_count(record, width);
        put_count(record, zeros);
        put_numbers(record, equation.y.iter());
        for row in equation.x.chunks_exact(width.max(1)) {
            put_numbers(record, row[zeros..].iter());
        }
        record.extend(equation.keep.iter().map(|keep| u8::from(*keep)));
    }
    record::write(to, record)
}

fn read(from: &mut File, record: &mut Vec<u8>) -> std::io::Result<Option<Rows>> {
    if !record::read(from, record)? {
        return Ok(None);
    }
    let mut record = Record(record);
    let (equations, joints) = (record.count()?, record.count()?);
    let t = record.list()?;
    let mut lists = |n: usize| {
        (0..n)
            .map(|_| record.list())
            .collect::<std::io::Result<Vec<_>>>()
    };
    let (q, qd) = (lists(joints)?, lists(joints)?);
    let equations = (0..equations)
        .map(|_| {
            let (width, zeros) = (record.count()?, record.count()?);
            let y = record.list()?;
            let mut x = Vec::with_capacity(width * y.len());
            for row in 1..=y.len() {
                x.resize(x.len() + zeros, 0.0);
                record.numbers(&mut x)?;
                // Complete every row, whatever the file contains.
                x.resize(row * width, 0.0);
            }
            let keep = record.bytes(y.len())?.iter().map(|k| *k == 1).collect();
            Ok(Equation { x, y, keep })
        })
        .collect::<std::io::Result<Vec<_>>>()?;
    Ok(Some(Rows {
        t,
        equations,
        q,
        qd,
    }))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_as_they_went() {
        let equation = |x: &[f64], y: &[f64]| Equation {
            x: x.to_vec(),
            y: y.to_vec(),
            keep: y.iter().map(|y| *y > 0.0).collect(),
        };
        let pieces = [
            Rows {
                t: vec![0.0, 1.0],
                equations: vec![
                    equation(&[0.0, -0.0, 1.5, 0.0, 0.0, 1e-300], &[1.0, -1.0]),
                    equation(&[0.0; 6], &[0.5, 0.25]),
                    equation(&[1.0, 0.0, 0.0, 0.0, 2.0, 3.0], &[0.0, 7.0]),
                ],
                q: vec![vec![1.0, 2.0], vec![3.0, 4.0]],
                qd: vec![vec![5.0, 6.0], vec![7.0, 8.0]],
            },
            Rows {
                equations: vec![Equation::default()],
                ..Default::default()
            },
        ];
        let mut file = tempfile::tempfile().unwrap();
        let mut record = Vec::new();
        for rows in &pieces {
            write(&mut file, &mut record, rows).unwrap();
        }
        file.rewind().unwrap();
        for rows in &pieces {
            let found = read(&mut file, &mut record).unwrap().unwrap();
            assert_eq!(
                (&found.t, &found.q, &found.qd),
                (&rows.t, &rows.q, &rows.qd)
            );
            assert_eq!(found.equations.len(), rows.equations.len());
            for (a, b) in found.equations.iter().zip(&rows.equations) {
                assert_eq!((&a.x, &a.y, &a.keep), (&b.x, &b.y, &b.keep));
            }
        }
        assert!(read(&mut file, &mut record).unwrap().is_none());
    }
}
