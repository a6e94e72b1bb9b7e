//! Columns of one joint: nominal model, effects of the library, discrepancy.

use rig_numerics::statistics::mean_square;
use rig_numerics::vector::axpy;
use rig_shared::effects::{Kind, SHAPES, Scale};

use super::discrepancy::{Along, Motion};
use super::noise::{Averaging, Noise};
use super::posterior::Posterior;
use super::products::Products;
use crate::DiagnoseError;
use crate::acceptance::coordinates::since_reversal;
use crate::columns::candidate::Candidate;
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::rows::regression::{Column, Rows};
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::shapes::searched;
use crate::search::stepwise::Search;

/// Standard deviation of a nominal parameter, as its torque over the joint's torque: nothing is known of it.
const NOMINAL: f64 = 10.0;
/// Standard deviation of an effect's gain, as its torque over the joint's torque.
const EFFECT: f64 = 0.1;

/// Fewest used rows on which a law must differ from no effect.
const FEWEST_ROWS: usize = 30;
/// Ratio to the lower end of a shape's range below which the law has no effect: twice the tolerance of a refinement.
const ABOVE_THE_END: f64 = 1.02;

/// An effect of the library with given shapes.
pub(crate) struct Entry {
    /// Which.
    pub(crate) candidate: Candidate,
    /// Its shapes.
    pub(crate) shapes: [f64; SHAPES],
    /// Numbers of its columns.
    pub(crate) columns: Vec<usize>,
    /// Prior variances of its gains.
    pub(crate) variances: Vec<f64>,
    /// Physical bounds of its gains.
    pub(crate) bounds: Vec<[f64; 2]>,
    /// Number of shapes of this effect in the library.
    pub(crate) grid: usize,
    /// True if a shape lies at the end of its range, where the law has no effect.
    pub(crate) vanishes: bool,
    /// True if the shapes stay as they are: an observer has fitted them.
    pub(crate) fixed: bool,
}

impl Entry {
    /// Returns true if gains are within their physical bounds.
    pub(crate) fn allows(&self, gains: &[f64]) -> bool {
        (gains.iter().zip(&self.bounds)).all(|(gain, [low, high])| gain >= low && gain <= high)
    }
}

/// A discrepancy along one coordinate.
pub(crate) struct Family {
    /// The coordinate.
    pub(crate) along: Along,
    /// Numbers of its columns.
    pub(crate) columns: Vec<usize>,
}

/// Columns of one joint.
pub(crate) struct JointColumns<'a> {
    pub(crate) joint: usize,
    pub(crate) search: Search<'a>,
    pub(crate) averaging: Averaging,
    pub(crate) noise: Noise,
    pub(crate) products: Products,
    /// Numbers and prior variances of the nominal columns.
    pub(crate) nominal: Vec<(usize, f64)>,
    /// Their places among the free directions of the description.
    pub(crate) directions: Vec<usize>,
    pub(crate) entries: Vec<Entry>,
    pub(crate) families: Vec<Family>,
    /// Root of the mean square torque on the used rows, over the noise.
    torque: f64,
    /// Travel since a reversal within which [`FEWEST_ROWS`] used rows lie: presliding over a shorter stroke is not seen.
    least_travel: f64,
    /// Stiffness of a gear at which the link's resonance is at the end of the band of the rows.
    stiffest: f64,
}

