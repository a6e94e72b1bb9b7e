//! The demonstration without hardware: a rig that differs from its description is excited, recorded over the real wire
//! protocol, identified off-line and on-line, diagnosed and compensated. One report shows all results.

mod figures;

use std::path::Path;

use rig_shared::friction::Friction;
use rig_shared::trajectory::{FrictionSweep, SlowReversals, Trajectory};
use rig_shared::wire::message::RequestBody;
use thiserror::Error;

use rig_data::{DataError, Source};
use rig_diagnose::{DiagnoseError, Diagnosis, diagnose};
use rig_excite::ExciteError;
use rig_identify::{
    FrictionMap, FrictionMapOptions, Identification, IdentifyError, ModelKind, Options,
    friction_map, identified_robot, identify,
};
use rig_link::recorded_run::pause;
use rig_link::{
    EmulatedPort, LinkError, LossReport, RecordedRun, RunError, Session, SessionSettings,
};
use rig_model::robot::{ONE_LINK_TEMPLATE, Robot, RobotError};
use rig_model::simulate::SimulateError;
use rig_output::{WriteError, folder, write_whole};
use rig_plant::emulated::{EmulatedRig, Nameplate, NameplateError, link_parameters};
use rig_plant::{Equivalent, PlantConfig};

/// Speed of the slow reversals that test the precompensation, rad/s.
const SLOW: f64 = 0.05;
/// Rest after the slow reversals, which would show a limit cycle, s.
const REST: f64 = 5.0;
/// Speeds of the friction sweep, rad/s: below, at and well above the Stribeck velocity of a servo gear
/// (0.01 to 0.3 rad/s; Armstrong-Hélouvry, Dupont & Canudas de Wit 1994).
const SPEEDS: [f64; 12] = [
    0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.35, 0.6, 1.0, 1.5, 2.0,
];

