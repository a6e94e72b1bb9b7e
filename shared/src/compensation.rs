//! Effects beyond the standard model, turned into what a controller does about them.
//!
//! What is done follows from where the effect acts ([`Role`]):
//!
//! * **Dry friction** goes the way of the friction law ([`precompensation`](crate::precompensation)): the direction is
//!   the reference's near rest and the measurement's beyond the threshold, and a share of the torque is given,
//!   `gain_at_rest` to `gain`. At which speed? Where friction falls with speed (Stribeck), a torque held at the
//!   reference's speed exceeds the friction of a link that has run ahead, and drives it further; where it rises,
//!   a torque at the measured speed takes damping from the loop. So an effect that falls with speed is evaluated at
//!   the faster of reference and link, any other at the reference: no torque grows with the measured speed.
//! * **What stands at a position** as well as in motion (cogging, eccentricity, springs, tilt) is given in full at the
//!   measured position: it is a known torque like gravity, and wrong by the error of the position alone. Its speed
//!   is the reference's, for the reason above.
//! * **Friction with memory of distance** (presliding) builds up over the reference's way, as dry friction does at once:
//!   fed by the measured way it would close a loop of positive sign.
//! * **An eccentric encoder** is taken off the measured position, and its slope off the velocity; **a constant error
//!   of the current** is taken off the reading.
//! * **A voltage that the bridge loses** is given beside the current loop's, in the direction of the wanted current; within a
//!   small band about none it fades, where the ripple crosses zero and so does the loss.
//!
//! Whatever else there is has no torque, voltage or reading that would undo it, and is refused with the reason
//! ([`Role::refusal`]).
//!
//! Beside the torque to give, a tick says what of the drive's torque the effects *explain*: the same laws at the
//! measured motion, in full. An estimator of the standard model must not see that part, or its parameters absorb it.
//!
//! Leaves out: what the feed-forward does not reach because of the current loop's lag; effects that name another
//! joint.

mod now;
mod role;

pub use now::Now;
pub use role::{EffectFault, Role};

use crate::effects::{Effect, Instant, Kind, Memory, Parameter, Scale};
use crate::precompensation::{PrecompensationSettings, direction, finite, share};
use crate::scalar::{Real, Scalar};

/// Most effects that a rig compensates.
pub const EFFECTS: usize = 8;

/// The effects of a rig, from the front.
pub type Effects<T> = [Option<Effect<T>>; EFFECTS];

/// Slow and fast, rad/s: whether an effect falls with speed.
const SPEEDS: [f64; 2] = [1e-3, 10.0];
/// The slope of the encoder's error is taken over this angle of the motor, rad: within 1 % for an error of once a
/// turn, a hundred times above the rounding of `f32`.
const SLOPE_SPAN: f64 = 0.02;

/// An effect that has passed its checks, with what follows from it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Compensated<T> {
    effect: Effect<T>,
    role: Role,
    /// All shapes are whole: the motor's angle within a turn says as much as the angle itself, and better.
    whole: bool,
    /// It is smaller at high speed than at low speed.
    falls: bool,
}

impl<T: Scalar> Compensated<T> {
    fn new(effect: Effect<T>) -> Result<Self, EffectFault> {
        let kind = effect.kind;
        let role = Role::of(kind).ok_or(EffectFault::NotCompensable(kind))?;
        let about = kind.about();
        within(about.gains, &effect.gains, false)?;
        within(about.shapes, &effect.shapes, true)?;
        let whole = |shape: &T| shape.to_f64() as i64 as f64 == shape.to_f64();
        let sliding = |speed: f64| {
            let at = Instant {
                velocity: T::from_f64(speed),
                direction: T::ONE,
                load: T::ONE,
                ..Instant::default()
            };
            evaluate(&effect, &mut Memory::default(), &at).abs()
        };
        Ok(Self {
            effect,
            role,
            whole: effect.shapes.iter().all(whole),
            falls: sliding(SPEEDS[1]).lt(sliding(SPEEDS[0])),
        })
    }
}

