//! Families of motions, and manual work between their passes.

/// Purpose of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Forth and back at several constant speeds.
    ConstantSpeeds,
    /// Slow triangles of decreasing amplitude.
    NestedReversals,
    /// The same at the strongest gravity, which closes a gap.
    ReversalsUnderLoad,
    /// Swept sine, and again at a third of its amplitude.
    Chirp,
    /// A slow move to each of several levels after a dwell.
    RampsAfterRest,
    /// A sine at one frequency.
    Sine,
    /// A sine repeated for ten minutes from cold.
    WarmUp,
    /// A constant speed; the drive is switched off in the middle.
    CoastDown,
    /// Position levels that a clamped joint cannot reach, which become levels of torque and voltage.
    LockedRotor,
}

impl Family {
    /// All families in which the joint moves.
    pub const MOVING: [Self; 8] = [
        Self::ConstantSpeeds,
        Self::NestedReversals,
        Self::ReversalsUnderLoad,
        Self::Chirp,
        Self::RampsAfterRest,
        Self::Sine,
        Self::WarmUp,
        Self::CoastDown,
    ];

    /// Returns the name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::ConstantSpeeds => "constant-speed-pairs",
            Self::NestedReversals => "nested-reversals",
            Self::ReversalsUnderLoad => "reversals-under-load",
            Self::Chirp => "two-amplitude-chirp",
            Self::RampsAfterRest => "ramps-after-rest",
            Self::Sine => "sine",
            Self::WarmUp => "warm-up",
            Self::CoastDown => "coast-down",
            Self::LockedRotor => "locked-rotor-staircase",
        }
    }
}

/// Manual work between the passes of one motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hands {
    /// Nothing: one pass.
    None,
    /// A second pass with a payload.
    Payload,
    /// A second pass with the base turned so that gravity has no effect.
    BaseOnItsSide,
}

impl Hands {
    /// Returns the factors on inertia and gravity of the link in each pass.
    pub(crate) fn passes(self) -> &'static [[f64; 2]] {
        match self {
            Self::None => &[[1.0, 1.0]],
            // A payload of half the link's mass stays well within the reserve of the limits.
            Self::Payload => &[[1.0, 1.0], [1.5, 1.5]],
            Self::BaseOnItsSide => &[[1.0, 1.0], [1.0, 0.0]],
        }
    }
}
