//! Options that say which channels of a recording are its columns.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use rig_data::Mapping;

use super::error::CommandError;

/// Units and columns of the recordings from a file: for a command whose `--map` has two meanings.
#[derive(Clone, Debug, Default, ClapArgs)]
pub(crate) struct UnitArg {
    /// Unit of a column (q1=deg, t=ms), or of that column of all joints (q=deg); repeat for several
    #[arg(long, value_name = "COLUMN=UNIT", help_heading = "Columns")]
    unit: Vec<String>,
    /// Clock of the messages of MCAP files and bags: their header stamps, or the time at which each was logged, for
    /// topics that are stamped by several clocks [default: stamp]
    #[arg(long, value_name = "CLOCK", value_parser = ["stamp", "log"], help_heading = "Columns")]
    clock: Option<String>,
    /// File with channels and units: TOML with the tables [columns] and [units], and clock
    #[arg(long, value_name = "FILE", help_heading = "Columns")]
    mapping: Option<PathBuf>,
}

/// Columns of the recordings, for files with other names or units.
#[derive(Clone, Debug, Default, ClapArgs)]
pub(crate) struct MapArg {
    /// Channel of the recordings that is a column, such as q1=joint_states/position/elbow; repeat for several
    /// (`rig inspect` lists channels and proposes these options)
    #[arg(long, value_name = "COLUMN=CHANNEL", help_heading = "Columns")]
    map: Vec<String>,
    #[command(flatten)]
    units: UnitArg,
}

impl UnitArg {
    /// Returns the mapping that the options state.
    ///
    /// # Errors
    /// Names the option, or the file and the entry, at fault.
    pub(crate) fn mapping(&self) -> Result<Mapping, CommandError> {
        let mut mapping = Mapping::default();
        if let Some(path) = &self.mapping {
            mapping.add_file(path)?;
        }
        if let Some(clock) = &self.clock {
            let set = mapping.set_clock(clock);
            set.map_err(|why| CommandError::Sentence(format!("--clock {clock}: {why}.")))?;
        }
        for entry in &self.unit {
            let added = mapping.add_unit(entry);
            added.map_err(|why| CommandError::Sentence(format!("--unit {entry}: {why}.")))?;
        }
        Ok(mapping)
    }

    /// Returns the mapping with columns, each as COLUMN=CHANNEL.
    ///
    /// # Errors
    /// As [`Self::mapping`].
    pub(crate) fn mapping_with(&self, columns: &[String]) -> Result<Mapping, CommandError> {
        let mut mapping = self.mapping()?;
        for entry in columns {
            let added = mapping.add_column(entry);
            added.map_err(|why| CommandError::Sentence(format!("--map {entry}: {why}.")))?;
        }
        Ok(mapping)
    }
}

impl MapArg {
    /// Does the same as [`UnitArg::mapping`], with the columns of the options.
    pub(crate) fn mapping(&self) -> Result<Mapping, CommandError> {
        self.units.mapping_with(&self.map)
    }
}
