//! Size of a hidden effect relative to the noise floor.
//!
//! Both are residual RMS values after a refit of the nominal model J·q̈ + m·g·l·sin q + fv·q̇ + fc·sgn q̇ to the
//! torque. Model and torque pass the same zero-phase filter of 40 Hz. Only rows in motion count, because sgn q̇ is
//! undefined at rest. The excess comes from two recordings without noise, with and without the effect.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::error::ScenarioError;
use super::reference::RATE;
use rig_data::Block;
use rig_data::prepare::{LowPass, central_difference, second_difference};

/// Cut-off of the filter for residuals, Hz.
const BAND: f64 = 40.0;
/// Every tenth sample is used, so the sample rate stays above twice the band.
const STRIDE: usize = 10;

/// Speed above which the joint counts as moving, rad/s.
const MOVING: f64 = 0.01;

/// Size of a hidden effect.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Size {
    /// RMS of the part of the residual that the effect causes after a refit of the nominal model.
    pub excess_rms: f64,
    /// As `excess_rms`, with the nominal parameters from before instead of a refit.
    pub frozen_rms: f64,
    /// Noise floor: residual RMS after a refit, with noise and without the hidden effect.
    pub floor_rms: f64,
    /// As `floor_rms`, but without noise: the residual from filtering and reversals.
    pub base_rms: f64,
    /// Unit of the RMS values, ASCII; V for an effect that shows only in the voltage.
    pub unit: &'static str,
    /// True if the effect is a change of parameters, which a refit removes.
    pub parameter_change: bool,
}

/// Ratio of an effect's residual after a refit to the noise floor from which on a diagnosis should find it.
pub const ABOVE_FLOOR: f64 = 0.5;

impl Size {
    /// Returns true if a diagnosis should find the effect: its residual is at least [`ABOVE_FLOOR`] times the noise
    /// floor. For a change of parameters this is the residual without a refit.
    pub fn above_floor(&self) -> bool {
        let rms = if self.parameter_change {
            self.frozen_rms
        } else {
            self.excess_rms
        };
        rms >= ABOVE_FLOOR * self.floor_rms
    }
}

/// Equation that is refitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Equation {
    /// Equation of motion, N·m.
    Torque,
    /// Voltage equation of the winding, V: u = R·i + L·di/dt + k·q̇.
    Voltage,
}

/// A linear model of one recording: regressor columns and target.
pub(super) struct Problem {
    columns: DMatrix<f64>,
    target: DVector<f64>,
    equation: Equation,
}

impl Problem {
    pub(super) fn of(block: &Block, equation: Equation) -> Result<Self, ScenarioError> {
        let Signals {
            columns,
            target,
            velocity,
        } = Signals::of(block, equation)?;
        let rows: Vec<usize> = (0..velocity.len())
            .step_by(STRIDE)
            .filter(|&k| velocity[k].abs() > MOVING)
            .collect();
        Ok(Self {
            columns: DMatrix::from_fn(rows.len(), columns.len(), |k, c| columns[c][rows[k]]),
            target: DVector::from_fn(rows.len(), |k, _| target[rows[k]]),
            equation,
        })
    }

    /// Returns the prediction of the refitted model at every sample.
    pub(super) fn explained(&self, block: &Block) -> Result<Vec<f64>, ScenarioError> {
        let parameters = self.refit()?;
        let signals = Signals::of(block, self.equation)?;
        let at = |k: usize| {
            let terms = signals.columns.iter().zip(&parameters);
            terms.map(|(column, p)| column[k] * p).sum()
        };
        Ok((0..signals.target.len()).map(at).collect())
    }

    /// Refits the parameters by least squares.
    pub(super) fn refit(&self) -> Result<DVector<f64>, ScenarioError> {
        let normal = self.columns.transpose() * &self.columns;
        let right = self.columns.transpose() * &self.target;
        normal
            .cholesky()
            .map(|factor| factor.solve(&right))
            .ok_or_else(|| ScenarioError("the motion does not excite the model".into()))
    }

    /// Residual RMS with these parameters.
    pub(super) fn rms(&self, parameters: &DVector<f64>) -> f64 {
        let left = &self.target - &self.columns * parameters;
        (left.norm_squared() / left.len() as f64).sqrt()
    }
}

/// Columns and target at every sample.
struct Signals {
    columns: Vec<Vec<f64>>,
    target: Vec<f64>,
    velocity: Vec<f64>,
}

impl Signals {
    fn of(block: &Block, equation: Equation) -> Result<Self, ScenarioError> {
        let failed = |what: &str| ScenarioError(what.into());
        let filter =
            LowPass::butterworth(4, BAND, RATE).ok_or_else(|| failed("the band does not exist"))?;
        let joint = block
            .joints
            .first()
            .ok_or_else(|| failed("the recording has no joint"))?;
        let q = filter.zero_phase(&joint.q);
        let velocity = central_difference(&q, 1.0 / RATE);
        let acceleration = second_difference(&q, 1.0 / RATE);
        let each = |law: &dyn Fn(usize) -> f64| {
            let column: Vec<f64> = (0..q.len()).map(law).collect();
            filter.zero_phase(&column)
        };
        let (columns, target) = match equation {
            Equation::Torque => (
                vec![
                    filter.zero_phase(&acceleration),
                    each(&|k| q[k].sin()),
                    filter.zero_phase(&velocity),
                    each(&|k| velocity[k].signum()),
                ],
                filter.zero_phase(&joint.tau),
            ),
            Equation::Voltage => {
                let current = filter.zero_phase(&joint.tau);
                let change = central_difference(&current, 1.0 / RATE);
                let voltage = joint.voltage.as_ref();
                let voltage = voltage.ok_or_else(|| failed("no voltage was recorded"))?;
                (
                    vec![current, change, filter.zero_phase(&velocity)],
                    filter.zero_phase(voltage),
                )
            }
        };
        Ok(Self {
            columns,
            target,
            velocity,
        })
    }
}

/// RMS of the part of `with` that is not in `without`, assuming both parts are uncorrelated.
pub(super) fn beyond(with: f64, without: f64) -> f64 {
    (with * with - without * without).max(0.0).sqrt()
}
