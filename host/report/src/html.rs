//! A document as one self-contained HTML page.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::assets::{PLOT_LICENCE, PLOT_SCRIPT, PLOT_STYLE, THEME, palette};
use super::document::{Alignment, Block, Document, Fact, Link, NoteKind, Section, Table, Tone};
use super::error::ReportError;
use super::escape::{address, prose, text};
use super::heat_map::HeatMap;
use super::plot::Plot;
use super::scene::Scene;
use super::svg;

const STYLE: &str = include_str!("../assets/report.css");
const SCRIPT: &str = include_str!("../assets/report.js");

/// Returns the page of a document. The same document gives the same bytes.
///
/// # Errors
/// [`ReportError`] if the rows of a table, the series of a plot or the ids of the sections are inconsistent.
pub fn render(document: &Document) -> Result<String, ReportError> {
    check_ids(&document.sections)?;
    let mut page = Page::default();
    for section in &document.sections {
        page.section(section)?;
    }
    let mut out = String::with_capacity(page.body.len() + 120_000);
    // Writing into a String cannot fail: the results of `write!` in this file are ignored on purpose.
    let _ = writeln!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
         style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n\
         <title>{}</title>\n<style>\n{}{THEME}{STYLE}</style>",
        text(&document.title),
        palette()
    );
    if page.plots > 0 {
        let _ = writeln!(out, "<style>{PLOT_STYLE}</style>");
    }
    out.push_str("</head>\n<body>\n");
    out.push_str("<a class=\"skip\" href=\"#contents\">Skip to the contents</a>\n");
    header(&mut out, document);
    out.push_str("<div class=\"page\">\n");
    contents(&mut out, &document.sections);
    out.push_str("<main id=\"contents\">\n");
    out.push_str(&page.body);
    out.push_str("</main>\n</div>\n");
    if !document.footer.is_empty() {
        let _ = writeln!(out, "<footer><p>{}</p></footer>", prose(&document.footer));
    }
    if page.plots > 0 {
        let _ = writeln!(
            out,
            "<script>\n/*\n{}\n*/\n{PLOT_SCRIPT}</script>",
            PLOT_LICENCE.trim()
        );
    }
    let _ = writeln!(out, "<script>\n{SCRIPT}</script>\n</body>\n</html>");
    Ok(out)
}

fn check_ids(sections: &[Section]) -> Result<(), ReportError> {
    let mut seen = BTreeSet::new();
    for section in sections {
        let id = section.id.as_str();
        let formed = id.starts_with(|c: char| c.is_ascii_alphabetic())
            && id
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
        // These ids are reserved for the page.
        let own = id == "contents" || id.starts_with("figure-");
        if !formed || own || !seen.insert(id) {
            return Err(ReportError::SectionId { id: id.to_owned() });
        }
    }
    Ok(())
}

fn header(out: &mut String, document: &Document) {
    let _ = writeln!(
        out,
        "<header class=\"top\"><div class=\"wrap\">\n<h1>{}</h1>",
        text(&document.title)
    );
    if !document.subtitle.is_empty() {
        let _ = writeln!(
            out,
            "<p class=\"subtitle\">{}</p>",
            text(&document.subtitle)
        );
    }
    if !document.summary.is_empty() {
        out.push_str("<dl class=\"facts\">\n");
        for fact in &document.summary {
            card(out, fact);
        }
        out.push_str("</dl>\n");
    }
    out.push_str("</div></header>\n");
}

fn card(out: &mut String, fact: &Fact) {
    let (class, mark) = match fact.tone {
        Tone::Plain => ("plain", ""),
        Tone::Good => (
            "good",
            "<span class=\"mark\" role=\"img\" aria-label=\"good\">✓</span> ",
        ),
        Tone::Notice => (
            "notice",
            "<span class=\"mark\" role=\"img\" aria-label=\"notice\">i</span> ",
        ),
        Tone::Fault => (
            "fault",
            "<span class=\"mark\" role=\"img\" aria-label=\"fault\">✕</span> ",
        ),
        Tone::Warning => (
            "warning",
            "<span class=\"mark\" role=\"img\" aria-label=\"attention\">!</span> ",
        ),
    };
    let _ = write!(
        out,
        "<div class=\"fact {class}\"><dt>{mark}{}</dt><dd><span class=\"value\">{}</span>",
        text(&fact.label),
        text(&fact.value)
    );
    if let Some(unit) = &fact.unit {
        let _ = write!(out, " <span class=\"unit\">{}</span>", text(unit));
    }
    if !fact.note.is_empty() {
        let _ = write!(
            out,
            "<span class=\"fact-note\">{}</span>",
            prose(&fact.note)
        );
    }
    out.push_str("</dd></div>\n");
}

