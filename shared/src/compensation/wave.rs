//! Periodic effects. They are rotated with their angle in every second tick and extrapolated along a parabola in the
//! other. Once in a while each is set to its own formula.
//!
//! A wave cosine·cos φ + sine·sin φ and its value a quarter of a period later form a pair. A rotation by order times
//! the change of the angle updates the pair. This costs less than sine and cosine of the angle, and is accurate in
//! any tick between two resets. The first and second derivatives extrapolate the sums between two rotations.
//!
//! A wave whose phase moves by more than 1.5 rad between two rotations (order 84 over 50 : 1 above 1.8 rad/s) is 0. A
//! current loop of a twentieth of the tick's rate gives at best half of it, and a jump makes the phase unknown.

use super::compensated::Compensated;
use super::inputs::Inputs;
use super::list::EFFECTS;
use super::role::Role;
use crate::effects::Periodic;
use crate::precompensation::finite;
use crate::scalar::{Real, Scalar};

/// Largest change of the phase between two rotations, rad.
const MAX_PHASE_STEP: f64 = 1.5;

/// The sums to which waves belong: position errors by the motor's angle and by the joint's, torques, and torques per
/// drive torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum WaveGroup {
    #[default]
    Motor,
    Joint,
    Torque,
    PerDriveTorque,
}

impl WaveGroup {
    fn of<T>(one: &Compensated<T>) -> Option<Self> {
        Some(match (one.role, one.effect.kind.periodic()?) {
            (Role::Position, Periodic::Joint) => Self::Joint,
            (Role::Position, _) => Self::Motor,
            (_, Periodic::MotorTimesDrive) => Self::PerDriveTorque,
            _ => Self::Torque,
        })
    }

    /// Returns its index.
    #[inline(always)]
    fn index(self) -> usize {
        self as usize & 3
    }
}

/// An effect that is a sinusoid of an angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Wave<T> {
    /// Periods per turn of the angle.
    order: T,
    cosine: T,
    sine: T,
    group: WaveGroup,
    /// True if the order is whole. The motor's angle within a turn then suffices, and has less rounding error.
    whole: bool,
}

/// Value of a wave, and its value a quarter of a period later.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Phasor<T> {
    value: T,
    ahead: T,
}

/// Angles of the four sorts, or their changes, rad. A torque's angle is that at which a torque ordered now acts.
type Angles<T> = [T; 4];

/// Sum of the waves of a sort.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sum<T> {
    pub(super) value: T,
    /// First and second derivative by the angle: value per rad and per rad².
    pub(super) slope: T,
    curvature: T,
}

impl<T: Real> Sum<T> {
    /// Returns the sum after the given change of angle.
    #[inline(always)]
    pub(super) fn extrapolate(self, angle: T) -> Self {
        let half = T::from_f64(0.5);
        Self {
            value: self.value + angle * (self.slope + half * angle * self.curvature),
            slope: self.slope + angle * self.curvature,
            curvature: self.curvature,
        }
    }
}

/// The periodic effects of a rig.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Waves<T> {
    /// Grouped by sort.
    waves: [Wave<T>; EFFECTS],
    count: u8,
    has_position_waves: bool,
    has_torque_waves: bool,
    highest_order: T,
}

/// Current state of the waves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WaveState<T> {
    phasors: [Phasor<T>; EFFECTS],
    at: Angles<T>,
    sums: [Sum<T>; 4],
    /// Highest order among the waves that are not too fast.
    highest_order: T,
    /// Index of the wave that is set to its formula next.
    next: u8,
}

