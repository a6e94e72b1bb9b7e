//! Diagnosis from recordings: the effects that a model lacks.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use rig::commands::{
    CommandError, Inputs, recordings as listed, refuse_folder, refuse_shared, refuse_twice,
    write_diagnosis,
};
use rig_data::EffortNeed;
use rig_data::prepare::{Recording as Rows, Unburdened};
use rig_data::runs::Run;
use rig_diagnose::voltage::diagnose_voltage;
use rig_diagnose::{DiagnoseError, Options, clamped, outcome, sensor_zeros};
use rig_model::robot::{self, Description};
use rig_output::folder;
use rig_shared::effects::Kind;

use crate::error::{Error, refused, warn};
use crate::inputs::{Files, argument, paths, shown};
use crate::json;
use crate::recording::recordings;
use crate::robot::Robot;
use crate::watch::{Watch, run};

/// A fitted number.
#[pyclass(frozen, get_all, module = "rig_dynamics")]
pub(crate) struct Value {
    /// Value, SI.
    value: f64,
    /// Standard deviation; 0 for an integer, infinite if not identifiable.
    std: f64,
    /// Unit, ASCII.
    unit: String,
}

#[pymethods]
impl Value {
    fn __repr__(&self) -> String {
        let number = rig_output::format_value(self.value, self.std);
        format!("<{number} {}>", self.unit)
    }
}

/// An effect that was found.
#[pyclass(frozen, module = "rig_dynamics")]
pub(crate) struct Step {
    found: outcome::Step,
}

#[pymethods]
impl Step {
    /// Most probable name.
    #[getter]
    fn effect(&self) -> &str {
        &self.found.effect
    }

    /// Law, if the name has several.
    #[getter]
    fn law(&self) -> Option<&str> {
        self.found.law.as_deref()
    }

    /// Name of the joint.
    #[getter]
    fn joint(&self) -> &str {
        &self.found.joint
    }

    /// All names that these data support equally, ``effect`` among them.
    #[getter]
    fn set(&self) -> Vec<String> {
        self.found.set.clone()
    }

    /// Its parameters.
    #[getter]
    fn parameters(&self) -> BTreeMap<String, Value> {
        let all = self.found.parameters.iter();
        all.map(|(name, own)| {
            let value = Value {
                value: own.value,
                std: own.std,
                unit: own.unit.clone(),
            };
            (name.clone(), value)
        })
        .collect()
    }

    /// p-value, corrected for all trials.
    #[getter]
    fn p_value(&self) -> f64 {
        self.found.p_value
    }

    /// Posterior probability of the name among all tried in its place; NaN if no search compared them.
    #[getter]
    fn name_probability(&self) -> f64 {
        self.found.name_probability
    }

    /// Best name outside the set.
    #[getter]
    fn runner_up(&self) -> Option<&str> {
        self.found.runner_up.as_deref()
    }

    /// RMS of the joint's residual before and after this step, N*m or N (rad or m by voltage).
    #[getter]
    fn train_rms(&self) -> (f64, f64) {
        self.found.train_rms.into()
    }

    /// The same on the hold-out; None without one.
    #[getter]
    fn holdout_rms(&self) -> Option<(f64, f64)> {
        self.found.holdout_rms.map(Into::into)
    }

    /// Share of the gap to the noise floor that this step closes; NaN if no noise floor is known.
    #[getter]
    fn gap_closed(&self) -> f64 {
        self.found.gap_closed
    }

    /// Reason to believe it, a sentence.
    #[getter]
    fn why(&self) -> &str {
        &self.found.why
    }

    fn __repr__(&self) -> String {
        format!("<{} at joint {}>", self.found.effect, self.found.joint)
    }
}

/// The result of :func:`diagnose`. The attributes are those of ``diagnosis.json`` (docs/formats.md).
#[pyclass(frozen, module = "rig_dynamics")]
pub(crate) struct Diagnosis {
    found: outcome::Diagnosis,
    model: robot::Robot,
    json: String,
    /// Warnings about the recordings, for the report.
    warnings: Vec<String>,
    command: String,
}

