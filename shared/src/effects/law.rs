//! What each effect gives: its description and its equations.

use super::about::{About, Periodic};
use super::instant::Instant;
use crate::scalar::Real;

/// Maximum number of gains of an effect.
pub const GAINS: usize = 4;
/// Maximum number of shapes of an effect.
pub const SHAPES: usize = 4;
/// Maximum number of hidden states of an effect.
pub const MEMORY: usize = 4;

/// Returns cosine and sine of order times angle, as terms for [`Law::terms`].
#[inline(always)]
pub(super) fn wave<T: Real>(order: T, angle: T) -> [T; GAINS] {
    let (sine, cosine) = (order * angle).sin_cos();
    [cosine, sine, T::ZERO, T::ZERO]
}

/// The equations of one effect.
pub(super) trait Law {
    /// The description.
    const ABOUT: About;
    /// The angle of a sinusoidal effect.
    const PERIODIC: Option<Periodic> = None;
    /// Names of the shapes that a description may leave out; they are then 0.
    const OPTIONAL: &'static [&'static str] = &[];

    /// Returns the torque per unit of each gain, N·m, and advances the hidden state by one period. States start at 0.
    fn terms<T: Real>(
        shapes: &[T; SHAPES],
        memory: &mut [T; MEMORY],
        at: &Instant<T>,
    ) -> [T; GAINS];

    /// Advances the hidden state over a gap of `_seconds`, s. By default it is reset.
    fn after_pause<T: Real>(_shapes: &[T; SHAPES], memory: &mut [T; MEMORY], _seconds: T) {
        *memory = [T::ZERO; MEMORY];
    }
}
