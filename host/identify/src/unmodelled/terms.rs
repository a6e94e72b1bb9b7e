//! Regressor columns beyond the description's parameters.

/// Periods per turn of the joint that are searched for ripple. One period is gravity's.
pub(crate) const PERIODS: std::ops::RangeInclusive<usize> = 2..=6;
/// Columns of a joint: its position, cosine and sine of each ripple, then a base tilt about two axes.
pub(crate) const TERMS: usize = 1 + 2 * (*PERIODS.end() + 1 - *PERIODS.start()) + 2;

/// A candidate term.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Term {
    /// Spring or ripple of a joint.
    Position {
        joint: usize,
        periods: Option<usize>,
    },
    /// Base tilt, acting on all joints.
    Tilt,
}

impl Term {
    /// Returns the range of its columns among [`TERMS`].
    pub(crate) fn columns(self) -> std::ops::Range<usize> {
        match self {
            Self::Position { periods: None, .. } => 0..1,
            Self::Position {
                periods: Some(periods),
                ..
            } => {
                let first = 1 + 2 * (periods - PERIODS.start());
                first..first + 2
            }
            Self::Tilt => TERMS - 2..TERMS,
        }
    }

    pub(crate) fn is_spring(self) -> bool {
        matches!(self, Self::Position { periods: None, .. })
    }

    /// Returns true if joint `j` has its columns.
    pub(crate) fn at(self, j: usize) -> bool {
        match self {
            Self::Position { joint, .. } => joint == j,
            Self::Tilt => true,
        }
    }
}

/// Computes the columns of a term at position `q`; fills one or two.
pub(crate) fn terms_of(periods: Option<usize>, q: f64, out: &mut [f64]) -> usize {
    match periods {
        None => {
            out[0] = q;
            1
        }
        Some(periods) => {
            let (sine, cosine) = (periods as f64 * q).sin_cos();
            (out[0], out[1]) = (cosine, sine);
            2
        }
    }
}
