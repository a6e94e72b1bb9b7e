//! `rig base`: the canonical (base) parameters of a robot.

use clap::Args as ClapArgs;

use super::error::CommandError;
use super::identify::Model;
use super::input::RobotArg;
use super::link_numbers::followers_note;
use super::ui::Ui;
use rig_identify::{Base, agree, grouped};

/// Lists the canonical (base) parameters: the combinations of parameters that motion and torque can identify.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// Equations that the parameters belong to
    #[arg(long, value_enum, default_value = "differential")]
    model: Model,
    /// Seed of the random states from which the parameters are computed
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Runs the command.
///
/// # Errors
/// The description is wrong, or the base parameters of the model cannot be decided.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let robot = args.robot.load(ui)?;
    let base = Base::structural(&robot, args.model.into(), args.seed)?;
    // There are no rules for axes that follow a joint.
    let rules = match robot.has_followers() {
        true => None,
        false => Some(grouped(&robot)?),
    };
    let same = rules.as_ref().map(|rules| agree(rules, &base));
    let list: Vec<(String, &str)> = (0..base.len())
        .map(|k| (base.expression(k), base.unit(k)))
        .collect();
    if ui.is_json() {
        let parameters: Vec<_> = list
            .iter()
            .map(|(expression, unit)| serde_json::json!({ "expression": expression, "unit": unit }))
            .collect();
        let result = serde_json::json!({
            "schema": "rig-base/1",
            "robot": robot.name,
            "count": list.len(),
            "count_by_rules": rules.as_ref().map(Base::len),
            "rules_agree": same,
            "base_parameters": parameters,
        });
        ui.print_json(&format!("{result:#}"));
        return Ok(());
    }
    if let (Some(false), Some(rules)) = (same, &rules) {
        ui.note(&format!(
            "The grouping rules give {} parameters, the numeric rank {}, and the sets differ; the list is that of the numeric rank.",
            rules.len(),
            list.len()
        ));
    } else if rules.is_some() {
        ui.detail("Numeric rank and the grouping rules for modified Denavit-Hartenberg frames give the same set.");
    } else if let Some(note) = followers_note(&robot) {
        ui.note(&note);
    }
    for (expression, unit) in &list {
        ui.say(&format!("{expression}  [{unit}]"));
    }
    ui.say(&format!("{}: {} base parameters", robot.name, list.len()));
    Ok(())
}