fn contents(out: &mut String, sections: &[Section]) {
    out.push_str("<nav class=\"toc\" aria-label=\"Contents\">");
    if sections.len() > 1 {
        out.push_str("<p>Contents</p>\n<ol>\n");
        for section in sections {
            let _ = writeln!(
                out,
                "<li><a href=\"#{}\">{}</a></li>",
                section.id,
                text(&section.title)
            );
        }
        out.push_str("</ol>");
    }
    out.push_str("</nav>\n");
}

/// The body under construction, with the counters of figures and tables.
#[derive(Default)]
struct Page {
    body: String,
    figures: usize,
    tables: usize,
    /// Number of zoomable figures.
    plots: usize,
}

impl Page {
    fn section(&mut self, section: &Section) -> Result<(), ReportError> {
        let _ = writeln!(
            self.body,
            "<section id=\"{0}\" aria-labelledby=\"{0}-title\">\n<h2 id=\"{0}-title\">{1}</h2>",
            section.id,
            text(&section.title)
        );
        if !section.lead.is_empty() {
            let _ = writeln!(self.body, "<p class=\"lead\">{}</p>", prose(&section.lead));
        }
        for block in &section.blocks {
            self.block(block)?;
        }
        self.body.push_str("</section>\n");
        Ok(())
    }

    fn block(&mut self, block: &Block) -> Result<(), ReportError> {
        match block {
            Block::Text(source) => self.paragraphs(source),
            Block::List(items) => {
                self.body.push_str("<ul>\n");
                for item in items {
                    let _ = writeln!(self.body, "<li>{}</li>", prose(item));
                }
                self.body.push_str("</ul>\n");
            }
            Block::Links(links) => self.links(links),
            Block::Table(table) => self.table(table)?,
            Block::Plot(plot) => self.plot(plot)?,
            Block::HeatMap(map) => self.heat_map(map)?,
            Block::Details { summary, blocks } => {
                let _ = writeln!(
                    self.body,
                    "<details><summary>{}</summary>\n<div class=\"inside\">",
                    prose(summary)
                );
                for block in blocks {
                    self.block(block)?;
                }
                self.body.push_str("</div></details>\n");
            }
            Block::Note { kind, text: words } => {
                let (class, word) = match kind {
                    NoteKind::Info => ("info", "Note"),
                    NoteKind::Warning => ("warning", "Attention"),
                    NoteKind::Good => ("good", "Confirmed"),
                    NoteKind::Fault => ("fault", "Fault"),
                };
                let _ = writeln!(
                    self.body,
                    "<aside class=\"note {class}\"><strong>{word}</strong>"
                );
                self.paragraphs(words);
                self.body.push_str("</aside>\n");
            }
            Block::Code(source) => {
                let _ = writeln!(
                    self.body,
                    "<pre tabindex=\"0\"><code>{}</code></pre>",
                    text(source)
                );
            }
        }
        Ok(())
    }

    fn links(&mut self, links: &[Link]) {
        self.body.push_str("<ul>\n");
        for link in links {
            let _ = writeln!(
                self.body,
                "<li><a href=\"{}\">{}</a></li>",
                address(&link.address),
                text(&link.text)
            );
        }
        self.body.push_str("</ul>\n");
    }

    fn paragraphs(&mut self, source: &str) {
        let clean = source.replace("\r\n", "\n");
        for paragraph in clean.split("\n\n").map(str::trim).filter(|p| !p.is_empty()) {
            let _ = writeln!(self.body, "<p>{}</p>", prose(paragraph));
        }
    }

