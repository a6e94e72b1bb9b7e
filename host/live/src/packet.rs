//! Samples and on-line estimates as the clients receive them.
//!
//! A binary message of the page: kind (`u32`, 1 samples, 2 estimate), count (`u32`), number of the first sample
//! (`f64`), then columns of `count` `f64` each; little-endian. Samples have the columns of [`COLUMNS`]. An estimate is
//! one column: time, residual RMS, values, standard deviations, 1 or 0 for trusted or not, rows (used, masked,
//! uninformative), and the number of [`Learning`](rig_shared::estimation::Learning).

use axum::body::Bytes;
use rig_link::{COLUMNS, Row};
use rig_shared::link::PARAMETER_COUNT;
use rig_shared::wire::message::Estimate;

/// Number of values of an estimate.
pub(crate) const ESTIMATE_VALUES: usize = 2 + 3 * PARAMETER_COUNT + 4;

/// One message to every client, encoded once.
#[derive(Clone, Debug)]
pub(crate) enum Packet {
    Samples(Samples),
    Estimate(EstimateValues),
}

/// Consecutive samples.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    /// Number of samples received from the rig before the first of these.
    pub first: u64,
    pub rows: Vec<Row>,
    pub bytes: Bytes,
}

/// An on-line estimate: time (s), residual RMS (N·m), values, standard deviations, trusted, rows, learning.
#[derive(Clone, Debug)]
pub(crate) struct EstimateValues {
    pub values: [f64; ESTIMATE_VALUES],
    pub bytes: Bytes,
}

impl Packet {
    pub(crate) fn samples(first: u64, rows: Vec<Row>) -> Self {
        let mut bytes = head(1, rows.len(), first);
        for column in 0..COLUMNS.len() {
            for row in &rows {
                bytes.extend(row.values()[column].to_le_bytes());
            }
        }
        Self::Samples(Samples {
            first,
            rows,
            bytes: bytes.into(),
        })
    }

    pub(crate) fn estimate(estimate: &Estimate, control_rate: f64) -> Self {
        let mut values = [0.0; ESTIMATE_VALUES];
        let trusted = estimate.trusted.map(|yes| f64::from(u8::from(yes)));
        let rows = estimate.rows;
        let learning = [
            rows.used,
            rows.masked,
            rows.uninformative,
            estimate.learning as u32,
        ];
        let all = [
            estimate.tick as f64 / control_rate,
            estimate.residual_rms.into(),
        ]
        .into_iter()
        .chain(estimate.value.map(f64::from))
        .chain(estimate.std.map(f64::from))
        .chain(trusted)
        .chain(learning.map(f64::from));
        for (place, value) in values.iter_mut().zip(all) {
            *place = value;
        }
        let mut bytes = head(2, ESTIMATE_VALUES, 0);
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        Self::Estimate(EstimateValues {
            values,
            bytes: bytes.into(),
        })
    }
}

fn head(kind: u32, count: usize, first: u64) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(16 + 8 * count * COLUMNS.len());
    bytes.extend(kind.to_le_bytes());
    bytes.extend((count as u32).to_le_bytes());
    bytes.extend((first as f64).to_le_bytes());
    bytes
}
