//! Compensation of effects beyond the standard model by a controller.
//!
//! The action depends on where the effect acts ([`Role`]):
//!
//! * **Dry friction** follows the rules of the friction law ([`precompensation`](crate::precompensation)). Near rest
//!   the direction is the reference's, beyond the threshold the measurement's. A share of the torque is given,
//!   `gain_at_rest` to `gain`. The speed at which a law is evaluated depends on the law. Where friction falls with
//!   speed (Stribeck), a torque at the reference's speed exceeds the friction of a link that has run ahead, and
//!   drives it further. Where friction rises with speed, a torque at the measured speed takes damping from the loop.
//!   So an effect that falls with speed is evaluated at the faster of reference and link, and any other at the
//!   reference: no torque grows with the measured speed.
//! * **Effects that also exist at rest** (cogging, eccentricity, springs, tilt) are given in full at the measured
//!   position. Such an effect is a known torque like gravity, and its only error comes from the position error. Its
//!   speed is the reference's, for the reason above. Effects that are periodic in the motor's angle are updated at
//!   every tick, for the angle at which the torque will act ([`Inputs::torque_delay`]).
//! * **Presliding friction** builds up over the reference's travel, as dry friction does at once. With the measured
//!   travel it would close a loop of positive sign. Friction through the same contact builds up with it. A tick
//!   has no time for the extra deflection of the contact
//!   ([`Instant::extra_friction_ratio`](crate::effects::Instant::extra_friction_ratio)).
//! * **An eccentric encoder** is corrected in the measured position, and its slope in the velocity. **A constant
//!   current error** is subtracted from the measured current.
//! * **A voltage loss of the bridge** is added to the current loop's voltage, in the direction of the coming current.
//!   It fades within a small band around zero current, where the ripple crosses zero and the loss vanishes.
//!
//! No torque, voltage or correction undoes any other effect. Such effects are refused with the reason
//! ([`Role::refusal`]).
//!
//! Besides the torque to give, a tick returns the drive torque that the effects *explain*: the same laws at the
//! measured motion, in full. An estimator of the standard model must not see that part, or its parameters absorb it.
//!
//! Leaves out: the attenuation of fast torques by the current loop; effects that name another joint.

mod compensated;
mod effect_fault;
mod inputs;
mod list;
mod role;
mod wave;

pub use effect_fault::EffectFault;
pub use inputs::Inputs;
pub use list::{EFFECTS, Effects};
pub use role::Role;

use crate::effects::{Instant, Kind, Memory};
use crate::precompensation::{PrecompensationSettings, finite, share};
use crate::scalar::{Real, Scalar};
use compensated::{Compensated, evaluate};
use wave::{WaveState, Waves};

/// Number of ticks for which the given periodic torques are stored. [`Inputs::delay_ticks`] is at most this less 2.
pub const HISTORY_TICKS: usize = 64;
// A slot is the tick number modulo the number of slots, and the tick number wraps at 256.
const _: () = assert!(HISTORY_TICKS.is_power_of_two() && HISTORY_TICKS <= 256);

/// Result of the compensation in a control tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Output<T> {
    /// Torque to add to the control law's, N·m.
    pub feedforward: T,
    /// Drive torque that the effects explain at the measured motion, N·m. An estimator must not see it.
    pub explained: T,
}

/// Errors of the measured position due to effects.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PositionError<T> {
    /// Error of the position, rad: reading minus true value.
    pub error: T,
    /// Error of the velocity, as a share of it.
    pub slope: T,
}

/// Hidden state of all effects.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T: Real> {
    /// Hidden states of each law: for the planned motion, and for the measured motion.
    memories: [[Memory<T>; 2]; EFFECTS],
    wave_state: WaveState<T>,
    /// Value of each law at the planned motion: dry laws from the front, standing laws from the end.
    planned: [T; EFFECTS],
    /// Value of each dry law at the measured motion.
    sliding: [T; EFFECTS],
    /// Sums of the dry and of the standing laws in `planned`, and of `sliding`. Each law updates them. They are
    /// recomputed once a round, so that rounding errors do not accumulate.
    sums: [T; 3],
    turn: u8,
    history: TorqueHistory<T>,
}

/// Periodic torques given in the last ticks. They are given ahead, and explained when the motor gets there.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TorqueHistory<T> {
    torques: [T; HISTORY_TICKS],
    next: u8,
}

impl<T: Real> Default for TorqueHistory<T> {
    fn default() -> Self {
        Self {
            torques: [T::ZERO; HISTORY_TICKS],
            next: 0,
        }
    }
}

impl<T: Real> TorqueHistory<T> {
    /// Stores the torque given now. Returns the torque given `ticks` + `share` ticks ago, interpolated.
    #[inline(always)]
    fn push(&mut self, torque: T, ticks: u8, share: T) -> T {
        const LAST: usize = HISTORY_TICKS - 1;
        let next = usize::from(self.next);
        self.torques[next & LAST] = torque;
        self.next = self.next.wrapping_add(1);
        let at = |ago: usize| self.torques[next.wrapping_sub(ago) & LAST];
        let (newer, older) = (at(usize::from(ticks)), at(usize::from(ticks) + 1));
        newer + share * (older - newer)
    }
}

