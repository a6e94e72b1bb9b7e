//! What the footer of a Parquet file declares, before it is believed: the crate that reads the footer calls itself once a level
//! of the schema and takes memory for as many children as an element says it has (`parquet` 59.3), so that a file of a few
//! kilobytes could end the program.
//!
//! Format: Apache Thrift, "Thrift Compact protocol encoding"; parquet.thrift of Apache Parquet 2.11.

/// Deepest schema; recordings have a depth of 4 at most.
const DEEPEST: usize = 64;

/// Deepest nesting of Thrift values; those of a footer have a depth of 8 at most.
const NESTED: usize = 16;

/// Types of the protocol.
const BINARY: u8 = 8;
const STRUCT: u8 = 12;

/// Place in the bytes of a footer.
struct Reader<'a> {
    rest: &'a [u8],
}

/// Returns true if the schema is a tree of at most [`DEEPEST`] levels whose elements are all there.
pub(super) fn is_tree(footer: &[u8]) -> bool {
    let mut reader = Reader { rest: footer };
    let mut children = Vec::new();
    let read = reader.structure(|r, field, kind| {
        if field != 2 {
            return r.skip(kind, 0);
        }
        let (of, count) = r.list()?;
        for _ in 0..count {
            if of != STRUCT {
                return None;
            }
            children.push(r.children()?);
        }
        Some(())
    });
    read.is_some() && is_tree_of(&children)
}

/// Returns true if elements with so many children, each followed by its children, form a tree.
fn is_tree_of(children: &[usize]) -> bool {
    // Children that are still to come in each element that is open.
    let mut open = vec![1_usize];
    for count in children {
        let Some(left) = open.last_mut().and_then(|own| own.checked_sub(1)) else {
            return false;
        };
        if let Some(own) = open.last_mut() {
            *own = left;
        }
        if *count > children.len() {
            return false;
        }
        open.push(*count);
        while open.last() == Some(&0) {
            open.pop();
        }
        if open.len() > DEEPEST {
            return false;
        }
    }
    open.is_empty()
}

impl Reader<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.rest.split_first()?;
        self.rest = rest;
        Some(*first)
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }

    fn pass(&mut self, bytes: u64) -> Option<()> {
        self.rest = self.rest.get(usize::try_from(bytes).ok()?..)?;
        Some(())
    }

    /// Reads the type and the number of elements of a list, which have a byte each at least.
    fn list(&mut self) -> Option<(u8, u64)> {
        let head = self.byte()?;
        let count = match head >> 4 {
            15 => self.varint()?,
            short => u64::from(short),
        };
        (count <= self.rest.len() as u64).then_some((head & 15, count))
    }

    /// Reads a structure; `each` takes the number and the type of a field and reads it.
    fn structure(&mut self, mut each: impl FnMut(&mut Self, i64, u8) -> Option<()>) -> Option<()> {
        let mut field = 0;
        loop {
            let head = self.byte()?;
            if head == 0 {
                return Some(());
            }
            field = match head >> 4 {
                0 => self.whole()?,
                step => field + i64::from(step),
            };
            each(self, field, head & 15)?;
        }
    }

    /// Reads a whole number.
    fn whole(&mut self) -> Option<i64> {
        let bits = self.varint()?;
        Some((bits >> 1).cast_signed() ^ -(bits & 1).cast_signed())
    }

    /// Reads an element of the schema; returns how many children it has.
    fn children(&mut self) -> Option<usize> {
        let mut children = 0;
        self.structure(|r, field, kind| match (field, kind) {
            (5, 4..=6) => {
                children = usize::try_from(r.whole()?).ok()?;
                Some(())
            }
            _ => r.skip(kind, 0),
        })?;
        Some(children)
    }

    /// Passes a value.
    fn skip(&mut self, kind: u8, depth: usize) -> Option<()> {
        if depth > NESTED {
            return None;
        }
        match kind {
            // Truth values of a structure are in their type.
            1 | 2 => Some(()),
            3 => self.pass(1),
            4..=6 => self.varint().map(drop),
            7 => self.pass(8),
            BINARY => {
                let length = self.varint()?;
                self.pass(length)
            }
            9 | 10 => {
                let (of, count) = self.list()?;
                for _ in 0..count {
                    match of {
                        1 | 2 => self.pass(1)?,
                        _ => self.skip(of, depth + 1)?,
                    }
                }
                Some(())
            }
            STRUCT => self.structure(|r, _, kind| r.skip(kind, depth + 1)),
            // A footer has no maps.
            _ => None,
        }
    }
}
