//! The values behind the handles, and their operations.

use std::sync::OnceLock;

use grazemap::analysis::{NoProgress, Precision, Using};
use grazemap::model::catalogue;
use grazemap::pipeline::Points;
use grazemap::prelude::FindGraze;
use grazemap::report::{self, Alignment, diagram_rows};

use crate::border::{
    GRAZEMAP_CATALOGUE, GRAZEMAP_DIRECT, GRAZEMAP_GUARDED, GRAZEMAP_MAP, GRAZEMAP_PATH,
    GRAZEMAP_TEXT,
};
use crate::failure::Failure;

/// A request to end calls, from any thread.
#[derive(Clone, Debug, Default)]
pub struct Interruption(pub(crate) grazemap::interruption::Interruption);

/// A scene: an oscillator, its stops, and the requested results.
#[derive(Debug)]
pub struct Scene(grazemap::Scene);

impl Scene {
    /// Loads a scene from a file, a text, or the catalogue.
    pub(crate) fn load(source: i32, text: &str) -> Result<Self, Failure> {
        let scene = match source {
            GRAZEMAP_PATH => grazemap::Scene::load(text),
            GRAZEMAP_TEXT => grazemap::Scene::parse(text, "scene.toml"),
            GRAZEMAP_CATALOGUE => {
                let unknown = || {
                    let names: Vec<_> = catalogue::names().collect();
                    let names = names.join(", ");
                    Failure::Call(format!("no scene `{text}` in the catalogue: {names}"))
                };
                let source = catalogue::text(text).ok_or_else(unknown)?;
                grazemap::Scene::parse(source, &format!("{text}.toml"))
            }
            other => {
                let words =
                    format!("`source` is GRAZEMAP_PATH, _TEXT or _CATALOGUE, found {other}");
                return Err(Failure::Call(words));
            }
        };
        Ok(Self(scene?))
    }

    pub(crate) fn graze(&self) -> Result<Graze, Failure> {
        Ok(Graze(self.0.clone().graze()?))
    }
}

/// A scene with its grazing orbit.
#[derive(Debug)]
pub struct Graze(grazemap::Graze);

impl Graze {
    pub(crate) fn parameter(&self, name: &str) -> Result<f64, Failure> {
        Ok(self.0.parameter(name)?)
    }

    pub(crate) fn map(&self) -> Result<Map, Failure> {
        Ok(Map(self.0.map()?))
    }
}

/// The local map near a grazing orbit.
#[derive(Debug)]
pub struct Map(grazemap::Map);

/// States, row by row; parameters, one row for all states or one for each.
pub(crate) type Rows<'a> = (&'a [f64], &'a [f64]);

impl Map {
    pub(crate) fn load(path: &str) -> Result<Self, Failure> {
        Ok(Self(grazemap::Map::load(path)?))
    }

    /// Numbers of coordinates, parameters and passages.
    pub(crate) fn sizes(&self) -> [usize; 3] {
        let local = self.0.local();
        [local.dimension(), local.parameters.len(), local.passages()]
    }

    pub(crate) fn step(&self, (states, parameters): Rows<'_>) -> Result<Vec<f64>, Failure> {
        let batch = self.0.batch(states, parameters, false)?;
        let rows = batch.rows.chunks_exact(batch.width);
        let [dimension, ..] = self.sizes();
        Ok(rows.flat_map(|row| &row[..dimension]).copied().collect())
    }

    pub(crate) fn jacobian(&self, (states, parameters): Rows<'_>) -> Result<Vec<f64>, Failure> {
        let batch = self.0.batch(states, parameters, true)?;
        let rows = batch.rows.chunks_exact(batch.width);
        let [dimension, _, passages] = self.sizes();
        Ok(rows.flat_map(|row| &row[dimension + passages..]).copied().collect())
    }

    pub(crate) fn inside(&self, (states, parameters): Rows<'_>) -> Result<Vec<u8>, Failure> {
        Ok(self.0.inside(states, parameters)?.into_iter().map(u8::from).collect())
    }

    pub(crate) fn iterate(
        &self,
        method: i32,
        (states, parameters): Rows<'_>,
        iterations: usize,
    ) -> Result<Vec<f64>, Failure> {
        let using = match method {
            GRAZEMAP_MAP => Using::Map,
            GRAZEMAP_GUARDED => Using::Guarded,
            GRAZEMAP_DIRECT => Using::Direct,
            other => {
                let words = format!("`method` is GRAZEMAP_MAP, _GUARDED or _DIRECT, found {other}");
                return Err(Failure::Call(words));
            }
        };
        let points = Points { states: states.to_vec(), parameters: parameters.to_vec() };
        Ok(self.0.point_orbits(points, iterations, (using, Precision::F64), &NoProgress)?)
    }

    /// Diagrams of the tables `[[diagram]]` in the text, or those of the scene if the text is
    /// blank.
    pub(crate) fn diagram(&self, tables: &str) -> Result<Table, Failure> {
        let asked = match tables.trim().is_empty() {
            true => self.0.clone(),
            false => self.0.asking(tables)?,
        };
        if asked.scene().diagrams.is_empty() {
            let words = "the scene asks for no diagram: give a table `[[diagram]]`";
            return Err(Failure::Call(words.to_owned()));
        }
        let diagrams = asked.diagrams(&NoProgress)?;
        let table = diagram_rows(&diagrams).into_table();
        Ok(Table { table, csv: OnceLock::new() })
    }
}

/// A table: columns of numbers or words.
#[derive(Debug)]
pub struct Table {
    table: report::Table,
    csv: OnceLock<String>,
}

impl Table {
    /// Numbers of rows and columns.
    pub(crate) fn size(&self) -> (usize, usize) {
        (self.table.rows().len(), self.table.columns().len())
    }

    /// Column of numbers, NaN if a value is unknown.
    pub(crate) fn column(&self, name: &str) -> Result<Vec<f64>, Failure> {
        let mut columns = self.table.columns().iter();
        let place = columns.position(|column| column.header == name);
        let place = place.ok_or_else(|| {
            let names = self.table.columns().iter().map(|column| &*column.header);
            let names = names.collect::<Vec<_>>().join(", ");
            Failure::Call(format!("no column `{name}` in the table: {names}"))
        })?;
        if self.table.columns()[place].alignment == Alignment::Left {
            let words = format!("column `{name}` holds words: they are in the CSV text");
            return Err(Failure::Call(words));
        }
        Ok(self.table.rows().iter().map(|row| row[place].value()).collect())
    }

    /// The table as CSV text.
    pub(crate) fn csv(&self) -> Result<&str, Failure> {
        if let Some(csv) = self.csv.get() {
            return Ok(csv);
        }
        let csv = self.table.to_csv().map_err(grazemap::Error::from)?;
        Ok(self.csv.get_or_init(|| csv))
    }
}
