//! Size of the gap and its dependence on the motion.

use super::words;
use crate::pages::parts;
use rig_diagnose::outcome::{Diagnosis, Map, Place, Residual, Waterfall};
use rig_diagnose::what_falls;
use rig_output::{format_p_value, format_significant};
use rig_report::{self, Axis, Block, Column, Marker, Plot, Role, Section, Series, Style, Table};

/// Smallest share of the gap that is printed as a sentence.
const LEAST_SHARE: f64 = 0.005;
/// Ratio of highest residual to noise floor from which on the axis is logarithmic, to show the last steps.
const TALL: f64 = 20.0;

/// Returns true if there are figures for a hold-out beside those for the training recordings.
pub(super) fn held_out(found: &Diagnosis) -> bool {
    found.waterfall.iter().any(|w| !w.holdout.is_empty())
}

/// Ratio of the last model's residual RMS to the noise floor, worst joint; on the hold-out if there is one.
pub(super) fn left_over(found: &Diagnosis) -> Option<f64> {
    found
        .waterfall
        .iter()
        .filter_map(|w| {
            let rms = w.holdout.last().or(w.train.last())?;
            // A run that diverged has no residual.
            (w.floor > 0.0 && !rms.is_nan()).then(|| rms / w.judged_floor())
        })
        .reduce(f64::max)
}

/// Residual from the description to the final model.
pub(super) fn waterfall(found: &Diagnosis) -> Option<Section> {
    if found.waterfall.is_empty() {
        return None;
    }
    let mut section = Section::new(
        "gap",
        "Residual from the description to the final model",
        match found.residual {
            Residual::Torque => {
                "Torque that each model leaves unexplained: first the description with its given values, then the same equations with all parameters refitted to the training data, then each effect added in turn. At the noise floor only noise remains."
            }
            Residual::Position => {
                "Deviation of each model's position from the recorded one when the motor voltage drives the model from the first row of a recording to its last: first with refitted parameters, then with each effect added in turn. The line is the encoder's step; no simulation can come below it."
            }
        },
    );
    if !found.noise_floor_how.is_empty() {
        section = section.with(Block::Text(format!(
            "The noise floor. {}",
            found.noise_floor_how
        )));
    }
    if found.waterfall.len() > 1 {
        section.blocks.extend(by_joint(found).map(Block::Plot));
    }
    let (moved, still): (Vec<&Waterfall>, Vec<&Waterfall>) =
        found.waterfall.iter().partition(|w| {
            found.waterfall.len() == 1 || found.steps.iter().any(|step| step.joint == w.joint)
        });
    section.blocks.extend(
        moved
            .iter()
            .map(|w| Block::Plot(bars(found, w, parts::ROOM))),
    );
    if !still.is_empty() {
        section.blocks.push(Block::Details {
            summary: format!(
                "Joints in which nothing was found: {}",
                rig_output::listed(&still.iter().map(|w| w.joint.clone()).collect::<Vec<_>>())
            ),
            blocks: still
                .iter()
                .map(|w| Block::Plot(bars(found, w, parts::ROOM)))
                .collect(),
        });
    }
    Some(section.with(figures(found)))
}

/// Draws the residual of every joint over its noise floor, refitted and with the effects. None if no floor is known.
fn by_joint(found: &Diagnosis) -> Option<Plot> {
    let joints: Vec<&str> = found.waterfall.iter().map(|w| w.joint.as_str()).collect();
    let held = held_out(found);
    let over_floor = |model: &dyn Fn(&[f64]) -> Option<f64>| -> Vec<f64> {
        let ratio = |w: &Waterfall| {
            let rms = if held { &w.holdout } else { &w.train };
            let floor = if held { w.judged_floor() } else { w.floor };
            model(rms)
                .filter(|_| floor > 0.0)
                .map_or(f64::NAN, |rms| rms / floor)
        };
        found.waterfall.iter().map(ratio).collect()
    };
    // The description comes first, then the refit, then each effect.
    let refitted = over_floor(&|rms| rms.get(1).copied());
    let last = over_floor(&|rms| rms.last().copied());
    if last.iter().all(|ratio| ratio.is_nan()) {
        return None;
    }
    let data = if held { "hold-out" } else { "training data" };
    Some(
        parts::joint_bars(
            "Residual of all joints",
            &joints,
            Axis::new("residual RMS over noise floor", ""),
            vec![
                ("refitted", Role::Before, refitted),
                ("with the effects", Role::After, last),
            ],
            &format!("On the {data}. At 1 only noise remains."),
        )
        .mark(Marker::horizontal(1.0, "noise floor")),
    )
}

