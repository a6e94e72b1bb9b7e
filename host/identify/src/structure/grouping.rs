//! Base parameters by rules, from the geometry alone: without random states or a numeric rank.
//!
//! Parameters that a link shares with the preceding link are moved there (Gautier & Khalil 1990; Khalil & Dombre 2002,
//! sec. 9.4; stated here as a transfer of masses, after Ros et al. 2012). For a revolute joint these are a mass on its
//! axis, a first moment along it, and an inertia that is equal about all axes across it; for a prismatic joint, the
//! whole tensor. So `m`, `mz`, `Iyy` of a revolute link and all six inertias of a prismatic one join the preceding
//! link. Those of the first link vanish in the base.
//!
//! More rules hold for links that turn about at most one fixed direction a (up to the second direction of revolute
//! joints):
//! * Before the first revolute joint nothing turns, so first moments and inertias have no effect.
//! * If all turn about a, only the inertia about a counts and a first moment along a has no effect. The first moment of
//!   a prismatic link that slides along a moves to the preceding link.
//! * If the origin does not move across a and gravity is along a, first moments have no effect.
//! * Without gravity, if all axes so far meet in a point, a first moment is an inertia about that point.
//!
//! `Ia` joins `Izz` of the first revolute joint, and of the first that turns about a second, perpendicular direction.
//! For a prismatic joint of fixed direction, perpendicular to the preceding prismatic ones, `Ia` is the moved mass
//! minus the mass moving along; its constant torque `off` states gravity.
//!
//! No rules are published for motors of coupled drives. Rule used here: with constant ratios, the inertia of a motor is
//! a fixed quadratic form in the joint velocities. It joins parameters whose forms add up to it: `Ia`; `Izz` of links
//! whose rotation about their own axis is a fixed sum of joint velocities (those that turn about one direction or about
//! a second one); and, for a prismatic joint of fixed direction, the moved mass minus the same mass at rest on the
//! preceding link. The last form contains the joint's velocity squared and times those of the preceding prismatic
//! joints. All other motor parameters are taken as independent.

use nalgebra::{DMatrix, Isometry3, Translation3, UnitQuaternion, Vector3};
use rig_numerics::svd::Svd;
use rig_shared::multibody::{COLUMNS, JointGeometry, JointKind, column};
use rig_shared::transmission::{DriveKind, MOTOR_COLUMNS, Transmission, motor_column};

use super::base::Base;
use super::chain::chain_of;
use crate::error::IdentifyError;
use rig_model::robot::Robot;

/// Sine or cosine below which directions are parallel or perpendicular. Real geometries have no values between this and
/// the tolerance of the numeric method.
const EXACT: f64 = 1e-9;
const XX: usize = 4;
const XY: usize = 5;
const XZ: usize = 6;
const YY: usize = 7;
const YZ: usize = 8;
const ZZ: usize = 9;

/// A column as a combination of kept columns, one entry per column.
type Combination = Vec<f64>;

/// Returns the base parameters of `robot` by the rules: kept columns and combinations as in [`Base::structural`]. They
/// hold for the differential and the integral model.
///
/// # Errors
/// [`IdentifyError::Model`] if the geometry is invalid.
pub fn grouped(robot: &Robot) -> Result<Base, IdentifyError> {
    chain_of(robot)?;
    robot
        .without_followers("The grouping of base parameters by rules")
        .map_err(|e| IdentifyError::Model(e.to_string()))?;
    let transmission = robot
        .transmission()
        .map_err(|e| IdentifyError::Model(e.to_string()))?;
    let n = robot.joints.len();
    let motors = if transmission.is_simple() { 0 } else { 3 * n };
    let width = n * COLUMNS + motors;
    let geometry = robot.geometry();
    let mut walk = Walk::new(&geometry, robot.gravity, width);
    for j in 0..n {
        walk.link(j);
    }
    let (spins, moved) = (walk.spins, walk.moved);
    let mut columns = walk.columns;
    for j in 0..n {
        if !transmission.has_joint_inertia(j) {
            columns[j * COLUMNS + column::DRIVE_INERTIA] = vec![0.0; width];
        }
    }
    // Columns of the motors: zero where the drive is simple.
    for c in n * COLUMNS..width {
        let simple = transmission.kind((c - n * COLUMNS) / 3) == Some(DriveKind::Simple);
        columns.push(unit(width, c, if simple { 0.0 } else { 1.0 }));
    }
    if motors > 0 {
        join_motors(&transmission, &spins, moved, &mut columns)?;
    }
    let kept: Vec<usize> = (0..width).filter(|&c| columns[c][c] == 1.0).collect();
    let combination = DMatrix::from_fn(kept.len(), width, |row, c| columns[c][kept[row]]);
    Ok(Base {
        columns: kept,
        combination,
        kinds: robot.link_kinds(),
        joints: (0..n).collect(),
        drives: robot.drive_kinds(),
    })
}

