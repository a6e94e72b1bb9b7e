//! The option of all commands that write a report.

use std::path::Path;

use clap::Args;

use super::error::CommandError;
use super::ui::Ui;
use rig_report::{Document, text_tables};

/// The form of a report.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(crate) struct ReportArg {
    /// Write the report as Markdown, too: report.md, with its figures as SVG files beside it
    #[arg(long)]
    markdown: bool,
}

impl ReportArg {
    /// Returns true if Markdown is asked for.
    pub(crate) fn is_markdown(self) -> bool {
        self.markdown
    }

    /// Writes a report as the HTML file `path`.
    ///
    /// # Errors
    /// As [`write_report`].
    pub(crate) fn write(self, path: &Path, page: &Document) -> Result<(), CommandError> {
        write_report(path, page, self.markdown)
    }

    /// Writes a report as the HTML file `path`, and prints its tables if details are asked for.
    ///
    /// # Errors
    /// As [`write_report`].
    pub(crate) fn write_and_show(
        self,
        path: &Path,
        page: &Document,
        ui: &Ui,
    ) -> Result<(), CommandError> {
        self.write(path, page)?;
        if ui.is_verbose() {
            for table in text_tables(page)? {
                ui.detail(&format!("{table}\n"));
            }
        }
        Ok(())
    }

    /// Prints where the report `path` is.
    pub(crate) fn tell(self, path: &Path, ui: &Ui) {
        ui.file(path);
        if !self.markdown {
            return ui.say(&format!("report: {}", path.display()));
        }
        let beside = path.with_extension("md");
        ui.file(&beside);
        ui.say(&format!(
            "report: {} and {}",
            path.display(),
            beside.display()
        ));
    }
}

/// Writes a report as the HTML file `path`; if `markdown`, as Markdown beside it. Otherwise removes the Markdown of an earlier
/// report, so that nobody takes it for a part of the new result.
///
/// # Errors
/// A document that contradicts itself, or a file that cannot be written or removed.
pub(super) fn write_report(
    path: &Path,
    page: &Document,
    markdown: bool,
) -> Result<(), CommandError> {
    let beside = path.with_extension("md");
    match markdown {
        true => rig_report::write_markdown(&beside, page)?,
        false => rig_report::remove_markdown(&beside)?,
    }
    rig_report::write(path, page)?;
    Ok(())
}
