//! Observer of the link behind a gear, from the recorded torque.
//!
//! A twist driven only by the motor's motion ([`Driven::excess`]) keeps errors while the link rings, a second or more.
//! They come from the motion's noise and from torques on the link. With backlash, one early contact shifts all later
//! ones. So an extended Kalman filter follows the link. Its states are the twist, its rate and an unknown torque on the
//! link (first-order Gauss-Markov). Its reading is the part of the recorded torque that remains for the gear. The zone
//! without contact is replaced by the nearest line over the distribution of the twist: the describing function of a
//! random input (Gelb and Vander Velde 1968). The resulting torque is *predicted*: it restarts from the filter's state
//! every [`SWING`] of the link, not before [`STRETCH`]. It does not use the torque recorded after that.
//!
//! Between the flanks no torque shows the link's position. An unknown torque makes contact some milliseconds early or
//! late, which causes most of the residual of a backlash. So a stretch may be *smoothed*: it starts at the most likely
//! state by the filter's belief and the stretch's own readings (maximum a posteriori, two numbers a stretch; a horizon
//! with an arrival cost: Rao, Rawlings and Mayne 2003, IEEE Transactions on Automatic Control 48). Shapes are fitted to
//! predictions, not to smoothed stretches.
//!
//! Leaves out: effects of one joint's twist on the others; the uncertainty of friction while the link sticks.

use std::f64::consts::{SQRT_2, TAU};
use std::ops::Range;

use rig_shared::effects::{Kind, SHAPES};
use statrs::function::erf::erf;

use crate::columns::transmission::{Driven, Gear, Load, Twist};
use rig_numerics::optimise::simplex::Simplex;

/// Least time between two restarts of the prediction, s: the duration of a torque on the link.
pub(crate) const STRETCH: f64 = 0.05;
/// … and as a share of the link's oscillation period on its gear. A shorter prediction would depend on its initial
/// state alone.
const SWING: f64 = 0.5;
/// Time between two readings, s; the torque is averaged over it.
const READ_EVERY: f64 = 0.002;
/// Correlation time of the unknown torque on the link, s.
const LASTS: f64 = 0.05;
/// Relative uncertainty of the initial twist under load.
const AT_FIRST: f64 = 0.3;
/// Least standard deviation of the initial twist, rad.
const LEAST_TWIST: f64 = 1e-5;
/// … and the one of its rate, rad/s.
const FIRST_RATE: f64 = 0.01;
/// Squared error of a reading, in units of its variance, above which the filter has lost the contact.
const SURPRISED: f64 = 16.0;
/// Standard deviation added to the twist then, as a share of half the gap …
const LOST: f64 = 0.3;
/// … and to its rate, as a share of half the gap times the natural frequency of the closed contact.
const LOST_RATE: f64 = 0.15;
/// Torque, in standard deviations of its noise, above which its sign shows the flank in contact …
const FLANK: f64 = 3.0;
/// … and standard deviation of the twist then, as a share of half the gap.
const KNOWN_BY_FLANK: f64 = 0.1;

/// Evaluations per smoothed stretch: they determine its two numbers to a tenth of a standard deviation or better.
const ANSWERS: usize = 30;

/// Recorded torque as input of the observer.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seen {
    /// Torque that remains for the gear's excess, N·m.
    pub(crate) torque: Vec<f64>,
    /// True where the torque is valid: the direction is known and nothing saturates.
    pub(crate) sure: Vec<bool>,
    /// Standard deviation of a sample's noise, N·m.
    pub(crate) noise: f64,
    /// Standard deviation of the unknown torque on the link, N·m.
    pub(crate) unrest: f64,
    /// True to start each stretch at the state that its own readings support too.
    pub(crate) smoothed: bool,
}

/// Linear approximation of the zone without contact over the distribution of the twist.
struct Contact {
    /// Mean deflection of the contact.
    bend: f64,
    /// Its slope: the probability of contact.
    slope: f64,
    /// Variance that the line does not explain.
    left: f64,
}

