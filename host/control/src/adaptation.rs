//! The base parameters of the adaptive law: rates, bounds, and what a motion excites of them.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::design::at_start;
use super::error::ControlError;
use super::law_model::LawModel;
use super::settings::Settings;
use rig_identify::{Base, ModelKind};
use rig_shared::control::arm::PassiveRegressor;
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::trajectory::Reference;
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

/// Share of the largest parameter of its kind that counts as the size of a smaller one.
const LEAST_SIZE: f64 = 0.05;
/// RMS torque of a parameter error of one size, as a share of the motion's RMS torque or of the dry friction, whichever is
/// larger, from which the motion excites the direction of that error. A choice: a hundredth; less drowns in the friction
/// that is not compensated.
pub const EXCITED: f64 = 0.01;
/// K_D·ω over the mean gain of the adaptation as an integral of s. 4 would be critically damped with a constant gain; 8
/// leaves room for its peaks, which are a few times the mean.
const SLOWER: f64 = 8.0;
/// Mean square torque of a parameter, as a share of the largest in the joint, below which it counts as this share. It keeps
/// the rate of a parameter that the motion hardly excites within bounds.
const WEAK: f64 = 0.01;
/// Instants of the planned motion at which the regressor is evaluated.
const DESIGNED: usize = 200;
/// Bound on a parameter that is not friction, in sizes from its start.
const BOUND: f64 = 20.0;

/// The base parameters of a robot.
pub(crate) struct Parameters {
    /// The base parameters as combinations of the standard ones.
    pub base: Base,
    /// Size of each, in its unit.
    pub size: Vec<f64>,
    /// Γ of each.
    pub rate: Vec<f64>,
    /// Lowest value of each.
    pub lower: Vec<f64>,
    /// Highest value of each.
    pub upper: Vec<f64>,
}

/// Kinds of columns: mass, first moment, inertia, drive inertia, viscous, Coulomb, offset.
fn kind(column: usize, links: usize) -> usize {
    match column.checked_sub(COLUMNS * links) {
        Some(motor) => [3, 4, 5][motor % MOTOR_COLUMNS] + 10,
        None => match column % COLUMNS {
            column::MASS => 0,
            1..=3 => 1,
            4..=9 => 2,
            place => place - column::DRIVE_INERTIA + 3,
        },
    }
}

fn is_friction(column: usize, links: usize) -> bool {
    match column.checked_sub(COLUMNS * links) {
        Some(motor) => motor % MOTOR_COLUMNS != motor_column::INERTIA,
        None => matches!(column % COLUMNS, column::VISCOUS | column::COULOMB),
    }
}

impl Parameters {
    /// Returns rates and bounds for a model and a planned motion; `derivative` is K_D of each joint, and `torque` a
    /// torque scale of each joint.
    ///
    /// Γ is the same for all parameters in units of their sizes and of the torque that they make in the motion. The
    /// adaptation acts like an integral of s with the gain Y·Γ·Yᵀ. Γ is as large as lets the mean of this gain stay below
    /// K_D·ω/[`SLOWER`] in every joint.
    pub(crate) fn of(
        model: &LawModel,
        regressor: &PassiveRegressor<'_, f64>,
        reference: &[Vec<Reference<f64>>],
        [derivative, torque]: [&[f64]; 2],
        settings: &Settings,
    ) -> Result<Self, ControlError> {
        let links = model.chain.link_count();
        let base = Base::structural(&model.robot, ModelKind::Differential, settings.seed)?;
        let values = values(&base, model);
        let mut largest = [0.0_f64; 20];
        for (&c, value) in base.columns.iter().zip(&values) {
            let own = &mut largest[kind(c, links)];
            *own = own.max(value.abs());
        }
        let (mut size, mut lower, mut upper) = (Vec::new(), Vec::new(), Vec::new());
        for (&c, value) in base.columns.iter().zip(&values) {
            let joint = match c.checked_sub(COLUMNS * links) {
                Some(motor) => motor / MOTOR_COLUMNS,
                None => (model.robot.joint_of_link(c / COLUMNS)).unwrap_or_default(),
            };
            // A kind whose parameters are all zero: a constant torque or friction that the model does not have.
            let least = match largest[kind(c, links)] {
                0.0 => LEAST_SIZE * torque[joint],
                some => LEAST_SIZE * some,
            };
            let own = value.abs().max(least);
            size.push(own);
            lower.push(if is_friction(c, links) {
                0.0
            } else {
                value - BOUND * own
            });
            upper.push(value + BOUND * own);
        }
        let squares = mean_squares(&base.columns, &size, regressor, reference)?;
        let highest: Vec<f64> = (derivative.iter())
            .map(|own| own * settings.omega() / SLOWER)
            .collect();
        let rate = rates(&squares, &size, &highest);
        Ok(Self {
            base,
            size,
            rate,
            lower,
            upper,
        })
    }

    /// Returns the values of the base parameters of a model.
    pub(crate) fn values(&self, model: &LawModel) -> Vec<f64> {
        values(&self.base, model)
    }
}

/// Mean of (Y·size)² over a motion, for each joint and parameter.
fn mean_squares(
    columns: &[usize],
    size: &[f64],
    regressor: &PassiveRegressor<'_, f64>,
    reference: &[Vec<Reference<f64>>],
) -> Result<Vec<Vec<f64>>, ControlError> {
    let n = reference.len();
    let mut sums = vec![vec![0.0; size.len()]; n];
    let stride = reference[0].len().div_ceil(DESIGNED).max(1);
    let rows = reference[0].len().div_ceil(stride) as f64;
    each_regressor(regressor, reference, stride, |out| {
        for (j, sums) in sums.iter_mut().enumerate() {
            for ((own, &c), size) in sums.iter_mut().zip(columns).zip(size) {
                *own += (regressor.entry(out, j, c) * size).powi(2) / rows;
            }
        }
    })?;
    Ok(sums)
}

