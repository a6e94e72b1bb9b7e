//! One search for effects on the training data, repeated with new row weights if it finds gears.

use crate::columns::candidate::Candidate;
use crate::columns::effect_columns::Source;
use crate::columns::kinds::is_constant;
use crate::description::described_effects::candidate;
use crate::fit::refit::Refit;
use crate::link_encoder::{Across, across, gears, refutes};
use crate::models::observer_models::ObserverModels;
use crate::recordings::context::{DiagnosisContext, PreparedData, library};
use crate::search::chosen::same;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::refusal::Refusal;
use crate::search::stepwise::Search;
use crate::search::tried_candidate::TriedCandidate;
use crate::{DiagnoseError, Options};

/// Maximum number of searches with row weights. Each may change the gear shapes.
const BESIDE_GEARS: usize = 2;

/// Result of a search.
pub(crate) struct Pass<'a> {
    /// The nominal model, with row weights if a gear was found.
    pub(crate) refit: Refit<'a>,
    /// The library, with the predictions of the last model.
    pub(crate) search: Search<'a>,
    /// The effects.
    pub(crate) found: Vec<FittedCandidate>,
    /// All trials.
    pub(crate) tried: Vec<TriedCandidate>,
    /// Results of the link encoders.
    pub(crate) across: Vec<Across>,
}

impl<'a> Pass<'a> {
    /// Searches recordings whose torque lead is already compensated.
    pub(crate) fn over(
        context: &'a DiagnosisContext,
        prepared: &'a PreparedData,
        options: &Options,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, DiagnoseError> {
        let refit = Refit::of(context, &prepared.rows)?;
        let source = context.source(prepared, &context.anchor.values(&refit.before.values))?;
        // Link encoders come before the torque: they confirm or exclude effects across a transmission.
        let across = across(
            &source,
            &context.anchor,
            &refit.before,
            prepared,
            None,
            options,
        )?;
        let search = begun(context, prepared, source, &across, options);
        let mut searching = Searching {
            context,
            prepared,
            search,
            progress,
            tried: Vec::new(),
            sweeps: 0,
        };
        let found = searching.further(&refit, None)?;
        let found = searching.with_near_miss(&refit, found)?;
        let (refit, found) = searching.beside_gears(refit, found)?;
        Ok(Self {
            refit,
            search: searching.search,
            found,
            tried: searching.tried,
            across,
        })
    }
}

/// Returns the search with its library, as far as the link encoders do not refute it.
fn begun<'a>(
    context: &'a DiagnosisContext,
    prepared: &PreparedData,
    source: Source<'a>,
    across: &[Across],
    options: &Options,
) -> Search<'a> {
    let mut library = library(context.robot, &prepared.runs, &options.without);
    library.retain(|c| !refutes(across, c));
    // If a joint moves in one direction only, every constant is collinear with its Coulomb friction.
    let one_way = |c: &Candidate| context.one_way.iter().any(|own| own.joint == c.joint);
    library.retain(|c| !(is_constant(c.kind) && one_way(c)));
    let mut described = context.stated.free();
    described.retain(|placed| !refutes(across, &candidate(placed)));
    let mut search = Search::new(
        source,
        library,
        described,
        rig_data::prepare::threads(options.threads),
    );
    search.measured = gears(across);
    search
}

/// A search on the training data, repeated with other row weights.
struct Searching<'a, 'p> {
    context: &'a DiagnosisContext<'a>,
    prepared: &'a PreparedData,
    search: Search<'a>,
    progress: &'p mut dyn FnMut(f64),
    /// Trials so far.
    tried: Vec<TriedCandidate>,
    /// Number of sweeps so far.
    sweeps: i32,
}

impl<'a> Searching<'a, '_> {
    /// Searches again with a backlash that almost passed, if the observer supports it.
    fn with_near_miss(
        &mut self,
        refit: &Refit,
        found: Vec<FittedCandidate>,
    ) -> Result<Vec<FittedCandidate>, DiagnoseError> {
        let Some(play) = self.search.nearly.take() else {
            return Ok(found);
        };
        let candidate = play.candidate;
        let observers = ObserverModels::new(self.context, self.prepared, refit, &self.search);
        if !observers.observer_supports(&found, play)? {
            return Ok(found);
        }
        self.search.accepted_by_observer.push(candidate);
        self.further(refit, Some(found))
    }

    /// Searches again with row weights, as long as there are gears. Returns the model with its weights, and the effects.
    fn beside_gears(
        &mut self,
        mut refit: Refit<'a>,
        mut found: Vec<FittedCandidate>,
    ) -> Result<(Refit<'a>, Vec<FittedCandidate>), DiagnoseError> {
        for _ in 0..BESIDE_GEARS {
            let loud = self.search.loud(&found);
            if loud.is_empty() {
                break;
            }
            self.search.settle_gears(refit.even(), &mut found)?;
            refit = refit.reweighted(&found, &loud);
            let before = found.clone();
            found = self.further(&refit, Some(found))?;
            if same(&before, &found) {
                break;
            }
        }
        if refit.is_quieted() && self.search.loud(&found).is_empty() {
            // The gear was dropped: search without row weights.
            refit = refit.evened();
            self.search.settle_gears(refit.even(), &mut found)?;
            found = self.further(&refit, Some(found))?;
        }
        Ok((refit, found))
    }

    /// Searches for effects, starting with those already `found`.
    fn further(
        &mut self,
        refit: &Refit,
        found: Option<Vec<FittedCandidate>>,
    ) -> Result<Vec<FittedCandidate>, DiagnoseError> {
        let Self {
            context,
            prepared,
            search,
            progress,
            tried,
            sweeps,
        } = self;
        let (context, prepared): (&'a DiagnosisContext, &'a PreparedData) = (context, prepared);
        let trials = search.trials();
        // If effect columns are collinear with nominal ones, the nominal values stay.
        let renew = |chosen: &[FittedCandidate]| {
            let solution = refit.solution(chosen);
            let coefficients = solution.as_ref().unwrap_or(&refit.before);
            let nominal = &coefficients.values[..refit.free.len()];
            let source = context.source(prepared, &context.anchor.values(nominal))?;
            match &solution {
                Ok(solution) => source.loaded_by(chosen, &solution.values[refit.free.len()..]),
                Err(_) => Ok(source),
            }
        };
        let mut told = |step: usize, profiles: &[FittedCandidate]| {
            *sweeps += 1;
            progress(0.1 + 0.7 * (1.0 - 0.6_f64.powi(*sweeps)));
            let first = profiles.iter().position(|p| p.refused(trials).is_none());
            for (k, p) in profiles.iter().enumerate() {
                let refused = match p.refused(trials) {
                    None if Some(k) != first => Some(Refusal::SmallerThanAnother),
                    refused => refused,
                };
                tried.push(TriedCandidate::of(p, step, trials, refused));
            }
        };
        search.run(&refit.base, found, &renew, &mut told)
    }
}
