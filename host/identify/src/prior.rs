//! What is known of a robot before its data: the description's inertial values, or a plausible body in their place.

use nalgebra::{DMatrix, DVector, Matrix4};
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::{DriveKind, MOTOR_COLUMNS, motor_column};

use super::contradicted::contradicted;
use super::pseudo_inertia::{Divergence, INERTIAL, parameters_of};
use rig_model::robot::{Quantity, Robot, STAND_IN, Worth, worth};
use rig_output::format_significant;

/// Density of the stand-in bodies, kg/m³: aluminium castings with as much air as metal.
const DENSITY: f64 = 1300.0;
/// Least half-width of a stand-in body, m.
const LEAST_HALF_WIDTH: f64 = 0.06;
/// Where nothing is known of a friction or drive value: this share of what the joint's torque and speed suggest.
const SMALL_SHARE: f64 = 0.01;

/// What a standard column must obey.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rule {
    /// One of the ten inertial parameters of a link (its index): J positive definite.
    Inertial(usize),
    /// Friction and drive inertia: not below zero.
    NotNegative,
    /// Offsets.
    Free,
}

/// Prior values, their natural scales and rules, by standard column.
#[derive(Clone, Debug)]
pub(super) struct Prior {
    /// Centre.
    pub centre: Vec<f64>,
    /// Natural size of each column: what "100 %" means.
    pub scale: Vec<f64>,
    /// What a column's value can plausibly be: `scale`, for unstated friction, drive inertia and offset what would make all
    /// of the joint's torque.
    pub size: Vec<f64>,
    /// Friction and drive inertia that would make all of the joint's torque, by column; 0 of the others.
    whole: Vec<f64>,
    /// Least-squares value of each column of friction or drive inertia; not a number where there is none.
    seen: Vec<f64>,
    /// Relative uncertainty of each column; infinite where nothing is known.
    pub uncertainty: Vec<f64>,
    /// Rules.
    pub rules: Vec<Rule>,
    /// What each joint's own columns hold of drives that move it from another joint: π = shares·π', π' the values
    /// here. Absent where every drive moves its own joint only.
    pub shares: Option<DMatrix<f64>>,
    /// One divergence a link.
    pub bodies: Vec<Divergence>,
    /// Multiplies every pull: where the path of the solution ends.
    pub strength: f64,
    /// Sentences: what stands in for what.
    pub remarks: Vec<String>,
    /// Whether the description states inertial values for every link.
    pub stated: bool,
}

/// What the data suggest for a column that the description does not know.
pub(super) struct Hints {
    /// Least-squares value of each standard column that is identified on its own, else NaN.
    pub values: Vec<f64>,
    /// RMS torque of each joint.
    pub torque: Vec<f64>,
    /// RMS speed of each joint.
    pub speed: Vec<f64>,
    /// RMS acceleration of each joint.
    pub acceleration: Vec<f64>,
}

impl Prior {
    /// From the description; `given` is the relative uncertainty of its values.
    pub(super) fn of(robot: &Robot, columns: usize, hints: &Hints, given: f64) -> Self {
        let n = robot.joints.len();
        let shares = shares(robot, columns);
        let mut described = described(robot, columns);
        if let Some(shares) = &shares {
            // Triangular with ones on the diagonal.
            described = 2.0 * &described - shares * &described;
        }
        let described = described.as_slice().to_vec();
        let mut prior = Self {
            centre: described.clone(),
            scale: vec![1.0; columns],
            size: Vec::new(),
            whole: vec![0.0; columns],
            seen: vec![f64::NAN; columns],
            uncertainty: vec![given; columns],
            rules: vec![Rule::NotNegative; columns],
            shares,
            bodies: Vec::with_capacity(n),
            strength: 1.0,
            remarks: Vec::new(),
            stated: true,
        };
        for i in 0..n {
            prior.link(robot, i, given);
        }
        let mut sizes = vec![0.0; columns];
        for c in 0..columns {
            let (joint, place) = place_of(c, n);
            if place < INERTIAL {
                continue;
            }
            let size = size_of(place, joint, hints);
            if place == column::OFFSET {
                prior.rules[c] = Rule::Free;
                prior.scale[c] = size;
                prior.uncertainty[c] = f64::INFINITY;
                continue;
            }
            prior.whole[c] = size;
            prior.seen[c] = hints.values[c];
            let quantity = match place {
                column::DRIVE_INERTIA => Quantity::DriveInertia,
                _ => Quantity::Friction,
            };
            match worth(quantity, robot.origin, described[c]) {
                Worth::Share(_) if described[c] > 0.0 => prior.scale[c] = described[c],
                _ => {
                    prior.forget(c);
                    sizes[c] = size;
                }
            }
        }
        prior.size = (prior.scale.iter().zip(&sizes))
            .map(|(scale, size)| scale.max(*size))
            .collect();
        prior
    }

