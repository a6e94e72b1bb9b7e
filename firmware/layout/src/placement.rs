//! The list against the image.

use std::collections::BTreeSet;

use crate::{Entry, Image, Region, Speed};

/// Where an image's functions lie, against what the list says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Placement {
    /// Entries that no function of the image fits.
    pub without_function: Vec<Entry>,
    /// Fast functions that lie in flash: name and bytes.
    pub spilled: Vec<(String, u32)>,
    /// Functions that the tick calls and no entry names: name and bytes.
    pub unlisted: Vec<(String, u32)>,
}

impl Placement {
    /// Compares an image with a list. `code` is the memory that fast functions run from, `root` the tick's symbol.
    /// What a slow function calls in turn needs no entry.
    pub fn of(image: &Image, entries: &[Entry], code: &Region, root: &str) -> Self {
        let mut found = Self::default();
        for entry in entries {
            let fits = |names: &[String]| names.iter().any(|name| entry.fits(name));
            let functions: Vec<_> = (image.functions())
                .filter(|(_, function)| fits(&function.names))
                .collect();
            if functions.is_empty() && !entry.if_called {
                found.without_function.push(entry.clone());
            }
            let inside = |address: u32| (code.origin..code.origin + code.length).contains(&address);
            if entry.speed == Speed::Fast {
                let outside = functions.iter().filter(|(address, _)| !inside(*address));
                let named_size = outside.map(|(_, f)| (f.name().to_owned(), f.size));
                found.spilled.extend(named_size);
            }
        }
        let listed = |names: &[String]| {
            let entry = entries.iter().find(|e| names.iter().any(|n| e.fits(n)));
            entry.map(|entry| entry.speed)
        };
        let mut seen: BTreeSet<u32> = image.named(root).into_iter().collect();
        let mut open: Vec<u32> = seen.iter().copied().collect();
        while let Some(address) = open.pop() {
            let Some(function) = image.function(address) else {
                continue;
            };
            match listed(&function.names) {
                Some(Speed::Slow) => continue,
                Some(Speed::Fast) => {}
                None if function.is_jump() => {}
                None => {
                    let named_size = (function.name().to_owned(), function.size);
                    found.unlisted.push(named_size);
                    continue;
                }
            }
            for target in image.branches(address).0 {
                if seen.insert(target) {
                    open.push(target);
                }
            }
        }
        found
    }
}
