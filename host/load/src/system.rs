//! The equations of the wrist sensor for one mounting: which unknowns there are, and their least squares.
//!
//! s·R·y = (W + ε × g)·φ − T·Ẇ·φ + b + d·t + δ × (s·R·y) − p × f: y are the readings, R the rotation of the sensor
//! against the description, s the sign convention, W the regressor of the wrench, φ the load, b the bias of a recording. Further
//! unknowns are a drift d of the bias, a small rotation δ of the sensor, a small rotation ε of gravity, a delay T of the
//! sensor against the encoders, and an error p of the sensor's position, beside the force f of the load. A scale of the
//! moments multiplies what the load adds to them, the gain of a channel what it adds to that channel.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{
    DMatrix, DMatrixView, DMatrixViewMut, DVector, Dyn, OMatrix, Rotation3, SMatrix, U3, Unit,
    Vector3,
};
use rig_identify::{TriangularFactor, f_p_value};
use rig_shared::multibody::INERTIAL_PARAMETERS;

use crate::estimate::{Parameters, solved};
use crate::mounting::Mounting;
use crate::statistics::{Recorded, Segment, column, others};
use crate::wrench_row::{WEIGHED, WrenchRow};

/// Ratio of the readings' size to the smallest noise that is told apart from rounding.
const ROUNDING: f64 = 1e-9;
/// Rounds in which the noise of forces and moments is estimated from the residuals.
const ROUNDS: usize = 4;

/// A jump of the bias of one recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Jump {
    /// Index of the recording.
    pub recording: usize,
    /// First segment after the jump. Of a motion, this one and the one before it are left out. Poses have a jump between them.
    pub segment: usize,
}

impl Jump {
    /// Returns true if a segment of its recording is left out because of it.
    fn is_beside(&self, segment: usize, poses: bool) -> bool {
        !poses && (segment + 1 == self.segment || segment == self.segment)
    }
}

/// A property of sensor, recorder or base that is an unknown beside the load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Nuisance {
    /// A small rotation of the sensor's axes.
    Rotation,
    /// A small rotation of gravity in the base frame: the base leans.
    Lean,
    /// A delay of the sensor against the encoders.
    Delay,
    /// An error of the sensor's position.
    Origin,
    /// A drift of the bias with time, in every recording.
    Drift,
    /// A drift of the bias with temperature, one for all recordings.
    Warming,
    /// A small relative change of the scale of the moments. None of [`Self::ALL`]: a scale is a fault to be named.
    Scale,
    /// A change of the gain of one channel. None of [`Self::ALL`], as a scale.
    Gain(usize),
}

impl Nuisance {
    /// Those that are estimated where the data show them.
    pub(crate) const ALL: [Self; 6] = [
        Self::Rotation,
        Self::Lean,
        Self::Delay,
        Self::Origin,
        Self::Drift,
        Self::Warming,
    ];

    /// Returns true if its unknowns multiply those of the load.
    fn is_product(self) -> bool {
        match self {
            Self::Lean | Self::Delay | Self::Origin | Self::Scale | Self::Gain(_) => true,
            Self::Rotation | Self::Drift | Self::Warming => false,
        }
    }

    /// Returns the number of its unknowns.
    fn count(self, recordings: usize) -> usize {
        match self {
            Self::Delay | Self::Scale | Self::Gain(_) => 1,
            Self::Lean => 2,
            Self::Rotation | Self::Origin => 3,
            Self::Warming => 6,
            Self::Drift => 6 * recordings,
        }
    }
}

/// Which unknowns there are beside the load.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Unknowns {
    /// What is mounted beyond the sensor without the load: there are recordings without the load.
    pub tool: bool,
    /// Jumps of the bias.
    pub jumps: Vec<Jump>,
    /// The others.
    pub nuisances: Vec<Nuisance>,
}

impl Unknowns {
    /// Returns them without jumps and nuisances.
    pub(crate) fn plain(&self) -> Self {
        Self {
            tool: self.tool,
            ..Self::default()
        }
    }

    /// Returns true if `nuisance` is among them.
    pub(crate) fn has(&self, nuisance: Nuisance) -> bool {
        self.nuisances.contains(&nuisance)
    }

