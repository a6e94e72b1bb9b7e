//! The pages of effects in `docs/`, an index and one for each, are made from the laws of the library, with a picture each.

use std::fmt::Write as _;
use std::path::Path;

use rig_output::capital;
use rig_shared::effects::{Confusion, Kind, Need};

use crate::documented::made_page;

/// Says what the pages are made from.
const MADE: &str = "<!-- Made from shared/src/effects/: RIG_WRITE_DOCS=1 cargo test -p rig --test cli the_pages_of_effects -->";

/// Head of the index, behind its title.
const HEAD: &str = "An effect is physics beyond rigid bodies, Coulomb and viscous friction. `rig diagnose` searches for the effects of this page,
`rig simulate` computes them, and the firmware compensates most of those that are torques ([firmware.md](firmware.md#effects)). The
page of each has the equation, what the effect looks like, what it is mistaken for, and the experiment that separates the two.
The keys of a description are in [formats.md](formats.md#effects). [measured.md](diagnosis/measured.md) says how often each is found.

| effect | is | picture |
| --- | --- | --- |
";

/// End of the index.
const END: &str = "
## How to read the pages

θm is the angle of the motor and q that of the joint. Units are those of a revolute joint.

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

/// Returns the names of the effects, in the order of the registry, with the laws of each.
fn effects() -> Vec<(&'static str, Vec<Kind>)> {
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

/// Returns the page of an effect.
fn page_of(name: &str, kinds: &[Kind]) -> String {
    let title = capital(kinds[0].about().title);
    let mut page = format!("# {title}: `{name}`\n\n{MADE}\n\n");
    for kind in kinds {
        law(*kind, &mut page);
    }
    let _ = writeln!(page, "![{title}]({name}.svg)\n");
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
    page += match rivals.is_empty() {
        true => "No entry of the library is mistaken for it.\n",
        false => "| mistaken for | experiment that separates the two |\n| --- | --- |\n",
    };
    for (rival, entry) in rivals {
        let exact = match entry.exact {
            true => "one function of torque and motor position for every motion: ",
            false => "",
        };
        let separated = escaped(entry.separated_by);
        let _ = writeln!(page, "| [`{rival}`]({rival}.md) | {exact}{separated} |");
    }
    page + "\n[All effects, and how to read the page](../effects.md)\n"
}

/// Returns the index and the page of each effect: the path of each, and its text.
fn made() -> Vec<(String, String)> {
    let mut index =
        format!("# Which effects are known, and what do they look like?\n\n{MADE}\n\n{HEAD}");
    let mut pages = Vec::new();
    for (name, kinds) in effects() {
        let title = capital(kinds[0].about().title);
        let _ = writeln!(
            index,
            "| [`{name}`](effects/{name}.md) | {title} | <img src=\"effects/{name}.svg\" alt=\"{title}\" width=\"240\"> |"
        );
        pages.push((format!("docs/effects/{name}.md"), page_of(name, &kinds)));
    }
    pages.push(("docs/effects.md".to_owned(), index + END));
    pages
}

#[test]
fn the_pages_of_effects_have_what_the_library_has() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (page, text) in made() {
        let picture = root.join(&page).with_extension("svg");
        assert!(
            page == "docs/effects.md" || picture.exists(),
            "docs/effects/draw.py makes the picture of {page}"
        );
        made_page(&page, &text, "the_pages_of_effects");
    }
}
