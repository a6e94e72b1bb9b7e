//! Comparisons of a value with its bound. A value that is not finite is a [`Refusal::BadValue`].

use rig_shared::wire::message::{Bounded, Refusal};

fn hold(quantity: Bounded, value: f32, bound: f32, holds: bool) -> Result<(), Refusal> {
    if !value.is_finite() {
        Err(Refusal::BadValue)
    } else if holds {
        Ok(())
    } else {
        Err(Refusal::OutOfBounds {
            quantity,
            value,
            bound,
        })
    }
}

/// Refuses a value above its bound.
#[inline(never)]
pub(crate) fn at_most(quantity: Bounded, value: f32, bound: f32) -> Result<(), Refusal> {
    hold(quantity, value, bound, value <= bound)
}

/// Refuses a value below its bound.
#[inline(never)]
pub(crate) fn at_least(quantity: Bounded, value: f32, bound: f32) -> Result<(), Refusal> {
    hold(quantity, value, bound, value >= bound)
}

/// Refuses a value that is not above 0, the bound that is told.
pub(crate) fn positive(quantity: Bounded, value: f32) -> Result<(), Refusal> {
    hold(quantity, value, 0.0, value > 0.0)
}
