//! Which of names that the data support alike agrees with the description's values.
//!
//! A name that stands in for another one fits as well because the nominal parameters move beside it: a constant takes the
//! place of a spring where gravity takes up its stiffness. With the true name the description's values stand.

use rig_shared::effects::Kind;

use super::DiagnoseError;
use super::bench::Bench;
use super::change::is_loaded;
use super::judge::{BEYOND_FLOOR, Judge, Judged, equal};
use super::profile::{Profile, stiff};
use super::refit::Refit;
use super::search::with;

/// Share of what a name leaves beyond the floor, the description's values as they are, that another one leaves at most.
const MUCH_LESS: f64 = 0.5;

/// Times the floor that a name may leave, the description's values as they are: beside one that leaves more these have changed, and
/// are no witness.
const STANDS: f64 = 2.0;

/// Puts names in the place of equal ones where the description's values, as they are, then leave much less.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(super) fn by_description(
    judge: &Judge,
    refit: &Refit,
    bench: &Bench,
    judged: Judged,
) -> Result<Judged, DiagnoseError> {
    // A load on the link is in its inertia as well, where no other name has a say: the description is no witness then.
    if !bench.anchor.stated || is_loaded(bench, refit, &judged.chosen) {
        return Ok(judged);
    }
    let frozen = refit.frozen(bench);
    let left = |list: &[Profile], joint: usize| with(&frozen, list, None).rms(joint);
    // Where gravity is as described, a spring that it could hide behind shows.
    let stands = |rival: &Profile, list: &[Profile], k: usize| {
        let shows = || stiff(&with(&frozen, list, Some(k)), &rival.columns);
        rival.vanished.is_none() || rival.candidate.kind == Kind::Spring && shows()
    };
    let mut chosen = judged.chosen.clone();
    let mut moved = false;
    for k in 0..chosen.len() {
        // Its name is the description's own.
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
