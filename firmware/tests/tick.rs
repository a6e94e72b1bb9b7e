//! What the image's control tick may call: nothing that can panic, and nothing that cannot be seen here.
//!
//! Reads the machine code that will be flashed: from the converter's interrupt along every branch that leaves a
//! function. Needs the image: build it with `firmware/build` and name it in `RIG_FIRMWARE_ELF`.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeMap;

use rig_layout::{Image, LIST, MEMORY, Placement, ROOT, entries, regions};

#[test]
#[ignore = "needs the image for the chip: firmware/build, then RIG_FIRMWARE_ELF"]
fn nothing_that_the_tick_reaches_can_panic() {
    let path = std::env::var("RIG_FIRMWARE_ELF").expect("RIG_FIRMWARE_ELF must name the image");
    let image = Image::read(path.as_ref()).unwrap();
    let find = |wanted: &str| {
        let named = image.named(wanted);
        named.or_else(|| image.containing(wanted)).unwrap()
    };
    // The scan must be able to see a panic where there is one: from the start to the panic handler.
    let handler = find("rust_begin_unwind");
    assert!(
        reached(&image, find("main")).contains_key(&handler),
        "the start reaches no panic: the scan is blind"
    );
    let start = reached(&image, find("main"));
    assert!(
        start
            .keys()
            .any(|function| image.branches(*function).1.is_some()),
        "the start calls nothing through a register: the scan is blind"
    );
    let tick = reached(&image, find(ROOT));
    assert!(
        tick.len() > 20,
        "the tick reaches only {} functions",
        tick.len()
    );
    if tick.contains_key(&handler) {
        let (mut way, mut at) = (Vec::new(), handler);
        loop {
            way.push(image.function(at).unwrap().name());
            match tick[&at] {
                Some(caller) => at = caller,
                None => break,
            }
        }
        panic!("the tick can panic: {}", way.join(" <- "));
    }
    let opaque: Vec<String> = tick
        .keys()
        .filter_map(|function| {
            let what = image.branches(*function).1?;
            Some(format!(
                "{} {what}",
                image.function(*function).unwrap().name()
            ))
        })
        .collect();
    assert!(
        opaque.is_empty(),
        "this check sees nothing behind it:\n{}",
        opaque.join("\n")
    );
}

/// Every function reached, with the one it was reached from.
fn reached(image: &Image, root: u32) -> BTreeMap<u32, Option<u32>> {
    let mut seen = BTreeMap::from([(root, None)]);
    let mut open = vec![root];
    while let Some(function) = open.pop() {
        for target in image.branches(function).0 {
            if let std::collections::btree_map::Entry::Vacant(entry) = seen.entry(target) {
                entry.insert(Some(function));
                open.push(target);
            }
        }
    }
    seen
}

/// What runs from the fast memory is what the list says: by every compiler that the image is built with.
#[test]
#[ignore = "needs the image for the chip: firmware/build, then RIG_FIRMWARE_ELF"]
fn every_function_of_the_tick_lies_where_the_list_says() {
    let path = std::env::var("RIG_FIRMWARE_ELF").expect("RIG_FIRMWARE_ELF must name the image");
    let image = Image::read(path.as_ref()).unwrap();
    let all = regions(MEMORY);
    let code = all.iter().find(|region| region.name == "CODE").unwrap();
    let mut list = entries(LIST).unwrap();
    assert_eq!(
        Placement::of(&image, &list, code, ROOT),
        Placement::default(),
        "functions of the tick that firmware/fast_code.list does not place as it says"
    );
    // The check sees an entry too many and one too few.
    let odd = entries("fast rig_firmware::nothing::of::that::name").unwrap();
    let found = Placement::of(&image, &odd, code, ROOT);
    assert_eq!(found.without_function, odd);
    list.retain(|entry| entry.path != "rig_firmware::step::step");
    let found = Placement::of(&image, &list, code, ROOT);
    assert_eq!(found.unlisted.len(), 1, "{:?}", found.unlisted);
    // And one that lies elsewhere.
    let nowhere = rig_layout::Region {
        length: 0,
        ..code.clone()
    };
    let found = Placement::of(&image, &list, &nowhere, ROOT);
    assert!(found.spilled.len() > 10, "{:?}", found.spilled);
}
