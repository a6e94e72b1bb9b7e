//! Limits of a URDF that count as not known, with the remark on the joints that have them.

/// Why a limit of a joint counts as not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Unknown {
    /// `<limit>` is zero throughout.
    All,
    /// The lower and the upper limit are both 0.
    Range,
    /// The velocity limit is 0.
    Speed,
    /// There is no velocity limit.
    NoSpeed,
    /// Neither the velocity nor the effort limit is known.
    SpeedAndEffort,
    /// The effort limit is a placeholder.
    Effort(f64),
    /// There is no effort limit.
    NoEffort,
}

impl Unknown {
    /// Returns the remark about these joints, without its place.
    pub(super) fn sentence(self, joints: &str, is_one: bool) -> String {
        let its = if is_one { "its" } else { "their" };
        let (limit, look, count) = match is_one {
            true => ("limit", "looks like a placeholder", "counts"),
            false => ("limits", "look like placeholders", "count"),
        };
        let speed = match is_one {
            true => "so it counts as not known; a command that designs a motion wants it",
            false => "so they count as not known; a command that designs a motion wants them",
        };
        let whole = format!(
            "so {its} limits count as not known, the stated ones too; a command that designs a motion wants them all"
        );
        match self {
            Self::All => format!(
                "<limit> of {joints} is zero throughout, a placeholder; {its} limits count as not known."
            ),
            Self::Range => {
                format!("the lower and the upper {limit} of {joints} are both 0, {whole}.")
            }
            Self::Speed => format!(
                "the velocity {limit} of {joints} {} 0, {speed}.",
                if is_one { "is" } else { "are" }
            ),
            Self::NoSpeed => format!("<limit> of {joints} has no `velocity`, {speed}."),
            Self::SpeedAndEffort => format!(
                "neither the velocity nor the effort {limit} of {joints} {} stated (0 is none), so both count as not known; a command that designs a motion wants the velocity.",
                if is_one { "is" } else { "are" }
            ),
            Self::Effort(effort) => format!(
                "the effort {limit} {effort} of {joints} {look}; {its} torque {limit} {count} as not known."
            ),
            Self::NoEffort => format!(
                "<limit> of {joints} has no `effort`; {its} torque {limit} {count} as not known."
            ),
        }
    }
}
