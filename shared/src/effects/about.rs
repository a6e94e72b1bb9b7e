//! What is known of an effect beside its equations.

/// Where an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// A torque on the joint.
    Torque,
    /// On what the position sensor reads: the terms are its error in rad per unit of each gain.
    Position,
    /// On what the torque or current sensor reads.
    Effort,
    /// Between motor and link.
    Transmission,
    /// Between the commanded and the effective voltage, V.
    Voltage,
    /// Inertia and gravity of the link: nothing is left after a refit.
    Load,
}

/// What the torque does with the direction of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Changes sign with it and holds the joint at rest: dry friction.
    Dry,
    /// Exists at rest as well as in motion.
    Indifferent,
}

/// Of what a periodic effect is a sinusoid: its terms are cosine and sine of its first shape, the order, times that angle,
/// and nothing else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Periodic {
    /// Of the motor's angle.
    Motor,
    /// Of the motor's angle, times the torque of the drive.
    MotorTimesDrive,
    /// Of the joint's angle.
    Joint,
}

/// How a parameter is searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Any number, in equal steps.
    Linear,
    /// Any number, in equal ratios.
    Logarithmic,
    /// Whole numbers alone, such as the order of a wave: nothing lies between two of them.
    Whole,
}

/// One parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Key in a description.
    pub name: &'static str,
    /// ASCII, joint-side unless the name says otherwise.
    pub unit: &'static str,
    /// What physics allows.
    pub bounds: [f64; 2],
    /// What rigs have: the range that is searched.
    pub range: [f64; 2],
    /// How it is searched.
    pub scale: Scale,
    /// In words.
    pub meaning: &'static str,
}

/// Another effect that can pass for this one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Confusion {
    /// Its name.
    pub with: &'static str,
    /// Whether no recording of torque and motor position can tell them apart.
    pub exact: bool,
    /// What does.
    pub separated_by: &'static str,
}

/// What a recording must contain before the effect can be judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Need {
    /// Reversals of direction.
    Reversals(u32),
    /// Motion below this speed in rad/s, and above three times of it.
    SlowMotion(f64),
    /// Highest over typical speed.
    SpeedRange(f64),
    /// Turns of the joint.
    Travel(f64),
    /// Turns of the motor at less than this speed of the motor in rad/s.
    SlowTurns(f64),
    /// Range of the transmitted torque over its mean.
    LoadRange(f64),
    /// Running time, s.
    Duration(f64),
    /// A recorded voltage.
    Voltage,
    /// A recorded temperature or running time.
    Temperature,
    /// Another joint that moves.
    OtherJoint,
    /// A description known to be right before the change.
    Prior,
}

/// What is known of an effect beside its equations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct About {
    /// As descriptions and results write it.
    pub name: &'static str,
    /// Which of several laws under one name; none where there is one.
    pub law: Option<&'static str>,
    /// In words, without an article.
    pub title: &'static str,
    /// The equation, plain text.
    pub equation: &'static str,
    /// Author, year, place.
    pub source: &'static str,
    /// Where it acts.
    pub channel: Channel,
    /// What it does with the direction of motion.
    pub direction: Direction,
    /// Parameters that enter linearly.
    pub gains: &'static [Parameter],
    /// Parameters that do not.
    pub shapes: &'static [Parameter],
    /// How it shows in a residual.
    pub signature: &'static str,
    /// What it is taken for.
    pub confused: &'static [Confusion],
    /// What a recording must contain.
    pub needs: &'static [Need],
    /// Whether the firmware can compensate it by a torque.
    pub compensable: bool,
    /// What the equations leave out.
    pub leaves_out: &'static str,
}
