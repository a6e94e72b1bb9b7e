//! Gear parameters from the coefficients of a transmission's equation.

use rig_shared::effects::{Kind, SHAPES};

use crate::fit::least_squares::Fit;
use crate::levels::CLOSED_TEETH;
use crate::link_encoder::analysis::{Solved, Term, TransmissionAnalysis};
use crate::link_encoder::contact::Contact;
use crate::link_encoder::law::{Law, Laws};
use crate::link_encoder::sizes::spread;

/// Standard deviations above which stiffness, damping and link friction are identifiable.
const TOLD: f64 = 3.0;
/// Default damping ratio if the motion does not determine one.
const USUAL_DAMPING: f64 = 0.03;

/// A gear with the standard deviations of its shapes.
pub(crate) struct Gear {
    pub(crate) kind: Kind,
    pub(crate) shapes: [f64; SHAPES],
    pub(crate) stds: [f64; SHAPES],
    /// Elasticity beside backlash: stiffness, damping and link friction share, each with its standard deviation.
    pub(crate) gives: Option<[[f64; 2]; 3]>,
}

impl Gear {
    pub(crate) fn values(&self) -> Vec<[f64; 2]> {
        let count = self.kind.about().shapes.len();
        (self.shapes.iter().zip(&self.stds).take(count))
            .map(|(value, std)| [*value, *std])
            .collect()
    }
}

impl TransmissionAnalysis<'_, '_> {
    /// Returns the gear that the coefficients represent; `None` without elasticity and backlash.
    pub(crate) fn gear(
        &self,
        solved: &Solved,
        base: &Fit,
        laws: &Laws,
        touch: Option<&Contact>,
    ) -> Option<Gear> {
        let equation = self.training;
        let usual = |stiffness: f64| {
            let damping = 2.0 * USUAL_DAMPING * (stiffness * equation.mass.max(0.0)).sqrt();
            [damping, f64::INFINITY]
        };
        let twist = laws.found.iter().any(|f| f.law == Law::Twist);
        if let Some(touch) = touch {
            let [stiffness, std] = touch.stiffness;
            let stiff = [
                stiffness,
                std.hypot(stiffness * self.of_the_load(base, solved)),
            ];
            let damping = Some(touch.damping)
                .filter(|[d, std]| *d > TOLD * std)
                .unwrap_or_else(|| usual(stiffness));
            let share = (equation.friction > 0.0)
                .then(|| touch.friction.map(|f| f / equation.friction))
                .map_or([0.0, f64::INFINITY], |[s, std]| [s.clamp(0.0, 1.0), std]);
            // Closed contacts are elastic too, but less.
            let mass = equation.mass.max(f64::MIN_POSITIVE);
            let swing = (stiffness / mass).sqrt() / std::f64::consts::TAU;
            return Some(Gear {
                kind: Kind::Backlash,
                shapes: [touch.gap[0], stiff[0], damping[0], share[0]],
                stds: [touch.gap[1], stiff[1], damping[1], share[1]],
                gives: (twist && swing < CLOSED_TEETH).then_some([stiff, damping, share]),
            });
        }
        if !twist {
            return None;
        }
        let of = |wanted: &dyn Fn(&Term) -> bool| solved.of(equation, wanted);
        let given = of(&|t| *t == Term::Load).filter(|[a, std]| *a > TOLD * std);
        let [compliance, told] = match given {
            Some([a, std]) => {
                let load = self.of_the_load(base, solved);
                [a, std.hypot(a * load)]
            }
            // Too stiff to identify: takes the least detectable stiffness.
            None => {
                let [a, std] = of(&|t| *t == Term::Load).unwrap_or([0.0, 0.0]);
                let least = equation.resolution / spread(equation, &equation.load);
                [(a + TOLD * std).max(least), f64::INFINITY]
            }
        };
        let stiffness = 1.0 / compliance;
        let stiffness_std = told * stiffness * stiffness;
        let damping = (of(&|t| *t == Term::Change))
            .map(|[c, std]| [-c * stiffness * stiffness, std * stiffness * stiffness])
            .filter(|[d, std]| *d > TOLD * std)
            .unwrap_or_else(|| usual(stiffness));
        let per_friction = stiffness / equation.friction.max(f64::MIN_POSITIVE);
        let share = (of(&|t| *t == Term::Direction))
            .map(|[c, std]| [(c * per_friction).clamp(0.0, 1.0), std * per_friction])
            .filter(|_| equation.friction > 0.0)
            .unwrap_or([0.0, f64::INFINITY]);
        Some(Gear {
            kind: Kind::JointElasticity,
            shapes: [stiffness, damping[0], share[0], 0.0],
            stds: [stiffness_std, damping[1], share[1], 0.0],
            gives: None,
        })
    }
}
