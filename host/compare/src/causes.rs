//! Causes of a difference, as hypotheses with their likelihoods.
//!
//! Each hypothesis lets a part of the parameters differ between the sets, and the rest is common: y_s = μ + D·δ_s + e_s
//! with the full covariance of e_s, or y_s = a_s·μ + e_s for a scale of all torques. The remaining sum of squares tells
//! whether the hypothesis explains the difference. Hypotheses are compared by Akaike's criterion (1974), χ² + 2·(number
//! of free values); exp(difference/2) are the odds against the worse one (Burnham and Anderson 2002).
//!
//! Leaves out: two causes at once, and changes that depend on the motion. The errors are those within the sets. An error
//! of the model that changes with the motion therefore looks like a difference that no hypothesis explains.

use nalgebra::{DMatrix, DVector};
use rig_model::robot::Robot;
use rig_output::format_value;
use rig_shared::multibody::{COLUMNS, INERTIAL_PARAMETERS, column};
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use crate::common::{Common, without_changes};
use crate::matrices::{inverse, quadratic};
use crate::result::{Causes, Hypothesis};
use crate::significance::{FAMILY_LEVEL, chi2_p};

/// Odds against every other hypothesis from which a cause is named.
pub const ODDS: f64 = 20.0;
/// Largest number of steps to the scales, and their relative change at the end.
const SCALE_STEPS: (usize, f64) = (100, 1e-10);

/// Tests all hypotheses, and compares them with those of shifted zeros. `combination` and `columns` are those of all
/// parameters.
pub(crate) fn causes(
    common: &Common,
    names: &[String],
    combination: &DMatrix<f64>,
    columns: &[usize],
    robot: &Robot,
    zeros: Vec<Hypothesis>,
) -> Option<Causes> {
    let all = DMatrix::identity(common.parameters.len(), common.parameters.len());
    let mut found = vec![
        differing(
            common,
            "nothing",
            "nothing; chance alone",
            &DMatrix::zeros(all.nrows(), 0),
        )?,
        scaled(common)?,
    ];
    for (name, what, d) in changes(common, combination, columns, robot) {
        found.push(differing(common, name, what, &d)?);
    }
    found.push(differing(common, "anything", "every parameter", &all)?);
    found.extend(zeros);
    rate(&mut found);
    let (named, sentence) = answer(&found, names, robot);
    Some(Causes {
        hypotheses: found,
        named,
        sentence,
        corrected: None,
    })
}

/// Returns the linear changes of the common parameters that are tested: name, words, and directions.
pub(crate) fn changes(
    common: &Common,
    combination: &DMatrix<f64>,
    columns: &[usize],
    robot: &Robot,
) -> [(&'static str, &'static str, DMatrix<f64>); 4] {
    let links = robot.link_count();
    let own: Vec<usize> = common.parameters.iter().map(|&k| columns[k]).collect();
    let units = |of: &dyn Fn(usize) -> bool| {
        let chosen: Vec<usize> = (0..own.len()).filter(|&k| of(own[k])).collect();
        DMatrix::identity(own.len(), own.len()).select_columns(&chosen)
    };
    let motor = |c: usize| c.checked_sub(COLUMNS * links).map(|m| m % MOTOR_COLUMNS);
    let friction = units(&|c| match motor(c) {
        Some(which) => which != motor_column::INERTIA,
        None => matches!(c % COLUMNS, column::VISCOUS | column::COULOMB),
    });
    let offset = units(&|c| motor(c).is_none() && c % COLUMNS == column::OFFSET);
    let gravity = units(&|c| {
        motor(c).is_none() && (c % COLUMNS == column::OFFSET || (1..=3).contains(&(c % COLUMNS)))
    });
    let last = COLUMNS * robot.last_link();
    let payload = combination
        .select_rows(&common.parameters)
        .columns(last, INERTIAL_PARAMETERS)
        .into_owned();
    [
        ("friction", "viscous and Coulomb friction", friction),
        ("offset", "constant torques", offset),
        ("gravity", "first moments and constant torques", gravity),
        (
            "payload",
            "the ten inertial parameters of the last link",
            payload,
        ),
    ]
}

/// Returns the hypothesis that D·δ_s differs between the sets.
fn differing(
    common: &Common,
    name: &'static str,
    what: &str,
    d: &DMatrix<f64>,
) -> Option<Hypothesis> {
    let mut free = 0;
    let mut weights = Vec::with_capacity(common.weights.len());
    for (s, weight) in common.weights.iter().enumerate() {
        // The first set fixes what is common; in the others D·δ is fitted, which removes it from the weight.
        let (own, rank) = match s {
            0 => (weight.clone(), 0),
            _ => without_changes(weight, d),
        };
        free += rank;
        weights.push(own);
    }
    let chi2 = if free == common.freedom() {
        0.0
    } else {
        common.about_mean(&weights)?.1
    };
    Some(hypothesis(common, name, what.to_owned(), free, chi2))
}

/// Returns a hypothesis with `free` values that leaves `chi2`; it is not compared with others yet.
pub(crate) fn hypothesis(
    common: &Common,
    name: &'static str,
    what: String,
    free: usize,
    chi2: f64,
) -> Hypothesis {
    let degrees_of_freedom = common.freedom().saturating_sub(free);
    let p = chi2_p(chi2, degrees_of_freedom);
    Hypothesis {
        name,
        what,
        free,
        chi2,
        degrees_of_freedom,
        p,
        log_likelihood_ratio: 0.0,
        aic: chi2 + 2.0 * free as f64,
        odds_against: 1.0,
        explains: p >= FAMILY_LEVEL,
        scales: Vec::new(),
        shifts: Vec::new(),
        joint: None,
    }
}