/// Reason why the demonstration failed.
#[derive(Debug, Error)]
pub enum DemoError {
    /// The description.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The nameplate that is sent to the firmware.
    #[error(transparent)]
    Nameplate(#[from] NameplateError),
    /// Trajectory design.
    #[error(transparent)]
    Excite(#[from] ExciteError),
    /// The link.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// An experiment.
    #[error(transparent)]
    Run(#[from] RunError),
    /// Recordings.
    #[error(transparent)]
    Data(#[from] DataError),
    /// Identification.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// Diagnosis.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// The model for a figure.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Files.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A fault of the rig.
    #[error("{0}")]
    Sentence(String),
}

/// Results of the demonstration.
pub struct Demo {
    /// Description that firmware and host were given.
    pub robot: Robot,
    /// True parameters of the emulated rig, with the link's true angle as coordinate.
    pub truth: Equivalent,
    /// Identification with the differential model.
    pub differential: Identification,
    /// Identification with the integral model.
    pub integral: Identification,
    /// Friction as a function of speed.
    pub friction_map: FrictionMap,
    /// Diagnosis of the identified description.
    pub diagnosis: Diagnosis,
    /// Identified description with the effects that were found.
    pub model: Robot,
    /// The training run, with its on-line estimates.
    pub training: RecordedRun,
    /// The hold-out run.
    pub holdout: RecordedRun,
    /// Slow reversals without precompensation.
    pub without: RecordedRun,
    /// Slow reversals with precompensation.
    pub with: RecordedRun,
    /// Lost samples of each run.
    pub losses: Vec<LossReport>,
    /// Sample rate of the telemetry, Hz.
    pub sample_rate: f64,
}

/// Runs the demonstration and writes recordings and the identified description into `out`. Calls `progress` with the
/// share of the work that is done, 0 to 1.
///
/// # Errors
/// [`DemoError`], whose text is a sentence.
pub fn run(out: &Path, seed: u64, mut progress: impl FnMut(f64)) -> Result<Demo, DemoError> {
    folder(out)?;
    let plant = PlantConfig::laboratory(seed);
    let robot = nameplate_of(&plant)?;
    let nameplate = Nameplate::from_robot(&robot)?;
    let home = plant.initial_position;
    let truth = plant.equivalent();
    let rig = EmulatedRig::new(&nameplate, plant, seed).map_err(|fault| {
        DemoError::Sentence(format!(
            "The estimator's settings cannot be used: {fault:?}."
        ))
    })?;
    let mut session = Session::open(EmulatedPort::new(rig), SessionSettings::default())?;
    let at_home = vec![RequestBody::SetPosition(home as f32)];
    // Two motions without a pause can overheat the motor.
    let cooling = f64::from(nameplate.config.monitor.thermal_time);
    let mut losses = Vec::new();
    let mut record = |session: &mut Session<_>,
                      name: &str,
                      settings: Vec<RequestBody>,
                      motion: &Trajectory<f64>,
                      rest| {
        pause(session, cooling)?;
        let run = RecordedRun::record(session, settings, motion, rest, &out.join(name))?;
        losses.push(run.losses);
        Ok::<_, DemoError>(run)
    };

    let design = rig_excite::design(&robot, &design_options(seed, home), |_, _| ())?;
    let other = rig_excite::design(&robot, &design_options(seed + 1, home), |_, _| ())?;
    progress(0.2);
    let training = record(
        &mut session,
        "train.csv",
        at_home,
        &design.file.joints[0].trajectory,
        0.5,
    )?;
    progress(0.3);
    record(
        &mut session,
        "train-again.csv",
        vec![],
        &design.file.joints[0].trajectory,
        0.5,
    )?;
    progress(0.4);
    let holdout = record(
        &mut session,
        "holdout.csv",
        vec![],
        &other.file.joints[0].trajectory,
        0.5,
    )?;
    progress(0.5);
    let sweep = sweep()?;
    record(&mut session, "sweep.csv", vec![], &sweep, 0.5)?;
    let reversals = reversals()?;
    let without = record(&mut session, "slow-without.csv", vec![], &reversals, REST)?;
    progress(0.6);

    let open = |name: &str| Source::open(&out.join(name), &robot);
    let (train, hold) = (open("train.csv")?, open("holdout.csv")?);
    let fit = |model| {
        identify(
            &robot,
            &[&train],
            &[&hold],
            &Options {
                model,
                ..Options::default()
            },
        )
    };
    let differential = fit(ModelKind::Differential)?;
    let integral = fit(ModelKind::Integral)?;
    let sweep = open("sweep.csv")?;
    let friction_map = friction_map(
        &robot,
        &differential,
        &sweep,
        0,
        FrictionMapOptions::default(),
    )?;
    let (identified, _) = identified_robot(&robot, &differential);
    write_whole(
        &out.join("identified.toml"),
        identified.to_toml()?.as_bytes(),
    )?;
    let (again, slow) = (open("train-again.csv")?, open("slow-without.csv")?);
    let (diagnosis, model) = diagnose(
        &identified,
        &[&train, &again, &slow],
        &[&hold],
        &rig_diagnose::Options {
            seed,
            ..rig_diagnose::Options::default()
        },
        &mut |share| progress(0.6 + 0.3 * share),
    )?;
    write_whole(&out.join("model.toml"), model.to_toml()?.as_bytes())?;
    progress(0.9);

    let uploaded = compensation(&identified, &friction_map)?;
    let with = record(&mut session, "slow-with.csv", uploaded, &reversals, REST)?;
    progress(1.0);
    Ok(Demo {
        robot,
        truth,
        differential,
        integral,
        friction_map,
        diagnosis,
        model,
        training,
        holdout,
        without,
        with,
        losses,
        sample_rate: f64::from(nameplate.config.rates.telemetry_hz()),
    })
}

/// Returns the shipped description with the torque constant, resistance and inductance of this motor's nameplate.
/// Masses, inertia and friction keep the guesses of the description.
///
/// A wrong torque constant scales every torque by the same factor and is not identifiable from torque and motion, so
/// the demonstration takes it from the nameplate.
fn nameplate_of(plant: &PlantConfig) -> Result<Robot, DemoError> {
    let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml"))?;
    for drive in robot
        .joints
        .iter_mut()
        .filter_map(|joint| joint.drive.as_mut())
    {
        drive.torque_constant = plant.motor.torque_constant;
        drive.resistance = Some(plant.motor.resistance);
        drive.inductance = Some(plant.motor.inductance);
    }
    Ok(robot)
}

fn design_options(seed: u64, home: f64) -> rig_excite::Options {
    rig_excite::Options {
        start: Some(vec![home]),
        seed,
        ..rig_excite::Options::default()
    }
}

/// The friction sweep: at each speed at least 0.4 rad in both directions.
fn sweep() -> Result<Trajectory<f64>, DemoError> {
    FrictionSweep::new(&SPEEDS, 0.4, 0.1, 0.3, 1.0)
        .map(Trajectory::FrictionSweep)
        .ok_or_else(|| {
            DemoError::Sentence("The friction sweep cannot be built from its speeds.".into())
        })
}

fn reversals() -> Result<Trajectory<f64>, DemoError> {
    SlowReversals::new(SLOW, 0.1, &[0.1, 0.05], 3)
        .map(Trajectory::SlowReversals)
        .ok_or_else(|| {
            DemoError::Sentence("The slow reversals cannot be built from their speed.".into())
        })
}

/// Returns the requests that send the identified model and friction law to the rig and switch precompensation on.
fn compensation(identified: &Robot, map: &FrictionMap) -> Result<Vec<RequestBody>, DemoError> {
    let model = link_parameters(identified)?;
    let mut settings = Nameplate::from_robot(identified)?.settings.precompensation;
    settings.enabled = true;
    let weakening = map.stribeck.as_ref().filter(|_| map.warranted);
    let friction = Friction {
        coulomb: model.coulomb,
        viscous: model.viscous,
        breakaway_excess: weakening.map_or(0.0, |fit| fit.breakaway_excess as f32),
        stribeck_velocity: weakening
            .and_then(|fit| fit.stribeck_velocity)
            .unwrap_or(0.0) as f32,
        ..Friction::default()
    };
    Ok(vec![
        RequestBody::SetModel(model),
        RequestBody::SetFriction(friction),
        RequestBody::SetPrecompensation(settings),
    ])
}
