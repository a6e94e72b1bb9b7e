//! Evidence for candidate columns: gain, significance, errors block by block.

use rig_numerics::statistics::squares_about;

/// Evidence for candidate columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Evidence {
    /// Coefficients of the columns.
    pub(crate) gains: Vec<f64>,
    /// Their standard deviations, robust to correlation within blocks.
    pub(crate) stds: Vec<f64>,
    /// Share of the residual's squares that they explain.
    pub(crate) explained: f64,
    /// Share of the RMS that they remove on folds outside their fit.
    pub(crate) gain: f64,
    /// The same for the joint with the largest share: a single joint is a small part of all joints together.
    pub(crate) joint_gain: f64,
    /// The gain over its standard deviation between blocks.
    pub(crate) gain_sigmas: f64,
    /// p-value of all coefficients being zero, uncorrected.
    pub(crate) p_value: f64,
    /// Squared error of each block without and with them, on folds outside the fit.
    pub(crate) block_errors: Vec<[f64; 2]>,
}

impl Evidence {
    /// Returns the p-value corrected for `tried` trials (Bonferroni).
    pub(crate) fn corrected(&self, tried: usize) -> f64 {
        (self.p_value * tried as f64).min(1.0)
    }

    /// Returns the share of the RMS left by `simpler` that this one also removes, in the joint with the largest gain.
    pub(crate) fn beyond(&self, simpler: &Self) -> f64 {
        1.0 - (1.0 - self.joint_gain) / (1.0 - simpler.joint_gain).max(f64::MIN_POSITIVE)
    }

    /// Returns the standard deviations by which improved blocks outnumber others (the sign test, Arbuthnott 1710).
    pub(crate) fn sign_sigmas(&self) -> f64 {
        let signs: Vec<f64> = (self.taken())
            .filter(|taken| *taken != 0.0)
            .map(f64::signum)
            .collect();
        signs.iter().sum::<f64>() / (signs.len().max(1) as f64).sqrt()
    }

    /// Returns the squares that they remove, block by block.
    pub(crate) fn taken(&self) -> impl Iterator<Item = f64> {
        (self.block_errors.iter()).map(|[without, with]| without - with)
    }

    /// Returns the standard deviations of the paired block differences by which this one leaves less than the other.
    pub(crate) fn ahead_of(&self, other: &Self) -> f64 {
        let differences: Vec<f64> = (self.block_errors.iter().zip(&other.block_errors))
            .map(|(a, b)| b[1] - a[1])
            .collect();
        sigmas(&differences)
    }
}

/// Returns the mean over its standard deviation between blocks.
pub(crate) fn sigmas(blocks: &[f64]) -> f64 {
    let n = blocks.len().max(2) as f64;
    let mean = blocks.iter().sum::<f64>() / n;
    let spread = squares_about(blocks, mean) / (n - 1.0);
    mean / (spread / n).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_beside_another_counts_by_what_that_one_leaves() {
        let of = |joint_gain| Evidence {
            joint_gain,
            ..Evidence::default()
        };
        // Of a residual of 10 %, one point more is a tenth; of 90 % it is almost nothing.
        assert!((of(0.91).beyond(&of(0.90)) - 0.1).abs() < 1e-12);
        assert!((of(0.11).beyond(&of(0.10)) - 1.0 / 90.0).abs() < 1e-12);
    }

    #[test]
    fn many_blocks_that_agree_count_beside_one_that_is_loud() {
        let of = |block_errors: Vec<[f64; 2]>| Evidence {
            block_errors,
            ..Evidence::default()
        };
        // A small gain in every block, and one loud block.
        let mut agree: Vec<[f64; 2]> = (0..60).map(|_| [1.0, 0.8]).collect();
        agree.push([500.0, 450.0]);
        assert!(of(agree).sign_sigmas() > 7.0);
        // The same total gain in one block. Unchanged blocks have no vote.
        let mut one = vec![[1.0, 1.0]; 60];
        one.push([500.0, 450.0]);
        assert!(of(one).sign_sigmas() <= 1.0);
        let either: Vec<[f64; 2]> = (0..60)
            .map(|k| [1.0, if k % 2 == 0 { 0.5 } else { 1.1 }])
            .collect();
        assert!(of(either).sign_sigmas().abs() < 1e-12);
        assert!(of(Vec::new()).sign_sigmas().abs() < 1e-12);
    }
}