impl<'a> JointColumns<'a> {
    /// Computes the columns of a joint. `left` is the averaged residual of an earlier model, from which the noise is
    /// estimated without a repeated run; None: that of the nominal model.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn of(
        context: &DiagnosisContext,
        prepared: &PreparedData,
        search: Search<'a>,
        joint: usize,
        left: Option<Vec<f64>>,
    ) -> Result<Self, DiagnoseError> {
        let rows = &prepared.rows;
        let averaging = Averaging::of(rows, &prepared.runs);
        let recorded = &rows.torque[joint];
        let nominal = nominal_columns(context, rows, joint);
        let residual = residual_of(&nominal, recorded, &rows.keep[joint]);
        let left = left.unwrap_or_else(|| averaging.averaged(&residual));
        let noise = Noise::of(&averaging, &residual, &rows.keep[joint], &left);
        let torque = noise.whitened(&averaging.averaged(recorded));
        let size = (mean_square(&averaging.averaged(recorded))).sqrt() / noise.deviation;
        let fastest = std::f64::consts::PI / rows.period;
        let stiffest = fastest.powi(2) * search.source.mass(joint, 0)?;
        let mut own = Self {
            joint,
            stiffest,
            least_travel: least_travel(prepared, &averaging, joint),
            search,
            averaging,
            noise,
            products: Products::new(torque),
            nominal: Vec::new(),
            directions: Vec::new(),
            entries: Vec::new(),
            families: Vec::new(),
            torque: size,
        };
        own.read_nominal(&nominal);
        own.read_discrepancy(context, prepared);
        own.read_library()?;
        Ok(own)
    }

    /// Returns the prior variance of the coefficient of a column whose torque is `share` of the joint's.
    fn variance(&self, column: &[f64], share: f64) -> f64 {
        let averaged = self.averaging.averaged(column);
        let size = mean_square(&averaged).sqrt();
        (share * self.torque * self.noise.deviation / size.max(f64::MIN_POSITIVE)).powi(2)
    }

    fn push(&mut self, column: &[f64]) -> usize {
        let whitened = self.noise.whitened(&self.averaging.averaged(column));
        self.products.push(whitened)
    }

    fn read_nominal(&mut self, columns: &[(usize, Vec<f64>)]) {
        for (direction, values) in columns {
            let variance = self.variance(values, NOMINAL);
            let number = self.push(values);
            self.nominal.push((number, variance));
            self.directions.push(*direction);
        }
    }

    fn read_discrepancy(&mut self, context: &DiagnosisContext, prepared: &PreparedData) {
        let rows = &prepared.rows;
        let motion = Motion {
            runs: &prepared.runs,
            predicted: &self.search.source.predicted,
            robot: context.robot,
            thinning: &rows.thinning,
            left_out: &rows.left_out,
            joint: self.joint,
            keep: &rows.keep[self.joint],
        };
        for (along, columns) in Along::ALL.map(|along| (along, motion.columns(along))) {
            let columns = columns.iter().map(|c| self.push(c)).collect();
            self.families.push(Family { along, columns });
        }
    }

    fn read_library(&mut self) -> Result<(), DiagnoseError> {
        for candidate in self.search.library.clone() {
            let mut points = self.search.grid(&candidate);
            points.retain(|point| self.search.shows(&candidate, point));
            let threads = self.search.threads;
            let columns = (self.search.source).columns_of(threads, &candidate, &points)?;
            let count = points.len();
            for (point, columns) in points.into_iter().zip(columns) {
                self.add(&candidate, point, &columns, count);
            }
        }
        Ok(())
    }

    /// Adds an effect with these shapes and columns; returns its number, or None if the joint does not show it.
    pub(crate) fn add(
        &mut self,
        candidate: &Candidate,
        shapes: [f64; SHAPES],
        columns: &[Column],
        grid: usize,
    ) -> Option<usize> {
        let own: Option<Vec<&Vec<f64>>> = columns.iter().map(|c| c[self.joint].as_ref()).collect();
        let own = own?;
        let variances = own.iter().map(|c| self.variance(c, EFFECT)).collect();
        let numbers = own.iter().map(|c| self.push(c)).collect();
        self.entries.push(Entry {
            candidate: *candidate,
            shapes,
            columns: numbers,
            variances,
            bounds: self.search.bounds(candidate),
            grid,
            vanishes: self.vanishes(candidate, &shapes),
            fixed: false,
        });
        Some(self.entries.len() - 1)
    }

    /// Adds an effect with these shapes; returns its number, or None if the joint does not show it.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn add_at(
        &mut self,
        candidate: &Candidate,
        shapes: [f64; SHAPES],
    ) -> Result<Option<usize>, DiagnoseError> {
        let of_it = |entry: &&Entry| entry.candidate == *candidate;
        let grid = self
            .entries
            .iter()
            .find(of_it)
            .map_or(1, |entry| entry.grid);
        let columns = self.search.source.columns(candidate, &shapes)?;
        Ok(self.add(candidate, shapes, &columns, grid))
    }

    /// Adds an effect of an earlier search; returns its number, or None if the joint does not show it.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn add_fitted(
        &mut self,
        own: &FittedCandidate,
    ) -> Result<Option<usize>, DiagnoseError> {
        if own.followed.is_none() {
            return self.add_at(&own.candidate, own.shapes);
        }
        let grid = self.search.grid(&own.candidate).len();
        let entry = self.add(&own.candidate, own.shapes, &own.columns, grid);
        if let Some(entry) = entry {
            self.entries[entry].fixed = true;
        }
        Ok(entry)
    }

    /// Returns the whitened columns of an effect with these shapes, and the prior variances.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn columns_at(
        &self,
        candidate: &Candidate,
        shapes: &[f64; SHAPES],
    ) -> Result<Option<(Vec<Vec<f64>>, Vec<f64>)>, DiagnoseError> {
        let columns = self.search.source.columns(candidate, shapes)?;
        let own: Option<Vec<&Vec<f64>>> = columns.iter().map(|c| c[self.joint].as_ref()).collect();
        Ok(own.map(|own| {
            let whitened = own
                .iter()
                .map(|c| self.noise.whitened(&self.averaging.averaged(c)));
            let variances = own.iter().map(|c| self.variance(c, EFFECT));
            (whitened.collect(), variances.collect())
        }))
    }

    /// Returns the range of each shape that these recordings can show.
    pub(crate) fn reach(&self, candidate: &Candidate) -> Vec<[f64; 2]> {
        let told = self.search.least_told(candidate.kind, candidate.joint);
        let told = match candidate.kind.is_presliding() {
            true => told.max(self.least_travel),
            false => told,
        };
        let source = &self.search.source;
        let reached = [source.running(), source.fastest(candidate.joint)];
        let shapes = candidate.kind.about().shapes.iter();
        shapes.map(|shape| searched(shape, told, reached)).collect()
    }

    /// Returns true if these recordings cannot tell the shapes from no effect: a distance within the resolution, or an
    /// elastic gear with a resonance above the band of the rows.
    fn vanishes(&self, candidate: &Candidate, shapes: &[f64; SHAPES]) -> bool {
        if candidate.kind == Kind::JointElasticity {
            return shapes[0] >= self.stiffest;
        }
        let first = candidate.kind.about().shapes.first();
        let least = self.reach(candidate).first().map_or(0.0, |[low, _]| *low);
        first.is_some_and(|first| first.scale == Scale::Logarithmic)
            && shapes[0] <= least * ABOVE_THE_END
    }
}

