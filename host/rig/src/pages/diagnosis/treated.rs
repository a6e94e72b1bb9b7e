//! Filters, band and rows that everything on the page rests on.

use rig_diagnose::outcome::{Diagnosis, Treated};
use rig_output::{format_significant, format_unit};
use rig_report::{Block, Column, Section, Table};

/// What was done to the recordings.
pub(super) fn section(found: &Diagnosis) -> Option<Section> {
    let treated = found.treatment.as_ref()?;
    Some(
        Section::new(
            "rows",
            "Filter and rows",
            "Torque and model are compared on rows behind filters, each of which both pass. What is faster than the band shows nowhere on this page, and rows that were left out took no part in a fit or a figure.",
        )
        .with(Block::Text(filters(treated)))
        .with(Block::Table(rows(treated))),
    )
}

fn filters(treated: &Treated) -> String {
    let hertz = |value: f64| format!("{} Hz", format_significant(value, 3));
    let links = treated.links_cutoff.map_or(String::new(), |cutoff| {
        format!(
            " Inertia and gravity are formed of the position up to {} and filtered like the torque afterwards.",
            hertz(cutoff)
        )
    });
    format!(
        "Recorded at {}; the motion reaches {}. Low-pass of the position: {}{links} Rows: up to {}, {} a second.",
        hertz(treated.sample_rate),
        hertz(treated.motion_frequency),
        treated.position_cutoff_why,
        hertz(treated.band),
        format_significant(treated.row_rate, 4),
    )
}

fn rows(treated: &Treated) -> Table {
    let share = |[used, all]: [usize; 2]| {
        let percent = 100.0 * used as f64 / all.max(1) as f64;
        format!("{used} of {all} ({percent:.0} %)")
    };
    Table {
        caption: "Rows that are used".into(),
        columns: vec![
            Column::text("Joint"),
            Column::number("Slower is left out", ""),
            Column::number("Training", ""),
            Column::number("Hold-out", ""),
        ],
        rows: (treated.rows.iter())
            .map(|rows| {
                vec![
                    rows.joint.clone(),
                    format!(
                        "{} {}",
                        format_significant(rows.least_speed, 3),
                        format_unit(&rows.unit)
                    ),
                    share(rows.train),
                    rows.holdout.map_or("–".into(), share),
                ]
            })
            .collect(),
        note: "Left out are rows near rests and reversals, where friction may be anything between both directions', rows at a torque limit and what was touched.".into(),
    }
}
