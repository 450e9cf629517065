//! Scenes and grazing orbits.

use std::path::PathBuf;

use grazemap::model;
use grazemap::pipeline::{BranchPlace, Source};
use grazemap::prelude::*;
use grazemap::report::GrazeStudy;
use pyo3::prelude::*;

use crate::background::compute;
use crate::error::exception;
use crate::map;

/// Overrides of a scene: keys and TOML values.
type Overrides = Vec<(String, String)>;

/// Names of the scenes of the catalogue.
#[pyfunction]
pub(crate) fn catalogue() -> Vec<&'static str> {
    model::catalogue::names().collect()
}

/// Scene.
#[pyclass(frozen, module = "grazemap._lib")]
pub(crate) struct Scene(pub(crate) grazemap::Scene);

#[pymethods]
impl Scene {
    /// Reads a scene file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, overrides: Overrides) -> PyResult<Self> {
        let scene = grazemap::Scene::load_with(&path, &overrides);
        scene.map(Self).map_err(|error| exception(py, &error.into()))
    }

    /// Parses the text of a scene. `name` is its name in messages.
    #[staticmethod]
    fn parse(py: Python<'_>, text: &str, name: &str, overrides: Overrides) -> PyResult<Self> {
        let scene = grazemap::Scene::parse_with(text, name, &overrides);
        scene.map(Self).map_err(|error| exception(py, &error.into()))
    }

    /// Text of a scene of the catalogue; `None` for an unknown name.
    #[staticmethod]
    fn catalogue_text(name: &str) -> Option<&'static str> {
        model::catalogue::text(name)
    }

    #[getter]
    fn text(&self) -> &str {
        &self.0.text
    }

    #[getter]
    fn file_name(&self) -> &str {
        &self.0.file_name
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.identifier
    }

    #[getter]
    fn digest(&self) -> String {
        self.0.digest.to_string()
    }

    #[getter]
    fn states(&self) -> Vec<String> {
        self.0.model.full_state_names().into_iter().map(str::to_owned).collect()
    }

    /// Names and values of the parameters.
    #[getter]
    fn parameters(&self) -> Vec<(String, f64)> {
        let parameters = self.0.model.parameters.iter();
        parameters.map(|parameter| (parameter.name.clone(), parameter.value.to_f64())).collect()
    }

    /// Names of the parameters that maps keep as variables.
    #[getter]
    fn active(&self) -> Vec<String> {
        let active = self.0.expansion.active.iter();
        active.map(|&parameter| self.0.model.parameters[parameter].name.clone()).collect()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.iter().map(ToString::to_string).collect()
    }

    /// Finds the grazing orbit.
    fn graze(&self, py: Python<'_>) -> PyResult<Graze> {
        let scene = self.0.clone();
        compute(py, None, move |_| scene.graze()).map(Graze)
    }

    /// Scene whose grazing orbit is that of a special point of a branch document.
    fn at_graze(
        &self,
        py: Python<'_>,
        document: String,
        name: PathBuf,
        number: usize,
    ) -> PyResult<Self> {
        let source = Source::Scene(Box::new(self.0.clone()));
        let place = BranchPlace { path: name, number };
        let search = compute(py, None, move |_| source.at_graze_of(&document, &place))?;
        Ok(Self(search.scene))
    }
}

/// Scene with its grazing orbit.
#[pyclass(frozen, module = "grazemap._lib")]
pub(crate) struct Graze(pub(crate) grazemap::Graze);

#[pymethods]
impl Graze {
    /// Reads an orbit from its JSON document.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str) -> PyResult<Self> {
        grazemap::Graze::from_json(text).map(Self).map_err(|error| exception(py, &error))
    }

    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        self.0.to_json().map_err(|error| exception(py, &error))
    }

    #[getter]
    fn scene(&self) -> Scene {
        Scene(self.0.scene().clone())
    }

    /// Prediction of theory for the graze, as sentences.
    fn verdict(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let graze = self.0.clone();
        let theory = compute(py, None, move |_| graze.theory())?;
        Ok(GrazeStudy { theory, measured: Vec::new() }.words())
    }

    /// Expands the local map.
    fn map(&self, py: Python<'_>) -> PyResult<map::Map> {
        let graze = self.0.clone();
        compute(py, None, move |_| graze.map()).map(map::Map)
    }
}
