//! No circle of imports between files: who reads a file need not read one that reads it. No function that does not fit
//! on a page.
//!
//! A file imports another where a path in it names something that the other defines; re-exports are followed to the
//! definition. Test modules are left out.

#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::Span;
use syn::visit::Visit;
use syn::{Attribute, Block, Ident, ImplItemFn, Item, ItemFn, UseTree};

/// Most lines of a function, from its name to its last brace.
const MOST_LINES: usize = 80;

/// Path of a module within its crate; empty for the root.
type Module = Vec<String>;

/// What one file says of itself and of others.
#[derive(Default)]
struct File {
    /// Names that it defines.
    defines: BTreeSet<String>,
    /// Names that it imports, with the path that each stands for.
    imports: BTreeMap<String, Vec<String>>,
    /// Modules whose names it imports all (`use x::*`).
    globs: Vec<Vec<String>>,
    /// All paths in it.
    paths: Vec<Vec<String>>,
    /// Functions of more than [`MOST_LINES`], with their lines.
    long: Vec<(String, usize)>,
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| {
        a.path().is_ident("cfg")
            && (a.parse_args::<syn::Path>()).is_ok_and(|path| path.is_ident("test"))
    })
}

impl File {
    fn measure(&mut self, name: &Ident, block: &Block) {
        let line = |span: Span| span.start().line;
        let lines = line(block.brace_token.span.close()) + 1 - line(name.span());
        if lines > MOST_LINES {
            self.long.push((name.to_string(), lines));
        }
    }

    fn take_use(&mut self, tree: &UseTree, before: &[String]) {
        let join = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(path) => self.take_use(&path.tree, &join(&path.ident)),
            UseTree::Name(name) if name.ident == "self" => {
                let last = before.last().cloned().unwrap_or_default();
                self.imports.insert(last, before.to_vec());
            }
            UseTree::Name(name) => {
                self.imports
                    .insert(name.ident.to_string(), join(&name.ident));
            }
            UseTree::Rename(name) => {
                self.imports
                    .insert(name.rename.to_string(), join(&name.ident));
            }
            UseTree::Glob(_) => self.globs.push(before.to_vec()),
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.take_use(tree, before);
                }
            }
        }
    }
}

impl<'ast> Visit<'ast> for File {
    fn visit_item_fn(&mut self, item: &'ast ItemFn) {
        self.measure(&item.sig.ident, &item.block);
        syn::visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast ImplItemFn) {
        if !is_test(&item.attrs) {
            self.measure(&item.sig.ident, &item.block);
            syn::visit::visit_impl_item_fn(self, item);
        }
    }

    /// `pub(crate)` imports nothing.
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}

    fn visit_item(&mut self, item: &'ast Item) {
        let (attributes, name) = match item {
            Item::Const(i) => (&i.attrs, Some(&i.ident)),
            Item::Enum(i) => (&i.attrs, Some(&i.ident)),
            Item::Fn(i) => (&i.attrs, Some(&i.sig.ident)),
            Item::Macro(i) => (&i.attrs, i.ident.as_ref()),
            Item::Mod(i) => (&i.attrs, None),
            Item::Static(i) => (&i.attrs, Some(&i.ident)),
            Item::Struct(i) => (&i.attrs, Some(&i.ident)),
            Item::Trait(i) => (&i.attrs, Some(&i.ident)),
            Item::Type(i) => (&i.attrs, Some(&i.ident)),
            Item::Impl(i) => (&i.attrs, None),
            Item::Use(i) => (&i.attrs, None),
            _ => return syn::visit::visit_item(self, item),
        };
        if is_test(attributes) {
            return;
        }
        if let Some(name) = name {
            self.defines.insert(name.to_string());
        }
        if let Item::Use(used) = item {
            self.take_use(&used.tree, &[]);
        }
        syn::visit::visit_item(self, item);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments = path.segments.iter().map(|s| s.ident.to_string());
        self.paths.push(segments.collect());
        syn::visit::visit_path(self, path);
    }
}

/// The files of one crate by their modules, found from its root by `mod` lines.
fn files_of(root: &Path) -> BTreeMap<Module, File> {
    let mut files = BTreeMap::new();
    let mut open = vec![(Module::new(), root.to_path_buf())];
    while let Some((module, path)) = open.pop() {
        let text = std::fs::read_to_string(&path).unwrap();
        let parsed = syn::parse_file(&text).unwrap();
        let own = match path.file_stem().and_then(|s| s.to_str()) {
            Some("lib" | "main" | "mod") => path.parent().unwrap().to_path_buf(),
            _ => path.with_extension(""),
        };
        for item in &parsed.items {
            if let Item::Mod(inner) = item
                && inner.content.is_none()
                && !is_test(&inner.attrs)
            {
                let name = inner.ident.to_string();
                let places = [
                    own.join(format!("{name}.rs")),
                    own.join(&name).join("mod.rs"),
                ];
                // Modules of another place or platform are not followed.
                if let Some(place) = places.into_iter().find(|p| p.is_file()) {
                    open.push(([module.as_slice(), &[name]].concat(), place));
                }
            }
        }
        let mut file = File::default();
        file.visit_file(&parsed);
        files.insert(module, file);
    }
    files
}

