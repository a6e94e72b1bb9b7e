//! Lets `cargo build --workspace` link the extension on macOS without Python; maturin does so by itself.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
