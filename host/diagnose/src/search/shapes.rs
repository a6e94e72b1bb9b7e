//! Search ranges of shapes.

use rig_shared::effects::{Kind, Parameter, SHAPES, Scale};

use crate::columns::kinds::is_gear;
use rig_model::robot::{Joint, JointKind};

/// Grid points per decade of a logarithmic range.
const PER_DECADE: f64 = 4.0;
/// Grid steps over a linear range.
const LINEAR_STEPS: u32 = 8;
/// Initial tooth stiffness (N·m/rad) and damping (N·m·s/rad) of the search for backlash.
const SOFT_TEETH: [f64; 2] = [1500.0, 15.0];
/// Ratio to the lower search bound, less one, within which a shape is at the bound: twice the refinement tolerance.
const AT_THE_END: f64 = 2.0 * FINE_ENOUGH;
/// Share of a joint's highest speed beyond which Stribeck friction has fallen. For lubricated contacts the Stribeck
/// velocity is tenths of that speed or less (Armstrong-Hélouvry 1991).
const THROUGHOUT: f64 = 0.4;
/// Refinement tolerance of a shape: a ratio, less one, or a share of a linear range.
const FINE_ENOUGH: f64 = 0.01;

/// Returns initial shapes of a gear. With backlash, the fit has a narrow ridge along gap and friction, and many false
/// maxima from contact chatter. Soft, damped teeth show only the ridge.
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
                // A few per cent of critical damping for 0.1 kg·m².
                [first, 0.1 * (0.1 * first).sqrt(), share, 0.0]
            });
        }
    }
    list
}

/// Periods per joint turn of the later gear stages, and of a torque sensor's spokes. One period would be gravity.
const OF_THE_JOINT: [f64; 5] = [2.0, 3.0, 4.0, 5.0, 6.0];

/// Returns the grid of an effect's shapes on a joint.
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

/// Returns the grid of an effect's shapes.
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

/// Returns a shape's search coordinate: its logarithm if it is log-scaled.
pub(crate) fn coordinate(shape: &Parameter, value: f64) -> f64 {
    match shape.scale {
        Scale::Logarithmic => value.ln(),
        Scale::Linear | Scale::Whole => value,
    }
}

/// Returns the search range of a shape. Beyond ten times its range, a law equals its limit. A distance must be at least
/// `told`, a time constant at most the operating time `running`. A velocity is at most a share of `fastest`: friction
/// that falls over all speeds fits anything.
pub(crate) fn searched(shape: &Parameter, told: f64, [running, fastest]: [f64; 2]) -> [f64; 2] {
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

/// Returns true if Stribeck friction falls up to its search bound, for a joint with this highest speed.
pub(crate) fn falls_throughout(kind: Kind, shapes: &[f64; SHAPES], fastest: f64) -> bool {
    matches!(kind, Kind::Stribeck | Kind::StribeckExponential)
        && shapes[0] * (1.0 + AT_THE_END) > THROUGHOUT * fastest
}

/// Returns the first shape of a law if it is at its lower search bound: then there is no effect. For gears this applies
/// only to a backlash gap.
pub(crate) fn at_bound(kind: Kind, shapes: &[f64; SHAPES], told: f64) -> Option<&'static str> {
    let shape = kind.about().shapes.first()?;
    let least = (1.0 + AT_THE_END) * searched(shape, told, [f64::INFINITY; 2])[0];
    let counts = shape.scale == Scale::Logarithmic && (!is_gear(kind) || is_distance(shape));
    (counts && shapes[0] < least).then_some(shape.name)
}

/// Returns true if a shape is a distance in the position.
pub(crate) fn is_distance(shape: &Parameter) -> bool {
    shape.unit == "rad"
}

/// Returns true if a shape is a velocity.
fn is_velocity(shape: &Parameter) -> bool {
    shape.unit == "rad/s"
}

/// Returns true if a shape is a duration.
fn is_duration(shape: &Parameter) -> bool {
    shape.unit == "s"
}

/// Returns true if a shape is a time constant that reached the operating time `running`. Beyond it the law is a
/// straight line, with gain and time constant collinear.
pub(crate) fn is_straight(shape: &Parameter, value: f64, running: f64) -> bool {
    is_duration(shape) && value * (1.0 + AT_THE_END) > running
}

/// Returns true if one of a law's shapes is such a time constant.
pub(crate) fn goes_straight(kind: Kind, shapes: &[f64; SHAPES], running: f64) -> bool {
    let scales = kind.about().shapes.iter();
    (scales.zip(shapes)).any(|(shape, value)| is_straight(shape, *value, running))
}

/// Returns the value at a search coordinate, within the physical bounds.
pub(crate) fn value_at(shape: &Parameter, coordinate: f64) -> f64 {
    let [low, high] = shape.bounds;
    match shape.scale {
        Scale::Logarithmic => coordinate.exp(),
        Scale::Linear | Scale::Whole => coordinate,
    }
    .clamp(low, high)
}

/// Returns the grid spacing along the coordinate of one of `count` shapes, and the tolerance of its refinement.
pub(crate) fn spacing(shape: &Parameter, count: usize) -> [f64; 2] {
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
