//! Steps of a result: the gain of each effect, and alternative names.

use crate::DiagnoseError;
use crate::acceptance::judge::Judged;
use crate::acceptance::judge::rank::rank;
use crate::columns::waves::{is_of_the_motor, ratio_is_described};
use crate::fit::refit::{Joint, Refit};
use crate::gap::closed;
use crate::models::parameter_change::Change;
use crate::models::rms_path::RmsPath;
use crate::models::simulated_motion::Errors;
use crate::outcome::Step;
use crate::result::sentences::model::change as change_words;
use crate::search::stepwise::Search;
use rig_model::robot::Robot;

/// Returns one step for each effect that is not described, with its alternative names.
pub(crate) fn steps(
    search: &Search,
    refit: &Refit,
    judged: &Judged,
    described: usize,
    joint: &Joint,
    descent: &RmsPath,
    motion: &[Option<Errors>],
) -> Result<Vec<Step>, DiagnoseError> {
    let Judged { chosen, known, .. } = judged;
    let held_floors = descent.floors(known);
    let trials = search.trials();
    let source = &search.source;
    let mut steps = Vec::new();
    for (k, profile) in chosen.iter().enumerate().skip(described) {
        let j = profile.candidate.joint;
        let at = k - described;
        let train = descent.train.step(j, at);
        let unseen = descent.holdout.as_ref().map(|fall| fall.step(j, at));
        let about = profile.candidate.kind.about();
        let mut step = Step {
            effect: about.name.to_owned(),
            law: about.law.map(str::to_owned),
            joint: source.robot.joints[j].name.clone(),
            set: Vec::new(),
            parameters: joint.parameters(source, chosen, refit.free.len(), k),
            p_value: profile.evidence.corrected(trials),
            name_probability: f64::NAN,
            runner_up: None,
            runner_up_gap_closed: None,
            rms_unit: source.robot.joints[j].kind.units().1.to_owned(),
            train_rms: train,
            holdout_rms: unseen,
            motion_rms: (motion[at].as_ref().zip(motion[at + 1].as_ref()))
                .map(|pair| <[&Errors; 2]>::from(pair).map(|e| e.rms(j))),
            gap_closed: share(unseen.unwrap_or(train), held_floors[j]),
            why: String::new(),
        };
        if search.is_measured(&profile.candidate) {
            step.set.push(step.effect.clone());
        } else {
            let rivals = search.alternatives(&refit.base, chosen, k)?;
            let is_not = |kind| search.is_not(&profile.candidate, kind);
            rank(&mut step, profile, &rivals, source.runs, &is_not);
            // Without a gear ratio, motor and link waves are not distinguishable.
            if is_of_the_motor(profile.candidate.kind)
                && !ratio_is_described(&source.robot.joints[j])
            {
                step.name_probability *= 0.5;
            }
        }
        steps.push(step);
    }
    Ok(steps)
}

/// Returns the share of the gap closed by a step; NaN if the RMS rises.
fn share(rms: [f64; 2], floor: f64) -> f64 {
    let share = closed(rms, floor);
    if share < 0.0 { f64::NAN } else { share }
}

/// Returns the step of a parameter change that has the name of an effect.
pub(crate) fn change_step(
    robot: &Robot,
    change: &Change,
    descent: &RmsPath,
    floors: &[f64],
) -> Option<Step> {
    let about = change.effect?.about();
    let held_floors = descent.floors(floors);
    let j = robot.joints.len() - 1;
    let [refitted, last] = descent.train.whole(j);
    let train = [descent.train.frozen[j].max(refitted), last];
    let unseen = (descent.holdout.as_ref()).map(|fall| [fall.frozen[j], fall.whole(j)[1]]);
    Some(Step {
        effect: about.name.to_owned(),
        law: None,
        joint: robot.joints[j].name.clone(),
        set: vec![about.name.to_owned()],
        parameters: change.parameters.clone(),
        p_value: change.p_value,
        name_probability: f64::NAN,
        runner_up: None,
        runner_up_gap_closed: None,
        rms_unit: robot.joints[j].kind.units().1.to_owned(),
        train_rms: train,
        holdout_rms: unseen,
        motion_rms: None,
        gap_closed: share(unseen.unwrap_or(train), held_floors[j]),
        why: change_words(robot, &change.cause),
    })
}