/// Every law of the registry is in here: once, not at every place that asks.
#[inline(never)]
fn evaluate<T: Real>(effect: &Effect<T>, memory: &mut Memory<T>, at: &Instant<T>) -> T {
    let terms = effect
        .kind
        .compensated_terms(&effect.shapes, &mut memory.0, at);
    let sum = effect
        .gains
        .iter()
        .zip(terms)
        .fold(T::ZERO, |sum, (gain, term)| sum + *gain * term);
    finite(sum)
}

/// `divided`: the law divides by those that are searched in ratios, and has no value where they are 0.
fn within<T: Scalar>(
    parameters: &[Parameter],
    values: &[T],
    divided: bool,
) -> Result<(), EffectFault> {
    for (k, value) in values.iter().enumerate() {
        let value = value.to_f64();
        let Some(parameter) = parameters.get(k) else {
            if value == 0.0 {
                continue;
            }
            return Err(EffectFault::Surplus);
        };
        let [low, high] = parameter.bounds;
        let open = divided && parameter.scale == Scale::Logarithmic;
        let above = if open { low < value } else { low <= value };
        if !(above && value <= high && value.is_finite()) {
            return Err(EffectFault::Parameter(parameter.name));
        }
    }
    Ok(())
}

/// What effects ask for in a control tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Output<T> {
    /// Torque to give beside the law's, N·m.
    pub feed: T,
    /// What the drive has to give because of the effects at the measured motion, N·m: not for an estimator to see.
    pub explained: T,
}

/// What effects do to the measured position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading<T> {
    /// Too much in the position, rad.
    pub error: T,
    /// Too much in the velocity, as a share of it.
    pub slope: T,
}

/// What an effect does to the measured position, about the place where that was last worked out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Tangent<T> {
    place: T,
    error: T,
    slope: T,
}

/// What effects remember.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T: Real> {
    /// Of each law where the torque to give is taken from, and at the measured motion.
    memories: [[Memory<T>; 2]; EFFECTS],
    tangents: [Tangent<T>; EFFECTS],
    reading_turn: usize,
    /// Value of each law where the torque to give is taken from: dry ones from the front, standing ones from the end.
    planned: [T; EFFECTS],
    /// Value of each dry law at the measured motion.
    sliding: [T; EFFECTS],
    /// Sums of dry and standing ones among `planned`, and of `sliding`: brought up to date with each law, and made anew with
    /// each round, so that no rounding piles up.
    sums: [T; 3],
    turn: usize,
}

impl<T: Real> State<T> {
    /// Ticks have been left out: what was worked out before them no longer holds.
    pub fn interrupt(&mut self) {
        self.planned = [T::ZERO; EFFECTS];
        self.sliding = [T::ZERO; EFFECTS];
        self.sums = [T::ZERO; 3];
        self.memories = [[Memory::default(); 2]; EFFECTS];
        self.turn = 0;
    }

    /// The link is said to stand elsewhere: what was worked out for another place no longer holds.
    pub fn displace(&mut self) {
        self.tangents = [Tangent::default(); EFFECTS];
        self.reading_turn = 0;
    }
}

/// One law to be evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Job {
    effect: u8,
    /// Place among the values.
    place: u8,
    /// At the measured motion, instead of where the torque to give is taken from.
    sliding: bool,
}

/// The effects of a rig, checked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Compensation<T> {
    effects: [Option<Compensated<T>>; EFFECTS],
    /// What is evaluated in turn, one law a tick.
    jobs: [Job; 2 * EFFECTS],
    count: u8,
    /// Dry effects, and standing ones.
    dry: u8,
    standing: u8,
    /// Ticks until a law's turn comes again.
    round: T,
    /// Effects in the position.
    positions: u8,
    /// Some effect depends on the transmitted torque.
    needs_load: bool,
}

