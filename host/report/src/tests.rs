#![allow(clippy::unwrap_used, clippy::panic)]

use super::*;

const HOSTILE: &str = "</script><script>alert(1)</script><img src=x onerror=\"a\"> '&\u{2028}\u{0}";

fn wave(n: usize) -> (Vec<f64>, Vec<f64>) {
    (0..n)
        .map(|i| i as f64 * 0.01)
        .map(|t| (t, (3.0 * t).sin()))
        .unzip()
}

/// A plot of every style, all texts taken from `name`.
fn every_style(name: &str) -> Plot {
    let (x, y) = wave(200);
    let low: Vec<f64> = y.iter().map(|v| v - 0.2).collect();
    let high: Vec<f64> = y.iter().map(|v| v + 0.2).collect();
    let mut plot = Plot::new(name, Axis::new(name, name), Axis::new(name, name));
    for (k, style) in [
        Style::Line,
        Style::Points,
        Style::Steps,
        Style::Band { low, high },
        Style::Bars,
        Style::Bars,
        Style::ErrorBars {
            half_width: vec![0.1; 200],
        },
    ]
    .into_iter()
    .enumerate()
    {
        plot = plot.with(Series::new(name, Role::ALL[k], style, x.clone(), y.clone()));
    }
    plot.mark(Marker::vertical(0.5, name))
        .mark(Marker::horizontal(0.25, name))
        .note(name)
}

fn heat_map(name: &str) -> HeatMap {
    HeatMap {
        title: name.into(),
        x: Axis::new(name, name),
        y: Axis::new(name, name),
        value: Axis::new(name, name),
        columns: vec![0.0, 1.0, 2.0],
        rows: vec![0.0, 1.0],
        values: vec![vec![1.0, 2.0, f64::NAN], vec![3.0, 4.0, 5.0]],
        marks: vec![([1.0, 0.0], name.into())],
        note: name.into(),
        height: HeatMap::HEIGHT,
    }
}

#[test]
fn a_heat_map_colours_each_value_once_and_leaves_gaps_blank() {
    let picture = heat_map("map").svg().unwrap().unwrap();
    // One path for each of five values, one more for the axes.
    assert_eq!(picture.matches("<path").count(), 6, "{picture}");
    let mut wrong = heat_map("map");
    wrong.values[1].pop();
    let said = wrong.svg().unwrap_err().to_string();
    assert!(said.contains("has 2 values in a row"), "{said}");
    let mut empty = heat_map("map");
    empty.values = vec![vec![f64::NAN; 3]; 2];
    assert_eq!(empty.svg().unwrap(), None);
}

fn every_block(name: &str) -> Document {
    let inner = vec![
        Block::Text(name.into()),
        Block::List(vec![name.into()]),
        Block::Table(Table {
            caption: name.into(),
            columns: vec![Column::text(name), Column::number(name, name)],
            rows: vec![vec![name.into(), name.into()]],
            note: name.into(),
        }),
        Block::Plot(every_style(name)),
        Block::HeatMap(heat_map(name)),
        Block::Note {
            kind: NoteKind::Warning,
            text: name.into(),
        },
        Block::Code(name.into()),
    ];
    Document {
        title: name.into(),
        subtitle: name.into(),
        summary: vec![Fact::new(name, name).unit(name).note(name).tone(Tone::Good)],
        sections: vec![
            Section::new("one", name, name).with(Block::Details {
                summary: name.into(),
                blocks: inner.clone(),
            }),
            Section {
                blocks: inner,
                ..Section::new("two", name, name)
            },
        ],
        footer: name.into(),
    }
}

