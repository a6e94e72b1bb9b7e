//! One effect with its parameters, and its hidden state.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::instant::Instant;
use super::kind::Kind;
use super::law::{GAINS, MEMORY, SHAPES};
use crate::scalar::Real;

/// One effect with its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Effect<T> {
    /// The kind.
    pub kind: Kind,
    /// In the order of [`About::gains`](super::About::gains); the others are 0.
    pub gains: [T; GAINS],
    /// In the order of [`About::shapes`](super::About::shapes); the others are 0.
    pub shapes: [T; SHAPES],
}

/// Hidden state of one effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory<T>(pub [T; MEMORY]);

impl<T: Real> Default for Memory<T> {
    fn default() -> Self {
        Self([T::ZERO; MEMORY])
    }
}

impl<T: Real> Effect<T> {
    /// Returns an effect with `gains` and `shapes` in the order of [`About`](super::About); the others are 0. Values beyond
    /// [`GAINS`] and [`SHAPES`] are ignored.
    pub fn new(kind: Kind, gains: &[T], shapes: &[T]) -> Self {
        let value = |list: &[T], k: usize| list.get(k).copied().unwrap_or(T::ZERO);
        Self {
            kind,
            gains: core::array::from_fn(|k| value(gains, k)),
            shapes: core::array::from_fn(|k| value(shapes, k)),
        }
    }

    /// Returns the drive torque due to the effect, N·m, and advances the hidden state by one period.
    #[inline(always)]
    pub fn torque(&self, memory: &mut Memory<T>, at: &Instant<T>) -> T {
        let terms = self.kind.terms(&self.shapes, &mut memory.0, at);
        self.gains
            .iter()
            .zip(terms)
            .fold(T::ZERO, |sum, (gain, term)| sum + *gain * term)
    }

    /// Returns the hidden state after a gap of `seconds`, as in a recording. Heat decays as in a joint at rest, and a
    /// memory of distance is reset.
    pub fn after_pause(&self, mut memory: Memory<T>, seconds: T) -> Memory<T> {
        self.kind.after_pause(&self.shapes, &mut memory.0, seconds);
        memory
    }
}
