//! The equations of the wrist sensor for one mounting: which unknowns there are, and their least squares.
//!
//! s·R·y = W·φ + b + d·t + δ × (s·R·y): y are the readings, R the rotation from the sensor to the last joint, s the sign
//! convention, W the regressor of the wrench, φ the load, b the bias of a recording, d its drift, δ a small rotation of
//! the sensor.

use nalgebra::{DMatrix, DVector, SMatrix, Vector3};
use rig_identify::TriangularFactor;
use rig_shared::multibody::INERTIAL_PARAMETERS;

use crate::estimate::{Parameters, solved};
use crate::mounting::Mounting;
use crate::statistics::{Recorded, Segment, column};
use crate::wrench_row::WrenchRow;

/// Ratio of the readings' size to the smallest noise that is told apart from rounding.
const ROUNDING: f64 = 1e-9;
/// Rounds in which the noise of forces and moments is estimated from the residuals.
const ROUNDS: usize = 4;

/// A jump of the bias of one recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Jump {
    /// Index of the recording.
    pub recording: usize,
    /// First segment after the jump. This one and the one before it are left out.
    pub segment: usize,
}

/// Which unknowns there are beside the load.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Unknowns {
    /// A small rotation of the sensor.
    pub rotation: bool,
    /// A drift of the bias with time, in every recording.
    pub drift: bool,
    /// A drift of the bias with temperature, one for all recordings.
    pub warming: bool,
    /// What is mounted beyond the sensor without the load: there are recordings without the load.
    pub tool: bool,
    /// Jumps of the bias.
    pub jumps: Vec<Jump>,
}

/// Places of the unknowns.
struct Layout<'a> {
    unknowns: &'a Unknowns,
    recordings: usize,
}

impl Layout<'_> {
    fn tool(&self) -> usize {
        INERTIAL_PARAMETERS
    }
    fn bias(&self, recording: usize) -> usize {
        self.tool()
            + if self.unknowns.tool {
                INERTIAL_PARAMETERS
            } else {
                0
            }
            + 6 * recording
    }
    fn after_jump(&self, jump: usize) -> usize {
        self.bias(self.recordings) + 6 * jump
    }
    fn drift(&self, recording: usize) -> usize {
        self.after_jump(self.unknowns.jumps.len()) + 6 * recording
    }
    fn warming(&self) -> usize {
        self.drift(if self.unknowns.drift {
            self.recordings
        } else {
            0
        })
    }
    fn rotation(&self) -> usize {
        self.warming() + if self.unknowns.warming { 6 } else { 0 }
    }
    fn count(&self) -> usize {
        self.rotation() + if self.unknowns.rotation { 3 } else { 0 }
    }
}

/// Recordings, and how the parameters in the flange frame enter the wrench in the frame of the last joint.
pub(crate) struct Sensed<'a> {
    /// The recordings.
    pub recordings: &'a [Recorded],
    /// From the ten parameters in the flange frame to those in the frame of the last joint.
    pub to_joint: &'a SMatrix<f64, INERTIAL_PARAMETERS, INERTIAL_PARAMETERS>,
}

/// A fit of the sensor's equations.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// The mounting with which it was made; the rotation among the unknowns is relative to it.
    pub mounting: Mounting,
    /// The unknowns.
    pub unknowns: Unknowns,
    /// Their values.
    pub values: Vec<f64>,
    /// Standard deviation of the residual: force, N, and moment, N·m.
    pub noise: [f64; 2],
    /// Sums of the squared residuals of forces and of moments.
    pub squares: [f64; 2],
    /// Number of equations.
    pub equations: u64,
}

impl Fit {
    /// Returns the degrees of freedom.
    pub(crate) fn freedom(&self) -> f64 {
        self.equations as f64 - self.values.len() as f64
    }

    /// Returns −2·ln of the likelihood with the noise of forces and moments estimated.
    pub(crate) fn misfit(&self) -> f64 {
        let each = 0.5 * self.equations as f64;
        self.squares.iter().map(|s| each * (s / each).ln()).sum()
    }

    /// Returns [`Self::misfit`] by equation.
    pub(crate) fn misfit_per_equation(&self) -> f64 {
        self.misfit() / self.equations as f64
    }