impl<T: Real> State<T> {
    /// Discards all values after skipped ticks: they no longer hold.
    pub fn interrupt(&mut self) {
        self.planned = [T::ZERO; EFFECTS];
        self.sliding = [T::ZERO; EFFECTS];
        self.sums = [T::ZERO; 3];
        self.memories = [[Memory::default(); 2]; EFFECTS];
        self.turn = 0;
        self.history = TorqueHistory::default();
    }

    /// Discards the periodic state, because the position is unknown. Not inlined: it is seldom called.
    #[cold]
    #[inline(never)]
    fn forget(&mut self) {
        self.wave_state = WaveState::default();
    }
}

/// Returns the sum of values. Not inlined: a chip's fast memory is small.
#[inline(never)]
fn total<T: Real>(values: &[T]) -> T {
    values.iter().fold(T::ZERO, |sum, value| sum + *value)
}

/// Returns the last `count` values.
#[inline(always)]
fn last<T>(values: &[T; EFFECTS], count: u8) -> &[T] {
    let first = EFFECTS.saturating_sub(usize::from(count));
    values.get(first..).unwrap_or_default()
}

/// A law to be evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Job {
    effect: u8,
    /// Index among the values.
    place: u8,
    /// True if it is evaluated at the measured motion instead of the planned one.
    sliding: bool,
    /// Index of the presliding effect through whose contact it acts.
    contact: Option<u8>,
}

/// The checked effects of a rig.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Compensation<T> {
    effects: [Option<Compensated<T>>; EFFECTS],
    /// The laws to be evaluated in turn, one in each tick.
    jobs: [Job; 2 * EFFECTS],
    count: u8,
    /// Number of dry and of standing effects.
    dry_count: u8,
    static_count: u8,
    /// Number of standing effects on the link (they come first); 0 if no effect depends on the transmitted torque.
    on_link: u8,
    /// Number of evaluated ticks between two turns of a law.
    round: T,
    waves: Waves<T>,
    /// True if an effect depends on the transmitted torque.
    needs_load: bool,
}