impl<T: Scalar> Waves<T> {
    pub(super) fn new(effects: &[Option<Compensated<T>>; EFFECTS]) -> Self {
        let mut all = Self::default();
        // Grouped by sort.
        for group in [
            WaveGroup::Motor,
            WaveGroup::Joint,
            WaveGroup::Torque,
            WaveGroup::PerDriveTorque,
        ] {
            for one in effects.iter().flatten() {
                let Some(wave) = all.waves.get_mut(usize::from(all.count)) else {
                    break;
                };
                if WaveGroup::of(one) != Some(group) {
                    continue;
                }
                let [cosine, sine, ..] = one.effect.gains;
                *wave = Wave {
                    order: one.effect.shapes[0],
                    cosine,
                    sine,
                    group,
                    whole: one.whole,
                };
                all.count += 1;
                all.highest_order = all.highest_order.max(wave.order);
                if matches!(group, WaveGroup::Motor | WaveGroup::Joint) {
                    all.has_position_waves = true;
                } else {
                    all.has_torque_waves = true;
                }
            }
        }
        all
    }

    /// Returns the largest slope of the position error: the sum of amplitude times order over motor and joint waves.
    pub(super) fn position_slope(&self, gear_ratio: T) -> T {
        let waves = self.waves.iter().take(usize::from(self.count));
        waves.fold(T::ZERO, |sum, wave| {
            let amplitude = (wave.cosine * wave.cosine + wave.sine * wave.sine).sqrt();
            let slope = amplitude * wave.order.abs();
            sum + match wave.group {
                WaveGroup::Motor => slope * gear_ratio.abs(),
                WaveGroup::Joint => slope,
                WaveGroup::Torque | WaveGroup::PerDriveTorque => T::ZERO,
            }
        })
    }

    #[inline(always)]
    pub(super) fn any(&self) -> bool {
        self.count > 0
    }

    #[inline(always)]
    pub(super) fn has_position_waves(&self) -> bool {
        self.has_position_waves
    }

    #[inline(always)]
    pub(super) fn has_torque_waves(&self) -> bool {
        self.has_torque_waves
    }

    /// Returns the position error by the motor's angle and by the joint's.
    #[inline(always)]
    pub(super) fn position(&self, wave_state: &WaveState<T>, inputs: &Inputs<T>) -> [Sum<T>; 2] {
        let [motor, joint, ..] = wave_state.at;
        let [of_motor, of_joint, ..] = wave_state.sums;
        [
            wave_state.extrapolate(of_motor, inputs.motor_angle - motor),
            wave_state.extrapolate(of_joint, inputs.position - joint),
        ]
    }

    /// Returns the torque at the moment when an order of now acts, and the same per drive torque.
    #[inline(always)]
    pub(super) fn torque(&self, wave_state: &WaveState<T>, inputs: &Inputs<T>) -> [Sum<T>; 2] {
        let [.., torque, per_drive_torque] = wave_state.sums;
        let change = future_motor_angle(inputs) - wave_state.at[2];
        [torque, per_drive_torque].map(|sum| wave_state.extrapolate(sum, change))
    }

    /// Rotates all waves to the current angles. If the tick has time, first sets one of them to its formula.
    ///
    /// Not inlined: it needs registers of its own.
    #[inline(never)]
    pub(super) fn turn(&self, wave_state: &mut WaveState<T>, inputs: &Inputs<T>) {
        let f = T::from_f64;
        let future_motor_angle = future_motor_angle(inputs);
        let at = [
            inputs.motor_angle,
            inputs.position,
            future_motor_angle,
            future_motor_angle,
        ];
        let [motor, joint, before, _] = core::mem::replace(&mut wave_state.at, at);
        let ahead = future_motor_angle - before;
        let mut change = [at[0] - motor, at[1] - joint, ahead, ahead];
        if !inputs.busy {
            self.refresh_phasor(wave_state, inputs, &at, &change);
        }
        let largest_change = change[0].abs().max(change[1].abs()).max(change[2].abs());
        // The negation also catches NaN.
        if !(largest_change * wave_state.highest_order).le(f(MAX_PHASE_STEP)) {
            self.drop_fast(wave_state, &mut change);
        }
        // A sum is stored where the next sort begins. The sum of a sort without waves stays 0.
        let mut group = WaveGroup::default();
        let mut group_change = change[group.index()];
        let mut sum = Sum::default();
        let waves = self.waves.iter().take(usize::from(self.count));
        for (wave, phasor) in waves.zip(&mut wave_state.phasors) {
            if wave.group != group {
                wave_state.sums[group.index()] = sum;
                sum = Sum::default();
                group = wave.group;
                group_change = change[group.index()];
            }
            let order = wave.order;
            let angle = order * group_change;
            // Taylor series: errors of 3·10⁻³ and 6·10⁻⁴ at 1.5 rad, 2·10⁻⁴ and 3·10⁻⁵ at 1 rad.
            let square = angle * angle;
            let sine = angle * (T::ONE - square * (f(1.0 / 6.0) - square * f(1.0 / 120.0)));
            let cosine =
                T::ONE - square * (f(0.5) - square * (f(1.0 / 24.0) - square * f(1.0 / 720.0)));
            let (value, ahead) = (phasor.value, phasor.ahead);
            phasor.value = cosine * value + sine * ahead;
            phasor.ahead = cosine * ahead - sine * value;
            sum.value += phasor.value;
            sum.slope += order * phasor.ahead;
            sum.curvature -= order * (order * phasor.value);
        }
        wave_state.sums[group.index()] = sum;
    }

