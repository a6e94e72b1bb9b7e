//! Treatment of the training recordings: cut-off, band, window and slow rows.

use super::planner::Planner;
use super::recordings::{Sets, Surveyed};
use super::robot_model::RobotModel;
use super::task::Task;
use crate::error::IdentifyError;
use crate::estimator::Estimator;
use crate::options::Options;
use crate::rows::cache::RowCache;
use crate::rows::directions::one_way;
use crate::rows::plan::Plan;
use crate::treatment::band::explained_band;
use crate::treatment::cutoff::decided;
use crate::treatment::decimation;
use crate::treatment::speed::speed_thresholds;
use crate::treatment::window::choose_window;
use rig_data::prepare::{Choice, PreprocessingPlan, Recording, Survey};

/// Smallest number of kept rows per parameter, over all joints of the shortest recording, in a narrower band.
const ROWS_A_PARAMETER: usize = 10;

/// Surveys and treatment that are the same in every pass over effects beyond the description.
#[derive(Clone)]
pub(crate) struct Prepared {
    /// Surveys of the training recordings.
    pub surveys: Vec<Survey>,
    /// Treatment in the widest band.
    pub treatment: PreprocessingPlan,
}

impl Prepared {
    /// Decides the treatment of the recordings of `sets`.
    ///
    /// # Errors
    /// [`IdentifyError`]: recordings that cannot be read or prepared.
    pub(crate) fn of(
        task: &Task,
        model: &RobotModel,
        surveyed: &Surveyed,
        sets: &Sets,
    ) -> Result<Self, IdentifyError> {
        let (surveys, treatment) = decided(
            model.equations(task.described.effects.is_empty()),
            &sets.training,
            surveyed.training_surveys.clone(),
            &task.options.prepare,
            &model.robot.torque_limits(),
        )?;
        Ok(Self { surveys, treatment })
    }
}

/// The treatment of the fitted rows.
pub(crate) struct Treated {
    /// Treatment of the training recordings.
    pub treatment: PreprocessingPlan,
    /// Length of a window of the integral model, samples.
    pub window: usize,
    /// The reason for that length.
    pub window_reason: String,
}

impl Treated {
    /// Decides band, window and slow rows, beginning with the widest band. Returns also the rows that were computed on
    /// the way.
    ///
    /// # Errors
    /// [`IdentifyError`]: recordings that cannot be read, an impossible window.
    pub(crate) fn of(
        options: &Options,
        planner: &Planner,
        training: &[&dyn Recording],
        wide: &Prepared,
    ) -> Result<(Self, RowCache), IdentifyError> {
        let banded = banded(options, planner, training, wide)?;
        let (window, window_reason) = choose_window(options, &banded, &wide.surveys)?;
        let mut treatment = banded.clone();
        let mut cache = RowCache::default();
        if options.prepare.speed_threshold == Choice::Auto {
            let by_noise = planner.plan(&banded, window);
            let chosen = speed_thresholds(training, &by_noise)?;
            cache = if chosen.fitted == banded.speed_threshold {
                by_noise.cache
            } else {
                RowCache::after(by_noise.cache)
            };
            (treatment.speed_threshold, treatment.judged_speed) = (chosen.fitted, chosen.judged);
            treatment.speed_reason = chosen.reason;
        }
        let treated = Self {
            treatment,
            window,
            window_reason,
        };
        Ok((treated, cache))
    }

    /// Returns the plan of the fitted rows; `cache` holds those computed so far.
    ///
    /// # Errors
    /// Reading errors.
    pub(crate) fn plan<'a>(
        &'a self,
        planner: &Planner<'a>,
        cache: RowCache,
        training: &[&dyn Recording],
    ) -> Result<Plan<'a>, IdentifyError> {
        let mut plan = Plan {
            cache,
            ..planner.plan(&self.treatment, self.window)
        };
        plan.one_way = one_way(training, &plan)?;
        Ok(plan)
    }
}

/// Returns the treatment in the band that predicts best.
fn banded(
    options: &Options,
    planner: &Planner,
    training: &[&dyn Recording],
    Prepared {
        surveys,
        treatment: wide,
    }: &Prepared,
) -> Result<PreprocessingPlan, IdentifyError> {
    let model = planner.model;
    let bands = match options.prepare.decimation {
        // A narrow band spreads the outliers that a robust fit should exclude over their neighbours.
        Choice::Auto if options.estimator != Estimator::Robust => {
            let rows = (ROWS_A_PARAMETER * model.base.len()).div_ceil(model.joints()) as u64;
            let limits = model.robot.torque_limits();
            let narrowed = |band| wide.narrowed(band, rows, surveys, &options.prepare, &limits);
            let first = match explained_band(training, &planner.plan(wide, 1))? {
                Some(band) => narrowed(band)?,
                None => wide.clone(),
            };
            decimation::candidates(first, &narrowed)?
        }
        _ => vec![wide.clone()],
    };
    let plans: Vec<Plan> = bands.iter().map(|band| planner.plan(band, 1)).collect();
    decimation::best(training, &bands[0], &plans)
}