    /// Takes what stands in the description for no knowledge: it is a first value where the data give none.
    fn forget(&mut self, c: usize) {
        let (size, seen) = (self.whole[c], self.seen[c]);
        self.uncertainty[c] = f64::INFINITY;
        // Where the motion tells it badly, least squares may give what no torque was there for.
        let value = if seen.is_nan() { self.centre[c] } else { seen };
        self.centre[c] = value.clamp(SMALL_SHARE * size, size);
        self.scale[c] = self.centre[c];
    }

    /// The same without those stated values of friction and drive inertia that the data contradict; `data` has the residual's noise as
    /// unit, over the standard columns. Each is said.
    pub(super) fn without_contradicted(
        mut self,
        data: &DMatrix<f64>,
        right: &DVector<f64>,
        robot: &Robot,
    ) -> Self {
        let own = self.own(data);
        let surprise = right - &own * DVector::from_column_slice(&self.centre);
        let spread: Vec<f64> = (self.uncertainty.iter().zip(&self.size))
            .map(|(u, size)| if u.is_finite() { u * size } else { *size })
            .collect();
        let stated: Vec<usize> = (0..spread.len())
            .filter(|&c| self.whole[c] > 0.0 && self.uncertainty[c].is_finite())
            .collect();
        for (c, times) in contradicted(&own, &surprise, &spread, &stated) {
            let (joint, place) = place_of(c, robot.joints.len());
            self.remarks.push(format!(
                "Joint {}: the data contradict the described {} of {} by {} standard deviations of the description's worth and theirs, so it counts as not known.",
                robot.joints[joint].name,
                match place {
                    column::DRIVE_INERTIA => "drive inertia",
                    column::VISCOUS => "viscous friction",
                    _ => "Coulomb friction",
                },
                format_significant(self.centre[c], 3),
                format_significant(times, 2)
            ));
            self.forget(c);
            self.size[c] = self.scale[c].max(self.whole[c]);
        }
        self
    }

    /// The same with values behind its own of which nothing is known but their size.
    pub(super) fn with_free(&self, sizes: &[f64]) -> Self {
        let mut prior = self.clone();
        let all = prior.centre.len() + sizes.len();
        prior.centre.resize(all, 0.0);
        prior.scale.extend(sizes);
        prior.size.extend(sizes);
        prior.whole.resize(all, 0.0);
        prior.seen.resize(all, f64::NAN);
        prior.uncertainty.resize(all, f64::INFINITY);
        prior.rules.resize(all, Rule::Free);
        prior.shares = prior.shares.map(|shares| {
            let own = shares.nrows();
            let mut shares = shares.resize(all, all, 0.0);
            shares.view_range_mut(own.., own..).fill_with_identity();
            shares
        });
        prior
    }

    /// The ten parameters of link `i`: the description's where a body can have them, else a stand-in.
    fn link(&mut self, robot: &Robot, i: usize, given: f64) {
        let at = i * COLUMNS;
        let stated = robot.joints[i].inertial.is_some();
        let own = &self.centre[at..at + INERTIAL];
        let divergence = if stated { Divergence::new(own) } else { None };
        let divergence = match divergence {
            Some(divergence) => divergence,
            None => {
                let mass = (stated && own[0] > 0.0).then_some(own[0]);
                let moment = stated.then(|| [own[1], own[2], own[3]]);
                let stand_in = stand_in(robot, i, mass, moment);
                self.centre[at..at + INERTIAL].copy_from_slice(&stand_in);
                self.stated = false;
                self.remarks.push(format!(
                    "Joint {}: {}, so a uniform block of {:.3} kg stands in for its link.",
                    robot.joints[i].name,
                    if stated {
                        "no body has the inertial values that the description states"
                    } else {
                        "the description states no inertial values"
                    },
                    stand_in[0]
                ));
                for c in at..at + INERTIAL {
                    self.uncertainty[c] = STAND_IN.max(given);
                }
                // A block of finite size is always a body; the unit block answers for rounding.
                match Divergence::new(&stand_in) {
                    Some(divergence) => divergence,
                    None => return self.unit_block(at),
                }
            }
        };
        self.scales(at);
        self.bodies.push(divergence);
    }

    fn unit_block(&mut self, at: usize) {
        let block = parameters_of(&Matrix4::from_diagonal_element(1.0));
        self.centre[at..at + INERTIAL].copy_from_slice(&block);
        self.scales(at);
        self.bodies.extend(Divergence::new(&block));
    }

    fn scales(&mut self, at: usize) {
        let p = &self.centre[at..at + INERTIAL];
        let (mass, second) = (p[0], 0.5 * (p[4] + p[7] + p[9]));
        let moment = (mass * second).sqrt();
        for k in 0..INERTIAL {
            self.rules[at + k] = Rule::Inertial(k);
            self.scale[at + k] = match k {
                0 => mass,
                1..=3 => moment,
                _ => second,
            };
        }
    }

    /// A matrix over the standard columns as one over the values here.
    pub(super) fn own(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        match &self.shares {
            Some(shares) => matrix * shares,
            None => matrix.clone(),
        }
    }