/// Replaces the inertia of coupled motors by parameters with the same quadratic form, if there are any.
fn join_motors(
    transmission: &Transmission<f64>,
    spins: &[Option<Vec<f64>>],
    moved: Vec<(Combination, DMatrix<f64>)>,
    columns: &mut [Combination],
) -> Result<(), IdentifyError> {
    let n = spins.len();
    let square = |v: &[f64]| DMatrix::from_fn(n, n, |i, j| v[i] * v[j]);
    // Parameters with a constant form, together with that form.
    let mut forms = moved;
    for (j, spin) in spins.iter().enumerate() {
        if let Some(spin) = spin {
            forms.push((columns[j * COLUMNS + ZZ].clone(), square(spin)));
        }
        if transmission.has_joint_inertia(j) {
            let mut own = vec![0.0; n];
            own[j] = 1.0;
            let column = &columns[j * COLUMNS + column::DRIVE_INERTIA];
            forms.push((column.clone(), square(&own)));
        }
    }
    let mut directions = vec![0.0; n * n];
    let coupled = |k: usize| transmission.kind(k) == Some(DriveKind::Coupled);
    // A screw's direction is not needed, so its position may be one that it cannot have.
    transmission
        .motor_directions(&vec![0.0; n], &mut directions)
        .map_err(|e| IdentifyError::Model(e.to_string()))?;
    let ratios = |k: usize| &directions[k * n..(k + 1) * n];
    for k in (0..n).filter(|k| coupled(*k)) {
        let mut form = square(ratios(k));
        for i in (0..n).filter(|i| *i != k) {
            form[(i, i)] -= ratios(k)[i].powi(2);
        }
        let own = n * COLUMNS + MOTOR_COLUMNS * k + motor_column::INERTIA;
        join(own, form, &mut forms, columns);
    }
    // Viscous friction is such a form too; that of the joints is the square of their own velocity.
    let mut forms: Vec<(Combination, DMatrix<f64>)> = Vec::new();
    for j in 0..n {
        let mut own = vec![0.0; n];
        own[j] = 1.0;
        let column = &columns[j * COLUMNS + column::VISCOUS];
        forms.push((column.clone(), square(&own)));
    }
    for k in (0..n).filter(|k| coupled(*k)) {
        let mut form = square(ratios(k));
        for i in 0..n {
            form[(i, i)] = 0.0;
        }
        let own = n * COLUMNS + MOTOR_COLUMNS * k + motor_column::VISCOUS;
        join(own, form, &mut forms, columns);
    }
    Ok(())
}

/// Expresses column `own` by others if their forms add up to its form; otherwise adds it to them.
fn join(
    own: usize,
    form: DMatrix<f64>,
    forms: &mut Vec<(Combination, DMatrix<f64>)>,
    columns: &mut [Combination],
) {
    let entries = form.len();
    let wanted = DMatrix::from_column_slice(entries, 1, form.as_slice());
    let there = DMatrix::from_fn(entries, forms.len(), |entry, c| {
        forms[c].1.as_slice()[entry]
    });
    let scale = wanted.amax();
    let factors = Svd::of(there.clone()).solve(&wanted, EXACT);
    match Some(factors).filter(|x| (&there * x - &wanted).amax() < EXACT * scale) {
        Some(factors) => {
            let mut combination = vec![0.0; columns[own].len()];
            for ((from, _), factor) in forms.iter().zip(factors.iter()) {
                // Skip rounding errors of the solution.
                if factor.abs() > EXACT {
                    add(&mut combination, *factor, from);
                }
            }
            columns[own] = combination;
        }
        None => forms.push((columns[own].clone(), form)),
    }
}

