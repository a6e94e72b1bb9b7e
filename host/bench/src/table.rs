//! Writes the figures as a table.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::score::{GapClass, Score};
use super::wilson::Proportion;

/// Returns Markdown: criteria and aims with one column for each method, then a table of effects for each method.
pub fn markdown(scores: &[Score]) -> String {
    let methods: Vec<(&str, &Score)> = scores.iter().map(|s| (s.method.as_str(), s)).collect();
    let mut rows = Rows::new("criterion", &methods);
    names(&mut rows);
    gaps(&mut rows);
    left_over(&mut rows);
    values(&mut rows);
    controls(&mut rows, scores);
    rows.row("failed altogether", "0", &|s| s.failed.to_string());
    let mut text = rows.text;
    for score in scores {
        by_effect(&mut text, score);
    }
    text
}

/// Returns what a row of proportions shows of a score.
fn share(of: fn(&Score) -> Proportion) -> impl Fn(&&Score) -> String {
    move |score| of(score).to_string()
}

/// Adds the rows on right and wrong names.
fn names(rows: &mut Rows<&Score>) {
    rows.row(
        "right name first, one effect above the floor",
        "≥ 97 %",
        &share(|s| s.right_first),
    );
    rows.row(
        "right name first, effects below the floor too",
        "",
        &share(|s| s.right_first_any_size),
    );
    rows.row(
        "false alarm, nothing hidden",
        "≤ 2 %",
        &share(|s| s.false_alarm),
    );
    rows.row("false-discovery proportion, mean", "≤ 0.05", &|s| {
        number(s.false_discovery, 3)
    });
    rows.row(
        "exact set, one effect",
        "≥ 95 %",
        &share(|s| s.exact_single),
    );
    rows.row(
        "exact set, two or three effects",
        "≥ 85 %",
        &share(|s| s.exact_combination),
    );
    rows.row(
        "… an open name right where the hidden effect is in its set",
        "",
        &share(|s| s.exact_combination_as_sets),
    );
}

/// Adds the rows on the gap closed, by class of effect.
fn gaps(rows: &mut Rows<&Score>) {
    for (class, name, aim) in [
        (GapClass::Static, "static", "≥ 97 %"),
        (GapClass::Presliding, "presliding", "≥ 97 %"),
        (GapClass::Elasticity, "elasticity", "≥ 95 %"),
        (GapClass::Backlash, "backlash", "≥ 85 %"),
    ] {
        rows.row(
            &format!("gap closed on the hold-out, {name}, median"),
            aim,
            &|s| percent(s.gap_closed.get(&class).copied()),
        );
    }
}

/// Adds the rows on remainders, open names and experiments.
fn left_over(rows: &mut Rows<&Score>) {
    rows.row(
        "something left is said, all named or nothing hidden",
        "",
        &share(|s| s.left_wrongly),
    );
    rows.row(
        "effect not in the library: invents a name silently",
        "≤ 10 %",
        &share(|s| s.invented_silently),
    );
    rows.row(
        "effect not in the library: says that something is left",
        "≥ 95 %",
        &share(|s| s.remainder_flagged),
    );
    rows.row(
        "confounded names returned as a set",
        "100 %",
        &share(|s| s.set_returned),
    );
    rows.row(
        "open name with the hidden effect in its set: the rig runs the experiment proposed, as it is or with what pulls on it taken off",
        "",
        &share(|s| s.experiment_runs),
    );
    rows.row(
        "separated by that one experiment",
        "≥ 90 %",
        &share(|s| s.set_separated),
    );
}

/// Adds the rows on the values of parameters.
fn values(rows: &mut Rows<&Score>) {
    rows.row("parameter error, median", "≤ 5 %", &|s| {
        percent(s.parameter_error)
    });
    rows.row(
        "95 % intervals that hold the truth",
        "90–98 %",
        &share(|s| s.coverage),
    );
}

/// Adds a row for each negative control.
fn controls(rows: &mut Rows<&Score>, scores: &[Score]) {
    let groups: BTreeSet<_> = scores
        .iter()
        .flat_map(|s| s.controls.keys().copied())
        .collect();
    for group in groups {
        let name = serde_json::to_string(&group).unwrap_or_default();
        rows.row(
            &format!("invents a name, control {}", name.trim_matches('"')),
            "≤ 5 %",
            &|s| {
                s.controls
                    .get(&group)
                    .map_or("–".into(), Proportion::to_string)
            },
        );
    }
}

/// Appends the table of effects of one method.
fn by_effect(text: &mut String, score: &Score) {
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

/// Writes a share in percent; a dash if there is none.
pub(super) fn percent(value: Option<f64>) -> String {
    value.map_or("–".into(), |v| format!("{:.1} %", 100.0 * v))
}
