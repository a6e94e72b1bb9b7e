//! Changes of the nominal parameters against the description: a payload, a torque constant, a single value.

use std::collections::BTreeMap;

use rig_shared::effects::Kind;

use crate::fit::least_squares::{Evidence, Fit};
use crate::fit::refit::{Refit, described_sizes};
use crate::fit::solution::Solution;
use crate::models::payload::{on_last_link, on_single_link};
use crate::outcome::Value;
use crate::recordings::context::DiagnosisContext;
use crate::rows::regression::{Column, Rows, combined};
use crate::search::fitted_candidate::{FittedCandidate, LEAST_GAIN, SIGNIFICANT};

/// Share of the whole change's gain that some parameters must reach to explain it.
const SPEAKS_FOR_ALL: f64 = 0.9;

/// The same for inertia and gravity of a payload beside friction effects, whose mismatch moves friction values.
const SPEAKS_BESIDE_FRICTION: f64 = 0.5;
/// Difference of the growth of inertia and gravity below which both have one factor.
const ONE_RATIO: f64 = 0.05;

/// Least relative change of at least one nominal parameter. The mismatch of effects moves all of them by a per cent in
/// a refit.
const LEAST_CHANGE: f64 = 0.04;
/// Least relative change of both inertia and gravity for a payload …
const LEAST_OF_BOTH: f64 = 0.02;
/// … and with an unexplained residual, which moves parameters at random.
const LEAST_OF_BOTH_BESIDE: f64 = 0.04;
/// Least ratio of a change to its standard deviation.
pub(crate) const LEAST_SIGMAS: f64 = 4.0;

/// Maximum number of parameters reported with values.
const MOST_TOLD: usize = 8;
/// Largest departure of parameters from one common factor. The mismatch of effects moves them as much.
const ONE_FACTOR: f64 = 0.15;

/// A change of nominal parameters.
#[derive(Clone, Debug)]
pub(crate) struct Change {
    /// Description of the change.
    pub(crate) words: String,
    /// Name of the effect, if it is one.
    pub(crate) effect: Option<Kind>,
    /// Its parameters.
    pub(crate) parameters: BTreeMap<String, Value>,
    /// p-value of freeing the parameters that explain it, corrected for the sets tried.
    pub(crate) p_value: f64,
}

