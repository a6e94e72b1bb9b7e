//! Colours and the plot library of the pages, for other pages of the program.

use super::plot::Role;

/// Style-sheet variables of surfaces and text, light and dark.
pub const THEME: &str = include_str!("../assets/theme.css");
/// Style sheet of uPlot.
pub const PLOT_STYLE: &str = include_str!("../assets/uplot/uPlot.min.css");
/// uPlot, which defines the global `uPlot`.
pub const PLOT_SCRIPT: &str = include_str!("../assets/uplot/uPlot.iife.min.js");
/// Licence of uPlot, to be put beside it.
pub const PLOT_LICENCE: &str = include_str!("../assets/uplot/LICENSE");

/// Returns the colours of the roles as style-sheet variables: light, dark, and light again for print.
pub fn palette() -> String {
    let list = |colour: fn(Role) -> &'static str| -> String {
        Role::ALL
            .iter()
            .map(|role| format!("--{}:{};", role.name(), colour(*role)))
            .collect()
    };
    let (light, dark) = (list(Role::light), list(Role::dark));
    format!(":root{{{light}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}\n")
}
