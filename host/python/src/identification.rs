//! Identification from recordings.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use rig::commands::{
    CommandError, Compare, Impossible, Inputs, refuse_folder, refuse_shared, refuse_twice,
    write_identification,
};
use rig_data::prepare::{Choice, PrepareOptions, as_recordings};
use rig_identify::{Estimator, Options, Warning, identified_robot};
use rig_model::robot::{Description, MOST_LEAD};
use rig_output::folder;

use crate::base::model_kind;
use crate::error::{Error, refused, warn};
use crate::inputs::{Files, Observed, Passes, argument, checked, paths, shown};
use crate::json;
use crate::recording::recordings;
use crate::robot::Robot;
use crate::watch::run;

/// An identified base parameter.
#[pyclass(frozen, get_all, module = "rig_dynamics")]
pub(crate) struct BaseParameter {
    /// The combination, such as ``Izz1 + Ia1``.
    expression: String,
    /// Value, SI.
    value: f64,
    /// Standard deviation; it allows for the correlation of the residuals.
    std: f64,
    /// 95 % interval.
    interval: (f64, f64),
    /// 100 * std / abs(value).
    relative_std_percent: f64,
    /// Unit, ASCII.
    unit: String,
}

#[pymethods]
impl BaseParameter {
    fn __repr__(&self) -> String {
        format!(
            "<{} = {} {}>",
            self.expression,
            rig_output::format_value(self.value, self.std),
            self.unit
        )
    }
}

/// Residuals of a joint.
#[pyclass(frozen, get_all, module = "rig_dynamics")]
pub(crate) struct JointFit {
    /// Name of the joint.
    name: String,
    /// RMS of the torque residual, N*m or N; NaN if no row of the joint was usable.
    train_residual_rms: f64,
    /// The same on the hold-out; None without one.
    holdout_residual_rms: Option<f64>,
    /// RMS of the residual over RMS of the torque.
    train_relative_error: f64,
    /// The same on the hold-out; None without one.
    holdout_relative_error: Option<f64>,
}

#[pymethods]
impl JointFit {
    fn __repr__(&self) -> String {
        format!(
            "<{}: residual {:.4} rms, {:.2} % of the torque>",
            self.name,
            self.train_residual_rms,
            100.0 * self.train_relative_error
        )
    }
}

/// The result of :func:`identify`. The attributes are those of ``identification.json`` (docs/formats.md).
#[pyclass(frozen, module = "rig_dynamics")]
pub(crate) struct Identification {
    found: rig_identify::Identification,
    description: Arc<Description>,
    json: String,
    /// Warnings from reading the recordings, for the report.
    warnings: Vec<String>,
    command: String,
}

#[pymethods]
impl Identification {
    /// Equations that were fitted.
    #[getter]
    fn model(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(json::entry(py, &self.json, "model")?.unbind())
    }

