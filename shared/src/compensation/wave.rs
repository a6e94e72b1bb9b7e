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
use super::list::EFFECTS;
use super::now::Now;
use super::role::Role;
use crate::effects::Periodic;
use crate::precompensation::finite;
use crate::scalar::{Real, Scalar};

/// Largest change of the phase between two rotations, rad.
const FARTHEST: f64 = 1.5;

/// The sums to which waves belong: position errors by the motor's angle and by the joint's, torques, and torques per
/// drive torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Sort {
    #[default]
    Motor,
    Joint,
    Torque,
    OfDrive,
}

impl Sort {
    fn of<T>(one: &Compensated<T>) -> Option<Self> {
        Some(match (one.role, one.effect.kind.periodic()?) {
            (Role::Position, Periodic::Joint) => Self::Joint,
            (Role::Position, _) => Self::Motor,
            (_, Periodic::MotorTimesDrive) => Self::OfDrive,
            _ => Self::Torque,
        })
    }

    /// Returns its index.
    #[inline(always)]
    fn place(self) -> usize {
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
    sort: Sort,
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
    bend: T,
}

impl<T: Real> Sum<T> {
    /// Returns the sum after the given change of angle.
    #[inline(always)]
    pub(super) fn after(self, angle: T) -> Self {
        let half = T::from_f64(0.5);
        Self {
            value: self.value + angle * (self.slope + half * angle * self.bend),
            slope: self.slope + angle * self.bend,
            bend: self.bend,
        }
    }
}

/// The periodic effects of a rig.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Waves<T> {
    /// Grouped by sort.
    waves: [Wave<T>; EFFECTS],
    count: u8,
    of_position: bool,
    of_torque: bool,
    highest_order: T,
}

