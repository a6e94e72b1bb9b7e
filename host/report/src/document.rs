//! Content of a document, independent of HTML.

use super::error::ReportError;
use super::heat_map::HeatMap;
use super::plot::Plot;

/// A whole document: one page to read, print and share.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document {
    /// Heading of the page.
    pub title: String,
    /// One sentence below the title.
    pub subtitle: String,
    /// Results before their explanation: verdict and key figures, shown as cards.
    pub summary: Vec<Fact>,
    /// Chapters in reading order; their titles form the table of contents.
    pub sections: Vec<Section>,
    /// Footer: version and command that created the document. May be empty.
    pub footer: String,
}

/// Rating of a fact or note, shown by a word or mark as well as by colour.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub enum Tone {
    /// Neither good nor bad.
    #[default]
    Plain,
    /// As expected.
    Good,
    /// Neutral, but important.
    Notice,
    /// Needs the reader's attention.
    Warning,
    /// Must be corrected before any conclusion.
    Fault,
}

/// One key figure of the summary.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fact {
    /// Name of the figure.
    pub label: String,
    /// Value as text; see [`rig_output::format_value`].
    pub value: String,
    /// Unit, if the value has one.
    pub unit: Option<String>,
    /// One line of explanation. May be empty.
    pub note: String,
    /// Rating.
    pub tone: Tone,
}

impl Fact {
    /// Creates a neutral fact without unit or note.
    pub fn new(label: impl Into<String>, value: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            value: value.into(),
            ..Self::default()
        }
    }

    /// Sets the unit of the value.
    #[must_use]
    pub fn unit(mut self, unit: impl Into<String>) -> Self {
        self.unit = Some(unit.into());
        self
    }

    /// Sets the line of explanation.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Sets the rating.
    #[must_use]
    pub fn tone(mut self, tone: Tone) -> Self {
        self.tone = tone;
        self
    }
}

/// A chapter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// Anchor, unique in the document: letters, digits, `-` and `_`, starting with a letter.
    pub id: String,
    /// Heading.
    pub title: String,
    /// Introductory paragraph. May be empty.
    pub lead: String,
    /// Contents in order.
    pub blocks: Vec<Block>,
}

impl Section {
    /// Creates an empty chapter.
    pub fn new(id: impl Into<String>, title: impl Into<String>, lead: impl Into<String>) -> Self {
        Self {
            id: id.into(),
            title: title.into(),
            lead: lead.into(),
            blocks: Vec::new(),
        }
    }

    /// Appends a block.
    #[must_use]
    pub fn with(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }
}

/// Kind of a [`Block::Note`].
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum NoteKind {
    /// Worth knowing.
    Info,
    /// Limits the possible conclusions.
    Warning,
    /// Confirmed.
    Good,
    /// Must be corrected before any conclusion.
    Fault,
}

/// A link to another file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Link {
    /// Visible text.
    pub text: String,
    /// Path of the file, relative to the folder of the page.
    pub address: String,
}

/// One piece of a section.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// Plain text; an empty line separates paragraphs.
    Text(String),
    /// Items of equal rank.
    List(Vec<String>),
    /// Links to other files, one below the other.
    Links(Vec<Link>),
    /// A table.
    Table(Table),
    /// A figure.
    Plot(Plot),
    /// A value over two quantities, as a coloured picture.
    HeatMap(HeatMap),
    /// Blocks that unfold on a click; in print always unfolded.
    Details {
        /// The line that stays visible.
        summary: String,
        /// The blocks that unfold.
        blocks: Vec<Block>,
    },
    /// A highlighted remark.
    Note {
        /// Kind of the remark.
        kind: NoteKind,
        /// Its text.
        text: String,
    },
    /// Verbatim text: a command, a file.
    Code(String),
}

/// Horizontal alignment of the cells of a column.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub enum Alignment {
    /// Words.
    #[default]
    Left,
    /// Numbers, so that digits of equal value align.
    Right,
    /// Marks.
    Center,
}

/// Head of a table column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Column {
    /// Content of the column.
    pub name: String,
    /// Unit of every number in the column.
    pub unit: Option<String>,
    /// Alignment of head and cells.
    pub alignment: Alignment,
}

impl Column {
    /// Creates a column of words.
    pub fn text(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            ..Self::default()
        }
    }

    /// Creates a column of numbers; an empty unit means no unit.
    pub fn number(name: impl Into<String>, unit: &str) -> Self {
        Self {
            name: name.into(),
            unit: (!unit.is_empty()).then(|| unit.to_owned()),
            alignment: Alignment::Right,
        }
    }
}

/// A table; the first cell of a row names the row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Content of the table.
    pub caption: String,
    /// Column heads.
    pub columns: Vec<Column>,
    /// Cells: one inner vector per row, as long as `columns`.
    pub rows: Vec<Vec<String>>,
    /// Explanation for the reader. May be empty.
    pub note: String,
}

impl Table {
    /// Checks that each row has a cell for each column.
    ///
    /// # Errors
    /// [`ReportError::Row`] with the first that has not.
    pub(crate) fn check(&self) -> Result<(), ReportError> {
        let columns = self.columns.len();
        let wrong = (self.rows.iter().enumerate()).find(|(_, row)| row.len() != columns);
        wrong.map_or(Ok(()), |(k, row)| {
            Err(ReportError::Row {
                table: self.caption.clone(),
                row: k + 1,
                cells: row.len(),
                columns,
            })
        })
    }
}
