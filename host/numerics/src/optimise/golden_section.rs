//! Search for the maximum along one variable by golden section (Kiefer 1953).
//!
//! By hand: a dozen lines, with a function that may fail.

/// Narrows the interval from `low` to `high` around the maximum of `function`, by at most `steps` steps and until it is
/// shorter than `fine`. The caller keeps the best of the points that `function` sees.
///
/// # Errors
/// The first error of `function`.
pub fn golden_section<E>(
    [mut low, mut high]: [f64; 2],
    steps: usize,
    fine: f64,
    mut function: impl FnMut(f64) -> Result<f64, E>,
) -> Result<(), E> {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
    let (mut fa, mut fb) = (function(a)?, function(b)?);
    for _ in 0..steps {
        if fa > fb {
            (high, b, fb) = (b, a, fa);
            a = high - golden * (high - low);
            fa = function(a)?;
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + golden * (high - low);
            fb = function(b)?;
        }
        if high - low < fine {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_maximum_is_found_to_the_width_asked_for() {
        let mut best = [f64::NEG_INFINITY, 0.0];
        let done = golden_section([-1.0, 2.0], 50, 1e-4, |x| {
            let value = -(x - 0.3_f64).powi(2);
            if value > best[0] {
                best = [value, x];
            }
            Ok::<_, ()>(value)
        });
        assert!(done.is_ok() && (best[1] - 0.3).abs() < 1e-4, "{best:?}");
        assert_eq!(golden_section([0.0, 1.0], 5, 0.0, |_| Err(7)), Err(7));
    }
}
