//! Judges what was found: one sentence each, with the command that mends it.

use serde::Serialize;

use super::facts::{Answer, Facts, SerialPort, TARGET};

/// How a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum State {
    /// It can be used.
    Ok,
    /// It is optional and not there.
    Note,
    /// It is there and cannot be used.
    Fault,
}

/// One finding.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Finding {
    /// What it is about.
    pub(super) about: &'static str,
    pub(super) state: State,
    /// What was found, without the full stop.
    pub(super) text: String,
    /// The command that mends it.
    pub(super) command: Option<String>,
}

impl Finding {
    fn ok(about: &'static str, text: String) -> Self {
        Self {
            about,
            state: State::Ok,
            text,
            command: None,
        }
    }

    fn note(about: &'static str, text: impl Into<String>, command: &str) -> Self {
        Self {
            about,
            state: State::Note,
            text: text.into(),
            command: (!command.is_empty()).then(|| command.to_owned()),
        }
    }

    fn fault(about: &'static str, text: impl Into<String>, command: &str) -> Self {
        Self {
            state: State::Fault,
            ..Self::note(about, text, command)
        }
    }
}

/// Judges everything.
pub(super) fn findings(facts: &Facts) -> Vec<Finding> {
    let mut all = vec![program()];
    all.extend(serial(&facts.ports));
    all.push(probe_tool(facts));
    all.extend(probe_rules(facts));
    all.extend(compiler(facts));
    all.push(package(facts.package.as_ref()));
    all.push(recordings(facts));
    all
}

fn program() -> Finding {
    let probe = match cfg!(feature = "probe") {
        true => "with",
        false => "without",
    };
    Finding::ok(
        "program",
        format!(
            "rig {} for {} on {}, built {probe} the debug probe (`rig record --probe`)",
            env!("CARGO_PKG_VERSION"),
            std::env::consts::OS,
            std::env::consts::ARCH
        ),
    )
}

fn serial(ports: &[SerialPort]) -> Vec<Finding> {
    const ABOUT: &str = "serial port";
    if ports.is_empty() {
        return vec![Finding::note(
            ABOUT,
            "none of a board is there; plug the rig in, or work without hardware",
            "rig record --emulated --out train.csv",
        )];
    }
    let of = |port: &SerialPort| match (port.is_usable, &port.group) {
        (true, _) => Finding::ok(ABOUT, format!("{} can be used", port.name)),
        (false, Some(group)) => Finding::fault(
            ABOUT,
            format!(
                "you may not use {}, which belongs to the group {group}; join the group and log in again",
                port.name
            ),
            &format!("sudo usermod -aG {group} $USER"),
        ),
        (false, None) => Finding::fault(
            ABOUT,
            format!(
                "you may not use {}; ask its owner for read and write access",
                port.name
            ),
            &format!("ls -l {}", port.name),
        ),
    };
    ports.iter().map(of).collect()
}

fn probe_tool(facts: &Facts) -> Finding {
    const ABOUT: &str = "debug probe";
    const INSTALL: &str = "cargo install probe-rs-tools --locked";
    match &facts.probe_tool {
        Some(Answer::Done(version)) => Finding::ok(ABOUT, format!("{version} is installed")),
        Some(Answer::Failed(why)) => Finding::fault(
            ABOUT,
            format!("probe-rs is there and fails ({why}); install it again"),
            INSTALL,
        ),
        None => Finding::note(
            ABOUT,
            "probe-rs is not installed, which `rig flash` needs; install it",
            INSTALL,
        ),
    }
}

/// Judges the rules of udev, if probe-rs is there to use them.
fn probe_rules(facts: &Facts) -> Option<Finding> {
    const ABOUT: &str = "debug probe";
    facts.probe_tool.as_ref()?;
    Some(match facts.probe_rules? {
        true => Finding::ok(ABOUT, "udev has rules for it".to_owned()),
        false => Finding::fault(
            ABOUT,
            "udev has no rule for it, so only root may use it; add that of probe-rs and plug the board in again",
            "sudo curl -o /etc/udev/rules.d/69-probe-rs.rules https://probe.rs/files/69-probe-rs.rules && sudo udevadm control --reload",
        ),
    })
}

fn compiler(facts: &Facts) -> Vec<Finding> {
    const ABOUT: &str = "compiler";
    const OLDEST: &str = env!("CARGO_PKG_RUST_VERSION");
    let version = match &facts.compiler {
        Some(Answer::Done(version)) => version,
        Some(Answer::Failed(why)) => {
            return vec![Finding::fault(
                ABOUT,
                format!("rustc is there and fails ({why}); choose a toolchain"),
                "rustup default stable",
            )];
        }
        None => {
            return vec![Finding::note(
                ABOUT,
                "rustc is not installed, which building the program and the firmware needs; install it from https://rustup.rs",
                "",
            )];
        }
    };
    if numbers(version) < numbers(OLDEST) {
        return vec![Finding::fault(
            ABOUT,
            format!("{version} is older than {OLDEST}, which the sources need; update it"),
            "rustup update stable",
        )];
    }
    let target = match facts.has_target {
        true => Finding::ok(ABOUT, format!("the chip's target {TARGET} is installed")),
        false => Finding::note(
            ABOUT,
            "the chip's target is not installed, which building the firmware needs; add it",
            &format!("rustup target add {TARGET}"),
        ),
    };
    vec![Finding::ok(ABOUT, version.clone()), target]
}

