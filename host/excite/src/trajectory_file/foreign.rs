//! Recognises files that are given as the parameters of a motion and hold something else.

/// First bytes of an MCAP file (MCAP specification, "Magic").
const MCAP: &[u8] = b"\x89MCAP0\r\n";

/// Returns what a file holds instead of the parameters of a motion, by its beginning; `None` if it may hold them.
pub(super) fn foreign(beginning: &[u8]) -> Option<&'static str> {
    if beginning.starts_with(MCAP) {
        return Some("a recording (MCAP)");
    }
    let text = String::from_utf8_lossy(beginning);
    let text = text.trim_start_matches('\u{feff}');
    let first =
        (text.lines().map(str::trim)).find(|line| !line.is_empty() && !line.starts_with('#'))?;
    if first.starts_with('<') {
        return Some("XML, as a URDF does");
    }
    // A key, a table and a string of TOML have one of these characters before the first comma.
    let (head, _) = first.split_once([',', ';', '\t'])?;
    (!head.contains(['=', '[', '{', '"'])).then_some("samples in columns (CSV)")
}

/// Returns true if a TOML text describes a robot: no trajectory has these keys.
pub(super) fn is_robot(text: &str) -> bool {
    let Ok(table) = text.parse::<toml::Table>() else {
        return false;
    };
    let joints = table.get("joint").and_then(toml::Value::as_array);
    let mut joints = joints.into_iter().flatten();
    table.contains_key("gravity")
        || joints.any(|joint| joint.get("kind").is_some() && joint.get("trajectory").is_none())
}