    /// Returns the sum of squares in units of the noise of `other`.
    pub(crate) fn squares_over(&self, other: &Self) -> f64 {
        (self.squares.iter().zip(other.noise))
            .map(|(s, n)| s / (n * n))
            .sum()
    }
}

impl Sensed<'_> {
    fn layout<'a>(&self, unknowns: &'a Unknowns) -> Layout<'a> {
        Layout {
            unknowns,
            recordings: self.recordings.len(),
        }
    }

    /// Calls `take` with each segment that is used, and the place of its recording's bias.
    fn each_segment(
        &self,
        unknowns: &Unknowns,
        take: &mut dyn FnMut(usize, usize, &Segment, usize),
    ) {
        let layout = self.layout(unknowns);
        for (r, recorded) in self.recordings.iter().enumerate() {
            let jump = unknowns.jumps.iter().position(|jump| jump.recording == r);
            for (g, segment) in recorded.segments.iter().enumerate() {
                let bias = match jump.map(|at| (at, unknowns.jumps[at].segment)) {
                    Some((_, before)) if g + 1 == before || g == before => continue,
                    Some((at, first)) if g > first => layout.after_jump(at),
                    _ => layout.bias(r),
                };
                take(r, g, segment, bias);
            }
        }
    }

    /// Returns the rows of a channel of a segment, one column an unknown, and their right-hand sides.
    fn rows(
        &self,
        [recording, channel, bias]: [usize; 3],
        segment: &Segment,
        mounting: &Mounting,
        unknowns: &Unknowns,
    ) -> (DMatrix<f64>, Vec<f64>) {
        let layout = self.layout(unknowns);
        let triangle = &segment.channels[channel];
        let axis = channel % 3;
        let readings = triangle.columns(column::READINGS, 3);
        // The wrench of the robot on the load by these readings, three components.
        let wrench = readings * mounting.matrix(channel).transpose();
        let own = triangle.columns(0, INERTIAL_PARAMETERS) * self.to_joint;
        let mut rows = DMatrix::zeros(column::COUNT, layout.count());
        if self.recordings[recording].loaded {
            rows.columns_mut(0, INERTIAL_PARAMETERS).copy_from(&own);
        }
        if unknowns.tool {
            rows.columns_mut(layout.tool(), INERTIAL_PARAMETERS)
                .copy_from(&own);
        }
        rows.column_mut(bias + channel)
            .copy_from(&triangle.column(column::ONE));
        if unknowns.drift {
            rows.column_mut(layout.drift(recording) + channel)
                .copy_from(&triangle.column(column::TIME));
        }
        if unknowns.warming {
            rows.column_mut(layout.warming() + channel)
                .copy_from(&triangle.column(column::TEMPERATURE));
        }
        if unknowns.rotation {
            // −(δ × w) of component `axis` for a rotation about each axis.
            for k in 0..3 {
                let mut unit = Vector3::zeros();
                unit[k] = 1.0;
                let mut column = rows.column_mut(layout.rotation() + k);
                for (row, value) in column.iter_mut().enumerate() {
                    let w = Vector3::new(wrench[(row, 0)], wrench[(row, 1)], wrench[(row, 2)]);
                    *value = -unit.cross(&w)[axis];
                }
            }
        }
        (rows, wrench.column(axis).iter().copied().collect())
    }

    /// Returns one factor a segment, in units of the noise, the load's columns first.
    pub(crate) fn factors(
        &self,
        mounting: &Mounting,
        unknowns: &Unknowns,
        noise: [f64; 2],
    ) -> Vec<TriangularFactor> {
        let count = self.layout(unknowns).count();
        let mut factors = Vec::new();
        self.each_segment(unknowns, &mut |recording, _, segment, bias| {
            let mut factor = TriangularFactor::new(count);
            for channel in 0..6 {
                let (rows, right) =
                    self.rows([recording, channel, bias], segment, mounting, unknowns);
                for (row, y) in rows.row_iter().zip(right) {
                    let x: Vec<f64> = row.iter().copied().collect();
                    factor.push(&x, y, 1.0 / noise[channel / 3]);
                }
            }
            factors.push(factor);
        });
        factors
    }

    /// Fits all unknowns; the noise of forces and of moments comes from the residuals.
    pub(crate) fn fit(&self, mounting: &Mounting, unknowns: &Unknowns) -> Fit {
        let rows = self.used_rows(unknowns);
        let count = self.layout(unknowns).count();
        let mut noise = [1.0, 0.1];
        let least = self.sizes(unknowns).map(|size| ROUNDING * size);
        let mut fit = Fit {
            mounting: mounting.clone(),
            unknowns: unknowns.clone(),
            values: vec![0.0; count],
            noise,
            squares: [0.0; 2],
            equations: 6 * rows,
        };
        for _ in 0..ROUNDS {
            let mut whole = TriangularFactor::new(count);
            for factor in self.factors(mounting, unknowns, noise) {
                whole.merge(&factor, 1.0);
            }
            let (r, z) = whole.system();
            fit.values = solved(&r, &z).as_slice().to_vec();
            fit.squares = self.squares(&fit);
            // Each kind bears half of the unknowns.
            let freedom = (0.5 * fit.freedom()).max(1.0);
            for kind in 0..2 {
                fit.squares[kind] = fit.squares[kind].max(least[kind].powi(2) * freedom);
                noise[kind] = (fit.squares[kind] / freedom).sqrt();
            }
            fit.noise = noise;
        }
        fit
    }

    /// Returns true if the fit leaves nothing but rounding: likelihoods of other units cannot be compared then.
    pub(crate) fn is_exact(&self, fit: &Fit) -> bool {
        let sizes = self.sizes(&fit.unknowns);
        (fit.noise.iter().zip(sizes)).any(|(noise, size)| *noise < 1e3 * ROUNDING * size)
    }

    /// Returns the number of rows that are used.
    pub(crate) fn used_rows(&self, unknowns: &Unknowns) -> u64 {
        let mut rows = 0;
        self.each_segment(unknowns, &mut |_, _, segment, _| rows += segment.rows);
        rows
    }

    /// Returns the RMS of forces and of moments.
    fn sizes(&self, unknowns: &Unknowns) -> [f64; 2] {
        let mut sums = [0.0; 2];
        self.each_segment(unknowns, &mut |_, _, segment, _| {
            for (channel, triangle) in segment.channels.iter().enumerate() {
                sums[channel / 3] += triangle
                    .column(column::READINGS + channel % 3)
                    .norm_squared();
            }
        });
        let equations = 3.0 * self.used_rows(unknowns).max(1) as f64;
        sums.map(|sum| (sum / equations).sqrt().max(f64::MIN_POSITIVE))
    }

    /// Returns the squared residuals of forces and of moments.
    fn squares(&self, fit: &Fit) -> [f64; 2] {
        self.squares_by_segment(fit)
            .iter()
            .fold([0.0; 2], |sum, own| [sum[0] + own[0], sum[1] + own[1]])
    }

    /// Returns the squared residuals of forces and of moments in each used segment.
    pub(crate) fn squares_by_segment(&self, fit: &Fit) -> Vec<[f64; 2]> {
        let mut all = Vec::new();
        self.each_segment(&fit.unknowns, &mut |recording, _, segment, bias| {
            let mut sums = [0.0; 2];
            for channel in 0..6 {
                sums[channel / 3] += self
                    .residual([recording, channel, bias], segment, fit)
                    .norm_squared();
            }
            all.push(sums);
        });
        all
    }

    /// Returns the residual of the triangle's rows of a channel.
    fn residual(&self, place: [usize; 3], segment: &Segment, fit: &Fit) -> DVector<f64> {
        let (rows, right) = self.rows(place, segment, &fit.mounting, &fit.unknowns);
        DVector::from_vec(right) - rows * DVector::from_column_slice(&fit.values)
    }

    /// Returns, per recording and segment, the mean residual of each channel in the axes of the last joint.
    pub(crate) fn mean_residuals(&self, fit: &Fit) -> Vec<Vec<[f64; 6]>> {
        let mut means: Vec<Vec<[f64; 6]>> = vec![Vec::new(); self.recordings.len()];
        self.each_segment(&fit.unknowns, &mut |recording, _, segment, bias| {
            means[recording].push(std::array::from_fn(|channel| {
                let residual = self.residual([recording, channel, bias], segment, fit);
                let ones = segment.channels[channel].column(column::ONE);
                ones.dot(&residual) / segment.rows as f64
            }));
        });
        means
    }

    /// Returns the rotation among the unknowns, rad in the axes of the last joint.
    pub(crate) fn rotation(&self, fit: &Fit) -> Option<Vector3<f64>> {
        let at = self.layout(&fit.unknowns).rotation();
        (fit.unknowns.rotation)
            .then(|| Vector3::new(fit.values[at], fit.values[at + 1], fit.values[at + 2]))
    }

    /// Returns the bias of a recording, as the sensor reads it: force and moment in its own axes.
    pub(crate) fn bias(&self, fit: &Fit, recording: usize) -> [f64; 6] {
        self.read(fit, self.layout(&fit.unknowns).bias(recording))
    }

    /// Returns the bias after a jump, as the sensor reads it.
    pub(crate) fn bias_after(&self, fit: &Fit, jump: usize) -> [f64; 6] {
        self.read(fit, self.layout(&fit.unknowns).after_jump(jump))
    }

    /// Returns the drift of a recording from its begin to its end, as the sensor reads it.
    pub(crate) fn drift(&self, fit: &Fit, recording: usize) -> Option<[f64; 6]> {
        let at = self.layout(&fit.unknowns).drift(recording);
        fit.unknowns.drift.then(|| self.read(fit, at))
    }

    /// Returns the drift with temperature, per °C, as the sensor reads it.
    pub(crate) fn warming(&self, fit: &Fit) -> Option<[f64; 6]> {
        let at = self.layout(&fit.unknowns).warming();
        fit.unknowns.warming.then(|| self.read(fit, at))
    }

    /// Returns what the sensor would read at a row of a recording by the fit.
    pub(crate) fn predicted(&self, fit: &Fit, recording: usize, row: &WrenchRow) -> [f64; 6] {
        let (layout, recorded) = (self.layout(&fit.unknowns), &self.recordings[recording]);
        let jump = fit
            .unknowns
            .jumps
            .iter()
            .position(|jump| jump.recording == recording);
        let after = jump.filter(|at| {
            let share = fit.unknowns.jumps[*at].segment as f64 / recorded.segments.len() as f64;
            row.time > share * recorded.length
        });
        let bias = after.map_or(layout.bias(recording), |at| layout.after_jump(at));
        let part =
            |at: usize| Parameters::from_column_slice(&fit.values[at..at + INERTIAL_PARAMETERS]);
        let mut load = Parameters::zeros();
        if recorded.loaded {
            load += part(0);
        }
        if fit.unknowns.tool {
            load += part(layout.tool());
        }
        let load = self.to_joint * load;
        let wrench: [f64; 6] = std::array::from_fn(|channel| {
            let own = &row.regressor[channel * INERTIAL_PARAMETERS..][..INERTIAL_PARAMETERS];
            let mut sum = fit.values[bias + channel];
            sum += own.iter().zip(load.iter()).map(|(w, p)| w * p).sum::<f64>();
            if fit.unknowns.drift {
                let share = row.time / recorded.length - 0.5;
                sum += share * fit.values[layout.drift(recording) + channel];
            }
            if fit.unknowns.warming {
                let warmer = row.temperature - recorded.reference;
                sum += warmer * fit.values[layout.warming() + channel];
            }
            sum
        });
        self.as_read(fit, &wrench)
    }

    /// Turns six unknowns from the axes of the joint to readings.
    fn read(&self, fit: &Fit, at: usize) -> [f64; 6] {
        self.as_read(fit, &fit.values[at..at + 6])
    }

    /// Turns a wrench of the robot on the load, in the axes of the last joint, to readings.
    fn as_read(&self, fit: &Fit, wrench: &[f64]) -> [f64; 6] {
        let of = |first: usize| {
            let own = Vector3::from_column_slice(&wrench[first..first + 3]);
            fit.mounting.matrix(first).transpose() * own
        };
        let (force, moment) = (of(0), of(3));
        [force.x, force.y, force.z, moment.x, moment.y, moment.z]
    }
}