/// Returns true if two sets of base parameters are equivalent: equal in number and each a combination of the others.
pub fn agree(a: &Base, b: &Base) -> bool {
    if a.len() != b.len() || a.combination.ncols() != b.combination.ncols() {
        return false;
    }
    // Rows of `a` are β = K·π, and K is the identity over the kept columns of `a`. So b's rows must equal their entries
    // in these columns times K.
    let there = b.combination.select_columns(&a.columns);
    let rebuilt = &there * &a.combination;
    let scale = b.combination.amax().max(1.0) * there.amax().max(1.0);
    (rebuilt - &b.combination).amax() < 1e-7 * scale
}

fn unit(width: usize, c: usize, value: f64) -> Combination {
    let mut row = vec![0.0; width];
    row[c] = value;
    row
}

fn add(to: &mut Combination, factor: f64, from: &Combination) {
    for (a, b) in to.iter_mut().zip(from) {
        *a += factor * b;
    }
}

/// The directions about which the links turn so far.
#[derive(Clone, Copy)]
enum Turning {
    Nothing,
    /// About this direction of the base, from the first revolute joint.
    One(Vector3<f64>),
    Many,
}

struct Walk<'a> {
    geometry: &'a [JointGeometry<f64>],
    gravity: Vector3<f64>,
    width: usize,
    /// All columns so far, link by link.
    columns: Vec<Combination>,
    turning: Turning,
    /// Pose of the link in the base at q = 0.
    pose: Isometry3<f64>,
    /// Directions of the prismatic joints so far, in the base at q = 0.
    slides: Vec<Vector3<f64>>,
    /// Indices of these joints.
    sliders: Vec<usize>,
    /// For prismatic joints of fixed direction: the moved mass minus the same mass at rest on the preceding link,
    /// without gravity. It has a quadratic form in the joint velocities.
    moved: Vec<(Combination, DMatrix<f64>)>,
    /// Axes of the revolute joints so far: point and direction in the base at q = 0.
    axes: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// Indices of the joints of these axes.
    turners: Vec<usize>,
    /// First joint that turns about a second direction, as long as all later ones turn about that direction.
    second: Option<usize>,
    /// Per joint: factors of the joint velocities in its link's rotation about its own axis, if they are constant.
    spins: Vec<Option<Vec<f64>>>,
}

impl<'a> Walk<'a> {
    fn new(geometry: &'a [JointGeometry<f64>], gravity: [f64; 3], width: usize) -> Self {
        Self {
            geometry,
            gravity: Vector3::from(gravity),
            width,
            columns: Vec::new(),
            turning: Turning::Nothing,
            pose: Isometry3::identity(),
            slides: Vec::new(),
            sliders: Vec::new(),
            moved: Vec::new(),
            axes: Vec::new(),
            turners: Vec::new(),
            second: None,
            spins: Vec::new(),
        }
    }

