//! Filters, band and rows behind all results on the page.

use rig_diagnose::outcome::{Diagnosis, Treated};
use rig_output::{format_significant, format_unit};
use rig_report::{Block, Column, Section, Table};

/// Treatment of the recordings.
pub(super) fn section(found: &Diagnosis) -> Option<Section> {
    let treated = found.treatment.as_ref()?;
    Some(
        Section::new(
            "rows",
            "Filter and rows",
            "Torque and model pass the same filters and are then compared row by row. Nothing on this page shows frequencies above the band, and rows that were left out were used in no fit and no figure.",
        )
        .with(Block::Text(filters(treated)))
        .with(Block::Table(rows(treated))),
    )
}

fn filters(treated: &Treated) -> String {
    let hertz = |value: f64| format!("{} Hz", format_significant(value, 3));
    let links = treated.links_cutoff.map_or(String::new(), |cutoff| {
        format!(
            " Inertia and gravity torques are computed from the position up to {} and then filtered like the torque.",
            hertz(cutoff)
        )
    });
    format!(
        "Sample rate: {}; highest frequency of the motion: {}. Low-pass of the position: {}{links} Rows: band up to {}, {} rows a second.",
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
            Column::number("Least speed", ""),
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
        note: "Rows left out: slower than the least speed, near rests and reversals, where friction can have any value between those of both directions; at a torque limit; and during a disturbance.".into(),
    }
}