/// Returns the first two numbers of a version, such as 1 and 90 of `rustc 1.90.0 (…)`.
fn numbers(version: &str) -> Vec<u32> {
    let word = version
        .split_whitespace()
        .find(|word| word.starts_with(|c: char| c.is_ascii_digit()));
    let parts = word.unwrap_or_default().split('.').take(2);
    parts.filter_map(|part| part.parse().ok()).collect()
}

fn package(answer: Option<&Answer>) -> Finding {
    const ABOUT: &str = "Python package";
    const INSTALL: &str = "pip install ./host/python";
    let own = env!("CARGO_PKG_VERSION");
    match answer {
        None => Finding::note(
            ABOUT,
            "python3 is not installed, which rig_dynamics needs; install Python 3.9 or newer from https://python.org",
            "",
        ),
        Some(Answer::Done(version)) if version == own => {
            Finding::ok(ABOUT, format!("rig_dynamics {version} is installed"))
        }
        Some(Answer::Done(version)) => Finding::fault(
            ABOUT,
            format!(
                "rig_dynamics {version} is of another version than this program ({own}); install that of these sources"
            ),
            INSTALL,
        ),
        Some(Answer::Failed(why)) if why.contains("No module named 'rig_dynamics'") => {
            Finding::note(
                ABOUT,
                "rig_dynamics is not installed; install it from the folder of the sources",
                INSTALL,
            )
        }
        Some(Answer::Failed(why)) => Finding::fault(
            ABOUT,
            format!("rig_dynamics cannot be imported ({why}); install it again"),
            &format!("{INSTALL} --force-reinstall"),
        ),
    }
}

fn recordings(facts: &Facts) -> Finding {
    const ABOUT: &str = "recordings";
    match &facts.recordings {
        None => Finding::note(
            ABOUT,
            "RIG_DATA is not set, so tests with recordings of real robots are skipped; name their folder, if you have them",
            "export RIG_DATA=FOLDER",
        ),
        Some((path, true)) => Finding::ok(
            ABOUT,
            format!("RIG_DATA names the folder {}", path.display()),
        ),
        Some((path, false)) => Finding::fault(
            ABOUT,
            format!(
                "RIG_DATA names {}, which is no folder; name the folder of the recordings",
                path.display()
            ),
            "export RIG_DATA=FOLDER",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of<'a>(found: &'a [Finding], about: &str) -> Vec<&'a Finding> {
        found.iter().filter(|own| own.about == about).collect()
    }

    #[test]
    fn a_port_of_another_group_is_a_fault_with_the_command_that_mends_it() {
        let port = |is_usable, group: Option<&str>| Facts {
            ports: vec![SerialPort {
                name: "/dev/ttyACM0".into(),
                is_usable,
                group: group.map(str::to_owned),
            }],
            ..Facts::default()
        };
        let found = findings(&port(false, Some("dialout")));
        let own = of(&found, "serial port")[0];
        assert_eq!(own.state, State::Fault);
        assert_eq!(
            own.command.as_deref(),
            Some("sudo usermod -aG dialout $USER")
        );
        let found = findings(&port(true, Some("dialout")));
        assert_eq!(of(&found, "serial port")[0].state, State::Ok);
        let found = findings(&port(false, None));
        assert_eq!(
            of(&found, "serial port")[0].command.as_deref(),
            Some("ls -l /dev/ttyACM0")
        );
    }

    #[test]
    fn versions_are_compared_as_numbers() {
        for (version, state) in [
            ("rustc 1.9.0 (a 2016-05-23)", State::Fault),
            ("rustc 1.89.1", State::Fault),
            ("rustc 1.90.0", State::Ok),
            ("rustc 1.100.0-nightly (a 2027-01-01)", State::Ok),
            ("rustc 2.0.0", State::Ok),
        ] {
            let facts = Facts {
                compiler: Some(Answer::Done(version.into())),
                ..Facts::default()
            };
            assert_eq!(
                of(&findings(&facts), "compiler")[0].state,
                state,
                "{version}"
            );
        }
    }

    #[test]
    fn what_is_optional_is_no_fault() {
        let found = findings(&Facts::default());
        assert!(
            found.iter().all(|own| own.state != State::Fault),
            "{found:?}"
        );
        assert!(of(&found, "debug probe").len() == 1);
    }
}
