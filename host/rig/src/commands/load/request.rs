//! What `rig load` and the Python package are asked for.

use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};
use rig_data::prepare::{Choice, PrepareOptions};
use rig_data::{EffortNeed, Mapping, WRENCH_TEMPERATURE};
use rig_load::{By, FEWEST_ROWS, KnownMass, LoadIdentification, LoadOptions, identify_load};
use rig_model::robot::{LARGEST_GAIN_STD, Load, Original, Reads, Robot, WristSensor};

use crate::commands::error::CommandError;
use crate::commands::input::{Inputs, recordings, refuse_twice};
use crate::commands::same_file::{is_copy, is_same};

/// What is asked for: recordings, and how the load is found in them.
#[derive(Debug, ClapArgs)]
pub struct LoadRequest {
    /// Recording with the load, CSV or MCAP; one or more
    #[arg(long, required = true, num_args = 1..)]
    pub data: Vec<PathBuf>,
    /// Recording without the load: what is mounted beyond the sensor, or the bare robot, is subtracted
    #[arg(long, num_args = 1..)]
    pub without: Vec<PathBuf>,
    /// What the load is measured by
    #[arg(long, value_enum, default_value_t = Measured::Sensor)]
    pub by: Measured,
    /// The recordings are poses at rest; rows on the way between two are left out (assumed for rows far apart in time, and
    /// for fewer than 256)
    #[arg(long)]
    pub poses: bool,
    /// A known load (load.toml) that is mounted as well, and is subtracted
    #[arg(long, value_name = "FILE", conflicts_with = "without")]
    pub subtract: Option<PathBuf>,
    /// Mass of the load as weighed, kg: a contradiction to the identified mass tells a wrong unit of the forces, or a wrong
    /// scale of forces or torques. It enters no fit
    #[arg(long, value_name = "KG")]
    pub mass: Option<f64>,
    /// Standard deviation of --mass, kg
    #[arg(long, value_name = "KG", requires = "mass", default_value_t = 0.0)]
    pub mass_std: f64,
    /// Standard deviation of the gain of a channel of the sensor, relative (0.005 for 0.5 %): it is counted in the standard
    /// deviations of the load [default: gain_std of the table wrist_sensor; without it gains count as exact]
    #[arg(long, value_name = "SHARE")]
    pub gain_std: Option<f64>,
    /// Origin of the sensor in the flange frame, m
    #[arg(long, num_args = 3, value_names = ["X", "Y", "Z"])]
    pub sensor_position: Option<Vec<f64>>,
    /// Roll, pitch and yaw of the sensor's axes in the flange frame, rad
    #[arg(long, num_args = 3, value_names = ["R", "P", "Y"])]
    pub sensor_rotation: Option<Vec<f64>>,
    /// The wrench that the sensor reads: that of the load on the robot (weight, downwards), or that of the robot on it
    #[arg(long, value_enum)]
    pub reads: Option<ReadsArg>,
    /// Cut-off of the low-pass on the position, Hz [default: from the recording]
    #[arg(long)]
    pub cutoff: Option<f64>,
    /// Go on with the best explanation if channels look wrong; prints what is wrong
    #[arg(long)]
    pub even_if_wrong: bool,
}

/// What the load is measured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Measured {
    /// The wrist sensor
    Sensor,
    /// The joint torques
    Torque,
    /// Both, weighted by their uncertainty
    Both,
}

/// The wrench that the sensor reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ReadsArg {
    /// That of the load on the robot
    Load,
    /// That of the robot on the load
    Robot,
}

impl LoadRequest {
    /// Refuses options and files that do not fit together.
    ///
    /// # Errors
    /// A sentence that names the option or the file.
    pub fn check(&self) -> Result<(), CommandError> {
        refuse_twice(&self.data, "give every recording once")?;
        refuse_twice(&self.without, "give every recording once")?;
        refuse_both(&self.data, &self.without)?;
        if self.poses && self.by != Measured::Sensor {
            return Err(CommandError::Sentence(
                "--poses is for the wrist sensor alone: joint torques at rest are hidden by friction. Leave it out, or use --by sensor."
                    .to_owned(),
            ));
        }
        Ok(())
    }

    /// Puts the sensor of the request into the description, and opens the recordings with the load and those without it.
    ///
    /// # Errors
    /// A sentence that names the wrong option or file.
    pub fn open(&self, robot: &mut Robot, mapping: Mapping) -> Result<[Inputs; 2], CommandError> {
        sensor(self, robot)?;
        let need = match self.by {
            Measured::Sensor => EffortNeed::Optional,
            Measured::Torque | Measured::Both => EffortNeed::Required,
        };
        let mapping = match self.by {
            Measured::Torque => mapping,
            _ => mapping.with_wrench().with_numbers(WRENCH_TEMPERATURE),
        };
        let read = |paths| Inputs::read_mapped(robot, paths, need, &mapping);
        Ok([read(&self.data)?, read(&self.without)?])
    }