    /// Returns the index of the last of the jumps of a recording that have happened.
    fn last_jump(&self, recording: usize, has_happened: impl Fn(&Jump) -> bool) -> Option<usize> {
        let all = self.jumps.iter().enumerate();
        let own = all.filter(|(_, jump)| jump.recording == recording && has_happened(jump));
        own.max_by_key(|(_, jump)| jump.segment).map(|(at, _)| at)
    }

    /// Returns them with another one.
    pub(crate) fn with(&self, nuisance: Nuisance) -> Self {
        let mut more = self.clone();
        if !more.has(nuisance) {
            more.nuisances.push(nuisance);
        }
        more
    }

    /// Returns them without one.
    pub(crate) fn without(&self, nuisance: Nuisance) -> Self {
        let mut fewer = self.clone();
        fewer.nuisances.retain(|own| *own != nuisance);
        fewer
    }
}

/// Number of a segment, and the mean residual of each channel in it.
pub(crate) type SegmentMean = (usize, [f64; 6]);

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
    /// Returns the places of a nuisance.
    fn place(&self, nuisance: Nuisance) -> Option<Range<usize>> {
        let mut at = self.after_jump(self.unknowns.jumps.len());
        for own in &self.unknowns.nuisances {
            let next = at + own.count(self.recordings);
            if *own == nuisance {
                return Some(at..next);
            }
            at = next;
        }
        None
    }
    fn count(&self) -> usize {
        let nuisances = self.unknowns.nuisances.iter();
        let others: usize = nuisances.map(|own| own.count(self.recordings)).sum();
        self.after_jump(self.unknowns.jumps.len()) + others
    }
}

/// Recordings, and how the parameters in the flange frame enter the wrench in the described axes of the sensor.
pub(crate) struct Sensed<'a> {
    /// The recordings.
    pub recordings: &'a [Recorded],
    /// From the ten parameters in the flange frame to those in the described axes of the sensor.
    pub to_axes: &'a SMatrix<f64, INERTIAL_PARAMETERS, INERTIAL_PARAMETERS>,
    /// Gravity as described, in the base frame, m/s².
    pub gravity: Vector3<f64>,
    /// Noise of the moments over that of the forces, m, where the rows do not tell it.
    pub lever: f64,
}

/// A fit of the sensor's equations.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// The mounting with which it was made; rotations among the unknowns are relative to it.
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

    /// Returns the probability that this fit leaves less than one with fewer unknowns by chance (F test, both in the noise of
    /// this one); `None` if it has no further unknowns.
    pub(crate) fn chance_over(&self, smaller: &Self) -> Option<f64> {
        let further = self.values.len() as f64 - smaller.values.len() as f64;
        let freedom = self.freedom();
        if further <= 0.0 || freedom <= 0.0 {
            return None;
        }
        let own = self.squares_over(self);
        // Fits of unlike many equations are compared by equation.
        let before = smaller.squares_over(self) * self.equations as f64 / smaller.equations as f64;
        let ratio = (before - own) / further / (own / freedom);
        f_p_value(ratio, [further, freedom])
    }
}

/// Turn of gravity from which on the robot is mounted otherwise than described, rad: no base on a floor leans by 45 degrees.
pub(crate) const MOUNTED: f64 = std::f64::consts::FRAC_PI_4;

