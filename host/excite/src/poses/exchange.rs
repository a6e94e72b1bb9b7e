//! D-optimal choice of poses by exchange (Fedorov 1972; Meyer and Nachtsheim 1995).

use rand::RngExt;
use rand_pcg::Pcg64;

use super::information::Sums;
use super::space::Pose;

/// Number of random first choices.
const STARTS: usize = 12;
/// Largest number of passes over all poses; the choice converges in fewer than ten.
const PASSES: usize = 30;
/// Gain in the logarithm of the determinant below which an exchange is not worth it: rounding.
const GAIN: f64 = 1e-9;

/// Returns the indices of the `count` candidates with the largest determinant of the information.
pub(super) fn best_choice(candidates: &[Pose], count: usize, random: &mut Pcg64) -> Vec<usize> {
    let mut best: Option<(f64, Vec<usize>)> = None;
    for _ in 0..STARTS {
        let first = (0..count).map(|_| random.random_range(0..candidates.len()));
        let (value, choice) = improved(candidates, first.collect());
        if best.as_ref().is_none_or(|(most, _)| value > *most) {
            best = Some((value, choice));
        }
    }
    best.map_or_else(Vec::new, |(_, choice)| choice)
}

/// Exchanges one pose after the other for the best candidate until nothing is gained.
fn improved(candidates: &[Pose], mut choice: Vec<usize>) -> (f64, Vec<usize>) {
    let mut sums = Sums::of(choice.iter().map(|k| candidates[*k].gravity));
    let mut value = sums.log_determinant();
    for _ in 0..PASSES {
        let mut gained = false;
        for own in &mut choice {
            let old = candidates[*own].gravity;
            for (k, candidate) in candidates.iter().enumerate() {
                let changed = sums.exchanged(old, candidate.gravity);
                let other = changed.log_determinant();
                if other > value + GAIN {
                    (value, *own, gained) = (other, k, true);
                }
            }
            sums = sums.exchanged(old, candidates[*own].gravity);
        }
        if !gained {
            break;
        }
    }
    (value, choice)
}
