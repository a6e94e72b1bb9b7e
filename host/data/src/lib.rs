//! Recordings: columns with units, checked line by line and read in blocks of constant memory.
//!
//! [`Source`] reads CSV, MCAP and others repeatedly; [`RecordingWriter`] writes CSV, MCAP and Parquet. [`plausibility`] detects wrong units
//! before they lead to wrong parameters. [`prepare`] filters, differentiates and decimates recordings. [`runs`] holds
//! them in memory at the full rate, and [`Compensated`] subtracts the torques that a description already explains.
//!
//! ```no_run
//! use rig_data::Source;
//! use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = Robot::from_toml(ONE_LINK_TEMPLATE, "one-link.toml".as_ref())?;
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("log.csv");
//! let rows: String = (0..500).map(|k| format!("{},{},0.1\n", 0.001 * k as f64, 0.01 * k as f64)).collect();
//! std::fs::write(&path, format!("t,q1,tau1\n{rows}"))?;
//! let (blocks, warnings) = Source::open(&path, &robot)?.read_all()?;
//! assert_eq!(blocks[0].joints[0].q.len(), 500);
//! assert!(warnings.is_empty());
//! # Ok(())
//! # }
//! ```

mod array;
mod bag;
mod bag_table;
mod between_rows;
mod binary_number;
mod block;
mod bursts;
mod channel;
mod clock;
mod columns;
mod compensated;
pub mod contents;
mod csv;
mod csv_header;
mod decoder;
mod efforts;
mod error;
mod flat_message;
mod flat_rows;
mod foreign;
mod form;
mod frozen;
mod header;
mod iso_time;
mod joined_rows;
mod joint_names;
mod joint_states;
mod json_samples;
mod layout;
mod library_panic;
mod likely_time;
mod lost_rows;
mod mapping;
mod mat;
mod mat73;
mod mcap_index;
mod mcap_messages;
mod mcap_records;
mod mcap_rows;
mod mcap_sorted;
mod missing_rows;
mod motors;
mod npz;
mod npz_writer;
mod number;
mod own_names;
mod parquet;
mod place;
mod plain_rows;
mod plateau;
mod plausibility;
mod position_jump;
pub mod prepare;
mod quantity;
mod rate_match;
mod rate_spike;
mod rate_zeros;
mod reference;
mod remark;
mod ros_layout;
mod ros_message;
mod rounded_time;
pub mod runs;
mod sample_hold;
mod sampling;
pub mod sessions;
mod side_rows;
mod source;
mod sqlite;
mod stale_rows;
mod table_rows;
mod text_file;
mod thermal_history;
mod time_names;
mod torque_spike;
mod unit;
mod unsettled;
mod unsigned;
mod writer;
mod written_rows;

pub use block::{Block, JointColumns, WRENCH_COLUMNS, WRENCH_MESSAGE, WRENCH_TEMPERATURE};
pub use columns::EffortNeed;
pub use compensated::Compensated;
pub use error::{DataError, Warning};
pub use foreign::ForeignFormat;
pub use mapping::Mapping;
pub use npz_writer::write_npz;
pub use parquet::ParquetWriter;
pub use place::{Place, RowAt};
pub use plain_rows::PlainRows;
pub use plateau::{PILE_UP, Plateau, Stretch, plateaus};
pub use plausibility::{Implausible, JUDGED_ROWS, implausible_positions, plausibility};
pub use plausibility::{long_step, sign_of_steps, strange_rates, unit_of_steps, velocity_scale};
pub use position_jump::has_position_jump;
pub use quantity::Quantity;
pub use reference::reference_scale;
pub use reference::{StrangeReference, strange_references};
pub use remark::Remark;
pub use sampling::Sampling;
pub use source::{Blocks, KEPT_WARNINGS, Source, column_names};
pub use unit::Unit;
pub use writer::{CsvWriter, McapWriter, RecordingWriter};
pub use written_rows::Column;

#[cfg(test)]
mod bag_table_test;
#[cfg(test)]
mod csv_test;
#[cfg(test)]
mod made_for_tests;
#[cfg(test)]
mod mapping_test;
#[cfg(test)]
mod mcap_test;
#[cfg(test)]
mod motors_test;
#[cfg(test)]
mod tests;
