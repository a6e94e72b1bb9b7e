//! Static loading: which recordings show what.

use super::another_reading::another_reading;
use super::link::by_links;
use super::result::LoadingFindings;
use super::stuck::refuse_stuck;
use super::tool::by_tool;
use super::wrench::{has_displacement, has_wrench};
use crate::error::ComplianceError;
use crate::signals::Signals;
use crate::tool_point::ToolPoint;

/// Finds the stiffness of the drives from recordings of slow loading.
///
/// # Errors
/// [`ComplianceError`]: recordings with neither a link encoder nor a displacement of the tool point.
pub(crate) fn loading(
    tool: &ToolPoint<'_>,
    stretches: &[Signals],
) -> Result<LoadingFindings, ComplianceError> {
    let mut found = LoadingFindings::default();
    let displaced: Vec<&Signals> = stretches.iter().filter(|s| has_displacement(s)).collect();
    let linked: Vec<&Signals> = (stretches.iter())
        .filter(|s| s.joints.iter().any(|j| j.link.is_some()))
        .collect();
    for signals in stretches {
        let link = signals.joints.iter().any(|j| j.link.is_some());
        let tool = has_displacement(signals);
        if tool && !has_wrench(signals) {
            return Err(ComplianceError::Recording(format!(
                "{} has a displacement of the tool point, but no force (columns fx fy fz, N, base axes). {}",
                signals.label,
                signals.other_columns()
            )));
        }
        if !link && !tool {
            return Err(ComplianceError::Recording(format!(
                "{} shows no deflection: static loading needs an encoder on a link (column ql<k>), or the displacement of the tool point (dx dy dz, m, base axes) with its force (fx fy fz, N). {}",
                signals.label,
                signals.other_columns()
            )));
        }
        refuse_stuck(signals)?;
    }
    if !displaced.is_empty() {
        let mut seen = by_tool(tool, &displaced)?;
        let nothing = seen.drives.iter().all(|drive| drive.stiffness.is_none());
        let other = (nothing || seen.told.is_some())
            .then(|| another_reading(tool, &displaced, &seen.lack))
            .flatten();
        if let Some(other) = &other {
            let drives = seen.drives.iter_mut();
            for drive in drives.filter(|drive| drive.missing.is_some()) {
                drive.missing = Some(other.clone());
            }
        }
        found.drives.extend(seen.drives);
        found.residual = Some(seen.lack.residual);
        found.warnings.extend(other.or(seen.told));
        found.warnings.extend(seen.unused);
    }
    if !linked.is_empty() {
        found.drives.extend(by_links(tool, &linked)?);
    }
    let told: Vec<String> = (found.drives.iter())
        .flat_map(|d| d.warnings.clone())
        .collect();
    found.warnings.extend(told);
    Ok(found)
}
