//! Separation of two rivals' predictions along a motion (T-optimality, Atkinson and Fedorov 1975).
//!
//! Leaves out: effects between motor and link and of the voltage, which are no torque along a given motion; the
//! controller's errors.

use nalgebra::{DMatrix, DVector};
use rig_shared::effects::{Channel, Effect, GAINS, Instant, Kind, MEMORY, SHAPES, Scale};

use crate::experiment::nominal::{Held, Nominal};
use crate::experiment::place::Place;
use crate::experiment::primitives::Primitive;

/// Independent torque values per second of a noise floor, as after a low-pass at 40 to 50 Hz.
pub const FLOOR_RATE: f64 = 100.0;
/// Most rows of one motion.
const MOST: usize = 4000;
/// Values tried for each of the rival's shapes.
const STEPS: usize = 12;

/// A motion as instants, pass after pass.
pub(crate) struct Course {
    instants: Vec<Vec<Instant<f64>>>,
    /// Independent values per row.
    weight: f64,
    pub(crate) held: Held,
    /// Described gravity torque with cos q and with sin q, of length 1.
    gravity: [f64; 2],
}

/// Returns true if an effect's torque along a given motion can be computed.
pub(crate) fn predictable(kind: Kind) -> bool {
    !matches!(
        kind.about().channel,
        Channel::Transmission | Channel::Voltage
    ) && !kind.about().gains.is_empty()
}

impl Course {
    pub(crate) fn of(place: &Place, primitive: &Primitive) -> Self {
        let [_, cosine, sine, ..] = place.nominal;
        let length = cosine.hypot(sine);
        let duration = primitive.duration();
        let rows = (duration * FLOOR_RATE).ceil().clamp(1.0, MOST as f64) as usize;
        let period = duration / rows as f64;
        let [inertia, _, _, viscous, coulomb, offset] = place.nominal;
        let instants = primitive.hands.passes().iter().map(|[mass, gravity]| {
            let mut direction = 0.0;
            let mut before: Option<f64> = None;
            let way = primitive.way(place, rows);
            (way.into_iter().enumerate())
                .map(|(k, (at, driven))| {
                    let time = (k as f64 + 0.5) * period;
                    if at.velocity != 0.0 {
                        direction = at.velocity.signum();
                    }
                    let position = primitive.start + at.position;
                    let load = (mass * inertia - place.drive_inertia).max(0.0) * at.acceleration
                        + gravity * place.weight(position);
                    let asked = load
                        + place.drive_inertia * at.acceleration
                        + viscous * at.velocity
                        + coulomb * direction
                        + offset;
                    let drive_torque = if driven { asked } else { 0.0 };
                    let drive_rate = before.map_or(0.0, |b| (drive_torque - b) / period);
                    before = Some(drive_torque);
                    Instant {
                        position,
                        velocity: at.velocity,
                        acceleration: at.acceleration,
                        direction,
                        motor_angle: place.ratio * position,
                        drive_torque,
                        drive_rate,
                        load,
                        friction: viscous * at.velocity + coulomb * direction,
                        gravity: gravity * place.pull_at(position),
                        time,
                        temperature_rise: 0.0,
                        other: [0.0; 3],
                        period,
                        travel: at.velocity * period,
                        extra_friction_ratio: 0.0,
                    }
                })
                .collect()
        });
        Self {
            instants: instants.collect(),
            weight: period * FLOOR_RATE,
            held: Held {
                gravity: place.held.gravity && length > 0.0,
                ..place.held
            },
            gravity: [cosine, sine].map(|part| part / length.max(f64::MIN_POSITIVE)),
        }
    }

    /// Returns the moving rows: at rest, friction may have any value within its bounds.
    fn moving(&self) -> Vec<(usize, usize)> {
        let all = self.instants.iter().enumerate();
        all.flat_map(|(p, pass)| {
            let rows = pass.iter().enumerate();
            rows.filter(|(_, i)| i.velocity != 0.0)
                .map(move |(k, _)| (p, k))
        })
        .collect()
    }

    /// Returns the columns of the standard model, those of the load once per pass. Manual work also changes gravity's
    /// direction.
    fn nominal(&self, rows: &[(usize, usize)], revolute: bool) -> DMatrix<f64> {
        let passes = self.instants.len();
        let own = if revolute { 3 } else { 1 };
        let friction = own * passes;
        let mut x = DMatrix::zeros(rows.len(), friction + 3);
        for (r, (p, k)) in rows.iter().enumerate() {
            let at = &self.instants[*p][*k];
            x[(r, own * p)] = at.acceleration;
            if revolute {
                let (sine, cosine) = at.position.sin_cos();
                if self.held.gravity && *p == 0 {
                    x[(r, own * p + 1)] = self.gravity[0] * cosine + self.gravity[1] * sine;
                } else {
                    x[(r, own * p + 1)] = cosine;
                    x[(r, own * p + 2)] = sine;
                }
            }
            x[(r, friction)] = at.velocity;
            x[(r, friction + 1)] = at.direction;
            if !self.held.constant {
                x[(r, friction + 2)] = 1.0;
            }
        }
        x
    }

    /// Returns the torque per unit of each gain.
    pub(crate) fn columns(
        &self,
        kind: Kind,
        shapes: &[f64; SHAPES],
        rows: &[(usize, usize)],
        nominal: &Nominal,
    ) -> DMatrix<f64> {
        let terms: Vec<Vec<[f64; GAINS]>> = self
            .instants
            .iter()
            .map(|pass| {
                let mut memory = [0.0; MEMORY];
                let own: Vec<[f64; GAINS]> = pass
                    .iter()
                    .map(|at| kind.terms(shapes, &mut memory, at))
                    .collect();
                if kind.about().channel == Channel::Position {
                    misread(&own, pass, nominal)
                } else {
                    own
                }
            })
            .collect();
        DMatrix::from_fn(rows.len(), kind.gains(), |r, g| {
            let (p, k) = rows[r];
            terms[p][k][g]
        })
    }

