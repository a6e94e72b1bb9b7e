//! TOML text for readers: a comment behind every value.

use std::mem;

use serde::Serialize;
use toml_edit::visit_mut::{VisitMut, visit_table_like_kv_mut};
use toml_edit::{ArrayOfTables, DocumentMut, Formatted, Item, Key, KeyMut, Table, Value};

/// Characters of a line before its comment.
const BEFORE_COMMENT: usize = 40;

/// Returns a structure as a TOML document: its structures are tables with a header, numbers have the fewest digits that
/// read back to the same number. Tables called one of `inline` stay on one line.
///
/// # Errors
/// A value that TOML does not know, like an integer beyond 63 bits.
pub fn toml_document<T: Serialize>(
    value: &T,
    inline: &[&str],
) -> Result<DocumentMut, toml_edit::ser::Error> {
    let mut document = toml_edit::ser::to_document(value)?;
    Layout { inline }.visit_document_mut(&mut document);
    Ok(document)
}

/// Returns the tables of the list called `name`; none without such a list.
pub fn toml_tables<'a>(
    document: &'a mut DocumentMut,
    name: &str,
) -> impl Iterator<Item = &'a mut Table> {
    let list = document
        .get_mut(name)
        .and_then(Item::as_array_of_tables_mut);
    list.into_iter().flat_map(ArrayOfTables::iter_mut)
}

/// Puts the keys of a table in the order of `comments`, and behind each value the comment of its key. A table in
/// `comments` is for the table, or for every table of the list, of that name.
pub fn comment_toml(table: &mut Table, comments: &Table) {
    let place = |key: &Key| comments.iter().position(|(named, _)| named == key.get());
    let last = comments.len();
    table.sort_values_by(|a, _, b, _| {
        let [a, b] = [a, b].map(|key| place(key).unwrap_or(last));
        a.cmp(&b)
    });
    for (key, item) in table.iter_mut() {
        match (item, comments.get(&key)) {
            (Item::Value(value), Some(Item::Value(Value::String(comment)))) => {
                value.decor_mut().clear();
                let width = format!("{} = {value}", key.display_repr()).chars().count();
                let gap = BEFORE_COMMENT.saturating_sub(width);
                let behind = format!("{:gap$} # {}", "", comment.value());
                value.decor_mut().set_suffix(behind);
            }
            (Item::Table(below), Some(Item::Table(comments))) => comment_toml(below, comments),
            (Item::ArrayOfTables(below), Some(Item::Table(comments))) => {
                below
                    .iter_mut()
                    .for_each(|table| comment_toml(table, comments));
            }
            _ => {}
        }
    }
}

/// Tables with headers, and short numbers.
struct Layout<'a> {
    inline: &'a [&'a str],
}

impl VisitMut for Layout<'_> {
    fn visit_table_like_kv_mut(&mut self, key: KeyMut<'_>, node: &mut Item) {
        if !self.inline.contains(&key.get()) {
            *node = match mem::take(node).into_table() {
                Ok(table) => Item::Table(table),
                Err(item) => item
                    .into_array_of_tables()
                    .map_or_else(|value| value, Item::ArrayOfTables),
            };
        }
        visit_table_like_kv_mut(self, key, node);
    }

    fn visit_float_mut(&mut self, node: &mut Formatted<f64>) {
        // The library itself writes 1e-300 with all its zeros.
        if let Ok(Value::Float(short)) = format!("{:?}", node.value()).parse() {
            *node = short;
        }
    }
}