/// Current state of the waves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Stand<T> {
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
        for sort in [Sort::Motor, Sort::Joint, Sort::Torque, Sort::OfDrive] {
            for one in effects.iter().flatten() {
                let Some(wave) = all.waves.get_mut(usize::from(all.count)) else {
                    break;
                };
                if Sort::of(one) != Some(sort) {
                    continue;
                }
                let [cosine, sine, ..] = one.effect.gains;
                *wave = Wave {
                    order: one.effect.shapes[0],
                    cosine,
                    sine,
                    sort,
                    whole: one.whole,
                };
                all.count += 1;
                all.highest_order = all.highest_order.max(wave.order);
                if matches!(sort, Sort::Motor | Sort::Joint) {
                    all.of_position = true;
                } else {
                    all.of_torque = true;
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
            sum + match wave.sort {
                Sort::Motor => slope * gear_ratio.abs(),
                Sort::Joint => slope,
                Sort::Torque | Sort::OfDrive => T::ZERO,
            }
        })
    }

    #[inline(always)]
    pub(super) fn any(&self) -> bool {
        self.count > 0
    }

    #[inline(always)]
    pub(super) fn of_position(&self) -> bool {
        self.of_position
    }

    #[inline(always)]
    pub(super) fn of_torque(&self) -> bool {
        self.of_torque
    }

    /// Returns the position error by the motor's angle and by the joint's.
    #[inline(always)]
    pub(super) fn position(&self, stand: &Stand<T>, now: &Now<T>) -> [Sum<T>; 2] {
        let [motor, joint, ..] = stand.at;
        let [of_motor, of_joint, ..] = stand.sums;
        [
            stand.after(of_motor, now.motor_angle - motor),
            stand.after(of_joint, now.position - joint),
        ]
    }

    /// Returns the torque at the moment when an order of now acts, and the same per drive torque.
    #[inline(always)]
    pub(super) fn torque(&self, stand: &Stand<T>, now: &Now<T>) -> [Sum<T>; 2] {
        let [.., torque, of_drive] = stand.sums;
        let moved = later(now) - stand.at[2];
        [torque, of_drive].map(|sum| stand.after(sum, moved))
    }

    /// Rotates all waves to the current angles. If the tick has time, first sets one of them to its formula.
    ///
    /// Not inlined: it needs registers of its own.
    #[inline(never)]
    pub(super) fn turn(&self, stand: &mut Stand<T>, now: &Now<T>) {
        let f = T::from_f64;
        let later = later(now);
        let at = [now.motor_angle, now.position, later, later];
        let [motor, joint, before, _] = core::mem::replace(&mut stand.at, at);
        let ahead = later - before;
        let mut moved = [at[0] - motor, at[1] - joint, ahead, ahead];
        if !now.busy {
            self.set(stand, now, &at, &moved);
        }
        let farthest = moved[0].abs().max(moved[1].abs()).max(moved[2].abs());
        // The negation also catches NaN.
        if !(farthest * stand.highest_order).le(f(FARTHEST)) {
            self.drop_fast(stand, &mut moved);
        }
        // A sum is stored where the next sort begins. The sum of a sort without waves stays 0.
        let mut sort = Sort::default();
        let mut way = moved[sort.place()];
        let mut sum = Sum::default();
        let waves = self.waves.iter().take(usize::from(self.count));
        for (wave, phasor) in waves.zip(&mut stand.phasors) {
            if wave.sort != sort {
                stand.sums[sort.place()] = sum;
                sum = Sum::default();
                sort = wave.sort;
                way = moved[sort.place()];
            }
            let order = wave.order;
            let angle = order * way;
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
            sum.bend -= order * (order * phasor.value);
        }
        stand.sums[sort.place()] = sum;
    }

    /// Sets the next wave to its formula at the previous angles; the rotation then moves it to the current ones.
    #[inline(always)]
    fn set(&self, stand: &mut Stand<T>, now: &Now<T>, at: &Angles<T>, moved: &Angles<T>) {
        let place = stand.next;
        stand.next = if place + 1 < self.count { place + 1 } else { 0 };
        let place = usize::from(place);
        let (Some(wave), Some(phasor)) = (self.waves.get(place), stand.phasors.get_mut(place))
        else {
            return;
        };
        let k = wave.sort.place();
        let short = wave.whole && wave.sort != Sort::Joint;
        let angle = if short {
            now.angle_in_turn + (at[k] - now.motor_angle)
        } else {
            at[k]
        };
        let (sine, cosine) = (wave.order * (angle - moved[k])).sin_cos();
        *phasor = Phasor {
            value: wave.cosine * cosine + wave.sine * sine,
            ahead: wave.sine * cosine - wave.cosine * sine,
        };
        stand.highest_order = self.highest_order;
    }

    /// Sets waves whose phase has moved too far to 0.
    #[cold]
    #[inline(never)]
    fn drop_fast(&self, stand: &mut Stand<T>, moved: &mut Angles<T>) {
        let farthest = T::from_f64(FARTHEST);
        stand.highest_order = T::ZERO;
        for (wave, phasor) in self.waves.iter().zip(&mut stand.phasors) {
            let angle = wave.order * moved[wave.sort.place()];
            if angle.abs().le(farthest) {
                stand.highest_order = stand.highest_order.max(wave.order);
            } else {
                *phasor = Phasor::default();
            }
        }
        // These changes rotate no wave, but may be NaN.
        for moved in moved {
            *moved = T::select(moved.abs().le(farthest), *moved, T::ZERO);
        }
    }
}

impl<T: Real<Mask = bool>> Stand<T> {
    /// Returns a sum after a change of angle; 0 if the change is too large.
    #[inline(always)]
    fn after(&self, sum: Sum<T>, moved: T) -> Sum<T> {
        let near = (moved * self.highest_order).abs().le(T::from_f64(FARTHEST));
        if near {
            sum.after(moved)
        } else {
            Sum::default()
        }
    }
}

/// Returns the motor's angle when a torque ordered now acts, rad.
#[inline(always)]
fn later<T: Real>(now: &Now<T>) -> T {
    now.motor_angle + now.lead * finite(now.velocity) * now.gear_ratio
}

#[cfg(test)]
#[path = "wave_test.rs"]
mod tests;