impl Diagnosis {
    fn entry(&self, py: Python<'_>, key: &str) -> PyResult<Py<PyAny>> {
        Ok(json::entry(py, &self.json, key)?.unbind())
    }

    fn write(&self, out: &Path, force: bool) -> Result<(), CommandError> {
        refuse_folder(out, &[], force)?;
        folder(out)?;
        write_diagnosis(
            out,
            &self.found,
            &self.model,
            self.command.clone(),
            self.warnings.clone(),
            false,
        )
    }
}

#[pymethods]
impl Diagnosis {
    /// Verdict.
    #[getter]
    fn verdict(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.entry(py, "verdict")
    }

    /// The verdict in words, sentences.
    #[getter]
    fn words(&self) -> Vec<String> {
        self.found.words.clone()
    }

    /// The effects found, in their order.
    #[getter]
    fn steps(&self) -> Vec<Step> {
        let steps = self.found.steps.iter().cloned();
        steps.map(|found| Step { found }).collect()
    }

    /// Closed share of the residual's excess over the noise floor, on the hold-out (else training).
    #[getter]
    fn gap_closed(&self) -> Option<f64> {
        self.found.gap_closed
    }

    /// Noise floor of each joint; NaN if unknown.
    #[getter]
    fn noise_floor_rms(&self) -> Vec<f64> {
        self.found.noise_floor_rms.clone()
    }

    /// The unexplained residual.
    #[getter]
    fn remainder(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.entry(py, "remainder")
    }

    /// Torque residual of the written model, joint by joint.
    #[getter]
    fn left(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.entry(py, "left")
    }

    /// Nominal parameters that changed.
    #[getter]
    fn absorbed(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.entry(py, "absorbed")
    }

    /// Effects that these data cannot show.
    #[getter]
    fn not_testable(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.entry(py, "not_testable")
    }

    /// Experiment that would separate the names of a set, or make an effect testable.
    #[getter]
    fn next_experiment(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.entry(py, "next_experiment")
    }

    /// Faults of the recordings.
    #[getter]
    fn data_faults(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.entry(py, "data_faults")
    }

    /// The description with the effects found and the parameters fitted again.
    #[getter]
    fn robot(&self) -> PyResult<Robot> {
        Robot::of_result(self.model.clone())
    }

    /// Return the contents of ``diagnosis.json``.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::read(py, &self.json)
    }

    /// Write model.toml, diagnosis.json, report.html, the figures and, if there is one, next_experiment.toml.
    ///
    /// A folder with earlier results is refused unless ``force``.
    #[pyo3(signature = (folder, *, force = false))]
    fn save(&self, py: Python<'_>, folder: PathBuf, force: bool) -> PyResult<()> {
        py.detach(|| self.write(&folder, force)).map_err(refused)
    }

    fn __repr__(&self) -> String {
        let steps = self.found.steps.iter();
        let names: Vec<String> = steps
            .map(|step| format!("{} at joint {}", step.effect, step.joint))
            .collect();
        let said = format!("{:?}", self.found.verdict);
        format!("<Diagnosis: {said}; {}>", names.join(", "))
    }
}

/// Reads names of effects.
///
/// # Errors
/// A name that no effect has.
fn kinds(names: &[String]) -> PyResult<Vec<Kind>> {
    let mut found = Vec::new();
    for name in names {
        let own = Kind::ALL.iter().filter(|kind| kind.about().name == name);
        let before = found.len();
        found.extend(own.copied());
        if found.len() == before {
            let mut all: Vec<&str> = Kind::ALL.iter().map(|kind| kind.about().name).collect();
            all.sort_unstable();
            all.dedup();
            return Err(Error::new_err(format!(
                "without has \"{name}\", but no effect has that name; the names are {}.",
                all.join(", ")
            )));
        }
    }
    Ok(found)
}

