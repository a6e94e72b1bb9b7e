//! A recording in pieces with margins: filters over whole recordings in constant memory.

use super::error::PrepareError;
use crate::block::{Block, append, stretch};
use crate::source::Source;

/// A source of rows in blocks that can be read repeatedly.
pub trait Recording {
    /// Calls `take` with each block in turn, from the first row on.
    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError>;
    /// Returns the recording that this one is made from; name, progress and loads are its own unless stated otherwise.
    fn source(&self) -> Option<&dyn Recording> {
        None
    }
    /// Name for messages and reports; to be given by a recording without a source.
    fn label(&self) -> String {
        self.source()
            .map_or_else(String::new, |source| source.label())
    }
    /// Called when `share` of the recording has been processed again without reading it: for progress.
    fn passed(&self, share: f64) {
        if let Some(source) = self.source() {
            source.passed(share);
        }
    }
    /// Returns true if all external loads on the joints had been removed.
    fn unburdened(&self) -> bool {
        self.source().is_some_and(|source| source.unburdened())
    }
}

/// Returns the first rows of a recording up to its first gap, at most `rows`; `None` if it is empty. Rows after them
/// are not read.
///
/// # Errors
/// Errors of the reader up to there.
pub fn first_block(recording: &dyn Recording, rows: usize) -> Result<Option<Block>, PrepareError> {
    let mut first = None;
    let read = recording.each_block(rows, &mut |block| {
        if block.is_empty() {
            return Ok(());
        }
        first = Some(block);
        Err(PrepareError::Stopped("enough".to_owned()))
    });
    match first {
        Some(block) => Ok(Some(block)),
        None => read.map(|()| None),
    }
}

/// The longest stretch without a gap among the first rows of a recording: what a short stretch holds, for example
/// torques of one sign, may be chance.
#[derive(Debug)]
pub struct LongestPart {
    longest: Block,
    part: Block,
    /// Rows that are still looked at.
    left: usize,
    more: bool,
}

impl LongestPart {
    /// Begins; looks at no more than `rows` rows.
    pub fn among(rows: usize) -> Self {
        Self {
            longest: Block::default(),
            part: Block::default(),
            left: rows,
            more: false,
        }
    }

    /// Takes the next block. Returns false if there are more rows than are looked at.
    pub fn push(&mut self, block: &Block) -> bool {
        self.more = block.len() > self.left;
        let own = stretch(block, 0, block.len().min(self.left));
        if !own.continues {
            self.close();
        }
        self.left -= own.len();
        append(&mut self.part, own);
        !self.more
    }

    fn close(&mut self) {
        let part = std::mem::take(&mut self.part);
        if part.len() > self.longest.len() {
            self.longest = part;
        }
    }

    /// Returns true if the recording has more rows than were looked at.
    pub fn more(&self) -> bool {
        self.more
    }

    /// Returns the rows; none if the recording has none.
    pub fn rows(mut self) -> Block {
        self.close();
        self.longest
    }
}

/// Returns the longest stretch without a gap among the first `rows` rows of a recording.
///
/// # Errors
/// Errors of the reader up to there.
pub fn longest_part(recording: &dyn Recording, rows: usize) -> Result<LongestPart, PrepareError> {
    let mut found = LongestPart::among(rows);
    let read = recording.each_block(rows, &mut |block| match found.push(&block) {
        true => Ok(()),
        false => Err(PrepareError::Stopped("enough".to_owned())),
    });
    if !found.more {
        read?;
    }
    Ok(found)
}

/// A recording of the rig with all external loads on its joints removed.
pub struct Unburdened<'a>(pub &'a dyn Recording);

impl Recording for Unburdened<'_> {
    fn source(&self) -> Option<&dyn Recording> {
        Some(self.0)
    }

    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        self.0.each_block(rows, take)
    }

    fn unburdened(&self) -> bool {
        true
    }
}

/// The first `rows` rows of a recording.
pub struct Beginning<'a> {
    /// The whole recording.
    pub recording: &'a dyn Recording,
    /// Number of rows.
    pub rows: usize,
}

impl Recording for Beginning<'_> {
    fn source(&self) -> Option<&dyn Recording> {
        Some(self.recording)
    }

    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        let (mut left, mut enough) = (self.rows, false);
        let read = self.recording.each_block(rows, &mut |block| {
            if block.len() < left {
                left -= block.len();
                return take(block);
            }
            take(stretch(&block, 0, left))?;
            enough = true;
            Err(PrepareError::Stopped("enough".to_owned()))
        });
        if enough { Ok(()) } else { read }
    }
}

/// A recording whose blocks are changed as they are read.
pub struct Changed<'a> {
    /// The recording.
    pub inner: &'a dyn Recording,
    /// The change of each block.
    pub change: &'a dyn Fn(&mut Block),
}

impl Recording for Changed<'_> {
    fn source(&self) -> Option<&dyn Recording> {
        Some(self.inner)
    }

    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        self.inner.each_block(rows, &mut |mut block| {
            (self.change)(&mut block);
            take(block)
        })
    }
}

/// A recording held in memory.
#[derive(Clone, Debug, Default)]
pub struct InMemory {
    /// Name for messages.
    pub label: String,
    /// Its rows.
    pub blocks: Vec<Block>,
}

impl Recording for InMemory {
    fn label(&self) -> String {
        self.label.clone()
    }
    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        for block in &self.blocks {
            for start in (0..block.len()).step_by(rows.max(1)) {
                let end = start.saturating_add(rows.max(1)).min(block.len());
                take(stretch(block, start, end))?;
            }
        }
        Ok(())
    }
}