/// The module whose file defines what a path names, seen from a module; none outside the crate.
fn defined_in(
    files: &BTreeMap<Module, File>,
    from: &Module,
    path: &[String],
    depth: usize,
) -> Option<Module> {
    let (first, rest) = path.split_first()?;
    let mut at = from.clone();
    let mut rest = rest;
    match first.as_str() {
        "crate" => at.clear(),
        "self" => {}
        "super" => {
            at.pop();
            while let Some((next, more)) = rest.split_first()
                && next == "super"
            {
                at.pop();
                rest = more;
            }
        }
        name => return named_in(files, &at, name, rest, depth),
    }
    match rest.split_first() {
        None => Some(at),
        Some((name, rest)) => named_in(files, &at, name, rest, depth),
    }
}

/// The same of a name that a module holds.
fn named_in(
    files: &BTreeMap<Module, File>,
    at: &Module,
    name: &str,
    rest: &[String],
    depth: usize,
) -> Option<Module> {
    let child = [at.as_slice(), &[name.to_owned()]].concat();
    if files.contains_key(&child) {
        return match rest.split_first() {
            None => Some(child),
            Some((next, rest)) => named_in(files, &child, next, rest, depth),
        };
    }
    let file = files.get(at)?;
    if file.defines.contains(name) {
        return Some(at.clone());
    }
    if depth == 0 {
        return None;
    }
    if let Some(target) = file.imports.get(name) {
        let whole = [target.as_slice(), rest].concat();
        // An import that names itself is of another crate.
        return (target.len() > 1)
            .then(|| defined_in(files, at, &whole, depth - 1))
            .flatten();
    }
    let through = |glob: &Vec<String>| {
        let whole = [glob.as_slice(), &[name.to_owned()]].concat();
        defined_in(files, at, &whole, depth - 1)
    };
    file.globs.iter().find_map(through)
}

/// Files that import themselves through others.
fn circle(files: &BTreeMap<Module, File>) -> BTreeSet<Module> {
    let mut edges: BTreeMap<&Module, BTreeSet<Module>> = BTreeMap::new();
    for (module, file) in files {
        for path in file
            .paths
            .iter()
            .chain(file.imports.values())
            .chain(&file.globs)
        {
            let target = defined_in(files, module, path, 12);
            let own = edges.entry(module).or_default();
            own.extend(target.filter(|t| t != module));
        }
    }
    let reaches_itself = |module: &Module| {
        let mut seen = BTreeSet::new();
        let mut open = vec![module];
        while let Some(at) = open.pop() {
            for next in edges.get(at).into_iter().flatten() {
                if next == module {
                    return true;
                }
                if seen.insert(next) {
                    open.push(next);
                }
            }
        }
        false
    };
    files
        .keys()
        .filter(|m| reaches_itself(m))
        .cloned()
        .collect()
}

/// Roots of all crates of the workspace.
fn roots() -> Vec<PathBuf> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let manifest = std::fs::read_to_string(workspace.join("Cargo.toml")).unwrap();
    let members = manifest.split("members = [").nth(1).unwrap();
    let members = members.split(']').next().unwrap();
    let names = members.split(',').map(|m| m.trim().trim_matches('"'));
    let libraries = names
        .filter(|m| !m.is_empty())
        .map(|m| workspace.join(m).join("src/lib.rs"));
    libraries.filter(|p| p.is_file()).collect()
}

/// All files of the workspace's libraries, with the folder of their crate.
fn crates() -> Vec<(String, BTreeMap<Module, File>)> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let roots = roots();
    assert!(roots.len() > 15, "{roots:?}");
    (roots.iter())
        .map(|root| {
            let folder = root.parent().and_then(Path::parent).unwrap();
            let name = folder.strip_prefix(workspace).unwrap();
            (name.display().to_string(), files_of(root))
        })
        .collect()
}

#[test]
fn files_import_one_another_in_no_circle() {
    let wrong: Vec<String> = (crates().iter())
        .filter_map(|(name, files)| {
            let circle: Vec<String> = circle(files).iter().map(|m| m.join("/")).collect();
            (!circle.is_empty()).then(|| format!("{name}: {}", circle.join(", ")))
        })
        .collect();
    assert!(wrong.is_empty(), "files in circles:\n{}", wrong.join("\n"));
}

#[test]
fn functions_fit_on_a_page() {
    let wrong: Vec<String> = (crates().iter())
        .flat_map(|(name, files)| {
            files.iter().flat_map(move |(module, file)| {
                let of = move |(function, lines): &(String, usize)| {
                    format!("{name}: {}::{function}, {lines} lines", module.join("::"))
                };
                file.long.iter().map(of)
            })
        })
        .collect();
    assert!(
        wrong.is_empty(),
        "more than {MOST_LINES} lines:\n{}",
        wrong.join("\n")
    );
    let long: String = (0..MOST_LINES).map(|_| "    f();\n").collect();
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("lib.rs");
    std::fs::write(&root, format!("fn f() {{\n{long}}}")).unwrap();
    assert_eq!(files_of(&root)[&Module::new()].long.len(), 1);
}

#[test]
fn a_circle_is_seen_through_a_re_export() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("lib.rs", "mod a; mod b; pub use a::A;");
    write("a.rs", "use crate::b::B; pub struct A(B);");
    write("b.rs", "pub struct B;");
    let root = folder.path().join("lib.rs");
    assert!(circle(&files_of(&root)).is_empty());
    write(
        "b.rs",
        "pub struct B; impl B { fn a(&self, _: &crate::A) {} }",
    );
    let names = circle(&files_of(&root));
    assert_eq!(names.len(), 2, "{names:?}");
    // A test may import what it tests.
    write(
        "b.rs",
        "pub struct B; #[cfg(test)] mod tests { use crate::A; }",
    );
    assert!(circle(&files_of(&root)).is_empty());
}
