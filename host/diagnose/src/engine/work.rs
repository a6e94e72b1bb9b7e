//! Data and models that the stages after the search share.

use crate::Options;
use crate::acceptance::judge::Judge;
use crate::description::described_effects::DescribedEffects;
use crate::fit::refit::Refit;
use crate::models::bodies::ModelCache;
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::search::stepwise::Search;

/// Prepared data and settings.
pub(super) struct Data<'a> {
    /// Robot and data treatment.
    pub(super) context: &'a DiagnosisContext<'a>,
    /// Effects that the description states.
    pub(super) stated: &'a DescribedEffects,
    /// Settings.
    pub(super) options: &'a Options,
    /// The training data.
    pub(super) prepared: &'a PreparedData,
    /// The hold-out.
    pub(super) held_out: Option<&'a PreparedData>,
}

/// Shared inputs of the stages after the search.
pub(super) struct Work<'a, 'r> {
    /// Prepared data and settings.
    pub(super) data: &'a Data<'a>,
    /// The nominal model on the training data.
    pub(super) refit: &'a Refit<'r>,
    /// The candidate library on the training data.
    pub(super) search: &'a Search<'r>,
    /// Models with effects.
    pub(super) fitting: &'a ModelCache<'a, 'r>,
    /// Judgement of effects.
    pub(super) judge: &'a Judge<'a, 'r>,
}
