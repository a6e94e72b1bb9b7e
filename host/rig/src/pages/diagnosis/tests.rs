#![allow(clippy::unwrap_used, clippy::panic)]

#[path = "../../../examples/made_up/diagnosis.rs"]
mod made_up;

use super::{diagnosis, gap, limits};
use crate::pages::context::Context;
use rig_diagnose::outcome;
use rig_diagnose::outcome::Diagnosis;
use rig_output::format_value;
use rig_report::{Block, Document, Section, Tone, render};

fn context() -> Context {
    Context {
        command: "rig diagnose --robot r.toml".into(),
        identified: Some(("model.toml".into(), "name = \"described text\"".into())),
        remarks: Vec::new(),
        warnings: vec!["The <data> warning.".into()],
    }
}

fn page(found: &Diagnosis) -> String {
    render(&diagnosis(found, &context())).unwrap()
}

fn section<'a>(document: &'a Document, id: &str) -> Option<&'a Section> {
    document.sections.iter().find(|s| s.id == id)
}

#[test]
fn a_page_says_all_that_the_diagnosis_says() {
    let found = made_up::explained();
    let text = page(&found);
    let steps = found.steps.iter().flat_map(|s| {
        let values = s
            .parameters
            .iter()
            .flat_map(|(name, v)| [name.clone(), format_value(v.value, v.std)]);
        values.chain([s.why.clone()])
    });
    let all = found
        .words
        .iter()
        .cloned()
        .chain([found.noise_floor_how.clone()])
        .chain(found.places.iter().map(|p| p.text.clone()))
        .chain(steps)
        .chain(found.absorbed.iter().map(|a| a.parameter.clone()))
        .chain(
            found
                .not_testable
                .iter()
                .flat_map(|n| [n.why.clone(), n.experiment.clone()]),
        )
        .chain(found.detectable.iter().map(|d| d.parameter.clone()))
        .chain(found.tried.iter().map(|t| t.refused.clone()))
        .chain(found.next_experiment.iter().map(|n| n.text.clone()))
        .chain(["The &lt;data&gt; warning.".into(), "described text".into()]);
    for words in all {
        assert!(text.contains(&words), "{words}");
    }
}

#[test]
fn an_arm_shows_all_joints_over_their_noise_floor_first() {
    let mut found = made_up::explained();
    let mut other = found.waterfall[0].clone();
    other.joint = "other".into();
    // The floor of this joint is not known: its bars are left out.
    other.floor = 0.0;
    other.holdout_floor = 0.0;
    found.waterfall.push(other);
    let document = diagnosis(&found, &context());
    let mut blocks = section(&document, "gap").unwrap().blocks.iter();
    let first = blocks.find_map(|block| match block {
        Block::Plot(plot) => Some(plot),
        _ => None,
    });
    let first = first.unwrap();
    assert_eq!(first.title, "Residual of all joints");
    let refitted = &first.series[0].y;
    assert!(
        (refitted[0] - 0.224 / 0.051).abs() < 1e-9 && refitted[1].is_nan(),
        "{refitted:?}"
    );
    found.waterfall.truncate(1);
    assert!(!page(&found).contains("Residual of all joints"));
}

#[test]
fn no_section_of_any_verdict_is_empty() {
    for (name, found) in made_up::all() {
        let document = diagnosis(&found, &context());
        render(&document).unwrap();
        for section in &document.sections {
            assert!(!section.blocks.is_empty(), "{name}: {}", section.id);
            for block in &section.blocks {
                match block {
                    Block::Table(table) => {
                        assert!(!table.rows.is_empty(), "{name}: {}", table.caption)
                    }
                    Block::List(items) => assert!(!items.is_empty(), "{name}: {}", section.id),
                    Block::Text(words) => {
                        assert!(!words.trim().is_empty(), "{name}: {}", section.id)
                    }
                    Block::Plot(plot) => assert!(!plot.series.is_empty(), "{name}: {}", plot.title),
                    _ => {}
                }
            }
        }
    }
}

#[test]
fn each_verdict_has_its_own_word_and_stands_first() {
    let mut words = std::collections::BTreeSet::new();
    for (_, found) in made_up::all() {
        let document = diagnosis(&found, &context());
        assert_eq!(document.sections[0].id, "verdict");
        words.insert(document.summary[0].value.clone());
    }
    assert_eq!(words.len(), 5);
}

#[test]
fn data_at_fault_show_the_fault_and_nothing_fitted() {
    let document = diagnosis(&made_up::data_fault(), &context());
    let ids: Vec<&str> = document.sections.iter().map(|s| s.id.as_str()).collect();
    assert_eq!(ids, ["verdict", "faults", "warnings", "repeat"]);
    assert_eq!(document.summary[0].tone, Tone::Fault);
}

