//! The page of a comparison of several sets.

use super::context::Context;
use super::parts;
use rig_compare::{
    CORRELATED, Comparison, Grade, Hypothesis, ODDS, PooledParameter, SetValue, TOGETHER,
    TorqueMatrix,
};
use rig_output::{format_significant, format_unit, format_value};
use rig_report::{
    Axis, Block, Column, Document, Fact, Marker, Plot, Role, Section, Series, Style, Table, Tone,
};

/// Where the figures are that a warning of an identification names.
pub(crate) const SEE_IDENTIFY: &str = "Figures that a warning of a set names are in the report of \"rig identify\" on the set's recordings.";
/// Number of parameters whose forest plots are shown unfolded.
const UNFOLDED: usize = 12;

/// Composes the page.
pub fn compare(found: &Comparison, context: &Context) -> Document {
    let mut sections: Vec<Section> = parts::warnings(&[&found.warnings, &context.warnings])
        .map(|section| match found.brief_warnings.is_empty() {
            true => section,
            false => section.with(parts::info(SEE_IDENTIFY)),
        })
        .into_iter()
        .collect();
    sections.push(Section::new("grade", "Grade", "").with(Block::List(found.reasons.clone())));
    sections.push(sets(found));
    sections.push(values(found));
    sections.push(forests(found));
    sections.push(torque(found));
    sections.extend(causes(found));
    sections.push(trades(found));
    sections.push(treated(found));
    sections.push(parts::repeat(context));
    Document {
        title: format!("{}: {} results compared", found.robot, found.sets.len()),
        subtitle: "Which values to trust, what differs between the sets, and whether it matters for the torque.".into(),
        summary: summary(found, context),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

/// Returns what the grade `differ-without-effect` means.
pub(crate) fn same_torque(found: &Comparison) -> String {
    let most = found.torque.worst().map_or(0.0, |(share, ..)| share);
    let corrected = (found.causes.as_ref()).is_some_and(|causes| causes.corrected.is_some());
    let advice = match corrected {
        true => "correct the zero of the joint in the recordings and compare again",
        false => "use whichever set",
    };
    format!(
        "The parameters differ by more than their errors, but the torque that they predict is the same within {} %: {advice}.",
        parts::percent(most)
    )
}

fn summary(found: &Comparison, context: &Context) -> Vec<Fact> {
    let (grade, tone) = match found.grade {
        Grade::Agree => ("agree", Tone::Good),
        Grade::DifferWithoutEffect => ("differ, same torque", Tone::Notice),
        Grade::DifferAndMatter => ("differ and matter", Tone::Warning),
        Grade::Undecided => ("undecided", Tone::Warning),
        Grade::NotComparable => ("not comparable", Tone::Fault),
    };
    let tests = || found.parameters.iter().filter_map(|p| p.test);
    let differing = tests().filter(|t| t.differs).count();
    let mut grade = Fact::new("Grade", grade).tone(tone);
    if found.grade == Grade::DifferWithoutEffect {
        grade = grade.note(same_torque(found));
    }
    let mut facts = vec![
        grade,
        Fact::new(
            "Parameters that differ",
            format!("{differing} of {}", tests().count()),
        )
        .note(format!(
            "level {} after Holm's correction",
            found.test_level
        )),
    ];
    if let Some((share, joint, ..)) = found.torque.worst() {
        facts.push(
            Fact::new("Largest effect on a torque", parts::percent(share))
                .unit("%")
                .note(format!(
                    "joint {}; the tolerance is {} %",
                    found.torque.joints[joint],
                    parts::percent(found.tolerance)
                ))
                .tone(if share > found.tolerance {
                    Tone::Warning
                } else {
                    Tone::Good
                }),
        );
    }
    if let Some(causes) = &found.causes {
        let second = causes
            .corrected
            .as_ref()
            .and_then(|own| own.named.as_deref());
        let tied = (causes.hypotheses.iter())
            .filter(|h| h.explains && h.odds_against < ODDS)
            .count();
        facts.push(Fact::new(
            "Cause",
            match causes.named.as_deref() {
                Some("nothing") => "chance",
                Some(name) => name,
                None if tied > 1 => "several possible",
                None if second.is_some() => "zero",
                None => "not one of those tested",
            },
        ));
        if let Some(second) = second {
            facts.push(Fact::new("Cause with the zero corrected", second));
        }
    }
    facts.push(parts::warning_count(
        found.warnings.len() + context.warnings.len(),
    ));
    facts
}

fn sets(found: &Comparison) -> Section {
    let rows = found.sets.iter().map(|set| {
        vec![
            set.name.clone(),
            set.recordings.join(", "),
            set.rank.to_string(),
            set.degrees_of_freedom.to_string(),
            format!("{:.2}", set.shrinkage),
            (set.repeats_after).map_or_else(|| "–".into(), |s| format_significant(s, 3)),
            (set.relative_error.iter())
                .map(|e| parts::percent(*e))
                .collect::<Vec<_>>()
                .join(" · "),
            match set.not_shown.is_empty() {
                true => "all".into(),
                false => format!("not {}", set.not_shown.join(", ")),
            },
        ]
    });
    Section::new("sets", "Sets", "Each set is identified on its own.").with(Block::Table(Table {
        caption: "Sets of recordings".into(),
        columns: vec![
            Column::text("Set"),
            Column::text("Recordings"),
            Column::number("Rank", ""),
            Column::number("Degrees of freedom", ""),
            Column::number("Shrinkage", ""),
            Column::number("Motion repeats after", "s"),
            Column::number("Residual by joint", "% of the torque"),
            Column::text("Parameters shown"),
        ],
        rows: rows.collect(),
        note: "Degrees of freedom: groups of rows that the covariance was estimated from, minus one; if the motion repeats, rows of one place in it are one group. Shrinkage: weight of the covariance that the regressor alone gives (0: groups of rows only).".into(),
    }))
}

fn values(found: &Comparison) -> Section {
    let rows = found.parameters.iter().map(|p| {
        let test = match p.test {
            None => "one set only".to_owned(),
            Some(t) if t.differs => format!("{} differs ▲", probability(t.p_holm)),
            Some(t) => probability(t.p_holm),
        };
        vec![
            p.expression.clone(),
            test,
            format!(
                "{} {}",
                format_value(p.value, p.half_interval),
                format_unit(&p.unit)
            ),
            format_significant(p.std, 2),
            format_significant(p.within, 2),
            format_significant(p.between, 2),
        ]
    });
    let mut section = Section::new(
        "values",
        "Pooled values",
        "Values of all sets together, each set weighted by its full covariance and by the spread between sets.",
    )
    .with(Block::Table(Table {
        caption: "Pooled parameters".into(),
        columns: vec![
            Column::text("Parameter"),
            Column::number("p (Holm)", ""),
            Column::number("Value ± half the 95 % interval", ""),
            Column::number("Standard error", ""),
            Column::number("Within a set", ""),
            Column::number("Between sets", ""),
        ],
        rows: rows.collect(),
        note: "p: of Cochran's test that a parameter is the same in all sets, after Holm's correction; Q is below the figures. Standard error: the larger of that by the errors within the sets and that by the scatter of the sets. Within: typical standard deviation in one set. Between: standard deviation of the true values between sets that the errors within them do not explain.".into(),
    }))
    .with(parts::names_of_parameters());
    if found.sets.len() < 5 {
        section = section.with(parts::info(format!(
            "{} sets tell little about the spread between sets: its value is uncertain by about half of itself or more, and the intervals use Student's t with few degrees of freedom.",
            found.sets.len()
        )));
    }
    section
}

fn probability(p: f64) -> String {
    match p < 1e-4 {
        true => "< 0.0001".into(),
        false => format_significant(p, 2),
    }
}

/// A forest plot of each parameter.
fn forests(found: &Comparison) -> Section {
    let names: Vec<String> = (found.sets.iter())
        .map(|s| s.name.clone())
        .chain(["pooled".to_owned()])
        .collect();
    let mut order: Vec<&PooledParameter> = found.parameters.iter().collect();
    let p = |p: &PooledParameter| p.test.map_or(2.0, |t| t.p);
    order.sort_by(|a, b| p(a).total_cmp(&p(b)));
    let mut plots: Vec<Block> = (order.iter())
        .map(|parameter| Block::Plot(forest(parameter, &names)))
        .collect();
    let rest = plots.split_off(plots.len().min(UNFOLDED));
    let mut section = Section::new(
        "forests",
        "Values of each set",
        "The parameters with the clearest differences come first. Bars are ± 2 standard deviations of a set, and the 95 % interval of the pooled value.",
    );
    section.blocks.extend(plots);
    if !rest.is_empty() {
        section = section.with(Block::Details {
            summary: format!("{} more parameters", rest.len()),
            blocks: rest,
        });
    }
    section
}

fn forest(parameter: &PooledParameter, names: &[String]) -> Plot {
    let of = |f: fn(&SetValue) -> f64| parameter.sets.iter().map(f).collect::<Vec<f64>>();
    let mut plot = Plot::new(
        parameter.expression.clone(),
        Axis::categories("", names.to_vec()),
        Axis::new("value", &format_unit(&parameter.unit)),
    )
    .with(Series::new(
        "sets",
        Role::Measured,
        Style::ErrorBars {
            half_width: of(|v| 2.0 * v.std),
        },
        of(|v| v.set as f64),
        of(|v| v.value),
    ))
    .with(Series::new(
        "pooled",
        Role::Model,
        Style::ErrorBars {
            half_width: vec![parameter.half_interval],
        },
        vec![(names.len() - 1) as f64],
        vec![parameter.value],
    ))
    .mark(Marker::horizontal(parameter.value, "pooled"));
    plot.height = 220;
    if let Some(test) = parameter.test {
        plot = plot.note(format!(
            "Q {} with {} degrees of freedom; p after Holm's correction: {}.",
            format_significant(test.q, 3),
            test.degrees_of_freedom,
            probability(test.p_holm)
        ));
    }
    plot
}

/// The matrix of added residuals.
fn torque(found: &Comparison) -> Section {
    let matrix = &found.torque;
    let mut section = Section::new(
        "torque",
        "Effect on the torque",
        "Each row is the motion of a set, each column the parameters of one. The number is the residual that these parameters add to that of the set's own fit, as a share of the joint's torque RMS.",
    );
    let joints = matrix.joints.len();
    if joints > 1 {
        section = section.with(Block::Plot(all_joints(matrix)));
    }
    for (j, name) in matrix.joints.iter().enumerate() {
        let table = Block::Table(by_joint(found, matrix, j));
        section
            .blocks
            .extend(parts::of_joint(name, joints, "added residual", vec![table]));
    }
    section
}

/// Draws the largest residual that the parameters of another set add at each joint.
fn all_joints(matrix: &TorqueMatrix) -> Plot {
    let names: Vec<&str> = matrix.joints.iter().map(String::as_str).collect();
    let worst = (0..names.len())
        .map(|j| 100.0 * matrix.worst_of(j).map_or(f64::NAN, |(share, ..)| share))
        .collect();
    parts::joint_bars(
        "Largest added residual of all joints",
        &names,
        Axis::new("added residual over torque RMS", "%"),
        vec![("parameters of another set", Role::Model, worst)],
        "The parameters of each set on the motions of the others.",
    )
}

/// Filter and rows of each set.
fn treated(found: &Comparison) -> Section {
    let rows = found
        .sets
        .iter()
        .zip(&found.pooled.bands)
        .map(|(set, band)| {
            let speeds: Vec<String> = (band.min_speed.iter())
                .map(|v| format_significant(*v, 3))
                .collect();
            vec![
                set.name.clone(),
                format_significant(band.cutoff, 3),
                format_significant(band.rate, 4),
                parts::count(set.rows),
                speeds.join(" · "),
            ]
        });
    Section::new(
        "rows",
        "Filter and rows",
        "Each set is prepared on its own; the report of an identification has the reasons.",
    )
    .with(Block::Table(Table {
        caption: "Filter and rows of each set".into(),
        columns: vec![
            Column::text("Set"),
            Column::number("Cut-off of the position filter", "Hz"),
            Column::number("Rows a second", ""),
            Column::number("Rows used", ""),
            Column::number("Least speed by joint", "rad/s or m/s"),
        ],
        rows: rows.collect(),
        note: "Rows at less than the least speed, and rows at a torque limit, are not used.".into(),
    }))
}

fn by_joint(found: &Comparison, matrix: &TorqueMatrix, j: usize) -> Table {
    let mut columns = vec![
        Column::text("Motion of"),
        Column::number("Torque RMS", "N·m or N"),
        Column::number("Own residual", "N·m or N"),
    ];
    let names = found.sets.iter().map(|s| s.name.as_str());
    for name in names.clone().chain(["pooled"]) {
        columns.push(Column::number(format!("by {name}"), "%"));
    }
    let rows = names.enumerate().map(|(motion, name)| {
        let mut cells = vec![
            name.to_owned(),
            format_significant(matrix.torque[j][motion], 3),
            format_significant(matrix.residual[j][motion][motion], 3),
        ];
        for (set, share) in matrix.added[j][motion].iter().enumerate() {
            let own = set == motion;
            let mark = if *share > found.tolerance { " ▲" } else { "" };
            cells.push(match own {
                true => "own".into(),
                false => format!("{}{mark}", parts::percent(*share)),
            });
        }
        cells
    });
    Table {
        caption: format!("Joint {}", matrix.joints[j]),
        columns,
        rows: rows.collect(),
        note: format!(
            "▲: more than the tolerance of {} %.",
            parts::percent(found.tolerance)
        ),
    }
}

fn hypothesis(h: &Hypothesis) -> Vec<String> {
    vec![
        h.name.to_owned(),
        if h.explains { "yes" } else { "no" }.to_owned(),
        match h.odds_against < 1e6 {
            true => format_significant(h.odds_against, 3),
            false => "> 1 000 000".into(),
        },
        probability(h.p),
        format!("{:.1} ({})", h.chi2, h.degrees_of_freedom),
        h.free.to_string(),
        h.what.clone(),
    ]
}

fn causes(found: &Comparison) -> Option<Section> {
    let causes = found.causes.as_ref()?;
    let columns = || {
        vec![
            Column::text("Hypothesis"),
            Column::text("Explains"),
            Column::number("Times less likely than the first", ""),
            Column::number("p of the remainder", ""),
            Column::number("Remainder χ² (degrees of freedom)", ""),
            Column::number("Free values", ""),
            Column::text("What may differ between the sets"),
        ]
    };
    let table = |caption: &str, list: &[Hypothesis]| {
        Block::Table(Table {
            caption: caption.into(),
            columns: columns(),
            rows: list.iter().map(hypothesis).collect(),
            note: format!(
                "A cause is named if its remainder is consistent with chance (p of {} or more) and every other such hypothesis is at least {ODDS} times less likely: exp(half the difference of Akaike's criterion).",
                found.family_level
            ),
        })
    };
    let mut section = Section::new("causes", "Cause of the differences", &causes.sentence).with(
        table("Hypotheses, the most likely first", &causes.hypotheses),
    );
    if let Some(corrected) = &causes.corrected {
        section = section.with(Block::Text(corrected.sentence.clone()));
        if !corrected.hypotheses.is_empty() {
            section = section.with(table(
                "Hypotheses with the zero corrected",
                &corrected.hypotheses,
            ));
        }
    }
    Some(section)
}

fn trades(found: &Comparison) -> Section {
    let section = Section::new(
        "trades",
        "Correlated parameters",
        "A pair trades if the errors of the two are strongly correlated within a set and their differences between two sets nearly cancel in the torque. Then only their sum in the torque is certain, and a difference of one of them alone means little.",
    );
    if found.trades.is_empty() {
        return section.with(Block::Text(format!(
            "No pair with a correlation of {CORRELATED} or more has differences whose torque together is at most {TOGETHER} of that of each alone."
        )));
    }
    let rows = found.trades.iter().map(|t| {
        vec![
            t.pair.join(" and "),
            format!("{:.3}", t.correlation),
            t.sets.join(" to "),
            t.differences
                .map(|d| format_significant(d, 3))
                .join(" and "),
            t.torque.map(|d| format_significant(d, 3)).join(" · "),
        ]
    });
    section.with(Block::Table(Table {
        caption: "Pairs that trade torque".into(),
        columns: vec![
            Column::text("Pair"),
            Column::number("Correlation", ""),
            Column::text("Sets"),
            Column::number("Differences", "SI"),
            Column::number("Torque of the first, the second, both", "residual RMS"),
        ],
        rows: rows.collect(),
        note: String::new(),
    }))
}