/// Checks that every start tag has its end tag, in order, and returns the names of all elements.
/// Contents of scripts and styles are skipped up to their end tag, as a browser does.
fn elements(html: &str) -> Vec<String> {
    let mut open: Vec<String> = Vec::new();
    let mut all = Vec::new();
    let mut rest = html.strip_prefix("<!DOCTYPE html>").unwrap();
    while let Some(start) = rest.find('<') {
        rest = &rest[start + 1..];
        let end = rest.find('>').unwrap();
        let tag = &rest[..end];
        rest = &rest[end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "before {:.80}", rest);
            continue;
        }
        let name = tag.split([' ', '/']).next().unwrap().to_owned();
        all.push(name.clone());
        if tag.ends_with('/') || name == "meta" {
            continue;
        }
        if name == "script" || name == "style" {
            let close = format!("</{name}>");
            let end = rest.find(&close).unwrap();
            rest = &rest[end + close.len()..];
            continue;
        }
        open.push(name);
    }
    assert_eq!(open, Vec::<String>::new());
    all
}

#[test]
fn hostile_names_change_no_element_of_the_page() {
    let hostile = elements(&render(&every_block(HOSTILE)).unwrap());
    let harmless = elements(&render(&every_block("q")).unwrap());
    assert_eq!(hostile, harmless);
    assert!(!hostile.contains(&"img".to_owned()));
}

#[test]
fn embedded_data_are_json_and_within_the_limit() {
    let (x, y) = wave(50_000);
    let plot = every_style(HOSTILE).with(Series::line("long", Role::Other, x, y));
    let document = Document {
        sections: vec![Section::new("s", "", "").with(Block::Plot(plot))],
        ..Document::default()
    };
    let page = render(&document).unwrap();
    let (_, tail) = page.split_once("class=\"data\">").unwrap();
    let (data, _) = tail.split_once("</script>").unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    let series = data["series"].as_array().unwrap();
    assert_eq!(series.len(), 8);
    let long = &series[7];
    let n = long["x"].as_array().unwrap().len();
    assert!(n <= 4000 && n > 2000 && long["y"].as_array().unwrap().len() == n);
    assert_eq!(long["x"][n - 1].as_f64().unwrap(), 499.99);
    assert!(page.contains(&format!("long: {n} of 50000 samples drawn")));
}

