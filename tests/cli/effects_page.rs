//! The page of effects in `docs/` is made from the laws of the library, with a picture each.

use std::fmt::Write as _;
use std::path::Path;

use rig_output::capital;
use rig_shared::effects::{Confusion, Kind, Need};

use crate::documented::made_page;

/// Head of the page.
const HEAD: &str = "# Which effects are known, and what do they look like?

<!-- Made from shared/src/effects/: RIG_WRITE_DOCS=1 cargo test -p rig --test cli the_page_of_effects -->

An effect is physics beyond rigid bodies, Coulomb and viscous friction. `rig diagnose` searches for the effects of this page,
`rig simulate` computes them, and the firmware compensates most of those that are torques ([firmware.md](firmware.md#effects)). Each
section has the equation, what the effect looks like, what it is mistaken for, and the experiment that separates the two.
The keys of a description are in [formats.md](formats.md#effects). [measured.md](diagnosis/measured.md) says how often each is found.

θm is the angle of the motor and q that of the joint. Units are those of a revolute joint.

## How to read the pictures

Each picture is a figure of a diagnosis. The emulated rig has the effect, by equations that it does not share with the
search; the coupling of two joints is simulated by `rig simulate`. The model lacks the effect at first. The picture shows the mean
residual before and after the effect is in the model, with 95 % intervals, and the law, over the coordinate that shows it.
No coordinate shows a payload: its picture has the residual of each model. A picture shows what a refit of the other
parameters leaves of an effect.

The pictures were made by this script, which also prints the verdict on each rig:

```sh
python3 docs/effects/draw.py
```

";

/// Returns a requirement on a recording.
fn need(need: Need) -> String {
    match need {
        Need::Reversals(count) => format!("{count} reversals"),
        Need::SlowMotion(speed) => format!(
            "steady motion below {speed} rad/s and above {} rad/s",
            (300.0 * speed).round() / 100.0
        ),
        Need::SpeedRange(ratio) => format!("a highest speed of {ratio} times the typical speed"),
        Need::Travel(turns) => format!("travel over {turns} turns of the joint"),
        Need::SlowTurns(speed) => format!(
            "turns of the motor at less than {speed} rad/s of the motor, and a described gear ratio"
        ),
        Need::LoadRange(ratio) => {
            format!("transmitted torques over a range of {ratio} times their mean")
        }
        Need::Duration(seconds) => format!("{seconds} s of one motion"),
        Need::Voltage => "the voltage of the motor".to_owned(),
        Need::Temperature => "a temperature that rises".to_owned(),
        Need::OtherJoint => "a second joint that moves".to_owned(),
        Need::Prior => {
            "a description with the mass of the link that was right before the change".to_owned()
        }
    }
}

/// Makes words of the library safe for Markdown, in a table too.
fn escaped(text: &str) -> String {
    (text.replace('*', "\\*").replace('_', "\\_")).replace('|', "\\|")
}

/// Returns the titles of the sections, in the order of the registry, with the laws of each.
fn sections() -> Vec<(&'static str, Vec<Kind>)> {
    let mut list: Vec<(&str, Vec<Kind>)> = Vec::new();
    for kind in Kind::ALL {
        let name = kind.about().name;
        match list.iter_mut().find(|(other, _)| *other == name) {
            Some((_, kinds)) => kinds.push(*kind),
            None => list.push((name, vec![*kind])),
        }
    }
    list
}

/// Returns the equation, the source and the parameters of one law.
fn law(kind: Kind, page: &mut String) {
    let about = kind.about();
    if let Some(law) = about.law {
        let _ = writeln!(page, "Law `{law}`:\n");
    }
    let _ = writeln!(page, "```text\n{}\n```\n", about.equation);
    for p in about.gains.iter().chain(about.shapes) {
        let unit = if p.unit == "1" { "" } else { p.unit };
        let unit = escaped(unit);
        let open = if unit.is_empty() { "" } else { " in " };
        let _ = writeln!(page, "* `{}`{open}{unit}: {}", p.name, escaped(p.meaning));
    }
    let _ = writeln!(
        page,
        "\nSource: {}. Left out: {}.\n",
        escaped(about.source),
        escaped(about.leaves_out)
    );
}

/// Returns what all laws of a name are mistaken for: each rival once, first those of this name's own entries.
fn confusions(name: &str, kinds: &[Kind]) -> Vec<(&'static str, Confusion)> {
    let own = (kinds.iter()).flat_map(|k| k.about().confused.iter().map(|c| (c.with, *c)));
    let others = Kind::ALL.iter().flat_map(|k| {
        let about = k.about();
        about.confused.iter().map(|c| (about.name, *c))
    });
    let mut list: Vec<(&str, Confusion)> = Vec::new();
    for (rival, entry) in own.chain(others.filter(|(_, c)| c.with == name)) {
        if rival != name && !list.iter().any(|(other, _)| *other == rival) {
            list.push((rival, entry));
        }
    }
    list
}

/// Adds the section of an effect.
fn section(name: &str, kinds: &[Kind], page: &mut String) {
    let about = kinds[0].about();
    let _ = writeln!(page, "## `{name}`\n\n{}.\n", capital(about.title));
    for kind in kinds {
        law(*kind, page);
    }
    let _ = writeln!(page, "![{}](effects/{name}.svg)\n", capital(about.title));
    let mut signatures: Vec<&str> = kinds.iter().map(|k| k.about().signature).collect();
    signatures.dedup();
    let _ = writeln!(
        page,
        "**Looks like:** {}.\n",
        escaped(&signatures.join("; "))
    );
    let mut needs: Vec<String> = Vec::new();
    for own in kinds.iter().flat_map(|k| k.about().needs) {
        let words = need(*own);
        if !needs.contains(&words) {
            needs.push(words);
        }
    }
    let _ = writeln!(page, "**A recording needs:** {}.\n", needs.join("; "));
    let rivals = confusions(name, kinds);
    if rivals.is_empty() {
        *page += "No entry of the library is mistaken for it.\n\n";
        return;
    }
    *page += "| mistaken for | what separates the two |\n| --- | --- |\n";
    for (rival, entry) in rivals {
        let exact = match entry.exact {
            true => "one function of torque and motor position for every motion: ",
            false => "",
        };
        let _ = writeln!(
            page,
            "| [`{rival}`](#{rival}) | {exact}{} |",
            escaped(entry.separated_by)
        );
    }
    *page += "\n";
}

#[test]
fn the_page_of_effects_has_what_the_library_has() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    let mut page = HEAD.to_owned();
    for (name, kinds) in sections() {
        section(name, &kinds, &mut page);
        assert!(
            docs.join(format!("effects/{name}.svg")).exists(),
            "docs/effects/draw.py makes the picture of {name}"
        );
    }
    let page = format!("{}\n", page.trim_end());
    made_page("docs/effects.md", &page, "the_page_of_effects");
}
