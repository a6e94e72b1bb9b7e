//! The audit of a URDF file, as `rig urdf --audit` prints it.

use std::path::Path;

use rig_model::robot::{Audit, AuditCheck, AuditFinding, ChainChoice, audit_file};

use super::error::CommandError;
use super::ui::Ui;

/// Checks the values of a URDF file and prints the findings.
///
/// # Errors
/// The file cannot be read, or is no URDF.
pub(crate) fn run(
    path: &Path,
    choice: &ChainChoice,
    seed: u64,
    ui: &Ui,
) -> Result<(), CommandError> {
    let audit = audit_file(path, choice, seed)?;
    if ui.is_json() {
        ui.print_json(&format!("{:#}", as_json(path, &audit)));
        return Ok(());
    }
    for finding in &audit.findings {
        let (place, sentence) = (finding.place, &finding.sentence);
        ui.say(&format!("{}:{place}: {sentence}.", path.display()));
    }
    for sentence in &audit.unchecked {
        ui.note(sentence);
    }
    let counts = audit
        .checks
        .iter()
        .map(|own| format!("{} {}", own.count, own.of));
    let counts: Vec<String> = counts.collect();
    let found = match audit.findings.len() {
        0 => "no finding".to_owned(),
        1 => "1 finding".to_owned(),
        n => format!("{n} findings"),
    };
    ui.say(&format!(
        "{}: {found}. Checked: {}.",
        path.display(),
        counts.join(", ")
    ));
    Ok(())
}

fn as_json(path: &Path, audit: &Audit) -> serde_json::Value {
    let check = |own: &AuditCheck| serde_json::json!({ "check": own.check, "of": own.of, "count": own.count });
    let finding = |own: &AuditFinding| {
        serde_json::json!({
            "check": own.check,
            "name": own.name,
            "line": own.place.line,
            "column": own.place.column,
            "sentence": own.sentence,
        })
    };
    serde_json::json!({
        "schema": "rig-urdf-audit/1",
        "file": path.display().to_string(),
        "checks": audit.checks.iter().map(check).collect::<Vec<_>>(),
        "unchecked": audit.unchecked,
        "findings": audit.findings.iter().map(finding).collect::<Vec<_>>(),
    })
}
