//! Documents and files of diagrams, charts and basins, and the keys of `basin`.

use serde::{Deserialize, Serialize};

use super::keys::{ActiveParameters, COORDINATES, KeyError, named_offsets, place_of};
#[cfg(feature = "cli")]
use super::options::{CELLS, METHODS, one_of, positions, ranges};
use super::positions::{Counting, Ends, Origin, Position};
use super::{Error, Map};
use crate::analysis::basin::{Basin, BasinRequest};
use crate::analysis::chart::Chart;
use crate::analysis::diagram::Diagram;
use crate::convergence::MeasuredWindow;
use crate::expansion::WindowEdge;
use crate::iteration::parallel;
use crate::model::Method;
use crate::report::{
    DocumentKind, Figure, Named, OutputFolder, SectionDocument, basin_array, basin_figure,
    basin_rows, chart_array, chart_figure, chart_rows, diagram_array, diagram_figures,
    diagram_rows, manifold_rows, pictures, write_json,
};

/// JSON document of results computed with a map.
#[derive(Serialize)]
pub struct ByMap<'a, T> {
    document: DocumentKind,
    format: u32,
    #[serde(flatten)]
    content: &'a T,
    /// Measured window of the map.
    window: &'a MeasuredWindow,
    /// Share that truncation omits at the edge of the window, one per passage.
    window_edges: &'a [WindowEdge],
    /// Section of the map.
    section: SectionDocument,
}

impl<'a, T> ByMap<'a, T> {
    /// Documents of several results computed with one map.
    fn each(document: DocumentKind, contents: &'a [T], map: &'a Map) -> Vec<Self> {
        contents.iter().map(|content| Self::new(document, content, map)).collect()
    }

    fn new(document: DocumentKind, content: &'a T, map: &'a Map) -> Self {
        Self {
            document,
            format: DocumentKind::FORMAT,
            content,
            window: map.window(),
            window_edges: map.window_edges(),
            section: map.section(),
        }
    }
}

impl Map {
    /// Documents of diagrams computed with the map.
    pub fn diagram_documents<'a>(&'a self, diagrams: &'a [Diagram]) -> Vec<ByMap<'a, Diagram>> {
        ByMap::each(DocumentKind::Diagram, diagrams, self)
    }

    /// Documents of charts computed with the map.
    pub fn chart_documents<'a>(&'a self, charts: &'a [Chart]) -> Vec<ByMap<'a, Chart>> {
        ByMap::each(DocumentKind::Chart, charts, self)
    }

    /// Document of a basin computed with the map.
    pub fn basin_document<'a>(&'a self, basin: &'a Basin) -> ByMap<'a, Basin> {
        ByMap::new(DocumentKind::Basin, basin, self)
    }

    /// Writes data and pictures of diagrams, without measured times. Returns remarks on the
    /// pictures.
    ///
    /// # Errors
    ///
    /// [`Error::Report`] if a file cannot be written.
    pub fn write_diagrams(
        &self,
        folder: &OutputFolder,
        diagrams: &[Diagram],
    ) -> Result<Vec<String>, Error> {
        let documents = self.diagram_documents(diagrams);
        let stems = || diagrams.iter().zip(stems("diagram", diagrams.len()));
        let data = || {
            folder.write_streamed("diagram.json", |out| write_json(out, &documents))?;
            folder.write_streamed("diagram.csv", |out| diagram_rows(diagrams).write_csv(out))?;
            stems().try_for_each(|(diagram, stem)| {
                Ok(folder.write(&format!("{stem}.npy"), diagram_array(diagram)?).map(drop)?)
            })
        };
        let figures = stems().flat_map(|(diagram, stem)| {
            let named = move |(end, figure)| (format!("{stem}{end}"), figure);
            diagram_figures(diagram).into_iter().map(named)
        });
        write_both(folder, data, figures.collect())
    }

    /// Writes data and pictures of charts, without measured times. Returns remarks on the pictures.
    ///
    /// # Errors
    ///
    /// [`Error::Report`] if a file cannot be written.
    pub fn write_charts(
        &self,
        folder: &OutputFolder,
        charts: &[Chart],
    ) -> Result<Vec<String>, Error> {
        let documents = self.chart_documents(charts);
        let stems = || charts.iter().zip(stems("chart", charts.len()));
        let data = || {
            folder.write_streamed("chart.json", |out| write_json(out, &documents))?;
            folder.write_streamed("chart.csv", |out| chart_rows(charts).write_csv(out))?;
            stems().try_for_each(|(chart, stem)| {
                Ok(folder.write(&format!("{stem}.npy"), chart_array(chart)?).map(drop)?)
            })
        };
        let figures = stems().map(|(chart, stem)| (stem, chart_figure(chart)));
        write_both(folder, data, figures.collect())
    }

    /// Writes data and pictures of basins, without measured times. Returns remarks on the pictures.
    ///
    /// # Errors
    ///
    /// [`Error::Report`] if a file cannot be written.
    pub fn write_basins(
        &self,
        folder: &OutputFolder,
        basins: &[Basin],
    ) -> Result<Vec<String>, Error> {
        let named = |name| basins.iter().zip(stems(name, basins.len()));
        let data = || {
            for (basin, stem) in named("basin") {
                let (rows, document) = (basin_rows(basin), self.basin_document(basin));
                folder.write_streamed(&format!("{stem}.json"), |out| write_json(out, &document))?;
                folder.write_streamed(&format!("{stem}.csv"), |out| rows.write_csv(out))?;
                folder.write(&format!("{stem}.npy"), basin_array(basin)?)?;
            }
            for (basin, stem) in named("manifolds") {
                if let Some(manifolds) = &basin.manifolds {
                    let rows = manifold_rows(basin, manifolds);
                    folder.write_streamed(&format!("{stem}.csv"), |out| rows.write_csv(out))?;
                }
            }
            Ok(())
        };
        let figures = named("basin").map(|(basin, stem)| (stem, basin_figure(basin)));
        write_both(folder, data, figures.collect())
    }
}

