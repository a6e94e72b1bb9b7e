//! Effects that the recordings cannot show, detectable sizes of the others, and the next experiment.
//!
//! Leaves out: sizes of transmission effects, which are shapes and not gains.

use nalgebra::DMatrix;
use rig_shared::effects::{Effect, Kind, Need};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, Normal};

use crate::columns::candidate::Candidate;
use crate::columns::kinds::{is_first_law, is_gear, rivals};
use crate::experiment::{ExperimentKind, Held, Nominal, testable};
use crate::fit::least_squares::Fit;
use crate::levels::{LEAST_GAIN, SIGNIFICANT};
use crate::outcome::{Detectable, Diagnosis, NextExperiment, NotTestable};
use crate::recordings::external_load::told_apart;
use crate::result::found::Found;
use crate::result::sentences::limits::{
    COLLINEAR, GivenAlready, RICHER_MOTION, given_already, to_test,
};
use crate::search::chosen::with;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::shapes::grid;
use crate::{DiagnoseError, experiment};
use rig_data::runs::Run;
use rig_model::robot::Robot;
use rig_model::simulate::Model;
use rig_numerics::vector::norm_squared;

/// Most grid points that are evaluated.
const POINTS: usize = 12;
/// Probability of finding an effect of detectable size.
const POWER: f64 = 0.9;

/// Returns the effects that the recordings cannot show.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn not_testable(found: &Found) -> Result<Vec<NotTestable>, DiagnoseError> {
    let runs = found.search.source.runs;
    let n = found.robot.joints.len();
    let last = with(found.base, found.chosen, None);
    let mut list: Vec<NotTestable> = Vec::new();
    for &kind in Kind::ALL.iter().filter(|k| is_first_law(**k)) {
        let coupling = kind.about().needs.contains(&Need::OtherJoint);
        if coupling && n == 1 {
            continue;
        }
        let name = kind.about().name;
        for j in 0..n {
            let known = |list: &[NotTestable]| {
                let own = &found.robot.joints[j].name;
                list.iter().any(|t| t.effect == name && t.joint == *own)
            };
            let taken = found
                .chosen
                .iter()
                .any(|p| p.candidate.joint == j && p.candidate.kind.about().name == name);
            // A link encoder decides on a transmission effect by itself.
            let across = is_gear(kind) && (runs.iter()).any(|r| r.joints[j].link.is_some());
            if taken || across || known(&list) {
                continue;
            }
            let own = (found.search.library.iter().enumerate())
                .filter(|(_, c)| c.kind == kind && c.joint == j);
            let lacking = testable::not_testable(kind, found.robot, j, runs);
            if let Some(mut lacking) = lacking {
                if own.count() > 0 {
                    lacking.why += "; it was tried all the same, as a large one would show";
                }
                list.push(lacking);
                continue;
            }
            let mut tried = false;
            let mut distinct = false;
            for (c, candidate) in own {
                if is_gear(candidate.kind) {
                    distinct = true;
                }
                tried = true;
                if !distinct {
                    let columns = found
                        .search
                        .cached(c, &found.search.grid_within(candidate)?)?;
                    distinct = (places(kind)).any(|k| last.distinct(&columns[k]).is_some());
                }
            }
            if tried && !distinct {
                list.push(disguised(found, kind, j));
            }
        }
    }
    Ok(list)
}

/// Describes an effect whose torque is collinear with other parameters.
fn disguised(found: &Found, kind: Kind, joint: usize) -> NotTestable {
    let about = kind.about();
    let runs = found.search.source.runs;
    let exact = testable::confounded(kind, joint, runs);
    NotTestable {
        effect: about.name.to_owned(),
        joint: found.robot.joints[joint].name.clone(),
        why: COLLINEAR.to_owned(),
        experiment: (exact.first())
            .map_or(RICHER_MOTION, |c| c.separated_by)
            .to_owned(),
    }
}

/// Returns indices of points spread over an effect's grid.
fn places(kind: Kind) -> impl Iterator<Item = usize> {
    let count = grid(kind).len();
    (0..count).step_by(count.div_ceil(POINTS).max(1))
}

