//! The fit with and without a gap.
//!
//! A gap in series with the spring softens the response, the more the smaller the twist is (describing function of a dead
//! zone, Gelb & Vander Velde 1968): a linear fit gives a smaller stiffness, a heavier motor and a lighter link. Here the
//! torque that the gap takes away is predicted in time and is a further input, as friction is.
//!
//! A controller that holds the torque from row to row makes the joint seem stiffer, by 8 % with 7 rows a period of the
//! antiresonance; both are fitted, and the more likely one counts.
//!
//! Leaves out: gaps beyond the twist, where impacts decide the motion of the link; the response then bounds the stiffness.

use super::bands::bands;
use super::fit::{Fitted, Known, fit, refit};
use super::spectra::Spectra;
use super::two_mass::TwoMass;

/// Predictions of the friction; four more change the stiffness by less than a twentieth of its standard deviation.
const PREDICTIONS: usize = 8;
/// Damping ratio from which a fit begins again that ended without damping. From 0.02 and 0.08 it ended at one model.
const DAMPED: f64 = 0.08;
/// Gaps that are tried at first, over the twist by the RMS torque.
const TRIED: [f64; 3] = [0.1, 0.5, 2.0];
/// Predictions with a gap. The last ones differ by a few per cent: the motion of a link in a gap is not predictable in detail.
const GAP_PREDICTIONS: usize = 10;
/// Decrease of the deviance from which on a gap is evident. Simulated rigs without a gap had none (tests), those with a gap
/// of 8 to 400 % of the twist had 200 to 3900.
const EVIDENT: f64 = 50.0;
/// Share of this decrease that the described inertias must keep.
const KEPT: f64 = 0.5;

/// What the response shows of a gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Gap {
    /// Nothing.
    None,
    /// A gap whose size follows, with the described inertias.
    Found,
    /// A gap whose size does not follow: the stiffness is a lower bound.
    Bound,
}

/// Fits the model with the friction that it predicts, and with a gap if one is evident. `inertias` are those of link and
/// motor by the description.
pub(super) fn fit_all(
    spectra: &mut Spectra,
    known: &Known,
    inertias: Option<[f64; 2]>,
) -> Option<(Fitted, Gap)> {
    let (known, plain) = fit_plain(spectra, known)?;
    let known = &known;
    let (before, without) = (spectra.clone(), plain.deviance);
    let evident =
        fit_with_gap(spectra, known, &plain).filter(|found| without - found.deviance > EVIDENT);
    let Some(evident) = evident else {
        *spectra = before;
        return Some((plain, Gap::None));
    };
    let described = inertias.and_then(|[link, motor]| {
        let known = Known {
            link_inertia: Some(link),
            motor_inertia: Some(motor),
            ..*known
        };
        fit_with_gap(spectra, &known, &plain)
    });
    let least = KEPT * (without - evident.deviance);
    match described.filter(|found| without - found.deviance > least) {
        Some(found) => Some((found, Gap::Found)),
        None => {
            *spectra = before;
            Some((plain, Gap::Bound))
        }
    }
}

/// Returns the most likely fit without a gap, of a torque that acts as recorded at each instant, or that is held from row to
/// row; leaves the spectra as it predicts them. One of the two is enough. Both are fitted by the whole prediction before they
/// are compared: before it a deviance is that of friction which another model predicts, and tells nothing of its own.
fn fit_plain(spectra: &mut Spectra, known: &Known) -> Option<(Known, Fitted)> {
    let mut start = fit(&bands(spectra), known, None)?;
    let mut with_hold = |hold: f64| {
        let known = Known { hold, ..*known };
        let (mut own, mut found) = (spectra.clone(), start.clone());
        for _ in 0..PREDICTIONS {
            own.predict(&found.model, &known.gravity);
            found = fit(&bands(&own), &known, Some(&found.model))?;
        }
        // The next one begins where this one ends.
        start.clone_from(&found);
        let found = fit_whole(&mut own, &known, found);
        Some((known, found, own))
    };
    let both = [with_hold(0.0), with_hold(1.0 / known.rate)];
    let (known, found, own) =
        (both.into_iter().flatten()).min_by(|a, b| a.1.deviance.total_cmp(&b.1.deviance))?;
    *spectra = own;
    Some((known, found))
}

/// Fits by the whole prediction, and leaves the spectra as it predicts them. No damping is a local minimum, in which viscous
/// friction of the link and a delay stand for it: the fit begins again with damping, without this friction.
fn fit_whole(spectra: &mut Spectra, known: &Known, found: Fitted) -> Fitted {
    let Some(whole) = refitted(spectra, known, &found.model) else {
        return found;
    };
    if !whole.model.is_undamped() {
        return whole;
    }
    let mut start = whole.model;
    start.damping = 2.0 * DAMPED * start.antiresonance() * start.link_inertia;
    start.link_viscous = 0.0;
    let mut damped = spectra.predicted(&start, &start, &known.gravity);
    // Its weights are those of the start at first.
    let again = refitted(&mut damped, known, &start)
        .and_then(|own| refitted(&mut damped, known, &own.model));
    match again.filter(|own| own.deviance < whole.deviance) {
        Some(own) => {
            *spectra = damped;
            own
        }
        None => whole,
    }
}

/// Fits by the whole prediction from a start that predicted the spectra, and leaves them as the fit predicts them.
fn refitted(spectra: &mut Spectra, known: &Known, start: &TwoMass) -> Option<Fitted> {
    let found = refit(spectra, known, start)?;
    *spectra = spectra.predicted(&found.model, start, &known.gravity);
    Some(found)
}

/// Returns the most likely fit with a gap, and leaves the spectra as it predicts them.
fn fit_with_gap(spectra: &mut Spectra, known: &Known, plain: &Fitted) -> Option<Fitted> {
    let twist = spectra.torque() / plain.model.stiffness;
    let mut best: Option<(Fitted, Spectra)> = None;
    for share in TRIED {
        let mut model = plain.model;
        model.gap = share * twist;
        // The antiresonance stays where it is.
        if let Some(link) = known.link_inertia {
            model.stiffness *= link / model.link_inertia;
        }
        for _ in 0..GAP_PREDICTIONS {
            spectra.predict(&model, &known.gravity);
            let Some(found) = fit(&bands(spectra), known, Some(&model)) else {
                break;
            };
            model = found.model;
            if model.gap <= 0.0 {
                break;
            }
            if (best.as_ref()).is_none_or(|(best, _)| found.deviance < best.deviance) {
                best = Some((found, spectra.clone()));
            }
        }
    }
    let (found, predicted) = best?;
    *spectra = predicted;
    Some(found)
}