impl<T: Scalar> Compensation<T> {
    /// Checks all effects.
    ///
    /// # Errors
    /// What is wrong with the first that cannot be used.
    pub fn new(effects: &Effects<T>) -> Result<Self, EffectFault> {
        let mut all = Self::default();
        for (k, effect) in effects.iter().enumerate() {
            let Some(effect) = effect else { continue };
            let checked = Compensated::new(*effect)?;
            all.effects[k] = Some(checked);
            all.needs_load |= effect.kind == Kind::LoadFriction;
            match checked.role {
                Role::Dry => {
                    all.add(k, all.dry, false);
                    all.add(k, all.dry, true);
                    all.dry += 1;
                }
                Role::Standing => {
                    all.standing += 1;
                    all.add(k, EFFECTS as u8 - all.standing, false);
                }
                Role::Position => all.positions += 1,
                Role::Current | Role::Voltage => {}
            }
        }
        Ok(all)
    }

    fn add(&mut self, effect: usize, place: u8, sliding: bool) {
        if let Some(job) = self.jobs.get_mut(usize::from(self.count)) {
            *job = Job {
                effect: effect as u8,
                place,
                sliding,
            };
            self.count += 1;
            self.round += T::ONE;
        }
    }

    /// The effects as they were given.
    pub fn effects(&self) -> Effects<T> {
        self.effects.map(|one| one.map(|one| one.effect))
    }

    /// Whether there is a torque to work out.
    #[inline(always)]
    pub fn has_torque(&self) -> bool {
        self.count > 0
    }

    /// Whether there is anything to take off the position.
    #[inline(always)]
    pub fn has_position(&self) -> bool {
        self.positions > 0
    }

    /// Whether an effect depends on the torque that the gear transmits.
    #[inline(always)]
    pub fn needs_load(&self) -> bool {
        self.needs_load
    }

    /// Voltage that the bridge loses against the current, V.
    pub fn lost_voltage(&self) -> T {
        let lost = |one: &Compensated<T>| one.effect.gains[0];
        let all = self.effects.iter().flatten();
        all.filter(|one| one.role == Role::Voltage)
            .fold(T::ZERO, |sum, one| sum + lost(one))
    }

    /// Constant error of the measured current, A, where a torque in N·m is so many per ampere.
    pub fn current_error(&self, torque_per_ampere: T) -> T {
        let mut sum = T::ZERO;
        for one in self.effects.iter().flatten() {
            if one.role != Role::Current {
                continue;
            }
            let error = evaluate(&one.effect, &mut Memory::default(), &Instant::default());
            let amperes = one.effect.kind.about().gains.first();
            sum += if amperes.is_some_and(|gain| gain.unit == "A") {
                error
            } else {
                error / torque_per_ampere
            };
        }
        sum
    }

    /// What the encoder reads too much at this angle. Evaluated at the reading instead of the truth: wrong by the
    /// error's own square.
    ///
    /// One effect is evaluated in a tick that has time, in turn, and continued along its tangent until its turn comes again.
    #[inline(always)]
    pub fn reading(&self, state: &mut State<T>, now: &Now<T>) -> Reading<T> {
        let mut reading = Reading::default();
        if self.positions == 0 || !now.placed {
            return reading;
        }
        let position = finite(now.position);
        if !now.busy {
            self.evaluate_tangent(state, now);
        }
        let tangents = self.effects.iter().zip(&state.tangents);
        for (_, at) in tangents.filter(|(one, _)| one.is_some_and(|one| one.role == Role::Position))
        {
            reading.error += at.error + at.slope * (position - at.place);
            reading.slope += at.slope;
        }
        reading
    }

    /// Works out the tangent of the next effect in the position.
    #[inline(always)]
    fn evaluate_tangent(&self, state: &mut State<T>, now: &Now<T>) {
        let span = T::from_f64(SLOPE_SPAN);
        for _ in 0..EFFECTS {
            let k = state.reading_turn;
            state.reading_turn = if k + 1 < EFFECTS { k + 1 } else { 0 };
            let (Some(Some(one)), Some(tangent)) = (self.effects.get(k), state.tangents.get_mut(k))
            else {
                continue;
            };
            if one.role != Role::Position {
                continue;
            }
            let mut instant = now.instant(one.whole);
            let here = evaluate(&one.effect, &mut Memory::default(), &instant);
            instant.position += span / now.gear_ratio;
            instant.motor_angle += span;
            let ahead = evaluate(&one.effect, &mut Memory::default(), &instant);
            *tangent = Tangent {
                place: finite(now.position),
                error: here,
                slope: (ahead - here) * now.gear_ratio / span,
            };
            return;
        }
    }

