//! Rows that several passes need, kept in a temporary file: made once, read as often as asked, memory constant.

use std::cell::RefCell;
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, BufWriter, ErrorKind, Read, Seek, Write};

use super::model::{Equation, Rows, Tally};
use super::{IdentifyError, ModelKind};
use crate::prepare::{PrepareError, Recording};

/// Which rows: of which recording (by address and name, both fixed while it is borrowed), of which model.
type Key = (usize, String, bool);

/// Rows of every recording that a plan has been applied to.
#[derive(Debug, Default)]
pub struct RowCache {
    kept: RefCell<HashMap<Key, (File, Tally)>>,
}

fn key(recording: &dyn Recording, model: ModelKind) -> Key {
    let address = std::ptr::from_ref(recording).cast::<()>().addr();
    (address, recording.label(), model == ModelKind::Integral)
}

fn failed(e: std::io::Error) -> PrepareError {
    PrepareError::Stopped(format!(
        "The temporary file for prepared rows cannot be used ({e}); make room in the folder for temporary files."
    ))
}

impl RowCache {
    /// Gives the rows again if they are kept; `None` if they have to be made.
    pub(super) fn replay(
        &self,
        recording: &dyn Recording,
        model: ModelKind,
        take: &mut dyn FnMut(&Rows) -> Result<(), PrepareError>,
    ) -> Result<Option<Tally>, IdentifyError> {
        let key = key(recording, model);
        let (mut file, tally) = match self.kept.borrow().get(&key) {
            Some((file, tally)) => (file.try_clone().map_err(failed)?, tally.clone()),
            None => return Ok(None),
        };
        file.rewind().map_err(failed)?;
        let mut reader = BufReader::new(file);
        while let Some(rows) = read(&mut reader).map_err(failed)? {
            take(&rows)?;
        }
        Ok(Some(tally))
    }

    /// Makes the rows with `make`, gives them to `take` and keeps them.
    pub(super) fn keep(
        &self,
        recording: &dyn Recording,
        model: ModelKind,
        make: impl FnOnce(
            &mut dyn FnMut(&Rows) -> Result<(), PrepareError>,
        ) -> Result<Tally, IdentifyError>,
        take: &mut dyn FnMut(&Rows) -> Result<(), PrepareError>,
    ) -> Result<Tally, IdentifyError> {
        let mut writer = BufWriter::new(tempfile::tempfile().map_err(failed)?);
        let tally = make(&mut |rows| {
            write(&mut writer, rows).map_err(failed)?;
            take(rows)
        })?;
        let file = writer.into_inner().map_err(|e| failed(e.into_error()))?;
        self.kept
            .borrow_mut()
            .insert(key(recording, model), (file, tally.clone()));
        Ok(tally)
    }
}

fn write_numbers(to: &mut impl Write, list: &[f64]) -> std::io::Result<()> {
    to.write_all(&(list.len() as u64).to_le_bytes())?;
    list.iter().try_for_each(|x| to.write_all(&x.to_le_bytes()))
}

fn write(to: &mut impl Write, rows: &Rows) -> std::io::Result<()> {
    to.write_all(&(rows.equations.len() as u64).to_le_bytes())?;
    to.write_all(&(rows.q.len() as u64).to_le_bytes())?;
    write_numbers(to, &rows.t)?;
    rows.q
        .iter()
        .chain(&rows.qd)
        .try_for_each(|list| write_numbers(to, list))?;
    rows.equations.iter().try_for_each(|equation| {
        write_numbers(to, &equation.x)?;
        write_numbers(to, &equation.y)?;
        equation
            .keep
            .iter()
            .try_for_each(|keep| to.write_all(&[u8::from(*keep)]))
    })
}

fn read_count(from: &mut impl Read) -> std::io::Result<usize> {
    let mut bytes = [0; 8];
    from.read_exact(&mut bytes)?;
    Ok(u64::from_le_bytes(bytes) as usize)
}

fn read_numbers(from: &mut impl Read) -> std::io::Result<Vec<f64>> {
    let mut bytes = vec![0; 8 * read_count(from)?];
    from.read_exact(&mut bytes)?;
    Ok(bytes
        .as_chunks::<8>()
        .0
        .iter()
        .map(|b| f64::from_le_bytes(*b))
        .collect())
}

fn read(from: &mut impl Read) -> std::io::Result<Option<Rows>> {
    let equations = match read_count(from) {
        Err(e) if e.kind() == ErrorKind::UnexpectedEof => return Ok(None),
        other => other?,
    };
    let joints = read_count(from)?;
    let t = read_numbers(from)?;
    let mut lists = |n: usize| {
        (0..n)
            .map(|_| read_numbers(from))
            .collect::<std::io::Result<Vec<_>>>()
    };
    let (q, qd) = (lists(joints)?, lists(joints)?);
    let equations = (0..equations)
        .map(|_| {
            let (x, y) = (read_numbers(from)?, read_numbers(from)?);
            let mut keep = vec![0; y.len()];
            from.read_exact(&mut keep)?;
            Ok(Equation {
                x,
                y,
                keep: keep.iter().map(|k| *k == 1).collect(),
            })
        })
        .collect::<std::io::Result<Vec<_>>>()?;
    Ok(Some(Rows {
        t,
        equations,
        q,
        qd,
    }))
}
