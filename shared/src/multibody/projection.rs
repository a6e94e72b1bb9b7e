//! Chains in which one drive turns several axes, as `<mimic>` of a URDF states ([`Follower`](super::Follower)).
//!
//! Such a chain has n coordinates q and more axes, whose positions are M·q + b with a constant matrix M. Its quantities
//! are those of the chain of all axes, projected (principle of virtual work):
//!
//! τ = Mᵀ·τ_axes(M·q + b, M·q̇, M·q̈), A = Mᵀ·A_axes·M, Y = Mᵀ·Y_axes
//!
//! Rows of parameters belong to links: first those of the joints in their order, then those of the followers. A follower
//! has no drive and no friction of its own: the last four entries of its row do not enter, and their columns are 0.
//! Friction at its axis acts like friction of its drive.

use super::chain::{Chain, MAX_JOINTS, MultibodyError, check};
use super::parameters::{COLUMNS, column};
use crate::scalar::Real;

/// The largest number of entries of a square over all axes.
const SQUARE: usize = MAX_JOINTS * MAX_JOINTS;
/// The largest number of parameters.
const WIDTH: usize = MAX_JOINTS * COLUMNS;
/// The largest number of entries of a regressor.
pub(super) const REGRESSOR: usize = MAX_JOINTS * WIDTH;

impl<T: Real> Chain<T> {
    /// Computes the positions of all axes.
    fn positions(&self, q: &[T]) -> [T; MAX_JOINTS] {
        let mut out = [T::ZERO; MAX_JOINTS];
        for (to, axis) in out.iter_mut().zip(&self.axes) {
            *to = axis.ratio * q[axis.joint] + axis.offset;
        }
        out
    }

    /// Computes the velocities or accelerations of all axes.
    fn rates(&self, qd: &[T]) -> [T; MAX_JOINTS] {
        let mut out = [T::ZERO; MAX_JOINTS];
        for (to, axis) in out.iter_mut().zip(&self.axes) {
            *to = axis.ratio * qd[axis.joint];
        }
        out
    }

    /// Returns the rows of parameters in the order of the axes.
    fn rows(&self, parameters: &[[T; COLUMNS]]) -> [[T; COLUMNS]; MAX_JOINTS] {
        let mut out = [[T::ZERO; COLUMNS]; MAX_JOINTS];
        for (to, axis) in out.iter_mut().zip(&self.axes) {
            *to = parameters[axis.link];
            if axis.follows {
                to[column::DRIVE_INERTIA..].fill(T::ZERO);
            }
        }
        out
    }

    /// Computes Mᵀ times a vector over the axes.
    pub(super) fn project(&self, of_axes: &[T], out: &mut [T]) {
        out.fill(T::ZERO);
        for (value, axis) in of_axes.iter().zip(&self.axes) {
            out[axis.joint] += axis.ratio * *value;
        }
    }

    /// Computes Mᵀ·S·M for a square over the axes.
    fn project_square(&self, of_axes: &[T], out: &mut [T]) {
        let (n, all) = (self.joint_count(), self.joints.len());
        out.fill(T::ZERO);
        for (row, a) in self.axes.iter().enumerate() {
            for (c, b) in self.axes.iter().enumerate() {
                out[a.joint * n + b.joint] += a.ratio * b.ratio * of_axes[row * all + c];
            }
        }
    }

    /// Copies a row over the columns of all axes to the columns of the links, times `scale`, and adds it to `out`.
    fn add_columns(&self, of_axes: &[T], scale: T, out: &mut [T]) {
        for (block, axis) in of_axes.chunks_exact(COLUMNS).zip(&self.axes) {
            let to = &mut out[axis.link * COLUMNS..][..axis.columns()];
            for (to, value) in to.iter_mut().zip(block) {
                *to += scale * *value;
            }
        }
    }

    /// Computes Mᵀ times a regressor over the axes.
    fn project_regressor(&self, of_axes: &[T], out: &mut [T]) {
        let width = self.parameter_count();
        out.fill(T::ZERO);
        for (row, axis) in of_axes.chunks_exact(width).zip(&self.axes) {
            self.add_columns(row, axis.ratio, &mut out[axis.joint * width..][..width]);
        }
    }

    /// Returns what `of_axes` computes with the chain of all axes and their positions, velocities and accelerations, or the
    /// first of these.
    #[cold]
    #[inline(never)]
    pub(super) fn on_axes<R, const STATES: usize>(
        &self,
        states: [&[T]; STATES],
        of_axes: impl FnOnce(&Self, [&[T]; STATES]) -> Result<R, MultibodyError>,
    ) -> Result<R, MultibodyError> {
        let (n, all) = (self.joint_count(), self.link_count());
        let mut wide = [[T::ZERO; MAX_JOINTS]; STATES];
        for ((argument, state), to) in ["q", "qd", "qdd"].into_iter().zip(states).zip(&mut wide) {
            check(argument, n, state.len())?;
            *to = match argument {
                "q" => self.positions(state),
                _ => self.rates(state),
            };
        }
        of_axes(&self.unfolded(), wide.each_ref().map(|own| &own[..all]))
    }

