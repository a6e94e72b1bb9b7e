//! The measured stiffness as effects for a description.

use rig_output::format_significant;
use serde::Serialize;

use crate::error::ComplianceError;
use crate::identify::Compliance;
use crate::stiffness::elasticity_effects;

/// The tables of the file.
#[derive(Serialize)]
struct Tables {
    effect: Vec<rig_model::robot::RobotEffect>,
}

/// Returns the text of compliance.toml: one `[[effect]]` block for each measured drive, to be pasted into the description.
///
/// # Errors
/// [`ComplianceError::Option`]: a value that TOML cannot hold.
pub fn elasticity_text(found: &Compliance) -> Result<String, ComplianceError> {
    let effect = elasticity_effects(&found.drives);
    let mut text = format!(
        "# Stiffness of the drives of {}, measured by `rig compliance`. Append these blocks to the description.\n",
        found.robot.replace(['\n', '\r'], " ")
    );
    if effect.is_empty() {
        text.push_str("# No stiffness was measured: the values were given, or are those of the description.\n");
        return Ok(text);
    }
    for drive in found.drives.iter().filter(|d| d.source.is_measured()) {
        if let Some(value) = drive.stiffness {
            text.push_str(&format!(
                "# {}: standard deviation {} {}, by {}; {}.\n",
                drive.joint.replace(['\n', '\r'], " "),
                format_significant(value.std, 2),
                drive.unit,
                drive.source.words(),
                match drive.damping {
                    Some(_) => "damping from the frequency response",
                    None => "damping unknown and written as 0",
                }
            ));
        }
    }
    text.push('\n');
    let tables = toml::to_string(&Tables { effect }).map_err(|error| {
        ComplianceError::Option(format!("compliance.toml cannot be written: {error}."))
    })?;
    Ok(text + &tables)
}
