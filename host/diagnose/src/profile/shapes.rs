//! Where a law's shapes are looked for.

use std::f64::consts::TAU;

use rig_shared::effects::{Kind, Parameter, SHAPES, Scale};

use crate::DiagnoseError;
use crate::across::CLOSED_TEETH;
use crate::columns::Candidate;
use crate::search::{Search, is_gear};
use rig_model::robot::{Joint, JointKind};

/// Points of a grid per decade of a logarithmic range.
const PER_DECADE: f64 = 4.0;
/// Steps of a grid over a linear range.
const LINEAR_STEPS: u32 = 8;
/// Stiffness (N·m/rad) and damping (N·m·s/rad) of teeth that the search for play begins with.
const SOFT_TEETH: [f64; 2] = [1500.0, 15.0];
/// A link does not swing slower on closed teeth, Hz. Softer ones bend to what a wide play does between two touches, as a spring with
/// a little play, and then nothing stands.
const SLOWEST_TEETH: f64 = 0.5 * CLOSED_TEETH;
/// A shape within this ratio, less one, of the least of what is searched has run there: two refinements' ends.
const AT_THE_END: f64 = 2.0 * FINE_ENOUGH;
/// Share of a joint's highest speed beyond which friction has fallen: the Stribeck velocities of lubricated contacts are tenths of it or
/// less (Armstrong-Hélouvry 1991).
const THROUGHOUT: f64 = 0.4;
/// A shape is known well enough within this ratio, less one, or this share of a linear range.
const FINE_ENOUGH: f64 = 0.01;

/// Where the search for a gear's shapes begins. With play the fit has a narrow ridge along gap and friction and many false
/// tops where contact chatters: teeth that are taken as soft and damped show the ridge alone.
fn starts(kind: Kind) -> Vec<[f64; SHAPES]> {
    let mut list = Vec::new();
    let shapes = kind.about().shapes;
    let [low, high] = shapes[0].range;
    const STEPS: usize = 11;
    for k in 0..=STEPS {
        let first = low * (high / low).powf(k as f64 / STEPS as f64);
        for share in [0.05, 0.25, 0.5, 0.9] {
            list.push(if kind == Kind::Backlash {
                [first, SOFT_TEETH[0], SOFT_TEETH[1], share]
            } else {
                // A few per cent of critical damping for a tenth of a kg·m².
                [first, 0.1 * (0.1 * first).sqrt(), share, 0.0]
            });
        }
    }
    list
}

/// Periods that the later stages of a gear, and the spokes of a torque sensor behind it, make in a turn of the joint. One would be gravity.
const OF_THE_JOINT: [f64; 5] = [2.0, 3.0, 4.0, 5.0, 6.0];

/// Grid of shapes of an effect on a joint.
pub(crate) fn grid_on(kind: Kind, joint: &Joint) -> Vec<[f64; SHAPES]> {
    let mut points = grid(kind);
    if kind == Kind::GearEccentricity && joint.kind == JointKind::Revolute {
        let later = OF_THE_JOINT.map(|periods| {
            let mut point = [0.0; SHAPES];
            point[0] = periods / joint.gear_ratio().abs();
            point
        });
        points.extend(
            later
                .into_iter()
                .filter(|p| !points.contains(p))
                .collect::<Vec<_>>(),
        );
    }
    points
}

/// Grid of shapes of an effect.
pub(crate) fn grid(kind: Kind) -> Vec<[f64; SHAPES]> {
    if is_gear(kind) {
        return starts(kind);
    }
    let shapes = kind.about().shapes;
    let mut points = vec![[0.0; SHAPES]];
    for (place, shape) in shapes.iter().enumerate() {
        let [low, high] = shape.range;
        let values: Vec<f64> = match shape.scale {
            Scale::Logarithmic => {
                let n = ((high / low).log10() * PER_DECADE / shapes.len() as f64)
                    .ceil()
                    .max(1.0);
                (0..=n as usize)
                    .map(|k| low * (high / low).powf(k as f64 / n))
                    .collect()
            }
            Scale::Linear => (0..=LINEAR_STEPS)
                .map(|k| low + (high - low) * f64::from(k) / f64::from(LINEAR_STEPS))
                .collect(),
            Scale::Whole => (0..=(high - low).floor() as u32)
                .map(|k| low + f64::from(k))
                .collect(),
        };
        points = points
            .into_iter()
            .flat_map(|point| {
                values.iter().map(move |v| {
                    let mut point = point;
                    point[place] = *v;
                    point
                })
            })
            .collect();
    }
    points
}

/// A shape's value as the search moves it: its logarithm where ratios count.
pub(super) fn coordinate(shape: &Parameter, value: f64) -> f64 {
    match shape.scale {
        Scale::Logarithmic => value.ln(),
        Scale::Linear | Scale::Whole => value,
    }
}