impl Contact {
    fn of(half: f64, twist: f64, variance: f64) -> Self {
        if half <= 0.0 {
            return Self {
                bend: twist,
                slope: 1.0,
                left: 0.0,
            };
        }
        let spread = variance.max(f64::MIN_POSITIVE).sqrt();
        // For a flank exceeded by `beyond`: probability of contact, first and second moment of the deflection.
        let flank = |beyond: f64| {
            let z = beyond / spread;
            let probability = 0.5 * (1.0 + erf(z / SQRT_2));
            let density = spread * (-0.5 * z * z).exp() / TAU.sqrt();
            let mean = beyond * probability + density;
            let square = (beyond * beyond + variance) * probability + beyond * density;
            [probability, mean, square]
        };
        let [above, below] = [flank(twist - half), flank(-twist - half)];
        let (bend, slope) = (above[1] - below[1], above[0] + below[0]);
        Self {
            bend,
            slope,
            left: (above[2] + below[2] - bend * bend - slope * slope * variance).max(0.0),
        }
    }
}

/// Twist, its rate and the torque on the link, with their covariance.
struct Belief {
    twist: Twist<f64>,
    torque: f64,
    covariance: [[f64; 3]; 3],
}

impl Belief {
    /// Advances the covariance by a step. The new rate is a linear function of the state with these slopes.
    fn stepped(&mut self, half_step: f64, [a, b, c]: [f64; 3], keeps: f64) {
        let p = self.covariance;
        let h = half_step;
        // The new twist is x + h·(v + v'). All covariances follow from those of the new rate with the old state.
        let rate: [f64; 3] = std::array::from_fn(|j| a * p[0][j] + b * p[1][j] + c * p[2][j]);
        let own = a * rate[0] + b * rate[1] + c * rate[2];
        let along = rate[0] + h * rate[1];
        let twist = p[0][0] + h * (2.0 * p[0][1] + h * p[1][1]) + h * (2.0 * along + h * own);
        let both = along + h * own;
        let to_torque = [keeps * (p[0][2] + h * (p[1][2] + rate[2])), keeps * rate[2]];
        self.covariance = [
            [twist, both, to_torque[0]],
            [both, own, to_torque[1]],
            [to_torque[0], to_torque[1], keeps * keeps * p[2][2]],
        ];
    }

    /// Corrects the state by a reading with this error, these slopes and this variance.
    fn corrected(&mut self, error: f64, slopes: [f64; 2], variance: f64) {
        let p = self.covariance;
        let along: [f64; 3] = std::array::from_fn(|i| p[i][0] * slopes[0] + p[i][1] * slopes[1]);
        let gain = along.map(|x| x / variance);
        self.twist.x += gain[0] * error;
        self.twist.v += gain[1] * error;
        self.torque += gain[2] * error;
        for i in 0..3 {
            for j in 0..3 {
                self.covariance[i][j] -= 0.5 * (gain[i] * along[j] + gain[j] * along[i]);
            }
        }
    }

    /// Returns the twist at `away` standard deviations: along twist and correlated rate, and along the remaining rate.
    fn at(&self, away: &[f64]) -> Twist<f64> {
        let [[xx, xv, _], [_, vv, _], _] = self.covariance;
        let twist = xx.max(f64::MIN_POSITIVE).sqrt();
        let along = xv / twist;
        let rate = (vv - along * along).max(0.0).sqrt();
        Twist {
            x: self.twist.x + twist * away[0],
            v: self.twist.v + along * away[0] + rate * away[1],
        }
    }

    /// Returns the variance of a reading with these slopes.
    fn variance(&self, [a, b]: [f64; 2]) -> f64 {
        let p = &self.covariance;
        a * a * p[0][0] + 2.0 * a * b * p[0][1] + b * b * p[1][1]
    }
}

