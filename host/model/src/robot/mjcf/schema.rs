//! Elements and attributes that MuJoCo knows.

use std::collections::HashMap;

use roxmltree::{Document, Node};

/// Lines "parent/element: attributes", as MuJoCo 3.3.0, 3.3.7 and 4.0.0 print them; written by `tests/mjcf/schema.py`.
const SCHEMA: &str = include_str!("schema.txt");

/// Returns the first element that MuJoCo does not know, or that has an attribute that MuJoCo does not know, and a sentence
/// about it: a misspelt name would otherwise be lost.
pub(super) fn unknown<'a>(document: &'a Document<'a>) -> Option<(Node<'a, 'a>, String)> {
    let known: HashMap<&str, Vec<&str>> = (SCHEMA.lines())
        .filter_map(|line| line.split_once(':'))
        .map(|(element, names)| (element, names.split_whitespace().collect()))
        .collect();
    let elements = document.descendants().filter(Node::is_element);
    elements.into_iter().find_map(|node| {
        let tag = node.tag_name().name();
        let parent = node.parent_element().map_or("", |p| p.tag_name().name());
        let is_body = ["worldbody", "frame"].contains(&parent);
        let place = format!("{}/{tag}", if is_body { "body" } else { parent });
        let Some(names) = known.get(place.as_str()) else {
            return Some((node, format!("MuJoCo knows no <{tag}> in <{parent}>")));
        };
        if parent == "worldbody" && ["joint", "freejoint", "inertial"].contains(&tag) {
            let message =
                format!("<{tag}> is in <worldbody>, which does not move; put it in a <body>");
            return Some((node, message));
        }
        let odd = node.attributes().find(|own| !names.contains(&own.name()))?;
        let list = match names.is_empty() {
            true => "it has none".to_owned(),
            false => format!("its attributes are {}", names.join(", ")),
        };
        Some((
            node,
            format!(
                "MuJoCo knows no attribute `{}` of <{tag}>; {list}",
                odd.name()
            ),
        ))
    })
}
