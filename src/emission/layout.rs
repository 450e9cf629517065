//! The templates: layout only. Every expression in them was rendered before.

use super::EmissionError;
use super::target::Target;
use crate::expansion::MapOrders;

/// What templates/map.rs.tera and templates/map.c.tera lay out.
#[derive(Clone, Debug, serde::Serialize)]
pub(super) struct MapLayout {
    pub(super) header: Vec<String>,
    /// Word of the target.
    pub(super) target: &'static str,
    /// Type of states, parameters and coefficients.
    pub(super) real: &'static str,
    /// What C ends single literals and names with, small and capital; empty in double precision.
    pub(super) suffix: &'static str,
    pub(super) capital: String,
    /// The largest number of that type.
    pub(super) largest: String,
    pub(super) identifier: String,
    /// The identifier in capitals, for the names of macros.
    pub(super) upper: String,
    pub(super) dimension: usize,
    pub(super) parameters: usize,
    pub(super) passages: usize,
    pub(super) coefficients: usize,
    pub(super) lanes: usize,
    #[serde(flatten)]
    pub(super) orders: MapOrders,
    pub(super) scene: String,
    pub(super) digest: String,
    pub(super) section: String,
    pub(super) coordinate_names: Vec<String>,
    pub(super) parameter_names: Vec<String>,
    pub(super) point: Vec<String>,
    pub(super) grazing: Vec<String>,
    pub(super) window_depth: String,
    pub(super) window_state: Vec<String>,
    pub(super) window_parameters: Vec<String>,
    /// Conditions in C that a state lies in the window.
    pub(super) inside_state: Vec<String>,
    /// Conditions in C that parameters lie in the window.
    pub(super) inside_parameters: Vec<String>,
    pub(super) tolerance: String,
    pub(super) measured_error: String,
    pub(super) prepare_statements: Vec<String>,
    pub(super) prepare_outputs: Vec<String>,
    pub(super) step_statements: Vec<String>,
    pub(super) image: Vec<String>,
    pub(super) depths: Vec<String>,
    pub(super) jacobian_statements: Vec<String>,
    pub(super) jacobian_image: Vec<String>,
    pub(super) jacobian_depths: Vec<String>,
    pub(super) jacobian_rows: Vec<String>,
    pub(super) jacobian_entries: Vec<String>,
}

/// The text of one map's module.
pub(super) fn map(target: Target, layout: &MapLayout) -> Result<String, EmissionError> {
    let mut context = tera::Context::new();
    context.insert("map", layout);
    match target {
        Target::Rust => render(
            "map.rs.tera",
            include_str!("../../templates/map.rs.tera"),
            context,
        ),
        Target::C | Target::Cuda => render(
            "map.c.tera",
            include_str!("../../templates/map.c.tera"),
            context,
        ),
    }
}

/// The manifest of a standalone crate.
pub(super) fn manifest(package: &str) -> Result<String, EmissionError> {
    let mut context = tera::Context::new();
    context.insert("package", package);
    render(
        "crate_cargo.toml.tera",
        include_str!("../../templates/crate_cargo.toml.tera"),
        context,
    )
}

/// The root of a standalone crate.
pub(super) fn standalone_root(module: &str) -> Result<String, EmissionError> {
    let mut context = tera::Context::new();
    context.insert("module", module);
    render(
        "crate_lib.rs.tera",
        include_str!("../../templates/crate_lib.rs.tera"),
        context,
    )
}

/// The root of the crate of the catalogue's maps.
pub(super) fn catalogue_root(modules: &[&str]) -> Result<String, EmissionError> {
    let mut context = tera::Context::new();
    context.insert("modules", modules);
    render(
        "catalogue_lib.rs.tera",
        include_str!("../../templates/catalogue_lib.rs.tera"),
        context,
    )
}

fn render(name: &str, template: &str, mut context: tera::Context) -> Result<String, EmissionError> {
    context.insert("version", env!("CARGO_PKG_VERSION"));
    context.insert("format", &super::FORMAT);
    let mut templates = tera::Tera::default();
    templates.autoescape_on(Vec::<&str>::new());
    templates.add_raw_template(name, template)?;
    Ok(templates.render(name, &context)?)
}
