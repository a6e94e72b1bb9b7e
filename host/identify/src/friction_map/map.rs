//! Points, fitted laws and the choice between them.

use serde::Serialize;

/// Settings for finding stretches of constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionMapOptions {
    /// Largest relative deviation of a measured position's speed from its mean over the stretch.
    pub tolerance: f64,
    /// Shortest usable stretch after its start is excluded, s.
    pub shortest: f64,
    /// Excluded start of a stretch, in which the controller settles, s.
    pub settle: f64,
    /// Smallest excluded share at the start of a stretch. Friction builds up over a distance after a reversal
    /// (presliding), and slow passes take long to cover it.
    pub settle_share: f64,
}

impl Default for FrictionMapOptions {
    fn default() -> Self {
        Self {
            tolerance: 0.05,
            shortest: 0.1,
            settle: 0.05,
            settle_share: 0.1,
        }
    }
}

/// Mean friction over one stretch of constant speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrictionPoint {
    /// Mean measured speed, rad/s or m/s.
    pub speed: f64,
    /// Torque minus the identified gravity, inertia and offset, N·m or N.
    pub friction: f64,
    /// Standard deviation of that mean; allows for correlation in time.
    pub std: f64,
    /// Start, s.
    pub start: f64,
    /// Duration, s.
    pub duration: f64,
    /// First row used and one past the last.
    #[serde(skip)]
    pub rows: (usize, usize),
}

/// A stretch of constant speed that gave no point.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DroppedPass {
    /// Speed, rad/s or m/s.
    pub speed: f64,
    /// Start, s.
    pub start: f64,
    /// Duration, s.
    pub duration: f64,
    /// Reason, a phrase.
    pub why: String,
}

/// A fitted law.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrictionFit {
    /// Coulomb friction, N·m or N.
    pub coulomb: f64,
    /// Viscous coefficient, N·m·s/rad or N·s/m.
    pub viscous: f64,
    /// Breakaway friction minus Coulomb friction, N·m or N; 0 without the Stribeck term.
    pub breakaway_excess: f64,
    /// Constant torque of the sweep minus the identified one, N·m or N.
    pub offset: f64,
    /// Stribeck velocity, rad/s or m/s.
    pub stribeck_velocity: Option<f64>,
    /// 95 % half intervals in the order coulomb, viscous, breakaway excess.
    pub half_interval: Vec<f64>,
    /// Weighted sum of squared residuals.
    pub squares: f64,
    /// RMS error on points that were left out of the fit one at a time, N·m or N.
    pub leave_one_out_rms: f64,
}

/// Points, fitted laws and the choice between them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrictionMap {
    /// Name of the joint.
    pub joint: String,
    /// One point per stretch, sorted by speed.
    pub points: Vec<FrictionPoint>,
    /// Stretches of constant speed that gave no point, sorted by time.
    pub dropped: Vec<DroppedPass>,
    /// True if the stretches come from the recorded reference, false if from the measured position.
    pub from_reference: bool,
    /// Standard deviation between passes beyond that of the points themselves, N·m or N.
    pub scatter: f64,
    /// fc·sgn v + fv·v + a constant.
    pub simple: FrictionFit,
    /// The same plus breakaway·exp(−(v/vs)²)·sgn v (Armstrong-Hélouvry, Dupont & Canudas de Wit 1994), if the points
    /// warrant it.
    pub stribeck: Option<FrictionFit>,
    /// Sum of squares as a function of the Stribeck velocity vs, which decides the choice of vs.
    pub profile: Vec<[f64; 2]>,
    /// p-value of the F-test of the Stribeck law against the simple one.
    pub p_value: Option<f64>,
    /// RMS error of the Stribeck law on left-out points, N·m or N; given even if the law is not warranted.
    pub stribeck_left_out_rms: Option<f64>,
    /// True if the Stribeck term is warranted.
    pub warranted: bool,
    /// One or two sentences.
    pub text: String,
    /// Corrections to the sweep's time stamps, a sentence.
    pub note: Option<String>,
    /// Reasons not to trust the map, a sentence each: the torque has another clock or scale than the position or than
    /// the identification, or friction is negative. Empty for a sound sweep.
    pub doubts: Vec<String>,
}