impl Sensed<'_> {
    fn layout<'a>(&self, unknowns: &'a Unknowns) -> Layout<'a> {
        Layout {
            unknowns,
            recordings: self.recordings.len(),
        }
    }

    /// Returns a mounting with gravity reversed; `None` if there are poses, which do not tell it from the opposite reading.
    pub(crate) fn reversed_gravity(&self, start: &Mounting) -> Option<Mounting> {
        if self.recordings.iter().any(|own| own.poses) || self.gravity == Vector3::zeros() {
            return None;
        }
        Some(self.upside_down(start))
    }

    /// Returns a mounting with gravity reversed.
    pub(crate) fn upside_down(&self, start: &Mounting) -> Mounting {
        let down = start.gravity * self.gravity;
        let level = Unit::new_normalize(down.cross(&Vector3::ith(down.iamin(), 1.0)));
        let half_turn = Rotation3::from_axis_angle(&level, std::f64::consts::PI);
        Mounting {
            gravity: half_turn * start.gravity,
            ..start.clone()
        }
    }

    /// Returns true if gravity is so far off that at rest a fit may take the opposite gravity and the opposite readings.
    pub(crate) fn is_of_either_sign(&self, fit: &Fit) -> bool {
        let far = fit.mounting.gravity.angle() >= MOUNTED;
        far && fit.unknowns.has(Nuisance::Lean) && self.recordings.iter().all(|own| own.poses)
    }

    /// Calls `take` with each segment that is used, and the place of its recording's bias.
    fn each_segment(
        &self,
        unknowns: &Unknowns,
        take: &mut dyn FnMut(usize, usize, &Segment, usize),
    ) {
        let layout = self.layout(unknowns);
        for (r, recorded) in self.recordings.iter().enumerate() {
            for (g, segment) in recorded.segments.iter().enumerate() {
                let own = unknowns.jumps.iter().filter(|jump| jump.recording == r);
                if !own.clone().any(|jump| jump.is_beside(g, recorded.poses)) {
                    let last = unknowns.last_jump(r, |jump| jump.segment <= g);
                    let bias = last.map_or(layout.bias(r), |at| layout.after_jump(at));
                    take(r, g, segment, bias);
                }
            }
        }
    }

    /// Calls `take` with what [`Self::each_segment`] gives, a recording without jumps in one.
    fn each_part(&self, unknowns: &Unknowns, take: &mut dyn FnMut(usize, &Segment, usize)) {
        let layout = self.layout(unknowns);
        let jumps = |recording: usize| unknowns.jumps.iter().any(|own| own.recording == recording);
        for (r, recorded) in self.recordings.iter().enumerate() {
            if !jumps(r) {
                take(r, &recorded.whole, layout.bias(r));
            }
        }
        self.each_segment(unknowns, &mut |r, _, segment, bias| {
            if jumps(r) {
                take(r, segment, bias);
            }
        });
    }

    /// Returns the rows of a channel of a segment, one column an unknown, and their right-hand sides. Products of unknowns
    /// are linearised about the values of `fit`.
    fn rows(
        &self,
        [recording, channel, bias]: [usize; 3],
        segment: &Segment,
        fit: &Fit,
    ) -> (DMatrix<f64>, Vec<f64>) {
        let unknowns = &fit.unknowns;
        let layout = self.layout(unknowns);
        let height = height(fit);
        let triangle = segment.channels[channel].rows(0, height);
        let axis = channel % 3;
        let readings = triangle.fixed_columns::<3>(column::READINGS);
        // The wrench of the robot on the load by these readings, three components.
        let wrench = readings * fit.mounting.matrix(channel).transpose();
        let mut own = triangle.columns(0, INERTIAL_PARAMETERS).into_owned();
        let change = fit.mounting.gravity * self.gravity - self.gravity;
        add_weight(&triangle, &change, &mut own);
        let factor = fit.mounting.factor(channel);
        let of_kind = &own * fit.mounting.of_kind(channel);
        own *= factor;
        let mut rows = DMatrix::zeros(height, layout.count());
        let loaded = self.recordings[recording].loaded;
        let parts = [(loaded, 0), (unknowns.tool, layout.tool())];
        // What moves here, in the described axes of the sensor.
        let mut body = Parameters::zeros();
        for (_, at) in parts.iter().filter(|(is_here, _)| *is_here) {
            rows.columns_mut(*at, INERTIAL_PARAMETERS)
                .copy_from(&(&own * self.to_axes));
            let values = &fit.values[*at..at + INERTIAL_PARAMETERS];
            body += self.to_axes * Parameters::from_column_slice(values);
        }
        rows.column_mut(bias + channel)
            .copy_from(&triangle.column(column::ONE));
        for nuisance in &unknowns.nuisances {
            let Some(place) = layout.place(*nuisance) else {
                continue;
            };
            let mut to = rows.columns_mut(place.start, place.len());
            match nuisance {
                Nuisance::Drift => to
                    .column_mut(6 * recording + channel)
                    .copy_from(&triangle.column(column::TIME)),
                Nuisance::Warming => to
                    .column_mut(channel)
                    .copy_from(&triangle.column(column::TEMPERATURE)),
                Nuisance::Delay => {
                    let rate = triangle.columns(column::RATE, INERTIAL_PARAMETERS);
                    to.copy_from(&-(rate * (body * factor)));
                }
                Nuisance::Lean => {
                    let gravity = fit.mounting.gravity * self.gravity;
                    for (k, about) in self.level_axes(fit).iter().enumerate() {
                        let mut lean = DMatrix::zeros(height, INERTIAL_PARAMETERS);
                        add_weight(&triangle, &about.cross(&gravity), &mut lean);
                        to.column_mut(k).copy_from(&(lean * (body * factor)));
                    }
                }
                Nuisance::Rotation => turn(&wrench, axis, &mut to),
                Nuisance::Scale if channel >= 3 => to.copy_from(&(&own * body)),
                Nuisance::Scale => {}
                Nuisance::Gain(own) if *own == channel => to.copy_from(&(&of_kind * body)),
                Nuisance::Gain(_) => {}
                Nuisance::Origin if channel >= 3 => {
                    let [next, last] = others(axis);
                    let [along_next, along_last] = forces(&triangle, axis, &body, &change);
                    to.column_mut(next).copy_from(&(along_last * -factor));
                    to.column_mut(last).copy_from(&(along_next * factor));
                }
                Nuisance::Origin => {}
            }
        }
        (rows, wrench.column(axis).iter().copied().collect())
    }

    /// Returns one factor a segment, in units of the noise, the load's columns first.
    pub(crate) fn factors(&self, fit: &Fit) -> Vec<TriangularFactor> {
        let count = self.layout(&fit.unknowns).count();
        let mut factors = Vec::new();
        self.each_segment(&fit.unknowns, &mut |recording, _, segment, bias| {
            let mut factor = TriangularFactor::new(count);
            for channel in 0..6 {
                let (rows, right) = self.rows([recording, channel, bias], segment, fit);
                for (row, y) in rows.row_iter().zip(right) {
                    let x: Vec<f64> = row.iter().copied().collect();
                    factor.push(&x, y, 1.0 / fit.noise[channel / 3]);
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
        let least = self.sizes(unknowns).map(|size| ROUNDING * size);
        let mut fit = Fit {
            mounting: mounting.clone(),
            unknowns: unknowns.clone(),
            values: vec![0.0; count],
            noise: [1.0, 0.1],
            squares: [0.0; 2],
            equations: 6 * rows,
        };
        let factors = |fit: &Fit| [0, 1].map(|kind| self.factor(fit, kind));
        let mut kinds = factors(&fit);
        for _ in 0..ROUNDS {
            let mut whole = TriangularFactor::new(count);
            for (kind, noise) in kinds.iter().zip(fit.noise) {
                whole.merge(kind, 1.0 / noise);
            }
            let (r, z) = whole.system();
            fit.values = solved(&r, &z).as_slice().to_vec();
            if unknowns.nuisances.iter().any(|own| own.is_product()) {
                kinds = factors(&fit);
            }
            // Each kind bears half of the unknowns.
            let freedom = (0.5 * fit.freedom()).max(1.0);
            for kind in 0..2 {
                let squares = kinds[kind].residual_squares(&fit.values);
                fit.squares[kind] = squares.max(least[kind].powi(2) * freedom);
                fit.noise[kind] = (fit.squares[kind] / freedom).sqrt();
            }
        }
        fit
    }

    /// Returns the equations of the forces (`kind` 0) or the moments (1) of all segments in one factor.
    fn factor(&self, fit: &Fit, kind: usize) -> TriangularFactor {
        let mut whole = TriangularFactor::new(fit.values.len());
        self.each_part(&fit.unknowns, &mut |recording, segment, bias| {
            for channel in 3 * kind..3 * kind + 3 {
                let (rows, right) = self.rows([recording, channel, bias], segment, fit);
                for (row, y) in rows.row_iter().zip(right) {
                    let x: Vec<f64> = row.iter().copied().collect();
                    whole.push(&x, y, 1.0);
                }
            }
        });
        whole
    }

    /// Returns the squared residuals of the forces (`kind` 0) or the moments (1) if they are fitted alone.
    pub(crate) fn squares_alone(
        &self,
        mounting: &Mounting,
        unknowns: &Unknowns,
        kind: usize,
    ) -> f64 {
        let fit = Fit {
            mounting: mounting.clone(),
            unknowns: unknowns.clone(),
            values: vec![0.0; self.layout(unknowns).count()],
            noise: [1.0; 2],
            squares: [0.0; 2],
            equations: 0,
        };
        let factor = self.factor(&fit, kind);
        let (r, z) = factor.system();
        factor.residual_squares(solved(&r, &z).as_slice())
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

    /// Returns the residual of forces and of moments as a share of what they read beside the bias.
    pub(crate) fn share(&self, fit: &Fit) -> [f64; 2] {
        let mut unloaded = fit.clone();
        let bodies = self.layout(&fit.unknowns).bias(0);
        unloaded.values[..bodies].fill(0.0);
        let read = self.squares(&unloaded);
        std::array::from_fn(|kind| (fit.squares[kind] / read[kind].max(f64::MIN_POSITIVE)).sqrt())
    }

    /// Returns the squared residuals of forces and of moments.
    fn squares(&self, fit: &Fit) -> [f64; 2] {
        self.squares_by_segment(fit)
            .values()
            .fold([0.0; 2], |sum, own| [sum[0] + own[0], sum[1] + own[1]])
    }

    /// Returns the squared residuals of forces and of moments in each used segment, by recording and number of the segment.
    pub(crate) fn squares_by_segment(&self, fit: &Fit) -> BTreeMap<(usize, usize), [f64; 2]> {
        let mut all = BTreeMap::new();
        self.each_segment(&fit.unknowns, &mut |recording, number, segment, bias| {
            let mut sums = [0.0; 2];
            for channel in 0..6 {
                sums[channel / 3] += self
                    .residual([recording, channel, bias], segment, fit)
                    .norm_squared();
            }
            all.insert((recording, number), sums);
        });
        all
    }

    /// Returns recording and number of the segment with the largest residual, and its share of the power of all residuals, in
    /// units of the noise of the fit.
    pub(crate) fn worst_segment(&self, fit: &Fit) -> Option<(usize, usize, f64)> {
        let over = |s: [f64; 2]| (0..2).map(|k| s[k] / fit.noise[k].powi(2)).sum::<f64>();
        let all = self.squares_by_segment(fit).into_iter();
        let all: Vec<((usize, usize), f64)> = all.map(|(place, s)| (place, over(s))).collect();
        let sum: f64 = all.iter().map(|(_, power)| power).sum();
        let worst = all.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        worst.map(|((recording, number), power)| (recording, number, power / sum))
    }

    /// Returns the residual of the triangle's rows of a channel.
    fn residual(&self, place: [usize; 3], segment: &Segment, fit: &Fit) -> DVector<f64> {
        let (rows, right) = self.rows(place, segment, fit);
        DVector::from_vec(right) - rows * DVector::from_column_slice(&fit.values)
    }

    /// Returns, per recording and stretch between two jumps, the number of each segment and the mean residual of each
    /// channel in it, in the described axes of the sensor.
    pub(crate) fn mean_residuals(&self, fit: &Fit) -> Vec<(usize, Vec<SegmentMean>)> {
        let mut stretches: Vec<(usize, Vec<SegmentMean>)> = Vec::new();
        let mut last = None;
        self.each_segment(&fit.unknowns, &mut |recording, number, segment, bias| {
            if last != Some(bias) {
                stretches.push((recording, Vec::new()));
                last = Some(bias);
            }
            let mean = std::array::from_fn(|channel| {
                let residual = self.residual([recording, channel, bias], segment, fit);
                let ones = segment.channels[channel].column(column::ONE);
                ones.rows(0, residual.len()).dot(&residual) / segment.rows as f64
            });
            if let Some((_, means)) = stretches.last_mut() {
                means.push((number, mean));
            }
        });
        stretches
    }

    /// Returns the mean over a segment of what a drift of the bias is proportional to; 0 for another property.
    pub(crate) fn mean_of(&self, drift: Nuisance, recording: usize, segment: usize) -> f64 {
        let column = match drift {
            Nuisance::Drift => column::TIME,
            Nuisance::Warming => column::TEMPERATURE,
            _ => return 0.0,
        };
        let own = &self.recordings[recording].segments[segment];
        // The columns of a triangle have the scalar products of the rows' columns.
        let triangle = &own.channels[0];
        triangle.column(column::ONE).dot(&triangle.column(column)) / own.rows as f64
    }

    /// Returns the places of a nuisance among the unknowns.
    pub(crate) fn place(&self, unknowns: &Unknowns, nuisance: Nuisance) -> Option<Range<usize>> {
        self.layout(unknowns).place(nuisance)
    }

    /// Returns the values of a nuisance.
    fn values<'f>(&self, fit: &'f Fit, nuisance: Nuisance) -> Option<&'f [f64]> {
        let place = self.place(&fit.unknowns, nuisance)?;
        fit.values.get(place)
    }

    /// Returns the rotations among the unknowns, rad: of the sensor in the described axes of the sensor, of gravity in the base
    /// frame.
    pub(crate) fn rotations(&self, fit: &Fit) -> [Vector3<f64>; 2] {
        let sensor = self.values(fit, Nuisance::Rotation);
        let gravity = self.values(fit, Nuisance::Lean).map(|values| {
            let axes = self.level_axes(fit);
            axes[0] * values[0] + axes[1] * values[1]
        });
        [
            sensor.map(Vector3::from_column_slice).unwrap_or_default(),
            gravity.unwrap_or_default(),
        ]
    }

    /// Returns the mass of what is mounted without the load, kg; 0 if there is no recording of it.
    pub(crate) fn tool_mass(&self, fit: &Fit) -> f64 {
        match fit.unknowns.tool {
            true => fit.values[self.layout(&fit.unknowns).tool()],
            false => 0.0,
        }
    }

    /// Returns the relative change of the scale of the moments.
    pub(crate) fn scale(&self, fit: &Fit) -> f64 {
        self.values(fit, Nuisance::Scale).map_or(0.0, |v| v[0])
    }

    /// Returns the change of the gain of the channel whose gain is unknown.
    pub(crate) fn gain(&self, fit: &Fit) -> Option<(usize, f64)> {
        let gain = |own: &Nuisance| match own {
            Nuisance::Gain(channel) => Some((*channel, self.values(fit, *own)?[0])),
            _ => None,
        };
        fit.unknowns.nuisances.iter().find_map(gain)
    }

    /// Returns the two axes of the base frame about which gravity is turned.
    pub(crate) fn level_axes(&self, fit: &Fit) -> [Vector3<f64>; 2] {
        level_axes(&(fit.mounting.gravity * self.gravity))
    }

    /// Returns the delay of the sensor against the encoders, s.
    pub(crate) fn delay(&self, fit: &Fit) -> Option<f64> {
        self.values(fit, Nuisance::Delay).map(|values| values[0])
    }

    /// Returns the error of the sensor's position in the described axes of the sensor, m.
    pub(crate) fn origin(&self, fit: &Fit) -> Option<Vector3<f64>> {
        self.values(fit, Nuisance::Origin)
            .map(Vector3::from_column_slice)
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
        let place = self.place(&fit.unknowns, Nuisance::Drift)?;
        Some(self.read(fit, place.start + 6 * recording))
    }

    /// Returns the drift with temperature, per unit of the column `temp`, as the sensor reads it.
    pub(crate) fn warming(&self, fit: &Fit) -> Option<[f64; 6]> {
        let place = self.place(&fit.unknowns, Nuisance::Warming)?;
        Some(self.read(fit, place.start))
    }

    /// Returns what the sensor would read at a row of a recording by the fit.
    pub(crate) fn predicted(&self, fit: &Fit, recording: usize, row: &WrenchRow) -> [f64; 6] {
        let (layout, recorded) = (self.layout(&fit.unknowns), &self.recordings[recording]);
        let after = fit.unknowns.last_jump(recording, |jump| {
            let first = recorded.segments.get(jump.segment);
            first.is_some_and(|segment| row.time >= segment.begin)
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
        let load = self.to_axes * load;
        let change = fit.mounting.gravity * self.gravity - self.gravity;
        let delay = self.delay(fit).unwrap_or(0.0);
        let of = |nuisance| self.values(fit, nuisance);
        let loads: [f64; 6] = std::array::from_fn(|channel| {
            let own = channel * INERTIAL_PARAMETERS..(channel + 1) * INERTIAL_PARAMETERS;
            let along = |entries: &[f64]| -> f64 {
                entries.iter().zip(load.iter()).map(|(w, p)| w * p).sum()
            };
            let mut load = along(&row.regressor[own.clone()]) - delay * along(&row.rate[own]);
            for (entries, change) in row.weights.iter().zip(change.iter()) {
                load += change * along(&entries[channel * WEIGHED..(channel + 1) * WEIGHED]);
            }
            load
        });
        let mut wrench: [f64; 6] = std::array::from_fn(|channel| {
            let mut sum =
                fit.values[bias + channel] + fit.mounting.factor(channel) * loads[channel];
            if let Some(drift) = of(Nuisance::Drift) {
                sum += (row.time / recorded.length - 0.5) * drift[6 * recording + channel];
            }
            if let Some(warming) = of(Nuisance::Warming) {
                sum += (row.temperature - recorded.reference) * warming[channel];
            }
            sum
        });
        if let Some(origin) = self.origin(fit) {
            let lever = origin.cross(&Vector3::new(loads[0], loads[1], loads[2]));
            for axis in 0..3 {
                wrench[3 + axis] -= fit.mounting.factor(3 + axis) * lever[axis];
            }
        }
        self.as_read(fit, &wrench)
    }

    /// Turns six unknowns to readings.
    fn read(&self, fit: &Fit, at: usize) -> [f64; 6] {
        self.as_read(fit, &fit.values[at..at + 6])
    }

    /// Turns a wrench of the robot on the load, in the described axes of the sensor, to readings.
    pub(crate) fn as_read(&self, fit: &Fit, wrench: &[f64]) -> [f64; 6] {
        let of = |first: usize| {
            let own = Vector3::from_column_slice(&wrench[first..first + 3]);
            fit.mounting.matrix(first).transpose() * own
        };
        let (force, moment) = (of(0), of(3));
        [force.x, force.y, force.z, moment.x, moment.y, moment.z]
    }
}

/// Returns the number of rows of a triangle that its columns in use have.
fn height(fit: &Fit) -> usize {
    let has = |nuisance| fit.unknowns.has(nuisance);
    let leans = has(Nuisance::Lean) || fit.mounting.gravity != Rotation3::identity();
    match (has(Nuisance::Delay), leans, has(Nuisance::Origin)) {
        (true, _, _) => column::COUNT,
        (false, true, _) => column::RATE,
        (false, false, true) => column::WEIGHTS,
        (false, false, false) => column::FORCES,
    }
}

/// Adds what `gravity` (base frame, m/s²) adds to the regressor of a channel.
fn add_weight(triangle: &DMatrixView<'_, f64>, gravity: &Vector3<f64>, to: &mut DMatrix<f64>) {
    for (k, along) in gravity.iter().enumerate() {
        let own = triangle.columns(column::WEIGHTS + k * WEIGHED, WEIGHED);
        let mut weighed = to.columns_mut(0, WEIGHED);
        weighed += own * *along;
    }
}

/// Returns the forces of a body along the two other axes, by the rows of a moment. Those that were read have noise, which
/// would be taken for noise of the moments. `change` is added to gravity (base frame, m/s²).
fn forces(
    triangle: &DMatrixView<'_, f64>,
    axis: usize,
    body: &Parameters,
    change: &Vector3<f64>,
) -> [DVector<f64>; 2] {
    let weighed = body.fixed_rows::<WEIGHED>(0);
    let at = [column::FORCES, column::FORCES + WEIGHED];
    let mut forces = at.map(|at| triangle.columns(at, WEIGHED) * weighed);
    let [next, last] = others(axis);
    for (k, along) in change.iter().enumerate() {
        // The moment of a weight is −h × g, so the columns of h hold gravity along the two other axes.
        let gravity = |column: usize| triangle.column(column::WEIGHTS + k * WEIGHED + 1 + column);
        forces[0] -= gravity(last) * (body[0] * *along);
        forces[1] += gravity(next) * (body[0] * *along);
    }
    forces
}

/// Returns two unit vectors at right angles to gravity.
fn level_axes(gravity: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let mut unit = Vector3::zeros();
    unit[gravity.iamin()] = 1.0;
    let first = gravity.cross(&unit).try_normalize(0.0).unwrap_or(unit);
    let second = gravity.cross(&first).try_normalize(0.0).unwrap_or(unit);
    [first, second]
}

/// Writes −(e × w) of component `axis` for a unit vector e along each axis; `vectors` has one w a row.
fn turn(vectors: &OMatrix<f64, Dyn, U3>, axis: usize, to: &mut DMatrixViewMut<'_, f64>) {
    for k in 0..3 {
        let mut unit = Vector3::zeros();
        unit[k] = 1.0;
        for (row, w) in vectors.row_iter().enumerate() {
            to[(row, k)] = -unit.cross(&Vector3::new(w[0], w[1], w[2]))[axis];
        }
    }
}
