//! One search for effects on the training data, repeated with new row weights if it finds gears.

use crate::columns::effect_columns::Candidate;
use crate::description::described_effects::candidate;
use crate::engine::follow::ObserverModels;
use crate::fit::refit::Refit;
use crate::link_encoder::{Across, across, gears, refutes};
use crate::outcome::Tried;
use crate::recordings::context::{DiagnosisContext, PreparedData, library};
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::{Search, is_constant, same};
use crate::{DiagnoseError, Options};
use rig_model::robot::title_of;

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
    pub(crate) tried: Vec<Tried>,
    /// Results of the link encoders.
    pub(crate) across: Vec<Across>,
}

/// Trials so far, and number of sweeps.
#[derive(Default)]
struct Heard {
    tried: Vec<Tried>,
    sweeps: i32,
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
        let mut library = library(context.robot, &prepared.runs, &options.without);
        library.retain(|c| !refutes(&across, c));
        // If a joint moves in one direction only, every constant is collinear with its Coulomb friction.
        let one_way = |c: &Candidate| context.one_way.iter().any(|own| own.joint == c.joint);
        library.retain(|c| !(is_constant(c.kind) && one_way(c)));
        let mut described = context.stated.free();
        described.retain(|placed| !refutes(&across, &candidate(placed)));
        let mut search = Search::new(
            source,
            library,
            described,
            rig_data::prepare::threads(options.threads),
        );
        search.measured = gears(&across);
        let mut accepted_by_observer = Heard::default();
        let mut further = |refit: &Refit, search: &mut Search<'a>, found| {
            searched(
                context,
                prepared,
                refit,
                search,
                found,
                &mut accepted_by_observer,
                progress,
            )
        };
        let mut found = further(&refit, &mut search, None)?;
        if let Some(play) = search.nearly.take() {
            let candidate = play.candidate;
            if ObserverModels::new(context, prepared, &refit, &search)
                .observer_supports(&found, play)?
            {
                search.accepted_by_observer.push(candidate);
                found = further(&refit, &mut search, Some(found))?;
            }
        }
        let mut refit = refit;
        for _ in 0..BESIDE_GEARS {
            let loud = search.loud(&found);
            if loud.is_empty() {
                break;
            }
            search.settle_gears(refit.even(), &mut found)?;
            refit = refit.reweighted(&found, &loud);
            let before = found.clone();
            found = further(&refit, &mut search, Some(found))?;
            if same(&before, &found) {
                break;
            }
        }
        if refit.is_quieted() && search.loud(&found).is_empty() {
            // The gear was dropped: search without row weights.
            refit = refit.evened();
            search.settle_gears(refit.even(), &mut found)?;
            found = further(&refit, &mut search, Some(found))?;
        }
        Ok(Self {
            refit,
            search,
            found,
            tried: accepted_by_observer.tried,
            across,
        })
    }
}

/// Searches for effects, starting with those already `found`.
fn searched<'a>(
    context: &'a DiagnosisContext,
    prepared: &'a PreparedData,
    refit: &Refit,
    search: &mut Search<'a>,
    found: Option<Vec<FittedCandidate>>,
    accepted_by_observer: &mut Heard,
    progress: &mut dyn FnMut(f64),
) -> Result<Vec<FittedCandidate>, DiagnoseError> {
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
        accepted_by_observer.sweeps += 1;
        progress(0.1 + 0.7 * (1.0 - 0.6_f64.powi(accepted_by_observer.sweeps)));
        let first = profiles.iter().position(|p| p.refused(trials).is_none());
        for (k, p) in profiles.iter().enumerate() {
            accepted_by_observer.tried.push(Tried {
                effect: title_of(p.candidate.kind),
                joint: context.robot.joints[p.candidate.joint].name.clone(),
                step,
                gain: p.evidence.gain,
                gain_sigmas: p.evidence.gain_sigmas,
                p_value: p.evidence.corrected(trials),
                refused: match p.refused(trials) {
                    Some(why) => why,
                    None if Some(k) == first => String::new(),
                    None => "another takes away more".into(),
                },
            });
        }
    };
    search.run(&refit.base, found, &renew, &mut told)
}