impl<T: Scalar> Compensation<T> {
    /// Checks all effects.
    ///
    /// # Errors
    /// Returns the fault of the first effect that cannot be used.
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
        // Effects on the link come first, so that their values are contiguous.
        for on_link in [true, false] {
            for (k, one) in all.effects.into_iter().enumerate() {
                let Some(one) = one else { continue };
                if one.effect.kind.acts_on_link() == on_link {
                    all.place(k, &one, contact);
                }
            }
            if on_link && all.needs_load {
                all.on_link = all.static_count;
            }
        }
        all.waves = Waves::new(&all.effects);
        Ok(all)
    }

    /// Assigns an effect its jobs and its place among the values.
    fn place(&mut self, effect: usize, one: &Compensated<T>, contact: Option<u8>) {
        let kind = one.effect.kind;
        let job = |place: u8, sliding: bool| Job {
            effect: effect as u8,
            place,
            sliding,
            contact: contact.filter(|_| kind.acts_through_contact()),
        };
        match one.role {
            Role::DryFriction => {
                self.add(job(self.dry_count, false));
                self.add(job(self.dry_count, true));
                self.dry_count += 1;
            }
            Role::StaticTorque if kind.periodic().is_none() => {
                self.static_count += 1;
                self.add(job(EFFECTS as u8 - self.static_count, false));
            }
            Role::StaticTorque | Role::Position | Role::Current | Role::Voltage => {}
        }
    }

    fn add(&mut self, job: Job) {
        if let Some(place) = self.jobs.get_mut(usize::from(self.count)) {
            *place = job;
            self.count += 1;
            self.round += T::ONE;
        }
    }

    /// Returns the effects as they were given.
    pub fn effects(&self) -> Effects<T> {
        self.effects.map(|one| one.map(|one| one.effect))
    }

    /// Returns true if any effect gives a torque.
    #[inline(always)]
    pub fn has_torque(&self) -> bool {
        self.count > 0 || self.waves.has_torque_waves()
    }

    /// Returns true if any effect is periodic and must get the angle at every tick.
    #[inline(always)]
    pub fn has_waves(&self) -> bool {
        self.waves.any()
    }

    /// Returns true if an effect depends on the torque that the gear transmits.
    #[inline(always)]
    pub fn needs_load(&self) -> bool {
        self.needs_load
    }

    /// Returns the voltage that the bridge loses against the current, V.
    pub fn lost_voltage(&self) -> T {
        let lost = |one: &Compensated<T>| one.effect.gains[0];
        let all = self.effects.iter().flatten();
        all.filter(|one| one.role == Role::Voltage)
            .fold(T::ZERO, |sum, one| sum + lost(one))
    }

    /// Returns the largest error of the velocity due to the encoder, as a share of the velocity.
    pub fn position_slope(&self, gear_ratio: T) -> T {
        self.waves.position_slope(gear_ratio)
    }

    /// Returns the constant error of the measured current, A. `torque_per_ampere` is in N·m/A.
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

    /// Moves periodic effects to the current angle. Returns the encoder's error there, evaluated at the reading
    /// instead of the true position; this is wrong by the square of the error.
    #[inline(always)]
    pub fn turn(&self, state: &mut State<T>, inputs: &Inputs<T>) -> PositionError<T> {
        if !inputs.position_known {
            state.forget();
            return PositionError::default();
        }
        if inputs.rotates_waves {
            self.waves.turn(&mut state.wave_state, inputs);
        }
        if !self.waves.has_position_waves() {
            return PositionError::default();
        }
        let [motor, joint] = self.waves.position(&state.wave_state, inputs);
        PositionError {
            error: motor.value + joint.value,
            slope: motor.slope * inputs.gear_ratio + joint.slope,
        }
    }

    /// Returns the torque to give and the torque that is explained. The result is finite for any input.
    ///
    /// In each tick that is not busy one law is evaluated, in turn. Its value is held until its next turn, and is
    /// taken for the middle of that time. Call [`turn`](Self::turn) first: it updates the periodic effects.
    #[inline(always)]
    pub fn torque(
        &self,
        settings: &PrecompensationSettings<T>,
        state: &mut State<T>,
        inputs: &Inputs<T>,
    ) -> Output<T> {
        if !inputs.busy {
            self.evaluate_next(settings, state, inputs);
        }
        let [dry, static_torque, sliding] = state.sums;
        let share = if settings.enabled && self.dry_count > 0 {
            share(
                settings,
                finite(inputs.reference.velocity),
                finite(inputs.velocity),
            )
        } else {
            T::ZERO
        };
        let mut output = Output {
            feedforward: share * dry + static_torque,
            explained: sliding + static_torque,
        };
        if self.waves.has_torque_waves() {
            let [torque, per_drive_torque] = self.waves.torque(&state.wave_state, inputs);
            let drive = finite(inputs.drive_torque);
            let periodic = torque.value + drive * per_drive_torque.value;
            output.feedforward += periodic;
            output.explained +=
                state
                    .history
                    .push(periodic, inputs.delay_ticks, inputs.delay_fraction);
        }
        output
    }

    /// Recomputes the sums.
    #[inline(never)]
    fn add_up(&self, state: &mut State<T>) {
        let dry = usize::from(self.dry_count);
        state.sums = [
            total(state.planned.get(..dry).unwrap_or_default()),
            total(last(&state.planned, self.static_count)),
            total(state.sliding.get(..dry).unwrap_or_default()),
        ];
    }

    /// Returns the deflection of the contact through which a law acts; none if it acts through no contact.
    #[inline(always)]
    fn contact_deflection(&self, state: &State<T>, job: &Job) -> Option<T> {
        let contact = usize::from(job.contact?);
        let [planned, sliding] = state.memories.get(contact)?;
        let one = self.effects.get(contact)?.as_ref()?;
        let memory = if job.sliding { sliding } else { planned };
        Some(one.effect.contact_deflection(memory, T::ZERO))
    }

    #[inline(always)]
    fn evaluate_next(
        &self,
        settings: &PrecompensationSettings<T>,
        state: &mut State<T>,
        inputs: &Inputs<T>,
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
        let contact_deflection = self.contact_deflection(state, job);
        let (Some(Some(one)), Some([planned, sliding])) =
            (self.effects.get(k), state.memories.get_mut(k))
        else {
            return;
        };
        let (planned_velocity, measured_velocity) =
            (finite(inputs.reference.velocity), finite(inputs.velocity));
        let mut instant = inputs.instant(one.whole);
        if self.on_link > 0 {
            instant.load += total(last(&state.planned, self.on_link));
        }
        instant.period = inputs.period * self.round;
        // To the middle of the time for which the value is held.
        let travel = T::from_f64(0.5) * (instant.period - inputs.period) * measured_velocity;
        instant.position += travel;
        instant.motor_angle += travel * inputs.gear_ratio;
        let (place, memory) = if job.sliding {
            instant.velocity = measured_velocity;
            instant.direction = measured_velocity.sgn();
            (&mut state.sliding, sliding)
        } else {
            one.plan(
                &mut instant,
                settings.velocity_threshold,
                planned_velocity,
                measured_velocity,
            );
            (&mut state.planned, planned)
        };
        instant.travel = instant.velocity * instant.period;
        // Dry friction gives no torque where the direction is 0, for any hidden state.
        let at_rest = one.role == Role::DryFriction && instant.direction.abs().le(T::ZERO);
        if let Some(contact_deflection) = contact_deflection {
            instant.direction = contact_deflection;
        }
        instant.friction = inputs.friction(instant.velocity, instant.direction);
        let position_unknown = one.role == Role::StaticTorque && !inputs.position_known;
        let torque = if position_unknown {
            T::ZERO
        } else {
            evaluate(&one.effect, memory, &instant)
        };
        let torque = if at_rest { T::ZERO } else { torque };
        let sum = match (one.role, job.sliding) {
            (_, true) => 2,
            (Role::StaticTorque, _) => 1,
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
