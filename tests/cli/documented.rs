//! What README and pages of `docs/` show: every command exists with its options, the walkthroughs run, and they print what the
//! page says.

mod walks;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::{CommandFactory, Parser};
use rig::commands::Cli;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Compares a page that is made from other texts with what they give now. Writes it instead if `RIG_WRITE_DOCS` is set.
pub(crate) fn made_page(path: &str, text: &str, test: &str) {
    let place = root().join(path);
    if std::env::var_os("RIG_WRITE_DOCS").is_some() {
        fs::write(place, text).unwrap();
        return;
    }
    let found = fs::read_to_string(place).unwrap_or_default();
    let mut lines = found.lines().zip(text.lines()).enumerate();
    let differs = lines.find(|(_, (found, made))| found != made);
    assert!(
        found == text,
        "{path} is stale: `RIG_WRITE_DOCS=1 cargo test -p rig --test cli {test}` renews it. First difference: {differs:?}"
    );
}

/// The pages that users read.
fn pages() -> Vec<PathBuf> {
    let mut found = vec![root().join("README.md"), root().join("CONTRIBUTING.md")];
    let mut folders = vec![root().join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Fenced blocks of a page: their language and text, without the indent of a list.
fn blocks(page: &Path) -> Vec<(String, String)> {
    let text = fs::read_to_string(page).unwrap();
    let mut found = Vec::new();
    let mut open: Option<(String, usize, String)> = None;
    for line in text.lines() {
        let fence = line.trim_start().strip_prefix("```");
        open = match (open, fence) {
            (None, Some(language)) => {
                let indent = line.len() - line.trim_start().len();
                Some((language.trim().to_owned(), indent, String::new()))
            }
            (Some((language, _, block)), Some(_)) => {
                found.push((language, block));
                None
            }
            (Some((language, indent, block)), None) => {
                let line = line.get(indent..).unwrap_or_default();
                Some((language, indent, block + line + "\n"))
            }
            (None, None) => None,
        };
    }
    found
}

/// A page without its fenced blocks.
fn sentences(page: &Path) -> String {
    let text = fs::read_to_string(page).unwrap();
    let mut fenced = false;
    let mut outside = String::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
        } else if !fenced {
            outside += line;
            outside.push('\n');
        }
    }
    outside
}

/// The calls of `rig` in a block of shell commands, as words.
fn calls(block: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    for line in block.lines() {
        let line = line.split(" #").next().unwrap_or_default();
        for part in line.split([';', '|', '>']).flat_map(|p| p.split("&&")) {
            let part = part.trim().trim_start_matches("do ").trim();
            if part.starts_with("rig ") {
                let words = part.replace("$k", "1");
                found.push(words.split_whitespace().map(str::to_owned).collect());
            }
        }
    }
    found
}