    /// As [`Self::on_axes`], with the rows of parameters in the order of the axes.
    pub(super) fn on_bodies<R, const STATES: usize>(
        &self,
        parameters: &[[T; COLUMNS]],
        states: [&[T]; STATES],
        of_axes: impl FnOnce(&Self, &[[T; COLUMNS]], [&[T]; STATES]) -> Result<R, MultibodyError>,
    ) -> Result<R, MultibodyError> {
        let all = self.link_count();
        check("parameters", all, parameters.len())?;
        self.on_axes(states, |axes, states| {
            of_axes(axes, &self.rows(parameters)[..all], states)
        })
    }

    /// Computes torques called `argument` from those of all axes, which `of_axes` computes.
    pub(super) fn torques<const STATES: usize>(
        &self,
        parameters: &[[T; COLUMNS]],
        states: [&[T]; STATES],
        (argument, out): (&'static str, &mut [T]),
        of_axes: impl FnOnce(
            &Self,
            &[[T; COLUMNS]],
            [&[T]; STATES],
            &mut [T],
        ) -> Result<(), MultibodyError>,
    ) -> Result<(), MultibodyError> {
        self.on_bodies(parameters, states, |axes, rows, states| {
            check(argument, self.joint_count(), out.len())?;
            let mut wide = [T::ZERO; MAX_JOINTS];
            let wide = &mut wide[..rows.len()];
            of_axes(axes, rows, states, wide)?;
            self.project(wide, out);
            Ok(())
        })
    }

    /// Computes a matrix of n × n from that of all axes, which `of_axes` computes.
    pub(super) fn matrix<const STATES: usize>(
        &self,
        parameters: &[[T; COLUMNS]],
        states: [&[T]; STATES],
        out: &mut [T],
        of_axes: impl FnOnce(
            &Self,
            &[[T; COLUMNS]],
            [&[T]; STATES],
            &mut [T],
        ) -> Result<(), MultibodyError>,
    ) -> Result<(), MultibodyError> {
        self.on_bodies(parameters, states, |axes, rows, states| {
            check("out", self.joint_count() * self.joint_count(), out.len())?;
            let mut square = [T::ZERO; SQUARE];
            let square = &mut square[..rows.len() * rows.len()];
            of_axes(axes, rows, states, square)?;
            self.project_square(square, out);
            Ok(())
        })
    }

    /// Computes a regressor of n × 14·(links) from that of all axes, which `of_axes` computes.
    pub(super) fn projected<const STATES: usize>(
        &self,
        states: [&[T]; STATES],
        out: &mut [T],
        of_axes: impl FnOnce(&Self, [&[T]; STATES], &mut [T]) -> Result<(), MultibodyError>,
    ) -> Result<(), MultibodyError> {
        self.on_axes(states, |axes, states| {
            let (all, width) = (self.link_count(), self.parameter_count());
            check("out", self.joint_count() * width, out.len())?;
            let mut wide = [T::ZERO; REGRESSOR];
            let wide = &mut wide[..all * width];
            of_axes(axes, states, wide)?;
            self.project_regressor(wide, out);
            Ok(())
        })
    }

    /// Computes a row of 14·(links) columns from that of all axes, which `of_axes` computes.
    pub(super) fn arranged<const STATES: usize>(
        &self,
        states: [&[T]; STATES],
        out: &mut [T],
        of_axes: impl FnOnce(&Self, [&[T]; STATES], &mut [T]) -> Result<(), MultibodyError>,
    ) -> Result<(), MultibodyError> {
        self.on_axes(states, |axes, states| {
            let width = self.parameter_count();
            check("out", width, out.len())?;
            let mut wide = [T::ZERO; WIDTH];
            of_axes(axes, states, &mut wide[..width])?;
            out.fill(T::ZERO);
            self.add_columns(&wide[..width], T::ONE, out);
            Ok(())
        })
    }

    /// Computes weights over the axes, so that the weighted sum of the regressor over the axes is that of the projected one.
    pub(super) fn weights(&self, of_joints: &[T], out: &mut [T]) {
        let width = self.parameter_count();
        for (row, a) in out.chunks_exact_mut(width).zip(&self.axes) {
            for (block, b) in row.chunks_exact_mut(COLUMNS).zip(&self.axes) {
                let from = &of_joints[a.joint * width + b.link * COLUMNS..][..b.columns()];
                for (to, weight) in block.iter_mut().zip(from) {
                    *to = a.ratio * *weight;
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "projection_test.rs"]
mod tests;