    /// Returns the squared distance, in units of the noise, between the truth and the best rival of that kind.
    pub(crate) fn separation(
        &self,
        truth: &(Effect<f64>, Nominal),
        rival: &Effect<f64>,
        revolute: bool,
        floor: f64,
    ) -> f64 {
        let rows = self.moving();
        let (effect, nominal) = truth;
        let y = self.columns(effect.kind, &effect.shapes, &rows, nominal)
            * DVector::from_column_slice(&effect.gains[..effect.kind.gains()]);
        let standard = Basis::of(&self.nominal(&rows, revolute));
        let y = standard.rest(y);
        let least = shapes_of(rival)
            .iter()
            .map(|shapes| standard.left(&self.columns(rival.kind, shapes, &rows, nominal), &y))
            .fold(f64::INFINITY, f64::min);
        self.weight * least / (floor * floor).max(f64::MIN_POSITIVE)
    }
}

/// Orthonormal columns.
struct Basis(Vec<DVector<f64>>);

impl Basis {
    fn of(columns: &DMatrix<f64>) -> Self {
        let mut basis = Self(Vec::new());
        basis.extend(columns);
        basis
    }

    /// Returns a vector's part outside the columns; two projections are enough (Kahan).
    fn rest(&self, mut vector: DVector<f64>) -> DVector<f64> {
        for b in self.0.iter().chain(&self.0) {
            let along = b.dot(&vector);
            vector.axpy(-along, b, 1.0);
        }
        vector
    }

    fn extend(&mut self, columns: &DMatrix<f64>) {
        for column in columns.column_iter() {
            let length = column.norm();
            let rest = self.rest(column / length.max(f64::MIN_POSITIVE));
            let left = rest.norm();
            if left > 1e-8 {
                self.0.push(rest / left);
            }
        }
    }

    /// Returns the squared residual of `y`, which is orthogonal to these columns, after a fit of `more` columns.
    fn left(&self, more: &DMatrix<f64>, y: &DVector<f64>) -> f64 {
        let beside: Vec<DVector<f64>> = more
            .column_iter()
            .map(|c| self.rest(c / c.norm().max(f64::MIN_POSITIVE)))
            // A column of the standard model leaves only rounding.
            .filter(|rest| rest.norm() > 1e-8)
            .collect();
        if beside.is_empty() {
            return y.norm_squared();
        }
        let own = Self::of(&DMatrix::from_columns(&beside));
        own.rest(y.clone()).norm_squared()
    }
}

/// Returns the torque error of a wrong position: the torque of the motion as read minus that of the true motion.
fn misread(errors: &[[f64; GAINS]], pass: &[Instant<f64>], nominal: &Nominal) -> Vec<[f64; GAINS]> {
    let [inertia, cosine, sine, viscous, ..] = *nominal;
    let last = errors.len().saturating_sub(1);
    (0..errors.len())
        .map(|k| {
            let at = &pass[k];
            let (before, after) = (errors[k.saturating_sub(1)], errors[(k + 1).min(last)]);
            let (s, c) = at.position.sin_cos();
            core::array::from_fn(|g| {
                let error = errors[k][g];
                let rate = (after[g] - before[g]) / (2.0 * at.period);
                let second = (after[g] - 2.0 * error + before[g]) / (at.period * at.period);
                -(inertia * second + viscous * rate + (sine * c - cosine * s) * error)
            })
        })
        .collect()
}

/// Returns the shapes to try for the rival: its own and a grid over its range.
fn shapes_of(rival: &Effect<f64>) -> Vec<[f64; SHAPES]> {
    let mut list = vec![rival.shapes];
    for (s, shape) in rival.kind.about().shapes.iter().enumerate() {
        let [from, to] = shape.range;
        for k in 0..STEPS {
            let share = k as f64 / (STEPS - 1) as f64;
            let mut shapes = rival.shapes;
            shapes[s] = match shape.scale {
                Scale::Linear => from + share * (to - from),
                Scale::Whole => (from + share * (to - from)).round(),
                Scale::Logarithmic => from * (to / from).powf(share),
            };
            // A narrow range of whole numbers has fewer values than steps.
            if !list.contains(&shapes) {
                list.push(shapes);
            }
        }
    }
    list
}

#[cfg(test)]
pub(crate) mod access {
    //! Access for tests with simulated noise.

    use super::*;

    /// Returns the rows of the standard model and of an effect along a motion.
    pub(in crate::experiment) fn rows(
        course: &Course,
        effect: &Effect<f64>,
        nominal: &Nominal,
        revolute: bool,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let rows = course.moving();
        (
            course.nominal(&rows, revolute),
            course.columns(effect.kind, &effect.shapes, &rows, nominal),
        )
    }

    /// Returns the squared residual of `y` with the standard model and the best rival.
    pub(in crate::experiment) fn best(
        course: &Course,
        rival: &Effect<f64>,
        nominal: &Nominal,
        revolute: bool,
        y: &DVector<f64>,
    ) -> f64 {
        let rows = course.moving();
        let standard = Basis::of(&course.nominal(&rows, revolute));
        let y = standard.rest(y.clone());
        let tried = shapes_of(rival);
        let left = tried
            .iter()
            .map(|s| standard.left(&course.columns(rival.kind, s, &rows, nominal), &y));
        left.fold(f64::INFINITY, f64::min)
    }
}