#[test]
fn commands_of_the_pages_are_understood() {
    let mut count = 0;
    let mut wrong = Vec::new();
    for page in pages() {
        for (language, block) in blocks(&page) {
            for call in calls(&block).iter().filter(|_| language == "sh") {
                count += 1;
                if let Err(error) = Cli::try_parse_from(call) {
                    wrong.push(format!("{}: {call:?}: {error}", page.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count > 50, "only {count} commands were found");
}

/// Text such as `rig excite --load` names commands and options that exist.
#[test]
fn commands_within_sentences_have_their_options() {
    let program = Cli::command();
    let mut wrong = Vec::new();
    let mut count = 0;
    for page in pages() {
        let text = sentences(&page);
        for quoted in text.split('`').skip(1).step_by(2) {
            let mut words = quoted.split_whitespace().peekable();
            if words.next() != Some("rig") {
                continue;
            }
            let mut command = &program;
            let mut own: Vec<&clap::Arg> = program.get_arguments().collect();
            while let Some(next) = words.peek().and_then(|w| command.find_subcommand(w)) {
                command = next;
                own.extend(next.get_arguments());
                words.next();
            }
            let named = command.get_name() != program.get_name();
            if !named && !words.peek().is_none_or(|w| w.starts_with('-')) {
                wrong.push(format!("{}: `{quoted}`: no such command", page.display()));
            }
            for option in words.filter_map(|w| w.strip_prefix("--")) {
                count += 1;
                let name = option.split(['=', ',']).next().unwrap_or_default();
                let known = |a: &clap::Arg| {
                    a.get_long() == Some(name)
                        || a.get_all_aliases().is_some_and(|all| all.contains(&name))
                };
                if !["help", "version"].contains(&name) && !own.iter().any(|a| known(a)) {
                    wrong.push(format!("{}: `{quoted}`: no --{name}", page.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count > 20, "only {count} options were found");
}

/// Links to files of the project, and to headings of other pages, lead somewhere.
#[test]
fn links_of_the_pages_lead_somewhere() {
    let anchor = |heading: &str| -> String {
        let kept = |c: char| c.is_alphanumeric() || c == ' ' || c == '-' || c == '_';
        let text = heading.trim_start_matches('#').trim().to_lowercase();
        text.chars()
            .filter(|c| kept(*c))
            .collect::<String>()
            .replace(' ', "-")
    };
    let mut wrong = Vec::new();
    let mut count = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        for link in text
            .split("](")
            .skip(1)
            .filter_map(|rest| rest.split(')').next())
        {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            count += 1;
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = match file {
                "" => page.clone(),
                file => page.parent().unwrap().join(file),
            };
            let found = target.exists()
                && (heading.is_empty()
                    || fs::read_to_string(&target)
                        .unwrap()
                        .lines()
                        .any(|line| line.starts_with('#') && anchor(line) == heading));
            if !found {
                wrong.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count > 50, "only {count} links were found");
}

/// Returns the title of a page, as plain text.
fn title(page: &Path) -> String {
    let text = fs::read_to_string(page).unwrap();
    let line = text.lines().next().unwrap_or_default();
    let title = line.strip_prefix("# ");
    title
        .unwrap_or_else(|| panic!("{} does not begin with a title", page.display()))
        .replace('`', "")
}

/// The links of a line of the guide to pages beside it: a second page of a line stands below the first.
fn links_of(line: &str) -> Vec<&str> {
    (line.split("](").skip(1))
        .filter_map(|rest| rest.split(')').next())
        .filter(|link| !link.contains('#') && !link.starts_with("../"))
        .collect()
}

/// The links of a page to pages in the folder of its name, each once.
fn below(page: &Path, link: &str) -> Vec<String> {
    let folder = format!("{}/", link.trim_end_matches(".md"));
    let mut found = Vec::new();
    for line in fs::read_to_string(page).unwrap().lines() {
        let links = links_of(line).into_iter().map(str::to_owned);
        for own in links.filter(|own| own.starts_with(&folder) && own.ends_with(".md")) {
            if !found.contains(&own) {
                found.push(own);
            }
        }
    }
    found
}

/// The contents of the book are the guide's groups and links with the titles of the pages, and the guide has every page.
#[test]
fn the_summary_of_the_book_is_made_from_the_guide() {
    let docs = root().join("docs");
    let guide = fs::read_to_string(docs.join("README.md")).unwrap();
    let mut summary = format!(
        "# Summary\n\n<!-- Made from README.md: RIG_WRITE_DOCS=1 cargo test -p rig --test cli the_summary -->\n\n[{}](README.md)\n",
        title(&docs.join("README.md"))
    );
    let mut linked = vec![docs.join("README.md"), docs.join("SUMMARY.md")];
    for line in guide.lines() {
        if let Some(group) = line.strip_prefix("**").and_then(|l| l.strip_suffix("**")) {
            summary += &format!("\n# {group}\n\n");
        } else if line.starts_with("* ") {
            for link in links_of(line) {
                let page = docs.join(link);
                summary += &format!("- [{}]({link})\n", title(&page));
                for below in below(&page, link) {
                    let page = docs.join(&below);
                    if !guide.contains(&below) {
                        summary += &format!("  - [{}]({below})\n", title(&page));
                        linked.push(page);
                    }
                }
                linked.push(page);
            }
        }
    }
    let missing: Vec<_> = (pages().into_iter())
        .filter(|page| page.starts_with(&docs) && !linked.contains(page))
        .collect();
    assert!(missing.is_empty(), "docs/README.md lacks {missing:?}");
    made_page("docs/SUMMARY.md", &summary, "the_summary");
}

/// Builds the book with `mdbook`, where it is installed: no warning, and every link of it leads somewhere.
#[test]
fn the_book_builds_without_a_warning_and_its_links_lead_somewhere() {
    if Command::new("mdbook").arg("--version").output().is_err() {
        println!("skipped: there is no mdbook");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new("mdbook")
        .args(["build", "--dest-dir"])
        .arg(folder.path())
        .arg(root().join("docs"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(!said.contains("WARN") && !said.contains("ERROR"), "{said}");
    let mut wrong = Vec::new();
    let mut count = 0;
    for page in pages() {
        let Ok(place) = page.strip_prefix(root().join("docs")) else {
            continue;
        };
        if place.ends_with("SUMMARY.md") {
            continue;
        }
        let name = place.to_string_lossy().replace("README", "index");
        let html = folder.path().join(name).with_extension("html");
        let text = fs::read_to_string(&html).unwrap();
        for link in text
            .split("href=\"")
            .skip(1)
            .filter_map(|r| r.split('"').next())
        {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            count += 1;
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = match file {
                "" => html.clone(),
                file => html.parent().unwrap().join(file),
            };
            let has = |heading: &str| {
                let text = fs::read_to_string(&target).unwrap_or_default();
                heading.is_empty() || text.contains(&format!("id=\"{heading}\""))
            };
            if !target.exists() || !has(heading) {
                wrong.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count > 300, "only {count} links were found");
}
