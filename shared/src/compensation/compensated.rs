//! One effect that has passed its checks.

use super::effect_fault::EffectFault;
use super::role::Role;
use crate::effects::{Effect, Instant, Memory, Parameter, Scale};
use crate::precompensation::{direction, finite};
use crate::scalar::{Real, Scalar};

/// A slow and a fast speed, rad/s. Their comparison shows if an effect falls with speed.
const SPEEDS: [f64; 2] = [1e-3, 10.0];

/// A checked effect with derived properties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Compensated<T> {
    pub(super) effect: Effect<T>,
    pub(super) role: Role,
    /// True if all shapes are whole. The motor's angle within a turn then suffices, and has less rounding error.
    pub(super) whole: bool,
    /// True if the effect is smaller at high speed than at low speed.
    pub(super) falls_with_speed: bool,
}

impl<T: Scalar> Compensated<T> {
    /// Checks an effect.
    ///
    /// # Errors
    /// Returns the fault of the effect.
    pub(super) fn new(effect: Effect<T>) -> Result<Self, EffectFault> {
        let kind = effect.kind;
        let role = Role::of(kind).ok_or(EffectFault::NotCompensable(kind))?;
        let about = kind.about();
        check_bounds(about.gains, &effect.gains, false)?;
        check_bounds(about.shapes, &effect.shapes, true)?;
        let whole = |shape: &T| shape.to_f64() as i64 as f64 == shape.to_f64();
        let sliding = |speed: f64| {
            let at = Instant {
                velocity: T::from_f64(speed),
                direction: T::ONE,
                load: T::ONE,
                ..Instant::default()
            };
            evaluate(&effect, &mut Memory::default(), &at).abs()
        };
        Ok(Self {
            effect,
            role,
            whole: effect.shapes.iter().all(whole),
            falls_with_speed: sliding(SPEEDS[1]).lt(sliding(SPEEDS[0])),
        })
    }

    /// Sets the velocity and the direction of the planned motion at which the law is evaluated, from those of the
    /// reference (`planned`) and of the link (`measured`), rad/s. `velocity_threshold` is that of the friction law.
    #[inline(always)]
    pub(super) fn plan(
        &self,
        instant: &mut Instant<T>,
        velocity_threshold: T,
        planned: T,
        measured: T,
    ) {
        let dry = self.role == Role::DryFriction;
        let ahead = planned.abs().lt(measured.abs());
        // The faster speed, in the reference's direction.
        let backwards = planned.lt(T::ZERO);
        let faster = T::select(backwards, -measured.abs(), measured.abs());
        instant.velocity = if dry && self.falls_with_speed && ahead {
            faster
        } else {
            planned
        };
        instant.direction = if dry {
            direction(planned, measured, velocity_threshold)
        } else {
            planned.sgn()
        };
    }
}

/// Returns the value of an effect that is not periodic. Not inlined: the code of all laws is then stored only once.
#[inline(never)]
pub(super) fn evaluate<T: Real>(effect: &Effect<T>, memory: &mut Memory<T>, at: &Instant<T>) -> T {
    let terms = effect
        .kind
        .compensated_terms(&effect.shapes, &mut memory.0, at);
    let sum = effect
        .gains
        .iter()
        .zip(terms)
        .fold(T::ZERO, |sum, (gain, term)| sum + *gain * term);
    finite(sum)
}

/// Checks the bounds of parameters. With `divided` the lower bound of a logarithmic parameter is excluded: the law
/// divides by it.
fn check_bounds<T: Scalar>(
    parameters: &[Parameter],
    values: &[T],
    divided: bool,
) -> Result<(), EffectFault> {
    for (k, value) in values.iter().enumerate() {
        let value = value.to_f64();
        let Some(parameter) = parameters.get(k) else {
            if value == 0.0 {
                continue;
            }
            return Err(EffectFault::Surplus);
        };
        let [low, high] = parameter.bounds;
        let open = divided && parameter.scale == Scale::Logarithmic;
        let above = if open { low < value } else { low <= value };
        if !(above && value <= high && value.is_finite()) {
            return Err(EffectFault::Parameter(parameter.name));
        }
    }
    Ok(())
}
