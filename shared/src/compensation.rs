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
//!   is the reference's, for the reason above. What is periodic in the motor's angle turns with it at every tick, and
//!   is given for where the link will be when the torque acts ([`Now::lead`]).
//! * **Friction with memory of distance** (presliding) builds up over the reference's way, as dry friction does at once:
//!   fed by the measured way it would close a loop of positive sign. What acts through its contact goes the way that it does;
//!   that it bends the contact farther ([`Instant::beside`](crate::effects::Instant::beside)) is left out, for want of time in a tick.
//! * **An eccentric encoder** is taken off the measured position, and its slope off the velocity; **a constant error
//!   of the current** is taken off the reading.
//! * **A voltage that the bridge loses** is given beside the current loop's, in the direction that the current is about to have; within a
//!   small band about none it fades, where the ripple crosses zero and so does the loss.
//!
//! Whatever else there is has no torque, voltage or reading that would undo it, and is refused with the reason
//! ([`Role::refusal`]).
//!
//! Beside the torque to give, a tick says what of the drive's torque the effects *explain*: the same laws at the
//! measured motion, in full. An estimator of the standard model must not see that part, or its parameters absorb it.
//!
//! Leaves out: that the current loop gives fast torques smaller; effects that name another joint.

mod compensated;
mod now;
mod role;
mod wave;

pub use now::Now;
pub use role::{EffectFault, Role};

use crate::effects::{Effect, Instant, Kind, Memory};
use crate::precompensation::{PrecompensationSettings, direction, finite, share};
use crate::scalar::{Real, Scalar};
use compensated::{Compensated, evaluate};
use wave::{Stand, Waves};

/// Most effects that a rig compensates.
pub const EFFECTS: usize = 8;

/// Ticks for which it is remembered what periodic effects were given: the most that [`Now::lead_ticks`] may be, and one.
pub const GIVEN: usize = 64;
// The place of a tick is its number modulo that of places, and the number wraps at 256.
const _: () = assert!(GIVEN.is_power_of_two() && GIVEN <= 256);

/// The effects of a rig, from the front.
pub type Effects<T> = [Option<Effect<T>>; EFFECTS];

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

/// What effects remember.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T: Real> {
    /// Of each law where the torque to give is taken from, and at the measured motion.
    memories: [[Memory<T>; 2]; EFFECTS],
    stand: Stand<T>,
    /// Value of each law where the torque to give is taken from: dry ones from the front, standing ones from the end.
    planned: [T; EFFECTS],
    /// Value of each dry law at the measured motion.
    sliding: [T; EFFECTS],
    /// Sums of dry and standing ones among `planned`, and of `sliding`: brought up to date with each law, and made anew with
    /// each round, so that no rounding piles up.
    sums: [T; 3],
    turn: u8,
    given: Given<T>,
}

/// What periodic effects were given in the ticks before: given ahead of the motor, it is what they explain when the motor is there.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Given<T> {
    torques: [T; GIVEN],
    next: u8,
}

impl<T: Real> Default for Given<T> {
    fn default() -> Self {
        Self {
            torques: [T::ZERO; GIVEN],
            next: 0,
        }
    }
}

impl<T: Real> Given<T> {
    /// Puts down what is given now, and says what was given so many ticks ago.
    #[inline(always)]
    fn put(&mut self, torque: T, ticks: u8, share: T) -> T {
        const LAST: usize = GIVEN - 1;
        let next = usize::from(self.next);
        self.torques[next & LAST] = torque;
        self.next = self.next.wrapping_add(1);
        let at = |ago: usize| self.torques[next.wrapping_sub(ago) & LAST];
        let (later, earlier) = (at(usize::from(ticks)), at(usize::from(ticks) + 1));
        later + share * (earlier - later)
    }
}

impl<T: Real> State<T> {
    /// Ticks have been left out: what was worked out before them no longer holds.
    pub fn interrupt(&mut self) {
        self.planned = [T::ZERO; EFFECTS];
        self.sliding = [T::ZERO; EFFECTS];
        self.sums = [T::ZERO; 3];
        self.memories = [[Memory::default(); 2]; EFFECTS];
        self.turn = 0;
        self.given = Given::default();
    }

    /// Nobody knows where the link stands: what is periodic stands nowhere. Not inlined: it is seldom.
    #[cold]
    #[inline(never)]
    fn forget(&mut self) {
        self.stand = Stand::default();
    }
}

/// Sum of values. Not inlined: a chip's fast memory is small.
#[inline(never)]
fn total<T: Real>(values: &[T]) -> T {
    values.iter().fold(T::ZERO, |sum, value| sum + *value)
}

/// The last so many values.
#[inline(always)]
fn last<T>(values: &[T; EFFECTS], count: u8) -> &[T] {
    let first = EFFECTS.saturating_sub(usize::from(count));
    values.get(first..).unwrap_or_default()
}

