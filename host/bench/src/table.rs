//! Writes the figures as a table.

use std::fmt::Write as _;

use super::score::Score;
use super::wilson::Proportion;

/// Returns Markdown: criteria and aims with one column for each method, then a table of effects for each method.
pub fn markdown(scores: &[Score]) -> String {
    let methods: Vec<(&str, &Score)> = scores.iter().map(|s| (s.method.as_str(), s)).collect();
    let mut rows = Rows::new("criterion", &methods);
    let mut row = |name: &str, aim: &str, of: &dyn Fn(&Score) -> String| {
        rows.row(name, aim, &|score| of(score));
    };
    let p = |f: fn(&Score) -> Proportion| move |s: &Score| f(s).to_string();
    row(
        "right name first, one effect above the floor",
        "≥ 97 %",
        &p(|s| s.right_first),
    );
    row(
        "right name first, effects below the floor too",
        "",
        &p(|s| s.right_first_any_size),
    );
    row(
        "false alarm, nothing hidden",
        "≤ 2 %",
        &p(|s| s.false_alarm),
    );
    row("false-discovery proportion, mean", "≤ 0.05", &|s| {
        number(s.false_discovery, 3)
    });
    row("exact set, one effect", "≥ 95 %", &p(|s| s.exact_single));
    row(
        "exact set, two or three effects",
        "≥ 85 %",
        &p(|s| s.exact_combination),
    );
    row(
        "… an open name right where the hidden effect is in its set",
        "",
        &p(|s| s.exact_combination_as_sets),
    );
    for (class, aim) in [
        ("static", "≥ 97 %"),
        ("presliding", "≥ 97 %"),
        ("elasticity", "≥ 95 %"),
        ("backlash", "≥ 85 %"),
    ] {
        row(
            &format!("gap closed on the hold-out, {class}, median"),
            aim,
            &|s| percent(s.gap_closed.get(class).copied()),
        );
    }
    row(
        "something left is said, all named or nothing hidden",
        "",
        &p(|s| s.left_wrongly),
    );
    row(
        "effect not in the library: invents a name silently",
        "≤ 10 %",
        &p(|s| s.invented_silently),
    );
    row(
        "effect not in the library: says that something is left",
        "≥ 95 %",
        &p(|s| s.remainder_flagged),
    );
    row(
        "confounded names returned as a set",
        "100 %",
        &p(|s| s.set_returned),
    );
    row(
        "open name with the hidden effect in its set: the rig runs the experiment proposed, as it is or with what pulls on it taken off",
        "",
        &p(|s| s.experiment_runs),
    );
    row(
        "separated by that one experiment",
        "≥ 90 %",
        &p(|s| s.set_separated),
    );
    row("parameter error, median", "≤ 5 %", &|s| {
        percent(s.parameter_error)
    });
    row(
        "95 % intervals that hold the truth",
        "90–98 %",
        &p(|s| s.coverage),
    );
    let groups: std::collections::BTreeSet<_> = scores
        .iter()
        .flat_map(|s| s.controls.keys().copied())
        .collect();
    for group in groups {
        let name = serde_json::to_string(&group).unwrap_or_default();
        row(
            &format!("invents a name, control {}", name.trim_matches('"')),
            "≤ 5 %",
            &|s| {
                s.controls
                    .get(&group)
                    .map_or("–".into(), Proportion::to_string)
            },
        );
    }
    row("failed altogether", "0", &|s| s.failed.to_string());
    let mut text = rows.text;
    for score in scores {
        let _ = write!(
            text,
            "\n### {}, by effect\n\n| effect | right name first | exact set | gap closed | parameter error | below the floor: invents | taken for |\n| --- | --- | --- | --- | --- | --- | --- |\n",
            score.method
        );
        for (name, effect) in &score.effects {
            let taken: Vec<String> = effect
                .taken_for
                .iter()
                .map(|(name, count)| format!("{name} {count}"))
                .collect();
            let _ = writeln!(
                text,
                "| {name} | {} | {} | {} | {} | {} | {} |",
                effect.right_first,
                effect.exact,
                percent(effect.gap_closed),
                percent(effect.parameter_error),
                effect.invented_below,
                taken.join(", ")
            );
        }
    }
    text
}

/// A Markdown table of figures and aims, one column for each method or arm.
pub(super) struct Rows<'o, O> {
    columns: &'o [(&'o str, O)],
    pub(super) text: String,
}

impl<'o, O> Rows<'o, O> {
    /// Creates the table head; `of` is the title of the first column.
    pub(super) fn new(of: &str, columns: &'o [(&'o str, O)]) -> Self {
        let mut text = format!("| {of} | aim |");
        for (name, _) in columns {
            let _ = write!(text, " {name} |");
        }
        text.push_str("\n| --- | --- |");
        text.push_str(&" --- |".repeat(columns.len()));
        text.push('\n');
        Self { columns, text }
    }

    /// Adds a row.
    pub(super) fn row(&mut self, name: &str, aim: &str, of: &dyn Fn(&O) -> String) {
        let _ = write!(self.text, "| {name} | {aim} |");
        for (_, column) in self.columns {
            let _ = write!(self.text, " {} |", of(column));
        }
        self.text.push('\n');
    }
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".into(), |v| format!("{v:.digits$}"))
}

pub(super) fn percent(value: Option<f64>) -> String {
    value.map_or("–".into(), |v| format!("{:.1} %", 100.0 * v))
}