/// Returns the smallest detectable size of each effect that was tested and not found: the median gain over its shapes.
/// Such a gain gives the minimum RMS reduction and is significant nine times in ten. A shape at which only more than the
/// largest torque of the joint would show is not seen: its size is infinite.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn detectable(
    found: &Found,
    without: &[NotTestable],
) -> Result<Vec<Detectable>, DiagnoseError> {
    let last = with(found.base, found.chosen, None);
    let trials = found.search.trials();
    let mut list = Vec::new();
    for (c, candidate) in found.search.library.iter().enumerate() {
        let about = candidate.kind.about();
        let joint = &found.robot.joints[candidate.joint];
        let hidden = without
            .iter()
            .any(|t| t.effect == about.name && t.joint == joint.name);
        let taken = (found.chosen.iter())
            .any(|p| rivals(&p.candidate, candidate) || p.candidate.sort() == *candidate);
        let gains = found.search.source.gains(candidate);
        if hidden || taken || !is_first_law(candidate.kind) || is_gear(candidate.kind) {
            continue;
        }
        let most = largest_torque(found, candidate.joint);
        let mut sizes: Vec<(f64, usize)> = Vec::new();
        let points = found.search.grid_within(candidate)?;
        let columns = found.search.cached(c, &points)?;
        for place in places(candidate.kind) {
            if !found.search.shows(candidate, &points[place]) {
                continue;
            }
            let Some(projected) = last.distinct(&columns[place]) else {
                continue;
            };
            sizes.extend(
                (projected.iter().enumerate())
                    .filter_map(|(g, column)| {
                        let size = smallest(&last, column, projected.len(), trials)?;
                        let hidden = gains[g].unit == "N*m" && size > most;
                        Some((if hidden { f64::INFINITY } else { size }, g))
                    })
                    .max_by(|a, b| a.0.total_cmp(&b.0)),
            );
        }
        sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(&(size, g)) = sizes.get(sizes.len() / 2)
            && let Some(gain) = gains.get(g)
        {
            list.push(Detectable {
                effect: about.name.to_owned(),
                joint: joint.name.clone(),
                parameter: gain.name.to_owned(),
                size,
                size_at_worst: (sizes.len() > 1).then(|| sizes[sizes.len() - 1].0),
                unit: found.search.source.unit(candidate, gain),
            });
        }
    }
    Ok(list)
}

/// Returns the largest recorded torque of a joint, N·m or N.
fn largest_torque(found: &Found, joint: usize) -> f64 {
    let of_run = |most: f64, run: &Run| {
        let recorded = run.joints[joint].recorded();
        recorded.iter().fold(most, |most, tau| tau.abs().max(most))
    };
    found.search.source.runs.iter().fold(0.0, of_run)
}

/// Returns the smallest accepted gain of a projected column; `count` columns are tested together.
pub(crate) fn smallest(fit: &Fit, column: &[f64], count: usize, trials: usize) -> Option<f64> {
    let left = fit.left();
    let length = norm_squared(column);
    // The minimum reduction refers to the RMS with the effect in the residual.
    let kept = (1.0 - LEAST_GAIN).powi(2);
    let visible = (norm_squared(left) * (1.0 - kept) / kept / length).sqrt();
    let inverse = DMatrix::from_element(1, 1, 1.0 / length);
    let std = fit.sandwich(&[column], &inverse, left)[(0, 0)].sqrt();
    let (g, k) = (fit.blocks() as f64, count as f64);
    let freedom = (g - k).max(1.0);
    let level = FisherSnedecor::new(k, freedom)
        .ok()?
        .inverse_cdf(1.0 - SIGNIFICANT / trials.max(1) as f64);
    let statistic = level * k * (g - 1.0) / freedom;
    let more = Normal::standard().inverse_cdf(POWER);
    let size = visible.max(std * (statistic.sqrt() + more));
    (size.is_finite() && size > 0.0).then_some(size)
}

