//! Prior knowledge of a robot: the description's inertial values, or a plausible body in their place.

use nalgebra::{DMatrix, DVector, Matrix4};
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::{DriveKind, MOTOR_COLUMNS, motor_column};

use super::contradicted::contradicted;
use super::hints::Hints;
use super::pseudo_inertia::{Divergence, INERTIAL, parameters_of};
use rig_model::robot::{Quantity, Robot, STAND_IN, Worth, worth};
use rig_output::format_significant;

/// Density of the substitute bodies, kg/m³: aluminium castings with equal volumes of air and metal.
const DENSITY: f64 = 1300.0;
/// Smallest half-width of a substitute body, m.
const LEAST_HALF_WIDTH: f64 = 0.06;
/// Assumed value of unknown friction or drive inertia, as a share of the value that would make all of the torque.
const SMALL_SHARE: f64 = 0.01;

/// Constraint on a standard column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rule {
    /// One of the ten inertial parameters of a link (its index): J is positive definite.
    Inertial(usize),
    /// Friction and drive inertia: not negative.
    NotNegative,
    /// Offsets: unconstrained.
    Free,
}

/// Prior values, their natural scales and constraints, by standard column.
#[derive(Clone, Debug)]
pub(crate) struct Prior {
    /// Prior value of each column.
    pub centre: Vec<f64>,
    /// Natural size of each column: the meaning of "100 %".
    pub scale: Vec<f64>,
    /// Largest plausible value of a column: `scale`; for unstated friction, drive inertia and offset the value that
    /// would make all of the joint's torque.
    pub size: Vec<f64>,
    /// Friction and drive inertia that would make all of the joint's torque, by column; 0 for the others.
    whole: Vec<f64>,
    /// Least-squares value of each friction or drive inertia column; not a number if there is no value.
    seen: Vec<f64>,
    /// Relative uncertainty of each column; infinite for unknown values.
    pub uncertainty: Vec<f64>,
    /// Constraints.
    pub rules: Vec<Rule>,
    /// Contribution of drives that move several joints to each joint's columns: π = shares·π', with π' the values here.
    /// Absent if every drive moves only its own joint.
    pub shares: Option<DMatrix<f64>>,
    /// One divergence per link.
    pub bodies: Vec<Divergence>,
    /// Factor on every pull; the solution path ends at this value.
    pub strength: f64,
    /// Sentences about substituted values.
    pub remarks: Vec<String>,
    /// True if the description states inertial values for every link.
    pub stated: bool,
}

