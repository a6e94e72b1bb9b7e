//! Puts the memory layout where the linker finds it, and names the linker scripts. Nothing on the desktop.

use std::{env, error::Error, fmt::Write as _, fs, path::PathBuf};

/// Which functions run from the CCM SRAM, by rank.
const LIST: &str = "fast_code.list";
/// Marks a library's function that a compiler may inline.
const IF_CALLED: &str = "if-called";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=../memory.x");
    println!("cargo::rerun-if-changed={LIST}");
    if env::var("CARGO_CFG_TARGET_OS")? == "none" {
        let out = PathBuf::from(env::var("OUT_DIR")?);
        fs::copy("../memory.x", out.join("memory.x"))?;
        let section = tick_section(&fs::read_to_string(LIST)?)?;
        fs::write(out.join("tick.x"), section)?;
        println!("cargo::rustc-link-search={}", out.display());
        println!("cargo::rustc-link-arg-bins=--nmagic");
        // What does not fit into CODE goes on to the next section that takes it, .text in flash, the last of the list first.
        println!("cargo::rustc-link-arg-bins=--enable-non-contiguous-regions");
        // Before link.x, whose .text takes every function that is left.
        println!("cargo::rustc-link-arg-bins=-Ttick.x");
        println!("cargo::rustc-link-arg-bins=-Tlink.x");
        println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    }
    Ok(())
}

/// The linker's section of the code that `board/ccm_code.rs` copies to the CCM SRAM, from the list of its functions.
fn tick_section(list: &str) -> Result<String, String> {
    let mut text = String::from("SECTIONS\n{\n  .tick : ALIGN(8)\n  {\n    __tick_start = .;\n");
    for (line, number) in list.lines().zip(1..) {
        let words: Vec<&str> = line
            .split('#')
            .take(1)
            .flat_map(str::split_whitespace)
            .collect();
        match words[..] {
            [] | ["slow", _] | ["slow", _, IF_CALLED] => {}
            ["fast", path] | ["fast", path, IF_CALLED] => {
                let _ = writeln!(text, "    *({});", patterns(path));
            }
            _ => {
                return Err(format!(
                    "firmware/{LIST}:{number}: \"{line}\" is neither `fast PATH` nor `slow PATH`, with or without `{IF_CALLED}` behind it."
                ));
            }
        }
    }
    text += "    . = ALIGN(8);\n    __tick_end = .;\n  } > CODE AT > LOAD\n}\n\n__tick_load = LOADADDR(.tick);\n";
    Ok(text)
}

/// Names of input sections that a function can have: the compiler names a section by the symbol. Rust's own symbols spell
/// the path's parts one after the other, each behind its length (v0 mangling, RFC 2603, which `.cargo/config.toml` asks
/// for, and the older one of libraries that come compiled).
fn patterns(path: &str) -> String {
    if path.contains("::") {
        let mut pattern = String::from(".text._*");
        for part in path.split("::") {
            let _ = write!(pattern, "{}{part}*", part.len());
        }
        pattern
    } else {
        format!(".text.{path} .text.*.{path}")
    }
}