/// Returns the next experiment: for the rivals of the first undecided step, else for the first untestable effect.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn next(
    found: &Found,
    diagnosis: &Diagnosis,
    model: &Robot,
) -> Result<Option<NextExperiment>, DiagnoseError> {
    for (k, (step, profile)) in diagnosis.steps.iter().zip(found.found()).enumerate() {
        if step.set.len() < 2 {
            continue;
        }
        let joint = profile.candidate.joint;
        let Some(nominal) = nominal_of(model, joint)? else {
            continue;
        };
        let fit = with(found.base, found.chosen, Some(found.described + k));
        let mut list: Vec<(Effect<f64>, Nominal)> = vec![(effect(profile, &nominal), nominal)];
        for name in step.set.iter().filter(|name| **name != step.effect) {
            let of_name = |c: &Candidate| c.joint == joint && c.kind.about().name == *name;
            let Some(c) = found.search.library.iter().position(of_name) else {
                continue;
            };
            if let Some(rival) = found.search.profile(&fit, c, None)? {
                list.push((effect(&rival, &nominal), nominal));
            }
        }
        let held = Held {
            gravity: found.anchor.gravity_held,
            constant: found.anchor.holds_constant(joint, found.nominal),
        };
        let floor = found.floors[joint];
        if let Some(proposal) = experiment::next(found.robot, joint, &list, held, floor)? {
            let mut experiment = proposal.experiment;
            if let Some(given) = given(found, joint, experiment.kind) {
                experiment.text.insert_str(0, &given_already(given));
            }
            return Ok(Some(NextExperiment {
                trajectory: proposal.trajectory.map(|t| t.to_toml(found.robot)),
                ..experiment
            }));
        }
    }
    Ok(diagnosis
        .not_testable
        .first()
        .map(|lacking| NextExperiment {
            kind: ExperimentKind::NotTestableYet,
            separates: vec![lacking.effect.clone()],
            text: to_test(lacking),
            file: None,
            separation: None,
            duration: None,
            hands: true,
            trajectory: None,
        }))
}

/// Returns the data of an experiment of this kind, if they were given and were not sufficient.
fn given(found: &Found, joint: usize, kind: ExperimentKind) -> Option<GivenAlready> {
    match kind {
        ExperimentKind::DriveOffLog => Some(GivenAlready::DriveOff {
            zero: *found.sensor_zeros.get(joint)?,
            unit: found.robot.joints[joint].kind.units().1,
        }),
        ExperimentKind::PullsOff => {
            told_apart(found.search.source.runs).then_some(GivenAlready::PullsOff)
        }
        _ => None,
    }
}

/// Returns an effect with its estimate. A tilt is fitted as an angle, which turns gravity's torque.
fn effect(profile: &FittedCandidate, nominal: &Nominal) -> Effect<f64> {
    let (kind, gains) = (profile.candidate.kind, &profile.evidence.gains);
    match (kind, gains.as_slice()) {
        (Kind::GravityTilt, [angle, ..]) => {
            let [_, cosine, sine, ..] = nominal;
            Effect::new(kind, &[angle * sine, -angle * cosine], &[])
        }
        _ => Effect::new(kind, gains, &profile.shapes),
    }
}

/// Returns the parameters of a joint with the others in mid-range; `None` if it has no inertia.
fn nominal_of(model: &Robot, joint: usize) -> Result<Option<Nominal>, DiagnoseError> {
    let failed = |e: rig_model::simulate::SimulateError| DiagnoseError::Model(e.to_string());
    let dynamics = Model::from_robot(model).map_err(failed)?;
    let n = model.joints.len();
    let mut stand = model.middle_position();
    let rest = vec![0.0; n];
    let mut torque = vec![0.0; n];
    let mut at = |angle: f64| {
        stand[joint] = angle;
        dynamics.inverse_dynamics(&stand, &rest, &rest, &mut torque)?;
        Ok(torque[joint])
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    let [ahead, up, back] = [at(0.0), at(quarter), at(2.0 * quarter)];
    let (ahead, up, back) = (
        ahead.map_err(failed)?,
        up.map_err(failed)?,
        back.map_err(failed)?,
    );
    let middle = 0.5 * (ahead + back);
    let mut inertia = vec![0.0; n * n];
    dynamics
        .inertia_matrix(&model.middle_position(), &mut inertia)
        .map_err(failed)?;
    let friction = model.joints[joint].friction.clone().unwrap_or_default();
    let own = inertia[joint * n + joint];
    Ok((own > 0.0).then_some([
        own,
        0.5 * (ahead - back),
        up - middle,
        friction.viscous,
        friction.coulomb,
        middle,
    ]))
}