    /// Torque to give, and torque that is explained. The result is finite for any input.
    ///
    /// One law is evaluated a tick, in turn, and stands until its turn comes again: a single effect of position at
    /// every tick, four dry ones every eighth, eight every sixteenth, each in the middle of the time that it stands for.
    #[inline(always)]
    pub fn torque(
        &self,
        settings: &PrecompensationSettings<T>,
        state: &mut State<T>,
        now: &Now<T>,
    ) -> Output<T> {
        if !now.busy {
            self.evaluate_next(settings, state, now);
        }
        let [dry, standing, sliding] = state.sums;
        let share = if settings.enabled && self.dry > 0 {
            share(
                settings,
                finite(now.reference.velocity),
                finite(now.velocity),
            )
        } else {
            T::ZERO
        };
        Output {
            feed: share * dry + standing,
            explained: sliding + standing,
        }
    }

    /// The sums anew.
    #[inline(never)]
    fn add_up(&self, state: &mut State<T>) {
        let sum =
            |values: &mut dyn Iterator<Item = &T>| values.fold(T::ZERO, |sum, value| sum + *value);
        let (dry, standing) = (usize::from(self.dry), usize::from(self.standing));
        state.sums = [
            sum(&mut state.planned.iter().take(dry)),
            sum(&mut state.planned.iter().rev().take(standing)),
            sum(&mut state.sliding.iter().take(dry)),
        ];
    }

    #[inline(always)]
    fn evaluate_next(
        &self,
        settings: &PrecompensationSettings<T>,
        state: &mut State<T>,
        now: &Now<T>,
    ) {
        let Some(job) = self.jobs.get(state.turn) else {
            return;
        };
        state.turn = if state.turn + 1 < usize::from(self.count) {
            state.turn + 1
        } else {
            0
        };
        let k = usize::from(job.effect);
        let (Some(Some(one)), Some([planned, sliding])) =
            (self.effects.get(k), state.memories.get_mut(k))
        else {
            return;
        };
        let (wanted, measured) = (finite(now.reference.velocity), finite(now.velocity));
        let mut instant = now.instant(one.whole);
        instant.period = now.period * self.round;
        // Until half of the time that it stands for has passed.
        let way = T::from_f64(0.5) * (instant.period - now.period) * measured;
        instant.position += way;
        instant.motor_angle += way * now.gear_ratio;
        let (place, memory) = if job.sliding {
            instant.velocity = measured;
            instant.direction = measured.sgn();
            (&mut state.sliding, sliding)
        } else {
            let dry = one.role == Role::Dry;
            let ahead = wanted.abs().lt(measured.abs());
            // The faster speed, in the reference's direction.
            let backwards = wanted.lt(T::ZERO);
            let faster = T::select(backwards, -measured.abs(), measured.abs());
            instant.velocity = if dry && one.falls && ahead {
                faster
            } else {
                wanted
            };
            instant.direction = if dry {
                direction(wanted, measured, settings.velocity_threshold)
            } else {
                wanted.sgn()
            };
            (&mut state.planned, planned)
        };
        let nowhere = one.role == Role::Standing && !now.placed;
        // Of dry friction nothing is given where nothing moves or is to, whatever a law remembers.
        let rests = one.role == Role::Dry && instant.direction.abs().le(T::ZERO);
        let torque = if nowhere {
            T::ZERO
        } else {
            evaluate(&one.effect, memory, &instant)
        };
        let torque = if rests { T::ZERO } else { torque };
        let sum = match (one.role, job.sliding) {
            (_, true) => 2,
            (Role::Standing, _) => 1,
            _ => 0,
        };
        if let Some(place) = place.get_mut(usize::from(job.place)) {
            state.sums[sum] += torque - *place;
            *place = torque;
        }
        if state.turn == 0 {
            self.add_up(state);
        }
    }
}

#[cfg(test)]
#[path = "compensation_test.rs"]
mod tests;