impl Driven {
    /// Returns the drive torque minus that of a rigid gear, predicted stretch by stretch from the observed link. `None`
    /// where [`Driven::excess`] gives none.
    pub(crate) fn followed(
        &self,
        kind: Kind,
        shapes: &[f64; SHAPES],
        of: &Load,
        seen: &Seen,
    ) -> Option<Vec<f64>> {
        let gear = Gear::of(kind, shapes, self.steps(kind, shapes, of)?)?;
        let rate = 1.0 / of.period;
        let swing = TAU * (self.mean_mass() / gear.law[1]).sqrt();
        let stretch = (SWING * swing).max(STRETCH);
        let stretch = ((stretch * rate).round() as usize).max(1);
        let every = ((READ_EVERY * rate).round() as usize).max(1);
        let noise = seen.noise * seen.noise / every as f64;
        let mut belief = Self::at_first(&gear, seen.unrest, of)?;
        let (mut sum, mut count) = (0.0, 0.0);
        let mut out = Vec::with_capacity(of.load.len());
        out.push(0.0);
        for k in 1..of.load.len() {
            if (k - 1) % stretch == 0 {
                let own = k..(k + stretch).min(of.load.len());
                let mut ahead = match seen.smoothed && gear.law[0] > 0.0 {
                    true => self.smoothed(&gear, of, seen, &belief, own.clone(), every),
                    false => belief.twist,
                };
                out.extend(own.map(|k| self.sample(&gear, of, k, &mut ahead)));
            }
            self.filtered(&mut belief, &gear, of, seen.unrest, k);
            let [viscous, coulomb] = of.friction.map(|f| gear.share * f.max(0.0));
            let rigid = of.load[k] + viscous * of.speed[k] + coulomb * of.speed[k].signum();
            sum += seen.torque[k] + rigid;
            count += 1.0;
            if k % every == 0 {
                if seen.sure[k] {
                    self.read(&mut belief, &gear, sum / count, [noise, seen.unrest], k);
                }
                (sum, count) = (0.0, 0.0);
            }
        }
        out.iter().all(|t| t.is_finite()).then_some(out)
    }

    /// Returns the most likely initial twist of a stretch, from the belief before it and its readings, each over
    /// `every` samples. The unknown torque is part of their error.
    fn smoothed(
        &self,
        gear: &Gear<f64>,
        of: &Load,
        seen: &Seen,
        belief: &Belief,
        stretch: Range<usize>,
        every: usize,
    ) -> Twist<f64> {
        let variance = seen.noise * seen.noise / every as f64 + seen.unrest * seen.unrest;
        let unlikely = |z: &[f64]| {
            let mut twist = belief.at(z);
            let mut cost = z[0] * z[0] + z[1] * z[1];
            for from in stretch.clone().step_by(every) {
                let reading = from..(from + every).min(stretch.end);
                let left: f64 = (reading.clone())
                    .map(|k| seen.torque[k] - self.sample(gear, of, k, &mut twist))
                    .sum();
                if seen.sure[reading.clone()].iter().all(|sure| *sure) {
                    cost += (left / reading.len() as f64).powi(2) / variance;
                }
            }
            cost
        };
        let mut simplex = Simplex::new(&[0.0, 0.0], &[1.0, 1.0]).with_evaluations(ANSWERS);
        while let Some(z) = simplex.next_point() {
            simplex.report(unlikely(&z));
        }
        belief.at(simplex.best())
    }

    fn at_first(gear: &Gear<f64>, unrest: f64, of: &Load) -> Option<Belief> {
        let load = *of.load.first()?;
        let twist = Twist::at_rest(gear, load);
        let [gap, stiffness, _] = gear.law;
        let wound = AT_FIRST * (load.abs() / stiffness + 0.5 * gap) + LEAST_TWIST;
        Some(Belief {
            twist,
            torque: 0.0,
            covariance: [
                [wound * wound, 0.0, 0.0],
                [0.0, FIRST_RATE * FIRST_RATE, 0.0],
                [0.0, 0.0, unrest * unrest],
            ],
        })
    }