/// Compares the refit to `rows` with the description. `known` is the torque of the effects found. `beside_friction` is
/// true if friction is among them, `left` if a residual remains. Kinds in `without` are not named.
pub(crate) fn change(
    context: &DiagnosisContext,
    refit: &Refit,
    rows: &Rows,
    known: &Column,
    beside_friction: bool,
    left: bool,
    after: &Solution,
    without: &[Kind],
) -> Option<Change> {
    let (anchor, free) = (&context.anchor, &refit.free);
    if !anchor.stated {
        return None;
    }
    let prior = anchor.prior_coefficients();
    let mut frozen = refit.frozen(context);
    frozen.subtract(known);
    // An undescribed parameter cannot change.
    let (unstated, all): (Vec<usize>, Vec<usize>) =
        (0..free.len()).partition(|k| anchor.is_unstated(*k));
    let beside_constants = frozen.clone().taking(unstated.iter().map(|k| &free[*k]));
    let constants = unstated.iter().map(|k| (&free[*k], after.values[*k]));
    frozen.subtract(&combined(known.len(), constants));
    let evidence_in = |fit: &Fit, picked: &[usize]| {
        let own = |k: &usize| fit.projected(fit.weighted(&free[*k]));
        let columns: Vec<Vec<f64>> = picked.iter().map(own).collect();
        let open = vec![[f64::NEG_INFINITY, f64::INFINITY]; picked.len()];
        fit.evidence(&columns, &open)
    };
    let evidence = |picked: &[usize]| evidence_in(&frozen, picked);
    // All, a payload, all in one ratio, each alone. Every set counts, not only those tried before a success.
    let tried = 3 + all.len();
    let corrected = |e: &Evidence| e.corrected(tried);
    let whole = evidence(&all)?;
    if whole.gain < LEAST_GAIN || corrected(&whole) > SIGNIFICANT {
        return None;
    }
    // A value described as 0, or as a rounding of it, is no reference for a relative change.
    let sizes = described_sizes(context);
    let moved_most = (all.iter())
        .map(|&k| (after.values[k] - prior[k]).abs() / prior[k].abs().max(sizes[k]))
        .fold(0.0, f64::max);
    if moved_most < LEAST_CHANGE {
        return None;
    }
    let speaks = |e: &Evidence| e.gain >= SPEAKS_FOR_ALL * whole.gain;
    // A common factor is a torque constant.
    let carries = |e: &Evidence, [inertia, moment]: &[usize; 2]| {
        let [inertia, moment] = [inertia, moment].map(|k| after.values[*k] / prior[*k]);
        e.gain >= SPEAKS_BESIDE_FRICTION * whole.gain && (inertia / moment - 1.0).abs() > ONE_RATIO
    };
    let least = if left {
        LEAST_OF_BOTH_BESIDE
    } else {
        LEAST_OF_BOTH
    };
    if !without.contains(&Kind::Payload) {
        let told = |words: String, parameters, e: &Evidence| Change {
            words,
            effect: Some(Kind::Payload),
            parameters,
            p_value: corrected(e),
        };
        if let Some((parameters, directions)) = on_single_link(context, after, &prior, least)
            && let Some(e) = evidence(&directions)
            && (speaks(&e) || beside_friction && carries(&e, &directions))
        {
            let words =
                "Inertia and gravity have grown in the ratio of a mass at one place: a payload.";
            return Some(told(words.into(), parameters, &e));
        }
        // Undescribed constants are fitted with it: gravity's part of them is not known before.
        let share = match beside_friction {
            true => SPEAKS_BESIDE_FRICTION,
            false => SPEAKS_FOR_ALL,
        };
        if let Some((load, e)) = on_last_link(context, rows, &beside_constants)
            && load.mass.value > LEAST_SIGMAS * load.mass.std
            && let Some(whole) = evidence_in(&beside_constants, &all)
            && e.gain >= share * whole.gain
        {
            return Some(told(load.words(context.robot), load.parameters(), &e));
        }
    }
    let scale = combined(known.len(), free.iter().zip(prior.iter().copied()));
    let open = [[f64::NEG_INFINITY, f64::INFINITY]];
    // If gravity and inertia dominate the torque, they also decide on friction, whatever that does.
    let of_one_factor = |factor: f64| {
        all.iter().all(|&k| {
            let apart = (after.values[k] - factor * prior[k]).abs();
            apart <= LEAST_SIGMAS * after.std(k) + ONE_FACTOR * (factor * prior[k]).abs()
        })
    };
    if let Some(e) = frozen.evidence(&[frozen.projected(frozen.weighted(&scale))], &open)
        && speaks(&e)
        && of_one_factor(1.0 + e.gains[0])
    {
        let percent = 100.0 * e.gains[0];
        return Some(Change {
            words: format!(
                "All parameters have changed by {percent:.1} % together: the torque constant (or the scale of the torque) is not what the description says."
            ),
            effect: None,
            parameters: BTreeMap::new(),
            p_value: corrected(&e),
        });
    }
    let name = |k: usize| match anchor.free[k].as_slice() {
        [(b, _)] => context.expression(*b),
        _ => "the first moment (gravity)".into(),
    };
    for &k in &all {
        if let Some(e) = evidence(&[k])
            && speaks(&e)
        {
            return Some(Change {
                words: format!(
                    "{} has changed from {} to {}.",
                    name(k),
                    rig_output::format_significant(prior[k], 4),
                    rig_output::format_value(after.values[k], after.std(k))
                ),
                effect: None,
                parameters: BTreeMap::new(),
                p_value: corrected(&e),
            });
        }
    }
    let moved: Vec<String> = (all.iter().copied())
        .filter(|&k| (after.values[k] - prior[k]).abs() > 4.0 * after.std(k))
        .map(|k| {
            format!(
                "{} {} where {} is described",
                name(k),
                rig_output::format_value(after.values[k], after.std(k)),
                rig_output::format_significant(prior[k], 4)
            )
        })
        .collect();
    if moved.is_empty() {
        return None;
    }
    Some(Change {
        words: format!(
            "Several nominal parameters differ from the description: {}{}.",
            moved[..moved.len().min(MOST_TOLD)].join("; "),
            match moved.len().saturating_sub(MOST_TOLD) {
                0 => String::new(),
                more => format!("; and {more} more"),
            }
        ),
        effect: None,
        parameters: BTreeMap::new(),
        p_value: corrected(&whole),
    })
}

/// Returns true if inertia and gravity beside these effects have grown like a payload on a single link.
pub(crate) fn is_loaded(
    context: &DiagnosisContext,
    refit: &Refit,
    chosen: &[FittedCandidate],
) -> bool {
    let prior = context.anchor.prior_coefficients();
    let grown = |after| on_single_link(context, &after, &prior, LEAST_OF_BOTH_BESIDE).is_some();
    refit.solution(chosen).is_ok_and(grown)
}
