//! The test whether all parameters are the same in all sets.

use crate::common::Common;
use crate::result::JointTest;
use crate::significance::{TEST_LEVEL, chi2_p};

/// Tests all parameters that every set shows; none if there are none.
pub(crate) fn joint_test(common: &Common) -> Option<JointTest> {
    if common.parameters.is_empty() {
        return None;
    }
    let (_, chi2) = common.about_mean(&common.weights)?;
    Some(tested(chi2, common.freedom()))
}

/// Returns the test of a sum of squares.
fn tested(chi2: f64, degrees_of_freedom: usize) -> JointTest {
    let p = chi2_p(chi2, degrees_of_freedom);
    JointTest {
        chi2,
        degrees_of_freedom,
        p,
        differs: p < TEST_LEVEL,
    }
}

/// Tests, for each set, all the others; empty for two sets.
pub(crate) fn without(common: &Common) -> Vec<JointTest> {
    let n = common.values.len();
    if n < 3 || common.parameters.is_empty() {
        return Vec::new();
    }
    (0..n)
        .filter_map(|s| {
            let freedom = common.parameters.len() * (n - 2);
            Some(tested(common.about_mean_without(s)?, freedom))
        })
        .collect()
}