/// Draws the residual of a joint for each model. If the names of the models need more than `room` letters, the laws of
/// the effects are left out; if that is not enough, the models are numbered.
pub(super) fn bars(found: &Diagnosis, w: &Waterfall, room: usize) -> Plot {
    let n = w.models.len();
    let short: Vec<String> = w
        .models
        .iter()
        .map(|model| match model.as_str() {
            "frozen description" => "as given".into(),
            "refitted" => "refitted".into(),
            effect => format!("+ {}", words::name(effect)),
        })
        .collect();
    let bare: Vec<String> = (short.iter())
        .map(|name| name.split(" (").next().unwrap_or(name).to_owned())
        .collect();
    let fits = |names: &Vec<String>| {
        let longest = names.iter().map(|name| name.chars().count()).max();
        longest.unwrap_or(0) * n <= room
    };
    let fitting = [short, bare].into_iter().find(fits);
    let numbered = fitting.is_none();
    let names = fitting.unwrap_or_else(|| (1..=n).map(|k| k.to_string()).collect());
    let shown = words::shown(found, &w.unit);
    let unit = &shown.unit;
    let places: Vec<f64> = (0..n).map(|k| k as f64).collect();
    let highest = w
        .train
        .iter()
        .chain(&w.holdout)
        .fold(0.0f64, |m, v| m.max(*v));
    // The position of a free run stays far above the encoder's step, so the axis stays linear.
    let tall = found.residual == Residual::Torque && w.floor > 0.0 && highest > TALL * w.floor;
    let (y, style) = if tall {
        (Axis::log("residual RMS", unit), Style::Line)
    } else {
        (Axis::new("residual RMS", unit), Style::Bars)
    };
    let mut plot = Plot::new(
        format!("Joint {}: residual of each model", w.joint),
        Axis::categories("", names),
        y,
    )
    .with(Series::new(
        "training",
        Role::Before,
        style.clone(),
        places.clone(),
        shown.scaled(&w.train),
    ));
    if !w.holdout.is_empty() {
        plot = plot.with(Series::new(
            "hold-out",
            Role::After,
            style,
            places,
            shown.scaled(&w.holdout),
        ));
    }
    let mut note = String::new();
    if numbered {
        note.push_str("The table below lists the names of the models. ");
    }
    if tall {
        note.push_str("Logarithmic axis: the first residual is far larger than the last. ");
    }
    if w.floor.is_nan() {
        note.push_str("No noise floor is known.");
        return plot.note(note);
    }
    note.push_str(&format!("Noise floor {}.", shown.value(w.floor)));
    plot.mark(Marker::horizontal(
        shown.scaled(&[w.floor])[0],
        "noise floor",
    ))
    .note(note)
}

fn figures(found: &Diagnosis) -> Block {
    let held = held_out(found);
    let mut columns = vec![
        Column::text("Joint"),
        Column::number("No.", ""),
        Column::text("Model"),
        Column::number("Training", ""),
    ];
    if held {
        columns.push(Column::number("Hold-out", ""));
    }
    columns.extend([Column::text("Unit"), Column::number("Ratio to floor", "")]);
    let value = |list: &[f64], k: usize| list.get(k).copied().unwrap_or(f64::NAN);
    let rows = found
        .waterfall
        .iter()
        .flat_map(|w| {
            let shown = words::shown(found, &w.unit);
            w.models.iter().enumerate().map(move |(k, model)| {
                let (train, holdout) = (value(&w.train, k), value(&w.holdout, k));
                let judged = if w.holdout.is_empty() { train } else { holdout };
                let mut row = vec![
                    w.joint.clone(),
                    (k + 1).to_string(),
                    model.clone(),
                    shown.number(train),
                ];
                if held {
                    row.push(shown.number(holdout));
                }
                row.extend([
                    shown.unit.clone(),
                    match w.judged_floor().is_nan() {
                        true => "–".into(),
                        false => format!("{} ×", format_significant(judged / w.judged_floor(), 3)),
                    },
                ]);
                row
            })
        })
        .collect();
    Block::Table(Table {
        caption: format!("RMS of the {} for each model", words::shown(found, "").what),
        columns,
        rows,
        note: format!(
            "Ratio to floor: {} divided by the noise floor; 1 means noise only.{}",
            if held { "RMS on the hold-out" } else { "RMS" },
            what_falls(found).map_or(String::new(), |meaning| format!(" {meaning}"))
        ),
    })
}

/// Dependence of the gap on position, velocity and other coordinates.
pub(super) fn places(found: &Diagnosis) -> Option<Section> {
    // The gap is located neither for free runs under voltage nor for faulty recordings.
    if found.residual != Residual::Torque || found.waterfall.is_empty() {
        return None;
    }
    let texts: Vec<String> = texts(&found.places, found.waterfall.len() > 1);
    let mut section = Section::new(
        "where",
        "Dependence of the residual",
        "Quantities that the residual of the refitted model depends on, before any effect is added. Noise depends on none of them; a dependence shows that the model lacks an effect.",
    );
    if found.places.is_empty() {
        return Some(section.with(Block::Text(
            "No coordinate alone explains it: the residual does not depend significantly (p < 0.05) on any of them."
                .to_owned(),
        )));
    }
    if !texts.is_empty() {
        section = section.with(Block::List(texts));
    }
    Some(section.with(table(
        "Quantities that the gap depends on, largest share first",
        &found.places,
    )))
}

