//! Escapes text from outside for a page.

/// Replaces characters that a page must not contain: control characters, which XML forbids, and overrides of the
/// writing direction, with which a name could reverse its surroundings.
pub(crate) fn visible(c: char) -> char {
    match c {
        '\n' | '\t' => c,
        '\u{0}'..='\u{1f}' | '\u{7f}'..='\u{9f}' => '\u{fffd}',
        '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => '\u{fffd}',
        '\u{fffe}' | '\u{ffff}' => '\u{fffd}',
        c => c,
    }
}

/// Escapes text for HTML and SVG, in element content and in quoted attributes.
pub(crate) fn text(source: &str) -> String {
    let mut out = String::with_capacity(source.len());
    for c in source.chars().map(visible) {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// Escapes a sentence for HTML, in element content, with one spelling of units. Words between two backticks, as the sentences have commands and names
/// of a file, become code; a backtick without another stays one.
pub(crate) fn prose(source: &str) -> String {
    let spelled = rig_output::spell_units(source);
    let mut parts = spelled.split('`').map(text);
    let mut out = parts.next().unwrap_or_default();
    while let Some(code) = parts.next() {
        match parts.next() {
            Some(rest) => out += &format!("<code>{code}</code>{rest}"),
            None => out += &format!("`{code}"),
        }
    }
    out
}

/// Returns a JSON string with quotes that ends neither a script element nor a line in it.
pub(crate) fn json(source: &str) -> String {
    use std::fmt::Write;
    let mut out = String::with_capacity(source.len() + 2);
    out.push('"');
    for c in source.chars().map(visible) {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            '<' | '>' | '&' | '\'' | '\u{2028}' | '\u{2029}' => {
                // Writing into a String cannot fail.
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// Escapes a relative path as an address (RFC 3986, section 2): all bytes but letters, digits, `-`, `.`, `_`, `~` and `/`
/// become their code, so that no path is read as a scheme, a query or markup.
pub(crate) fn address(path: &str) -> String {
    use std::fmt::Write;
    let mut out = String::with_capacity(path.len());
    for byte in path.bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => {
                out.push(char::from(byte));
            }
            _ => {
                // Writing into a String cannot fail.
                let _ = write!(out, "%{byte:02X}");
            }
        }
    }
    out
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const HOSTILE: &str = "</script><script>alert('x')</script><!-- \" & \\ \u{2028}\u{202e}\u{0}";

    #[test]
    fn html_comes_out_as_text() {
        let out = text(HOSTILE);
        assert!(!out.contains(['<', '>', '"', '\'', '\u{0}', '\u{202e}']));
        let page = format!("<p title=\"{out}\">{out}</p>");
        let parsed = roxmltree::Document::parse(&page).unwrap();
        let clean = HOSTILE.replace(['\u{202e}', '\u{0}'], "\u{fffd}");
        assert_eq!(parsed.root_element().text(), Some(clean.as_str()));
        assert_eq!(
            parsed.root_element().attribute("title"),
            Some(clean.as_str())
        );
    }

    #[test]
    fn words_between_backticks_are_code_and_nothing_else_is_markup() {
        assert_eq!(
            prose("Run `rig doctor` and `<b>`."),
            "Run <code>rig doctor</code> and <code>&lt;b&gt;</code>."
        );
        assert_eq!(prose("a `b"), "a `b");
        assert_eq!(prose(""), "");
        assert_eq!(prose(HOSTILE), text(HOSTILE));
    }

    #[test]
    fn an_address_is_a_relative_path_and_nothing_else() {
        assert_eq!(address("irp6/report.html"), "irp6/report.html");
        assert_eq!(address("javascript:x"), "javascript%3Ax");
        assert_eq!(address("a \"b\"?ö"), "a%20%22b%22%3F%C3%B6");
    }

    #[test]
    fn json_comes_back_and_cannot_end_a_script() {
        let out = json(HOSTILE);
        assert!(!out.contains(['<', '>', '&', '\u{2028}']));
        let back: String = serde_json::from_str(&out).unwrap();
        assert_eq!(back, HOSTILE.replace(['\u{202e}', '\u{0}'], "\u{fffd}"));
    }
}
