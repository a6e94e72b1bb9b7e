//! How the axes of the sensor lie, which of the two opposite wrenches it reads, and how the base stands.

use nalgebra::{Matrix3, Rotation3, Vector3};

/// From the readings to the wrench of the robot on the load, in the described axes of the sensor; and where gravity points.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mounting {
    /// Applied to the force.
    pub force: Matrix3<f64>,
    /// Applied to the moment; equal to `force` for a sensor whose channels are what they claim to be.
    pub moment: Matrix3<f64>,
    /// Turns the described gravity to the true one, in the base frame.
    pub gravity: Rotation3<f64>,
    /// Moments as read over moments in N·m, against the same of the forces; 1 in SI units.
    pub scale: f64,
    /// Reading over what a channel should read, by channel; 0 for one that reads its noise only.
    pub gains: [f64; 6],
}

impl Mounting {
    /// Builds the mounting of a sensor as described. `sign` is 1 if it reads the wrench of the robot on the load.
    pub(crate) fn of(sign: f64) -> Self {
        Self {
            force: Matrix3::identity() * sign,
            moment: Matrix3::identity() * sign,
            gravity: Rotation3::identity(),
            scale: 1.0,
            gains: [1.0; 6],
        }
    }

    /// Returns the matrix of a channel's kind: the first three channels are forces.
    pub(crate) fn matrix(&self, channel: usize) -> &Matrix3<f64> {
        if channel < 3 {
            &self.force
        } else {
            &self.moment
        }
    }

    /// Returns the mounting with the sensor turned by a rotation vector in its described axes, and gravity by one in the
    /// base frame.
    pub(crate) fn turned(&self, sensor: &Vector3<f64>, gravity: &Vector3<f64>) -> Self {
        let turn = Rotation3::from_scaled_axis(*sensor).into_inner();
        Self {
            force: turn * self.force,
            moment: turn * self.moment,
            gravity: Rotation3::from_scaled_axis(*gravity) * self.gravity,
            ..self.clone()
        }
    }

    /// Returns the mounting of a sensor whose moments read `factor` times as much.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self {
            scale: self.scale * factor,
            ..self.clone()
        }
    }

    /// Returns the mounting with another gain of a channel.
    pub(crate) fn with_gain(&self, channel: usize, gain: f64) -> Self {
        let mut other = self.clone();
        other.gains[channel] = gain;
        other
    }

    /// Returns true if a channel is not read as the others are.
    pub(crate) fn has_gain(&self) -> bool {
        self.gains != [1.0; 6]
    }

    /// Returns the factor of the readings of a channel's kind.
    pub(crate) fn of_kind(&self, channel: usize) -> f64 {
        if channel < 3 { 1.0 } else { self.scale }
    }

    /// Returns the factor of the readings of a channel.
    pub(crate) fn factor(&self, channel: usize) -> f64 {
        self.of_kind(channel) * self.gains[channel]
    }

    /// Returns the mounting for which the load has the opposite parameters.
    pub(crate) fn opposite(&self) -> Self {
        Self {
            force: -self.force,
            moment: -self.moment,
            ..self.clone()
        }
    }

    /// Returns the mounting with the channels exchanged and reversed beforehand.
    pub(crate) fn after(&self, channels: &Channels) -> Self {
        Self {
            force: self.force * channels.force,
            moment: self.moment * channels.moment,
            ..self.clone()
        }
    }
}

/// An exchange and reversal of channels: signed permutations of the forces and of the moments.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Channels {
    pub force: Matrix3<f64>,
    pub moment: Matrix3<f64>,
}

impl Channels {
    /// Returns the channels as they are in the file.
    pub(crate) fn as_recorded() -> Self {
        Self {
            force: Matrix3::identity(),
            moment: Matrix3::identity(),
        }
    }

    /// Returns true if forces and moments are exchanged alike and the axes stay right-handed: the sensor is turned.
    pub(crate) fn is_rotation(&self) -> bool {
        self.force == self.moment && self.force.determinant() > 0.0
    }

    /// Returns true if they are a rotation of a sensor that reads the opposite wrench.
    pub(crate) fn is_opposite_rotation(&self) -> bool {
        self.force == self.moment && self.force.determinant() < 0.0
    }

