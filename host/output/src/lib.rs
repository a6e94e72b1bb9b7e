//! Numbers as text, grouped sentences, misspelt words, commented TOML, and atomic writing of files.
//!
//! The other crates use it for messages and results. It does not depend on robots.
//!
//! ```
//! assert_eq!(rig_output::format_value(1.23456, 0.02), "1.235 ± 0.020");
//! ```

mod files;
mod finding;
mod format;
mod toml_text;

pub use files::{WriteError, can_take, data_dir, folder, persist, temporary, write_whole};
pub use finding::{Finding, one_a_kind, worst_first};
pub use format::{
    capital, fixed, format_interval, format_p_value, format_short, format_significant, format_time,
    format_trimmed, format_unit, format_value, listed, of_exponent, power_of_ten, spell_units,
};
pub use toml_text::{comment_toml, toml_document, toml_tables};
