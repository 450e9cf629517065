//! A scene from a file or a text.

use std::path::Path;

use toml_edit::Document;

use super::document::Table;
use super::{
    Digest, Scene, diagram, emit, expansion, grazing, oscillator, overrides, section, usage, window,
};
use crate::model::error::{Checked, Fault, SceneError};
use crate::model::names;
use crate::model::problem::SceneProblem;

/// Longest text read, in bytes.
const LONGEST: usize = 1 << 20;

/// Tables of a scene.
const KEYS: [&str; 8] = [
    "model",
    "grazing",
    "section",
    "expansion",
    "window",
    "emit",
    "diagram",
    "chart",
];

impl Scene {
    /// Reads and checks a scene; `file_name` names it in messages and gives it its identifier.
    ///
    /// ```
    /// use grazemap_sim::model::{Scene, catalogue};
    ///
    /// let source = catalogue::text("linear").expect("the catalogue holds it");
    /// let scene = Scene::parse(source, "linear.toml")?;
    /// assert_eq!(scene.model.full_state_names(), ["x", "v", "theta"]);
    /// # Ok::<(), grazemap_sim::model::SceneError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// The first fault of the text, with its place in it.
    pub fn parse(source: &str, file_name: &str) -> Result<Self, SceneError> {
        Self::parse_with(source, file_name, &[])
    }

    /// As [`parse`](Scene::parse), with overrides `(key, value)` put into the text first.
    ///
    /// A bare name is a parameter of the model; a dotted key is a place of the scene, list entries
    /// by number (`expansion.smooth_order`, `diagram.0.points`).
    ///
    /// # Errors
    ///
    /// The first fault of the overrides, or of the text after them.
    pub fn parse_with(
        source: &str,
        file_name: &str,
        overrides: &[(String, String)],
    ) -> Result<Self, SceneError> {
        let text =
            overridden(source, overrides).map_err(|fault| fault.in_file(file_name, source))?;
        read(&text, file_name).map_err(|fault| fault.in_file(file_name, &text))
    }

    /// The text of a scene with overrides in it, as in [`parse_with`](Scene::parse_with): what the
    /// digest is of.
    ///
    /// # Errors
    ///
    /// The first fault of the overrides.
    pub fn text_with(
        source: &str,
        file_name: &str,
        overrides: &[(String, String)],
    ) -> Result<String, SceneError> {
        overridden(source, overrides).map_err(|fault| fault.in_file(file_name, source))
    }

    /// Reads and checks a scene file.
    ///
    /// # Errors
    ///
    /// [`SceneProblem::Unreadable`] if the file cannot be read as UTF-8 text; otherwise as
    /// [`parse`](Scene::parse).
    pub fn load(path: impl AsRef<Path>) -> Result<Self, SceneError> {
        Self::load_with(path.as_ref(), &[])
    }

    /// As [`load`](Scene::load), with overrides as in [`parse_with`](Scene::parse_with).
    ///
    /// # Errors
    ///
    /// As [`load`](Scene::load) and [`parse_with`](Scene::parse_with).
    pub fn load_with(path: &Path, overrides: &[(String, String)]) -> Result<Self, SceneError> {
        let file_name = path.display().to_string();
        let unreadable = |reason: String| {
            Fault::nowhere(SceneProblem::Unreadable { reason }).in_file(&file_name, "")
        };
        let bytes = std::fs::read(path).map_err(|error| unreadable(error.to_string()))?;
        let source = String::from_utf8(bytes).map_err(|error| {
            unreadable(format!(
                "it is not text (byte {} is not UTF-8)",
                error.utf8_error().valid_up_to()
            ))
        })?;
        Self::parse_with(&source, &file_name, overrides)
    }
}

/// The text of a scene with the overrides in it.
fn overridden(source: &str, values: &[(String, String)]) -> Checked<String> {
    if source.len() > LONGEST {
        return Err(Fault::nowhere(SceneProblem::TooLong {
            length: source.len(),
            limit: LONGEST,
        }));
    }
    if values.is_empty() {
        return Ok(source.to_owned());
    }
    let mut document = parsed(source)?.into_mut();
    overrides::apply(&mut document, values)?;
    Ok(document.to_string())
}

fn parsed(text: &str) -> Checked<Document<&str>> {
    Document::parse(text).map_err(|error| {
        let problem = SceneProblem::Toml {
            reason: error.message().trim().replace('\n', "; "),
        };
        Fault {
            problem: Box::new(problem),
            span: error.span(),
        }
    })
}

/// Reads a whole scene.
fn read(text: &str, file_name: &str) -> Checked<Scene> {
    let document = parsed(text)?;
    let root = Table::root(text, document.as_table());
    root.only(&KEYS)?;
    let identifier = names::identifier(file_name);
    let (mut model, scope) = oscillator::read(&root.require("model")?.table()?, &identifier)?;
    let table = |key: &str| root.field(key).map(|field| field.table()).transpose();
    let tables = |key: &str| {
        root.field(key)
            .map_or(Ok(Vec::new()), |field| field.tables())
    };
    let grazing_table = root.require("grazing")?.table()?;
    let grazing = grazing::read(&grazing_table, &model)?;
    let warnings = usage::check(&grazing_table, &model, &grazing)?;
    let expansion = expansion::read(table("expansion")?.as_ref(), &model, &grazing)?;
    let (section, section_rule) =
        section::read(table("section")?.as_ref(), &model, expansion.orders)?;
    let window = window::read(table("window")?.as_ref(), &model)?;
    let emit = emit::read(table("emit")?.as_ref(), expansion.orders)?;
    let mut diagrams = Vec::new();
    for table in tables("diagram")? {
        diagrams.push(diagram::read(&table, &mut model, &scope)?);
    }
    let mut charts = Vec::new();
    for table in tables("chart")? {
        charts.push(diagram::read_chart(&table, &model)?);
    }
    Ok(Scene {
        identifier,
        text: text.into(),
        digest: Digest::of(text),
        model,
        grazing,
        section,
        section_rule,
        expansion,
        window,
        emit,
        diagrams,
        charts,
        warnings,
    })
}