    fn link(&mut self, j: usize) {
        let g = &self.geometry[j];
        let step = Isometry3::from_parts(
            Translation3::identity(),
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), g.alpha),
        ) * Translation3::new(g.a, 0.0, 0.0)
            * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), g.theta)
            * Translation3::new(0.0, 0.0, g.d);
        self.pose *= step;
        let z = self.pose.rotation * Vector3::z();
        let own: Vec<Combination> = (0..COLUMNS)
            .map(|c| unit(self.width, j * COLUMNS + c, 1.0))
            .collect();
        let own = match g.kind {
            JointKind::Revolute => self.revolute(j, own, z, &step),
            JointKind::Prismatic => self.prismatic(j, own, z, &step),
        };
        self.columns.extend(own);
    }

    fn revolute(
        &mut self,
        j: usize,
        mut own: Vec<Combination>,
        z: Vector3<f64>,
        step: &Isometry3<f64>,
    ) -> Vec<Combination> {
        let nothing = vec![0.0; self.width];
        own[column::MASS] = self.carried(j, step, &[(column::MASS, 1.0)]);
        own[3] = self.carried(j, step, &[(3, 1.0)]);
        let round = self.carried(j, step, &[(XX, 1.0), (YY, 1.0)]);
        let before = self.turning;
        self.turning = match before {
            Turning::Nothing => {
                own[column::DRIVE_INERTIA] = own[ZZ].clone();
                Turning::One(z)
            }
            Turning::One(a) if a.cross(&z).norm() < EXACT => Turning::One(a),
            Turning::One(a) => {
                if a.dot(&z).abs() < EXACT {
                    own[column::DRIVE_INERTIA] = own[ZZ].clone();
                }
                Turning::Many
            }
            Turning::Many => Turning::Many,
        };
        self.axes.push((self.pose.translation.vector, z));
        self.turners.push(j);
        let spin = self.spin(j, &before, z);
        self.spins.push(spin);
        if let Turning::One(a) = &self.turning {
            for c in [XX, XY, XZ, YZ] {
                own[c] = nothing.clone();
            }
            if self.on_axis(a) && self.gravity.cross(a).norm() < EXACT {
                own[1] = nothing.clone();
                own[2] = nothing.clone();
            }
        } else if self.gravity.norm() == 0.0
            && let Some(above) = self.above_centre()
        {
            for (h, product) in [(1, XZ), (2, YZ)] {
                let mut combination = nothing.clone();
                add(&mut combination, -above, &own[product]);
                own[h] = combination;
            }
        }
        own[YY] = round;
        let xx = own[XX].clone();
        add(&mut own[YY], -1.0, &xx);
        own
    }

    fn prismatic(
        &mut self,
        j: usize,
        mut own: Vec<Combination>,
        z: Vector3<f64>,
        step: &Isometry3<f64>,
    ) -> Vec<Combination> {
        let nothing = vec![0.0; self.width];
        for c in XX..=ZZ {
            own[c] = self.carried(j, step, &[(c, 1.0)]);
        }
        let mut fixed_direction = false;
        match &self.turning {
            Turning::Nothing => {
                for c in 1..=3 {
                    own[c] = nothing.clone();
                }
                fixed_direction = true;
            }
            Turning::One(a) if a.cross(&z).norm() < EXACT => {
                own[3] = nothing.clone();
                for c in 1..=2 {
                    own[c] = self.carried(j, step, &[(c, 1.0)]);
                }
                fixed_direction = true;
            }
            Turning::One(a) => {
                // A first moment along a has no effect, so one component follows from the other two.
                let along = self.pose.rotation.inverse() * a;
                let most = along.iamax();
                let mut combination = nothing.clone();
                for k in 0..3 {
                    if k != most {
                        add(&mut combination, -along[k] / along[most], &own[1 + k]);
                    }
                }
                own[1 + most] = combination;
            }
            Turning::Many => {}
        }
        if fixed_direction {
            let mut combination = own[column::MASS].clone();
            let resting = self.carried(j, step, &[(column::MASS, 1.0)]);
            add(&mut combination, -1.0, &resting);
            add(&mut combination, self.gravity.dot(&z), &own[column::OFFSET]);
            if self.slides.iter().all(|s| s.dot(&z).abs() < EXACT) {
                own[column::DRIVE_INERTIA] = combination.clone();
            }
            let n = self.geometry.len();
            let mut form = DMatrix::zeros(n, n);
            form[(j, j)] = 1.0;
            for (&i, slide) in self.sliders.iter().zip(&self.slides) {
                (form[(i, j)], form[(j, i)]) = (slide.dot(&z), slide.dot(&z));
            }
            self.moved.push((combination, form));
        }
        self.slides.push(z);
        self.sliders.push(j);
        self.spins.push(None);
        own
    }

    /// Expresses a set of parameters of link `j` as parameters of the preceding link, with the joint at zero.
    fn carried(&self, j: usize, step: &Isometry3<f64>, set: &[(usize, f64)]) -> Combination {
        let mut result = vec![0.0; self.width];
        let Some(before) = j.checked_sub(1) else {
            return result;
        };
        let mut body = [0.0; 10];
        for (c, value) in set {
            body[*c] = *value;
        }
        for (c, value) in seen_from(step, &body).into_iter().enumerate() {
            // Skip rounding errors of a right angle.
            if value.abs() > 1e-15 {
                add(&mut result, value, &self.columns[before * COLUMNS + c]);
            }
        }
        result
    }

    /// Returns the factors of the joint velocities in the rotation of revolute link `j` about its own axis; none if
    /// they depend on the position.
    fn spin(&mut self, j: usize, before: &Turning, z: Vector3<f64>) -> Option<Vec<f64>> {
        let first = match (&self.turning, before) {
            (Turning::Nothing | Turning::One(_), _) => 0,
            (Turning::Many, Turning::One(_)) => j,
            (Turning::Many, Turning::Many) => self.second?,
            (Turning::Many, Turning::Nothing) => return None,
        };
        let mut factors = vec![0.0; self.geometry.len()];
        for (&i, (_, axis)) in self.turners.iter().zip(&self.axes) {
            // The first direction is fixed in the base and keeps its angle to the second.
            if i >= first && axis.cross(&z).norm() > EXACT {
                self.second = None;
                return None;
            }
            factors[i] = axis.dot(&z);
        }
        if first > 0 {
            self.second = Some(first);
        }
        Some(factors)
    }

    /// Returns true if the link's origin does not move across a, the only direction of rotation.
    fn on_axis(&self, a: &Vector3<f64>) -> bool {
        let Some((first, _)) = self.axes.first() else {
            return true;
        };
        let one_line = self
            .axes
            .iter()
            .all(|(point, _)| (point - first).cross(a).norm() < EXACT);
        one_line && self.slides.iter().all(|s| s.cross(a).norm() < EXACT)
    }

    /// Returns the height of the link's origin, along its axis, above the fixed common point of all axes, if any.
    fn above_centre(&self) -> Option<f64> {
        if !self.slides.is_empty() {
            return None;
        }
        let (first, a) = *self.axes.first()?;
        let (point, b) = *self.axes.iter().find(|(_, b)| a.cross(b).norm() > EXACT)?;
        // Foot of the common normal on the first axis.
        let normal = a.cross(&b);
        let along = (point - first).cross(&b).dot(&normal) / normal.norm_squared();
        let centre = first + a * along;
        let meets = |(p, z): &(Vector3<f64>, Vector3<f64>)| (centre - p).cross(z).norm() < EXACT;
        if !self.axes.iter().all(meets) {
            return None;
        }
        let (origin, z) = self.axes.last()?;
        Some((origin - centre).dot(z))
    }
}

/// Returns the ten parameters of a body in the frame in which its own frame has the pose `pose`.
fn seen_from(pose: &Isometry3<f64>, body: &[f64; 10]) -> [f64; 10] {
    let [m, mx, my, mz, xx, xy, xz, yy, yz, zz] = *body;
    let r = pose.rotation.to_rotation_matrix();
    let p = pose.translation.vector;
    let h = r * Vector3::new(mx, my, mz);
    let i = r * nalgebra::Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * r.transpose();
    // Parallel-axis theorem without a centre of mass: Σ m·S(r + p)ᵀ·S(r + p).
    let product = |a: &Vector3<f64>, b: &Vector3<f64>| {
        nalgebra::Matrix3::identity() * a.dot(b) - b * a.transpose()
    };
    let i = i + product(&h, &p) + product(&p, &h) + product(&p, &p) * m;
    let h = h + p * m;
    [m, h.x, h.y, h.z, i.m11, i.m12, i.m13, i.m22, i.m23, i.m33]
}

#[cfg(test)]
#[path = "grouping_test.rs"]
mod tests;