#[test]
fn a_name_that_is_not_settled_is_said_to_be_open() {
    let document = diagnosis(&made_up::explained(), &context());
    let open = |id: &str| {
        section(&document, id).unwrap().blocks.iter().any(|b| {
            matches!(b, Block::Note { kind: rig_report::NoteKind::Warning, text } if text.contains("torque ripple"))
        })
    };
    assert!(!open("step-1"));
    assert!(open("step-2"));
}

#[test]
fn joints_for_which_the_same_is_not_testable_share_a_row() {
    let mut found = made_up::explained();
    let mut second = found.not_testable[0].clone();
    second.joint = "elbow".into();
    found.not_testable.push(second);
    assert_eq!(limits::grouped(&found.not_testable).len(), 2);
    assert!(page(&found).contains("link, elbow"));
}

#[test]
fn the_spread_of_an_absorbed_parameter_follows_from_its_sigmas() {
    let mut found = made_up::explained();
    found.absorbed.truncate(1);
    found.absorbed[0].before = 1.0;
    found.absorbed[0].after = 1.5;
    found.absorbed[0].sigmas = 10.0;
    assert!(page(&found).contains("1.500 ± 0.050"));
}

#[test]
fn pictures_have_the_fall_each_effect_and_what_is_left() {
    let names = |found: &Diagnosis| -> Vec<String> {
        let pictures = super::pictures(found);
        for (_, plot) in &pictures {
            rig_report::svg(plot).unwrap();
        }
        pictures.into_iter().map(|(name, _)| name).collect()
    };
    let found = made_up::explained();
    let effects: Vec<String> = names(&found).into_iter().skip(1).collect();
    assert_eq!(names(&found)[0], "gap-1.svg");
    assert_eq!(effects.len(), found.steps.len(), "{effects:?}");
    let left = names(&made_up::remainder());
    assert!(left.contains(&"left-1.svg".to_owned()), "{left:?}");
    // If nothing was found, the figure shows the small gap.
    let mut nothing = found;
    nothing.steps.clear();
    assert_eq!(names(&nothing)[0], "gap-1.svg");
    assert!(names(&made_up::data_fault()).is_empty());
}

/// A name is doubtful if a free function still reduces the residual.
#[test]
fn a_doubted_name_is_not_confirmed() {
    let mut found = made_up::explained();
    assert!(page(&found).contains("Confirmed"));
    let mut left = made_up::remainder().remainder.unwrap();
    left.joint.clone_from(&found.steps[0].joint);
    left.doubt = true;
    found.remainder = Some(left);
    let text = page(&found);
    assert!(text.contains("see the unexplained residual") && !text.contains("<td>yes</td>"));
}

#[test]
fn bins_that_crowd_about_zero_are_drawn_once_more() {
    let found = made_up::explained();
    let mut map = found.maps[0].clone();
    let count = map.at.len();
    let even = |k: usize| k as f64 - 0.5 * (count as f64 - 1.0);
    map.at = (0..count).map(even).collect();
    assert_eq!(gap::maps(&map).len(), 1);
    map.at = (0..count).map(|k| even(k).powi(7)).collect();
    let plots = gap::maps(&map);
    assert_eq!(plots.len(), 2);
    let [whole, close] = [&plots[0], &plots[1]].map(|p| p.series[0].x.len());
    assert!(close >= 8 && close < whole, "{close} of {whole}");
    assert!(plots[1].title.contains("its middle"));
}

#[test]
fn values_against_the_description_are_no_lies_of_a_fit() {
    let mut found = made_up::explained();
    found.absorbed_before = outcome::Before::Described;
    let text = page(&found);
    assert!(text.contains("As described") && !text.contains("biased by the missing effects"));
}

#[test]
fn without_a_holdout_every_figure_says_so() {
    let mut found = made_up::explained();
    found.waterfall[0].holdout.clear();
    for step in &mut found.steps {
        step.holdout_rms = None;
    }
    let text = page(&found);
    assert!(text.contains("no hold-out was given"));
    assert!(!text.contains("Hold-out") && !text.contains("on the hold-out;"));
}

#[test]
fn a_gap_that_goes_with_nothing_is_said_to() {
    let mut found = made_up::explained();
    let said = |found: &Diagnosis| page(found).contains("No coordinate alone explains it");
    assert!(!said(&found));
    found.places.clear();
    assert!(said(&found));
    assert!(!said(&made_up::data_fault()));
}
