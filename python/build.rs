//! Arguments of the linker where a module for Python needs some (macOS).

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
