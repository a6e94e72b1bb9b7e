//! The drives of a description as functions Ψ = F(q), for the equations.

use rig_shared::multibody::{COLUMNS, column};
use rig_shared::scalar::Real;
use rig_shared::transmission::{
    DriveKind, DriveMap, MOTOR_COLUMNS, Transmission, TransmissionError, motor_column,
};

use super::ball_screw_crank::BallScrewCrank;
use super::drive::Drive;
use super::joint::{Inertial, Joint, JointFriction, JointKind};
use super::serial_robot::Robot;

/// The numbers of one drive.
struct Numbers {
    ratios: Vec<f64>,
    weights: Vec<f64>,
    zero: f64,
}

impl Robot {
    /// Returns the motor coordinates as a function of the joint coordinates, one motor a joint. A joint without a drive
    /// counts as its own motor.
    ///
    /// # Errors
    /// [`TransmissionError`]. It cannot occur for a loaded description, whose drives were checked.
    pub fn transmission(&self) -> Result<Transmission<f64>, TransmissionError> {
        self.transmission_of::<f64>()
    }

    /// [`Self::transmission`] over any scalar: lanes, dual numbers.
    ///
    /// # Errors
    /// The same as [`Self::transmission`].
    pub fn transmission_of<T: Real>(&self) -> Result<Transmission<T>, TransmissionError> {
        self.with_drive_maps(Transmission::new)
    }