/// Returns the hypothesis that all torques of a set have one scale of their own.
fn scaled(common: &Common) -> Option<Hypothesis> {
    let n = common.values.len();
    let c = common.parameters.len();
    let mut scales = vec![1.0; n];
    let mut mean = common.about_mean(&common.weights)?.0;
    for _ in 0..SCALE_STEPS.0 {
        let mut change = 0.0f64;
        for s in 1..n {
            let along = &common.weights[s] * &mean;
            let scale = along.dot(&common.values[s]) / along.dot(&mean);
            change = change.max((scale - scales[s]).abs());
            scales[s] = scale;
        }
        let (mut sum, mut right) = (DMatrix::zeros(c, c), DVector::zeros(c));
        for ((weight, y), a) in common.weights.iter().zip(&common.values).zip(&scales) {
            sum += weight * (a * a);
            right += weight * y * *a;
        }
        mean = inverse(&sum)? * right;
        if change < SCALE_STEPS.1 {
            break;
        }
    }
    let chi2 = (0..n)
        .map(|s| quadratic(&common.weights[s], &(&common.values[s] - &mean * scales[s])))
        .sum();
    let own = |s: usize| match s {
        0 => [1.0, 0.0],
        _ => {
            let by_first = 1.0 / quadratic(&common.weights[0], &mean);
            let by_own = 1.0 / quadratic(&common.weights[s], &mean);
            [scales[s], (by_own + scales[s].powi(2) * by_first).sqrt()]
        }
    };
    let scales = (0..n).map(own).collect();
    Some(Hypothesis {
        scales,
        ..hypothesis(
            common,
            "scale",
            "one scale of all torques".to_owned(),
            n - 1,
            chi2,
        )
    })
}

/// Compares the hypotheses with each other and sorts them, the best first.
fn rate(list: &mut [Hypothesis]) {
    let nothing = list
        .iter()
        .find(|h| h.name == "nothing")
        .map_or(0.0, |h| h.chi2);
    let best = list.iter().map(|h| h.aic).fold(f64::INFINITY, f64::min);
    for h in list.iter_mut() {
        h.log_likelihood_ratio = 0.5 * (nothing - h.chi2);
        h.aic -= best;
        h.odds_against = (0.5 * h.aic).exp();
    }
    list.sort_by(|a, b| a.aic.total_cmp(&b.aic));
}

/// Returns the name of the cause, if one can be given, and the answer in words.
fn answer(list: &[Hypothesis], names: &[String], robot: &Robot) -> (Option<String>, String) {
    let Some(best) = list.first() else {
        return (None, String::new());
    };
    let ties: Vec<&Hypothesis> = (list.iter())
        .filter(|h| h.explains && h.odds_against < ODDS)
        .collect();
    match ties.as_slice() {
        [] if list.iter().all(|h| !h.explains || h.name == "anything") => (
            None,
            format!(
                "None of the tested causes explains the difference: its remainder is larger than chance for each of them.{} The sets differ in several ways at once, or the model has an error that depends on the motion; recordings of one repeated motion share it.",
                nearest(list, names, robot)
            ),
        ),
        [only] if only.name == "nothing" => (
            Some("nothing".into()),
            "Chance alone explains the difference: no cause is needed.".into(),
        ),
        [only] if only.name == "anything" => (
            None,
            "None of the tested causes explains the difference better than one of all parameters: the sets differ in several ways at once, or the model has an error that depends on the motion.".into(),
        ),
        [only] => {
            (
                Some(only.name.into()),
                format!(
                    "The difference is in {}. This explains it (remainder χ² {:.1} with {} degrees of freedom, p = {:.2}); every other hypothesis is at least {ODDS:.0} times less likely.",
                    with_sizes(only, names, robot), only.chi2, only.degrees_of_freedom, only.p
                ),
            )
        }
        several => (
            None,
            format!(
                "Several causes explain the difference about equally well: {}. The first is {:.1} times as likely as the last.",
                several.iter().map(|h| with_sizes(h, names, robot)).collect::<Vec<_>>().join("; "),
                several.last().map_or(best.odds_against, |h| h.odds_against)
            ),
        ),
    }
}

/// Names the cause that leaves least, if every other one is far less likely: it explains the largest part.
fn nearest(list: &[Hypothesis], names: &[String], robot: &Robot) -> String {
    match list {
        [best, next, ..]
            if next.odds_against >= ODDS && !["nothing", "anything"].contains(&best.name) =>
        {
            format!(
                " Nearest is {}; every other one is at least {ODDS:.0} times less likely.",
                with_sizes(best, names, robot)
            )
        }
        _ => String::new(),
    }
}

/// Returns a cause in words, with its size in each set if it has one.
fn with_sizes(found: &Hypothesis, names: &[String], robot: &Robot) -> String {
    match sizes(found, names, robot).join(", ") {
        none if none.is_empty() => found.what.clone(),
        some => format!("{} ({some}, relative to {})", found.what, names[0]),
    }
}

/// Returns the size of a scale or a shift in each set but the first.
fn sizes(found: &Hypothesis, names: &[String], robot: &Robot) -> Vec<String> {
    let scales = (found.scales.iter().zip(names).skip(1)).map(|([scale, std], name)| {
        format!(
            "{name} {:+.2} % ± {:.2} %",
            100.0 * (scale - 1.0),
            100.0 * std
        )
    });
    let unit = (found.joint).map_or("", |j| robot.joints[j].kind.units().0);
    let shifts = (found.shifts.iter().zip(names).skip(1))
        .map(|([shift, std], name)| format!("{name} {} {unit}", format_value(*shift, *std)));
    scales.chain(shifts).collect()
}
