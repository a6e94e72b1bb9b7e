//! The demonstration step by step: excite, record, identify, diagnose, compensate.

use std::path::Path;

use rig_shared::friction::Friction;
use rig_shared::trajectory::Trajectory;
use rig_shared::wire::message::RequestBody;

use super::error::DemoError;
use super::motions::Motions;
use super::result::Demo;
use rig_data::Source;
use rig_diagnose::{Diagnosis, diagnose};
use rig_identify::{
    FrictionMap, FrictionMapOptions, Identification, ModelKind, Options, friction_map,
    identified_robot, identify,
};
use rig_link::recorded_run::pause;
use rig_link::{EmulatedPort, LossReport, RecordedRun, Session, SessionSettings};
use rig_model::robot::Robot;
use rig_output::{folder, write_whole};
use rig_plant::PlantConfig;
use rig_plant::emulated::{EmulatedRig, Nameplate, description_of, link_parameters};

/// Rest after a motion, s.
const PAUSE: f64 = 0.5;
/// Rest after the slow reversals, which would show a limit cycle, s.
const REST: f64 = 5.0;

/// Runs the demonstration and writes recordings and the identified description into `out`. Calls `progress` with the
/// share of the work that is done, 0 to 1.
///
/// # Errors
/// [`DemoError`], whose text is a sentence.
pub fn run(out: &Path, seed: u64, mut progress: impl FnMut(f64)) -> Result<Demo, DemoError> {
    folder(out)?;
    let plant = PlantConfig::laboratory(seed);
    let robot = description_of(&plant)?;
    let nameplate = Nameplate::from_robot(&robot)?;
    let home = plant.initial_position;
    let truth = plant.equivalent();
    let rig = EmulatedRig::new(&nameplate, plant, seed).map_err(|fault| {
        DemoError::Sentence(format!(
            "The estimator's settings cannot be used: {fault:?}."
        ))
    })?;
    let mut recorder = Recorder {
        session: Session::open(EmulatedPort::new(rig), SessionSettings::default())?,
        cooling: f64::from(nameplate.config.monitor.thermal_time),
        out,
        losses: Vec::new(),
    };
    let motions = Motions::new(&robot, seed, home)?;
    progress(0.2);
    let Runs {
        training,
        holdout,
        without,
    } = Runs::record(&mut recorder, &motions, home, &mut progress)?;
    let recordings = Recordings::open(&robot, out)?;
    let Fits {
        differential,
        integral,
        friction_map,
        identified,
    } = Fits::new(&robot, &recordings, out)?;
    let (diagnosis, model) = diagnosed(&identified, &recordings, out, seed, &mut progress)?;
    progress(0.9);
    let uploaded = compensation(&identified, &friction_map)?;
    let with = recorder.record("slow-with.csv", uploaded, &motions.reversals, REST)?;
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
        losses: recorder.losses,
        sample_rate: f64::from(nameplate.config.rates.telemetry_hz()),
    })
}

/// The line to the rig, and the recordings made over it.
struct Recorder<'a> {
    session: Session<EmulatedPort<EmulatedRig>>,
    /// Pause before each motion, s: two motions without a pause can overheat the motor.
    cooling: f64,
    /// Folder of the recordings.
    out: &'a Path,
    /// Lost samples of each run so far.
    losses: Vec<LossReport>,
}

impl Recorder<'_> {
    /// Sends `settings`, runs a motion and a rest, s, and writes the file `name`.
    fn record(
        &mut self,
        name: &str,
        settings: Vec<RequestBody>,
        motion: &Trajectory<f64>,
        rest: f64,
    ) -> Result<RecordedRun, DemoError> {
        pause(&mut self.session, self.cooling)?;
        let path = self.out.join(name);
        let run = RecordedRun::record(&mut self.session, settings, motion, rest, &path)?;
        self.losses.push(run.losses);
        Ok(run)
    }
}

/// Runs before the identification that the results show.
struct Runs {
    training: RecordedRun,
    holdout: RecordedRun,
    without: RecordedRun,
}

impl Runs {
    /// Records all runs with feedback alone, from the position `home`, rad.
    fn record(
        recorder: &mut Recorder<'_>,
        motions: &Motions,
        home: f64,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, DemoError> {
        let at_home = vec![RequestBody::SetPosition(home as f32)];
        let training = recorder.record("train.csv", at_home, &motions.training, PAUSE)?;
        progress(0.3);
        recorder.record("train-again.csv", vec![], &motions.training, PAUSE)?;
        progress(0.4);
        let holdout = recorder.record("holdout.csv", vec![], &motions.holdout, PAUSE)?;
        progress(0.5);
        recorder.record("sweep.csv", vec![], &motions.sweep, PAUSE)?;
        let without = recorder.record("slow-without.csv", vec![], &motions.reversals, REST)?;
        progress(0.6);
        Ok(Self {
            training,
            holdout,
            without,
        })
    }
}

/// The recordings of all runs before the identification.
struct Recordings {
    train: Source,
    again: Source,
    hold: Source,
    sweep: Source,
    slow: Source,
}

impl Recordings {
    /// Opens the recordings in `out`, made with the description `robot`.
    fn open(robot: &Robot, out: &Path) -> Result<Self, DemoError> {
        let open = |name: &str| Source::open(&out.join(name), robot);
        Ok(Self {
            train: open("train.csv")?,
            again: open("train-again.csv")?,
            hold: open("holdout.csv")?,
            sweep: open("sweep.csv")?,
            slow: open("slow-without.csv")?,
        })
    }
}

/// Fits to the recordings.
struct Fits {
    differential: Identification,
    integral: Identification,
    friction_map: FrictionMap,
    /// Description with the values of the differential model.
    identified: Robot,
}

impl Fits {
    /// Identifies both models and the friction map, and writes the identified description into `out`.
    fn new(robot: &Robot, recordings: &Recordings, out: &Path) -> Result<Self, DemoError> {
        let fit = |model| {
            identify(
                robot,
                &[&recordings.train],
                &[&recordings.hold],
                &Options {
                    model,
                    ..Options::default()
                },
            )
        };
        let differential = fit(ModelKind::Differential)?;
        let integral = fit(ModelKind::Integral)?;
        let friction_map = friction_map(
            robot,
            &differential,
            &recordings.sweep,
            0,
            FrictionMapOptions::default(),
        )?;
        let (identified, _) = identified_robot(robot, &differential);
        write_whole(
            &out.join("identified.toml"),
            identified.to_toml()?.as_bytes(),
        )?;
        Ok(Self {
            differential,
            integral,
            friction_map,
            identified,
        })
    }
}

/// Diagnoses the identified description. Writes the description with the effects that were found into `out` and
/// returns it, too.
fn diagnosed(
    identified: &Robot,
    recordings: &Recordings,
    out: &Path,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<(Diagnosis, Robot), DemoError> {
    let Recordings {
        train,
        again,
        hold,
        slow,
        ..
    } = recordings;
    let (diagnosis, model) = diagnose(
        identified,
        &[train, again, slow],
        &[hold],
        &rig_diagnose::Options {
            seed,
            ..rig_diagnose::Options::default()
        },
        &mut |share| progress(0.6 + 0.3 * share),
    )?;
    write_whole(&out.join("model.toml"), model.to_toml()?.as_bytes())?;
    Ok((diagnosis, model))
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