    /// Advances the belief by a sample without a reading.
    fn filtered(&self, belief: &mut Belief, gear: &Gear<f64>, of: &Load, unrest: f64, k: usize) {
        let Gear {
            law: [gap, stiffness, damping],
            share,
            steps,
        } = *gear;
        let per_step = 1.0 / steps as f64;
        let h = of.period * per_step;
        let per_torque = h / self.mass[k];
        let [viscous, coulomb] = of.friction.map(|f| share * f.max(0.0));
        let slides = 1.0 / (1.0 + viscous * per_torque);
        let sticks = coulomb * per_torque;
        let keeps = (-h / LASTS).exp();
        let stirred = unrest * unrest * (1.0 - keeps * keeps);
        let from = belief.twist.x;
        let contact = Contact::of(0.5 * gap, from, belief.covariance[0][0]);
        let pulls = stiffness * contact.slope + self.slope[k];
        let damps = damping * contact.slope;
        for s in 0..steps {
            let part = (s as f64 + 0.5) * per_step;
            let between = |list: &[f64]| list[k - 1] + part * (list[k] - list[k - 1]);
            let Twist { x, v } = belief.twist;
            let middle = x + 0.5 * h * v;
            let bend = contact.bend + contact.slope * (middle - from);
            let pull = between(of.load)
                - self.slope[k] * middle
                - stiffness * bend
                - damps * v
                - belief.torque;
            let motor = between(of.speed);
            let slid = (motor - v - per_torque * pull) * slides;
            let slopes = if slid.abs() <= sticks {
                [0.0; 3]
            } else {
                [
                    -slides * per_torque * pulls,
                    slides * (1.0 - per_torque * (0.5 * h * pulls + damps)),
                    -slides * per_torque,
                ]
            };
            let v = motor - slid + slid.clamp(-sticks, sticks);
            belief.twist = Twist {
                x: middle + 0.5 * h * v,
                v,
            };
            belief.torque *= keeps;
            belief.stepped(0.5 * h, slopes, keeps);
            belief.covariance[2][2] += stirred;
            belief.covariance[1][1] += contact.left * (stiffness * per_torque).powi(2);
        }
    }

    /// Corrects the belief by the transmitted `torque`. `noise` is its variance, `unrest` the standard deviation of the
    /// torque on the link.
    fn read(
        &self,
        belief: &mut Belief,
        gear: &Gear<f64>,
        torque: f64,
        [noise, unrest]: [f64; 2],
        k: usize,
    ) {
        let [gap, stiffness, damping] = gear.law;
        let half = 0.5 * gap;
        let expected = |belief: &Belief| {
            let contact = Contact::of(half, belief.twist.x, belief.covariance[0][0]);
            let slopes = [stiffness * contact.slope, damping * contact.slope];
            let error = torque - stiffness * contact.bend - slopes[1] * belief.twist.v;
            let left = contact.left * stiffness * stiffness;
            (error, slopes, left + belief.variance(slopes) + noise)
        };
        let (mut error, mut slopes, mut variance) = expected(belief);
        if half > 0.0 && error * error > SURPRISED * variance {
            let swing = (stiffness / self.mass[k]).sqrt();
            belief.covariance[0][0] += (LOST * half).powi(2);
            belief.covariance[1][1] += (LOST_RATE * half * swing).powi(2);
            belief.covariance[2][2] = unrest * unrest;
            let touches = torque.abs() > FLANK * noise.sqrt();
            if touches && belief.twist.x * torque.signum() <= half {
                belief.twist.x = torque.signum() * (half + LEAST_TWIST);
                let [_, [_, rate, _], [_, _, torque]] = belief.covariance;
                let known = (KNOWN_BY_FLANK * half).powi(2);
                belief.covariance = [[known, 0.0, 0.0], [0.0, rate, 0.0], [0.0, 0.0, torque]];
            }
            (error, slopes, variance) = expected(belief);
        }
        belief.corrected(error, slopes, variance);
    }
}

#[cfg(test)]
mod tests {
    use rig_shared::effects::transmission_torque;

    use super::*;

