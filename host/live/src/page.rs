//! The page, as one document without any other host.

use std::sync::LazyLock;

use rig_report::assets::{PLOT_LICENCE, PLOT_SCRIPT, PLOT_STYLE, THEME, palette};

/// What the page may do: its own text, and talk to its own server. No other page may frame it, so that no click on
/// another page can arm the rig.
pub(crate) const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; \
     img-src data: blob:; connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// Returns the page.
pub(crate) fn page() -> &'static str {
    static PAGE: LazyLock<String> = LazyLock::new(|| {
        include_str!("../assets/live.html")
            .replace("/*theme*/", &(palette() + THEME + PLOT_STYLE))
            .replace("/*style*/", include_str!("../assets/live.css"))
            .replace("/*licence*/", PLOT_LICENCE.trim())
            .replace("/*plot*/", PLOT_SCRIPT)
            .replace("/*data*/", include_str!("../assets/data.js"))
            .replace("/*figures*/", include_str!("../assets/figures.js"))
            .replace("/*live*/", include_str!("../assets/live.js"))
    });
    &PAGE
}