/// Sentences about dependences of the residual; with the name of the joint if there are several.
pub(super) fn texts(places: &[Place], several: bool) -> Vec<String> {
    places
        .iter()
        .filter(|place| !place.text.is_empty() && place.share >= LEAST_SHARE)
        .map(|place| match several {
            true => format!("{}: {}", place.joint, place.text),
            false => place.text.clone(),
        })
        .collect()
}

pub(super) fn table(caption: &str, places: &[Place]) -> Block {
    Block::Table(Table {
        caption: caption.into(),
        columns: vec![
            Column::text("Joint"),
            Column::text("Depends on"),
            Column::number("Mainly between", ""),
            Column::text("Unit"),
            Column::number("Share", "%"),
            Column::number("p", ""),
        ],
        rows: places
            .iter()
            .map(|place| {
                vec![
                    place.joint.clone(),
                    place.coordinate.clone(),
                    format!(
                        "{} … {}",
                        format_significant(place.interval[0], 2),
                        format_significant(place.interval[1], 2)
                    ),
                    parts::unit(&place.unit),
                    parts::percent(place.share),
                    format_p_value(place.p_value),
                ]
            })
            .collect(),
        note: "Share: part of the gap that this quantity alone explains. Correlated quantities explain the same part, so the shares do not add up. p is corrected for the number of quantities tested; quantities with p of 0.05 or more are left out.".into(),
    })
}

/// Median distance of the bins from zero, as a share of the largest distance, up to which the bins count as crowded.
const CROWDED: f64 = 0.2;
/// Smallest number of bins in a figure of the middle range.
const FEWEST: usize = 8;

/// Draws the mean residual over one coordinate, before and after the step, with the fitted law. If the bins are crowded
/// near zero, a second figure shows the middle range.
pub(super) fn maps(map: &Map) -> Vec<Plot> {
    let whole = drawn(map);
    let nearer = |m: &Map| closer(m).filter(|m| m.at.len() >= FEWEST);
    let close = std::iter::successors(nearer(map), nearer).last();
    let close = close.map(|close| {
        let mut plot = drawn(&close);
        plot.title = format!("{}, its middle", plot.title);
        plot.note = format!(
            "The {} bins that are crowded in the middle of the figure before.",
            close.at.len()
        );
        plot
    });
    std::iter::once(whole).chain(close).collect()
}

/// Returns the bins near zero if they are crowded there. Travel and time since reversal are mostly short.
fn closer(map: &Map) -> Option<Map> {
    let mut far: Vec<f64> = map.at.iter().map(|x| x.abs()).collect();
    far.sort_by(f64::total_cmp);
    let (median, most) = (*far.get(far.len() / 2)?, *far.last()?);
    let within = |x: f64| x.abs() <= 2.0 * median;
    let signed = map.at.iter().any(|x| *x < 0.0) && map.at.iter().any(|x| *x > 0.0);
    if !signed || median > CROWDED * most {
        return None;
    }
    let close = |values: &[[f64; 2]]| -> Vec<[f64; 2]> {
        (map.at.iter().zip(values))
            .filter(|(x, _)| within(**x))
            .map(|(_, v)| *v)
            .collect()
    };
    Some(Map {
        at: map.at.iter().copied().filter(|x| within(*x)).collect(),
        before: close(&map.before),
        after: close(&map.after),
        law: (map.at.iter().zip(&map.law))
            .filter(|(x, _)| within(**x))
            .map(|(_, v)| *v)
            .collect(),
        ..map.clone()
    })
}

fn drawn(map: &Map) -> Plot {
    let unit = parts::unit(&map.residual_unit);
    let bars = |name: &str, role, values: &[[f64; 2]]| {
        Series::new(
            name,
            role,
            Style::ErrorBars {
                half_width: values.iter().map(|v| v[1]).collect(),
            },
            map.at.clone(),
            values.iter().map(|v| v[0]).collect(),
        )
    };
    let mut plot = Plot::new(
        format!("Joint {}: mean residual over {}", map.joint, map.coordinate),
        Axis::new(&map.coordinate, &parts::unit(&map.unit)),
        Axis::new("mean residual", &unit),
    );
    if !map.before.is_empty() {
        let name = if map.step.is_some() {
            "before"
        } else {
            "at the start"
        };
        plot = plot.with(bars(name, Role::Before, &map.before));
    }
    if !map.after.is_empty() {
        let name = if map.step.is_some() {
            "after"
        } else {
            "at the end"
        };
        plot = plot.with(bars(name, Role::After, &map.after));
    }
    if !map.law.is_empty() {
        plot = plot.with(Series::line(
            "fitted law",
            Role::Model,
            map.at.clone(),
            map.law.clone(),
        ));
    }
    plot.mark(Marker::horizontal(0.0, "")).note(format!(
        "n = {} bins; bars are 95 % intervals of the mean.{}",
        map.at.len(),
        if map.law.is_empty() {
            ""
        } else {
            " The law is drawn without the part that mass, inertia and friction of the standard model can represent."
        }
    ))
}
