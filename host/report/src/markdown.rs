//! A document as Markdown, with its figures as SVG files beside it.

use std::fmt::Write;

use super::document::{Alignment, Block, Document, Fact, NoteKind, Section, Table, Tone};
use super::error::ReportError;
use super::escape::{address, visible};
use super::heat_map::HeatMap;
use super::plot::Plot;
use super::scene::Scene;
use super::svg::svg;
use rig_output::spell_units;

/// A document as Markdown.
#[derive(Clone, Debug, PartialEq)]
pub struct Markdown {
    /// The text: CommonMark with the tables of GitHub.
    pub text: String,
    /// The figures that the text shows: file name and SVG.
    pub figures: Vec<(String, String)>,
}

/// Returns a document as Markdown. Its figures are called `stem-figure-1.svg` and so on. The same document gives the same
/// bytes.
///
/// # Errors
/// [`ReportError`] if the rows of a table or the series of a plot are inconsistent.
pub fn markdown(document: &Document, stem: &str) -> Result<Markdown, ReportError> {
    let mut page = Page {
        stem,
        text: String::new(),
        figures: Vec::new(),
        numbered: 0,
        tables: 0,
    };
    // Writing into a String cannot fail: the results of `write!` in this file are ignored on purpose.
    let _ = writeln!(page.text, "# {}", inline(&document.title));
    page.paragraphs(&document.subtitle, "");
    if !document.summary.is_empty() {
        page.text.push('\n');
    }
    for fact in &document.summary {
        page.fact(fact);
    }
    for section in &document.sections {
        page.section(section)?;
    }
    if !document.footer.is_empty() {
        page.text.push_str("\n---\n");
        page.paragraphs(&document.footer, "");
    }
    Ok(Markdown {
        text: page.text,
        figures: page.figures,
    })
}

/// The text under construction, with the counters of figures and tables.
struct Page<'a> {
    stem: &'a str,
    text: String,
    figures: Vec<(String, String)>,
    numbered: usize,
    tables: usize,
}