impl Prior {
    /// Builds the prior from the description; `given` is the relative uncertainty of its values.
    pub(crate) fn of(robot: &Robot, columns: usize, hints: &Hints, given: f64) -> Self {
        let n = robot.link_count();
        let shares = shares(robot, columns);
        let mut described = described(robot, columns);
        if let Some(shares) = &shares {
            // Exact inverse: `shares` is the identity plus a matrix whose square is zero.
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
            // A follower has no drive and no friction of its own: these stay 0.
            if joint >= robot.joints.len() {
                prior.rules[c] = Rule::Free;
                prior.uncertainty[c] = f64::INFINITY;
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

    /// Discards the described value as knowledge; it stays the initial value if the data give none.
    fn forget(&mut self, c: usize) {
        let (size, seen) = (self.whole[c], self.seen[c]);
        self.uncertainty[c] = f64::INFINITY;
        // A weakly excited value from least squares may need more torque than there was.
        let value = if seen.is_nan() { self.centre[c] } else { seen };
        self.centre[c] = value.clamp(SMALL_SHARE * size, size);
        self.scale[c] = self.centre[c];
    }

    /// Removes stated values of friction and drive inertia that the data contradict, with a remark for each. `data` is
    /// over the standard columns, in units of the residual's noise.
    pub(crate) fn without_contradicted(
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
            let (joint, place) = place_of(c, robot.link_count());
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

    /// Appends values of which only the size is known.
    pub(crate) fn with_free(&self, sizes: &[f64]) -> Self {
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

    /// Sets the ten parameters of link `i`: the described ones if they are physically consistent, else a substitute.
    fn link(&mut self, robot: &Robot, i: usize, given: f64) {
        let at = i * COLUMNS;
        let stated = robot.link_inertial(i).is_some();
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
                    "{} {}: {}, so a uniform block of {:.3} kg stands in for its link.",
                    if i < robot.joints.len() {
                        "Joint"
                    } else {
                        "Follower"
                    },
                    robot.link_name(i),
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
                // A block of finite size is always consistent; the unit block covers rounding errors.
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

    /// Converts a matrix over the standard columns to the values here.
    pub(crate) fn own(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        match &self.shares {
            Some(shares) => matrix * shares,
            None => matrix.clone(),
        }
    }

    /// Returns the drive inertias of joints that only drives of other joints move: no torque contains them.
    pub(crate) fn nothing_of_its_own(&self, own: &DMatrix<f64>) -> impl Iterator<Item = usize> {
        let coupled = self.shares.is_some();
        let links = self.bodies.len() * COLUMNS;
        (0..links.min(own.ncols())).filter(move |c| {
            let drive = c % COLUMNS == column::DRIVE_INERTIA;
            coupled && drive && !self.uncertainty[*c].is_finite() && own.column(*c).amax() == 0.0
        })
    }

    /// Converts the values here to standard parameters.
    pub(crate) fn standard(&self, own: &DVector<f64>) -> Vec<f64> {
        match &self.shares {
            Some(shares) => (shares * own).as_slice().to_vec(),
            None => own.as_slice().to_vec(),
        }
    }

    /// Returns the size of the divergence's pull, by standard column: the inverse square of the relative uncertainty.
    pub(crate) fn pull(&self, c: usize) -> f64 {
        let u = self.uncertainty[c];
        if u.is_finite() {
            1.0 / (u * u)
        } else {
            // Barrier only: keeps the value away from zero by a share of its own uncertainty.
            0.1
        }
    }
}

/// Returns the link of a standard column and its place among the link's columns. Motor columns follow, three per
/// joint: inertia, viscous, Coulomb.
fn place_of(c: usize, links: usize) -> (usize, usize) {
    if c < links * COLUMNS {
        return (c / COLUMNS, c % COLUMNS);
    }
    let after = c - links * COLUMNS;
    let place = match after % MOTOR_COLUMNS {
        motor_column::INERTIA => column::DRIVE_INERTIA,
        motor_column::VISCOUS => column::VISCOUS,
        _ => column::COULOMB,
    };
    ((after / MOTOR_COLUMNS).min(links.saturating_sub(1)), place)
}

/// Returns the friction, drive inertia or offset that would make all of the joint's torque; 1 if nothing moved.
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

/// Returns the described standard parameters, followed by those of motors if there are columns for them.
pub fn described(robot: &Robot, columns: usize) -> DVector<f64> {
    let mut all = robot.standard_parameters().concat();
    all.extend(robot.motor_parameters().concat());
    all.truncate(columns);
    DVector::from_vec(all)
}

/// Returns the matrix by which drives that move several joints add inertia and viscous friction to their columns, with
/// the square of the ratio; see [`rig_shared::transmission`].
fn shares(robot: &Robot, columns: usize) -> Option<DMatrix<f64>> {
    let n = robot.link_count();
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

/// Returns a uniform block from the link's frame to the next one's; a cube at the end of the chain.
fn stand_in(
    robot: &Robot,
    i: usize,
    mass: Option<f64>,
    moment: Option<[f64; 3]>,
) -> [f64; INERTIAL] {
    let order = robot.links_outwards();
    let next = order.iter().skip_while(|link| **link != i).nth(1);
    let next = next.and_then(|link| robot.link_as_joint(*link));
    let reach = next.map_or([0.0; 3], |next| {
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
