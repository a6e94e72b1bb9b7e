//! Clauses on why an effect is refused.

use crate::search::refusal::Refusal;

/// Returns the reason for a refusal, a clause.
pub(crate) fn refusal(why: &Refusal) -> String {
    let words = match why {
        Refusal::AtBound(part) => {
            return format!("its {part} goes to the least that can be told from none");
        }
        Refusal::Significance { p, trials } => {
            return format!("p = {p:.2}, corrected for {trials} trials");
        }
        Refusal::Gain { gain, least } => {
            return format!(
                "takes away {:.1} % of the residual, less than {:.0} %",
                100.0 * gain,
                100.0 * least
            );
        }
        Refusal::Variation { sigmas } => {
            return format!("its gain is only {sigmas:.1} of its standard deviations");
        }
        Refusal::SmallerThanAnother => "another takes away more",
        Refusal::AnotherLaw => "another law of that name does better",
        Refusal::FellAgain => {
            "fell again: beside all others it takes too little away, or another name takes as much"
        }
        Refusal::Guess => {
            "closes less of the gap than stays open beside it, and may be a guess at what has no name"
        }
        Refusal::WorseMotion => "explains torque, but the simulated motion gets worse with it",
        Refusal::NothingByMotion => {
            "fitted to the simulated motion as well, it could as well be nothing"
        }
        Refusal::Nothing => "by its own deviation it could as well be nothing",
        Refusal::Sags => {
            "the arm would sag on it by more than 20 mrad under its own load, and no arm that is not described so is as soft"
        }
        Refusal::NoGap => "its gap is less than two of its standard deviations",
        Refusal::NoStroke => "its stroke is less than two of its standard deviations",
        Refusal::AnotherClock => {
            "other joints of the same recorder do not have that delay, and one recorder has one clock"
        }
        Refusal::NotNeighbours => {
            "the two joints are not neighbours, and drives are coupled between neighbours only (wrists, parallelograms)"
        }
        Refusal::NoInertia => {
            "what it takes away goes with the other joint's speed alone, and no inertia is shown"
        }
        Refusal::FarOffCentre => "its encoder would have to be farther off its centre than any is",
        Refusal::MoreThanTheLink => {
            "it would change more torque than mass and load of the link have"
        }
        Refusal::BeyondBand => {
            "it would resonate beyond the band of the data, where other laws of fast motion look alike"
        }
    };
    words.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_reason_says_what_is_wrong() {
        for (why, words) in [
            (Refusal::MoreThanTheLink, "mass and load"),
            (Refusal::BeyondBand, "band"),
            (Refusal::AtBound("swing"), "swing"),
            (Refusal::Sags, "sag"),
            (Refusal::AnotherClock, "one clock"),
            (Refusal::NoGap, "its gap"),
        ] {
            assert!(refusal(&why).contains(words), "{why:?}");
        }
    }
}
