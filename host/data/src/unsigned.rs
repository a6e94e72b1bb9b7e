//! A signed register that was read as an unsigned one.
//!
//! A negative value x then lies far above all others. With k bits it reads as 2ᵏ + x in two's complement, and as 2ᵏ⁻¹ −
//! x if the highest bit is the sign. The values form two groups with a gap.
//!
//! Not detected: values that use more than half of the register's range, which leave no gap, and values filtered after
//! reading.

/// Minimum share of the rows in each group.
const BOTH: f64 = 0.02;
/// Minimum share of the range that the gap between the groups takes.
const GAP: f64 = 0.5;
/// Maximum ratio of the largest change at a change of sign to the largest change elsewhere, after the correction.
const JUMP: f64 = 2.0;
/// Possible numbers of bits of a register.
const BITS: std::ops::RangeInclusive<i32> = 7..=32;
/// Allowed relative deviation of the distance between the groups from a power of two counts.
const POWER_OF_TWO: f64 = 0.05;

/// Relative difference, to the highest value, below which two values are equal.
const ROUNDING: f64 = 1e-12;

/// How the sign was lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unsigned {
    /// Excess of the reading over a negative value (two's complement), or value of the sign bit.
    pub offset: f64,
    /// True if the highest bit is a sign; false for two's complement.
    pub sign_bit: bool,
    /// Share of the rows with a lost sign.
    pub share: f64,
}

/// Returns how `values` lost their sign; `None` if they did not.
pub(super) fn unsigned(values: &[f64]) -> Option<Unsigned> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (lowest, highest) = (*sorted.first()?, *sorted.last()?);
    if lowest < 0.0 || highest <= 0.0 {
        return None;
    }
    let gaps = || sorted.windows(2).map(|pair| pair[1] - pair[0]);
    let (below, gap) = (1..)
        .zip(gaps())
        .max_by(|a: &(usize, f64), b| a.1.total_cmp(&b.1))?;
    let above = sorted.len() - below;
    let least = BOTH * sorted.len() as f64;
    if gap < GAP * (highest - lowest) || (below as f64) < least || (above as f64) < least {
        return None;
    }
    // The smallest change above rounding is one count.
    let count = gaps()
        .filter(|by| *by > ROUNDING * highest)
        .fold(f64::INFINITY, f64::min);
    let first = sorted[below];
    let crosses = |pair: &[f64]| (pair[0] < first) != (pair[1] < first);
    let largest = |crossing: bool, signed: &dyn Fn(f64) -> f64| -> f64 {
        (values.windows(2).filter(|pair| crosses(pair) == crossing))
            .map(|pair| (signed(pair[1]) - signed(pair[0])).abs())
            .fold(0.0, f64::max)
    };
    // Values next to zero are one count away from the offset.
    let forms = [(false, highest + count), (true, first - count)];
    (forms
        .into_iter()
        .filter(|(_, offset)| is_register(offset / count)))
    .map(|(sign_bit, offset)| {
        let signed = |x: f64| match (x < first, sign_bit) {
            (true, _) => x,
            (_, true) => offset - x,
            (_, false) => x - offset,
        };
        let jump = largest(true, &signed) / largest(false, &signed).max(count);
        let share = above as f64 / values.len() as f64;
        (
            jump,
            Unsigned {
                offset,
                sign_bit,
                share,
            },
        )
    })
    .filter(|(jump, _)| *jump < JUMP)
    .min_by(|a, b| a.0.total_cmp(&b.0))
    .map(|(_, found)| found)
}

/// Returns true if a register can have this number of counts.
fn is_register(counts: f64) -> bool {
    BITS.into_iter()
        .any(|bits| (counts / f64::from(bits).exp2() - 1.0).abs() < POWER_OF_TWO)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn counts(amplitude: f64, noise: f64) -> Vec<i64> {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(11);
        (0..8000)
            .map(|k| {
                let t = f64::from(k) * 2e-3;
                let x = (2.0 * t).sin() + 0.4 * (7.3 * t).cos();
                (amplitude * x + noise * (rng.random::<f64>() - 0.5)).round() as i64
            })
            .collect()
    }

    #[test]
    fn lost_signs_are_found_in_registers_of_any_width() {
        for (bits, amplitude, scale) in [
            (16, 900.0, 2.69e-3),
            (12, 300.0, 0.01),
            (32, 5e5, 1e-6),
            (16, 4000.0, 0.05),
        ] {
            let full = 1_i64 << bits;
            for noise in [2.0, 0.05 * amplitude] {
                let own = counts(amplitude, noise);
                let twos: Vec<f64> = own
                    .iter()
                    .map(|c| c.rem_euclid(full) as f64 * scale)
                    .collect();
                let found = unsigned(&twos).unwrap();
                assert!(!found.sign_bit, "{bits} {noise}");
                assert!((found.offset / (full as f64 * scale) - 1.0).abs() < 0.01);
                assert!((0.2..0.8).contains(&found.share));
                let sign: Vec<f64> = (own.iter())
                    .map(|c| if *c < 0 { full / 2 - c } else { *c } as f64 * scale)
                    .collect();
                let found = unsigned(&sign).unwrap();
                assert!(found.sign_bit, "{bits} {noise}");
                assert!((found.offset / (full as f64 / 2.0 * scale) - 1.0).abs() < 0.01);
            }
        }
    }

    #[test]
    fn signed_values_magnitudes_and_steps_are_none() {
        let own = counts(900.0, 5.0);
        let signed: Vec<f64> = own.iter().map(|c| *c as f64 * 2.69e-3).collect();
        let magnitude: Vec<f64> = signed.iter().map(|x| x.abs()).collect();
        // A load that acts on the joint for half of the time.
        let steps: Vec<f64> = (signed.iter().enumerate())
            .map(|(k, x)| 0.1 * x.abs() + if (k / 1000) % 2 == 0 { 0.0 } else { 7.0 })
            .collect();
        for values in [signed, magnitude, steps] {
            assert_eq!(unsigned(&values), None);
        }
    }
}
