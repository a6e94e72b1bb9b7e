//! Messages of the TOML reader as sentences that name the key.

/// Says which key holds a list of a wrong length, and which length is right.
pub(super) fn of_wrong_length(error: &toml::de::Error, text: &str) -> String {
    let message = error.message().trim();
    let key = error.span().and_then(|span| key_before(text, span.start));
    let named = key.map_or_else(String::new, |key| format!("`{key}`: "));
    format!("{named}{message}; give exactly that many numbers in brackets")
}

/// Returns the key of the value that begins at a byte of the text.
fn key_before(text: &str, start: usize) -> Option<&str> {
    let before = text.get(..start)?;
    let (key, between) = before.rsplit_once('=')?;
    let key = key.lines().last()?.trim();
    // Between the key and its value there is nothing but blanks.
    (between.trim().is_empty() && !key.is_empty()).then_some(key)
}

/// Returns the message of the TOML reader on one line, with a correction if one is known.
pub(super) fn sentence(error: &toml::de::Error, text: &str) -> String {
    let message = error
        .message()
        .lines()
        .map(str::trim)
        .collect::<Vec<_>>()
        .join(", ");
    // The reader takes a bare word for the beginning of `true` or `false`.
    if message.starts_with("invalid boolean") || message.contains("must be quoted") {
        return "what stands here is no TOML value; write a number like 20 or 2e-5, text in quotation marks, true or false".into();
    }
    let advice = if message.starts_with("missing field") {
        "; add this key to the table that begins here (`rig init one-link` writes an example)"
    } else if message.starts_with("unknown field") {
        "; correct or remove this key"
    } else if message.starts_with("invalid length") {
        return of_wrong_length(error, text);
    } else if message.starts_with("invalid type") || message.starts_with("unknown variant") {
        "; give a value of that kind"
    } else {
        " (this is not valid TOML; `rig init one-link` writes an example)"
    };
    message.replace("expected f64", "expected a number") + advice
}
