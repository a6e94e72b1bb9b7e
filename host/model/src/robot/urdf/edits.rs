//! Edits of a URDF file, in its own indentation.

use std::ops::Range;

use roxmltree::Document;

use super::chain::Body;
use super::reader::{Xml, child};
use super::spatial::SpatialInertia;
use super::write::{comment, inertial_element};

/// A part of the file and its replacement.
pub(super) struct Edit {
    pub(super) range: Range<usize>,
    pub(super) text: String,
}

pub(super) fn at(place: usize) -> Range<usize> {
    place..place
}

/// Returns the top-level element of that kind and name.
fn named<'a>(document: &'a Document<'a>, tag: &str, name: &str) -> Option<Xml<'a>> {
    document
        .root_element()
        .children()
        .find(|n| n.has_tag_name(tag) && n.attribute("name") == Some(name))
}

/// Returns the white space before `place` on its line; empty if other text stands there.
fn indent<'a>(document: &Document<'a>, place: usize) -> &'a str {
    let before = document.input_text().get(..place).unwrap_or_default();
    let line = &before[before.rfind('\n').map_or(0, |i| i + 1)..];
    if line.trim().is_empty() { line } else { "" }
}

/// Writes `inertia` into the link that the joint moves, and removes it from the links fixed to it. Returns the link's
/// name and a sentence on the others.
///
/// # Errors
/// The obstacle, as the rest of a sentence about the joint.
pub(super) fn put_inertia<'b>(
    document: &Document<'_>,
    body: &'b Body,
    inertia: &SpatialInertia,
    edits: &mut Vec<Edit>,
) -> Result<(&'b str, Option<String>), String> {
    let missing = || format!("moves link `{}`, which is not in the file", body.link);
    let node = named(document, "link", &body.link).ok_or_else(missing)?;
    let fixed: Vec<&str> = body
        .heavy
        .iter()
        .map(String::as_str)
        .filter(|name| *name != body.link)
        .collect();
    if let Some(own) = child(node, "inertial") {
        let text = inertial_element(inertia, indent(document, own.range().start))?;
        edits.push(Edit {
            range: own.range(),
            text,
        });
    } else {
        let outer = indent(document, node.range().start);
        let element = inertial_element(inertia, &format!("{outer}  "))?;
        edits.push(inserted(document, node, outer, &element));
    }
    for name in &fixed {
        let Some(part) = named(document, "link", name).and_then(|link| child(link, "inertial"))
        else {
            continue;
        };
        edits.push(Edit {
            range: part.range(),
            text: comment(&format!(
                "The inertia of this link is part of that of {}.",
                body.link
            )),
        });
    }
    let merged = (!fixed.is_empty()).then(|| {
        format!(
            "Only the sum of what is fixed to each other can be identified: the <inertial> of {} holds that of {} too, which {} no more.",
            body.link,
            fixed.join(", "),
            if fixed.len() == 1 { "has one" } else { "have one" }
        )
    });
    Ok((&body.link, merged))
}

/// Inserts `element` as the last child of `node`, whose line begins with `outer`.
fn inserted(document: &Document<'_>, node: Xml<'_>, outer: &str, element: &str) -> Edit {
    let range = node.range();
    let text = document.input_text().get(range.clone()).unwrap_or_default();
    if let Some(last) = node.children().rfind(Xml::is_element) {
        return Edit {
            range: at(last.range().end),
            text: format!("\n{outer}  {element}"),
        };
    }
    if let Some(head) = text.strip_suffix("/>") {
        return Edit {
            range: range.start + head.trim_end().len()..range.end,
            text: format!(
                ">\n{outer}  {element}\n{outer}</{}>",
                node.tag_name().name()
            ),
        };
    }
    Edit {
        range: at(range.start + text.rfind("</").unwrap_or(text.len())),
        text: element.to_owned(),
    }
}

/// Writes viscous and Coulomb friction into `<dynamics>` of a joint. Returns false if the file has no such joint.
pub(super) fn put_friction(
    document: &Document<'_>,
    joint: &str,
    [viscous, coulomb]: [f64; 2],
    edits: &mut Vec<Edit>,
) -> bool {
    let Some(node) = named(document, "joint", joint) else {
        return false;
    };
    let Some(dynamics) = child(node, "dynamics") else {
        let outer = indent(document, node.range().start);
        let element = format!("<dynamics damping=\"{viscous:?}\" friction=\"{coulomb:?}\"/>");
        edits.push(inserted(document, node, outer, &element));
        return true;
    };
    for (key, value) in [("damping", viscous), ("friction", coulomb)] {
        let text = format!("{value:?}");
        edits.push(match dynamics.attribute_node(key) {
            Some(attribute) => Edit {
                range: attribute.range_value(),
                text,
            },
            // Position after the name of the element.
            None => Edit {
                range: at(dynamics.range().start + "<dynamics".len()),
                text: format!(" {key}=\"{text}\""),
            },
        });
    }
    true
}

/// Returns the text with all edits. They must not overlap.
pub(super) fn spliced(text: &str, mut edits: Vec<Edit>) -> String {
    // A stable sort: insertions at one place keep their order.
    edits.sort_by_key(|edit| edit.range.start);
    let mut out =
        String::with_capacity(text.len() + edits.iter().map(|e| e.text.len()).sum::<usize>());
    let mut done = 0;
    for edit in edits {
        out.push_str(text.get(done..edit.range.start).unwrap_or_default());
        out.push_str(&edit.text);
        done = edit.range.end;
    }
    out.push_str(text.get(done..).unwrap_or_default());
    out
}

/// Writes the rotor inertia (kg·m², motor side) into the elements of the file that state it.
pub(super) fn put_rotor(places: &[Xml<'_>], inertia: f64, edits: &mut Vec<Edit>) {
    for value in places
        .iter()
        .filter_map(|node| node.attribute_node("value"))
    {
        edits.push(Edit {
            range: value.range_value(),
            text: format!("{inertia:?}"),
        });
    }
}
