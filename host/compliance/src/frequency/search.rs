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

/// Predictions of the friction; four more change the stiffness by less than a twentieth of its standard deviation.
const PREDICTIONS: usize = 8;
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
/// row; leaves the spectra as it predicts them. One of the two is enough. Both begin alike, as further predictions alone make a
/// deviance smaller; the more likely one is then fitted by the whole prediction.
fn fit_plain(spectra: &mut Spectra, known: &Known) -> Option<(Known, Fitted)> {
    let start = fit(&bands(spectra), known, None)?;
    let with_hold = |hold: f64| {
        let known = Known { hold, ..*known };
        let (mut own, mut found) = (spectra.clone(), start.clone());
        for _ in 0..PREDICTIONS {
            own.predict(&found.model, &known.gravity);
            found = fit(&bands(&own), &known, Some(&found.model))?;
        }
        Some((known, found, own))
    };
    let both = [0.0, 1.0 / known.rate].map(with_hold).into_iter().flatten();
    let (known, found, own) = both.min_by(|a, b| a.1.deviance.total_cmp(&b.1.deviance))?;
    *spectra = own;
    let Some(whole) = refit(spectra, &known, &found) else {
        return Some((known, found));
    };
    *spectra = spectra.predicted(&whole.model, &found.model, &known.gravity);
    Some((known, whole))
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
