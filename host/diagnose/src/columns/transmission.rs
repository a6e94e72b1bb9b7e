//! Torque of an elastic gear or of one with backlash, driven by the motor's measured motion.
//!
//! x = θm/ratio − q is the twist of joint j; λ is the load that a rigid gear would transmit for the motor's motion. The
//! link's equation, linearised about the motor's position, is M·ẍ = λ + f − K·x − τc(x, ẋ). M is the joint's own
//! inertia without the drive and K the slope of gravity. f is the share of friction on the link, which sticks (Moreau's
//! time stepping). τc is the torque of spring, damping and backlash. The drive's torque then differs from the rigid
//! model's by τc − λ − f(θ̇m/ratio). Contacts only push: [`transmission_torque`] has the law.
//!
//! Leaves out: effects of one joint's twist on the others.

use rig_shared::effects::{Kind, SHAPES, transmission_torque};
use rig_shared::lanes::Lanes;
use rig_shared::scalar::Real;

use crate::DiagnoseError;
use crate::rows::lanes::ABREAST;
use crate::rows::motion::motion_of;
use crate::rows::nominal::Nominal;
use rig_data::runs::Run;
use rig_numerics::statistics;

pub(crate) mod observer;

/// Least steps per sample; contact begins and ends within one.
const FEWEST_STEPS: usize = 4;
/// Most steps per sample; a stiffer column is not formed.
const MOST_STEPS: usize = 64;
/// Upper bound of step time times natural frequency.
const STEP: f64 = 0.2;
/// Largest twist under load, rad. Beyond it the equation, linearised about the motor's position, is not valid, and no
/// real gear is so soft.
const MOST_TWIST: f64 = 0.2;
/// Position difference for the slope of gravity, rad.
const NUDGE: f64 = 1e-4;

/// Coefficients of a joint's twist equation over a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Driven {
    mass: Vec<f64>,
    slope: Vec<f64>,
}

