//! Choice among equal names by the described values.
//!
//! A wrong name can fit as well if nominal parameters compensate: a constant replaces a spring if gravity absorbs its
//! stiffness. With the right name, the described values hold.

use rig_shared::effects::Kind;

use crate::DiagnoseError;
use crate::acceptance::judge::{Judge, Judged};
use crate::fit::refit::Refit;
use crate::levels::BEYOND_FLOOR;
use crate::models::parameter_change::is_loaded;
use crate::recordings::context::DiagnosisContext;
use crate::search::chosen::with;
use crate::search::fitted_candidate::{FittedCandidate, equal};
use crate::search::spring::stiff;

/// Largest ratio of residuals beyond the floor, of a rival to the name, that replaces it (described values).
const MUCH_LESS: f64 = 0.5;

/// Largest ratio of a rival's residual to the floor with the described values. If it leaves more, these values have
/// changed and do not decide.
const STANDS: f64 = 2.0;

/// Replaces names by equal ones that leave much less with the described values.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn by_description(
    judge: &Judge,
    refit: &Refit,
    context: &DiagnosisContext,
    judged: Judged,
) -> Result<Judged, DiagnoseError> {
    // A load on the link also changes its inertia, which no other name explains. Then the description does not decide.
    if !context.anchor.stated || is_loaded(context, refit, &judged.chosen) {
        return Ok(judged);
    }
    let frozen = refit.frozen(context);
    let left = |list: &[FittedCandidate], joint: usize| with(&frozen, list, None).rms(joint);
    // With the described gravity, a spring hidden behind it becomes visible.
    let stands = |rival: &FittedCandidate, list: &[FittedCandidate], k: usize| {
        let shows = || stiff(&with(&frozen, list, Some(k)), &rival.columns);
        rival.at_bound.is_none() || rival.candidate.kind == Kind::Spring && shows()
    };
    let mut chosen = judged.chosen.clone();
    let mut moved = false;
    for k in 0..chosen.len() {
        // The description itself gives this name.
        if judge.search.rank_of(&chosen[k].candidate) < 2 {
            continue;
        }
        let joint = chosen[k].candidate.joint;
        let floor = judged.quiet[joint];
        let own = left(&chosen, joint);
        if own < BEYOND_FLOOR * floor {
            continue;
        }
        let rivals = judge.search.alternatives(judge.base, &chosen, k)?;
        let best = (rivals.into_iter())
            .filter(|rival| {
                !(judge.search).is_not(&chosen[k].candidate, rival.candidate.kind)
                    && equal(&chosen[k], rival)
                    && stands(rival, &chosen, k)
            })
            .map(|rival| {
                let mut list = chosen.clone();
                list[k] = rival;
                (left(&list, joint), list)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((less, list)) = best
            && less < STANDS * floor
            && less - floor < MUCH_LESS * (own - floor)
        {
            chosen = list;
            moved = true;
        }
    }
    if moved {
        judge.judged(chosen)
    } else {
        Ok(judged)
    }
}