    /// Calls `act` with each motor's position as a function of the joint coordinates, base first.
    pub fn with_drive_maps<R>(&self, act: impl FnOnce(&[DriveMap<'_>]) -> R) -> R {
        let numbers: Vec<Numbers> = (0..self.joints.len()).map(|k| self.numbers(k)).collect();
        let maps: Vec<DriveMap<'_>> = numbers
            .iter()
            .zip(&self.joints)
            .map(|(n, joint)| DriveMap {
                ratios: &n.ratios,
                screw: joint
                    .drive
                    .as_ref()
                    .and_then(|d| d.screw.as_ref())
                    .map(|s| s.map(&n.weights)),
                zero: n.zero,
                joint_inertia: (joint.drive.as_ref()).is_some_and(|d| d.joint_inertia != 0.0),
            })
            .collect();
        act(&maps)
    }

    fn numbers(&self, k: usize) -> Numbers {
        let mut ratios = vec![0.0; self.joints.len()];
        let Some(drive) = &self.joints[k].drive else {
            ratios[k] = 1.0;
            return Numbers {
                ratios,
                weights: Vec::new(),
                zero: 0.0,
            };
        };
        ratios[k] = drive.gear_ratio;
        for (name, ratio) in &drive.couples {
            if let Some(j) = self.joint_index(name) {
                ratios[j] = *ratio;
            }
        }
        Numbers {
            ratios,
            weights: drive
                .screw
                .as_ref()
                .map(|s| self.weights(s))
                .unwrap_or_default(),
            zero: drive.zero,
        }
    }

    /// Returns the weight of each joint in the crank's angle.
    fn weights(&self, screw: &BallScrewCrank) -> Vec<f64> {
        let weight = |name: &String| screw.angle.get(name).copied().unwrap_or(0.0);
        self.joints.iter().map(|j| weight(&j.name)).collect()
    }

    /// Returns the parameters of the motors that are not part of the joints' own, one row a motor in the order of
    /// [`rig_shared::transmission::MOTOR_COLUMN_NAMES`]. All are zero for a drive that moves only its own joint.
    pub fn motor_parameters(&self) -> Vec<[f64; MOTOR_COLUMNS]> {
        let kinds = self.drive_kinds();
        self.joints
            .iter()
            .zip(kinds)
            .map(|(joint, kind)| {
                let mut row = [0.0; MOTOR_COLUMNS];
                let Some(drive) = &joint.drive else {
                    return row;
                };
                let scale = match kind {
                    DriveKind::Simple => return row,
                    DriveKind::Coupled => drive.gear_ratio,
                    DriveKind::Varying => 1.0,
                };
                row[motor_column::INERTIA] = drive.rotor_inertia * scale * scale;
                row[motor_column::VISCOUS] = drive.viscous * scale * scale;
                row[motor_column::COULOMB] = drive.coulomb * scale.abs();
                row
            })
            .collect()
    }

    /// Returns the kinds of the drives, base first, without building the transmission.
    pub fn drive_kinds(&self) -> Vec<DriveKind> {
        self.joints
            .iter()
            .map(|joint| match &joint.drive {
                Some(drive) if drive.screw.is_some() => DriveKind::Varying,
                Some(drive)
                    if drive
                        .couples
                        .iter()
                        .any(|(name, ratio)| *ratio != 0.0 && *name != joint.name) =>
                {
                    DriveKind::Coupled
                }
                _ => DriveKind::Simple,
            })
            .collect()
    }

    /// Adds the drives to the joints' own columns. A simple drive adds all its parameters. A coupled drive adds the
    /// contribution of its rotor and its viscous friction to the diagonal of each joint.
    pub(super) fn add_drives(&self, rows: &mut [[f64; COLUMNS]]) {
        for (k, kind) in self.drive_kinds().into_iter().enumerate() {
            let Some(drive) = &self.joints[k].drive else {
                continue;
            };
            rows[k][column::DRIVE_INERTIA] += drive.joint_inertia;
            match kind {
                DriveKind::Simple => {
                    let square = drive.gear_ratio * drive.gear_ratio;
                    rows[k][column::DRIVE_INERTIA] += drive.rotor_inertia * square;
                    rows[k][column::VISCOUS] += drive.viscous * square;
                    rows[k][column::COULOMB] += drive.coulomb * drive.gear_ratio.abs();
                }
                DriveKind::Coupled => {
                    for (i, ratio) in self.numbers(k).ratios.into_iter().enumerate() {
                        let square = ratio * ratio;
                        if i != k {
                            rows[i][column::DRIVE_INERTIA] += drive.rotor_inertia * square;
                        }
                        rows[i][column::VISCOUS] += drive.viscous * square;
                    }
                }
                DriveKind::Varying => {}
            }
        }
    }

    /// Returns the description with other values: the inverse of [`Self::standard_parameters`] and
    /// [`Self::motor_parameters`], one row a link and a motor. A rotor gets the joint's `Ia` minus the share of the
    /// motors coupled to it. Friction is stored at the joints, except for coupled motors and screws. A joint without a
    /// drive gets a drive of ratio 1 to hold its drive inertia.
    ///
    /// The second result names the values that no description can hold (friction or rotor inertia below zero). They are
    /// set to zero.
    #[must_use]
    pub fn with_parameters(
        &self,
        rows: &[[f64; COLUMNS]],
        motors: &[[f64; MOTOR_COLUMNS]],
    ) -> (Self, Vec<String>) {
        let mut robot = self.clone();
        let mut floor = Floor {
            joints: &self.joints,
            remarks: Vec::new(),
        };
        let kinds = self.drive_kinds();
        let shares = self.put_motors(&mut robot, motors, &kinds, &mut floor);
        for (k, (joint, row)) in robot.joints.iter_mut().zip(rows).enumerate() {
            let simple = kinds[k] == DriveKind::Simple;
            put_joint(joint, k, row, simple, shares[k], &mut floor);
        }
        for (follower, row) in (robot.followers.iter_mut()).zip(rows.iter().skip(kinds.len())) {
            follower.inertial = Some(inertial(row));
        }
        (robot, floor.remarks)
    }

    /// Puts the parameters of the motors into the drives of `robot`. Returns the contributions of the coupled motors to
    /// the diagonals: inertia and viscous friction, one pair a joint.
    fn put_motors(
        &self,
        robot: &mut Self,
        motors: &[[f64; MOTOR_COLUMNS]],
        kinds: &[DriveKind],
        floor: &mut Floor<'_>,
    ) -> Vec<[f64; 2]> {
        let mut shares = vec![[0.0; 2]; self.joints.len()];
        for (k, kind) in kinds.iter().enumerate() {
            let (Some(drive), Some(own)) = (&mut robot.joints[k].drive, motors.get(k)) else {
                continue;
            };
            (drive.coulomb, drive.viscous) = (0.0, 0.0);
            let scale = match kind {
                DriveKind::Simple => continue,
                DriveKind::Coupled => drive.gear_ratio.abs(),
                DriveKind::Varying => 1.0,
            };
            drive.rotor_inertia = floor.at_least_zero(
                "Inertia of the motor",
                k,
                own[motor_column::INERTIA] / (scale * scale),
            );
            drive.viscous = floor.at_least_zero(
                "Viscous friction of the motor",
                k,
                own[motor_column::VISCOUS] / (scale * scale),
            );
            drive.coulomb = floor.at_least_zero(
                "Coulomb friction of the motor",
                k,
                own[motor_column::COULOMB] / scale,
            );
            if *kind == DriveKind::Coupled {
                let (rotor, viscous) = (drive.rotor_inertia, drive.viscous);
                for (i, ratio) in self.numbers(k).ratios.into_iter().enumerate() {
                    shares[i][0] += if i == k { 0.0 } else { rotor * ratio * ratio };
                    shares[i][1] += viscous * ratio * ratio;
                }
            }
        }
        shares
    }

    /// Returns the middle of the joints' limits, shifted so that every crank is within its range. It is the start
    /// position for solving joints from motors. Zero for a joint without limits.
    pub fn middle_position(&self) -> Vec<f64> {
        let mut q: Vec<f64> = self
            .joints
            .iter()
            .map(|j| match j.limits.as_ref().map(|l| l.position) {
                Some([low, high]) if low.is_finite() && high.is_finite() => 0.5 * (low + high),
                _ => 0.0,
            })
            .collect();
        for k in 0..q.len() {
            let Some(screw) = self.joints[k].drive.as_ref().and_then(|d| d.screw.as_ref()) else {
                continue;
            };
            let weights = self.weights(screw);
            let Some([low, high]) = screw.range.or_else(|| self.crank_box(screw)) else {
                continue;
            };
            let now = angle(&weights, &q) + screw.offset;
            if weights[k] != 0.0 && !(low..=high).contains(&now) {
                q[k] += (0.5 * (low + high) - now) / weights[k];
            }
        }
        q
    }

    /// Returns the range of a crank's angle within the limits of its joints; `None` if one of them has no limits.
    pub(super) fn crank_box(&self, screw: &BallScrewCrank) -> Option<[f64; 2]> {
        let mut range = [screw.offset; 2];
        for (weight, joint) in self.weights(screw).into_iter().zip(&self.joints) {
            if weight == 0.0 {
                continue;
            }
            let [low, high] = joint.limits.as_ref()?.position;
            if !(low.is_finite() && high.is_finite()) {
                return None;
            }
            range[0] += (weight * low).min(weight * high);
            range[1] += (weight * low).max(weight * high);
        }
        Some(range)
    }

    /// Returns true if motor `motor` moves joint `joint` (both from 0) at some position.
    pub fn moves(&self, motor: usize, joint: usize) -> bool {
        let (Some(own), Some(moved)) = (self.joints.get(motor), self.joints.get(joint)) else {
            return false;
        };
        let Some(drive) = &own.drive else {
            return motor == joint;
        };
        let nonzero = |ratio: Option<&f64>| ratio.is_some_and(|r| *r != 0.0);
        (motor == joint && drive.gear_ratio != 0.0)
            || nonzero(drive.couples.get(&moved.name))
            || drive
                .screw
                .as_ref()
                .is_some_and(|s| nonzero(s.angle.get(&moved.name)))
    }

    /// Returns the limits on combinations of joint positions. For every crank with a range: its weights c (one a
    /// joint), and the lowest and highest value of Σ c_j·q_j.
    pub fn combined_limits(&self) -> Vec<(Vec<f64>, [f64; 2])> {
        self.joints
            .iter()
            .filter_map(|j| j.drive.as_ref()?.screw.as_ref())
            .filter_map(|s| {
                let [low, high] = s.range?;
                Some((self.weights(s), [low - s.offset, high - s.offset]))
            })
            .collect()
    }

    /// Returns the unit of a motor parameter (place `c` of motor `k`), ASCII.
    pub fn motor_unit(&self, k: usize, c: usize) -> &'static str {
        let kind = self.drive_kinds().get(k).copied();
        let at_slide = kind != Some(DriveKind::Varying)
            && self.joints.get(k).map(|j| j.kind) == Some(JointKind::Prismatic);
        match (c, at_slide) {
            (motor_column::INERTIA, false) => "kg*m^2",
            (motor_column::INERTIA, true) => "kg",
            (motor_column::VISCOUS, false) => "N*m*s/rad",
            (motor_column::VISCOUS, true) => "N*s/m",
            (_, false) => "N*m",
            (_, true) => "N",
        }
    }
}

/// Puts zero for values that no description can hold, and collects a sentence on each.
struct Floor<'a> {
    joints: &'a [Joint],
    remarks: Vec<String>,
}