/// Returns Γ of each parameter, such that their gains add up to no more than `highest` in each joint.
fn rates(squares: &[Vec<f64>], size: &[f64], highest: &[f64]) -> Vec<f64> {
    let floors: Vec<f64> = (squares.iter())
        .map(|row| WEAK * row.iter().copied().fold(0.0, f64::max))
        .collect();
    let counts = squares.iter().zip(&floors);
    let counts: Vec<f64> = counts
        .map(|(row, floor)| row.iter().filter(|y| **y > *floor).count().max(1) as f64)
        .collect();
    (size.iter().enumerate())
        .map(|(k, size)| {
            let joints = squares.iter().zip(&floors).zip(highest.iter().zip(&counts));
            let most = joints
                .filter(|((row, _), _)| row[k] > 0.0)
                .map(|((row, floor), (highest, count))| highest / (count * row[k].max(*floor)));
            let most = most.fold(f64::INFINITY, f64::min);
            if most.is_finite() {
                size * size * most
            } else {
                0.0
            }
        })
        .collect()
}

/// Calls `take` with the regressor at every `stride`-th tick of a planned motion.
fn each_regressor(
    regressor: &PassiveRegressor<'_, f64>,
    reference: &[Vec<Reference<f64>>],
    stride: usize,
    mut take: impl FnMut(&[f64]),
) -> Result<(), ControlError> {
    let n = reference.len();
    let mut out = vec![0.0; n * regressor.width()];
    let mut workspace = vec![0.0; regressor.workspace_length()];
    for k in (0..reference[0].len()).step_by(stride) {
        let pick = |which: fn(&Reference<f64>) -> f64| -> Vec<f64> {
            reference.iter().map(|series| which(&series[k])).collect()
        };
        let (q, v) = (pick(|r| r.position), pick(|r| r.velocity));
        let a = pick(|r| r.acceleration);
        (regressor.evaluate(&q, &v, [&v, &a], &mut workspace, &mut out)).map_err(at_start)?;
        take(&out);
    }
    Ok(())
}

fn values(base: &Base, model: &LawModel) -> Vec<f64> {
    let standard = DVector::from_vec(model.standard());
    (&base.combination * standard).as_slice().to_vec()
}

/// What a motion excites of a set of parameters.
pub(crate) struct Excitation {
    /// Mean of YᵀY over the motion in units of sizes and torque limits.
    information: DMatrix<f64>,
    /// Projection on the excited directions.
    projection: DMatrix<f64>,
    /// Number of excited directions.
    pub directions: usize,
}

impl Excitation {
    /// Evaluates a motion, of which every `stride`-th tick is used.
    pub(crate) fn of(
        parameters: &Parameters,
        regressor: &PassiveRegressor<'_, f64>,
        reference: &[Vec<Reference<f64>>],
        torque_scale: &[f64],
        stride: usize,
    ) -> Result<Self, ControlError> {
        let columns = &parameters.base.columns;
        let mut information = DMatrix::<f64>::zeros(columns.len(), columns.len());
        let mut rows = 0.0;
        each_regressor(regressor, reference, stride, |out| {
            for (j, scale) in torque_scale.iter().enumerate() {
                let entries = columns.iter().zip(&parameters.size);
                let row = DVector::from_iterator(
                    columns.len(),
                    entries.map(|(&c, size)| regressor.entry(out, j, c) * size / scale),
                );
                information.ger(1.0, &row, &row, 1.0);
            }
            rows += 1.0;
        })?;
        information /= f64::max(rows, 1.0);
        let sizes = DVector::from_iterator(
            columns.len(),
            parameters
                .lower
                .iter()
                .zip(&parameters.upper)
                .zip(&parameters.size)
                .map(|((_, upper), size)| (upper - BOUND * size) / size),
        );
        // At rest the motion makes no torque, or rounding errors alone; dry friction that is not compensated acts all the same.
        let coulomb = |c: usize| c < COLUMNS * torque_scale.len() && c % COLUMNS == column::COULOMB;
        let dry = (columns.iter().enumerate())
            .filter(|(_, c)| coulomb(**c))
            .map(|(k, c)| sizes[k] * parameters.size[k] / torque_scale[c / COLUMNS]);
        let moved = (sizes.transpose() * &information * &sizes)[(0, 0)];
        let mean_square = moved.max(dry.map(|torque| torque * torque).sum());
        let eigen = SymmetricEigen::new(information.clone());
        let mut projection = DMatrix::zeros(columns.len(), columns.len());
        let mut directions = 0;
        for (value, vector) in eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
        {
            if *value >= EXCITED * EXCITED * mean_square {
                projection.ger(1.0, &vector, &vector, 1.0);
                directions += 1;
            }
        }
        Ok(Self {
            information,
            projection,
            directions,
        })
    }

    /// Returns the share of a parameter (from 0) that lies in the excited directions, 0 to 1.
    pub(crate) fn share(&self, parameter: usize) -> f64 {
        self.projection[(parameter, parameter)]
    }

    /// Returns the size of an error of the parameters in the excited directions, in sizes, and the RMS torque that it
    /// makes, as a share of the torque limits.
    pub(crate) fn error(&self, theta: &[f64], truth: &[f64], size: &[f64]) -> [f64; 2] {
        let entries = theta.iter().zip(truth).zip(size);
        let off = DVector::from_iterator(
            theta.len(),
            entries.map(|((own, truth), size)| (own - truth) / size),
        );
        let torque = (off.transpose() * &self.information * &off)[(0, 0)];
        [(&self.projection * &off).norm(), torque.max(0.0).sqrt()]
    }
}
