//! Tables of a document as plain text, for a terminal.

use super::document::{Alignment, Block, Document, Table};
use super::error::ReportError;
use super::escape::visible;

/// Returns the tables of a document as plain text with aligned columns, in order: a caption, a line of column heads, and
/// a line a row.
///
/// # Errors
/// [`ReportError::Row`] if a row of a table has not a cell for each column.
pub fn text_tables(document: &Document) -> Result<Vec<String>, ReportError> {
    let mut tables = Vec::new();
    for section in &document.sections {
        collect(&section.blocks, &mut tables);
    }
    tables.into_iter().map(text).collect()
}

/// Adds the tables among `blocks`, and those in blocks that unfold.
fn collect<'a>(blocks: &'a [Block], tables: &mut Vec<&'a Table>) {
    for block in blocks {
        match block {
            Block::Table(table) => tables.push(table),
            Block::Details { blocks, .. } => collect(blocks, tables),
            _ => {}
        }
    }
}

/// Returns one table as text.
fn text(table: &Table) -> Result<String, ReportError> {
    table.check()?;
    let head = table.columns.iter().map(|column| match &column.unit {
        Some(unit) => format!("{}, {unit}", column.name),
        None => column.name.clone(),
    });
    let mut rows: Vec<Vec<String>> = vec![head.map(|name| line(&name)).collect()];
    rows.extend((table.rows.iter()).map(|row| row.iter().map(|cell| line(cell)).collect()));
    let widths: Vec<usize> = (0..table.columns.len())
        .map(|k| (rows.iter().map(|row| row[k].chars().count()).max()).unwrap_or(0))
        .collect();
    let mut out = vec![line(&table.caption)];
    for row in rows {
        let cells =
            (row.iter().zip(&table.columns).zip(&widths)).map(
                |((cell, column), width)| match column.alignment {
                    Alignment::Right => format!("{cell:>width$}"),
                    Alignment::Left | Alignment::Center => format!("{cell:<width$}"),
                },
            );
        let cells: Vec<String> = cells.collect();
        out.push(format!("  {}", cells.join("  ").trim_end()));
    }
    if !table.note.is_empty() {
        out.push(format!("  {}", line(&table.note)));
    }
    Ok(out.join("\n"))
}

/// Returns text in one line, without characters that a terminal would obey.
fn line(text: &str) -> String {
    let words: Vec<&str> = text.split_whitespace().collect();
    words.join(" ").chars().map(visible).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::document::{Column, Section};

    #[test]
    fn columns_stand_below_their_heads_and_no_control_character_passes() {
        let mut section = Section::new("a", "A", "");
        let table = Table {
            caption: "Stiffness".into(),
            columns: vec![Column::text("joint"), Column::number("k", "N·m/rad")],
            rows: vec![
                vec!["shoulder".into(), "1500".into()],
                vec!["el\u{1b}[2Jbow\n2".into(), "7".into()],
            ],
            note: "At rest.".into(),
        };
        section.blocks.push(Block::Details {
            summary: "more".into(),
            blocks: vec![Block::Table(table)],
        });
        let document = Document {
            sections: vec![section],
            ..Document::default()
        };
        let found = text_tables(&document).unwrap();
        let lines: Vec<&str> = found[0].lines().collect();
        assert_eq!(lines.len(), 5, "{found:?}");
        assert_eq!(lines[0], "Stiffness");
        let end = |line: &str| line.chars().count();
        assert_eq!(end(lines[1]), end(lines[2]), "{found:?}");
        assert_eq!(end(lines[2]), end(lines[3]), "{found:?}");
        assert!(lines[2].ends_with(" 1500"), "{found:?}");
        assert!(!found[0].contains('\u{1b}'), "{found:?}");
        assert_eq!(lines[4], "  At rest.");
    }
}
