//! Reasons why an effect is refused.

/// Reason why a candidate of the search, or an effect found before, is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Refusal {
    /// This part of it is at the least that can be told from none.
    AtBound(&'static str),
    /// It may be chance.
    Significance {
        /// p-value, corrected for the trials.
        p: f64,
        /// Number of trials.
        trials: usize,
    },
    /// It removes too little of the residual's RMS. Both are shares from 0 to 1.
    Gain {
        /// Share that it removes.
        gain: f64,
        /// Least share.
        least: f64,
    },
    /// Its gain varies too much between blocks.
    Variation {
        /// Gain over its standard deviation.
        sigmas: f64,
    },
    /// Another candidate has the larger gain.
    SmallerThanAnother,
    /// Another law of its name has the larger gain.
    AnotherLaw,
    /// It was accepted, but does not stand beside all others.
    FellAgain,
    /// It closes less of the gap than stays open beside it.
    Guess,
    /// The simulated motion gets worse with it.
    WorseMotion,
    /// Its torque may be zero by the simulated motion.
    NothingByMotion,
    /// Its torque may be zero.
    Nothing,
    /// An elastic joint on which the arm would sag.
    Sags,
    /// A backlash without a significant gap.
    NoGap,
    /// Presliding without a significant stroke.
    NoStroke,
    /// A delay that other joints of the same recorder do not have.
    AnotherClock,
    /// A coupling of joints that are not neighbours.
    NotNeighbours,
    /// A coupling without a significant inertia.
    NoInertia,
    /// An encoder that is too far off its centre.
    FarOffCentre,
    /// A gear that changes more torque than mass and load of its link have.
    MoreThanTheLink,
    /// A gear that resonates beyond the band of the data.
    BeyondBand,
}