impl Page<'_> {
    fn fact(&mut self, fact: &Fact) {
        let _ = write!(
            self.text,
            "* **{}:** {}",
            inline(&fact.label),
            inline(&fact.value)
        );
        if let Some(unit) = &fact.unit {
            let _ = write!(self.text, " {}", inline(unit));
        }
        self.text.push_str(match fact.tone {
            Tone::Plain | Tone::Notice => "",
            Tone::Good => " (good)",
            Tone::Warning => " (attention)",
            Tone::Fault => " (fault)",
        });
        if !fact.note.is_empty() {
            let _ = write!(self.text, ". {}", inline(&fact.note));
        }
        self.text.push('\n');
    }

    fn section(&mut self, section: &Section) -> Result<(), ReportError> {
        let _ = writeln!(self.text, "\n## {}", inline(&section.title));
        self.paragraphs(&section.lead, "");
        section
            .blocks
            .iter()
            .try_for_each(|block| self.block(block))
    }

    fn block(&mut self, block: &Block) -> Result<(), ReportError> {
        match block {
            Block::Text(source) => self.paragraphs(source, ""),
            Block::List(items) => {
                self.text.push('\n');
                for item in items {
                    let _ = writeln!(self.text, "* {}", inline(item));
                }
            }
            Block::Links(links) => {
                self.text.push('\n');
                for link in links {
                    let (words, place) = (inline(&link.text), address(&link.address));
                    let _ = writeln!(self.text, "* [{words}]({place})");
                }
            }
            Block::Table(table) => self.table(table)?,
            Block::Plot(plot) => self.plot(plot)?,
            Block::HeatMap(map) => self.heat_map(map)?,
            Block::Details { summary, blocks } => {
                let _ = writeln!(self.text, "\n**{}**", inline(summary));
                blocks.iter().try_for_each(|block| self.block(block))?;
            }
            Block::Note { kind, text } => {
                let word = match kind {
                    NoteKind::Info => "Note",
                    NoteKind::Warning => "Attention",
                    NoteKind::Good => "Confirmed",
                    NoteKind::Fault => "Fault",
                };
                let _ = writeln!(self.text, "\n> **{word}**");
                self.paragraphs(text, "> ");
            }
            Block::Code(source) => self.code(source),
        }
        Ok(())
    }

    /// Writes paragraphs, each after an empty line. `quote` begins every line.
    fn paragraphs(&mut self, source: &str, quote: &str) {
        let clean = source.replace("\r\n", "\n");
        for paragraph in clean.split("\n\n").map(str::trim).filter(|p| !p.is_empty()) {
            let _ = writeln!(
                self.text,
                "{}\n{quote}{}",
                quote.trim_end(),
                inline(paragraph)
            );
        }
    }

    /// Writes verbatim text between fences that are longer than any run of their sign in it.
    fn code(&mut self, source: &str) {
        let clean: String = source.replace("\r\n", "\n").chars().map(visible).collect();
        let runs = clean.split(|c| c != '`').map(str::len);
        let fence = "`".repeat(runs.max().unwrap_or(0).max(2) + 1);
        let _ = writeln!(
            self.text,
            "\n{fence}text\n{}\n{fence}",
            clean.trim_end_matches('\n')
        );
    }

    fn table(&mut self, table: &Table) -> Result<(), ReportError> {
        table.check()?;
        self.tables += 1;
        let _ = writeln!(
            self.text,
            "\n**Table {}** {}\n",
            self.tables,
            inline(&table.caption)
        );
        for column in &table.columns {
            let _ = write!(self.text, "| {}", inline(&column.name));
            if let Some(unit) = &column.unit {
                let _ = write!(self.text, ", {}", inline(unit));
            }
            self.text.push(' ');
        }
        self.text.push_str("|\n");
        for column in &table.columns {
            self.text.push_str(match column.alignment {
                Alignment::Left => "| --- ",
                Alignment::Right => "| ---: ",
                Alignment::Center => "| :---: ",
            });
        }
        self.text.push_str("|\n");
        for row in &table.rows {
            for cell in row {
                let _ = write!(self.text, "| {} ", inline(cell));
            }
            self.text.push_str("|\n");
        }
        if table.rows.is_empty() {
            self.paragraphs("No rows.", "");
        }
        self.paragraphs(&table.note, "");
        Ok(())
    }

    fn plot(&mut self, plot: &Plot) -> Result<(), ReportError> {
        let Some(scene) = Scene::new(plot)? else {
            self.figure(&plot.title, None);
            self.paragraphs(&plot.note, "");
            return Ok(());
        };
        let mut notes = vec![plot.note.clone()];
        notes.extend(scene.remarks.iter().cloned());
        self.figure(&plot.title, Some(svg(plot)?));
        for note in &notes {
            self.paragraphs(note, "");
        }
        Ok(())
    }

    fn heat_map(&mut self, map: &HeatMap) -> Result<(), ReportError> {
        let picture = map.svg()?;
        self.figure(&map.title, picture);
        self.paragraphs(&map.note, "");
        Ok(())
    }

    /// Writes the title of a figure, and shows its picture if there is one.
    fn figure(&mut self, title: &str, picture: Option<String>) {
        self.numbered += 1;
        let (number, title) = (self.numbered, inline(title));
        let _ = writeln!(self.text, "\n**Figure {number}** {title}");
        match picture {
            Some(picture) => {
                let name = figure_name(self.stem, number);
                let _ = writeln!(self.text, "\n![{title}]({})", address(&name));
                self.figures.push((name, picture));
            }
            None => self.paragraphs("No value can be drawn.", ""),
        }
    }
}

/// Returns the name of the file with a figure.
pub(crate) fn figure_name(stem: &str, number: usize) -> String {
    format!("{stem}-figure-{number}.svg")
}

/// Escapes text for one line of Markdown, so that nothing in it is read as mark-up. Line breaks become spaces.
fn inline(source: &str) -> String {
    let spelled = spell_units(source);
    let words: Vec<&str> = spelled.split_whitespace().collect();
    let clean: Vec<char> = words.join(" ").chars().map(visible).collect();
    let mut out = String::with_capacity(clean.len() + 8);
    for (k, &c) in clean.iter().enumerate() {
        let beside = |at: Option<usize>| at.and_then(|at| clean.get(at)).copied();
        let is_word = |at: Option<usize>| beside(at).is_some_and(char::is_alphanumeric);
        let within_word = is_word(k.checked_sub(1)) && is_word(Some(k + 1));
        let is_markup = match c {
            '\\' | '`' | '*' | '[' | ']' | '<' | '>' | '|' | '~' | '&' | '$' | '@' => true,
            // The name of a joint or of a file often has one.
            '_' => !within_word,
            // A heading, or the line below one.
            '#' | '=' => k == 0,
            // An item of a list, or a rule; not the sign of a number.
            '+' | '-' => k == 0 && matches!(beside(Some(1)), None | Some(' ' | '-')),
            // A numbered list.
            '.' | ')' => {
                k > 0 && clean[..k].iter().all(char::is_ascii_digit) && !is_word(Some(k + 1))
            }
            // An address would become a link.
            ':' => beside(Some(k + 1)) == Some('/'),
            _ => false,
        };
        if is_markup {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