/// A diagnosis by torque or by voltage.
type Workflow = fn(
    &robot::Robot,
    &[&dyn Rows],
    &[&dyn Rows],
    &Options,
    &mut dyn FnMut(f64),
) -> Result<(outcome::Diagnosis, robot::Robot), DiagnoseError>;

/// The recordings by their use.
#[derive(Clone)]
struct Recordings {
    data: Files,
    holdout: Files,
    drive_off: Files,
    pulls_off: Files,
    clamped: Files,
}

impl Recordings {
    fn shown(&self, text: &str) -> String {
        let all = [
            &self.data,
            &self.holdout,
            &self.drive_off,
            &self.pulls_off,
            &self.clamped,
        ];
        shown(&all, text)
    }

    /// Refuses recordings that are given twice or for two uses.
    fn refuse_repeated(&self) -> Result<(), CommandError> {
        let mut learnt = paths(&self.data);
        learnt.extend(paths(&self.pulls_off));
        refuse_twice(&learnt, "give it once")?;
        refuse_shared(&learnt, &paths(&self.holdout))
    }
}

/// The work of [`diagnose`], without Python.
struct Job {
    description: Arc<Description>,
    recordings: Recordings,
    options: Options,
    without: Vec<String>,
}

/// What a job finds: the result, the model with its effects, and warnings.
type Found = (outcome::Diagnosis, robot::Robot, Vec<String>);

impl Job {
    /// Opens the recordings and selects the workflow: a single joint without torque or current is diagnosed by its
    /// voltage.
    fn opened(&self) -> Result<(Inputs, Inputs, Workflow), CommandError> {
        let robot = &self.description.robot;
        let (data, holdout) = (
            paths(&self.recordings.data),
            paths(&self.recordings.holdout),
        );
        if robot.joints.len() == 1 {
            let all = |paths: &[PathBuf]| Inputs::read_with(robot, paths, EffortNeed::Optional);
            let (training, held) = (all(&data)?, all(&holdout)?);
            if !training.any_effort() && !held.any_effort() {
                return Ok((training, held, diagnose_voltage));
            }
        }
        Ok((
            Inputs::read(robot, &data)?,
            Inputs::read(robot, &holdout)?,
            rig_diagnose::diagnose,
        ))
    }

    /// Reads recordings at rest: zeros of the sensors, and clamped joints.
    fn at_rest(
        &self,
        warnings: &mut Vec<String>,
    ) -> Result<(Vec<[f64; 2]>, Vec<Run>), CommandError> {
        let robot = &self.description.robot;
        let off = Inputs::read(robot, &paths(&self.recordings.drive_off))?;
        let zeros = (listed(&off.listened()).into_iter())
            .map(sensor_zeros)
            .collect::<Result<Vec<_>, _>>()?
            .concat();
        let held = Inputs::read(robot, &paths(&self.recordings.clamped))?;
        let runs = (listed(&held.listened()).into_iter())
            .map(clamped)
            .collect::<Result<Vec<_>, _>>()?
            .concat();
        for inputs in [&off, &held] {
            warnings.extend(inputs.warnings());
            warnings.extend(inputs.heard());
        }
        Ok((zeros, runs))
    }

