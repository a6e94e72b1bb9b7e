//! Signals as they come in: one column of samples a joint.

use super::BatchError;

/// Checks that every signal has one column a joint, all of the same length, and gives that length.
pub(super) fn samples<S: AsRef<[f64]>>(
    joints: usize,
    signals: &[(&'static str, &[S])],
) -> Result<usize, BatchError> {
    let mut samples = None;
    for (argument, columns) in signals {
        if columns.len() != joints {
            return Err(BatchError::WrongColumns {
                argument,
                expected: joints,
                found: columns.len(),
            });
        }
        for (joint, column) in columns.iter().enumerate() {
            let found = column.as_ref().len();
            let expected = *samples.get_or_insert(found);
            if found != expected {
                return Err(BatchError::WrongSamples {
                    argument,
                    joint,
                    expected,
                    found,
                });
            }
        }
    }
    Ok(samples.unwrap_or(0))
}

/// Checks that `out` holds `columns` columns of `samples`.
pub(super) fn output(columns: usize, samples: usize, out: &[f64]) -> Result<(), BatchError> {
    if out.len() == columns * samples {
        Ok(())
    } else {
        Err(BatchError::WrongOutput {
            columns,
            samples,
            found: out.len(),
        })
    }
}

/// Row `k` of the columns.
pub(super) fn row<S: AsRef<[f64]>>(columns: &[S], k: usize, out: &mut [f64]) {
    for (value, column) in out.iter_mut().zip(columns) {
        *value = column.as_ref()[k];
    }
}
