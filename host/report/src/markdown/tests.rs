use pulldown_cmark::{Event, Options, Parser, Tag};

use super::*;
use crate::document::{Column, Link};
use crate::{Axis, Role, Series};

/// A text with everything that Markdown gives a meaning.
const HOSTILE: &str =
    "# a *b* _c_ `d` [e](f) ![g](h) <i>j</i> | k ~~l~~ &amp; http://m.n o@p $q$ \\ --- \u{202e}";

/// What a parser of CommonMark with the tables of GitHub reads: the elements, and the text.
fn read(text: &str) -> (Vec<String>, String) {
    let (mut elements, mut words) = (Vec::new(), String::new());
    let options = Options::ENABLE_TABLES | Options::ENABLE_STRIKETHROUGH | Options::ENABLE_MATH;
    for event in Parser::new_ext(text, options) {
        match event {
            Event::Text(text) => words.push_str(&text),
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                elements.push(format!("link to {dest_url}"));
            }
            Event::Start(Tag::CodeBlock(_)) => elements.push("code".into()),
            Event::Start(tag) => elements.push(format!("{tag:?}")),
            Event::End(_) => words.push('\n'),
            other => elements.push(format!("{other:?}")),
        }
    }
    (elements, words)
}

fn plot(name: &str, y: f64) -> Plot {
    Plot::new(name, Axis::new(name, name), Axis::new(name, name))
        .with(Series::line(
            name,
            Role::Measured,
            vec![0.0, 1.0],
            vec![y, 2.0 * y],
        ))
        .note(name)
}

/// A document with every block; all texts are `name`.
fn every_block(name: &str) -> Document {
    let blocks = vec![
        Block::Text(format!("{name}\n\n{name}")),
        Block::List(vec![name.into(); 2]),
        Block::Links(vec![Link {
            text: name.into(),
            address: "beside/report.html".into(),
        }]),
        Block::Table(Table {
            caption: name.into(),
            columns: vec![Column::text(name), Column::number(name, name)],
            rows: vec![vec![name.into(); 2]; 2],
            note: name.into(),
        }),
        Block::Plot(plot(name, 1.0)),
        Block::Plot(plot(name, f64::NAN)),
        Block::Note {
            kind: NoteKind::Warning,
            text: format!("{name}\n\n{name}"),
        },
        Block::Details {
            summary: name.into(),
            blocks: vec![Block::Text(name.into())],
        },
        Block::Code("q".into()),
    ];
    Document {
        title: name.into(),
        subtitle: name.into(),
        summary: vec![Fact::new(name, name).unit(name).note(name).tone(Tone::Good)],
        sections: vec![Section {
            blocks,
            ..Section::new("one", name, name)
        }],
        footer: name.into(),
    }
}

#[test]
fn hostile_names_change_no_element_and_keep_their_letters() {
    let hostile = markdown(&every_block(HOSTILE), "report").unwrap();
    let harmless = markdown(&every_block("q"), "report").unwrap();
    let (elements, words) = read(&hostile.text);
    assert_eq!(elements, read(&harmless.text).0);
    let shown = HOSTILE.replace('\u{202e}', "\u{fffd}");
    // Each text of the document once, the title of the picture twice; that of the code is another.
    assert_eq!(words.matches(&shown).count(), 32, "{words}");
}

#[test]
fn the_text_shows_each_picture_that_can_be_drawn() {
    let made = markdown(&every_block("q"), "report").unwrap();
    assert_eq!(made.figures.len(), 1);
    assert_eq!(made.figures[0].0, "report-figure-1.svg");
    assert!(made.figures[0].1.contains("<svg"));
    assert!(made.text.contains("![q](report-figure-1.svg)"));
    assert!(made.text.contains("No value can be drawn."));
}

#[test]
fn numbers_and_names_of_joints_stay_as_they_are() {
    for plain in [
        "-0.00024 ± 0.00050",
        "panda_joint1",
        "+3",
        "1.5 N·m",
        "2. next",
    ] {
        let expected = plain.replace("2. ", "2\\. ");
        assert_eq!(inline(plain), expected);
    }
}

#[test]
fn code_ends_at_its_own_fence() {
    let document = Document {
        sections: vec![Section::new("s", "s", "").with(Block::Code("a\n````\nb".into()))],
        ..Document::default()
    };
    let (_, words) = read(&markdown(&document, "r").unwrap().text);
    assert!(words.contains("a\n````\nb"), "{words}");
}

#[test]
fn a_row_without_a_cell_is_refused_by_both_forms() {
    let table = Table {
        columns: vec![Column::text("a"), Column::text("b")],
        rows: vec![vec!["1".into()]],
        ..Table::default()
    };
    let document = Document {
        sections: vec![Section::new("s", "s", "").with(Block::Table(table))],
        ..Document::default()
    };
    let said = markdown(&document, "r").unwrap_err().to_string();
    assert_eq!(said, crate::render(&document).unwrap_err().to_string());
}

#[test]
fn a_document_with_fewer_figures_leaves_none_of_an_earlier_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.md");
    let of = |count: usize| Document {
        sections: vec![Section {
            blocks: vec![Block::Plot(plot("q", 1.0)); count],
            ..Section::new("s", "s", "")
        }],
        ..Document::default()
    };
    let files = || std::fs::read_dir(folder.path()).unwrap().count();
    crate::write_markdown(&path, &of(3)).unwrap();
    assert_eq!(files(), 4);
    crate::write_markdown(&path, &of(1)).unwrap();
    assert_eq!(files(), 2);
    crate::remove_markdown(&path).unwrap();
    assert_eq!(files(), 0);
    crate::remove_markdown(&path).unwrap();
}
