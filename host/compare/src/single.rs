//! One parameter over several sets: spread within and between, and the test of equality.

use crate::significance::f_p;

/// Value of a parameter in one set.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Single {
    /// Value.
    pub value: f64,
    /// Variance.
    pub variance: f64,
    /// Degrees of freedom of the variance.
    pub freedom: f64,
}

/// Spread of a parameter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spread {
    /// Cochran's Q.
    pub q: f64,
    /// Probability of a Q at least as large by chance.
    pub p: f64,
    /// Typical variance within a set.
    pub within: f64,
    /// Variance between sets.
    pub between: f64,
}

/// Values weighted by their inverse variances.
struct Weighted {
    weights: Vec<f64>,
    sum: f64,
    /// Sum of the squared weights.
    squares: f64,
    /// Weighted squares about the weighted mean.
    about: f64,
}

impl Weighted {
    /// Weighs `list`, with the variance `between` sets in addition to each own.
    fn of(list: &[Single], between: f64) -> Self {
        let weights: Vec<f64> = (list.iter())
            .map(|s| 1.0 / (s.variance + between))
            .collect();
        let (sum, squares) = (weights.iter()).fold((0.0, 0.0), |(s, q), w| (s + w, q + w * w));
        let pairs = || list.iter().zip(&weights);
        let mean = pairs().map(|(s, w)| w * s.value).sum::<f64>() / sum;
        let about = pairs().map(|(s, w)| w * (s.value - mean).powi(2)).sum();
        Self {
            weights,
            sum,
            squares,
            about,
        }
    }
}

/// Returns the spread of a parameter over two or more sets.
///
/// Between sets: the moment estimator of DerSimonian and Laird (1986). Within: the typical variance of Higgins and
/// Thompson (2002, eq. 9). The test is Cochran's Q, with Welch's correction (1951, "On the comparison of several mean
/// values") for variances that are estimated themselves.
pub(crate) fn spread(list: &[Single]) -> Spread {
    let n = list.len() as f64;
    let Weighted {
        weights,
        sum,
        squares,
        about: q,
    } = Weighted::of(list, 0.0);
    let lost: f64 = (list.iter().zip(&weights))
        .map(|(s, w)| (1.0 - w / sum).powi(2) / s.freedom)
        .sum();
    let f = q / (n - 1.0) / (1.0 + 2.0 * (n - 2.0) / (n * n - 1.0) * lost);
    Spread {
        q,
        p: f_p(f, [n - 1.0, (n * n - 1.0) / (3.0 * lost)]),
        within: (n - 1.0) * sum / (sum * sum - squares),
        between: ((q - (n - 1.0)) / (sum - squares / sum)).max(0.0),
    }
}

/// Returns the standard error of the mean of a parameter from the scatter of the sets (Hartung and Knapp 2001), and its
/// degrees of freedom: the effective number of sets (Kish 1965) minus one, 1 at least. `between` is the variance between
/// sets. None for one set.
pub(crate) fn scatter(list: &[Single], between: f64) -> Option<[f64; 2]> {
    if list.len() < 2 {
        return None;
    }
    let Weighted {
        sum,
        squares,
        about,
        ..
    } = Weighted::of(list, between);
    let freedom = (sum * sum / squares - 1.0).max(1.0);
    Some([(about / ((list.len() - 1) as f64 * sum)).sqrt(), freedom])
}