impl Recording for Source {
    fn label(&self) -> String {
        self.path().display().to_string()
    }
    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        for block in self.blocks(rows) {
            take(block.map_err(|e| PrepareError::Read(e.to_string()))?)?;
        }
        Ok(())
    }
}

/// Rows that are processed together, and the range of those to be used.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The rows with margins on both sides (no margin where the segment ends).
    pub rows: Block,
    /// First row to be used.
    pub core_start: usize,
    /// One past the last row to be used.
    pub core_end: usize,
    /// Index of the first row of `rows` within its segment.
    pub offset: u64,
    /// Number of the stretch (between gaps in time), from zero.
    pub segment: usize,
    /// True where `rows` starts and ends with the segment.
    pub at_ends: [bool; 2],
}

fn drop_front(block: &mut Block, rows: usize) {
    block.first_line = block.line(rows);
    block.interpolated.retain(|row| *row >= rows);
    block.interpolated.iter_mut().for_each(|row| *row -= rows);
    block.t.drain(..rows);
    for joint in &mut block.joints {
        joint.q.drain(..rows);
        joint.tau.drain(..rows);
        for column in [
            &mut joint.qd,
            &mut joint.qdd,
            &mut joint.reference,
            &mut joint.voltage,
            &mut joint.temperature,
            &mut joint.link,
            &mut joint.effects,
        ]
        .into_iter()
        .flatten()
        {
            column.drain(..rows);
        }
    }
    for (_, column) in &mut block.extra {
        column.drain(..rows);
    }
}

/// Calls `take` with pieces of `core` rows and `margin` rows on each side, in order. A segment that fits into one piece
/// is one piece. Holds at most `2·(core + 2·margin)` rows.
pub fn each_piece(
    recording: &dyn Recording,
    core: usize,
    margin: usize,
    take: &mut dyn FnMut(Piece) -> Result<(), PrepareError>,
) -> Result<(), PrepareError> {
    let mut buffer = Block::default();
    let mut offset = 0u64;
    let mut done = 0usize;
    let mut segment = 0usize;
    let mut started = false;
    let flush = |buffer: &mut Block,
                 offset: &mut u64,
                 done: &mut usize,
                 segment: usize,
                 take: &mut dyn FnMut(Piece) -> Result<(), PrepareError>| {
        if !buffer.is_empty() {
            let piece = Piece {
                core_start: *done,
                core_end: buffer.len(),
                rows: std::mem::take(buffer),
                offset: *offset,
                segment,
                at_ends: [*offset == 0, true],
            };
            take(piece)?;
        }
        *buffer = Block::default();
        (*offset, *done) = (0, 0);
        Ok::<(), PrepareError>(())
    };
    recording.each_block(core.min(1 << 16), &mut |block| {
        if block.is_empty() {
            return Ok(());
        }
        if started && !block.continues {
            flush(&mut buffer, &mut offset, &mut done, segment, take)?;
            segment += 1;
        }
        started = true;
        append(&mut buffer, block);
        // Twice the margin: the last piece then always has rows beyond its margin.
        while buffer.len() >= done + core + 2 * margin {
            let piece_len = done + core + margin;
            let piece = Piece {
                core_start: done,
                core_end: done + core,
                rows: stretch(&buffer, 0, piece_len),
                offset,
                segment,
                at_ends: [offset == 0, false],
            };
            take(piece)?;
            let drop = (done + core).saturating_sub(margin);
            drop_front(&mut buffer, drop);
            done = done + core - drop;
            offset += drop as u64;
        }
        Ok(())
    })?;
    flush(&mut buffer, &mut offset, &mut done, segment, take)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Returns an empty block and then these blocks, then fails.
    struct Broken(Vec<Block>);

    impl Recording for Broken {
        fn label(&self) -> String {
            "broken".into()
        }
        fn each_block(
            &self,
            _: usize,
            take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
        ) -> Result<(), PrepareError> {
            take(Block::default())?;
            self.0.iter().try_for_each(|block| take(block.clone()))?;
            Err(PrepareError::Read("line 9 is no number".into()))
        }
    }

    #[test]
    fn the_longest_part_is_judged_wherever_it_is() {
        let block = |from: usize, to: usize, continues: bool| Block {
            t: (from..to).map(|k| k as f64).collect(),
            continues,
            ..Block::default()
        };
        let parts = [
            block(0, 3, false),
            block(10, 14, false),
            block(14, 18, true),
            block(30, 35, false),
        ];
        let recording = InMemory {
            blocks: parts.to_vec(),
            ..InMemory::default()
        };
        let found = longest_part(&recording, 100).unwrap();
        assert!(!found.more());
        let times: Vec<f64> = (10..18).map(f64::from).collect();
        assert_eq!(found.rows().t, times);
        let found = longest_part(&recording, 5).unwrap();
        assert!(found.more());
        assert_eq!(found.rows().t, [0.0, 1.0, 2.0]);
        let none = longest_part(&InMemory::default(), 5).unwrap();
        assert!(none.rows().is_empty());
    }

    #[test]
    fn for_its_first_rows_no_more_of_a_recording_is_read() {
        let block = |t: f64| Block {
            t: vec![t, t + 1.0],
            ..Block::default()
        };
        let broken = Broken(vec![block(0.0), block(2.0)]);
        assert_eq!(first_block(&broken, 100).unwrap(), Some(block(0.0)));
        assert!(matches!(
            first_block(&Broken(Vec::new()), 100),
            Err(PrepareError::Read(_))
        ));
        assert_eq!(first_block(&InMemory::default(), 100).unwrap(), None);
    }
}
