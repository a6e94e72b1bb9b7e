//! Sums of a residual over the bins of a coordinate.

/// Number of bins with equal row counts.
pub(crate) const BINS: usize = 24;

/// Share of the explained squares within the reported interval.
const MOST_OF_IT: f64 = 0.75;

/// Sums of one coordinate, bin by bin.
pub(crate) struct Process {
    /// Of the residual, block by block.
    pub(crate) sums: Vec<[f64; BINS]>,
    /// Of the components that a refit removes, direction by direction.
    pub(crate) taken: Vec<[f64; BINS]>,
}

/// Returns the shortest range of bins with most of the explained squares.
pub(crate) fn narrowest(explained: &[f64; BINS], all: f64) -> (usize, usize) {
    let mut best = (0, BINS - 1);
    for low in 0..BINS {
        let mut sum = 0.0;
        for (high, e) in explained.iter().enumerate().skip(low) {
            sum += e;
            if sum >= MOST_OF_IT * all {
                if high - low < best.1 - best.0 {
                    best = (low, high);
                }
                break;
            }
        }
    }
    best
}