/// Writes data, and figures by file name, in parallel. Returns remarks on the figures.
fn write_both(
    folder: &OutputFolder,
    data: impl FnOnce() -> Result<(), Error> + Send,
    figures: Vec<(String, Figure)>,
) -> Result<Vec<String>, Error> {
    let drawn = || {
        let named = figures.iter().map(|(stem, figure)| (&**stem, figure));
        let (files, remarks) = pictures(named, folder.pictures());
        folder.write_all(files).map(|()| remarks)
    };
    let (data, drawn) = parallel::join(data, drawn);
    data?;
    Ok(drawn?)
}

/// File names of `count` results, without extension.
fn stems(name: &str, count: usize) -> impl Iterator<Item = String> {
    (1..=count).map(move |number| match count {
        1 => name.to_owned(),
        _ => format!("{name}-{number}"),
    })
}

/// Keys of `basin`, instead of a table of the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct BasinKeys {
    /// Offsets of active parameters from the graze (0 if not named).
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "NAME=OFFSET,...",
            value_parser = positions,
            default_value = ""
        )
    )]
    pub at: Named<Position>,
    /// Whether all numbers of parameters and coordinates are values.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub values: Counting,
    /// Section coordinates that span the plane, the horizontal one first. Default: the first two.
    #[cfg_attr(
        feature = "cli",
        arg(long = "plane", alias = "axes", value_name = "A,B", value_delimiter = ',')
    )]
    pub axes: Vec<String>,
    /// First and last offset along an axis. Default: the window of the map.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "NAME=FROM:TO,...",
            value_parser = ranges,
            default_value = ""
        )
    )]
    pub range: Named<Ends>,
    /// Number of cells along both axes, or along each. Default: 400.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N[,M]",
            value_delimiter = ',',
            value_parser = clap::value_parser!(u32).range(1..=10_000)
        )
    )]
    pub points: Vec<u32>,
    /// Cells that are computed: `all`, or `borders` (those along borders and probes of the blocks
    /// between; the others are filled). Default: borders.
    #[cfg_attr(feature = "cli", arg(long = "cells", value_name = "CELLS", value_parser = one_of(CELLS)))]
    pub every_cell: Option<bool>,
    /// Offsets of the other section coordinates (0 if not named).
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "NAME=OFFSET,...",
            value_parser = positions,
            default_value = ""
        )
    )]
    pub start: Named<Position>,
    /// Method that iterates the states. Default: guarded.
    #[cfg_attr(
        feature = "cli",
        arg(long = "method", value_name = "METHOD", alias = "with", value_parser = one_of(METHODS))
    )]
    pub with: Option<Method>,
    /// Also compute stable and unstable manifolds of saddles of up to N returns, as curves; needs a
    /// section of two coordinates.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            num_args = 0..=1,
            default_missing_value = "2",
            value_parser = clap::value_parser!(u8).range(1..=12)
        )
    )]
    pub manifolds: Option<u8>,
}

impl BasinKeys {
    /// Whether the keys ask for a basin of their own, in the place of the scene's.
    pub fn name_any(&self) -> bool {
        let values = self.values;
        *self != Self { values, ..Self::default() }
    }

    /// Request with numbers in place of names.
    ///
    /// # Errors
    ///
    /// [`KeyError`] for names and numbers that the map does not have.
    pub fn request(&self, map: &Map) -> Result<BasinRequest, KeyError> {
        let mut request = BasinRequest::over_the_window(map.local());
        let coordinates = &map.local().section.coordinates;
        let origin = Origin::new(map.settled().graze(), self.values);
        if !self.at.is_empty() {
            let at = origin.offsets(&self.at);
            request.parameters = ActiveParameters::of(map.scene(), map.local()).at(&at)?;
        }
        if !self.start.is_empty() {
            let start = origin.offsets(&self.start);
            request.origin = named_offsets("start", COORDINATES, &start, coordinates)?;
        }
        if let [first, second] = &self.axes[..] {
            let place = |name: &str| place_of("axes", COORDINATES, name, coordinates);
            request = request.over([place(first)?, place(second)?], map.local());
        } else if !self.axes.is_empty() {
            return Err(KeyError::NotTwoAxes { found: self.axes.len() });
        }
        let named =
            |place: usize| self.start.0.iter().any(|(name, _)| name.trim() == coordinates[place]);
        if let Some(place) = request.axes.into_iter().find(|&place| named(place)) {
            return Err(KeyError::Varies { key: "start", name: coordinates[place].clone() });
        }
        for (name, range) in &origin.ranges(&self.range).0 {
            let place = place_of("range", COORDINATES, name, coordinates)?;
            let axis = request.axes.iter().position(|&axis| axis == place);
            let axis = axis.ok_or_else(|| KeyError::NoAxis { name: name.clone() })?;
            let [from, to] = *range;
            if from >= to {
                return Err(KeyError::Decreasing { name: name.clone(), from, to });
            }
            request.ranges[axis] = *range;
        }
        match self.points[..] {
            [] => {}
            [both] => request.points = [both as usize; 2],
            [first, second] => request.points = [first as usize, second as usize],
            _ => return Err(KeyError::NotTwoAxes { found: self.points.len() }),
        }
        request.every_cell = self.every_cell.unwrap_or_default();
        request.method = self.with.unwrap_or(request.method);
        request.manifolds = self.manifolds.map(usize::from);
        Ok(request)
    }
}
