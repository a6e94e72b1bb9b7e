//! Descriptions of effects: names, parameters, sources and limits.

/// Where an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// A torque on the joint.
    Torque,
    /// The position reading. The terms are its error in rad per unit of each gain.
    Position,
    /// The torque or current reading.
    Effort,
    /// Between motor and link.
    Transmission,
    /// Between the commanded and the effective voltage, V.
    Voltage,
    /// Inertia and gravity of the link. A refit of the link's parameters absorbs it completely.
    Load,
}

/// Dependence of the torque on the direction of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Changes sign with the direction and holds the joint at rest: dry friction.
    Dry,
    /// Exists at rest as well as in motion.
    Indifferent,
}

/// Angle of a sinusoidal effect. The terms are cosine and sine of the order (its first shape) times that angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Periodic {
    /// The motor's angle.
    Motor,
    /// The motor's angle; the terms are multiplied by the drive torque.
    MotorTimesDrive,
    /// The joint's angle.
    Joint,
}

/// How a search samples a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Any number, in equal steps.
    Linear,
    /// Any number, in equal ratios.
    Logarithmic,
    /// Whole numbers only, such as the order of a wave.
    Whole,
}

/// Description of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Key in a description.
    pub name: &'static str,
    /// ASCII, joint-side unless the name says otherwise.
    pub unit: &'static str,
    /// Physical bounds.
    pub bounds: [f64; 2],
    /// Range of real rigs, which is searched.
    pub range: [f64; 2],
    /// How a search samples it.
    pub scale: Scale,
    /// Meaning in words.
    pub meaning: &'static str,
}

/// Another effect that can be mistaken for this one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Confusion {
    /// Its name.
    pub with: &'static str,
    /// True if no recording of torque and motor position can tell them apart.
    pub exact: bool,
    /// Experiment or measurement that separates the two.
    pub separated_by: &'static str,
}

/// Requirement on a recording before the effect can be judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Need {
    /// Reversals of direction.
    Reversals(u32),
    /// Motion below this speed in rad/s, and above three times this speed.
    SlowMotion(f64),
    /// Ratio of highest to typical speed.
    SpeedRange(f64),
    /// Travel of the joint, turns.
    Travel(f64),
    /// Turns of the motor below this motor speed in rad/s.
    SlowTurns(f64),
    /// Ratio of the range of the transmitted torque to its mean.
    LoadRange(f64),
    /// Running time, s.
    Duration(f64),
    /// A recorded voltage.
    Voltage,
    /// A recorded temperature or running time.
    Temperature,
    /// A second moving joint.
    OtherJoint,
    /// A description that was correct before the change.
    Prior,
}

/// Description of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct About {
    /// Name in descriptions and results.
    pub name: &'static str,
    /// Name of the law if the effect has several, else none.
    pub law: Option<&'static str>,
    /// Title in words, without an article.
    pub title: &'static str,
    /// The equation, plain text.
    pub equation: &'static str,
    /// Author, year, place.
    pub source: &'static str,
    /// Where it acts.
    pub channel: Channel,
    /// Dependence on the direction of motion.
    pub direction: Direction,
    /// Parameters that enter linearly.
    pub gains: &'static [Parameter],
    /// Parameters that enter nonlinearly.
    pub shapes: &'static [Parameter],
    /// Appearance in a residual.
    pub signature: &'static str,
    /// Effects that are mistaken for it.
    pub confused: &'static [Confusion],
    /// Requirements on a recording.
    pub needs: &'static [Need],
    /// True if the firmware can compensate it by a torque.
    pub compensable: bool,
    /// Physics that the equations leave out.
    pub leaves_out: &'static str,
}