    fn found(mut self, watch: &Watch) -> Result<Found, CommandError> {
        let robot = &self.description.robot;
        self.recordings.refuse_repeated()?;
        let (training, holdout, workflow) = self.opened()?;
        let unburdened = Inputs::read(robot, &paths(&self.recordings.pulls_off))?;
        let all = [&training, &unburdened, &holdout];
        let mut warnings: Vec<String> = all.iter().flat_map(|inputs| inputs.warnings()).collect();
        for inputs in [&training, &holdout] {
            warnings.extend(inputs.strange_references(robot)?);
        }
        let (zeros, runs) = self.at_rest(&mut warnings)?;
        (self.options.sensor_zeros, self.options.clamped) = (zeros, runs);
        let (listened, free) = (training.listened(), unburdened.listened());
        let free: Vec<Unburdened> = free.iter().map(|one| Unburdened(one)).collect();
        let mut learnt = listed(&listened);
        learnt.extend(free.iter().map(|one| one as &dyn Rows));
        let (mut found, model) = workflow(
            robot,
            &learnt,
            &listed(&holdout.listened()),
            &self.options,
            &mut |share| watch.at_or_unwind(share),
        )?;
        for fault in &mut found.data_faults {
            for inputs in all {
                inputs.in_its_names(&fault.recording, &mut fault.text);
            }
            fault.text = self.recordings.shown(&fault.text);
            fault.recording = self.recordings.shown(&fault.recording);
        }
        if !self.without.is_empty() {
            let names = self.without.join(", ");
            (found.words).push(format!("Left out of the library, as asked: {names}."));
        }
        for words in &mut found.words {
            *words = self.recordings.shown(words);
        }
        warnings.extend(all.iter().flat_map(|inputs| inputs.heard()));
        Ok((found, model, warnings))
    }
}

/// Find the physical effects that a model lacks, as ``rig diagnose``.
///
/// ``data``, ``holdout``: a :class:`Recording`, a path, a dict of columns, or a list of these. Record every motion twice:
/// the difference between the two runs is the noise floor. Give another motion as ``holdout``.
/// ``drive_off``: made with the drive off. ``pulls_off``: training recordings made without external loads.
/// ``clamped``: made with the joints clamped. ``without``: effects that the robot cannot have.
/// ``progress``: called with the share of the work, 0 to 1.
///
/// Ctrl-C ends the call at once. Raises ``Error`` or ``OSError``.
#[pyfunction]
#[pyo3(signature = (
    robot, data, holdout = None, *, drive_off = None, pulls_off = None, clamped = None, without = None,
    even_if_wrong = false, seed = 1, threads = 0, progress = None,
))]
pub(crate) fn diagnose(
    py: Python<'_>,
    robot: &Robot,
    data: &Bound<'_, PyAny>,
    holdout: Option<&Bound<'_, PyAny>>,
    drive_off: Option<&Bound<'_, PyAny>>,
    pulls_off: Option<&Bound<'_, PyAny>>,
    clamped: Option<&Bound<'_, PyAny>>,
    without: Option<Vec<String>>,
    even_if_wrong: bool,
    seed: u64,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Diagnosis> {
    let description = robot.description();
    let given = |value: Option<&Bound<'_, PyAny>>| value.map_or_else(|| Ok(Vec::new()), recordings);
    let files = Recordings {
        data: recordings(data)?,
        holdout: given(holdout)?,
        drive_off: given(drive_off)?,
        pulls_off: given(pulls_off)?,
        clamped: given(clamped)?,
    };
    let without = without.unwrap_or_default();
    let options = Options {
        even_if_wrong,
        seed,
        threads,
        no_offsets: description.urdf.is_some(),
        without: kinds(&without)?,
        ..Options::default()
    };
    let command = format!(
        "rig_dynamics.diagnose(robot, {}, {}, seed={seed})",
        argument(&files.data),
        argument(&files.holdout)
    );
    let job = Job {
        description,
        recordings: files.clone(),
        options,
        without,
    };
    let name = |text: String| files.shown(&text);
    let (found, model, warnings) = run(py, progress.as_ref(), &name, |watch| job.found(watch))?;
    let warnings: Vec<String> = warnings.into_iter().map(name).collect();
    warn(py, &warnings)?;
    let json = serde_json::to_string(&found).map_err(|error| {
        Error::new_err(format!("The result cannot be written as JSON: {error}."))
    })?;
    Ok(Diagnosis {
        found,
        model,
        json,
        warnings,
        command,
    })
}