    /// Returns how many of the six channels differ.
    pub(crate) fn changes(&self) -> usize {
        let of = |m: &Matrix3<f64>| (0..3).filter(|k| m[(*k, *k)] != 1.0).count();
        of(&self.force) + of(&self.moment)
    }

    /// Says what is wrong with the channels, as the begin of a sentence.
    pub(crate) fn words(&self) -> String {
        let minus = -Matrix3::identity();
        let parts: Vec<String> = match (self.force == minus, self.moment == minus) {
            (true, true) => vec!["all six channels have the opposite sign".to_owned()],
            (false, true) if self.force == Matrix3::identity() => {
                vec!["mx, my and mz have the opposite sign".to_owned()]
            }
            (true, false) if self.moment == Matrix3::identity() => {
                vec!["fx, fy and fz have the opposite sign".to_owned()]
            }
            _ => [
                words_of(&self.force, ["fx", "fy", "fz"]),
                words_of(&self.moment, ["mx", "my", "mz"]),
            ]
            .into_iter()
            .flatten()
            .collect(),
        };
        parts.join(", and ")
    }
}

/// Says what a signed permutation of three channels does; `None` for the identity.
fn words_of(matrix: &Matrix3<f64>, names: [&str; 3]) -> Option<String> {
    if *matrix == Matrix3::identity() {
        return None;
    }
    // Row k takes the reading of this channel, with this sign.
    let takes: Vec<(usize, f64)> = (0..3)
        .map(|row| {
            let from = (0..3).find(|c| matrix[(row, *c)] != 0.0).unwrap_or(row);
            (from, matrix[(row, from)])
        })
        .collect();
    let moved: Vec<usize> = (0..3).filter(|k| takes[*k].0 != *k).collect();
    let signs: Vec<&str> = (0..3)
        .filter(|k| takes[*k].1 < 0.0)
        .map(|k| names[takes[k].0])
        .collect();
    let order = match moved.as_slice() {
        [] => None,
        [a, b] => Some(format!("{} and {} are exchanged", names[*a], names[*b])),
        _ => Some(format!(
            "{} are recorded in the columns {}",
            names.join(", "),
            takes
                .iter()
                .map(|(from, _)| names[*from])
                .collect::<Vec<_>>()
                .join(", ")
        )),
    };
    let sign = match signs.as_slice() {
        [] => None,
        [one] => Some(format!("{one} has the opposite sign")),
        more => Some(format!("{} have the opposite sign", more.join(" and "))),
    };
    Some(
        [order, sign]
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
            .join(" and "),
    )
}

/// Returns all 48 signed permutations of three axes, the identity first.
pub(crate) fn signed_permutations() -> Vec<Matrix3<f64>> {
    const ORDERS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [1, 0, 2],
        [0, 2, 1],
        [2, 1, 0],
        [1, 2, 0],
        [2, 0, 1],
    ];
    let mut all = Vec::with_capacity(48);
    for order in ORDERS {
        for signs in 0..8u8 {
            all.push(Matrix3::from_fn(|row, column| {
                let negative = signs >> row & 1 == 1;
                match (order[row] == column, negative) {
                    (false, _) => 0.0,
                    (true, false) => 1.0,
                    (true, true) => -1.0,
                }
            }));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn permutations_are_those_of_a_cube() {
        let all = signed_permutations();
        assert_eq!(all.len(), 48);
        assert_eq!(all[0], Matrix3::identity());
        let turns = all.iter().filter(|m| m.determinant() > 0.0).count();
        assert_eq!(turns, 24);
        for (k, m) in all.iter().enumerate() {
            assert_eq!(m * m.transpose(), Matrix3::identity());
            assert!(!all[..k].contains(m));
        }
    }

    #[test]
    fn exchanged_channels_are_named() {
        let swap = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let of = |force, moment| Channels { force, moment }.words();
        let one = Matrix3::identity();
        assert_eq!(of(swap, one), "fx and fy are exchanged");
        assert_eq!(of(one, -one), "mx, my and mz have the opposite sign");
        let mut up = one;
        up[(2, 2)] = -1.0;
        assert_eq!(of(one, up), "mz has the opposite sign");
        assert_eq!(
            of(swap, swap),
            "fx and fy are exchanged, and mx and my are exchanged"
        );
        assert!(
            !Channels {
                force: swap,
                moment: swap
            }
            .is_rotation()
        );
    }
}