/// Where a refinement may go: beyond ten times its range a law is no longer told from its limit, nor is a distance below the
/// least that is `told`, nor a time constant beyond the time that the joints have been `running`, nor a velocity beyond a share of the
/// `fastest` that the joint reaches: what falls over all speeds bends to anything.
pub(super) fn searched(shape: &Parameter, told: f64, [running, fastest]: [f64; 2]) -> [f64; 2] {
    let ([low, high], [least, most]) = (shape.bounds, shape.range);
    match shape.scale {
        Scale::Logarithmic => {
            let told = if is_distance(shape) {
                told.min(most)
            } else {
                0.0
            };
            let most = if is_duration(shape) {
                running.max(least)
            } else if is_velocity(shape) {
                (10.0 * most).min((THROUGHOUT * fastest).max(least))
            } else {
                10.0 * most
            };
            [low.max(0.1 * least).max(told), high.min(most)]
        }
        Scale::Linear | Scale::Whole => [low, high],
    }
}

/// Whether friction falls as far up as it is looked for, of a joint that goes so fast at most.
pub(crate) fn falls_throughout(kind: Kind, shapes: &[f64; SHAPES], fastest: f64) -> bool {
    matches!(kind, Kind::Stribeck | Kind::StribeckExponential)
        && shapes[0] * (1.0 + AT_THE_END) > THROUGHOUT * fastest
}

/// The shape without which there is no effect, the first of each law, where it stands at the least of what is searched; of a
/// gear only play is one.
pub(super) fn vanished(kind: Kind, shapes: &[f64; SHAPES], told: f64) -> Option<&'static str> {
    let shape = kind.about().shapes.first()?;
    let least = (1.0 + AT_THE_END) * searched(shape, told, [f64::INFINITY; 2])[0];
    let counts = shape.scale == Scale::Logarithmic && (!is_gear(kind) || is_distance(shape));
    (counts && shapes[0] < least).then_some(shape.name)
}

/// Whether a shape is a way that the position shows.
pub(super) fn is_distance(shape: &Parameter) -> bool {
    shape.unit == "rad"
}

/// Whether a shape is a velocity.
fn is_velocity(shape: &Parameter) -> bool {
    shape.unit == "rad/s"
}

/// Whether a shape is a time that goes by.
fn is_duration(shape: &Parameter) -> bool {
    shape.unit == "s"
}

/// Whether a shape is a time constant that has run to the time that the joints have been `running`: what happens by a longer one
/// is a straight line, of which gain and time constant are one number.
pub(crate) fn is_straight(shape: &Parameter, value: f64, running: f64) -> bool {
    is_duration(shape) && value * (1.0 + AT_THE_END) > running
}

/// Whether one of a law's shapes is such a one.
pub(crate) fn goes_straight(kind: Kind, shapes: &[f64; SHAPES], running: f64) -> bool {
    let scales = kind.about().shapes.iter();
    (scales.zip(shapes)).any(|(shape, value)| is_straight(shape, *value, running))
}

/// The value there, within what physics allows.
pub(super) fn value_at(shape: &Parameter, coordinate: f64) -> f64 {
    let [low, high] = shape.bounds;
    match shape.scale {
        Scale::Logarithmic => coordinate.exp(),
        Scale::Linear | Scale::Whole => coordinate,
    }
    .clamp(low, high)
}

/// Distance of the grid's points along a coordinate of one of `count` shapes, and the one at which a refinement ends.
pub(super) fn spacing(shape: &Parameter, count: usize) -> [f64; 2] {
    let [low, high] = shape.range;
    match shape.scale {
        Scale::Logarithmic => [
            count as f64 / PER_DECADE * std::f64::consts::LN_10,
            FINE_ENOUGH,
        ],
        Scale::Linear | Scale::Whole => [
            (high - low) / f64::from(LINEAR_STEPS),
            FINE_ENOUGH * (high - low),
        ],
    }
}

impl Search<'_> {
    /// The least and the most that a candidate's shapes may be where that depends on the rig.
    ///
    /// A gear whose link would swing on it at more than half the rate of the rows is not believed (`engine::unbelieved`): up to that
    /// rate and its critical damping it is searched, and no further, where each sample would take many steps.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn ends(&self, candidate: &Candidate) -> Result<[[f64; SHAPES]; 2], DiagnoseError> {
        let [mut least, mut most] = [[f64::NEG_INFINITY; SHAPES], [f64::INFINITY; SHAPES]];
        let (true, Some(run)) = (is_gear(candidate.kind), self.source.runs.first()) else {
            return Ok([least, most]);
        };
        let mass = self.source.mass(candidate.joint, 0)?;
        let slowest = TAU * SLOWEST_TEETH;
        let fastest = (TAU / self.source.thinning.period(run.rate)).max(2.0 * slowest);
        for (place, shape) in candidate.kind.about().shapes.iter().enumerate() {
            if candidate.kind == Kind::Backlash && shape.name == "stiffness" {
                least[place] = slowest.powi(2) * mass;
            }
            match shape.name {
                "stiffness" if mass > 0.0 => most[place] = fastest.powi(2) * mass,
                "damping" if mass > 0.0 => most[place] = 2.0 * fastest * mass,
                _ => {}
            }
        }
        Ok([least, most])
    }

    /// A candidate's grid within its [`Self::ends`].
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn grid_within(
        &self,
        candidate: &Candidate,
    ) -> Result<Vec<[f64; SHAPES]>, DiagnoseError> {
        let [_, most] = self.ends(candidate)?;
        let within =
            |point: [f64; SHAPES]| std::array::from_fn(|place| point[place].min(most[place]));
        Ok(self.grid(candidate).into_iter().map(within).collect())
    }
}
