//! Limits as penalties with multipliers.

/// Share of each limit that the optimiser keeps free for peaks between its samples. With 48 samples per period of the
/// fastest harmonic, such a peak adds at most (π/48)²/2 = 0.2 % of that harmonic's amplitude.
pub(super) const MARGIN: f64 = 0.003;

/// Purpose of a pass over the constraints.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Pass {
    /// Adds penalties and their derivatives.
    Penalise,
    /// Updates the multipliers.
    Renew,
}

/// Returns the penalty of one constraint c ≤ 0 with its multiplier, and its derivative by c.
pub(super) fn penalty(c: f64, multiplier: &mut f64, weight: f64, pass: Pass) -> (f64, f64) {
    if pass == Pass::Renew {
        *multiplier = (*multiplier + weight * c).max(0.0);
        return (0.0, 0.0);
    }
    let idle = -0.5 * *multiplier * *multiplier / weight;
    let active = c + *multiplier / weight;
    if active > 0.0 {
        (idle + 0.5 * weight * active * active, weight * active)
    } else {
        (idle, 0.0)
    }
}

/// Penalises both sides of |away| ≤ limit·keep.
pub(super) fn both_sides(
    share: f64,
    multipliers: &mut [f64; 2],
    weight: f64,
    pass: Pass,
) -> (f64, f64) {
    let keep = 1.0 - MARGIN;
    let [above, below] = multipliers;
    let (up, force_up) = penalty(share - keep, above, weight, pass);
    let (down, force_down) = penalty(-share - keep, below, weight, pass);
    (up + down, force_up - force_down)
}
