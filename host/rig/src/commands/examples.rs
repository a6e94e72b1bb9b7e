//! What the help of the program shows besides the options: commands by purpose, and examples.

use std::fmt::Write as _;

use clap::Command;

/// Commands by what they are for, in the order of the work.
const GROUPS: [(&str, &[&str]); 7] = [
    ("Begin", &["demo", "init", "doctor"]),
    ("Look at logs", &["inspect", "convert"]),
    (
        "Move and record",
        &["excite", "record", "simulate", "live", "board", "flash"],
    ),
    (
        "Identify",
        &["identify", "base", "friction-map", "load", "compliance"],
    ),
    (
        "Check and explain",
        &["validate", "diagnose", "compare", "control"],
    ),
    ("Hand on", &["urdf", "mjcf", "header", "table"]),
    ("The program itself", &["run", "completions", "man", "help"]),
];

/// Lines that can be typed as they are, with files of one's own. The last words of each command's help.
const EXAMPLES: [(&str, &[&str]); 27] = [
    ("demo", &["rig demo", "rig demo --seed 2 --out second-rig"]),
    ("run", &["rig run lab.toml"]),
    (
        "init",
        &[
            "rig init one-link --out rig.toml",
            "rig init --from arm.urdf --out arm.toml",
        ],
    ),
    (
        "inspect",
        &["rig inspect log.csv", "rig inspect bag --out pictures"],
    ),
    (
        "excite",
        &[
            "rig excite --robot arm.toml --out motion.toml",
            "rig excite --robot arm.urdf --speed-share 0.5 --out motion.csv",
        ],
    ),
    (
        "record",
        &[
            "rig record --emulated --home -1.5708 --trajectory motion.toml --out train.csv",
            "rig record --port /dev/ttyACM0 --home -1.5708 --trajectory motion.toml --out train.csv",
        ],
    ),
    (
        "simulate",
        &[
            "rig simulate --robot arm.toml --trajectory motion.toml --noise-torque 0.1 --out train.csv",
        ],
    ),
    (
        "convert",
        &[
            "rig convert bag --out log.csv",
            "rig convert log.csv --out log.npz",
        ],
    ),
    (
        "urdf",
        &[
            "rig urdf --robot found/identified.toml --out arm.urdf",
            "rig urdf --robot arm.urdf --audit",
        ],
    ),
    (
        "mjcf",
        &["rig mjcf --robot found/identified.toml --out joints.xml"],
    ),
    (
        "header",
        &["rig header --robot found/identified.toml --out friction.h"],
    ),
    (
        "identify",
        &[
            "rig identify --robot arm.urdf --data log.csv --out found",
            "rig identify --robot arm.toml --data one.csv two.csv --holdout three.csv --out found",
            "rig identify --robot arm.urdf --data foreign.csv --map q1=angle --out found",
        ],
    ),
    (
        "friction-map",
        &["rig friction-map --robot rig.toml --data log.csv --sweep sweep.csv --out map"],
    ),
    (
        "validate",
        &["rig validate --robot found/identified.toml --data other.csv --out check"],
    ),
    (
        "diagnose",
        &[
            "rig diagnose --robot found/identified.toml --data log.csv --out why",
            "rig diagnose --robot arm.toml --data one.csv two.csv --holdout three.csv --out why",
        ],
    ),
    (
        "table",
        &["rig table found --out table.tex", "rig table found"],
    ),
    (
        "load",
        &[
            "rig load --robot arm.toml --data poses.csv --out load",
            "rig load --robot arm.toml --data with.csv --without empty.csv --by torque --out load",
        ],
    ),
    (
        "compare",
        &[
            "rig compare --robot arm.toml --data monday.csv friday.csv --out trust",
            "rig compare --simulated --out methods",
        ],
    ),
    (
        "compliance",
        &[
            "rig compliance --robot arm.toml --frequency chirp.csv --out stiffness",
            "rig compliance --robot arm.toml --pose 0,-1,1,0,1,0 --out stiffness",
        ],
    ),
    (
        "control",
        &[
            "rig control --robot arm.toml --law computed-torque --wrong 30 --out laws",
            "rig control --robot arm.toml --model found/identified.toml --out laws",
        ],
    ),
    ("live", &["rig live", "rig live --port /dev/ttyACM0"]),
    (
        "board",
        &[
            "rig board --port /dev/ttyACM0 health",
            "rig board --port /dev/ttyACM0 upload --model why/model.toml",
        ],
    ),
    ("flash", &["rig flash"]),
    ("base", &["rig base --robot arm.urdf"]),
    ("doctor", &["rig doctor"]),
    ("completions", &["rig completions bash > rig.bash"]),
    ("man", &["rig man --out man1"]),
];

/// Returns `program` with its commands listed by purpose, and with examples behind the options of each.
pub(super) fn with_examples(program: Command) -> Command {
    let list = groups(&program);
    let program = EXAMPLES.iter().fold(program, |program, (name, lines)| {
        program.mut_subcommand(name, |own| {
            own.after_help(format!("Examples:\n  {}", lines.join("\n  ")))
        })
    });
    program.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{list}Options:\n{{options}}{{after-help}}"
    ))
}

/// Lists the commands of `program` by purpose.
fn groups(program: &Command) -> String {
    let mut list = String::new();
    for (purpose, names) in GROUPS {
        let _ = writeln!(list, "{purpose}:");
        for name in names {
            let about = match program.find_subcommand(name) {
                Some(own) => own.get_about().map(ToString::to_string),
                // clap adds this one when it reads the command line.
                None => Some("Prints this message, or the help of a command".to_owned()),
            };
            let _ = writeln!(list, "  {name:<14}{}", about.unwrap_or_default());
        }
        list.push('\n');
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::Cli;
    use clap::{CommandFactory as _, Parser as _};

    #[test]
    fn every_command_stands_in_one_group_and_has_examples() {
        let program = Cli::command();
        let mut grouped: Vec<&str> = GROUPS
            .iter()
            .flat_map(|(_, names)| *names)
            .copied()
            .collect();
        grouped.sort_unstable();
        let mut known: Vec<&str> = program.get_subcommands().map(Command::get_name).collect();
        known.push("help");
        known.sort_unstable();
        assert_eq!(grouped, known);
        let mut shown: Vec<&str> = EXAMPLES.iter().map(|(name, _)| *name).collect();
        shown.push("help");
        shown.sort_unstable();
        assert_eq!(shown, known);
    }

    #[test]
    fn examples_are_command_lines_that_the_program_takes() {
        for (name, lines) in EXAMPLES {
            for line in lines {
                let words: Vec<&str> = line
                    .split_once(" > ")
                    .map_or(*line, |(own, _)| own)
                    .split(' ')
                    .collect();
                assert_eq!(words[..2], ["rig", name], "{line}");
                let refused = Cli::try_parse_from(&words).err();
                assert_eq!(refused.map(|error| error.to_string()), None, "{line}");
            }
        }
    }
}