#[test]
fn embedded_numbers_are_true_to_a_millionth_of_the_range() {
    for scale in [1e-30, 1e-5, 1.0, 1e4, 1e30] {
        for offset in [0.0, 1.7e9] {
            let (x, y) = wave(300);
            let x: Vec<f64> = x.iter().map(|v| (v + offset) * scale).collect();
            let y: Vec<f64> = y.iter().map(|v| v * scale).collect();
            let plot = Plot::new("p", Axis::default(), Axis::default()).with(Series::line(
                "s",
                Role::Other,
                x.clone(),
                y.clone(),
            ));
            let scene = scene::Scene::new(&plot).unwrap().unwrap();
            let data: serde_json::Value = serde_json::from_str(&scene.json()).unwrap();
            for (name, values) in [("x", &x), ("y", &y)] {
                let written = data["series"][0][name].as_array().unwrap();
                let span = values.iter().copied().fold(f64::MIN, f64::max)
                    - values.iter().copied().fold(f64::MAX, f64::min);
                for (a, b) in written.iter().zip(values) {
                    assert!(
                        (a.as_f64().unwrap() - b).abs() <= 1.01e-6 * span,
                        "{a} for {b}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_same_document_gives_the_same_bytes() {
    assert_eq!(
        render(&every_block("q̇ in rad/s")).unwrap(),
        render(&every_block("q̇ in rad/s")).unwrap()
    );
}

#[test]
fn pictures_are_well_formed_and_keep_within_their_frame() {
    for name in ["plain", HOSTILE] {
        let picture = svg(&every_style(name)).unwrap();
        let parsed = roxmltree::Document::parse(&picture).unwrap();
        let root = parsed.root_element();
        assert_eq!(root.tag_name().name(), "svg");
        assert!(
            root.attribute("aria-label")
                .unwrap()
                .contains(&name.replace('\u{0}', "\u{fffd}"))
        );
        let view: Vec<f64> = root
            .attribute("viewBox")
            .unwrap()
            .split(' ')
            .map(|v| v.parse().unwrap())
            .collect();
        let texts = parsed.descendants().filter(|n| n.has_tag_name("text"));
        let mut count = 0;
        for node in texts {
            let x: f64 = node.attribute("x").unwrap().parse().unwrap();
            let y: f64 = node.attribute("y").unwrap().parse().unwrap();
            assert!((0.0..=view[2]).contains(&x) && (0.0..=view[3]).contains(&y));
            count += 1;
        }
        assert!(count > 15);
        assert!(!picture.contains("NaN") && !picture.contains("inf"));
        assert!(
            !picture.contains("var("),
            "a picture alone has no style sheet"
        );
    }
}

#[test]
fn non_finite_values_are_gaps_that_are_counted() {
    let (x, mut y) = wave(100);
    y[40] = f64::NAN;
    y[41] = f64::INFINITY;
    y[42] = 1e300;
    let plot = Plot::new("gap", Axis::default(), Axis::default()).with(Series::line(
        "wave",
        Role::Measured,
        x,
        y,
    ));
    let picture = svg(&plot).unwrap();
    let parsed = roxmltree::Document::parse(&picture).unwrap();
    let curve = parsed
        .descendants()
        .filter_map(|n| n.attribute("d"))
        .max_by_key(|d| d.len())
        .unwrap();
    assert_eq!(curve.matches('M').count(), 2, "one curve in two pieces");
    let scene = scene::Scene::new(&plot).unwrap().unwrap();
    assert!(scene.y_range.1 < 2.0);
    assert!(scene.remarks[0].contains("3 of 100"));
    assert!(scene.json().contains("null,null,null"));
}

/// Dashes that are apart on purpose miss nothing.
#[test]
fn pieces_of_a_curve_are_no_missing_samples() {
    let nan = f64::NAN;
    let plot = Plot::new("dashes", Axis::default(), Axis::default()).with(Series::line(
        "fit",
        Role::Model,
        vec![0.0, 1.0, nan, 2.0, 3.0],
        vec![1.0, 1.0, nan, 2.0, 2.0],
    ));
    let band = plot.clone().with(Series::band(
        "interval",
        Role::Model,
        vec![0.0, 1.0, nan, 2.0, 3.0],
        vec![0.5, 0.5, nan, 1.5, 1.5],
        vec![1.5, 1.5, nan, 2.5, 2.5],
    ));
    for plot in [&plot, &band] {
        let scene = scene::Scene::new(plot).unwrap().unwrap();
        assert!(scene.remarks.is_empty(), "{:?}", scene.remarks);
    }
    let picture = svg(&plot).unwrap();
    let parsed = roxmltree::Document::parse(&picture).unwrap();
    let paths = parsed.descendants().filter_map(|n| n.attribute("d"));
    assert!(
        paths
            .map(|d| d.matches('M').count())
            .any(|pieces| pieces == 2)
    );
}

#[test]
fn empty_figures_are_a_sentence() {
    for y in [vec![], vec![f64::NAN; 3]] {
        let plot = Plot::new("nothing", Axis::default(), Axis::default()).with(Series::line(
            "s",
            Role::Model,
            vec![0.0; y.len()],
            y,
        ));
        assert!(matches!(svg(&plot), Err(ReportError::NothingToDraw { .. })));
        let document = Document {
            sections: vec![Section::new("s", "", "").with(Block::Plot(plot))],
            ..Document::default()
        };
        let page = render(&document).unwrap();
        assert!(page.contains("<p class=\"empty\">"));
        assert!(!page.contains("<svg"));
    }
}

#[test]
fn equal_scales_draw_a_circle_round() {
    let (x, y): (Vec<f64>, Vec<f64>) = (0..=360)
        .map(|d| f64::from(d).to_radians().sin_cos())
        .map(|(s, c)| (50.0 + c, s))
        .unzip();
    let mut plot = Plot::new("circle", Axis::default(), Axis::default()).with(Series::line(
        "circle",
        Role::Model,
        x,
        y,
    ));
    plot.equal_aspect = true;
    let picture = svg(&plot).unwrap();
    let parsed = roxmltree::Document::parse(&picture).unwrap();
    let curve = parsed
        .descendants()
        .filter_map(|n| n.attribute("d"))
        .max_by_key(|d| d.len())
        .unwrap();
    let points: Vec<(f64, f64)> = curve[1..]
        .split('L')
        .map(|p| p.split_once(' ').unwrap())
        .map(|(a, b)| (a.parse().unwrap(), b.parse().unwrap()))
        .collect();
    let span = |pick: fn(&(f64, f64)) -> f64| {
        points.iter().map(pick).fold(f64::MIN, f64::max)
            - points.iter().map(pick).fold(f64::MAX, f64::min)
    };
    assert!((span(|p| p.0) - span(|p| p.1)).abs() < 0.3);
    assert!(span(|p| p.0) > 100.0);
}

#[test]
fn what_does_not_fit_is_refused_with_its_place() {
    let ragged = Plot::new("torque", Axis::default(), Axis::default()).with(Series::line(
        "tau",
        Role::Measured,
        vec![0.0, 1.0],
        vec![1.0],
    ));
    let message = svg(&ragged).unwrap_err().to_string();
    assert!(message.contains("tau") && message.contains("torque") && message.contains('1'));
    let mut document = every_block("q");
    document.sections[1].id = "one".into();
    assert!(matches!(
        render(&document),
        Err(ReportError::SectionId { .. })
    ));
    document.sections[1].id = "a b".into();
    assert!(matches!(
        render(&document),
        Err(ReportError::SectionId { .. })
    ));
    document.sections[1].id = "two".into();
    document.sections[0].blocks = vec![Block::Table(Table {
        columns: vec![Column::text("a")],
        rows: vec![vec!["1".into()], vec![]],
        ..Table::default()
    })];
    assert!(matches!(
        render(&document),
        Err(ReportError::Row { row: 2, .. })
    ));
}

#[test]
fn files_appear_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.html");
    write(&path, &every_block("q")).unwrap();
    let first = std::fs::read(&path).unwrap();
    let mut broken = every_block("q");
    broken.sections[1].id = "one".into();
    assert!(write(&path, &broken).is_err());
    assert_eq!(std::fs::read(&path).unwrap(), first);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let missing = folder.path().join("none/report.html");
    let message = write(&missing, &every_block("q")).unwrap_err().to_string();
    assert!(message.contains("none/report.html"));
}

#[test]
fn the_page_asks_nothing_of_any_network() {
    let page = render(&every_block("q")).unwrap();
    for reference in ["src=", "url(http", "@import", "<link", "<base"] {
        let scripts_removed: String = page
            .split("<script>")
            .map(|part| part.split_once("</script>").map_or(part, |(_, rest)| rest))
            .collect();
        assert!(!scripts_removed.contains(reference), "{reference}");
    }
    assert!(page.contains("default-src 'none'"));
    assert!(
        page.contains("Copyright (c)"),
        "the plotting library's licence goes with it"
    );
}

/// A label between two markers stands where it crosses neither line.
#[test]
fn the_label_of_a_marker_does_not_cross_the_line_of_another() {
    let (x, y) = wave(200);
    let axis = || Axis::new("x", "m");
    let plot = |second: f64| {
        let lines = Plot::new("markers", axis(), axis())
            .with(Series::line("wave", Role::Model, x.clone(), y.clone()))
            .mark(Marker::vertical(1.0, "antiresonance"))
            .mark(Marker::vertical(second, "resonance"));
        let picture = svg(&lines).unwrap();
        let parsed = roxmltree::Document::parse(&picture).unwrap();
        let anchors = parsed.descendants().filter(|n| n.has_tag_name("text"));
        let labels = anchors.filter(|n| n.text().is_some_and(|t| t.contains("resonance")));
        let sides = labels.map(|n| n.attribute("text-anchor").unwrap().to_owned());
        sides.collect::<Vec<_>>()
    };
    assert_eq!(plot(1.8), ["start", "start"]);
    assert_eq!(plot(1.1), ["end", "start"]);
}