    /// Identifies the load. `refuse_faults` checks the columns of recordings whose torques are used.
    ///
    /// # Errors
    /// A sentence that names the wrong file, line or value.
    pub fn identify(
        &self,
        (robot, urdf): (&Robot, Option<&Original>),
        [with, without]: &[Inputs; 2],
        refuse_faults: impl FnOnce(&[&Inputs]) -> Result<(), CommandError>,
    ) -> Result<LoadIdentification, CommandError> {
        match self.by {
            Measured::Sensor => {
                let least = if self.poses { usize::MAX } else { FEWEST_ROWS };
                with.refuse_units(robot, least)?;
                without.refuse_units(robot, least)?;
            }
            Measured::Torque | Measured::Both => refuse_faults(&[with, without])?,
        }
        let options = options(self)?;
        let mut found = identify_load(
            robot,
            &recordings(&with.listened()),
            &recordings(&without.listened()),
            &options,
        )?;
        (found.warnings).extend(urdf.and_then(beyond_flange));
        let are_poses = (found.sensor.as_ref()).is_some_and(|own| own.prepared.is_none());
        for inputs in [with, without] {
            // Time passes from one pose to the next.
            found.warnings.extend(match are_poses {
                true => inputs.heard_but(&|warning| warning.is_of_time()),
                false => inputs.heard(),
            });
        }
        Ok(found)
    }
}

/// Says which links are fixed beyond the flange; `None` if there are none.
fn beyond_flange(urdf: &Original) -> Option<String> {
    let beyond = urdf.beyond_tip();
    let last = beyond.last()?;
    Some(format!(
        "The flange frame is that of link {}. Fixed to it, with frames of their own: {}. If the flange of your controller is one of these, give it, for example --tip {last}.",
        urdf.tip(),
        beyond.join(", ")
    ))
}

/// Refuses a recording that is given both with and without the load, by one name or as a copy.
fn refuse_both(with: &[PathBuf], without: &[PathBuf]) -> Result<(), CommandError> {
    let wants = "give a recording with the load, and another one without it";
    for path in without {
        if with.iter().any(|own| is_same(own, path)) {
            return Err(CommandError::Sentence(format!(
                "{} is given both as --data and as --without; {wants}.",
                path.display()
            )));
        }
        if let Some(own) = with.iter().find(|own| is_copy(own, path)) {
            return Err(CommandError::Sentence(format!(
                "{} (--without) has the same bytes as {} (--data); {wants}.",
                path.display(),
                own.display()
            )));
        }
    }
    Ok(())
}

/// Puts the sensor of the options into the description.
fn sensor(args: &LoadRequest, robot: &mut Robot) -> Result<(), CommandError> {
    let mut sensor = robot.wrist_sensor.clone().unwrap_or_default();
    let three = |name: &str,
                 list: &[f64],
                 most: f64,
                 unit: &str|
     -> Result<[f64; 3], CommandError> {
        match list {
            [a, b, c] if list.iter().all(|v| v.abs() <= most) => Ok([*a, *b, *c]),
            _ => Err(CommandError::Sentence(format!(
                "--{name} {list:?} is not possible: give three numbers of at most {most} {unit}, in {unit}."
            ))),
        }
    };
    if let Some(list) = &args.sensor_position {
        sensor.position = three("sensor-position", list, 1e4, "m")?;
        if let Some(text) = sensor.too_far() {
            return Err(CommandError::Sentence(text));
        }
    }
    if let Some(list) = &args.sensor_rotation {
        sensor.rotation = three("sensor-rotation", list, 7.0, "rad")?;
    }
    if let Some(reads) = args.reads {
        sensor.reads = Some(match reads {
            ReadsArg::Load => Reads::Load,
            ReadsArg::Robot => Reads::Robot,
        });
    }
    if let Some(std) = args.gain_std {
        if !(0.0..=LARGEST_GAIN_STD).contains(&std) {
            return Err(CommandError::Sentence(format!(
                "--gain-std {std} is not possible: give a share of 1 from 0 to {LARGEST_GAIN_STD} (0.005 for 0.5 %)."
            )));
        }
        sensor.gain_std = Some(std);
    }
    if args.by != Measured::Torque || sensor != WristSensor::default() {
        robot.wrist_sensor = Some(sensor);
    }
    Ok(())
}

/// Returns the mass that the user knows.
fn known_mass(args: &LoadRequest) -> Result<Option<KnownMass>, CommandError> {
    let Some(mass) = args.mass else {
        return Ok(None);
    };
    let std = args.mass_std;
    if !(mass > 0.0 && mass.is_finite() && (0.0..mass).contains(&std)) {
        return Err(CommandError::Sentence(format!(
            "--mass {mass} with --mass-std {std} is not possible: give a mass greater than 0 and a standard deviation below it, in kg."
        )));
    }
    Ok(Some(KnownMass { mass, std }))
}

/// Returns the options of the identification.
fn options(args: &LoadRequest) -> Result<LoadOptions, CommandError> {
    Ok(LoadOptions {
        by: match args.by {
            Measured::Sensor => By::Sensor,
            Measured::Torque => By::Torque,
            Measured::Both => By::Both,
        },
        poses: args.poses,
        tool: args.subtract.as_deref().map(Load::read).transpose()?,
        known_mass: known_mass(args)?,
        prepare: PrepareOptions {
            cutoff: args.cutoff.map_or(Choice::Auto, Choice::Fixed),
            ..PrepareOptions::default()
        },
        even_if_wrong: args.even_if_wrong,
    })
}
