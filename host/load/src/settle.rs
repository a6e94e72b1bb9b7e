//! Fits that are linearised about a rotation, a scale or a gain, repeated until these change no more.

use crate::mounting::Mounting;
use crate::system::{Fit, Sensed, Unknowns};

/// Gain of −2·ln of the likelihood from which one explanation is believed before another: odds of 3 million to one.
pub(crate) const DECISIVE: f64 = 30.0;
/// Rotation at which the steps end, rad.
const SETTLED: f64 = 1e-9;
/// Largest number of steps of the rotation.
const MOST_TURNS: usize = 40;

/// Turns sensor and gravity, and scales the moments or a channel, as far as these are among the unknowns, until the equations fit best
/// (Gauss–Newton).
pub(crate) fn settled(sensed: &Sensed, start: &Mounting, unknowns: &Unknowns) -> Fit {
    let mut fit = sensed.fit(start, unknowns);
    for _ in 0..MOST_TURNS {
        let turns = sensed.rotations(&fit);
        let scale = sensed.scale(&fit);
        let gain = sensed.gain(&fit);
        let change = gain.map_or(0.0, |(_, change)| change);
        let size = turns[0].norm().max(turns[1].norm());
        let size = size.max(scale.abs()).max(change.abs());
        if size == 0.0 {
            break;
        }
        // A linear step of more than a third of a turn points nowhere.
        let share = (1.0 / size).min(1.0);
        let [sensor, gravity] = turns.map(|by| by * share);
        let turned = fit.mounting.turned(&sensor, &gravity);
        let mut mounting = turned.scaled((share * scale).exp());
        if let Some((channel, change)) = gain {
            mounting.gains[channel] += share * change;
        }
        let next = sensed.fit(&mounting, unknowns);
        // Likelihoods are sums over many rows: less than one is rounding and the curvature of the rotation.
        if !next.misfit().is_finite() || next.misfit() > fit.misfit() + 1.0 {
            break;
        }
        fit = next;
        if size < SETTLED {
            break;
        }
    }
    fit
}