    /// Name of the estimator.
    #[getter]
    fn estimator(&self) -> &'static str {
        self.found.estimator.name()
    }

    /// Number of base parameters that are identifiable from the data.
    #[getter]
    fn rank(&self) -> usize {
        self.found.rank
    }

    /// Condition number of the regressor of these parameters.
    #[getter]
    fn condition_number(&self) -> f64 {
        self.found.condition_number
    }

    /// The identified parameters.
    #[getter]
    fn base_parameters(&self) -> Vec<BaseParameter> {
        let all = self.found.base_parameters.iter();
        all.map(|own| BaseParameter {
            expression: own.expression.clone(),
            value: own.value,
            std: own.std,
            interval: own.interval.into(),
            relative_std_percent: own.relative_std_percent,
            unit: own.unit.clone(),
        })
        .collect()
    }

    /// Residuals by joint.
    #[getter]
    fn joints(&self) -> Vec<JointFit> {
        let all = self.found.joints.iter();
        all.map(|own| JointFit {
            name: own.name.clone(),
            train_residual_rms: own.train_residual_rms,
            holdout_residual_rms: own.holdout_residual_rms,
            train_relative_error: own.train_relative_error,
            holdout_relative_error: own.holdout_relative_error,
        })
        .collect()
    }

    /// Combinations that the data do not determine: ``combination``, ``why``, ``motion``.
    #[getter]
    fn not_excited(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(json::entry(py, &self.json, "not_excited")?.unbind())
    }

    /// A full, physically consistent set of standard parameters; None for a single joint unless requested.
    #[getter]
    fn standard_parameters(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(json::entry(py, &self.json, "standard_parameters")?.unbind())
    }

    /// Comparison of the estimators with the recommended one, if requested.
    #[getter]
    fn comparison(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(json::entry(py, &self.json, "comparison")?.unbind())
    }

    /// The course of the estimation, sentences.
    #[getter]
    fn procedure(&self) -> Vec<String> {
        self.found.procedure.clone()
    }

    /// Sentences; also issued as :class:`Remark`.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.found.sentences()
    }

    /// The description with the identified values.
    #[getter]
    fn robot(&self) -> PyResult<Robot> {
        Robot::of_result(identified_robot(&self.description.robot, &self.found).0)
    }

    /// Return the contents of ``identification.json``.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::read(py, &self.json)
    }

    /// Write identified.toml, identification.json, report.html and, with a full set of parameters, identified.urdf.
    ///
    /// A folder with earlier results is refused unless ``force``.
    #[pyo3(signature = (folder, *, force = false))]
    #[pyo3(name = "save")]
    fn save_to(&self, py: Python<'_>, folder: PathBuf, force: bool) -> PyResult<()> {
        let remarks = py.detach(|| self.save(&folder, force)).map_err(refused)?;
        warn(py, &remarks)
    }

    fn __repr__(&self) -> String {
        format!(
            "<Identification of {:?}: {} base parameters, {}>",
            self.found.robot,
            self.found.rank,
            self.estimator()
        )
    }
}

impl Identification {
    fn save(&self, out: &std::path::Path, force: bool) -> Result<Vec<String>, CommandError> {
        refuse_folder(out, &[], force)?;
        folder(out)?;
        write_identification(
            out,
            &self.description,
            &self.found,
            self.command.clone(),
            self.warnings.clone(),
            false,
        )
    }
}

/// Reads the name of an estimator.
fn estimator(name: &str) -> PyResult<Estimator> {
    let all = Estimator::ALL;
    (all.into_iter().find(|one| one.name() == name)).ok_or_else(|| {
        let names = all.map(Estimator::name).join(", ");
        Error::new_err(format!("estimator is \"{name}\"; give one of {names}."))
    })
}

/// Estimators to compare, before the size of the recordings is known.
enum Compared {
    ByProgram(Compare),
    Listed(Vec<Estimator>),
}

fn compared(value: Option<&Bound<'_, PyAny>>) -> PyResult<Compared> {
    let Some(value) = value else {
        return Ok(Compared::ByProgram(Compare::None));
    };
    if let Ok(name) = value.extract::<String>() {
        return match name.as_str() {
            "auto" => Ok(Compared::ByProgram(Compare::Auto)),
            "all" => Ok(Compared::ByProgram(Compare::All)),
            _ => Err(Error::new_err(format!(
                "compare is \"{name}\"; give \"auto\", \"all\", None or a list of estimators."
            ))),
        };
    }
    let mut list = Vec::new();
    for name in value.try_iter()? {
        list.push(estimator(&name?.extract::<String>()?)?);
    }
    Ok(Compared::Listed(list))
}

/// Checks the numbers that the program checks as it reads its command line.
fn check_numbers(torque_lead: f64, min_speed: Option<f64>) -> PyResult<()> {
    if !(torque_lead.abs() <= MOST_LEAD) {
        return Err(Error::new_err(format!(
            "torque_lead is {torque_lead} s; it must lie between -{MOST_LEAD} and {MOST_LEAD} s."
        )));
    }
    match min_speed {
        Some(speed) if !(speed >= 0.0 && speed.is_finite()) => Err(Error::new_err(format!(
            "min_speed is {speed}; 0 keeps all rows, and a number above it leaves out slower rows."
        ))),
        _ => Ok(()),
    }
}

