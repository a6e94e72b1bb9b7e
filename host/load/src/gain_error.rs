//! What errors of the sensor's gains make of the load.
//!
//! A gain that differs from 1 by less than the noise shows is silent, and no fit of the same readings can have its error in
//! the residuals. So the load is fitted again with each gain a little larger and smaller: the slope times the error of the
//! gain is the error of the load. The errors of the channels count as independent.
//!
//! Leaves out: crosstalk, an error that all channels have in common beyond that of each, and gains that depend on the load.

use nalgebra::SMatrix;
use rig_output::format_significant;
use rig_shared::multibody::INERTIAL_PARAMETERS;
use serde::Serialize;

use crate::central::central_slopes;
use crate::estimate::{Estimate, Parameters, Spread, estimate};
use crate::settle::settled;
use crate::system::{Fit, Nuisance, Sensed};

/// Error of a channel's gain that a sound sensor may have: its makers state an accuracy of 0.25 to 1.5 % of the range.
pub(crate) const ACCURACY: f64 = 0.01;
/// Change of a gain for the slopes: the load is nearly linear in it.
const STEP: f64 = 1e-3;

/// Number of channels.
const CHANNELS: usize = 6;
/// Slopes of the parameters by the gains, one column a channel.
pub(crate) type Slopes = SMatrix<f64, INERTIAL_PARAMETERS, CHANNELS>;

/// What gains of the channels that are off at random mean for the load.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GainError {
    /// Standard deviation of each gain, relative, that is in the standard deviations of the load; 0 if the gains count as
    /// exact.
    pub counted: f64,
    /// Standard deviation of each gain, relative, that the next two values are for.
    pub example: f64,
    /// Standard deviation of the mass by it, kg.
    pub mass: f64,
    /// Standard deviation of the centre of mass by it, the root of the sum over its axes, m; `None` if the data do not show the centre.
    pub centre: Option<f64>,
}

impl GainError {
    /// Says what the gains mean, and whether they are counted.
    pub fn words(&self) -> String {
        let centre = self.centre.map_or_else(String::new, |centre| {
            format!(
                " and {} mm of the centre of mass",
                format_significant(1e3 * centre, 2)
            )
        });
        let share = format_significant(100.0 * self.example, 2);
        let effect = format!(
            "{} kg of the mass{centre}",
            format_significant(self.mass, 2)
        );
        match self.counted > 0.0 {
            true => format!(
                "counted in the standard deviations: gains of the channels that are off by {share} % each make {effect}"
            ),
            false => format!(
                "assumed: the gains of the channels are exact; gains that are off by {share} % each would make {effect} (gain_std of [wrist_sensor] or --gain-std counts them)"
            ),
        }
    }
}

/// Returns the slopes of the load by the gains of the channels that it was identified with.
pub(crate) fn slopes(sensed: &Sensed, fit: &Fit, mass: f64) -> Slopes {
    let mut slopes = Slopes::zeros();
    for channel in 0..CHANNELS {
        // A channel that is left out, or whose gain is estimated, tells nothing of the load's size.
        let own_gain = Nuisance::Gain(channel);
        if fit.mounting.gains[channel] != 1.0 || fit.unknowns.nuisances.contains(&own_gain) {
            continue;
        }
        let with = |gain: f64| -> Parameters {
            let mounting = fit.mounting.with_gain(channel, gain);
            let again = settled(sensed, &mounting, &fit.unknowns);
            estimate(&sensed.factors(&again), mass, Spread::Residuals(1)).values
        };
        let slope = (with(1.0 + STEP) - with(1.0 - STEP)) / (2.0 * STEP);
        slopes.set_column(channel, &slope);
    }
    slopes
}

/// Counts the gains' errors in the covariance, and returns what they mean. `counted` is the standard deviation of a gain, relative.
pub(crate) fn count(found: &mut Estimate, slopes: &Slopes, counted: Option<f64>) -> GainError {
    let example = counted.unwrap_or(ACCURACY);
    let shown = found.shown();
    let spread = slopes * slopes.transpose() * example.powi(2);
    let to_central = central_slopes(found);
    let central = to_central * spread * to_central.transpose();
    if let Some(std) = counted {
        found.widen(&(slopes * std));
    }
    GainError {
        counted: counted.unwrap_or(0.0),
        example,
        mass: central[(0, 0)].max(0.0).sqrt(),
        centre: (shown[..4].iter().all(|s| *s))
            .then(|| (1..4).map(|k| central[(k, k)].max(0.0)).sum::<f64>().sqrt()),
    }
}