/// Returns the free directions of the nominal model that a joint shows, with their columns.
fn nominal_columns(
    context: &DiagnosisContext,
    rows: &Rows,
    joint: usize,
) -> Vec<(usize, Vec<f64>)> {
    (context.anchor.columns(rows).into_iter().enumerate())
        .filter_map(|(direction, mut column)| Some((direction, column[joint].take()?)))
        .collect()
}

/// Returns the residual of the nominal model on all rows.
fn residual_of(nominal: &[(usize, Vec<f64>)], torque: &[f64], keep: &[bool]) -> Vec<f64> {
    let kept = |values: &[f64]| -> Vec<f64> {
        let pairs = values.iter().zip(keep);
        pairs.map(|(x, k)| if *k { *x } else { 0.0 }).collect()
    };
    let mut products = Products::new(kept(torque));
    let numbers: Vec<usize> = nominal
        .iter()
        .map(|(_, c)| products.push(kept(c)))
        .collect();
    let wide: Vec<f64> = (numbers.iter())
        .map(|n| 1e12 / products.of(*n, *n).max(f64::MIN_POSITIVE))
        .collect();
    let mut residual = torque.to_vec();
    if let Some(posterior) = Posterior::of(&products, numbers, &wide) {
        for ((_, column), value) in nominal.iter().zip(&posterior.means) {
            axpy(-value, column, &mut residual);
        }
    }
    residual
}

/// Returns the travel since a reversal within which [`FEWEST_ROWS`] used rows lie.
fn least_travel(prepared: &PreparedData, averaging: &Averaging, joint: usize) -> f64 {
    let rows = &prepared.rows;
    let mut travels = Vec::with_capacity(rows.count);
    for run in &prepared.runs {
        rows.thinning
            .pick(&since_reversal(run, joint).0, &mut travels);
    }
    let used: Vec<bool> = averaging.kept(&rows.keep[joint]);
    let mut sizes: Vec<f64> = (averaging.averaged(&travels).iter().zip(used))
        .filter(|(_, used)| *used)
        .map(|(x, _)| x.abs())
        .collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(FEWEST_ROWS).copied().unwrap_or(f64::INFINITY)
}