    /// Compares with the matrix product that the code avoids.
    #[test]
    fn what_is_known_after_a_step_is_what_its_transition_makes_of_it() {
        let (h, keeps, slopes) = (0.3, 0.8, [-0.7, 0.4, -0.2]);
        let before = nalgebra::matrix![2.0, 0.3, -0.5; 0.3, 1.0, 0.4; -0.5, 0.4, 0.7];
        let [a, b, c] = slopes;
        let transition = nalgebra::matrix![
            1.0 + h * a, h * (1.0 + b), h * c;
            a, b, c;
            0.0, 0.0, keeps
        ];
        let mut belief = Belief {
            twist: Twist { x: 0.0, v: 0.0 },
            torque: 0.0,
            covariance: before.transpose().into(),
        };
        belief.stepped(h, slopes, keeps);
        let after = transition * before * transition.transpose();
        for i in 0..3 {
            for j in 0..3 {
                assert!((belief.covariance[i][j] - after[(i, j)]).abs() < 1e-12);
            }
        }
    }

    /// A link inside its backlash is observed only at contact. Contact in the stretch determines the initial rate,
    /// although the belief is off by two standard deviations.
    #[test]
    fn a_smoothed_stretch_begins_at_the_rate_with_which_the_link_touches() {
        let driven = Driven {
            mass: vec![0.15; 50],
            slope: vec![0.0; 50],
        };
        let nothing = vec![0.0; 50];
        let of = Load {
            period: 1e-3,
            speed: &nothing,
            load: &nothing,
            friction: [0.0; 2],
        };
        let gear = Gear::<f64> {
            law: [0.01, 2000.0, 8.0],
            share: 0.0,
            steps: 8,
        };
        let mut truth = Twist { x: -0.005, v: 0.3 };
        let mut torque = vec![0.0];
        torque.extend((1..50).map(|k| driven.sample(&gear, &of, k, &mut truth)));
        assert!(torque.iter().any(|t| *t > 1.0), "{torque:?}");
        let seen = Seen {
            torque,
            sure: vec![true; 50],
            noise: 0.05,
            unrest: 0.03,
            smoothed: true,
        };
        let belief = Belief {
            twist: Twist { x: -0.005, v: 0.26 },
            torque: 0.0,
            covariance: [[1e-10, 0.0, 0.0], [0.0, 4e-4, 0.0], [0.0, 0.0, 1e-3]],
        };
        let found = driven.smoothed(&gear, &of, &seen, &belief, 1..50, 2);
        assert!((found.v - 0.3).abs() < 0.002, "{found:?}");
        assert!((found.x + 0.005).abs() < 1e-4, "{found:?}");
    }

    #[test]
    fn contact_as_a_line_is_the_law_where_the_twist_is_known_and_a_mean_where_it_is_not() {
        for (twist, bend) in [(0.3, 0.0), (1.5, 0.5), (-2.0, -1.0)] {
            let known = Contact::of(1.0, twist, 1e-8);
            assert!((known.bend - bend).abs() < 1e-6 && known.left < 1e-8);
            assert!((known.slope - f64::from(u8::from(bend != 0.0))).abs() < 1e-6);
            let torque = transmission_torque(2.0, 1.0, 0.0, twist, 0.0);
            assert!((known.bend - torque).abs() < 1e-6);
        }
        // Compares with sums over the normal density.
        let (twist, spread) = (0.7, 0.4);
        let (mut weight, mut bend, mut along, mut square) = (0.0, 0.0, 0.0, 0.0);
        for k in -6000..=6000 {
            let z = f64::from(k) * 1e-3;
            let w = (-0.5 * z * z).exp();
            let b = transmission_torque(2.0, 1.0, 0.0, twist + spread * z, 0.0);
            weight += w;
            bend += w * b;
            along += w * b * z;
            square += w * b * b;
        }
        let (bend, slope, square) = (bend / weight, along / weight / spread, square / weight);
        let found = Contact::of(1.0, twist, spread * spread);
        assert!((found.bend - bend).abs() < 1e-6);
        assert!((found.slope - slope).abs() < 1e-6);
        let left = square - bend * bend - (slope * spread).powi(2);
        assert!((found.left - left).abs() < 1e-6);
    }
}
