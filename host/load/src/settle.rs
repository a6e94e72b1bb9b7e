//! Fits that are linearised about a rotation, a scale or a gain, repeated until these change no more.

use nalgebra::Vector3;

use crate::mounting::Mounting;
use crate::system::{Fit, Sensed, Unknowns};

/// Gain of −2·ln of the likelihood from which one explanation is believed before another: odds of 3 million to one.
pub(crate) const DECISIVE: f64 = 30.0;
/// Rotation at which the steps end, rad.
const SETTLED: f64 = 1e-9;
/// Largest number of steps of the rotation.
const MOST_TURNS: usize = 40;

/// The changes that a linearised fit asks for.
struct Step {
    /// Of the sensor, and of gravity, rad.
    turns: [Vector3<f64>; 2],
    /// Logarithm of the scale of the moments.
    scale: f64,
    /// A channel, and that of its gain.
    gain: Option<(usize, f64)>,
}

impl Step {
    fn of(sensed: &Sensed, fit: &Fit) -> Self {
        Self {
            turns: sensed.rotations(fit),
            scale: sensed.scale(fit),
            gain: sensed.gain(fit),
        }
    }

    fn size(&self) -> f64 {
        let turned = self.turns[0].norm().max(self.turns[1].norm());
        let gain = self.gain.map_or(0.0, |(_, change)| change);
        turned.max(self.scale.abs()).max(gain.abs())
    }

    /// Returns the mounting after this step, which is shortened to 1 (rad): a longer one points nowhere.
    fn taken_from(&self, mounting: &Mounting) -> Mounting {
        let share = (1.0 / self.size()).min(1.0);
        let [sensor, gravity] = self.turns.map(|by| by * share);
        let mut next = (mounting.turned(&sensor, &gravity)).scaled((share * self.scale).exp());
        if let Some((channel, change)) = self.gain {
            next.gains[channel] += share * change;
        }
        next
    }
}

/// Turns sensor and gravity, and scales the moments or a channel, as far as these are among the unknowns, until the equations fit best
/// (Gauss–Newton).
///
/// The misfit of a fit is that with its own linear step. A long step makes gravity too large, and may fit better than any
/// turn. So a larger misfit ends the search only if the steps no longer become smaller.
pub(crate) fn settled(sensed: &Sensed, start: &Mounting, unknowns: &Unknowns) -> Fit {
    let mut fit = sensed.fit(start, unknowns);
    let mut step = Step::of(sensed, &fit);
    for _ in 0..MOST_TURNS {
        let size = step.size();
        if size < SETTLED {
            break;
        }
        let next = sensed.fit(&step.taken_from(&fit.mounting), unknowns);
        let next_step = Step::of(sensed, &next);
        // Likelihoods are sums over many rows: less than one is rounding and the curvature of the rotation.
        let is_worse = next.misfit() > fit.misfit() + 1.0;
        if !next.misfit().is_finite() || (is_worse && next_step.size() >= size) {
            break;
        }
        (fit, step) = (next, next_step);
    }
    fit
}