    fn table(&mut self, table: &Table) -> Result<(), ReportError> {
        table.check()?;
        self.tables += 1;
        let number = self.tables;
        let class = |alignment: Alignment| match alignment {
            Alignment::Left => "l",
            Alignment::Right => "r",
            Alignment::Center => "c",
        };
        let _ = write!(
            self.body,
            "<div class=\"table\" role=\"region\" aria-label=\"Table {number}\" tabindex=\"0\"><table>\n\
             <caption><span><b>Table {number}</b> {}</span></caption>\n<thead><tr>",
            text(&table.caption)
        );
        for column in &table.columns {
            let _ = write!(
                self.body,
                "<th scope=\"col\" class=\"{}\">{}",
                class(column.alignment),
                text(&column.name)
            );
            if let Some(unit) = &column.unit {
                let _ = write!(self.body, " <span class=\"unit\">{}</span>", text(unit));
            }
            self.body.push_str("</th>");
        }
        self.body.push_str("</tr></thead>\n<tbody>\n");
        for row in &table.rows {
            self.body.push_str("<tr>");
            for (k, (cell, column)) in row.iter().zip(&table.columns).enumerate() {
                let (open, close) = if k == 0 {
                    ("th scope=\"row\"", "th")
                } else {
                    ("td", "td")
                };
                let _ = write!(
                    self.body,
                    "<{open} class=\"{}\">{}</{close}>",
                    class(column.alignment),
                    prose(cell)
                );
            }
            self.body.push_str("</tr>\n");
        }
        self.body.push_str("</tbody></table></div>\n");
        if table.rows.is_empty() {
            self.body.push_str("<p class=\"table-note\">No rows.</p>\n");
        }
        if !table.note.is_empty() {
            let _ = writeln!(
                self.body,
                "<p class=\"table-note\">{}</p>",
                prose(&table.note)
            );
        }
        Ok(())
    }

    fn heat_map(&mut self, map: &HeatMap) -> Result<(), ReportError> {
        let picture = map.svg()?;
        self.figures += 1;
        let id = format!("figure-{}", self.figures);
        let _ = writeln!(
            self.body,
            "<figure id=\"{id}\" aria-labelledby=\"{id}-title\">\n\
             <div class=\"figure-head\"><p class=\"figure-title\" id=\"{id}-title\"><b>Figure {}</b> {}</p></div>",
            self.figures,
            text(&map.title)
        );
        match picture {
            // Outside of the class "static", which the zoomable figures replace.
            Some(picture) => _ = writeln!(self.body, "<div class=\"heat-map\">{picture}</div>"),
            None => self
                .body
                .push_str("<p class=\"empty\">No value can be drawn.</p>\n"),
        }
        if !map.note.is_empty() {
            let _ = writeln!(
                self.body,
                "<figcaption><p>{}</p></figcaption>",
                prose(&map.note)
            );
        }
        self.body.push_str("</figure>\n");
        Ok(())
    }

    fn plot(&mut self, plot: &Plot) -> Result<(), ReportError> {
        let scene = Scene::new(plot)?;
        self.figures += 1;
        let number = self.figures;
        let id = format!("figure-{number}");
        let _ = writeln!(
            self.body,
            "<figure id=\"{id}\" aria-labelledby=\"{id}-title\">\n\
             <div class=\"figure-head\"><p class=\"figure-title\" id=\"{id}-title\"><b>Figure {number}</b> {}</p></div>",
            text(&plot.title)
        );
        let mut notes = Vec::new();
        match &scene {
            None => {
                let why = if plot.series.iter().all(|s| s.x.is_empty()) {
                    "There are no samples to draw here."
                } else {
                    "None of the samples can be drawn: they have no value, or none above zero, as a logarithmic axis needs."
                };
                let _ = writeln!(self.body, "<p class=\"empty\">{why}</p>");
            }
            Some(scene) => {
                self.plots += 1;
                self.legend(scene);
                let _ = writeln!(
                    self.body,
                    "<div class=\"static\">{}</div>\n<div class=\"live\" tabindex=\"0\" role=\"img\" aria-label=\"{}\"></div>\n\
                     <script type=\"application/json\" class=\"data\">{}</script>",
                    svg::inline(scene, &id),
                    text(&scene.description()),
                    scene.json()
                );
                notes.extend(scene.remarks.iter().cloned());
            }
        }
        if !plot.note.is_empty() {
            notes.insert(0, plot.note.clone());
        }
        if !notes.is_empty() {
            self.body.push_str("<figcaption>");
            for note in &notes {
                let _ = write!(self.body, "<p>{}</p>", prose(note));
            }
            self.body.push_str("</figcaption>\n");
        }
        self.body.push_str("</figure>\n");
        Ok(())
    }

    fn legend(&mut self, scene: &Scene<'_>) {
        self.body.push_str("<ul class=\"legend\">");
        for series in &scene.series {
            let colour = format!("var(--{})", series.role.name());
            let _ = write!(
                self.body,
                "<li><svg class=\"swatch\" viewBox=\"-1 -7 24 14\" width=\"24\" height=\"14\" aria-hidden=\"true\">{}</svg>\
                 <span class=\"name\">{}</span><span class=\"v\"></span></li>",
                svg::swatch(series.shape, series.dashed, &colour, 0.0, 0.0),
                text(series.name)
            );
        }
        self.body.push_str("</ul>\n");
    }
}