/// Reads a setting that is chosen from the data if absent.
fn choice<T>(value: Option<T>) -> Choice<T> {
    value.map_or(Choice::Auto, Choice::Fixed)
}

/// The work of [`identify`], without Python.
struct Job {
    description: Arc<Description>,
    data: Files,
    holdout: Files,
    options: Options,
    compare: Compared,
    even_if_wrong: bool,
}

/// What a job finds: the result, warnings from the headers for the report, and remarks.
type Found = (rig_identify::Identification, Vec<String>, Vec<String>);

impl Job {
    fn found(mut self, watch: &crate::watch::Watch) -> Result<Found, CommandError> {
        let robot = &self.description.robot;
        let training = Inputs::read(robot, &paths(&self.data))?;
        let holdout = Inputs::read(robot, &paths(&self.holdout))?;
        refuse_shared(&paths(&self.data), &paths(&self.holdout))?;
        refuse_twice(
            &paths(&self.data),
            "give it once, and use weights if it should count more",
        )?;
        let warnings: Vec<String> = training.warnings().chain(holdout.warnings()).collect();
        let mut remarks = warnings.clone();
        let wrong = self.strange(&training, &holdout, &mut remarks)?;
        let both = [&training, &holdout];
        remarks.extend(checked(robot, &both, wrong, self.even_if_wrong)?);
        self.options.compare = match self.compare {
            Compared::ByProgram(compare) => compare.list(),
            Compared::Listed(ref list) => list.clone(),
        };
        // Three passes over the training data, two over the hold-out: see `identify`.
        let passes = Passes::new(watch, 3 * training.bytes() + 2 * holdout.bytes());
        let (a, b) = (training.listened(), holdout.listened());
        let a = Observed::all(&a, training.bytes(), &passes);
        let b = Observed::all(&b, holdout.bytes(), &passes);
        let (a, b) = (as_recordings(&a), as_recordings(&b));
        let mut found = rig_identify::identify(robot, &a, &b, &self.options)?;
        for inputs in both {
            let told = inputs.heard().into_iter().chain(inputs.outside());
            found.warnings.extend(told.map(Warning::from));
        }
        let Impossible { refused, doubtful } = Impossible::of(robot, &found);
        if !self.even_if_wrong && !refused.is_empty() {
            return Err(CommandError::Implausible(format!(
                "{} Give even_if_wrong=True to have the result in spite of this.",
                refused.join(" ")
            )));
        }
        let first = refused.into_iter().chain(doubtful);
        (found.warnings).splice(0..0, first.map(Warning::from));
        Ok((found, warnings, remarks))
    }

    /// Returns sentences about references and rates that cannot be right and are used. Adds those about references that
    /// are not used to `remarks`.
    fn strange(
        &self,
        training: &Inputs,
        holdout: &Inputs,
        remarks: &mut Vec<String>,
    ) -> Result<Vec<String>, CommandError> {
        let robot = &self.description.robot;
        let mut wrong = Vec::new();
        let strange = training.strange_references(robot)?;
        if self.options.estimator == Estimator::OutputError {
            wrong.extend(strange);
        } else {
            remarks.extend(strange.iter().map(|sentence| {
                format!("{sentence} They are not used: only the estimator output-error needs references.")
            }));
        }
        if self.options.prepare.measured_derivatives {
            for inputs in [training, holdout] {
                wrong.extend(inputs.strange_rates(robot)?);
            }
        }
        Ok(wrong)
    }
}

