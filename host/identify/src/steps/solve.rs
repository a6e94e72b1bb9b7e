//! The steps from recordings to an [`Identification`].

use rig_shared::multibody::COLUMNS;

use super::check::check;
use super::estimated::Estimated;
use super::freed::Freed;
use super::judged::Judge;
use super::planner::{Planner, each_planned};
use super::recordings::Surveyed;
use super::results::Results;
use super::robot_model::RobotModel;
use super::task::Task;
use super::treated::{Prepared, Treated};
use crate::error::IdentifyError;
use crate::estimators::fit::Fit;
use crate::estimators::problem::Problem;
use crate::identification::Identification;
use crate::options::Options;
use crate::rows::plan::Plan;
use crate::unmodelled::beyond::Beyond;
use crate::unmodelled::look_beyond::{Look, look};
use rig_data::prepare::{Recording, Spooled};
use rig_model::robot::Robot;

/// Largest number of passes over effects beyond the description: the first finds them, each further one refits jointly.
const MOST_LOOKS: usize = 8;

/// Identifies `robot` from `training`, checks the result on `holdout`. Its effects use these parameters, one row per
/// joint.
///
/// # Errors
/// [`IdentifyError`]: recordings that cannot be used, a motion that excites nothing, a singular problem.
pub(crate) fn identify_beside(
    robot: &Robot,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
    beside: &[[f64; COLUMNS]],
) -> Result<Identification, IdentifyError> {
    check(robot, options)?;
    let task = Task {
        described: robot,
        training,
        holdout,
        options,
        beside,
    };
    let (mut known, mut prepared) = (None, None);
    for _ in 0..=MOST_LOOKS {
        match solve(&task, known.as_ref(), &mut prepared)? {
            Solved::Whole(found) => return Ok(*found),
            Solved::Anew(more) => known = Some(more),
        }
    }
    Err(IdentifyError::Unsettled {
        what: "The search for what the description does not state",
        passes: MOST_LOOKS,
    })
}

/// An identification, or the effects with which it starts again.
enum Solved {
    Whole(Box<Identification>),
    Anew(Beyond),
}

/// Runs one pass with the effects `added` to the description. `prepared` is made by the first pass.
fn solve(
    task: &Task,
    added: Option<&Beyond>,
    prepared: &mut Option<Prepared>,
) -> Result<Solved, IdentifyError> {
    let options = task.options;
    let model = RobotModel::of(task, added.unwrap_or(&Beyond::default()))?;
    let spooled = [task.training, task.holdout].map(Spooled::all);
    let surveyed = Surveyed::of(&spooled, model.joints())?;
    let measured = surveyed.sets(task.training);
    surveyed.check_torque(model.joints())?;
    // Recordings and their treatment are the same in every pass.
    let wide = match prepared {
        Some(wide) => wide,
        None => prepared.insert(Prepared::of(task, &model, &surveyed, &measured)?),
    };
    let effects = model.effects(task)?;
    let freed = Freed::of(
        &measured,
        &surveyed,
        &wide.treatment,
        &effects,
        &model.chain,
    )?;
    let respooled = freed.as_ref().map(Freed::spooled);
    let (sets, whole) = match (&freed, &respooled) {
        (Some(freed), Some(respooled)) => (freed.sets(respooled), Some(&measured)),
        _ => (measured.clone(), None),
    };
    let planner = Planner::new(&model, &wide.surveys);
    let (treated, cache) = Treated::of(options, &planner, &sets.training, wide)?;
    let plan = treated.plan(&planner, cache, &sets.training)?;
    let fit = Fit::of(&sets.training, &plan, options, &model.base)?;
    let problem = Problem {
        robot: &model.robot,
        training: &sets.training,
        sources: &sets.sources,
        surveys: &wide.surveys,
        plan: &plan,
        options,
        base: &model.base,
        data: &fit.data,
        weights: &fit.by_noise,
        start: &fit.weighted,
        instants: fit.instants,
    };
    let (known, beside) = match look(&problem, &fit.factors, added, task.described.gravity)? {
        Look::Anew(found) => return Ok(Solved::Anew(found)),
        Look::Settled(known, beside) => (known, beside),
    };
    let estimated = Estimated::of(&problem, &fit, beside.as_ref())?;
    let judge = Judge {
        robot: &model.robot,
        torques: &known.torques,
        full: &estimated.full,
        sets: &sets,
        whole,
    };
    let train = judge.training(&wide.surveys, &plan)?;
    let treatments = surveyed.at_holdout_rates(&treated.treatment.judging())?;
    let of = |treatment| planner.plan(treatment, treated.window);
    let plans: Vec<Plan> = treatments.iter().map(of).collect();
    let holdout = judge.holdout(&surveyed.holdout_surveys, &plans)?;
    let results = Results {
        problem: &problem,
        described: task.described,
        fit: &fit,
        known: &known,
        full: &estimated.full,
        train,
        holdout,
        holdout_surveys: &surveyed.holdout_surveys,
        treated: &treated,
        treatments: &treatments,
        held: &each_planned(&sets.holdout, &plans),
        compensated: whole.is_some(),
    };
    let found = results.identification(estimated.estimate, estimated.own)?;
    Ok(Solved::Whole(Box::new(found)))
}