impl Driven {
    /// Computes them for `joint` over `run`, from base parameters. `drive` is the drive's inertia that is grouped with
    /// the link's.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn of(
        nominal: &Nominal,
        values: &[f64],
        joint: usize,
        drive: f64,
        run: &Run,
    ) -> Result<Self, DiagnoseError> {
        let n = nominal.joints();
        let rest = vec![vec![0.0; run.len()]; n];
        let motion = motion_of(run);
        let torque =
            |q: &[Vec<f64>], a: &[Vec<f64>]| nominal.inertial(values, joint, [q, &rest, a]);
        let still = torque(&motion[0], &rest)?;
        let mut unit = rest.clone();
        unit[joint].fill(1.0);
        let pushed = torque(&motion[0], &unit)?;
        let mut moved = motion[0].clone();
        moved[joint].iter_mut().for_each(|q| *q += NUDGE);
        let moved = torque(&moved, &rest)?;
        Ok(Self {
            mass: (pushed.iter().zip(&still))
                .map(|(a, b)| a - b - drive)
                .collect(),
            slope: (moved.iter().zip(&still))
                .map(|(a, b)| (a - b) / NUDGE)
                .collect(),
        })
    }

    /// Returns the link's own mean inertia over the run.
    pub(crate) fn mean_mass(&self) -> f64 {
        statistics::mean_or_zero(&self.mass)
    }

    /// Returns the drive torque minus that of a rigid gear, one signal per set of shapes. `None` if the link has no own
    /// inertia, the contact is too stiff for the steps or the gear is softer than [`MOST_TWIST`] allows.
    pub(crate) fn excess(
        &self,
        kind: Kind,
        shapes: &[[f64; SHAPES]],
        of: &Load,
    ) -> Vec<Option<Vec<f64>>> {
        let mut signals = vec![None; shapes.len()];
        let steps: Vec<Option<usize>> = shapes.iter().map(|s| self.steps(kind, s, of)).collect();
        let mut counts: Vec<usize> = steps.iter().flatten().copied().collect();
        counts.sort_unstable();
        counts.dedup();
        for count in counts {
            let alike: Vec<usize> = (0..shapes.len())
                .filter(|k| steps[*k] == Some(count))
                .collect();
            for places in alike.chunks(ABREAST) {
                let lane = |k: usize| shapes[places[k.min(places.len() - 1)]];
                let found = if places.len() == 1 {
                    self.driven::<f64>(kind, &lane(0), count, of)
                        .map(|torque| vec![torque])
                } else {
                    let all: [[f64; SHAPES]; ABREAST] = std::array::from_fn(lane);
                    let side_by_side = std::array::from_fn(|s| Lanes(all.map(|shape| shape[s])));
                    self.driven::<Lanes<ABREAST>>(kind, &side_by_side, count, of)
                        .map(|torque| {
                            (0..places.len())
                                .map(|k| torque.iter().map(|lanes| lanes.0[k]).collect())
                                .collect()
                        })
                };
                for (k, torque) in places.iter().zip(found.unwrap_or_default()) {
                    signals[*k] = torque.iter().all(|t| t.is_finite()).then_some(torque);
                }
            }
        }
        signals
    }

    /// Returns the steps per sample for these shapes: a power of two, so that sets can share it.
    fn steps(&self, kind: Kind, shapes: &[f64; SHAPES], of: &Load) -> Option<usize> {
        let [_, stiffness, damping] = kind.transmission(shapes)?;
        let least = self.mass.iter().copied().fold(f64::INFINITY, f64::min);
        let most = of.load.iter().fold(0.0, |m: f64, l| m.max(l.abs()));
        if least.is_nan() || least <= 0.0 || most > MOST_TWIST * stiffness {
            return None;
        }
        let fast = (stiffness / least).sqrt().max(damping / least);
        let steps = (of.period * fast / STEP).ceil().max(FEWEST_STEPS as f64) as usize;
        (steps <= MOST_STEPS).then(|| steps.next_power_of_two())
    }

    /// Returns the torque, one lane per set of shapes.
    fn driven<T: Real>(
        &self,
        kind: Kind,
        shapes: &[T; SHAPES],
        steps: usize,
        of: &Load,
    ) -> Option<Vec<T>> {
        let gear = Gear::of(kind, shapes, steps)?;
        let mut twist = Twist::at_rest(&gear, *of.load.first()?);
        let mut out = Vec::with_capacity(of.load.len());
        out.push(T::ZERO);
        out.extend((1..of.load.len()).map(|k| self.sample(&gear, of, k, &mut twist)));
        Some(out)
    }

    /// Returns the mean torque from sample `k` − 1 to `k` and advances the twist.
    #[inline]
    fn sample<T: Real>(&self, gear: &Gear<T>, of: &Load, k: usize, twist: &mut Twist<T>) -> T {
        let Gear {
            law: [gap, stiffness, damping],
            share,
            steps,
        } = *gear;
        let number = T::from_f64;
        let [viscous, coulomb] = of.friction.map(|f| share * number(f.max(0.0)));
        let per_step = 1.0 / steps as f64;
        let h = of.period * per_step;
        let half = number(0.5 * h);
        let (from, to) = (of.load[k - 1], of.load[k]);
        let (before, after) = (of.speed[k - 1], of.speed[k]);
        let slope = number(self.slope[k]);
        // Divides once per sample: each step waits for the one before it, so divisions would take most of the time.
        let per_torque = number(h / self.mass[k]);
        let slides = T::ONE / (T::ONE + viscous * per_torque);
        let sticks = coulomb * per_torque;
        let Twist { mut x, mut v } = *twist;
        let mut sum = T::ZERO;
        for s in 0..steps {
            let part = (s as f64 + 0.5) * per_step;
            // Half a step of the twist, torque at the midpoint, second half: second order.
            let middle = x + half * v;
            let torque = transmission_torque(gap, stiffness, damping, middle, v);
            let pull = number(from + part * (to - from)) - slope * middle - torque;
            // The link's own velocity after the step, without and with its friction.
            let motor = number(before + part * (after - before));
            let slid = (motor - v - per_torque * pull) * slides;
            v = motor - slid + slid.clamp_to(-sticks, sticks);
            x = middle + half * v;
            sum += torque;
        }
        *twist = Twist { x, v };
        let rigid = viscous * number(after) + coulomb * number(after.signum());
        sum * number(per_step) - number(0.5 * (from + to)) - rigid
    }
}

/// A gear with given shapes.
#[derive(Clone, Copy, Debug)]
struct Gear<T> {
    /// Gap, stiffness and damping, as [`transmission_torque`] takes them.
    law: [T; 3],
    /// Share of the joint's friction that acts on the link.
    share: T,
    /// Steps per sample.
    steps: usize,
}

impl<T: Real> Gear<T> {
    fn of(kind: Kind, shapes: &[T; SHAPES], steps: usize) -> Option<Self> {
        Some(Self {
            law: kind.transmission(shapes)?,
            share: kind.link_friction(shapes)?,
            steps,
        })
    }
}

/// Twist and its rate, rad and rad/s.
#[derive(Clone, Copy, Debug)]
struct Twist<T> {
    x: T,
    v: T,
}

impl<T: Real> Twist<T> {
    /// Returns the twist at rest against the flank that the load presses on.
    fn at_rest(gear: &Gear<T>, load: f64) -> Self {
        let number = T::from_f64;
        let [gap, stiffness, _] = gear.law;
        Self {
            x: number(0.5 * load.signum()) * gap + number(load) / stiffness,
            v: T::ZERO,
        }
    }
}

/// Inputs that drive the twist of a joint over a run.
pub(crate) struct Load<'a> {
    /// Sample period, s.
    pub(crate) period: f64,
    /// Motor velocity divided by the ratio, rad/s.
    pub(crate) speed: &'a [f64],
    /// Torque that a rigid gear would transmit, N·m.
    pub(crate) load: &'a [f64],
    /// Viscous and Coulomb friction of the joint, N·m·s/rad and N·m.
    pub(crate) friction: [f64; 2],
}
