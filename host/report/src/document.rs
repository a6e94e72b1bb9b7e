//! What a document is made of, before anyone thinks of HTML.

use super::plot::Plot;

/// A whole document: one page that can be read, printed and passed on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document {
    /// The one heading of the page.
    pub title: String,
    /// One sentence below the title.
    pub subtitle: String,
    /// The answer before the explanation: verdict and key figures, shown as cards.
    pub summary: Vec<Fact>,
    /// The chapters in reading order; their titles make the table of contents.
    pub sections: Vec<Section>,
    /// Closing line: version and command that made the document. May be empty.
    pub footer: String,
}

/// How a fact or note is to be taken; shown by a word or mark as well as by colour.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub enum Tone {
    /// Neither good nor bad.
    #[default]
    Plain,
    /// As it should be.
    Good,
    /// News that is neither good nor bad, to be seen at once.
    Notice,
    /// Needs the reader's attention.
    Warning,
    /// Nothing can be concluded before it is mended.
    Fault,
}

/// One key figure of the summary.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fact {
    /// What it is.
    pub label: String,
    /// The value as it is to be read; see [`rig_output::format_value`].
    pub value: String,
    /// Unit, where the value has one.
    pub unit: Option<String>,
    /// One line on how to read it. May be empty.
    pub note: String,
    /// Whether it is good news.
    pub tone: Tone,
}

impl Fact {
    /// A neutral fact without unit or note.
    pub fn new(label: impl Into<String>, value: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            value: value.into(),
            ..Self::default()
        }
    }

    /// With the unit of its value.
    #[must_use]
    pub fn unit(mut self, unit: impl Into<String>) -> Self {
        self.unit = Some(unit.into());
        self
    }

    /// With one line on how to read it.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Marked as good news or as a warning.
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
    /// The paragraph that says what the chapter shows. May be empty.
    pub lead: String,
    /// Contents in order.
    pub blocks: Vec<Block>,
}

impl Section {
    /// An empty chapter.
    pub fn new(id: impl Into<String>, title: impl Into<String>, lead: impl Into<String>) -> Self {
        Self {
            id: id.into(),
            title: title.into(),
            lead: lead.into(),
            blocks: Vec::new(),
        }
    }

    /// With one more block at its end.
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
    /// Limits what may be concluded.
    Warning,
    /// Confirmed.
    Good,
    /// Nothing can be concluded before it is mended.
    Fault,
}

/// One piece of a section.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// Plain text; an empty line separates paragraphs.
    Text(String),
    /// Items of equal rank.
    List(Vec<String>),
    /// A table.
    Table(Table),
    /// A figure.
    Plot(Plot),
    /// Blocks behind a line that unfolds them; on paper always unfolded.
    Details {
        /// The line that stays visible.
        summary: String,
        /// What unfolds.
        blocks: Vec<Block>,
    },
    /// A remark that stands out.
    Note {
        /// What sort of remark.
        kind: NoteKind,
        /// Its text.
        text: String,
    },
    /// Verbatim text: a command, a file.
    Code(String),
}

/// Which side the cells of a column keep to.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub enum Alignment {
    /// Words.
    #[default]
    Left,
    /// Numbers, so that digits of equal worth stand below each other.
    Right,
    /// Marks.
    Center,
}

/// Head of a table column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Column {
    /// What stands in the column.
    pub name: String,
    /// Unit of every number in the column.
    pub unit: Option<String>,
    /// Alignment of head and cells.
    pub alignment: Alignment,
}

impl Column {
    /// A column of words.
    pub fn text(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            ..Self::default()
        }
    }

    /// A column of numbers; an empty unit means that they have none.
    pub fn number(name: impl Into<String>, unit: &str) -> Self {
        Self {
            name: name.into(),
            unit: (!unit.is_empty()).then(|| unit.to_owned()),
            alignment: Alignment::Right,
        }
    }
}

/// A table: the first cell of a row names the row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// What the table shows.
    pub caption: String,
    /// Column heads.
    pub columns: Vec<Column>,
    /// Cells, one inner vector a row, as long as `columns`.
    pub rows: Vec<Vec<String>>,
    /// What is to be known for reading it. May be empty.
    pub note: String,
}
