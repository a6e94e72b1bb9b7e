//! Samples of a chain in which one drive turns several axes: signals of the axes, and results of the joints.

use rig_shared::multibody::block::{LANES, Lane, lower};
use rig_shared::multibody::{AxisMotion, COLUMNS, Chain, column};

use super::dispatch::Number;

/// How the axes of a chain move with its joints.
#[derive(Clone, Debug)]
pub(super) struct Gears<T> {
    axes: Vec<AxisMotion<T>>,
    joints: usize,
}

impl<T: Number> Gears<T> {
    /// Returns the gears of a chain; `None` if every axis is a joint.
    pub(super) fn of(chain: &Chain<f64>) -> Option<Self> {
        let axis = |own: AxisMotion<f64>| AxisMotion {
            link: own.link,
            joint: own.joint,
            ratio: T::from_f64(own.ratio),
            offset: T::from_f64(own.offset),
            follows: own.follows,
        };
        chain.has_followers().then(|| Self {
            axes: chain.axis_motions().map(axis).collect(),
            joints: chain.joint_count(),
        })
    }

    pub(super) fn joint_count(&self) -> usize {
        self.joints
    }

    /// Returns the rows of parameters by axis, those of followers without drive and friction.
    pub(super) fn rows(&self, parameters: &[[f64; COLUMNS]]) -> Vec<[f64; COLUMNS]> {
        let row = |axis: &AxisMotion<T>| {
            let mut row = parameters[axis.link];
            if axis.follows {
                row[column::DRIVE_INERTIA..].fill(0.0);
            }
            row
        };
        self.axes.iter().map(row).collect()
    }

    /// Returns the positions of the axes, one column an axis.
    pub(super) fn positions<S: AsRef<[T]>>(&self, q: &[S]) -> Vec<Vec<T>> {
        self.of_axes(q, |axis, q| axis.ratio * q + axis.offset)
    }

    /// Returns the velocities or accelerations of the axes, one column an axis.
    pub(super) fn rates<S: AsRef<[T]>>(&self, qd: &[S]) -> Vec<Vec<T>> {
        self.of_axes(qd, |axis, qd| axis.ratio * qd)
    }

    fn of_axes<S: AsRef<[T]>>(
        &self,
        signals: &[S],
        of: impl Fn(&AxisMotion<T>, T) -> T,
    ) -> Vec<Vec<T>> {
        (self.axes.iter())
            .map(|axis| {
                let signal = signals[axis.joint].as_ref();
                signal.iter().map(|x| of(axis, *x)).collect()
            })
            .collect()
    }

    /// Spreads a block's samples over the axes.
    pub(super) fn spread(&self, of_joints: &[Lane<T>], is_position: bool, out: &mut [Lane<T>]) {
        for (to, axis) in out.iter_mut().zip(&self.axes) {
            let offset = if is_position { axis.offset } else { T::ZERO };
            for k in 0..LANES {
                to[k] = axis.ratio * of_joints[axis.joint][k] + offset;
            }
        }
    }

    /// Projects one column an axis, each of `samples`, to one a joint.
    pub(super) fn project(&self, of_axes: &[T], samples: usize, out: &mut [T]) {
        out.fill(T::ZERO);
        for (a, axis) in self.axes.iter().enumerate() {
            let to = &mut out[axis.joint * samples..][..samples];
            add(axis.ratio, &of_axes[a * samples..][..samples], to);
        }
    }

    /// Projects a square over the axes, columns row by row, to one over the joints.
    pub(super) fn project_square(&self, of_axes: &[T], samples: usize, out: &mut [T]) {
        out.fill(T::ZERO);
        for (i, a) in self.axes.iter().enumerate() {
            for (j, b) in self.axes.iter().enumerate() {
                let from = &of_axes[(i * self.axes.len() + j) * samples..][..samples];
                let to = &mut out[(a.joint * self.joints + b.joint) * samples..][..samples];
                add(a.ratio * b.ratio, from, to);
            }
        }
    }

    /// Projects a symmetric matrix over the axes, given by the columns of its lower triangle.
    pub(super) fn project_lower(&self, of_axes: &[T], samples: usize, out: &mut [T]) {
        out.fill(T::ZERO);
        for (i, a) in self.axes.iter().enumerate() {
            for (j, b) in self.axes.iter().enumerate() {
                // The upper triangle of the result is not stored.
                if b.joint > a.joint {
                    continue;
                }
                let from = &of_axes[lower(i.max(j), i.min(j)) * samples..][..samples];
                let to = &mut out[lower(a.joint, b.joint) * samples..][..samples];
                add(a.ratio * b.ratio, from, to);
            }
        }
    }

    /// Returns true if parameter `c` of the links has no effect on the torque of `joint` for any motion.
    pub(super) fn is_zero(&self, joint: usize, c: usize) -> bool {
        let (link, place) = (c / COLUMNS, c % COLUMNS);
        if place >= column::DRIVE_INERTIA {
            return link != joint;
        }
        let axes = self.axes.iter().take_while(|axis| axis.link != link);
        let own = self.axes.iter().find(|axis| axis.link == link);
        !axes.chain(own).any(|axis| axis.joint == joint)
    }

    /// Projects a block's regressor over the axes, [`LANES`] samples a column, to the columns of joints and links in
    /// `out`: column c begins at `c * stride + at`.
    pub(super) fn project_regressor(&self, of_axes: &[T], out: &mut [T], stride: usize, at: usize) {
        let width = self.axes.len() * COLUMNS;
        for joint in 0..self.joints {
            for axis in &self.axes {
                for place in 0..axis.columns() {
                    let c = joint * width + axis.link * COLUMNS + place;
                    if !self.is_zero(joint, axis.link * COLUMNS + place) && place != column::OFFSET
                    {
                        out[c * stride + at..][..LANES].fill(T::ZERO);
                    }
                }
            }
        }
        for (a, row) in self.axes.iter().enumerate() {
            for (i, axis) in self.axes.iter().enumerate().skip(a) {
                // Drive and friction are columns of the axis itself; that of the offset is not computed.
                let own = if i == a {
                    axis.columns()
                } else {
                    column::DRIVE_INERTIA
                };
                for place in 0..own.min(column::OFFSET) {
                    let from = (a * width + i * COLUMNS + place) * LANES;
                    let c = row.joint * width + axis.link * COLUMNS + place;
                    let to = &mut out[c * stride + at..][..LANES];
                    add(row.ratio, &of_axes[from..][..LANES], to);
                }
            }
        }
    }

    /// Moves rows over the columns of the axes to those of the links.
    pub(super) fn arrange(&self, of_axes: &[T], samples: usize, out: &mut [T]) {
        out.fill(T::ZERO);
        for (a, axis) in self.axes.iter().enumerate() {
            let block = COLUMNS * samples;
            let used = axis.columns() * samples;
            let to = &mut out[axis.link * block..][..used];
            to.copy_from_slice(&of_axes[a * block..][..used]);
        }
    }
}

/// to += ratio · from
fn add<T: Number>(ratio: T, from: &[T], to: &mut [T]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += ratio * *from;
    }
}