/// One law to be evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Job {
    effect: u8,
    /// Place among the values.
    place: u8,
    /// At the measured motion, instead of where the torque to give is taken from.
    sliding: bool,
    /// The effect of presliding through whose contact it acts.
    contact: Option<u8>,
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
    /// How many of the standing ones, the first, act on the link, where an effect depends on what the gear transmits.
    on_link: u8,
    /// Ticks until a law's turn comes again.
    round: T,
    waves: Waves<T>,
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
        let mut contact = None;
        for (k, effect) in effects.iter().enumerate() {
            let Some(effect) = effect else { continue };
            all.effects[k] = Some(Compensated::new(*effect)?);
            all.needs_load |= effect.kind == Kind::LoadFriction;
            if effect.kind.is_presliding() {
                contact = Some(k as u8);
            }
        }
        // What a gear carries comes first, so that its values lie side by side.
        for on_link in [true, false] {
            for (k, one) in all.effects.into_iter().enumerate() {
                let Some(one) = one else { continue };
                if one.effect.kind.on_the_link() == on_link {
                    all.place(k, &one, contact);
                }
            }
            if on_link && all.needs_load {
                all.on_link = all.standing;
            }
        }
        all.waves = Waves::new(&all.effects);
        Ok(all)
    }

    /// Gives an effect its turn and its place among the values.
    fn place(&mut self, effect: usize, one: &Compensated<T>, contact: Option<u8>) {
        let kind = one.effect.kind;
        let job = |place: u8, sliding: bool| Job {
            effect: effect as u8,
            place,
            sliding,
            contact: contact.filter(|_| kind.acts_through_contact()),
        };
        match one.role {
            Role::Dry => {
                self.add(job(self.dry, false));
                self.add(job(self.dry, true));
                self.dry += 1;
            }
            Role::Standing if kind.periodic().is_none() => {
                self.standing += 1;
                self.add(job(EFFECTS as u8 - self.standing, false));
            }
            Role::Standing | Role::Position | Role::Current | Role::Voltage => {}
        }
    }

    fn add(&mut self, job: Job) {
        if let Some(place) = self.jobs.get_mut(usize::from(self.count)) {
            *place = job;
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
        self.count > 0 || self.waves.of_torque()
    }

    /// Whether there is anything that turns with an angle, and is to be told of it at every tick.
    #[inline(always)]
    pub fn turns(&self) -> bool {
        self.waves.any()
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

    /// Largest share of the velocity that what the encoder reads too much can make up.
    pub fn position_slope(&self, gear_ratio: T) -> T {
        self.waves.position_slope(gear_ratio)
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

    /// Turns what is periodic to where the link is. What the encoder reads too much there: evaluated at the reading instead of
    /// the truth, which is wrong by the error's own square.
    #[inline(always)]
    pub fn turn(&self, state: &mut State<T>, now: &Now<T>) -> Reading<T> {
        if !now.placed {
            state.forget();
            return Reading::default();
        }
        if now.turns {
            self.waves.turn(&mut state.stand, now);
        }
        if !self.waves.of_position() {
            return Reading::default();
        }
        let [motor, joint] = self.waves.position(&state.stand, now);
        Reading {
            error: motor.value + joint.value,
            slope: motor.slope * now.gear_ratio + joint.slope,
        }
    }

    /// Torque to give, and torque that is explained. The result is finite for any input.
    ///
    /// One law is evaluated in a tick that has time, in turn, and stands until its turn comes again, each in the middle of the
    /// time that it stands for. Periodic ones are as [`turn`](Self::turn) has left them, which is to be called first.
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
        let mut output = Output {
            feed: share * dry + standing,
            explained: sliding + standing,
        };
        if self.waves.of_torque() {
            let [torque, of_drive] = self.waves.torque(&state.stand, now);
            let drive = finite(now.drive_torque);
            let given = torque.value + drive * of_drive.value;
            output.feed += given;
            output.explained += state.given.put(given, now.lead_ticks, now.lead_share);
        }
        output
    }

    /// The sums anew.
    #[inline(never)]
    fn add_up(&self, state: &mut State<T>) {
        let dry = usize::from(self.dry);
        state.sums = [
            total(state.planned.get(..dry).unwrap_or_default()),
            total(last(&state.planned, self.standing)),
            total(state.sliding.get(..dry).unwrap_or_default()),
        ];
    }

    /// How far the contact is bent through which a law acts; none where nothing bends it.
    #[inline(always)]
    fn bent(&self, state: &State<T>, job: &Job) -> Option<T> {
        let contact = usize::from(job.contact?);
        let [planned, sliding] = state.memories.get(contact)?;
        let one = self.effects.get(contact)?.as_ref()?;
        let memory = if job.sliding { sliding } else { planned };
        Some(one.effect.bent(memory, T::ZERO))
    }

    #[inline(always)]
    fn evaluate_next(
        &self,
        settings: &PrecompensationSettings<T>,
        state: &mut State<T>,
        now: &Now<T>,
    ) {
        if self.count == 0 {
            return;
        }
        let Some(job) = self.jobs.get(usize::from(state.turn)) else {
            return;
        };
        state.turn = if state.turn + 1 < self.count {
            state.turn + 1
        } else {
            0
        };
        let k = usize::from(job.effect);
        let bent = self.bent(state, job);
        let (Some(Some(one)), Some([planned, sliding])) =
            (self.effects.get(k), state.memories.get_mut(k))
        else {
            return;
        };
        let (wanted, measured) = (finite(now.reference.velocity), finite(now.velocity));
        let mut instant = now.instant(one.whole);
        if self.on_link > 0 {
            instant.load += total(last(&state.planned, self.on_link));
        }
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
        // Of dry friction nothing is given where nothing moves or is to, whatever a law remembers.
        let rests = one.role == Role::Dry && instant.direction.abs().le(T::ZERO);
        if let Some(bent) = bent {
            instant.direction = bent;
        }
        instant.friction = now.friction(instant.velocity, instant.direction);
        let nowhere = one.role == Role::Standing && !now.placed;
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