    /// Drive inertias of joints that only drives of other joints move: none is stated, and no torque has a place for it.
    pub(super) fn nothing_of_its_own(&self, own: &DMatrix<f64>) -> impl Iterator<Item = usize> {
        let coupled = self.shares.is_some();
        let links = self.bodies.len() * COLUMNS;
        (0..links.min(own.ncols())).filter(move |c| {
            let drive = c % COLUMNS == column::DRIVE_INERTIA;
            coupled && drive && !self.uncertainty[*c].is_finite() && own.column(*c).amax() == 0.0
        })
    }

    /// Values here as standard parameters.
    pub(super) fn standard(&self, own: &DVector<f64>) -> Vec<f64> {
        match &self.shares {
            Some(shares) => (shares * own).as_slice().to_vec(),
            None => own.as_slice().to_vec(),
        }
    }

    /// Size of the divergence's pull: the inverse square of the relative uncertainty, by standard column.
    pub(super) fn pull(&self, c: usize) -> f64 {
        let u = self.uncertainty[c];
        if u.is_finite() {
            1.0 / (u * u)
        } else {
            // Barrier only: keeps the value off zero by a share of its own uncertainty.
            0.1
        }
    }
}

/// Joint and place among the joint's columns of a standard column. Motor columns follow the standard ones, three a joint: inertia,
/// viscous, Coulomb.
fn place_of(c: usize, joints: usize) -> (usize, usize) {
    if c < joints * COLUMNS {
        return (c / COLUMNS, c % COLUMNS);
    }
    let after = c - joints * COLUMNS;
    let place = match after % MOTOR_COLUMNS {
        motor_column::INERTIA => column::DRIVE_INERTIA,
        motor_column::VISCOUS => column::VISCOUS,
        _ => column::COULOMB,
    };
    ((after / MOTOR_COLUMNS).min(joints.saturating_sub(1)), place)
}

/// What a friction, drive inertia or offset would be if it made all of the joint's torque; 1 where nothing moved.
fn size_of(place: usize, joint: usize, hints: &Hints) -> f64 {
    let motion = match place {
        column::DRIVE_INERTIA => hints.acceleration[joint],
        column::VISCOUS => hints.speed[joint],
        _ => 1.0,
    };
    let size = hints.torque[joint] / motion.max(f64::MIN_POSITIVE);
    if size > 0.0 && size.is_finite() {
        size
    } else {
        1.0
    }
}

/// The description's standard parameters, those of motors behind them where there are columns for them.
pub fn described(robot: &Robot, columns: usize) -> DVector<f64> {
    let mut all = robot.standard_parameters().concat();
    all.extend(robot.motor_parameters().concat());
    all.truncate(columns);
    DVector::from_vec(all)
}

/// Where a drive moves other joints too, their columns hold its inertia and viscous friction by the square of the
/// ratio; see [`rig_shared::transmission`].
fn shares(robot: &Robot, columns: usize) -> Option<DMatrix<f64>> {
    let n = robot.joints.len();
    if columns <= n * COLUMNS {
        return None;
    }
    let mut shares = DMatrix::identity(columns, columns);
    for (k, kind) in robot.drive_kinds().into_iter().enumerate() {
        let (DriveKind::Coupled, Some(drive)) = (kind, &robot.joints[k].drive) else {
            continue;
        };
        let motor = n * COLUMNS + k * MOTOR_COLUMNS;
        for (i, joint) in robot.joints.iter().enumerate() {
            let ratio = if i == k {
                1.0
            } else {
                drive.couples.get(&joint.name).copied().unwrap_or(0.0) / drive.gear_ratio
            };
            let at = i * COLUMNS;
            if i != k {
                shares[(at + column::DRIVE_INERTIA, motor + motor_column::INERTIA)] = ratio * ratio;
            }
            shares[(at + column::VISCOUS, motor + motor_column::VISCOUS)] = ratio * ratio;
        }
    }
    Some(shares)
}

/// A uniform block from the link's frame to the next one's (half as far again as wide at the end of the chain).
fn stand_in(
    robot: &Robot,
    i: usize,
    mass: Option<f64>,
    moment: Option<[f64; 3]>,
) -> [f64; INERTIAL] {
    let reach = robot.joints.get(i + 1).map_or([0.0; 3], |next| {
        let (s, c) = next.alpha.sin_cos();
        [next.a, -s * next.d, c * next.d]
    });
    let length = reach.iter().map(|x| x * x).sum::<f64>().sqrt();
    let half = (0.25 * length).max(LEAST_HALF_WIDTH);
    let volume = (2.0 * half).powi(2) * (length + 2.0 * half);
    let mass = mass.unwrap_or(DENSITY * volume);
    let centre = moment.map_or(reach.map(|x| 0.5 * x), |h| h.map(|x| x / mass));
    let mut j = Matrix4::zeros();
    for r in 0..3 {
        // Second moment of a rod along the reach, and of the block's width in every direction.
        for c in 0..3 {
            j[(r, c)] = mass * (centre[r] * centre[c] + reach[r] * reach[c] / 12.0);
        }
        j[(r, r)] += mass * half * half / 3.0;
        j[(r, 3)] = mass * centre[r];
        j[(3, r)] = mass * centre[r];
    }
    j[(3, 3)] = mass;
    parameters_of(&j)
}