    /// Sets the next wave to its formula at the previous angles; the rotation then moves it to the current ones.
    #[inline(always)]
    fn refresh_phasor(
        &self,
        wave_state: &mut WaveState<T>,
        inputs: &Inputs<T>,
        at: &Angles<T>,
        change: &Angles<T>,
    ) {
        let place = wave_state.next;
        wave_state.next = if place + 1 < self.count { place + 1 } else { 0 };
        let place = usize::from(place);
        let (Some(wave), Some(phasor)) = (self.waves.get(place), wave_state.phasors.get_mut(place))
        else {
            return;
        };
        let k = wave.group.index();
        let short = wave.whole && wave.group != WaveGroup::Joint;
        let angle = if short {
            inputs.angle_in_turn + (at[k] - inputs.motor_angle)
        } else {
            at[k]
        };
        let (sine, cosine) = (wave.order * (angle - change[k])).sin_cos();
        *phasor = Phasor {
            value: wave.cosine * cosine + wave.sine * sine,
            ahead: wave.sine * cosine - wave.cosine * sine,
        };
        wave_state.highest_order = self.highest_order;
    }

    /// Sets waves whose phase has moved too far to 0.
    #[cold]
    #[inline(never)]
    fn drop_fast(&self, wave_state: &mut WaveState<T>, change: &mut Angles<T>) {
        let largest_change = T::from_f64(MAX_PHASE_STEP);
        wave_state.highest_order = T::ZERO;
        for (wave, phasor) in self.waves.iter().zip(&mut wave_state.phasors) {
            let angle = wave.order * change[wave.group.index()];
            if angle.abs().le(largest_change) {
                wave_state.highest_order = wave_state.highest_order.max(wave.order);
            } else {
                *phasor = Phasor::default();
            }
        }
        // These changes rotate no wave, but may be NaN.
        for change in change {
            *change = T::select(change.abs().le(largest_change), *change, T::ZERO);
        }
    }
}

impl<T: Real<Mask = bool>> WaveState<T> {
    /// Returns a sum after a change of angle; 0 if the change is too large.
    #[inline(always)]
    fn extrapolate(&self, sum: Sum<T>, change: T) -> Sum<T> {
        let near = (change * self.highest_order)
            .abs()
            .le(T::from_f64(MAX_PHASE_STEP));
        if near {
            sum.extrapolate(change)
        } else {
            Sum::default()
        }
    }
}

/// Returns the motor's angle when a torque ordered now acts, rad.
#[inline(always)]
fn future_motor_angle<T: Real>(inputs: &Inputs<T>) -> T {
    inputs.motor_angle + inputs.torque_delay * finite(inputs.velocity) * inputs.gear_ratio
}

#[cfg(test)]
#[path = "wave_test.rs"]
mod tests;
