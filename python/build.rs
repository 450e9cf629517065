//! Linker arguments that a Python module needs on some systems (macOS).

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