impl Floor<'_> {
    /// Returns a value of joint `k` (from 0), at least 0.
    fn at_least_zero(&mut self, name: &str, k: usize, value: f64) -> f64 {
        if value < 0.0 {
            self.remarks.push(format!(
                "{name} of joint {} came out as {value}, which feeds energy in; 0 stands in the description.",
                self.joints[k].name
            ));
            0.0
        } else {
            value
        }
    }
}

/// Puts the parameters `row` into joint `k` (from 0), except for the `share` of the coupled motors: inertia and viscous
/// friction. `simple`: its drive moves only this joint, at a constant ratio.
fn put_joint(
    joint: &mut Joint,
    k: usize,
    row: &[f64; COLUMNS],
    simple: bool,
    share: [f64; 2],
    floor: &mut Floor<'_>,
) {
    let rest = row[column::DRIVE_INERTIA] - share[0];
    if joint.drive.is_none() && rest != 0.0 {
        // Rotor inertia added to the link would make a body that cannot exist.
        joint.drive = Some(Drive {
            gear_ratio: 1.0,
            ..Default::default()
        });
    }
    if let Some(drive) = &mut joint.drive {
        if simple && rest >= 0.0 {
            let kept = drive.joint_inertia.clamp(0.0, rest);
            drive.joint_inertia = kept;
            drive.rotor_inertia = (rest - kept) / (drive.gear_ratio * drive.gear_ratio);
        } else {
            let total = floor.at_least_zero("Drive inertia", k, row[column::DRIVE_INERTIA]);
            drive.joint_inertia = without_rounding(total - share[0], total);
            if simple {
                drive.rotor_inertia = 0.0;
            }
        }
    }
    joint.inertial = Some(inertial(row));
    joint.friction = Some(JointFriction {
        coulomb: floor.at_least_zero("Coulomb friction", k, row[column::COULOMB]),
        viscous: floor.at_least_zero(
            "Viscous friction",
            k,
            without_rounding(row[column::VISCOUS] - share[1], row[column::VISCOUS]),
        ),
        offset: row[column::OFFSET],
    });
}

/// Returns the inertial parameters of a row.
fn inertial(row: &[f64; COLUMNS]) -> Inertial {
    let mut first_moment = [0.0; 3];
    first_moment.copy_from_slice(&row[column::FIRST_MOMENT..column::INERTIA]);
    let mut inertia = [0.0; 6];
    inertia.copy_from_slice(&row[column::INERTIA..column::DRIVE_INERTIA]);
    Inertial {
        mass: row[column::MASS],
        first_moment,
        inertia,
    }
}

/// Returns the difference, or zero if it is only rounding of `part`.
fn without_rounding(difference: f64, part: f64) -> f64 {
    if difference.abs() < 1e-12 * part.abs() {
        0.0
    } else {
        difference
    }
}

fn angle(weights: &[f64], q: &[f64]) -> f64 {
    weights.iter().zip(q).map(|(c, x)| c * x).sum()
}