/// Identify the parameters of a robot from recordings, as ``rig identify``.
///
/// ``data``, ``holdout``: a :class:`Recording`, a path, a dict of columns, or a list of these.
/// ``estimator``: None for weighted; for several joints consistent.
/// ``compare``: estimators to compare by cross-validation; None for no comparison, "auto" as the program does.
/// ``weights``: weight of each training recording; 1 if not given.
/// ``cutoff``: low-pass on the position, Hz; ``decimation``: keep every n-th row; ``min_speed``: leave out slower rows,
/// rad/s or m/s; None chooses each from the data. ``window``: of the integral model, s. ``torque_lead``: s.
/// ``even_if_wrong``: fit although columns look wrong. ``progress``: called with the share of the work, 0 to 1.
///
/// Ctrl-C ends the call at once. Raises ``Error`` or ``OSError``.
#[pyfunction]
#[pyo3(signature = (
    robot, data, holdout = None, *, estimator = None, model = "differential", compare = None, weights = None,
    prior_uncertainty = None, as_described = false, cutoff = None, decimation = None, min_speed = None, window = None,
    torque_lead = 0.0, measured_derivatives = false, even_if_wrong = false, seed = 1, progress = None,
))]
pub(crate) fn identify(
    py: Python<'_>,
    robot: &Robot,
    data: &Bound<'_, PyAny>,
    holdout: Option<&Bound<'_, PyAny>>,
    estimator: Option<&str>,
    model: &str,
    compare: Option<&Bound<'_, PyAny>>,
    weights: Option<Vec<f64>>,
    prior_uncertainty: Option<f64>,
    as_described: bool,
    cutoff: Option<f64>,
    decimation: Option<usize>,
    min_speed: Option<f64>,
    window: Option<f64>,
    torque_lead: f64,
    measured_derivatives: bool,
    even_if_wrong: bool,
    seed: u64,
    progress: Option<Py<PyAny>>,
) -> PyResult<Identification> {
    check_numbers(torque_lead, min_speed)?;
    let description = robot.description();
    let options = Options {
        model: model_kind(model)?,
        estimator: match estimator {
            Some(name) => self::estimator(name)?,
            None => Estimator::for_robot(&description.robot),
        },
        prepare: PrepareOptions {
            cutoff: choice(cutoff),
            decimation: choice(decimation),
            speed_threshold: choice(min_speed),
            torque_lead,
            measured_derivatives,
            ..PrepareOptions::default()
        },
        window,
        seed,
        recording_weights: weights.unwrap_or_default(),
        prior_uncertainty,
        look_beyond: !as_described,
        ..Options::default()
    };
    let data = recordings(data)?;
    let holdout = holdout.map_or_else(|| Ok(Vec::new()), recordings)?;
    if options.recording_weights.len() > data.len() {
        return Err(Error::new_err(format!(
            "weights has {} numbers, but data has {} recordings; give one weight at most for each.",
            options.recording_weights.len(),
            data.len()
        )));
    }
    let command = command(&options, &data, &holdout);
    let job = Job {
        description: Arc::clone(&description),
        data: data.clone(),
        holdout: holdout.clone(),
        options,
        compare: compared(compare)?,
        even_if_wrong,
    };
    let name = |text: String| shown(&[&data, &holdout], &text);
    let found = run(py, progress.as_ref(), &name, |watch| job.found(watch))?;
    result(py, description, command, found, &name)
}

/// Issues the remarks of a job and makes its result, with the names of recordings in place of temporary files.
fn result(
    py: Python<'_>,
    description: Arc<Description>,
    command: String,
    (mut found, warnings, remarks): Found,
    name: &dyn Fn(String) -> String,
) -> PyResult<Identification> {
    for text in &mut found.procedure {
        *text = name(text.clone());
    }
    for warning in &mut found.warnings {
        *warning = name(warning.to_string()).into();
    }
    let named = |list: Vec<String>| -> Vec<String> { list.into_iter().map(name).collect() };
    warn(py, &named(remarks))?;
    warn(py, &found.sentences())?;
    let json = serde_json::to_string(&found).map_err(|error| {
        Error::new_err(format!("The result cannot be written as JSON: {error}."))
    })?;
    Ok(Identification {
        warnings: named(warnings),
        found,
        description,
        json,
        command,
    })
}

/// The call that repeats an identification, for the report.
fn command(options: &Options, data: &Files, holdout: &Files) -> String {
    format!(
        "rig_dynamics.identify(robot, {}, {}, estimator=\"{}\", seed={})",
        argument(data),
        argument(holdout),
        options.estimator.name(),
        options.seed
    )
}
